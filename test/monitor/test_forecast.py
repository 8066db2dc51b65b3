"""Remaining life: closed forms, what widens it, what it refuses to say."""

import json
import math
import statistics

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leg_wear_monitor import ConfigError
from leg_wear_monitor.monitor.belief import Look, believe
from leg_wear_monitor.monitor.forecast import Answer, JointNow, LifeShape, forecast_joint, life_shapes
from leg_wear_monitor.monitor.forecast_config import Forecasting

pytestmark = pytest.mark.plain

SETTINGS = Forecasting()
SURE = Forecasting(load_sigma=0.0, model_sigma=0.0, clearance_sigma_m=1e-12, duty_sigma=0.0)
NOW = JointNow(
    fresh_m=3e-4, wear_m=0.0, limit_m=6e-4, growth_m=1.5e-11, growth_error_m=0.0, cycle_s=1.0, valid=True
)
Z = statistics.NormalDist().inv_cdf(0.9)


def forecast(now=NOW, settings=SETTINGS, looks=(), shape=None):
    return forecast_joint(now, believe(settings, now.fresh_m, looks), settings, shape)


def test_with_the_coefficient_alone_unknown_life_is_lognormal():
    told = forecast(settings=SURE)
    assert told.answer is Answer.KNOWN
    assert told.cycles.p50 == pytest.approx(2e7, rel=0.01)
    spread = math.exp(Z * SURE.wear_coefficient_sigma)
    assert told.cycles.p90 / told.cycles.p50 == pytest.approx(spread, rel=0.02)
    assert told.cycles.p50 / told.cycles.p10 == pytest.approx(spread, rel=0.02)
    assert told.hours.p50 == pytest.approx(told.cycles.p50 / 3600.0)
    assert told.days.p50 == pytest.approx(told.hours.p50 / 8.0)


def test_what_is_not_known_adds_up_in_squares():
    load = attrs.evolve(SURE, load_sigma=0.5)
    noisy = attrs.evolve(NOW, growth_error_m=0.3 * NOW.growth_m)
    told = forecast(noisy, load)
    both = math.sqrt(0.7**2 + 0.5**2 + 0.3**2)
    assert math.log(told.cycles.p90 / told.cycles.p10) == pytest.approx(2.0 * Z * both, rel=0.03)


@given(st.floats(0.1, 10.0))
def test_all_wear_faster_by_a_factor_is_life_shorter_by_it(factor):
    fast = attrs.evolve(NOW, growth_m=factor * NOW.growth_m)
    assert forecast(fast).cycles.p10 == pytest.approx(forecast().cycles.p10 / factor, rel=1e-9)


def test_a_measurement_narrows_and_moves_the_forecast():
    now = attrs.evolve(NOW, wear_m=6e-5)
    before = forecast(now)
    after = forecast(now, looks=[Look(3e-4 + 1.5 * 6e-5, 5e-6, 6e-5)])
    assert after.cycles.p50 < 0.75 * before.cycles.p50
    assert (
        math.log(after.cycles.p90 / after.cycles.p10) < math.log(before.cycles.p90 / before.cycles.p10) / 3.0
    )
    assert after.clearance_m.p90 - after.clearance_m.p10 < 0.2 * (
        before.clearance_m.p90 - before.clearance_m.p10
    )
    assert after.measurements == 1


@pytest.mark.parametrize(
    ("changes", "answer"),
    [
        ({"growth_m": None}, Answer.NOT_ENOUGH_DATA),
        ({"growth_m": 0.0}, Answer.NO_GROWTH),
        ({"valid": False}, Answer.OUTSIDE_VALIDITY),
        ({"valid": False, "growth_m": None}, Answer.OUTSIDE_VALIDITY),
    ],
)
def test_what_cannot_be_known_is_said(changes, answer):
    told = forecast(attrs.evolve(NOW, **changes))
    assert (told.answer, told.cycles, told.hours, told.days) == (answer, None, None, None)


def test_at_the_limit_nothing_remains_whatever_else():
    told = forecast(attrs.evolve(NOW, wear_m=3.1e-4, valid=False, growth_m=None))
    assert told.answer is Answer.AT_LIMIT
    assert attrs.astuple(told.cycles) == (0.0, 0.0, 0.0)


def test_a_life_of_constant_growth_changes_nothing():
    clearance = np.linspace(3e-4, 6e-4, 7)
    shape = LifeShape(clearance, (clearance - 3e-4) / 2e-11)
    assert attrs.astuple(forecast(shape=shape).cycles) == pytest.approx(attrs.astuple(forecast().cycles))


def test_growth_that_doubles_halfway_shortens_life_by_a_quarter():
    clearance = np.array([3e-4, 3.5e-4, 4e-4, 4.5e-4, 5e-4, 5.5e-4, 6e-4])
    shape = LifeShape(clearance, np.cumsum([0.0, 5.0, 5.0, 5.0, 2.5, 2.5, 2.5]))
    told, held = forecast(settings=SURE, shape=shape), forecast(settings=SURE)
    assert told.cycles.p50 == pytest.approx(0.75 * held.cycles.p50)


def life_file(tmp_path, **changes):
    life = {"cycles": [0, 1, 2, 3], "joints": {"A": {"clearance_m": [3e-4, 3.1e-4, 3.2e-4, 3.3e-4]}}}
    path = tmp_path / "life.json"
    path.write_text(json.dumps(life | changes))
    return str(path)


def test_a_life_is_read_from_its_file(tmp_path):
    (shape,) = life_shapes(life_file(tmp_path), ("A",))
    assert shape.growth(3.05e-4) == pytest.approx(1e-5)
    assert shape.cycles_at(np.array([3.5e-4])) == pytest.approx([5.0])
    assert life_shapes("", ("A", "B")) == (None, None)


def test_a_life_that_cannot_be_used_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="cannot be read"):
        life_shapes(str(tmp_path / "none.json"), ("A",))
    with pytest.raises(ConfigError, match="no life of the joints A, B"):
        life_shapes(life_file(tmp_path), ("A", "B"))
    with pytest.raises(ConfigError, match="no life"):
        life_shapes(life_file(tmp_path, cycles=[0, 1]), ("A",))

"""Remaining life of joints and leg: closed forms, what widens it, what it refuses to say."""

import math
import statistics

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leg_wear_monitor.mechanism.materials import USUAL_SPREAD
from leg_wear_monitor.monitor.config.settings import Forecasting
from leg_wear_monitor.monitor.forecast.forecast import Answer, JointCondition, forecast
from leg_wear_monitor.monitor.forecast.growth import GrowthLaw, no_law
from leg_wear_monitor.monitor.forecast.wear_coefficients import ClearanceAtWear, estimate_coefficient

SETTINGS = Forecasting(model_sigma=0.05)
SURE = Forecasting(load_sigma=0.0, model_sigma=0.0, new_clearance_sigma=1e-6, duty_sigma=0.0)
NOW = JointCondition(joint="A", fresh_m=3e-4, wear_m=0.0, limit_m=6e-4, growth_m=1.5e-11, growth_error_m=0.0)
B = attrs.evolve(NOW, joint="B", growth_m=5e-12)
Z = statistics.NormalDist().inv_cdf(0.9)


def whole(joints, settings=SETTINGS, observations=(), law=None, valid=True):
    """Forecast of joints; ``observations`` (joint's number, ClearanceAtWear)."""
    fresh = np.array([each.fresh_m for each in joints])
    own = [[observation for at, observation in observations if at == k] for k in range(len(joints))]
    coefficient_estimates = [
        estimate_coefficient(settings, each.fresh_m, o) for each, o in zip(joints, own, strict=True)
    ]
    law = law or no_law(fresh, settings.model_sigma)
    return forecast(joints, coefficient_estimates, settings, law, cycle_s=1.0, valid=valid)


def alone(now=NOW, settings=SETTINGS, observations=(), **more):
    return whole([now], settings, [(0, observation) for observation in observations], **more).joints[0]


def test_with_the_coefficient_alone_unknown_life_is_lognormal():
    result = alone(settings=SURE)
    assert result.answer is Answer.KNOWN
    assert result.cycles.p50 == pytest.approx(2e7, rel=0.01)
    spread = math.exp(Z * USUAL_SPREAD)
    assert result.cycles.p90 / result.cycles.p50 == pytest.approx(spread, rel=0.02)
    assert result.cycles.p50 / result.cycles.p10 == pytest.approx(spread, rel=0.02)
    assert result.hours.p50 == pytest.approx(result.cycles.p50 / 3600.0)
    assert result.days.p50 == pytest.approx(result.hours.p50 / 8.0)


def test_what_is_not_known_adds_up_in_squares():
    load = attrs.evolve(SURE, load_sigma=0.5)
    noisy = attrs.evolve(NOW, growth_error_m=0.3 * NOW.growth_m)
    result = alone(noisy, load)
    both = math.sqrt(0.7**2 + 0.5**2 + 0.3**2)
    assert math.log(result.cycles.p90 / result.cycles.p10) == pytest.approx(2.0 * Z * both, rel=0.03)


def test_lives_that_end_early_leave_the_rest_of_the_way_unknown():
    """Lives to 0.31 mm say nothing of 0.6 mm: p10 to p90 are as wide as without lives."""
    now = np.array([NOW.fresh_m])
    sure = attrs.evolve(SURE, model_sigma=0.4)
    law = GrowthLaw(np.zeros((1, 1)), now, np.array([3.1e-4]), np.array([0.01]), lives=5)
    found, without = (alone(settings=sure, law=one).cycles for one in (law, no_law(now, 0.4)))
    assert np.log(found.p90 / found.p10) == pytest.approx(np.log(without.p90 / without.p10), rel=0.06)


@given(st.floats(0.1, 10.0))
def test_all_wear_faster_by_a_factor_is_life_shorter_by_it(factor):
    fast = attrs.evolve(NOW, growth_m=factor * NOW.growth_m)
    assert alone(fast).cycles.p10 == pytest.approx(alone().cycles.p10 / factor, rel=1e-9)


def test_a_measurement_narrows_and_moves_the_forecast():
    """The part was measured when it was new: else the error of its fit is in the first measurement."""
    now = attrs.evolve(NOW, wear_m=6e-5)
    before = alone(now)
    when_new = ClearanceAtWear(3e-4, 5e-6, 0.0)
    after = alone(now, observations=[when_new, ClearanceAtWear(3e-4 + 1.5 * 6e-5, 5e-6, 6e-5)])
    assert after.cycles.p50 < 0.75 * before.cycles.p50
    lives = [math.log(one.cycles.p90 / one.cycles.p10) for one in (before, after)]
    assert lives[1] < lives[0] / 3.0
    widths_m = [one.clearance_m.p90 - one.clearance_m.p10 for one in (before, after)]
    assert widths_m[1] < 0.2 * widths_m[0]
    assert after.measurements == 2


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
    valid = changes.pop("valid", True)
    result = whole([attrs.evolve(NOW, **changes)], valid=valid)
    for each in (result.joints[0], result.leg):
        assert (each.answer, each.cycles, each.hours, each.days) == (answer, None, None, None)
    assert (result.leg.first, result.leg.first_probability) == (None, {})


def test_at_the_limit_nothing_remains_whatever_else():
    result = whole([B, attrs.evolve(NOW, wear_m=3.1e-4, growth_m=None)], valid=False)
    for each in (result.joints[1], result.leg):
        assert each.answer is Answer.AT_LIMIT
        assert attrs.astuple(each.cycles) == (0.0, 0.0, 0.0)
    assert result.joints[0].answer is Answer.OUTSIDE_VALIDITY
    assert result.leg.first_probability == {"B": 0.0, "A": 1.0}


def test_a_leg_of_one_joint_lasts_as_long_as_it():
    result = whole([NOW])
    assert result.leg.cycles == result.joints[0].cycles
    assert result.leg.days == result.joints[0].days
    assert (result.leg.first, result.leg.first_probability) == ("A", {"A": 1.0})


def test_a_leg_ends_with_the_first_of_two_lognormal_lives():
    """The smaller of two; the probability that it is A's is that of a difference of normals."""
    result = whole([NOW, B], SURE).leg
    gap = math.log(NOW.growth_m / B.growth_m) / (math.sqrt(2.0) * USUAL_SPREAD)
    assert result.first == "A"
    assert result.first_probability["A"] == pytest.approx(statistics.NormalDist().cdf(gap), abs=0.01)
    random = np.random.default_rng(0)
    lives = np.array([[2e7], [6e7]]) / np.exp(USUAL_SPREAD * random.standard_normal((2, 200_000)))
    expected = np.quantile(lives.min(axis=0), (0.1, 0.5, 0.9))
    np.testing.assert_allclose(attrs.astuple(result.cycles), expected, rtol=0.03)


def test_a_joint_without_a_growth_rate_leaves_the_leg_partly_known():
    result = whole([NOW, attrs.evolve(B, growth_m=None)])
    assert [each.answer for each in result.joints] == [Answer.KNOWN, Answer.NOT_ENOUGH_DATA]
    assert result.leg.answer is Answer.PARTLY_KNOWN
    assert result.leg.cycles == result.joints[0].cycles


def test_a_joint_without_a_growth_rate_does_not_end_the_leg_by_what_its_clearance_may_be():
    """Seen before: the leg was at its limit now with 10 %, of a joint that is said to be left out."""
    near = attrs.evolve(B, growth_m=None, wear_m=2.8e-4)
    unsure = attrs.evolve(SURE, new_clearance_sigma=2e-5 / 3e-4)
    result = whole([NOW, near], unsure)
    assert result.joints[1].clearance_m.p90 > near.limit_m
    assert (result.leg.answer, result.leg.cycles) == (Answer.PARTLY_KNOWN, result.joints[0].cycles)
    assert result.leg.first_probability == {"A": 1.0, "B": 0.0}


@pytest.mark.parametrize("wear_m", [0.0, 2.98e-4])
def test_a_joint_that_does_not_grow_never_ends_the_leg(wear_m):
    """Nor by a clearance that may be at its limit."""
    result = whole([NOW, attrs.evolve(B, growth_m=0.0, wear_m=wear_m)])
    assert (result.leg.answer, result.leg.cycles) == (Answer.KNOWN, result.joints[0].cycles)
    assert result.leg.first_probability == {"A": 1.0, "B": 0.0}


def test_a_day_has_24_hours():
    walking = attrs.evolve(SURE, duty_hours_per_day=24.0, duty_sigma=1.0)
    result = alone(settings=walking)
    assert result.days.p10 >= result.hours.p10 / 24.0
    assert result.days.p50 > result.hours.p50 / 24.0


@given(st.floats(-1.0, 1.0))
def test_a_measured_joint_tells_of_one_that_it_acts_upon(coupling):
    """A is half as much wider again than the twin has it, and stays so: half of that is in B's past."""
    law = GrowthLaw(np.array([[0.0, 0.0], [coupling, 0.0]]), np.full(2, 3e-4), np.full(2, 1e-3), np.zeros(2))
    worn = attrs.evolve(NOW, wear_m=1e-4, growth_m=0.0)
    result = whole([worn, B], SURE, [(0, ClearanceAtWear(4.5e-4, 1e-8, 1e-4))], law).joints[1].cycles
    expected = alone(B, SURE, law=no_law(np.array([3e-4]), 0.0)).cycles
    apart = math.log(4.5e-4 / 4e-4)
    assert math.log(expected.p50 / result.p50) == pytest.approx(0.5 * coupling * apart, abs=1e-3)

"""What no drive can do is named: biases, drifts, lags and crank offsets, by name."""

import math
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from leg_wear_monitor.estimate.cause import Cause, NamedCause
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.evaluation import AlarmBoard
from leg_wear_monitor.monitor.gait_evidence import (
    BIAS,
    COMMISSIONING_CYCLES,
    DRIFT,
    LAG,
    TorqueRecord,
    offset_error_rad,
    torque_bounds,
    torque_causes,
    torque_values,
)
from leg_wear_monitor.state import Level

pytestmark = pytest.mark.plain

SIZE_NM = 8.4
CONFIG = MonitorConfig()
BOUNDS = torque_bounds(CONFIG, SIZE_NM, CONFIG.drive_torque.max_lag_s)


def report(friction=0.0, lag=0.0, sigma=0.05, rpm=60.0):
    """A gait cycle's report, as far as it is of the torque."""
    return SimpleNamespace(
        torque_samples=200, friction_nm=friction, friction_sigma_nm=sigma, torque_lag_s=lag,
        torque_lag_sigma_s=1.0e-4, cadence_rpm=rpm,
    )  # fmt: skip


NEW = TorqueRecord()


def levels(said, record=NEW):
    """Levels of the torque's alarms after as many gait cycles as they need."""
    board = AlarmBoard(CONFIG, ("A",), SIZE_NM)
    for second in range(CONFIG.alarms.on_delay_cycles):
        board.evaluate(torque_values(said, record, BOUNDS), second)
    return {name: board.alarms[name].level for name in (BIAS, DRIFT, LAG) if board.alarms[name].level}


@pytest.mark.parametrize("friction", [0.0, 0.1, 1.0, 2.5])
def test_friction_is_no_bias(friction):
    assert levels(report(friction)) == {}


@pytest.mark.parametrize("friction", [-5.0, -1.5, 5.0, 20.0, 100.0])
def test_what_is_no_friction_is_a_bias(friction):
    assert levels(report(friction)) == {BIAS: Level.ERROR}
    cause = torque_causes({BIAS}, report(friction), TorqueRecord(), BOUNDS)[BIAS]
    beyond = friction if friction < 0.0 else friction - BOUNDS.max_friction_nm
    assert cause == NamedCause(Cause.BIAS, beyond, 0.05)


@given(st.floats(-50.0, 50.0), st.floats(0.01, 2.0))
def test_a_bias_is_told_only_beyond_its_own_scatter(friction, sigma):
    value = torque_values(report(friction, sigma=sigma), TorqueRecord(), BOUNDS)[BIAS]
    beyond = max(-friction, friction - BOUNDS.max_friction_nm, 0.0)
    assert value == pytest.approx(max(beyond - 3.0 * sigma, 0.0), abs=1e-12)


def test_friction_that_rises_after_commissioning_is_a_drift():
    record = TorqueRecord(friction_nm=0.4, sigma_nm=0.05)
    assert levels(report(0.5), record) == {}
    assert levels(report(2.4), record) == {DRIFT: Level.ERROR}
    assert levels(report(2.4)) == {}  # nothing to compare with yet


def test_the_first_sound_cycles_in_a_row_commission_and_the_ledger_keeps_them():
    record, cycle = TorqueRecord(), figures(0.0)
    for i in range(COMMISSIONING_CYCLES + 5):
        assert math.isnan(record.friction_nm)
        record = record.with_cycle(cycle, report(0.7), is_sound=i != 4)
    later = record.with_cycle(cycle, report(3.0), is_sound=True)
    assert record.friction_nm == later.friction_nm == 0.7
    assert TorqueRecord.of(later.totals) == TorqueRecord(0, 0.7, 0.05)


def figures(lag_s, rpm=60.0, sigma_s=2.0e-4):
    """A gait cycle whose torque comes late."""
    torque = SimpleNamespace(cycle_lag_s=lag_s, cycle_lag_sigma_s=sigma_s)
    return SimpleNamespace(torque=torque, moving_s=60.0 / rpm, direction=1)


def walked(lag_s, offset_rad, speeds):
    record = TorqueRecord()
    for rpm in speeds:
        lag = figures(lag_s + offset_rad / (rpm * math.pi / 30.0), rpm)
        record = record.with_cycle(lag, report(0.0), is_sound=False)
    return record


def test_a_crank_offset_at_one_speed_may_be_a_lag_and_is_reported_as_either():
    said, record = report(lag=0.05 / (2.0 * math.pi)), walked(0.0, 0.05, [60.0] * 50)
    assert levels(said, record) == {LAG: Level.ERROR}
    cause = torque_causes({LAG}, said, record, BOUNDS)[LAG]
    assert cause.cause is Cause.TIMING and cause.value == pytest.approx(-0.05)
    assert offset_error_rad(said, record) == pytest.approx(0.05)


@pytest.mark.parametrize(
    ("lag_s", "offset_rad", "named"), [(0.0, 0.05, Cause.CRANK_OFFSET), (0.009, 0.0, Cause.LAG)]
)
def test_where_the_speed_varies_a_lag_and_an_offset_are_told_apart(lag_s, offset_rad, named):
    record = walked(lag_s, offset_rad, [57.0, 60.0, 63.0] * 30)
    found_lag, found_offset = record.lag_and_offset
    assert found_lag.value == pytest.approx(lag_s, abs=1e-9)
    assert found_offset.value == pytest.approx(-offset_rad, abs=1e-9)
    assert 0.0 < found_lag.sigma < 0.001 and 0.0 < found_offset.sigma < 0.005
    cause = torque_causes({LAG}, report(lag=lag_s + 0.008), record, BOUNDS)[LAG]
    assert cause in (found_lag, found_offset) and cause.cause is named


def test_a_short_lag_is_a_sensors():
    assert levels(report(lag=0.003)) == {}


def test_without_a_torque_there_are_no_values():
    assert torque_values(SimpleNamespace(torque_samples=0), TorqueRecord(), BOUNDS) == {}

"""The table of alarms is what a board holds."""

from types import SimpleNamespace

import pytest

from leg_wear_monitor.monitor import alarm_specs
from leg_wear_monitor.monitor.config.parameters import config_from
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.evaluation import AlarmBoard, limits_of
from leg_wear_monitor.monitor.forecast.forecast import Quantiles
from leg_wear_monitor.state import Level

pytestmark = pytest.mark.plain

ENCODERS = {"encoders.names": ["knee"], "encoders.joints": ["G"]}
FOOT_LOAD = {"foot_load.source": "contact"}


def test_names_and_their_order_are_a_contract():
    joint = (
        "impact_force {}", "clearance {}", "growth {}", "remaining_life {}", "material_limit {}",
        "clearance_departure {}",
    )  # fmt: skip
    of_leg = (
        "torque_mismatch", "torque_bias", "torque_drift", "torque_lag", "cadence", "input_rate crank",
        "input_rate torque", "input_samples", "input_gaps", "input_torque", "input_sources",
    )  # fmt: skip
    expected = [*(name.format(each) for each in "AB" for name in joint), *of_leg]
    assert list(AlarmBoard(config_from(ENCODERS), ("A", "B")).alarms) == expected
    without = [name for name in expected if "departure" not in name]
    assert list(AlarmBoard(MonitorConfig(), ("A", "B")).alarms) == without
    of_load = (
        "input_rate foot_load", "input_gaps foot_load", "foot_load_stuck", "foot_load_zero",
        "foot_load_scale", "foot_load_exchanged", "foot_load_sign",
    )  # fmt: skip
    assert list(AlarmBoard(config_from(FOOT_LOAD), ("A", "B")).alarms) == [*without, *of_load]


def test_limits_follow_from_the_parameters():
    config = config_from({"limits.joint_clearance_m": [4.0e-4, 5.0e-4], "limits.min_rate_hz": 90.0})
    limits, warn, alarms = limits_of(config, ("A", "B"), 8.0), config.limits.warn_fraction, config.alarms
    assert (limits["clearance B"].warn, limits["clearance B"].error) == (warn * 5.0e-4, 5.0e-4)
    assert limits["impact_force B"].error == config.limits.impact_force_n
    assert limits["impact_force A"].on_delay == alarms.knock_on_delay_cycles
    assert limits["growth A"].on_delay == alarms.on_delay_cycles
    least = limits["input_rate crank"]
    assert (least.warn, least.error, least.is_least) == (90.0 / warn, 90.0, True)
    assert limits["torque_bias"].error == pytest.approx(0.1 * 8.0)
    sources = limits["input_sources"]
    assert (sources.warn, sources.error, sources.deadband, sources.on_delay) == (2.0, 2.0, 0.0, 1)


@pytest.mark.parametrize(
    ("values", "level"),
    [
        ((0.061, 0.087, 0.103, 0.045), Level.OK),  # a healthy leg at 45 rpm, once in 2500 gait cycles
        ((0.11, 0.12, 0.13), Level.ERROR),
        ((0.14,), Level.WARN),  # 1.75 times the limit of WARN
        ((0.16,), Level.ERROR),
    ],
)
def test_a_mismatch_lasts_or_is_far_beyond_its_limit(values, level) -> None:
    board = AlarmBoard(MonitorConfig(), ("A",))
    for stamp_ns, value in enumerate(values):
        board.evaluate({"torque_mismatch": value}, stamp_ns)
    assert board.alarms["torque_mismatch"].level is level


def test_the_limits_of_impact_forces_are_those_of_the_cadence() -> None:
    board = AlarmBoard(
        config_from({"limits.impact_force_n": 1000.0, "alarms.knock_on_delay_cycles": 1}), ("A",)
    )
    values = {"impact_force A": 1500.0, "torque_mismatch": 0.01}
    board.evaluate(values, 10**9, impact_factor=2.25)
    board.evaluate_early(values, 2 * 10**9, impact_factor=2.25)
    assert board.alarms["impact_force A"].level is Level.OK
    assert board.alarms["impact_force A"].limit == 2250.0
    assert board.alarms["torque_mismatch"].limit == 0.1
    board.evaluate_early(values, 3 * 10**9)
    assert board.alarms["impact_force A"].level is Level.ERROR


@pytest.mark.parametrize(
    ("hours", "level"),
    [((40.0, 80.0, 160.0), Level.ERROR), ((60.0, 120.0, 240.0), Level.WARN), (None, Level.OK)],
)
def test_a_life_that_may_be_short_raises_its_alarm_and_one_that_is_not_known_does_not(hours, level):
    config = config_from({"limits.remaining_life_h": 50.0})
    forecast = SimpleNamespace(hours=None if hours is None else Quantiles(*hours))
    value = alarm_specs.LIFE.value(SimpleNamespace(forecast=forecast))
    board = AlarmBoard(config, ("A",))
    for cycle in range(config.alarms.on_delay_cycles):
        board.evaluate({"remaining_life A": value}, 10**9 * (1 + cycle))
    assert board.alarms["remaining_life A"].level is level

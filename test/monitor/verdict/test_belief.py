"""The believed clearance: one number a joint, and the alarm that keeps what an estimate showed."""

import math

import attrs
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leg_wear_monitor.monitor.alarms import Alarm, Limit, acknowledged, evaluated, has_changed
from leg_wear_monitor.monitor.judgement import joint_clearance
from leg_wear_monitor.monitor.verdict.rules import findings
from leg_wear_monitor.monitor.verdict.situation import (
    JointSituation,
    KnownClearance,
    Situation,
    alarm_value,
    at_limit_by_estimate,
    believed,
    is_observed,
)
from leg_wear_monitor.monitor.verdict.verdict import verdict_of
from leg_wear_monitor.state import Level, State

LIMIT_M = 6.0e-4
LIMIT = Limit(0.8 * LIMIT_M, LIMIT_M, 0.05, 3)
COUNTED = JointSituation(joint="G", counted_m=3.0e-4, limit_m=LIMIT_M, label="knee")
NEW = Alarm(kind="clearance", subject="G", unit="m")
BROKEN = KnownClearance("torque", 2.05e-3, 0.65e-3)
RETURNED = KnownClearance("torque", 3.2e-4, 2.0e-5)


def after(alarm: Alarm, *seen: KnownClearance, joint: JointSituation = COUNTED) -> Alarm:
    """The alarm after a period in which the torque or encoders show something."""
    known = alarm_value(attrs.evolve(joint, seen=seen), alarm)
    if known is None:
        return alarm
    return evaluated(alarm, known.clearance_m, LIMIT, 1, 3, known.sigma_m, known.by)


def verdict(alarm: Alarm, *seen: KnownClearance, joint: JointSituation = COUNTED):
    joints = (attrs.evolve(joint, seen=seen),)
    return verdict_of(findings(Situation(joints=joints, alarms=(alarm,))))


def test_a_stop_stays_while_the_estimate_comes_and_goes() -> None:
    """A break-out went stop, inspect, stop, inspect, stop: 2.05, 1.43, 2.1 mm, and unsure ones between."""
    alarm, states = NEW, []
    unsure, again = KnownClearance("torque", 1.43e-3, 0.6e-3), KnownClearance("torque", 2.1e-3, 0.2e-3)
    for shown in ((BROKEN,), (), (unsure,), (), (again,)):
        alarm = after(alarm, *shown)
        states.append(verdict(alarm, *shown).state)
    assert states == [State.STOP] * 5
    last = verdict(alarm)
    assert (last.fault_code, last.joints) == ("CLEARANCE_SEEN_G", ("G",))
    assert "the drive torque" in last.why and "2.1 mm ± 0.2 mm" in last.why


def test_what_the_alarm_keeps_is_what_was_known_when_the_estimate_was_last_sure() -> None:
    alarm = after(after(NEW, BROKEN), RETURNED)
    assert (alarm.level, alarm.present) == (Level.ERROR, Level.OK)
    assert (alarm.worst, alarm.sigma, alarm.cause) == (2.05e-3, 0.65e-3, "torque")
    now = acknowledged(alarm)
    assert (now.level, now.cause, math.isnan(now.worst), math.isnan(now.sigma)) == (Level.OK, "", True, True)
    assert verdict(now).state is State.HEALTHY


def test_only_what_shows_the_joint_below_its_limit_ends_what_is_acknowledged() -> None:
    """After a restart, the torque showed nothing yet: the leg was healthy for a second, and then to stop."""
    first, held = KnownClearance("torque", 5.5e-4, 5e-5, -math.inf), KnownClearance("torque", 5.5e-4, 5e-5)
    for shown in ((), (first,), (KnownClearance("encoders", 6.5e-4, 1.0e-4),)):
        alarm = after(acknowledged(after(NEW, BROKEN)), *shown)
        assert (alarm.level, alarm.acknowledged) == (Level.ERROR, True)
        found = verdict(alarm, *shown)
        assert found.state is State.STOP
        assert "acknowledged; not shown now" in found.why
        for back in (held, attrs.evolve(RETURNED, least_m=-math.inf)):
            assert verdict(after(alarm, back), back).state is State.HEALTHY


@pytest.mark.parametrize("by", ["torque", "encoders"])
def test_an_estimate_that_is_not_surely_beyond_raises_nothing(by: str) -> None:
    unsure = KnownClearance(by, 9.0e-4, 2.0e-4)  # 1.5 sigma
    assert after(NEW, unsure) is NEW
    assert verdict(NEW, unsure).state is State.HEALTHY


def test_an_estimate_that_did_not_hold_raises_nothing() -> None:
    first = attrs.evolve(BROKEN, least_m=-math.inf)
    assert after(NEW, first) is NEW
    assert verdict(NEW, first).state is State.HEALTHY


def test_a_measurement_that_contradicts_ends_the_stop_until_the_estimate_rises_anew() -> None:
    measured = attrs.evolve(COUNTED, measured=KnownClearance("measured", 3.1e-4, 1.0e-5))
    raised = after(NEW, BROKEN)
    assert verdict(raised, BROKEN, joint=measured).state is State.STOP  # measured long before
    overruled = acknowledged(raised)
    assert (overruled.level, overruled.acknowledged) == (Level.ERROR, True)
    assert verdict(overruled, BROKEN, joint=measured).state is not State.STOP
    again = after(overruled, BROKEN, joint=measured)
    assert again.acknowledged  # the same estimate, and a start of the monitor without any, change nothing
    assert after(again, joint=measured) is again
    returned = after(again, RETURNED, joint=measured)
    assert returned.level is Level.OK
    assert verdict(after(returned, BROKEN, joint=measured), BROKEN, joint=measured).state is State.STOP


def test_a_measurement_at_the_limit_ends_no_stop() -> None:
    measured = attrs.evolve(COUNTED, measured=KnownClearance("measured", 5.9e-4, 1.0e-5))
    assert verdict(acknowledged(after(NEW, BROKEN)), BROKEN, joint=measured).state is State.STOP


def test_a_clearance_at_its_limit_by_all_that_is_known_stays_so_between_the_gait_cycles() -> None:
    """The end of each gait cycle, which judges the counted clearance, took it back: two changes a cycle."""
    joint = attrs.evolve(COUNTED, believed_m=6.5e-4)
    raised = after(NEW, joint=joint)
    assert (raised.level, raised.cause, is_observed(raised)) == (Level.ERROR, "both", True)
    assert not has_changed(raised, after(raised, joint=joint))
    lower = after(raised, joint=attrs.evolve(joint, believed_m=3.5e-4))  # the forecast learned otherwise
    assert (lower.level, lower.present, is_observed(lower)) == (Level.ERROR, Level.OK, False)
    assert after(NEW) is NEW


def test_an_estimate_is_believed_although_the_counted_clearance_is_not_valid() -> None:
    other = attrs.evolve(COUNTED, joint="A", seen=(KnownClearance("torque", 2.93e-4, 2.8e-5),))
    one = believed(other, None, is_counted_leg=False)
    assert one is not None
    assert (one.clearance_m, one.sigma_m, one.by) == (2.93e-4, 2.8e-5, "torque")
    assert believed(COUNTED, None, is_counted_leg=False) is None


METRES = st.floats(1.0e-4, 3.0e-3)
SEEN = st.builds(KnownClearance, st.sampled_from(("torque", "encoders")), METRES, st.floats(1.0e-6, 1.0e-3))


@given(
    counted_m=METRES,
    measured=st.none() | st.builds(KnownClearance, st.just("measured"), METRES, st.floats(1e-6, 1e-4)),
    before=st.lists(SEEN, max_size=2),
    now=st.lists(SEEN, max_size=2),
    is_acknowledged=st.booleans(),
)
def test_the_verdict_and_the_believed_clearance_tell_one_story(
    counted_m, measured, before, now, is_acknowledged
) -> None:
    """Whoever is at a limit by the verdict is so by the believed clearance, and the other way round."""
    joint = attrs.evolve(COUNTED, counted_m=counted_m, measured=measured)
    alarm = after(NEW, *before, joint=joint)
    alarm = evaluated(alarm, counted_m, LIMIT, 1, 3) if alarm.level is Level.OK else alarm
    alarm = after(acknowledged(alarm) if is_acknowledged else alarm, *now, joint=joint)
    joint = attrs.evolve(joint, seen=tuple(now))
    every = findings(Situation(joints=(joint,), alarms=(alarm,)))
    found, one = verdict_of(every), joint_clearance(joint, alarm, every, 3.0e-4)
    estimate = at_limit_by_estimate(joint, alarm)
    if estimate is not None:
        assert found.state is State.STOP
    if one.believed_m is not None and one.believed_m >= LIMIT_M:
        assert found.state is one.status is State.STOP
    if found.fault_code == "CLEARANCE_SEEN_G":
        assert one.believed_m is not None and one.believed_m >= LIMIT_M
    if "G" in found.joints:
        assert one.status is found.state
    assert joint_clearance(joint, alarm, [found], 3.0e-4) == one

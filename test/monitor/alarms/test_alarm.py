"""The alarm state machine, with lists of numbers and by its laws."""

import math

import attrs
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leg_wear_monitor.monitor.alarms import Alarm, Limit, acknowledged, evaluated, has_changed
from leg_wear_monitor.state import Level

OK, WARN, ERROR = Level
LIMIT = Limit(warn=8.0, error=10.0, deadband=0.1)
ALARM = Alarm(kind="clearance", subject="A", unit="m")


def course(values, limit=LIMIT, alarm=ALARM):
    """The alarm after each value, a second apart."""
    for second, value in enumerate(values):
        alarm = evaluated(alarm, value, limit, second * 10**9)
        yield alarm


def present(values, limit=LIMIT):
    return [alarm.present for alarm in course(values, limit)]


# fmt: off
DEADBAND = [
    ([1, 7.9, 8, 9.9, 10, 11], [OK, OK, WARN, WARN, ERROR, ERROR]),
    ([10, 9.1, 8.9, 7.3, 7.1], [ERROR, ERROR, WARN, WARN, OK]),        # each limit has its own deadband
    ([10, 1, 10, 1], [ERROR, OK, ERROR, OK]),
    ([math.inf, 0], [ERROR, OK]),
    ([math.nan, 9, math.nan, 1, math.nan], [OK, WARN, WARN, OK, OK]),  # no value, no change
]
ON_DELAY = [
    ([9, 9, 9], [OK, OK, WARN]),
    ([9, 9, 1, 9, 9, 9], [OK, OK, OK, OK, OK, WARN]),                  # in a row
    ([9, 9, 10, 10, 10], [OK, OK, WARN, WARN, ERROR]),                 # what is beyond ERROR is beyond WARN
    ([9, 9, math.nan, 9], [OK, OK, OK, WARN]),
    ([10, 10, 10, 9.1, 10, 8.9, 10], [OK, OK, ERROR, ERROR, ERROR, WARN, WARN]),
]
# fmt: on


@pytest.mark.parametrize(("values", "levels"), DEADBAND)
def test_levels_follow_values_with_a_deadband(values, levels):
    assert present(values) == levels


@pytest.mark.parametrize(("values", "levels"), ON_DELAY)
def test_levels_rise_after_the_on_delay_and_not_before(values, levels):
    assert present(values, attrs.evolve(LIMIT, on_delay=3)) == levels


def test_a_value_may_stand_for_several_cycles():
    limit = attrs.evolve(LIMIT, on_delay=3)
    assert evaluated(ALARM, 9.0, limit, 0, cycles=2).present is OK
    assert evaluated(ALARM, 9.0, limit, 0, cycles=3).present is WARN


def test_a_least_value_has_its_bad_side_below():
    limit = Limit(warn=50.0, error=40.0, deadband=0.1, is_least=True)
    assert present([60, 50, 40, 43, 45, 54, 56], limit) == [OK, WARN, ERROR, ERROR, WARN, WARN, OK]


def test_what_is_still_bad_stays_acknowledged_and_clears_by_itself():
    *_, alarm = course([1, 10])
    seen = acknowledged(alarm)
    assert (seen.level, seen.acknowledged) == (ERROR, True)
    levels = [(a.level, a.acknowledged) for a in course([10, 8.5, 1], alarm=seen)]
    assert levels == [(ERROR, True), (WARN, True), (OK, False)]


def test_what_gets_worse_wants_to_be_seen_again():
    *_, alarm = course([9])
    *_, worse = course([1, 2, 10], alarm=attrs.evolve(acknowledged(alarm), beyond=(0, 0)))
    assert (worse.level, worse.acknowledged, worse.raised_ns) == (ERROR, False, 2 * 10**9)


# --- laws ---

numbers = st.floats(0.0, 20.0) | st.just(math.nan)
limits = st.builds(
    Limit,
    warn=st.floats(5.0, 9.0),
    error=st.floats(9.0, 12.0),
    deadband=st.floats(0.0, 0.5),
    on_delay=st.integers(1, 4),
)


def what_is_done(alarm, step, limit):
    return acknowledged(alarm) if step is None else evaluated(alarm, step, limit, 1)


@given(st.lists(numbers), limits)
def test_a_shown_level_never_falls_without_acknowledgement(numbers, limit):
    levels = [alarm.level for alarm in course(numbers, limit)]
    assert levels == sorted(levels)


@given(st.lists(numbers), limits)
def test_what_is_shown_is_at_least_what_is_present(numbers, limit):
    assert all(alarm.level >= alarm.present for alarm in course(numbers, limit))


@given(st.lists(st.tuples(st.floats(0.0, 20.0), st.floats(0.0, 5.0))), limits)
def test_larger_values_are_never_less_alarming(pairs, limit):
    lower = present([value for value, _ in pairs], limit)
    upper = present([value + more for value, more in pairs], limit)
    assert all(low <= up for low, up in zip(lower, upper, strict=True))


@given(st.lists(st.floats(0.0, 20.0), min_size=1), limits)
def test_no_level_without_so_many_cycles_beyond_its_limit(numbers, limit):
    for i, level in enumerate(present(numbers, limit)):
        run = numbers[max(0, i + 1 - limit.on_delay) : i + 1]
        if len(run) == limit.on_delay and all(limit.reaches(value, WARN) for value in run):
            assert level is not OK
        if all(not limit.reaches(value, WARN) for value in numbers[: i + 1]):
            assert level is OK


@given(st.lists(numbers | st.none()), limits)
def test_acknowledging_twice_is_acknowledging_once(steps, limit):
    alarm = ALARM
    for step in steps:
        alarm = what_is_done(alarm, step, limit)
    once = acknowledged(alarm)
    assert repr(acknowledged(once)) == repr(once)  # a NaN is not equal to itself
    assert once.level is alarm.present
    assert once.acknowledged == (once.level is not OK)


@given(st.lists(numbers | st.none()), limits)
def test_no_value_changes_nothing(steps, limit):
    alarm = ALARM
    for step in steps:
        alarm = what_is_done(alarm, step, limit)
        assert evaluated(alarm, math.nan, limit, 99) is alarm


@given(st.lists(st.floats(-20.0, 20.0)), limits)
def test_least_values_are_largest_values_upside_down(numbers, limit):
    mirrored = attrs.evolve(limit, warn=-limit.warn, error=-limit.error, is_least=True)
    # of negative limits the deadband would lie on the other side
    upright = attrs.evolve(limit, deadband=0.0)
    assert present(numbers, upright) == present(
        [-number for number in numbers], attrs.evolve(mirrored, deadband=0.0)
    )


def test_only_what_people_see_is_a_change():
    first, second, third = course([1, 2, 9])
    assert not has_changed(first, second)
    assert has_changed(second, third)
    assert third.name == "clearance A"
    assert Alarm(kind="cadence").name == "cadence"

"""How bad a raised alarm was, and how it is printed."""

import attrs
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leg_wear_monitor.monitor.alarms import Alarm, Limit, acknowledged, evaluated, raised_words, state_of
from leg_wear_monitor.state import Level

pytestmark = pytest.mark.plain

LIMIT = Limit(warn=8.0, error=10.0, deadband=0.1)
LEAST = Limit(warn=10.0, error=8.0, deadband=0.1, is_least=True)


def after(values: list[float], limit: Limit = LIMIT) -> Alarm:
    alarm = Alarm(kind="input_gaps")
    for second, value in enumerate(values, 1):
        alarm = evaluated(alarm, value, limit, second * 10**9)
    return alarm


def words(alarm: Alarm) -> str:
    return raised_words(state_of(alarm), alarm.worst, alarm.limit, alarm.unit, alarm.raised_ns)


def test_a_latched_alarm_tells_its_worst_value_and_not_that_of_today() -> None:
    alarm = after([1.0, 11.0, 42.0, 0.0])
    assert (alarm.value, alarm.worst, alarm.raised_ns) == (0.0, 42.0, 2 * 10**9)
    assert words(alarm) == "latched, worst 42, limit 10, since 2.000 s"
    assert words(attrs.evolve(alarm, unit="N", raised_ns=1_700_000_000 * 10**9, worst=12345.6)) == (
        "latched, worst 12346 N, limit 10 N, since 2023-11-14 22:13:20 UTC"
    )
    assert "worst 1.65 mm, limit 10 mm" in words(attrs.evolve(alarm, unit="m", worst=1.65e-3, limit=1e-2))


def test_of_estimates_the_last_one_is_reported_and_is_not_called_the_worst() -> None:
    alarm = Alarm(kind="clearance", subject="G", unit="m")
    for value in (2.1e-3, 1.65e-3):
        alarm = evaluated(alarm, value, Limit(5e-4, 6e-4, 0.05), 10**9, 1, 4e-4, "torque")
    words = raised_words(state_of(alarm), alarm.worst, alarm.limit, "m", alarm.raised_ns, alarm.cause)
    assert words == "present, last estimate 1.65 mm, limit 0.6 mm, since 1.000 s"


def test_the_worst_of_a_rate_is_the_least() -> None:
    assert after([20.0, 7.0, 3.0, 9.5, 30.0], LEAST).worst == 3.0


def test_an_alarm_of_which_the_worst_is_not_known_says_the_rest() -> None:
    alarm = Alarm(kind="clearance", subject="A", level=Level.ERROR, raised_ns=10**9)  # of an older ledger
    assert words(alarm) == "latched, since 1.000 s"


@given(st.lists(st.floats(0.0, 20.0), min_size=1, max_size=20))
def test_the_worst_is_the_largest_since_it_was_raised(values: list[float]) -> None:
    alarm = after(values)
    first = next((i for i, value in enumerate(values) if value >= LIMIT.warn), None)
    if first is None:
        assert alarm.worst != alarm.worst
        return
    assert alarm.worst == max(values[first:])
    assert acknowledged(attrs.evolve(alarm, present=Level.OK)).worst != alarm.worst

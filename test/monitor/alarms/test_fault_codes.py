"""Fault codes of alarms and of statuses."""

import attrs
import pytest

from leg_wear_monitor.monitor.alarms import NO_FAULT, Alarm, code_of, worst_code
from leg_wear_monitor.state import Level

pytestmark = pytest.mark.plain

CLEAR = Alarm(kind="clearance", subject="A")
WARNS, FAILS = attrs.evolve(CLEAR, level=Level.WARN), Alarm(kind="torque_mismatch", level=Level.ERROR)


def test_an_alarm_has_a_code_while_it_is_raised() -> None:
    assert (code_of(CLEAR), code_of(WARNS), code_of(FAILS)) == (NO_FAULT, "CLEARANCE_A", "TORQUE_MISMATCH")


def test_the_code_of_several_alarms_is_that_of_the_worst() -> None:
    assert worst_code([CLEAR, WARNS, FAILS]) == "TORQUE_MISMATCH"
    assert worst_code([WARNS, CLEAR]) == "CLEARANCE_A"
    assert worst_code([CLEAR]) == worst_code([]) == NO_FAULT

"""Fault codes of alarms and of statuses."""

import re
from pathlib import Path

import attrs
import pytest

from leg_wear_monitor.monitor.alarms import NO_FAULT, Alarm, code_of, worst_code
from leg_wear_monitor.state import Level

pytestmark = pytest.mark.plain

PACKAGE = Path(__file__).parents[3] / "leg_wear_monitor"
CLEAR = Alarm(kind="clearance", subject="A")
WARNS, FAILS = attrs.evolve(CLEAR, level=Level.WARN), Alarm(kind="torque_mismatch", level=Level.ERROR)


def test_an_alarm_has_a_code_while_it_is_raised() -> None:
    assert (code_of(CLEAR), code_of(WARNS), code_of(FAILS)) == (NO_FAULT, "CLEARANCE_A", "TORQUE_MISMATCH")


def test_the_code_of_several_alarms_is_that_of_the_worst() -> None:
    assert worst_code([CLEAR, WARNS, FAILS]) == "TORQUE_MISMATCH"
    assert worst_code([WARNS, CLEAR]) == "CLEARANCE_A"
    assert worst_code([CLEAR]) == worst_code([]) == NO_FAULT


def test_every_status_that_is_not_sound_is_made_with_a_code() -> None:
    made = [
        call
        for path in PACKAGE.rglob("*.py")
        for call in re.findall(r"\bStatus\((?:[^()]|\([^()]*\))*\)", path.read_text(encoding="utf-8"))
        if "Level.WARN" in call or "Level.ERROR" in call
    ]
    assert len(made) > 5
    assert [call for call in made if not re.search(r"[A-Z]{3,}_?[A-Z]*\)$", call)] == []

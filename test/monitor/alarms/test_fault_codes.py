"""Fault codes: those of alarms, and the table of the others in ros.md, which this script renews."""

import re
from pathlib import Path

import attrs
import pytest

from leg_wear_monitor.monitor.alarms import FAULT_CODES, NO_FAULT, Alarm, code_of, worst_code
from leg_wear_monitor.state import Level

pytestmark = pytest.mark.plain

PACKAGE = Path(__file__).parents[3] / "leg_wear_monitor"
PAGE = PACKAGE.parent / "docs" / "reference" / "ros.md"
TABLE = re.compile(r"(<!-- fault codes -->\n).*?(<!-- end -->)", re.DOTALL)
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


def renewed(page: str) -> str:
    rows = ["| `fault_code` | meaning |", "|---|---|"]
    rows += [f"| `{code}` | {meaning} |" for code, meaning in FAULT_CODES.items()]
    table = "\n".join([*rows, ""])
    return TABLE.sub(lambda found: found[1] + table + found[2], page)


def test_the_page_lists_every_code() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert "<!-- fault codes -->" in page
    assert renewed(page) == page


if __name__ == "__main__":
    PAGE.write_text(renewed(PAGE.read_text(encoding="utf-8")), encoding="utf-8")

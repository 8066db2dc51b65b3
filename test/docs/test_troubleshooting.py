"""The messages that the page of troubleshooting explains are those that the source has."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "howto" / "troubleshooting.md"
SOURCE = "\n".join(path.read_text(encoding="utf-8") for path in (ROOT / "leg_wear_monitor").rglob("*.py"))
MESSAGES = re.findall(r"^### `(.+)`$", PAGE.read_text(encoding="utf-8"), re.MULTILINE)


def test_there_are_messages() -> None:
    assert len(MESSAGES) > 10


@pytest.mark.parametrize("message", MESSAGES)
def test_every_part_of_a_message_is_in_the_source(message: str) -> None:
    parts = [part.strip() for part in message.split("…") if part.strip(" ,")]
    assert [part for part in parts if part not in SOURCE] == []

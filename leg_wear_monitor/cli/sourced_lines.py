"""Numbers of a file with their conditions and sources, as text."""

from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from leg_wear_monitor.mechanism.materials.sourced import SourcedValue


def sourced_lines(values: "Iterable[tuple[str, SourcedValue]]") -> list[str]:
    """Two lines for each number: what it is, and where it is from."""
    lines = []
    for key, value in values:
        lines += [f"{key}: {value.text}, {value.conditions}", f"    {value.source}"]
    return lines

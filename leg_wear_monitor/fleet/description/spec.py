"""Keys of fleet.yaml."""

import re

import attrs

from leg_wear_monitor.configuration.quantity import choice, described
from leg_wear_monitor.configuration.strict import choose

Patterns = str | tuple[str, ...]

_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,99}")


def _name_fault(name: str) -> str | None:
    if _NAME.fullmatch(name):
        return None
    return f"{name!r} is no name for a directory, expected up to 100 letters, digits, '.', '_' or '-'"


def _patterns_fault(patterns: Patterns) -> str | None:
    return None if patterns and all(listed(patterns)) else "has an empty pattern, expected files"


def listed(patterns: Patterns) -> tuple[str, ...]:
    """Patterns as a tuple, also if there is only one."""
    return (patterns,) if isinstance(patterns, str) else patterns


choose(Patterns, lambda value: (tuple[str, ...] if isinstance(value, list) else str, value))


@attrs.frozen(kw_only=True)
class Defaults:
    """Values for legs that have none of their own."""

    config: str = described("parameter file of the monitor; empty: the one of the package", default="")


@attrs.frozen(kw_only=True)
class LegEntry:
    """One leg."""

    id: str = described("name of the leg; its directories are named after it", check=_name_fault)
    recordings: Patterns = described(
        "recordings: a file, a bag directory, a pattern with * or **, or a list of these",
        check=_patterns_fault,
    )
    config: str = described("parameter file of the monitor; empty: that of the defaults", default="")
    lot: str = described("production lot of its joints", default="")
    node: str = described(
        "full name of the node whose parameters apply; empty: beside the crank's topic", default=""
    )
    joint_states: str = described("topic of the crank; empty: found by its name", default="")
    drive_torque: str = described("topic of the drive torque; empty: found by its name", default="")


@attrs.frozen(kw_only=True)
class FleetFile:
    """All keys of the file."""

    defaults: Defaults = described("values for legs that have none of their own", factory=Defaults)
    out: str = described("directory of the fleet, unless a command has another one", default="fleet")
    row: str = choice(("minute", "cycle"), "what a row of the cycles' table is", default="minute")
    legs: tuple[LegEntry, ...] = described(
        "the legs", check=lambda legs: None if legs else "is empty, expected at least one leg"
    )

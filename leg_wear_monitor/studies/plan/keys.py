"""Settings that several studies share, and their validation."""

from collections.abc import Callable
from itertools import pairwise
from typing import Any

from leg_wear_monitor.configuration.quantity import described, quantity

Names = tuple[str, ...]
MOST = 1_000_000


def check_rising(values: tuple[float, ...]) -> str | None:
    """Error text if values do not increase."""
    if values and all(a < b for a, b in pairwise(values)):
        return None
    return f"{list(values)} does not rise from value to value"


def check_joints(names: Names) -> str | None:
    """Error text for an invalid list of joints."""
    if names and len(set(names)) == len(names):
        return None
    return f"{list(names)} is not a list of at least one joint, each once"


def check_sets(sets: tuple[Names, ...]) -> str | None:
    """Error text for an invalid list of lists of joints."""
    if not sets:
        return "is empty, expected at least one list of joints"
    return next((fault for fault in map(check_joints, sets) if fault), None)


def some_of(known: Names) -> Callable[[Names], str | None]:
    """Validator that accepts only known names."""

    def check(names: Names) -> str | None:
        strange = [name for name in names if name not in known]
        return f"{strange[0]!r} is not one of {', '.join(known)}" if strange else check_joints(names)

    return check


def count_field(doc: str, least: int, default: int) -> Any:
    """An integer."""
    return quantity("", doc, at_least=least, at_most=MOST, default=default)


def clearance_field() -> Any:
    """The clearance of all clearance joints."""
    return quantity(
        "m", "radial clearance of the clearance joints", at_least=1.0e-6, at_most=0.1, default=3.0e-4
    )


def clearances_field() -> Any:
    """Clearances, one per point."""
    return quantity(
        "m", "radial clearances of the clearance joints", at_least=1.0e-6, at_most=0.1, check=check_rising
    )


def speed_field() -> Any:
    """The crank's speed."""
    return quantity("rpm", "speed of the crank", at_least=0.1, at_most=10_000.0, default=60.0)


def speeds_field() -> Any:
    """Speeds, one per point."""
    return quantity("rpm", "speeds of the crank", at_least=0.1, at_most=10_000.0, check=check_rising)


def clearance_joints_field() -> Any:
    """Clearance joints by name."""
    return described("joints with clearance", check=check_joints)

"""How much of each clearance is used up, where the verdict believes it."""

from collections.abc import Iterable

from leg_wear_monitor.fleet.overview.parts import LegOverview
from leg_wear_monitor.monitor.verdict.verdict import Figure

BANDS = (0.25, 0.5, 0.8, 1.0)
"""Ends of the bands of the heat map: fractions of the clearance from new to limit."""


def valid_used(leg: LegOverview) -> dict[str, float | None]:
    """Fraction of each joint's clearance that is used up; None where it is not valid, or wear is accelerated.

    While the counted clearances are not valid, only those of the verdict's joints are, as measurements show
    them: those of the others are estimated from the counted leg.
    """
    verdict = leg.verdict
    if leg.is_accelerated:
        return dict.fromkeys(leg.used_fraction)
    if verdict is None or Figure.CLEARANCES not in verdict.not_valid:
        return dict(leg.used_fraction)
    return {
        joint: used if joint in verdict.joints and leg.clearances[joint].seen_m is not None else None
        for joint, used in leg.used_fraction.items()
    }


def joints_of(legs: Iterable[LegOverview]) -> list[str]:
    """Names of the joints of all legs, in alphabetical order."""
    return sorted({joint for leg in legs for joint in leg.used_fraction})


def band(used: float) -> int:
    """Index of the band of a fraction, from 0; the last one begins at the limit."""
    return sum(used >= end for end in BANDS)

"""Clearances that do not rest on counted wear: that of a new part, and what the drive torque showed later.

Wear is counted from each of them on, so that only the wear since is multiplied by what is learned of the wear
coefficient: an opening that the counting had missed says nothing about how fast the joint wears.
"""

import math
from collections.abc import Sequence

import attrs

from leg_wear_monitor.monitor.config.forecast import Forecasting
from leg_wear_monitor.monitor.ledger.entry import CorrectedClearance


@attrs.frozen
class KnownClearance:
    """A clearance from which on the wear is counted.

    Attributes
    ----------
    clearance_m, sigma_m : float
        Mean radial clearance and its standard deviation.
    wear_m : float
        Wear in the twin at that time.
    from_m : float
        Wear in the twin from which on it holds; below, the one before.
    """

    clearance_m: float
    sigma_m: float
    wear_m: float = 0.0
    from_m: float = -math.inf


def known_clearances(
    settings: Forecasting, fresh_m: float, corrections: Sequence[CorrectedClearance] = ()
) -> list[KnownClearance]:
    """Known clearances of a part, the oldest first.

    Parameters
    ----------
    settings : Forecasting
    fresh_m : float
        Nominal clearance when new.
    corrections : sequence of CorrectedClearance
        Of this part, in the order of time.
    """
    return [
        KnownClearance(fresh_m, settings.clearance_sigma_m),
        # a correction opens the joint by far more than what rounding makes of the wear
        *(
            KnownClearance(c.clearance_m, c.sigma_m, c.wear_m, 0.5 * (c.before_m + c.wear_m))
            for c in corrections
        ),
    ]


def corrections_of(
    corrections: Sequence[CorrectedClearance], joint: str, replaced_ns: int
) -> list[CorrectedClearance]:
    """Corrections of one part of a joint."""
    return [c for c in corrections if c.joint == joint and c.replaced_ns == replaced_ns]

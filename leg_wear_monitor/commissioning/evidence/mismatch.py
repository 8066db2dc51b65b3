"""The mismatch of the drive torque that a healthy leg has with the monitor itself, and the limit for it."""

import math

import numpy as np

from leg_wear_monitor.commissioning.evidence.walk import Walk
from leg_wear_monitor.commissioning.result.commissioning_result import CommissioningItem

LIMIT = "limits.torque_mismatch"

_LEAST_CYCLES = 10
# scatters of a gait cycle's mismatch by which a warning is above its mean: by chance less than once in 1e6
_SIGMAS = 5.3


def mismatch_item(walk: Walk) -> CommissioningItem | None:
    """Limit of the mismatch by what a healthy leg has; None with too few gait cycles.

    A given limit stays where it is enough.
    """
    found = walk.mismatch
    found = found[np.isfinite(found)]
    if len(found) < _LEAST_CYCLES:
        return None
    mean, scatter = float(found.mean()), float(found.std(ddof=1))
    least = (mean + _SIGMAS * scatter) / walk.config.limits.warn_fraction
    given = walk.config.limits.torque_mismatch
    return CommissioningItem(
        name=LIMIT,
        value=given if least <= given else math.ceil(100.0 * least) / 100.0,
        sigma=scatter,
        remark=f"{mean:.2g} in {len(found)} gait cycles of this leg",
    )

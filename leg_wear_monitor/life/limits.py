"""Checks that a life by cycle jumps ends."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.clearance_range import limit_fault
from leg_wear_monitor.wear.cycle_jump import JumpControl

MOST_JUMPS = 10_000  # per life; with the default length of a jump, a life takes some 15


def check_life(
    clearance_joints: Sequence[str], fresh_m: Floats, radius_m: Floats, limit_m: ArrayLike, jump: JumpControl
) -> None:
    """Check that a life can end.

    Parameters
    ----------
    clearance_joints : sequence of str
    fresh_m, radius_m : (k,) arrays
        Clearances when new, and radii of the bushings.
    limit_m : float or (k,) array
    jump : JumpControl

    Raises
    ------
    ConfigError
        For limits and jumps that `simulate_life` refuses.
    """
    limits = np.broadcast_to(np.asarray(limit_m, dtype=float), len(clearance_joints))
    for joint, fresh, radius, limit in zip(clearance_joints, fresh_m, radius_m, limits, strict=True):
        fault = limit_fault(joint, float(fresh), float(radius), float(limit))
        if fault:
            raise ConfigError("limit-m", "", fault)
    jumps = float((limits - fresh_m).min() / jump.opens_m)
    if jumps > MOST_JUMPS:
        raise ConfigError(
            "opens-m",
            "",
            f"{jump.opens_m:g} m a jump takes {jumps:.2g} jumps to the limit, expected at most {MOST_JUMPS}",
        )

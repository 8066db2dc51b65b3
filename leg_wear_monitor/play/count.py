"""The count of an encoder: the step between neighbouring values of its angle."""

import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN

_LEAST_VALUES = 4  # fewer different values: the smallest step may be several counts
_OFF = 0.02  # counts that a value may be off its step: decimals of a table, rounding
_LEAST_RAD = TURN / 2**30  # finer than any encoder: rounding of the numbers


def found_count(angle: Floats) -> float | None:
    """Count [rad] that all values of an angle are multiples of; None if the values do not show one.

    Parameters
    ----------
    angle : (n,) array, rad
    """
    values = np.unique(angle)
    steps = np.diff(values)
    steps = steps[steps > _LEAST_RAD]
    if len(steps) + 1 < _LEAST_VALUES:
        return None
    count = float(steps.min())
    # the mean over all steps, as decimals round each one
    numbers = np.rint(steps / count)
    count = float(steps.sum() / numbers.sum())
    return count if float(np.max(np.abs(steps / count - numbers))) < _OFF * max(1.0, numbers.max()) else None


def bits_of(count_rad: float) -> float:
    """Bits of an encoder with a count [rad]."""
    return float(np.log2(TURN / count_rad))

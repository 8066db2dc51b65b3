"""How fast clearances grow: averaged over gait cycles, since single cycles of a chaotic motion scatter."""

import math

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats

LEAST_CYCLES = 10
LARGEST_ERROR = 0.5  # of the mean: beyond it the scatter says more than the mean


@attrs.frozen(eq=False)
class GrowthWindow:
    """The last gait cycles of one joint.

    Attributes
    ----------
    growth_m : (n,) array
        Of the mean clearance in each cycle.
    moving_s : (n,) array
        Time in motion of each.
    """

    growth_m: Floats = attrs.field(factory=lambda: np.zeros(0))
    moving_s: Floats = attrs.field(factory=lambda: np.zeros(0))


@attrs.frozen
class GrowthRate:
    """Mean growth over a window.

    Attributes
    ----------
    per_cycle_m, error_m : float
        A gait cycle, and the standard error of it.
    per_second_m : float
        A second of walking.
    """

    per_cycle_m: float
    error_m: float
    per_second_m: float


def extended(window: GrowthWindow, growth_m: float, moving_s: float, cycles: int) -> GrowthWindow:
    """Window of at most so many cycles with one more."""
    keep = max(0, len(window.growth_m) + 1 - cycles)
    return GrowthWindow(
        np.append(window.growth_m[keep:], growth_m), np.append(window.moving_s[keep:], moving_s)
    )


def growth_rate(window: GrowthWindow) -> GrowthRate | None:
    """Mean growth, None while there is not enough data to know it.

    A mean is used and not a median: wear comes in bursts, and the mean is what adds up. Neighbouring cycles
    of a chaotic motion hang together, so the standard error is that of the means of batches.
    """
    n = len(window.growth_m)
    if n < LEAST_CYCLES:
        return None
    mean = float(window.growth_m.mean())
    error = _standard_error(window.growth_m)
    if not error <= LARGEST_ERROR * abs(mean):
        return None
    return GrowthRate(mean, error, float(window.growth_m.sum() / window.moving_s.sum()))


def _standard_error(values: Floats, batches: int = 5) -> float:
    size = len(values) // batches
    means = values[len(values) - batches * size :].reshape(batches, size).mean(axis=1)
    return float(means.std(ddof=1) / math.sqrt(batches))

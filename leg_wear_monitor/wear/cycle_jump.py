"""Cycle jumps: the mean wear of a few gait cycles, applied over many (physics.md section 10).

Depth over gait cycles is an ordinary differential equation whose right-hand side, the mean wear of a cycle,
is known with scatter only: single cycles are chaotic. A jump is a step of Heun's method: Euler to the end,
the mean of both ends' rates over the jump. What both ends differ by beyond their scatter is its error.
"""

import math

import attrs
import numpy as np

from leg_wear_monitor.configuration.quantity import quantity
from leg_wear_monitor.mechanism.arrays import Floats

_GROWS, _SHRINKS, _SAFETY = 2.0, 0.3, 0.8
_TOLERATED = 0.1  # of the deepest change


@attrs.frozen(kw_only=True)
class JumpControl:
    """How far a jump may go."""

    opens_m: float = quantity(
        "m", "deepest change of a surface that a jump may make", above=0.0, default=3.0e-5
    )
    tolerance_m: float = quantity(
        "m", "error of the deepest change that a jump may make", above=0.0, default=3.0e-6
    )
    smooth_deg: float = quantity(
        "deg", "standard deviation of the window that rates are smoothed by", at_least=0.0, default=5.0
    )

    @classmethod
    def of(cls, opens_m: float) -> "JumpControl":
        """Jumps of a length, with an error in proportion to it."""
        return cls(opens_m=opens_m, tolerance_m=_TOLERATED * opens_m)


@attrs.frozen(eq=False)
class WearRate:
    """Mean wear of a gait cycle over n simulated ones.

    Attributes
    ----------
    depth : (k, 2, N) array, m
        Of bushing and journal, a cycle.
    scatter : (k,) array, m
        Standard error of the growth of the mean clearance, a cycle.
    """

    depth: Floats
    scatter: Floats

    @property
    def clearance(self) -> Floats:
        """Growth (k,) of the mean clearance [m], a cycle."""
        return np.asarray(self.depth.mean(axis=2).sum(axis=1))


def wear_rate(worn: Floats, smooth_deg: float) -> WearRate:
    """Mean wear of a cycle.

    Parameters
    ----------
    worn : (n, k, 2, N) array, m
        Depth that each of n cycles took away.
    smooth_deg : float
        A few cycles touch here and there; their mean is smoothed over the angle, volume kept.
    """
    growth = worn.mean(axis=3).sum(axis=2)
    scatter = growth.std(axis=0, ddof=1) / math.sqrt(len(worn)) if len(worn) > 1 else np.abs(growth[0])
    return WearRate(smoothed(worn.mean(axis=0), smooth_deg), np.asarray(scatter))


def smoothed(profile: Floats, width_deg: float) -> Floats:
    """Profiles (..., N) around a circle through a Gaussian window of a standard deviation; sums are kept."""
    n = profile.shape[-1]
    order = np.arange(n // 2 + 1)
    window = np.exp(-0.5 * (order * math.radians(width_deg)) ** 2)
    result = np.fft.irfft(np.fft.rfft(profile, axis=-1) * window, n, axis=-1)
    return np.asarray(np.maximum(result, 0.0) * _ratio(profile, np.maximum(result, 0.0)))


def _ratio(before: Floats, after: Floats) -> Floats:
    """Factors that keep the sum of each profile, where cutting off what rounding made negative changed it."""
    sums = after.sum(axis=-1, keepdims=True)
    return np.asarray(before.sum(axis=-1, keepdims=True) / np.where(sums > 0.0, sums, 1.0))


def longest_jump(rate: WearRate, control: JumpControl) -> float:
    """Gait cycles [] that a jump at a rate may last by its change of the surfaces; infinite without wear."""
    deepest = float(rate.depth.sum(axis=1).max(initial=0.0))
    return control.opens_m / deepest if deepest > 0.0 else math.inf


def jump_error(first: WearRate, last: WearRate, cycles: float) -> Floats:
    """Error (k,) [m] of Euler's step in the mean clearance, without what scatter alone makes of it.

    Heun's own error is smaller; this one is what can be seen.
    """
    differ = np.square(last.clearance - first.clearance)
    scatter = np.square(first.scatter) + np.square(last.scatter)
    return np.asarray(0.5 * cycles * np.sqrt(np.maximum(differ - scatter, 0.0)))


def next_jump(cycles: float, error_m: float, control: JumpControl) -> float:
    """Gait cycles of the next jump, or of the same again if its error was beyond the tolerance."""
    if error_m == 0.0:
        return _GROWS * cycles
    factor = _SAFETY * math.sqrt(control.tolerance_m / error_m)
    return cycles * min(_GROWS, max(_SHRINKS, factor))

"""Cycle jumps: the mean wear of a few gait cycles, applied to many (physics.md section 10).

Wear depth over gait cycles obeys an ordinary differential equation. Its right-hand side, the mean wear per
cycle, has scatter, because single cycles are chaotic. A jump is a step of Heun's method: an Euler step to
the end, then the mean of the rates at both ends. The difference of both rates beyond their scatter is the
error.
"""

import math
from collections.abc import Sequence

import attrs
import numpy as np

from leg_wear_monitor.configuration import quantity
from leg_wear_monitor.mechanism.arrays import Floats

# step-size control as for ODE solvers: largest growth and shrinkage of a jump, safety factor
_GROWS, _SHRINKS, _SAFETY = 2.0, 0.3, 0.8
_TOLERATED = 0.1  # tolerated error of a jump as a fraction of its deepest change


@attrs.frozen(kw_only=True)
class JumpControl:
    """Limits on the length and the error of a jump."""

    max_wear_per_jump_m: float = quantity(
        "m", "deepest change of a surface that a jump may make", above=0.0, default=3.0e-5
    )
    tolerance_m: float = quantity(
        "m", "error of the deepest change that a jump may make", above=0.0, default=3.0e-6
    )
    smooth_deg: float = quantity(
        "deg", "standard deviation of the window that rates are smoothed by", at_least=0.0, default=5.0
    )

    @classmethod
    def of(cls, max_wear_per_jump_m: float) -> "JumpControl":
        """Limits of a jump from its deepest change [m]; the error tolerance is 10 % of this change."""
        return cls(max_wear_per_jump_m=max_wear_per_jump_m, tolerance_m=_TOLERATED * max_wear_per_jump_m)


@attrs.frozen(eq=False)
class WearRate:
    """Mean wear per gait cycle over n simulated cycles; k clearance joints, N sectors.

    Attributes
    ----------
    depth : (k, 2, N) array, m
        Wear depth of bushing and journal per cycle.
    scatter : (k,) array, m
        Standard error of the growth of the mean clearance per cycle.
    """

    depth: Floats
    scatter: Floats

    @property
    def clearance(self) -> Floats:
        """Growth (k,) of the mean clearance per cycle [m]."""
        return opening(self.depth)


def opening(depth: Floats) -> Floats:
    """Growth (…, k) of the mean clearance [m] by wear of depth (…, k, 2, N) [m]."""
    return np.asarray(depth.mean(axis=-1).sum(axis=-1))


def wear_rate(worn: Floats, smooth_deg: float) -> WearRate:
    """Mean wear per cycle.

    Parameters
    ----------
    worn : (n, k, 2, N) array, m
        Wear depth of each of n cycles.
    smooth_deg : float
        Width of the smoothing window over the angle [deg]: few cycles have contact in few sectors only. The
        worn volume is conserved.
    """
    growth = opening(worn)
    scatter = growth.std(axis=0, ddof=1) / math.sqrt(len(worn)) if len(worn) > 1 else np.abs(growth[0])
    return WearRate(smoothed(worn.mean(axis=0), smooth_deg), np.asarray(scatter))


def mean_rate(rates: Sequence[WearRate], shares: Floats) -> WearRate:
    """Wear per cycle of a leg that walks a share (n,) of its cycles with each of n rates."""
    variance = weighted(np.array([rate.scatter for rate in rates]) ** 2, shares**2)
    return WearRate(weighted(np.array([rate.depth for rate in rates]), shares), np.sqrt(variance))


def weighted(values: Floats, shares: Floats) -> Floats:
    """Sum (...) of the values (n, ...) times their shares (n,)."""
    return np.asarray(np.tensordot(shares, values, axes=1))


def smoothed(profile: Floats, width_deg: float) -> Floats:
    """Periodic profiles (..., N) smoothed by a Gaussian of a standard deviation [deg]; sums are conserved."""
    n = profile.shape[-1]
    order = np.arange(n // 2 + 1)
    window = np.exp(-0.5 * (order * math.radians(width_deg)) ** 2)
    result = np.fft.irfft(np.fft.rfft(profile, axis=-1) * window, n, axis=-1)
    return np.asarray(np.maximum(result, 0.0) * _ratio(profile, np.maximum(result, 0.0)))


def _ratio(before: Floats, after: Floats) -> Floats:
    """Factors (..., 1) that restore the sum of each profile after negative rounding errors were cut off."""
    sums = after.sum(axis=-1, keepdims=True)
    return np.asarray(before.sum(axis=-1, keepdims=True) / np.where(sums > 0.0, sums, 1.0))


def longest_jump(rate: WearRate, control: JumpControl) -> float:
    """Largest number of gait cycles of a jump by the change of the surfaces; infinite without wear."""
    deepest = float(rate.depth.sum(axis=1).max(initial=0.0))
    return control.max_wear_per_jump_m / deepest if deepest > 0.0 else math.inf


def jump_error(first: WearRate, last: WearRate, cycles: float) -> Floats:
    """Error (k,) [m] of the Euler step in the mean clearance, minus the part that scatter explains.

    The error of Heun's method is smaller, but cannot be estimated from the two rates.
    """
    differ = np.square(last.clearance - first.clearance)
    scatter = np.square(first.scatter) + np.square(last.scatter)
    return np.asarray(0.5 * cycles * np.sqrt(np.maximum(differ - scatter, 0.0)))


def next_jump(cycles: float, error_m: float, control: JumpControl) -> float:
    """Gait cycles of the next jump, or of the repeated one if its error [m] is above the tolerance."""
    if error_m == 0.0:
        return _GROWS * cycles
    factor = _SAFETY * math.sqrt(control.tolerance_m / error_m)
    return cycles * min(_GROWS, max(_SHRINKS, factor))

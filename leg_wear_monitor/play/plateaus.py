"""Plateaus: what an angle comes to rest at between two reversals of the load."""

from itertools import pairwise

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.mechanism.arrays import Floats

_LEAST_SAMPLES = 8  # of a push; three in eight are its plateau
_ENDS = (5.0, 95.0)  # percentiles: ends of a signal, without its outliers
_SURE = 3.0  # standard deviations
NORMAL_MAD = 1.4826  # standard deviations per median absolute deviation


@attrs.frozen(eq=False)
class Plateaus:
    """Plateaus of an angle, one per push.

    Attributes
    ----------
    time_s, angle_rad : (m,) arrays
        Mean time and angle of each.
    side : (m,) array
        1.0 and -1.0, on the two sides of the reversals.
    noise_rad : float
        Standard deviation of the samples within a plateau, median of all.
    samples : float
        Samples of a plateau, median of all.
    moving : int
        Pushes at whose end the angle still moves; they are not among the plateaus.
    """

    time_s: Floats
    angle_rad: Floats
    side: Floats
    noise_rad: float
    samples: float
    moving: int


@attrs.frozen(eq=False)
class _Push:
    """Part of a push: mean time and angle, its side, noise, samples, and the step between its halves."""

    time_s: float
    angle_rad: float
    side: float
    noise_rad: float
    samples: int
    step_rad: float


@attrs.frozen(eq=False)
class Sides:
    """Side of each sample of a signal that reverses.

    Attributes
    ----------
    side : (n,) array
        1 or -1, 0 before the first push. A sample near the middle keeps the side of the one before, so that
        noise and released pushes are no reversals.
    is_held : (n,) array of bool
        Whether the signal is beyond the middle half of its range, so that it presses the joint to its end.
    """

    side: NDArray[np.int8]
    is_held: NDArray[np.bool_]


def sides(signal: Floats) -> Sides:
    """Sides of a signal that reverses.

    Raises
    ------
    LegWearError
        If the signal does not change.
    """
    low, high = np.percentile(signal, _ENDS)
    if not high > low:
        raise LegWearError("does not reverse: push the joint to and fro, and hold each push")
    middle, quarter = 0.5 * (low + high), 0.25 * (high - low)
    state = np.where(signal > middle + quarter, 1, np.where(signal < middle - quarter, -1, 0))
    last = np.maximum.accumulate(np.where(state != 0, np.arange(len(state)), 0))
    return Sides(np.asarray(state[last], np.int8), np.asarray(state != 0))


def plateaus(time_s: Floats, angle: Floats, sides: Sides, count_rad: float) -> Plateaus:
    """Plateaus of an angle (n,) [rad] between the reversals of its sides."""
    edges = np.flatnonzero(np.diff(sides.side)) + 1
    bounds = np.concatenate([[0], edges, [len(sides.side)]])
    pushes = []
    for begin, end in pairwise(bounds.tolist()):
        held = begin + np.flatnonzero(sides.is_held[begin:end])
        if sides.side[begin] and len(held) >= _LEAST_SAMPLES:
            pushes.append(_push(time_s[held], angle[held], float(sides.side[begin])))
    noise = float(np.median([each.noise_rad for each in pushes])) if pushes else 0.0
    still = [each for each in pushes if _is_still(each, noise, count_rad)]
    return Plateaus(
        np.array([each.time_s for each in still]),
        np.array([each.angle_rad for each in still]),
        np.array([each.side for each in still]),
        noise,
        float(np.median([each.samples for each in still])) if still else 0.0,
        len(pushes) - len(still),
    )


def _push(time_s: Floats, angle: Floats, side: float) -> _Push:
    """Plateau of a push: its second half, without the end, where the next push may have begun."""
    part = slice(len(angle) // 2, len(angle) - len(angle) // 8)
    time_s, angle = time_s[part], angle[part]
    half = len(angle) // 2
    step = _middle_mean(angle[half:]) - _middle_mean(angle[:half])
    noise = float(np.std(angle))
    return _Push(float(time_s.mean()), _middle_mean(angle), side, noise, len(angle), step)


def _middle_mean(values: Floats) -> float:
    """Mean of the middle half of values: single outliers have no effect."""
    ordered, cut = np.sort(values), len(values) // 4
    return float(ordered[cut : len(ordered) - cut].mean())


def _is_still(push: _Push, noise: float, count_rad: float) -> bool:
    """Whether the two halves of a plateau agree within noise and one count."""
    scatter = noise * np.sqrt(2.0 / (push.samples / 2.0))
    return bool(abs(push.step_rad) <= count_rad + _SURE * scatter)

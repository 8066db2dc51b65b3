"""Plateaus: what an angle comes to rest at between two reversals of the load."""

from collections.abc import Iterator
from itertools import pairwise

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.mechanism.arrays import Floats

_LEAST_SAMPLES = 3  # of a push: two show that the angle is at rest
_SHORT = 8  # samples of a push: below, its second half may be the joint on its way
_BRIEF = 0.25  # of the usual push: less is a signal that crosses its middle slowly
_ENDS = (5.0, 95.0)  # percentiles: ends of a signal, without its outliers
_RARE = (0.5, 99.5)  # percentiles: ends of a signal that is at rest for most of the time
_MANY_TIMES = 3.0  # the range, if the pushes are rare
_SURE = 3.0  # standard deviations
_ROUNDED = 1.0 + 1.0e-6  # a count as a difference of two angles
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
        Pushes without a rest of the angle; they are not among the plateaus.
    brief : int
        Pushes of too few samples; they are not, either.
    sprung : int
        Pushes that the signal held, while the joint had sprung back from its end.
    """

    time_s: Floats
    angle_rad: Floats
    side: Floats
    noise_rad: float
    samples: float
    moving: int
    brief: int = 0
    sprung: int = 0


@attrs.frozen(eq=False)
class _Rest:
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
    least, most = np.percentile(signal, _RARE)
    if most - least > _MANY_TIMES * (high - low):
        low, high = least, most
    if not high > low:
        raise LegWearError("does not reverse: push the joint to and fro, and hold each push")
    middle, quarter = 0.5 * (low + high), 0.25 * (high - low)
    state = np.where(signal > middle + quarter, 1, np.where(signal < middle - quarter, -1, 0))
    last = np.maximum.accumulate(np.where(state != 0, np.arange(len(state)), 0))
    return Sides(np.asarray(state[last], np.int8), np.asarray(state != 0))


def plateaus(time_s: Floats, angle: Floats, sides: Sides, count_rad: float) -> Plateaus:
    """Plateaus of an angle (n,) [rad] between the reversals of its sides.

    A push counts by the outermost place at which the joint rests. That is where it rests at the end of a push
    that presses all the time. If the signal is a command, the joint follows it late; if it keeps its value
    after the push, the joint springs back: then the place is another one, and it is beyond that by more than
    count and noise.
    """
    edges = np.flatnonzero(np.diff(sides.side)) + 1
    bounds = np.concatenate([[0], edges, [len(sides.side)]])
    spans = [
        (begin + np.flatnonzero(sides.is_held[begin:end]), end)
        for begin, end in pairwise(bounds.tolist())
        if sides.side[begin]
    ]
    n = _LEAST_SAMPLES
    usual = _BRIEF * float(np.median([len(held) for held, _ in spans])) if spans else 0.0
    # the joint may follow a signal late, by the length of a push
    pushes = [
        (held, np.arange(held[0], min(end, held[-1] + 1 + len(held))))
        for held, end in spans
        if len(held) >= max(n, usual)
    ]
    last = [_rest(time_s, angle, sides, held[_end(len(held))]) for held, _ in pushes]
    noise = _median(
        [
            own.noise_rad
            if len(held) >= _SHORT
            else min(float(np.std(angle[window[k : k + n]])) for k in range(len(window) - n + 1))
            for own, (held, window) in zip(last, pushes, strict=True)
        ]
    )
    # of second differences: a joint that swings has none, and no rest where it turns back
    trembles = NORMAL_MAD * _median(np.abs(np.diff(angle[sides.is_held], 2)).tolist()) / np.sqrt(6.0)
    outward = _outward(last)
    rests, sprung = [], 0
    for own, (held, window) in zip(last, pushes, strict=True):
        best = own if _is_still(own, noise, count_rad) else None
        for part in _parts(angle[window] * outward * own.side, max(n, len(held) // 8)):
            each = _rest(time_s, angle, sides, window[part])
            least = _ROUNDED * count_rad + _SURE * noise / np.sqrt(each.samples)
            if best is not None and outward * own.side * (each.angle_rad - best.angle_rad) <= least:
                break
            if _is_still(each, noise, count_rad) and each.noise_rad <= count_rad + _SURE * trembles:
                best = each
                break
        if best is not None:
            rests.append(best)
            sprung += best is not own and best.time_s < own.time_s
    return Plateaus(
        np.array([each.time_s for each in rests]),
        np.array([each.angle_rad for each in rests]),
        np.array([each.side for each in rests]),
        _median([each.noise_rad for each in rests]),
        _median([float(each.samples) for each in rests]),
        len(pushes) - len(rests),
        sum(0 < len(held) < n for held, _ in spans),
        sprung,
    )


def _median(values: list[float]) -> float:
    return float(np.median(values)) if values else 0.0


def _end(samples: int) -> slice:
    """Rest of a push at its end: its second half, without the end, where the next push may have begun."""
    return slice(samples // 2, samples - samples // 8)


def _outward(rests: list[_Rest]) -> float:
    """Whether the angle grows (1.0) or falls (-1.0) towards the side 1.0, by the medians of both sides."""
    each = [[one.angle_rad for one in rests if one.side == side] for side in (1.0, -1.0)]
    return 1.0 if _median(each[0]) >= _median(each[1]) else -1.0


def _parts(outward: Floats, samples: int) -> Iterator[slice]:
    """Parts of a push of so many samples, overlapping by half, the outermost first."""
    begins = np.arange(0, len(outward) - samples + 1, max(1, samples // 2))
    total = np.concatenate([[0.0], np.cumsum(outward)])
    for begin in begins[np.argsort(total[begins] - total[begins + samples], kind="stable")].tolist():
        yield slice(begin, begin + samples)


def _rest(time_s: Floats, angle: Floats, sides: Sides, part: NDArray[np.int64]) -> _Rest:
    time_s, angle, side = time_s[part], angle[part], float(sides.side[part[0]])
    half = len(angle) // 2
    step = _middle_mean(angle[half:]) - _middle_mean(angle[:half])
    noise = float(np.std(angle))
    return _Rest(float(time_s.mean()), _middle_mean(angle), side, noise, len(angle), step)


def _middle_mean(values: Floats) -> float:
    """Mean of the middle half of values: single outliers have no effect."""
    ordered, cut = np.sort(values), len(values) // 4
    return float(ordered[cut : len(ordered) - cut].mean())


def _is_still(rest: _Rest, noise: float, count_rad: float) -> bool:
    """Whether the two halves of a plateau agree within noise and one count."""
    scatter = noise * np.sqrt(2.0 / (rest.samples / 2.0))
    return bool(abs(rest.step_rad) <= count_rad * _ROUNDED + _SURE * scatter)

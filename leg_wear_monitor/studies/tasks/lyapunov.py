"""The largest Lyapunov exponent by two neighbours (Benettin and others, Meccanica 15, 1980).

A neighbour is started a tiny way off, both are moved on, the growth of their distance is noted, and the
neighbour is brought back to the first distance along the same direction.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from leg_wear_monitor.mechanism.arrays import Flags, Floats

Motion = Callable[[Floats], Floats]
Comparable = Callable[[Floats, Floats], bool]


class Estimate(NamedTuple):
    """A mean and its standard error."""

    value: float
    error: float


def stretches(
    advance: Motion,
    state: Floats,
    direction: Floats,
    scale: Floats,
    distance: float,
    steps: int,
    comparable: Comparable | None = None,
) -> Floats:
    """Logarithms of the growth of a small distance, step by step.

    Parameters
    ----------
    advance : callable
        Gives the state one step later; must not change what it is given.
    state, direction, scale : (n,) arrays
        Where to start, where the neighbour stands from there, and the unit of each coordinate. A scale of 0
        keeps a coordinate out of the distance: a neighbour that is brought back has it from the first.
    distance : float
        In units of the scale.
    steps : int
    comparable : callable, optional
        Whether the neighbour may be brought back now. Where motion jumps, the two are on different sides of
        the jump for a moment; their distance is then no small one along a direction.

    Returns
    -------
    (steps,) array
        Its mean over the time of a step is the exponent, once the start is forgotten.
    """
    counts = scale > 0.0
    unit = scale[counts]
    offset = direction[counts] / np.linalg.norm(direction[counts])
    near, last, logs = _beside(state, counts, distance * unit * offset), distance, np.zeros(steps)
    for step in range(steps):
        state, near = advance(state), advance(near)
        gap = (near[counts] - state[counts]) / unit
        size = float(np.linalg.norm(gap))
        if size == 0.0:  # met to the last bit: as near as numbers are
            gap, size = offset, np.finfo(float).eps
        logs[step] = np.log(size / last)
        last = size
        if comparable is None or comparable(state, near):
            near, last = _beside(state, counts, gap * (distance / size) * unit), distance
    return logs


def _beside(state: Floats, counts: Flags, offset: Floats) -> Floats:
    near = state.copy()
    near[counts] += offset
    return near


def exponent(logs: Floats, step_time: float, skip: int = 0) -> Estimate:
    """Exponent from the stretches of independent runs, with its standard error.

    That is the larger one of the errors between runs and between steps: a few runs may agree by chance.

    Parameters
    ----------
    logs : (runs, steps) array
    step_time : float
    skip : int
        First steps to leave out, while the neighbour turns into the direction that grows most.
    """
    rates = logs[:, skip:] / step_time
    each = rates.mean(axis=1)
    errors = each.std(ddof=1) / np.sqrt(len(each)), rates.std(ddof=1) / np.sqrt(rates.size)
    return Estimate(float(each.mean()), float(max(errors)))

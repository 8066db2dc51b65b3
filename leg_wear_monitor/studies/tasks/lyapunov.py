"""The largest Lyapunov exponent from two neighbouring trajectories (Benettin et al., Meccanica 15, 1980).

The neighbour starts at a small distance, both trajectories are advanced by a step, the growth of their
distance is recorded, and the neighbour is rescaled to the initial distance in the present direction.
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
        Returns the state one step later; must not modify its argument.
    state, direction, scale : (n,) arrays
        Initial state, direction of the neighbour from it, and scale of each coordinate. A coordinate of scale
        0 does not count in the distance; rescaling copies it from the first trajectory.
    distance : float
        Initial distance, in units of the scale.
    steps : int
        Number of steps.
    comparable : callable, optional
        Whether the neighbour may be rescaled between these two states; default: always. Around an impact, the
        two are on different sides of it for a moment and their distance is not small.

    Returns
    -------
    (steps,) array
        Logarithmic growth factors [-]; their mean divided by the duration of a step is the exponent, without
        the first steps.
    """
    counts = scale > 0.0
    unit = scale[counts]
    offset = direction[counts] / np.linalg.norm(direction[counts])
    near, last, logs = _beside(state, counts, distance * unit * offset), distance, np.zeros(steps)
    for step in range(steps):
        state, near = advance(state), advance(near)
        gap = (near[counts] - state[counts]) / unit
        size = float(np.linalg.norm(gap))
        if size == 0.0:  # equal in all bits: take the smallest distance that the numbers resolve
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
    """Lyapunov exponent from the growth factors of independent runs, with its standard error.

    The standard error is the larger one of those over runs and over steps, because few runs may agree by
    chance.

    Parameters
    ----------
    logs : (runs, steps) array
        Logarithmic growth factors [-].
    step_time : float
        Duration of a step, in the unit of time of the exponent.
    skip : int
        Number of first steps to leave out, in which the separation turns into the fastest growing direction.

    Returns
    -------
    Estimate
    """
    rates = logs[:, skip:] / step_time
    each = rates.mean(axis=1)
    errors = each.std(ddof=1) / np.sqrt(len(each)), rates.std(ddof=1) / np.sqrt(rates.size)
    return Estimate(float(each.mean()), float(max(errors)))

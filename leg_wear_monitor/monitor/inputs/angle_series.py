"""Series of crank angles: each sample belongs to the series whose motion it continues best.

The records of settings and states have the fields that are used here, and further ones.
"""

import math

from leg_wear_monitor.kernel import kernel

_TURN = 2.0 * math.pi
WIDEST = 0.25  # distance from a series [rad] beyond which nothing belongs to it
_SETTLING = 0.02  # s, over which the speed of a series is averaged


@kernel
def wrapped(angle):
    """An angle in [-pi, pi)."""
    return angle - _TURN * math.floor(angle / _TURN + 0.5)


@kernel
def guess_speed(settings, state, k, stamp, angle):
    """Speed of a series of one sample: at rest, as commanded, or that of the other, what fits best."""
    if state.number[k] != 1:
        return
    h = 1.0e-9 * (stamp - state.stamp[k])
    moved, least = wrapped(angle - state.angle[k]), math.inf
    for speed in (0.0, settings.commanded, state.speed[1 - k]):
        off = abs(wrapped(moved - speed * h))
        if off < least:
            least, state.speed[k] = off, speed


@kernel
def distance(settings, state, k, stamp, angle):
    """How far an angle is from where series k would be; infinite where it cannot belong to it."""
    if state.number[k] == 0:
        return math.inf
    h = 1.0e-9 * (stamp - state.stamp[k])
    if abs(h) > settings.gap:
        return math.inf
    off = abs(wrapped(angle - state.angle[k] - state.speed[k] * h))
    # by how much the crank's greatest acceleration may have moved it
    widest = min(WIDEST, settings.gate + 0.5 * (settings.largest * h) ** 2)
    return off if off <= widest else math.inf


@kernel
def extend(state, k, stamp, angle):
    """One more sample of series k; a late or repeated one tells nothing new."""
    h = 1.0e-9 * (stamp - state.stamp[k])
    if h <= 0.0:
        return
    off = wrapped(angle - state.angle[k] - state.speed[k] * h)
    state.speed[k] += off / (h + _SETTLING)
    state.angle[k], state.stamp[k] = angle, stamp
    state.number[k] += 1


@kernel
def begin(state, k, stamp, angle):
    """A new series takes the place of series k."""
    state.number[k], state.stamp[k] = 1, stamp
    state.angle[k], state.speed[k] = angle, 0.0

"""Crank angles that no one leg can give: two series that interleave, and angles in another unit.

Both are found in the samples in their order of arrival alone, so that a replay finds what the live run found.

*Series*: each sample belongs to the series whose motion it continues best. Where two series go on side by
side and neither continues the other, two sources send one crank's angle. *Unit*: the angle as it was sent,
not wrapped to a turn, runs beyond the largest speed that is believed, evenly and for some time.
"""

import math

from leg_wear_monitor.kernel import entry, kernel
from leg_wear_monitor.twin.sample import CRANK, NO_FAULT, OUT_OF_RANGE
from leg_wear_monitor.twin.tracker.arrival import LARGEST_ANGLE

_TURN = 2.0 * math.pi

# settings: gate of an angle [rad]; largest speed that is believed [rad/s]; longest gap within a series [s];
# for how long one series must be alone before the other is forgotten [s]; commanded speed [rad/s]
GATE, LARGEST, GAP, ALONE, COMMANDED = range(5)

# integers of the state: of both series, how many samples each has, its last stamp; which of them had the last
# sample, how often that has changed since the younger began, stamp since when it has not; whether two sources
# send; then of the unit: stamp of the anchor, fast steps in a row, whether the unit is another; counts of
# samples that were withheld for either reason
NUMBER, STAMP, LAST, SWITCHES, SINCE, TWO, ANCHOR, FAST, OTHER_UNIT, CONFLICTING, IMPLAUSIBLE = (
    0, 2, 4, 5, 6, 7, 8, 9, 10, 11, 12,
)  # fmt: skip
INTEGERS = 13

# numbers of the state: of both series, angle and speed; the anchor's angle, the speed of the last step, that
# of fast steps, averaged, and for how long the angle has moved as a leg's does
ANGLE, SPEED, ANCHOR_ANGLE, STEP_SPEED, FAST_SPEED, PLAUSIBLE = 0, 2, 4, 5, 6, 7
NUMBERS = 8

# Samples that make a series, and changes from one to the other. Glitches at random angles continue each other
# by chance in one of twelve (2 * _WIDEST of a turn): eight in a row are one in thirty million.
_SERIES, _INTERLEAVED, _WIDEST = 8, 8, 0.25
_SETTLING = 0.02  # s, over which the speed of a series is averaged
_STEP_NS = 20_000_000  # least time of a step: noise of 1 mrad over it is 0.05 rad/s
_STEPS = 3  # fast steps in a row: the jump of an angle that wraps is one


@kernel
def _wrapped(angle):
    """An angle in [-pi, pi)."""
    return angle - _TURN * math.floor(angle / _TURN + 0.5)


@kernel
def _guess_speed(settings, integers, numbers, k, stamp, angle):
    """Speed of a series of one sample: at rest, as commanded, or that of the other, what fits best."""
    if integers[NUMBER + k] != 1:
        return
    h = 1.0e-9 * (stamp - integers[STAMP + k])
    moved, least = _wrapped(angle - numbers[ANGLE + k]), math.inf
    for speed in (0.0, settings[COMMANDED], numbers[SPEED + 1 - k]):
        off = abs(_wrapped(moved - speed * h))
        if off < least:
            least, numbers[SPEED + k] = off, speed


@kernel
def _distance(settings, integers, numbers, k, stamp, angle):
    """How far an angle is from where series k would be; infinite where it cannot belong to it."""
    if integers[NUMBER + k] == 0:
        return math.inf
    h = 1.0e-9 * (stamp - integers[STAMP + k])
    if abs(h) > settings[GAP]:
        return math.inf
    off = abs(_wrapped(angle - numbers[ANGLE + k] - numbers[SPEED + k] * h))
    # by how much the crank's greatest acceleration may have moved it
    widest = min(_WIDEST, settings[GATE] + 0.5 * (settings[LARGEST] * h) ** 2)
    return off if off <= widest else math.inf


@kernel
def _extend(integers, numbers, k, stamp, angle):
    """One more sample of series k; a late or repeated one tells nothing new."""
    h = 1.0e-9 * (stamp - integers[STAMP + k])
    if h <= 0.0:
        return
    off = _wrapped(angle - numbers[ANGLE + k] - numbers[SPEED + k] * h)
    numbers[SPEED + k] += off / (h + _SETTLING)
    numbers[ANGLE + k], integers[STAMP + k] = angle, stamp
    integers[NUMBER + k] += 1


@kernel
def _begin(integers, numbers, k, stamp, angle):
    """A new series takes the place of series k."""
    integers[NUMBER + k], integers[STAMP + k], integers[SWITCHES] = 1, stamp, 0
    numbers[ANGLE + k], numbers[SPEED + k] = angle, 0.0


@kernel
def _are_two(settings, integers, numbers, stamp, angle):
    """Whether two series go on side by side, after one more sample."""
    for k in range(2):
        _guess_speed(settings, integers, numbers, k, stamp, angle)
    near = _distance(settings, integers, numbers, 0, stamp, angle)
    far = _distance(settings, integers, numbers, 1, stamp, angle)
    k = 0 if near <= far else 1
    strong = 0 if integers[NUMBER] >= integers[NUMBER + 1] else 1
    if max(near, far) < math.inf and integers[NUMBER + 1 - strong] < _SERIES:
        k = strong  # a series must show itself by samples that the other does not explain
    if min(near, far) < math.inf:
        _extend(integers, numbers, k, stamp, angle)
    else:
        k = 0 if integers[NUMBER] < integers[NUMBER + 1] else 1
        _begin(integers, numbers, k, stamp, angle)
    if k != integers[LAST]:
        integers[LAST], integers[SINCE] = k, stamp
        integers[SWITCHES] += 1
    if min(integers[NUMBER], integers[NUMBER + 1]) >= _SERIES and integers[SWITCHES] >= _INTERLEAVED:
        integers[TWO] = 1
    if abs(stamp - integers[SINCE]) > 1.0e9 * settings[ALONE]:
        # the other has gone; what begins anew must show itself again
        integers[TWO], integers[NUMBER + 1 - k], integers[SWITCHES], integers[SINCE] = 0, 0, 0, stamp
    return integers[TWO] == 1


@kernel
def _is_other_unit(settings, integers, numbers, stamp, angle):
    """Whether the angle runs as none of a leg's does, after one more sample."""
    step = stamp - integers[ANCHOR]
    if integers[ANCHOR] == 0 or abs(step) > 1.0e9 * settings[GAP]:
        integers[ANCHOR], numbers[ANCHOR_ANGLE], integers[FAST] = stamp, angle, 0
    elif step >= _STEP_NS:
        h, before = 1.0e-9 * step, numbers[STEP_SPEED]
        speed = (angle - numbers[ANCHOR_ANGLE]) / h
        integers[ANCHOR], numbers[ANCHOR_ANGLE], numbers[STEP_SPEED] = stamp, angle, speed
        if abs(speed) > settings[LARGEST]:
            along = speed * math.copysign(1.0, before)
            is_even = 0.5 * abs(before) < along < 2.0 * abs(before)
            integers[FAST] = integers[FAST] + 1 if is_even else 1
            if is_even:  # and not the jump of an angle that wraps
                numbers[PLAUSIBLE], numbers[FAST_SPEED] = 0.0, 0.5 * (numbers[FAST_SPEED] + abs(speed))
        else:
            integers[FAST] = 0
            # at rest every unit is the same
            if abs(speed) > 0.1 * abs(settings[COMMANDED]):
                numbers[PLAUSIBLE] += h
    if integers[FAST] >= _STEPS:
        integers[OTHER_UNIT] = 1
    elif numbers[PLAUSIBLE] * abs(settings[COMMANDED]) >= _TURN:  # a gait cycle's time
        integers[OTHER_UNIT] = 0
    return integers[OTHER_UNIT] == 1


@entry
def check_angles(settings, integers, numbers, stamp, kind, angle, out_fault):
    """Mark crank samples (n,) that cannot be used, as long as two sources send or the unit is another.

    ``out_fault`` (n,) are the faults that are known; the state in ``integers`` and ``numbers`` is changed.
    """
    for i in range(stamp.shape[0]):
        is_usable = kind[i] == CRANK and out_fault[i] == NO_FAULT and stamp[i] > 0
        if not is_usable or not abs(angle[i]) <= LARGEST_ANGLE:
            continue
        if _is_other_unit(settings, integers, numbers, stamp[i], angle[i]):
            # its series mean nothing
            integers[NUMBER], integers[NUMBER + 1], integers[TWO] = 0, 0, 0
            integers[IMPLAUSIBLE] += 1
            out_fault[i] = OUT_OF_RANGE
        elif _are_two(settings, integers, numbers, stamp[i], angle[i]):
            integers[CONFLICTING] += 1
            out_fault[i] = OUT_OF_RANGE

"""Crank angles that no one leg can give: two series that interleave, and angles in another unit.

Both are found in the samples in their order of arrival alone, so that a replay finds what the live run found.

*Series*: each sample belongs to the series whose motion it continues best. Where two series go on side by
side and neither continues the other, two sources send one crank's angle. *Unit*: the angle as it was sent,
not wrapped to a turn, runs beyond the largest speed that is believed, evenly and for some time.
"""

import math

import numpy as np

from leg_wear_monitor.kernel import entry, kernel
from leg_wear_monitor.monitor.inputs.angle_series import begin, distance, extend, guess_speed
from leg_wear_monitor.twin.kinds import CRANK
from leg_wear_monitor.twin.sample import NO_FAULT, OUT_OF_RANGE
from leg_wear_monitor.twin.tracker.arrival import LARGEST_ANGLE

_TURN = 2.0 * math.pi

SETTINGS = np.dtype(
    [
        ("gate", "f8"),  # of an angle [rad]
        ("largest", "f8"),  # speed that is believed [rad/s]
        ("gap", "f8"),  # longest within a series [s]
        ("alone", "f8"),  # for how long one series must be alone before the other is forgotten [s]
        ("commanded", "f8"),  # speed [rad/s]
    ]
)
STATE = np.dtype(
    [
        # of both series
        ("number", "i8", (2,)),  # samples
        ("stamp", "i8", (2,)),  # of the last one [ns]
        ("angle", "f8", (2,)),  # [rad]
        ("speed", "f8", (2,)),  # [rad/s]
        ("last", "i8"),  # which of them had the last sample
        ("switches", "i8"),  # how often that has changed since the younger one began
        ("since", "i8"),  # stamp of the last such change [ns]
        ("two", "i8"),  # 1 where two sources send
        # of the unit
        ("anchor", "i8"),  # stamp of the last step's end [ns]
        ("anchor_angle", "f8"),  # [rad]
        ("step_speed", "f8"),  # of the last step [rad/s]
        ("fast", "i8"),  # fast steps in a row
        ("fast_speed", "f8"),  # of fast steps, averaged [rad/s]
        ("plausible", "f8"),  # for how long the angle has moved as a leg's does [s]
        ("other_unit", "i8"),  # 1 where the unit is another
        # samples withheld
        ("conflicting", "i8"),  # since two sources send
        ("implausible", "i8"),  # since the unit is another
    ]
)

# Samples that make a series, and changes from one to the other. Glitches at random angles continue each other
# by chance in one of twelve (2 * WIDEST of a turn): eight in a row are one in thirty million.
_SERIES, _INTERLEAVED = 8, 8
_STEP_NS = 20_000_000  # least time of a step: noise of 1 mrad over it is 0.05 rad/s
_STEPS = 3  # fast steps in a row: the jump of an angle that wraps is one


@kernel
def _are_two(settings, state, stamp, angle):
    """Whether two series go on side by side, after one more sample."""
    for k in range(2):
        guess_speed(settings, state, k, stamp, angle)
    near = distance(settings, state, 0, stamp, angle)
    far = distance(settings, state, 1, stamp, angle)
    k = 0 if near <= far else 1
    strong = 0 if state.number[0] >= state.number[1] else 1
    if max(near, far) < math.inf and state.number[1 - strong] < _SERIES:
        k = strong  # a series must show itself by samples that the other does not explain
    if min(near, far) < math.inf:
        extend(state, k, stamp, angle)
    else:
        k = 0 if state.number[0] < state.number[1] else 1
        begin(state, k, stamp, angle)
        state.switches = 0
    if k != state.last:
        state.last, state.since = k, stamp
        state.switches += 1
    if min(state.number[0], state.number[1]) >= _SERIES and state.switches >= _INTERLEAVED:
        state.two = 1
    if abs(stamp - state.since) > 1.0e9 * settings.alone:
        # the other has gone; what begins anew must show itself again
        state.two, state.number[1 - k], state.switches, state.since = 0, 0, 0, stamp
    return state.two == 1


@kernel
def _is_other_unit(settings, state, stamp, angle):
    """Whether the angle runs as none of a leg's does, after one more sample."""
    step = stamp - state.anchor
    if state.anchor == 0 or abs(step) > 1.0e9 * settings.gap:
        state.anchor, state.anchor_angle, state.fast = stamp, angle, 0
    elif step >= _STEP_NS:
        h, before = 1.0e-9 * step, state.step_speed
        speed = (angle - state.anchor_angle) / h
        state.anchor, state.anchor_angle, state.step_speed = stamp, angle, speed
        if abs(speed) > settings.largest:
            along = speed * math.copysign(1.0, before)
            is_even = 0.5 * abs(before) < along < 2.0 * abs(before)
            state.fast = state.fast + 1 if is_even else 1
            if is_even:  # and not the jump of an angle that wraps
                state.plausible, state.fast_speed = 0.0, 0.5 * (state.fast_speed + abs(speed))
        else:
            state.fast = 0
            # at rest every unit is the same
            if abs(speed) > 0.1 * abs(settings.commanded):
                state.plausible += h
    if state.fast >= _STEPS:
        state.other_unit = 1
    elif state.plausible * abs(settings.commanded) >= _TURN:  # a gait cycle's time
        state.other_unit = 0
    return state.other_unit == 1


@entry
def check_angles(all_settings, states, stamp, kind, angle, out_fault):
    """Mark crank samples (n,) that cannot be used, as long as two sources send or the unit is another.

    ``out_fault`` (n,) are the faults that are known. Of settings and states there is one each; the state is
    changed.
    """
    settings, state = all_settings[0], states[0]
    for i in range(stamp.shape[0]):
        is_usable = kind[i] == CRANK and out_fault[i] == NO_FAULT and stamp[i] > 0
        if not is_usable or not abs(angle[i]) <= LARGEST_ANGLE:
            continue
        if _is_other_unit(settings, state, stamp[i], angle[i]):
            # its series mean nothing
            state.number[0], state.number[1], state.two = 0, 0, 0
            state.implausible += 1
            out_fault[i] = OUT_OF_RANGE
        elif _are_two(settings, state, stamp[i], angle[i]):
            state.conflicting += 1
            out_fault[i] = OUT_OF_RANGE

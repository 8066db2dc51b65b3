"""Restarts of the crank's encoder: places where its angle does not continue, in the order of arrival."""

import math

import numpy as np

from leg_wear_monitor.kernel import entry, kernel
from leg_wear_monitor.monitor.inputs.angle_series import begin, distance, extend, guess_speed
from leg_wear_monitor.twin.kinds import CRANK
from leg_wear_monitor.twin.sample import NO_FAULT
from leg_wear_monitor.twin.tracker.arrival import LARGEST_ANGLE

_TURN = 2.0 * math.pi

SETTINGS = np.dtype(
    [
        ("gate", "f8"),  # of an angle [rad]
        ("largest", "f8"),  # speed that is believed [rad/s]
        ("gap", "f8"),  # longest within a series [s]
        ("commanded", "f8"),  # speed [rad/s]
    ]
)
STATE = np.dtype(
    [
        # of the crank's series, and of another one that may take its place
        ("number", "i8", (2,)),  # samples
        ("stamp", "i8", (2,)),  # of the last one [ns]
        ("angle", "f8", (2,)),  # [rad]
        ("speed", "f8", (2,)),  # [rad/s]
        ("first_stamp", "i8"),  # of the other one [ns]
        ("first_angle", "f8"),  # [rad]
        ("event", "i8"),  # at the sample where the search ended
    ]
)

# The angle leaves its series; it is back, or another series has taken its place without a restart; it is
# another series, so the encoder has restarted.
LEAVES, CONTINUES, RESTARTS = range(3)

_SURE = 3  # samples of another series; the tracker accepts one after five, see `twin.tracker.tracking`
_WRAP = 1.5 * _TURN  # an angle that is wrapped to a turn jumps by less


@kernel
def _is_counted_on(settings, state):
    """Whether the angle after a gap is too large for an encoder that restarted in it."""
    gap = 1.0e-9 * (state.first_stamp - state.stamp[0])
    return gap > settings.gap and abs(state.first_angle) > settings.largest * gap + _TURN


@kernel
def _belongs(settings, state, k, stamp, angle):
    """Whether an angle continues series k."""
    guess_speed(settings, state, k, stamp, angle)
    ahead = state.speed[k] * 1.0e-9 * (stamp - state.stamp[k])
    if abs(angle - state.angle[k] - ahead) > _WRAP:
        return False
    return distance(settings, state, k, stamp, angle) < math.inf


@kernel
def _take_over(state):
    """The other series becomes that of the crank."""
    state.number[0], state.stamp[0] = state.number[1], state.stamp[1]
    state.angle[0], state.speed[0] = state.angle[1], state.speed[1]
    state.number[1] = 0


@kernel
def _event(settings, state, stamp, angle):
    """Event at one more sample; -1 for none."""
    if state.number[0] == 0:
        begin(state, 0, stamp, angle)
        return -1
    since = 1.0e-9 * (stamp - state.stamp[0])
    if -settings.gap <= since <= 0.0:  # late or repeated
        return -1
    if _belongs(settings, state, 0, stamp, angle):
        extend(state, 0, stamp, angle)
        was_left = state.number[1] > 0
        state.number[1] = 0
        return CONTINUES if was_left else -1
    if state.number[1] > 0 and _belongs(settings, state, 1, stamp, angle):
        extend(state, 1, stamp, angle)
        if state.number[1] < _SURE:
            return -1
        event = CONTINUES if _is_counted_on(settings, state) else RESTARTS
        _take_over(state)
        return event
    event = LEAVES if state.number[1] == 0 else -1
    begin(state, 1, stamp, angle)
    state.first_stamp, state.first_angle = stamp, angle
    return event


@entry
def find_event(all_settings, states, stamp, kind, angle, fault, first):
    """Index of the sample, from ``first`` on, at which the next event is; -1 if there is none.

    Of settings and states there is one each; the state is changed, its ``event`` says which one it is.
    """
    settings, state = all_settings[0], states[0]
    for i in range(first, stamp.shape[0]):
        if kind[i] != CRANK or fault[i] != NO_FAULT or stamp[i] <= 0 or not abs(angle[i]) <= LARGEST_ANGLE:
            continue
        event = _event(settings, state, stamp[i], angle[i])
        if event >= 0:
            state.event = event
            return i
    return -1

"""Samples as they arrive: what is wrong with them, whether their stamps can be believed, their order."""

import math

from leg_wear_monitor.kernel import kernel
from leg_wear_monitor.twin.sample import (
    CRANK,
    NO_FAULT,
    NOT_FINITE,
    OUT_OF_RANGE,
    TORQUE,
    WRONG_TYPE,
    ZERO_STAMP,
)
from leg_wear_monitor.twin.tracker.state import (
    BRIDGE,
    CANDIDATE,
    CANDIDATE_KIND,
    DUPLICATES,
    JUMP,
    LATE,
    NEWEST,
    NEWEST_OF,
    RELEASED,
    RELEASED_KINDS,
    STRAY,
    TAIL,
    WAITING,
    WINDOW,
)

LARGEST_ANGLE, LARGEST_RATE, LARGEST_TORQUE = 1.0e6, 1.0e3, 1.0e6  # rad, rad/s, N m: beyond is no leg's


@kernel
def find_fault(stamp, kind, fault, angle, torque):
    """What is wrong with a sample, if it is not said already."""
    if fault != NO_FAULT:
        return min(fault, OUT_OF_RANGE)
    if not CRANK <= kind <= TORQUE:
        return WRONG_TYPE
    if stamp <= 0:
        return ZERO_STAMP
    value, largest = (angle, LARGEST_ANGLE) if kind == CRANK else (torque, LARGEST_TORQUE)
    if not math.isfinite(value):
        return NOT_FINITE
    return OUT_OF_RANGE if abs(value) > largest else NO_FAULT


@kernel
def _was_released(state, stamp, kind):
    """Whether a sample that comes too late is one that has been here before."""
    clock, j = state.clock, state.clock[TAIL] - 1
    if stamp == clock[RELEASED]:
        return (clock[RELEASED_KINDS] >> kind) & 1 == 1
    while j >= 0 and state.queue_stamp[j] >= stamp:
        if state.queue_stamp[j] == stamp and state.queue_kind[j] == kind:
            return True
        j -= 1
    return False


# what to do with an arrival: nothing, or put it in order, or that after a jump of the stamps
DROP_IT, KEEP_IT, AFTER_JUMP = range(3)


@kernel
def arrive(model, state, stamp, kind, values):
    """What to do with a sample, by its stamp and those before it.

    A stamp far from the others is believed only if another follows it: one bad clock reading must not cost
    the track.
    """
    clock, count, ns = state.clock, state.counts, model.ns
    ahead, candidate = stamp - clock[NEWEST], clock[CANDIDATE]
    if clock[NEWEST] != 0 and (ahead > ns[BRIDGE] or ahead < -ns[JUMP]):
        after = stamp - candidate
        if candidate != 0 and -ns[WINDOW] <= after <= ns[BRIDGE]:
            if after == 0 and kind == clock[CANDIDATE_KIND]:
                count[DUPLICATES] += 1
                return DROP_IT
            return AFTER_JUMP
        if candidate != 0:
            count[STRAY] += 1
        clock[CANDIDATE], clock[CANDIDATE_KIND] = stamp, kind
        for c in range(3):
            state.candidate[c] = values[c]
        return DROP_IT
    if candidate != 0:
        count[STRAY] += 1
        clock[CANDIDATE] = 0
    if stamp < clock[RELEASED] or (stamp == clock[RELEASED] and _was_released(state, stamp, kind)):
        count[DUPLICATES if _was_released(state, stamp, kind) else LATE] += 1
        clock[NEWEST_OF + kind] = max(clock[NEWEST_OF + kind], stamp)  # from now on it is waited for
        return DROP_IT
    return KEEP_IT


@kernel
def horizon_of(model, clock):
    """Stamp up to which samples have their order, a window behind the youngest.

    One kind waits for the other as long as gaps are bridged: what one topic brings late, or after a burst of
    the other, is not lost.
    """
    newest = clock[NEWEST]
    horizon = newest
    for kind in range(CRANK, TORQUE + 1):
        if newest - clock[NEWEST_OF + kind] <= model.ns[BRIDGE]:
            horizon = min(horizon, clock[NEWEST_OF + kind])
    return horizon - model.ns[WINDOW]


@kernel
def insert(state, stamp, kind, values):
    """Put a sample where it belongs among those that wait; False for one that waits already."""
    clock, stamps, kinds = state.clock, state.arrival_stamp, state.arrival_kind
    i = clock[WAITING]
    while i > 0 and (stamps[i - 1] > stamp or (stamps[i - 1] == stamp and kinds[i - 1] > kind)):
        i -= 1
    if i > 0 and stamps[i - 1] == stamp and kinds[i - 1] == kind:
        return False
    for j in range(clock[WAITING], i, -1):
        stamps[j], kinds[j] = stamps[j - 1], kinds[j - 1]
        for c in range(3):
            state.arrival[j, c] = state.arrival[j - 1, c]
    stamps[i], kinds[i] = stamp, kind
    for c in range(3):
        state.arrival[i, c] = values[c]
    clock[WAITING] += 1
    clock[NEWEST] = max(clock[NEWEST], stamp)
    clock[NEWEST_OF + kind] = max(clock[NEWEST_OF + kind], stamp)
    return True

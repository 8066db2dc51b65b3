"""Samples as they arrive: put in order, checked, filtered, and made into steps for the leg."""

import math

from leg_wear_monitor.kernel import entry, kernel
from leg_wear_monitor.twin.sample import (
    CRANK,
    NO_FAULT,
    TORQUE,
)
from leg_wear_monitor.twin.steps import (
    LOOK,
    LOST_BY_JUMP,
    LOST_BY_OUTLIERS,
    LOST_BY_OVERFLOW,
    LOST_IN_GAP,
    add_step,
)
from leg_wear_monitor.twin.tracker.arrival import (
    DROP_IT,
    KEEP_IT,
    LARGEST_RATE,
    LARGEST_TORQUE,
    arrive,
    find_fault,
    horizon_of,
    insert,
)
from leg_wear_monitor.twin.tracker.crank_filter import begin_filter, update
from leg_wear_monitor.twin.tracker.crank_motion import lose, reach_spline_nodes
from leg_wear_monitor.twin.tracker.state import (
    ACQUIRE,
    ACQUIRING,
    ARRIVALS,
    BRIDGE,
    BRIDGED,
    BY_ANGLE,
    BY_VELOCITY,
    CANDIDATE,
    CANDIDATE_KIND,
    CRANKS,
    CREDIT,
    DUPLICATES,
    FAULTY,
    FILTER_TIME,
    GAPS,
    HEAD,
    JUMPS,
    LAST_CRANK,
    MARK,
    NEWEST,
    NEWEST_OF,
    OUT_SINCE,
    OUTLIERS,
    PERIOD,
    QUEUE,
    RECEIVED,
    REFUSED,
    RELEASED,
    RELEASED_KINDS,
    SLOWEST,
    STEP,
    TAIL,
    TORQUE_VALUE,
    TORQUES,
    VELOCITY_OUTLIERS,
    WAITING,
    P,
    X,
)

# velocities in a row that must agree with the angles of a moving crank before any is used: many drivers
# send zeros, which are right at rest only
_ENOUGH_CREDIT = 20
_GAP_PERIODS = (
    2  # of the crank's samples, shortest lately: a longer time between them is a gap, if it is long
)
_AT_LEAST_REFUSED = 5  # samples in a row, before the crank is held to be elsewhere


@kernel
def _make_room(state, steps, n):
    """Room for one more sample in the queue: moved down, or all lost where it is full of waiting ones."""
    clock = state.clock
    if clock[TAIL] == QUEUE:
        head, tail = clock[HEAD], clock[TAIL]
        if head < QUEUE // 4:
            return lose(state, state.queue_stamp[tail - 1], LOST_BY_OVERFLOW, steps, n)
        for j in range(head, tail):
            state.queue_stamp[j - head], state.queue_kind[j - head] = (
                state.queue_stamp[j],
                state.queue_kind[j],
            )
            for c in range(state.queue.shape[1]):
                state.queue[j - head, c] = state.queue[j, c]
        clock[HEAD], clock[TAIL] = 0, tail - head
    return n


@kernel
def _begin(model, state, stamp, angle, row):
    """First crank sample of an acquisition."""
    clock = state.clock
    begin_filter(model.real, angle, state.filtered)
    clock[ACQUIRING] = stamp
    if clock[OUT_SINCE] == 0:
        clock[OUT_SINCE] = stamp
    row[STEP], row[BY_ANGLE], row[BY_VELOCITY], row[BRIDGED] = 0.0, 0.0, 0.0, 0.0
    for i in range(3):
        row[X + i] = state.filtered[i]
    for i in range(6):
        row[P + i] = state.filtered[3 + i]


@kernel
def _filter(model, state, stamp, angle, velocity, row):
    """Take a crank sample into the filter; whether it passed the gate."""
    clock, count = state.clock, state.counts
    gap = stamp - clock[LAST_CRANK]
    h, step = 1.0e-9 * (stamp - clock[FILTER_TIME]), 1.0e-9 * gap
    trusted = clock[CREDIT] >= _ENOUGH_CREDIT
    used, verdict = update(model.real, h, step, angle, velocity, trusted, state.filtered, row)
    clock[FILTER_TIME] = stamp
    if not used:
        count[OUTLIERS] += 1
        clock[REFUSED] += 1
        return False
    if verdict < 0:
        count[VELOCITY_OUTLIERS] += 1
        clock[CREDIT] = 0
    elif verdict > 0 and abs(state.filtered[1]) > 0.5 * model.real[SLOWEST]:
        clock[CREDIT] = min(clock[CREDIT] + 1, _ENOUGH_CREDIT)
    row[BRIDGED] = 0.0
    longest = _GAP_PERIODS * clock[PERIOD]
    clock[PERIOD] = min(gap, clock[PERIOD] * 21 // 20 + 1) if clock[PERIOD] > 0 else gap
    if gap > max(model.ns[MARK], longest) and longest > 0:
        row[BRIDGED] = 1.0
        count[GAPS] += 1
    return True


@kernel
def _follow(model, state, stamp, kind, values, out_target, steps, n):
    """Take in a sample whose turn it is, and go on as far as can be."""
    clock, count, ns = state.clock, state.counts, model.ns
    n = _make_room(state, steps, n)
    since = stamp - clock[LAST_CRANK]
    reason = -1
    if clock[LAST_CRANK] != 0 and since > ns[BRIDGE]:
        reason = LOST_IN_GAP
    elif kind == CRANK and clock[REFUSED] >= _AT_LEAST_REFUSED and since > ns[ACQUIRE]:
        reason = LOST_BY_OUTLIERS
    if reason >= 0:
        n = lose(state, stamp, reason, steps, n)
    row = state.queue[clock[TAIL]]
    row[TORQUE_VALUE] = values[2] if abs(values[2]) <= LARGEST_TORQUE else math.nan
    if kind == TORQUE:
        count[TORQUES] += 1
        if clock[LAST_CRANK] == 0:  # nothing to compare it with
            return add_step(steps, n, LOOK, stamp, stamp, kind)
    else:
        if clock[LAST_CRANK] == 0:
            _begin(model, state, stamp, values[0], row)
        elif not _filter(model, state, stamp, values[0], values[1], row):
            return n
        count[CRANKS] += 1
        if math.isfinite(row[TORQUE_VALUE]):  # the crank's effort
            count[TORQUES] += 1
        clock[LAST_CRANK], clock[FILTER_TIME], clock[REFUSED] = stamp, stamp, 0
    state.queue_stamp[clock[TAIL]], state.queue_kind[clock[TAIL]] = stamp, kind
    clock[TAIL] += 1
    if kind == CRANK:
        n = reach_spline_nodes(model, state, out_target, steps, n)
    return n


@kernel
def _release(model, state, horizon, out_values, out_target, steps, n):
    """Follow all waiting samples up to a stamp, and more where too many wait."""
    clock, done = state.clock, 0
    while done < clock[WAITING] and (
        state.arrival_stamp[done] <= horizon or clock[WAITING] - done >= ARRIVALS - 1
    ):
        stamp, kind = state.arrival_stamp[done], state.arrival_kind[done]
        for c in range(3):
            out_values[c] = state.arrival[done, c]
        kinds = clock[RELEASED_KINDS] if stamp == clock[RELEASED] else 0
        clock[RELEASED], clock[RELEASED_KINDS] = stamp, kinds | (1 << kind)
        n = _follow(model, state, stamp, kind, out_values, out_target, steps, n)
        done += 1
    if done > 0:
        for j in range(done, clock[WAITING]):
            i = j - done
            state.arrival_stamp[i], state.arrival_kind[i] = state.arrival_stamp[j], state.arrival_kind[j]
            for c in range(3):
                state.arrival[i, c] = state.arrival[j, c]
        clock[WAITING] -= done
    return n


@kernel
def _take_new_time_base(state, steps, n):
    """After a jump of the stamps, once all that waited has gone: start from the sample that began it."""
    clock, stamp = state.clock, state.clock[CANDIDATE]
    if stamp < clock[NEWEST]:
        state.counts[JUMPS] += 1
        n = lose(state, stamp, LOST_BY_JUMP, steps, n)
        clock[RELEASED], clock[RELEASED_KINDS], clock[OUT_SINCE] = 0, 0, 0
    clock[NEWEST], clock[CANDIDATE], clock[NEWEST_OF + CRANK], clock[NEWEST_OF + TORQUE] = stamp, 0, 0, 0
    insert(state, stamp, clock[CANDIDATE_KIND], state.candidate)
    return n


@entry
def track(model, state, stamp, kind, fault, angle, velocity, torque, work, steps):
    """Take in samples (n,) in order of arrival; ``work`` (3, 3).

    Returns
    -------
    n : int
        Number of steps for the leg.
    """
    clock, count, n = state.clock, state.counts, 0
    values, released, target = work[0], work[1], work[2]
    for i in range(stamp.shape[0]):
        count[RECEIVED] += 1
        found = find_fault(stamp[i], kind[i], fault[i], angle[i], torque[i])
        if found != NO_FAULT:
            count[FAULTY + found] += 1
            continue
        values[0], values[1], values[2] = angle[i], velocity[i], torque[i]
        if not abs(values[1]) <= LARGEST_RATE:
            values[1] = math.nan
        decision = arrive(model, state, stamp[i], kind[i], values)
        while decision != DROP_IT:
            horizon = clock[NEWEST]  # after a jump all that waits goes first
            if decision == KEEP_IT:
                if not insert(state, stamp[i], kind[i], values):
                    count[DUPLICATES] += 1
                    break
                horizon = horizon_of(model, clock)
            n = _release(model, state, horizon, released, target, steps, n)
            if decision == KEEP_IT:
                break
            n = _take_new_time_base(state, steps, n)
            decision = KEEP_IT
    return n

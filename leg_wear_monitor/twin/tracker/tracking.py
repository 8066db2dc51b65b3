"""Kernel of the tracker: converts samples in order of arrival to steps (physics.md section 9)."""

import math

from leg_wear_monitor.kernel import entry, kernel
from leg_wear_monitor.twin.kinds import CRANK, LOAD, TORQUE
from leg_wear_monitor.twin.sample import NO_FAULT
from leg_wear_monitor.twin.steps import (
    EVALUATE,
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
from leg_wear_monitor.twin.tracker.crank_filter import begin_filter, note_prediction, update
from leg_wear_monitor.twin.tracker.crank_motion import lose, reach_spline_nodes
from leg_wear_monitor.twin.tracker.state import ARRIVALS, QUEUE, TrackerState

# successive velocities that must agree with the angles of a moving crank before any is used: many drivers
# send zeros, which are correct at rest only
_ENOUGH_CREDIT = 20
_GAP_PERIODS = 2  # least duration of a gap, in periods of the crank samples
_AT_LEAST_REFUSED = 5  # successive outliers after which tracking is lost


@kernel
def _make_room(state, steps, n):
    """Make room in a full queue: move it down, or end tracking if it is full of waiting samples."""
    clock, queue = state.clock, state.queue
    if clock.tail == QUEUE:
        head, tail = clock.head, clock.tail
        if head < QUEUE // 4:
            return lose(state, queue[tail - 1].stamp_ns, LOST_BY_OVERFLOW, steps, n)
        for j in range(head, tail):
            queue[j - head] = queue[j]
        clock.head, clock.tail = 0, tail - head
    return n


@kernel
def _begin(model, state, sample, row):
    """Start the filter with the first crank sample."""
    clock = state.clock
    begin_filter(model, sample.crank_angle_rad, state.estimate)
    clock.acquiring_ns = sample.stamp_ns
    if clock.out_since_ns == 0:
        clock.out_since_ns = sample.stamp_ns
    note_prediction(state.estimate, 0.0, row)


@kernel
def _filter(model, state, sample, row):
    """Filter a crank sample; returns whether it passed the gate."""
    clock, count = state.clock, state.counts
    gap = sample.stamp_ns - clock.last_crank_ns
    h, step = 1.0e-9 * (sample.stamp_ns - clock.filter_ns), 1.0e-9 * gap
    trusted = clock.velocity_credit >= _ENOUGH_CREDIT
    used, verdict = update(
        model, h, step, sample.crank_angle_rad, sample.crank_velocity_radps, trusted, state.estimate, row
    )
    clock.filter_ns = sample.stamp_ns
    if not used:
        count.outliers += 1
        clock.refused += 1
        return False
    if verdict < 0:
        count.velocity_outliers += 1
        clock.velocity_credit = 0
    elif verdict > 0 and abs(state.estimate.speed) > 0.5 * model.slowest:
        clock.velocity_credit = min(clock.velocity_credit + 1, _ENOUGH_CREDIT)
    longest = _GAP_PERIODS * clock.period_ns
    clock.period_ns = min(gap, clock.period_ns * 21 // 20 + 1) if clock.period_ns > 0 else gap
    if gap > max(model.mark_gap_ns, longest) and longest > 0:
        row.bridged = 1
        count.gaps_bridged += 1
    return True


@kernel
def _follow(model, state, sample, steps, n):
    """Process a sample in order of stamps, and advance to all spline nodes that it completes."""
    clock, count, stamp, kind = state.clock, state.counts, sample.stamp_ns, sample.kind
    n = _make_room(state, steps, n)
    since = stamp - clock.last_crank_ns
    reason = -1
    if clock.last_crank_ns != 0 and since > model.bridge_limit_ns:
        reason = LOST_IN_GAP
    elif kind == CRANK and clock.refused >= _AT_LEAST_REFUSED and since > model.acquire_ns:
        reason = LOST_BY_OUTLIERS
    if reason >= 0:
        n = lose(state, stamp, reason, steps, n)
    row = state.queue[clock.tail]
    row.torque = sample.torque_nm if abs(sample.torque_nm) <= LARGEST_TORQUE else math.nan
    if kind == TORQUE:
        count.used[TORQUE] += 1
        if clock.last_crank_ns == 0:  # nothing to compare it with
            n = add_step(steps, n, EVALUATE, stamp, stamp, kind)
            steps[n - 1].torque = row.torque
            return n
    elif kind == LOAD:
        count.used[LOAD] += 1
        if clock.last_crank_ns == 0:
            return n
        for i in range(2):
            row.foot_force[i] = sample.foot_force_n[i]
    elif kind == CRANK:
        if clock.last_crank_ns == 0:
            _begin(model, state, sample, row)
        elif not _filter(model, state, sample, row):
            return n
        count.used[CRANK] += 1
        if math.isfinite(row.torque):  # the crank's effort
            count.used[TORQUE] += 1
        clock.last_crank_ns, clock.filter_ns, clock.refused = stamp, stamp, 0
    row.stamp_ns, row.kind = stamp, kind
    clock.tail += 1
    if kind == CRANK:
        n = reach_spline_nodes(model, state, steps, n)
    return n


@kernel
def _release(model, state, horizon, steps, n):
    """Process all waiting samples up to a stamp [ns], and more if too many wait."""
    clock, arrivals, done = state.clock, state.arrivals, 0
    while done < clock.waiting and (
        arrivals[done].stamp_ns <= horizon or clock.waiting - done >= ARRIVALS - 1
    ):
        sample = arrivals[done]
        kinds = clock.released_kinds if sample.stamp_ns == clock.released_ns else 0
        clock.released_ns, clock.released_kinds = sample.stamp_ns, kinds | (1 << sample.kind)
        n = _follow(model, state, sample, steps, n)
        done += 1
    if done > 0:
        for j in range(done, clock.waiting):
            arrivals[j - done] = arrivals[j]
        clock.waiting -= done
    return n


@kernel
def _take_new_time_base(state, steps, n):
    """Start a new time base with the candidate sample, after all waiting samples were released."""
    clock, candidate = state.clock, state.candidate
    if candidate.stamp_ns < clock.newest_ns:
        state.counts.backward_jumps += 1
        n = lose(state, candidate.stamp_ns, LOST_BY_JUMP, steps, n)
        clock.released_ns, clock.released_kinds, clock.out_since_ns = 0, 0, 0
    clock.newest_ns = candidate.stamp_ns
    for kind in range(clock.newest_of_ns.shape[0]):
        clock.newest_of_ns[kind] = 0
    insert(state, candidate)
    candidate.stamp_ns = 0
    return n


@entry
def track(models, states, arrivals, queue, samples, steps):
    """Process samples (n,) of `GAIT_SAMPLE` in order of arrival; models and states are (1,).

    Returns
    -------
    n : int
        Number of steps for the leg.
    """
    model, own = models[0], states[0]
    state = TrackerState(
        own.counts, own.clock, own.estimate, own.node, own.ahead, own.candidate, arrivals, queue
    )
    clock, count, n = state.clock, state.counts, 0
    for i in range(samples.shape[0]):
        sample = samples[i]
        count.received += 1
        fault = find_fault(sample)
        if fault != NO_FAULT:
            count.faults[fault] += 1
            continue
        if not abs(sample.crank_velocity_radps) <= LARGEST_RATE:
            sample.crank_velocity_radps = math.nan
        decision = arrive(model, state, sample)
        while decision != DROP_IT:
            horizon = clock.newest_ns  # before a new time base, release all waiting samples
            if decision == KEEP_IT:
                if not insert(state, sample):
                    count.duplicates += 1
                    break
                horizon = horizon_of(model, clock)
            n = _release(model, state, horizon, steps, n)
            if decision == KEEP_IT:
                break
            n = _take_new_time_base(state, steps, n)
            decision = KEEP_IT
    return n

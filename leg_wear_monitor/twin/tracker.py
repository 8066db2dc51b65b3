"""The crank tracker: converts samples in order of arrival to steps for the leg in order of stamps."""

import math
from collections.abc import Iterator

from leg_wear_monitor.compiled.kernel import (
    Record,
    compile_for,
    entry,
    kernel,
    new_records,
    record_of,
)
from leg_wear_monitor.twin import CRANK, KINDS, LOAD, TORQUE
from leg_wear_monitor.twin.crank_motion import (
    ACQUIRE_NS,
    ARRIVALS,
    BACKWARD_JUMP_NS,
    BRIDGE_LIMIT_NS,
    EVALUATE,
    FIRST_LOAD_N,
    IS_STARTING,
    LOST_BY_JUMP,
    LOST_BY_OUTLIERS,
    LOST_BY_OVERFLOW,
    LOST_IN_GAP,
    MARK_GAP_NS,
    QUEUE,
    QUEUED,
    REORDER_WINDOW_NS,
    TRACKER_STATE,
    Steps,
    TrackerState,
    add_step,
    begin_filter,
    judge_load,
    lose,
    note_prediction,
    reach_spline_nodes,
    room_for_steps,
    tracker_model,
    update,
)
from leg_wear_monitor.twin.sample import (
    GAIT_SAMPLE,
    NO_FAULT,
    NOT_FINITE,
    OUT_OF_RANGE,
    WRONG_TYPE,
    ZERO_STAMP,
    Samples,
    TrackerSettings,
)

# Arriving samples: faults, plausibility of stamps, order (physics.md section 9).


LARGEST_RATE = 1.0e3  # largest plausible crank speed [rad/s]
LARGEST_ANGLE, LARGEST_TORQUE, LARGEST_FORCE = (KINDS[kind].largest for kind in (CRANK, TORQUE, LOAD))


@kernel
def find_fault(sample):
    """Fault of a sample: the fault on arrival, otherwise the first fault found."""
    if sample.fault != NO_FAULT:
        return min(sample.fault, OUT_OF_RANGE)
    if sample.kind == CRANK:
        value, largest = sample.crank_angle_rad, LARGEST_ANGLE
    elif sample.kind == TORQUE:
        value, largest = sample.torque_nm, LARGEST_TORQUE
    elif sample.kind == LOAD:
        value, largest = abs(sample.foot_force_n[0]), LARGEST_FORCE
        if not value >= abs(sample.foot_force_n[1]):
            value = abs(sample.foot_force_n[1]) + 0.0 * value  # NaN if one of the values is NaN
    else:
        return WRONG_TYPE
    if sample.stamp_ns <= 0:
        return ZERO_STAMP
    if not math.isfinite(value):
        return NOT_FINITE
    return OUT_OF_RANGE if abs(value) > largest else NO_FAULT


@kernel
def _was_released(state, sample):
    """True if a late sample repeats a released sample."""
    clock, queue, stamp, kind = state.clock, state.queue, sample.stamp_ns, sample.kind
    if stamp == clock.released_ns:
        return (clock.released_kinds >> kind) & 1 == 1
    j = clock.tail - 1
    while j >= 0 and queue[j].stamp_ns >= stamp:
        if queue[j].stamp_ns == stamp and queue[j].kind == kind:
            return True
        j -= 1
    return False


@kernel
def _copy_measured(source, out):
    """Copy the fields of a sample that the tracker needs."""
    out.stamp_ns, out.kind, out.fault, out.torque_nm = (
        source.stamp_ns,
        source.kind,
        source.fault,
        source.torque_nm,
    )
    out.crank_angle_rad, out.crank_velocity_radps = source.crank_angle_rad, source.crank_velocity_radps
    for i in range(2):
        out.foot_force_n[i] = source.foot_force_n[i]


# decisions on an arriving sample: drop it; insert it in order; insert it after a new time base
DROP_IT, KEEP_IT, AFTER_JUMP = range(3)


@kernel
def arrive(state, sample):
    """Decision on a sample, by its stamp and the previous stamps.

    A stamp far from the other stamps is accepted only after a second such stamp, because one wrong clock
    reading must not end the tracking.
    """
    clock, count, candidate = state.clock, state.counts, state.candidate
    stamp, kind = sample.stamp_ns, sample.kind
    ahead = stamp - clock.newest_ns
    if clock.newest_ns != 0 and (ahead > BRIDGE_LIMIT_NS or ahead < -BACKWARD_JUMP_NS):
        after = stamp - candidate.stamp_ns
        if candidate.stamp_ns != 0 and -REORDER_WINDOW_NS <= after <= BRIDGE_LIMIT_NS:
            if after == 0 and kind == candidate.kind:
                count.duplicates += 1
                return DROP_IT
            return AFTER_JUMP
        if candidate.stamp_ns != 0:
            count.stray_stamps += 1
        _copy_measured(sample, candidate)
        return DROP_IT
    if candidate.stamp_ns != 0:
        count.stray_stamps += 1
        candidate.stamp_ns = 0
    known = stamp <= clock.released_ns and _was_released(state, sample)
    if known or stamp < clock.released_ns:
        if known:
            count.duplicates += 1
        else:
            count.late += 1
        clock.newest_of_ns[kind] = max(clock.newest_of_ns[kind], stamp)  # the horizon now waits for this kind
        return DROP_IT
    return KEEP_IT


@kernel
def horizon_of(clock):
    """Stamp [ns] up to which the order of samples is final: one window before the youngest sample.

    Kinds wait for each other up to the longest bridged gap: samples of a topic that is late, or that arrive
    after a burst of the other topic, are not lost.
    """
    newest = clock.newest_ns
    horizon = newest
    for kind in range(clock.newest_of_ns.shape[0]):
        if newest - clock.newest_of_ns[kind] <= BRIDGE_LIMIT_NS:
            horizon = min(horizon, clock.newest_of_ns[kind])
    return horizon - REORDER_WINDOW_NS


@kernel
def insert(state, sample):
    """Insert a sample in the order of the waiting samples; False for a repeated sample."""
    clock, arrivals, stamp, kind = state.clock, state.arrivals, sample.stamp_ns, sample.kind
    i = clock.waiting
    while i > 0 and (
        arrivals[i - 1].stamp_ns > stamp
        or (arrivals[i - 1].stamp_ns == stamp and arrivals[i - 1].kind > kind)
    ):
        i -= 1
    if i > 0 and arrivals[i - 1].stamp_ns == stamp and arrivals[i - 1].kind == kind:
        return False
    for j in range(clock.waiting, i, -1):
        arrivals[j] = arrivals[j - 1]
    arrivals[i] = sample
    clock.waiting += 1
    clock.newest_ns = max(clock.newest_ns, stamp)
    clock.newest_of_ns[kind] = max(clock.newest_of_ns[kind], stamp)
    return True


# Kernel of the tracker: converts samples in order of arrival to steps (physics.md section 9).


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
        h, step, sample.crank_angle_rad, sample.crank_velocity_radps, trusted, state.estimate, row
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
    if gap > max(MARK_GAP_NS, longest) and longest > 0:
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
    if clock.last_crank_ns != 0 and since > BRIDGE_LIMIT_NS:
        reason = LOST_IN_GAP
    elif kind == CRANK and clock.refused >= _AT_LEAST_REFUSED and since > ACQUIRE_NS:
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
        judge_load(state, sample)
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
        decision = arrive(state, sample)
        while decision != DROP_IT:
            horizon = clock.newest_ns  # before a new time base, release all waiting samples
            if decision == KEEP_IT:
                if not insert(state, sample):
                    count.duplicates += 1
                    break
                horizon = horizon_of(clock)
            n = _release(model, state, horizon, steps, n)
            if decision == KEEP_IT:
                break
            n = _take_new_time_base(state, steps, n)
            decision = KEEP_IT
    return n


_CHUNK = 1024  # samples per call of the kernels: an evaluation period at 2 kHz takes one
_STEPS_A_SAMPLE = 7  # largest number of steps per sample


class CrankTracker:
    """Tracks the crank's motion from noisy, late, repeated and missing samples.

    Parameters
    ----------
    settings : TrackerSettings

    Attributes
    ----------
    records : Records
        The `TRACKER_STATE`, (1,), without the queues.
    state : Record
        The same record, by names.
    steps : Steps
        Steps of the last block of samples, with room for more.
    """

    def __init__(self, settings: TrackerSettings) -> None:
        self._model = tracker_model(settings)
        self.records, self._block = new_records(1, TRACKER_STATE), new_records(_CHUNK, GAIT_SAMPLE)
        self._arrivals, self._queue = new_records(ARRIVALS, GAIT_SAMPLE), new_records(QUEUE, QUEUED)
        self.state: Record = record_of(self.records)
        self.state.clock.tracking, self.state.clock.foot_force = IS_STARTING, FIRST_LOAD_N
        self.steps = room_for_steps(_STEPS_A_SAMPLE * (QUEUE + ARRIVALS + _CHUNK))

    def update(self, samples: Samples) -> Iterator[tuple[Steps, int]]:
        """Process a block (n,) of samples, in order of arrival.

        Yields
        ------
        steps : Steps
            Valid until the next iteration.
        n : int
            Number of steps.
        """
        for start in range(0, len(samples), _CHUNK):
            block = samples[start : start + _CHUNK]
            own = self._block[: len(block)]
            own[:] = block  # compiled code gets this layout only, and does not change the caller's array
            n = track(self._model, self.records, self._arrivals, self._queue, own, self.steps)
            yield self.steps, int(n)

    def compile(self) -> None:
        """Compile the tracking of samples, or load it."""
        compile_for(
            track, self._model, self.records, self._arrivals, self._queue, self._block[:0], self.steps
        )

    @property
    def due_stamp_ns(self) -> int:
        """Stamp that the samples of all kinds must reach for the next spline node; 0 while none is followed.

        The node is the first crank sample after its interval, so it may be reached a period later.
        """
        (model,), clock = self._model, self.state.clock
        if not clock.followed:
            return 0
        waits = model["node_interval_ns"] + model["lag_ns"] + REORDER_WINDOW_NS
        return int(clock.last_node_ns + waits)

"""Arriving samples: faults, plausibility of stamps, order (physics.md section 9)."""

import math

from leg_wear_monitor.kernel import kernel
from leg_wear_monitor.twin.kinds import CRANK, KINDS, LOAD, TORQUE
from leg_wear_monitor.twin.sample import NO_FAULT, NOT_FINITE, OUT_OF_RANGE, WRONG_TYPE, ZERO_STAMP

LARGEST_RATE = 1.0e3  # largest plausible crank speed [rad/s]
LARGEST_ANGLE, LARGEST_TORQUE, LARGEST_FORCE = (KINDS[kind].largest for kind in (CRANK, TORQUE, LOAD))


@kernel
def find_fault(sample):
    """Fault of a sample: the one that it arrived with, else the first one found."""
    if sample.fault != NO_FAULT:
        return min(sample.fault, OUT_OF_RANGE)
    if sample.kind == CRANK:
        value, largest = sample.crank_angle_rad, LARGEST_ANGLE
    elif sample.kind == TORQUE:
        value, largest = sample.torque_nm, LARGEST_TORQUE
    elif sample.kind == LOAD:
        value, largest = abs(sample.foot_force_n[0]), LARGEST_FORCE
        if not value >= abs(sample.foot_force_n[1]):
            value = abs(sample.foot_force_n[1]) + 0.0 * value  # NaN if one of them is
    else:
        return WRONG_TYPE
    if sample.stamp_ns <= 0:
        return ZERO_STAMP
    if not math.isfinite(value):
        return NOT_FINITE
    return OUT_OF_RANGE if abs(value) > largest else NO_FAULT


@kernel
def _was_released(state, sample):
    """Whether a late sample repeats a released one."""
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
def arrive(model, state, sample):
    """Decision on a sample, by its stamp and the previous ones.

    A stamp far from the others is accepted only after a second one follows it: one wrong clock reading must
    not lose the track.
    """
    clock, count, candidate = state.clock, state.counts, state.candidate
    stamp, kind = sample.stamp_ns, sample.kind
    ahead = stamp - clock.newest_ns
    if clock.newest_ns != 0 and (ahead > model.bridge_limit_ns or ahead < -model.backward_jump_ns):
        after = stamp - candidate.stamp_ns
        if candidate.stamp_ns != 0 and -model.reorder_window_ns <= after <= model.bridge_limit_ns:
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
def horizon_of(model, clock):
    """Stamp [ns] up to which the order of samples is final, one window behind the youngest.

    Kinds wait for each other up to the longest bridged gap: samples of a topic that is late, or that arrive
    after a burst of the other topic, are not lost.
    """
    newest = clock.newest_ns
    horizon = newest
    for kind in range(clock.newest_of_ns.shape[0]):
        if newest - clock.newest_of_ns[kind] <= model.bridge_limit_ns:
            horizon = min(horizon, clock.newest_of_ns[kind])
    return horizon - model.reorder_window_ns


@kernel
def insert(state, sample):
    """Insert a sample into the waiting ones in order; False for a repeated one."""
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

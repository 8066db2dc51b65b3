"""The follower: advances the leg along the steps, compares torques at samples (physics.md section 9)."""

import math
from typing import NamedTuple

import numpy as np

from leg_wear_monitor.compiled.kernel import Records, entry, kernel, new_records
from leg_wear_monitor.dynamics.clearance.advance import ADVANCE
from leg_wear_monitor.dynamics.clearance.contact import force_in_joint
from leg_wear_monitor.dynamics.clearance.model import ANGLE, SPEED, blend, move_time_origin
from leg_wear_monitor.dynamics.run import DONE, TORQUE, TORQUE_SQUARED
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.twin.crank_motion import EVALUATE, LEAVE, MOVE, PUSH, REPORT, START
from leg_wear_monitor.twin.load import LONGEST_PUSH, in_mechanism, learn

# State of the follower: motion along the steps, torque comparison.


PHASES = 32  # crank phases per turn, for the residual that repeats over gait cycles
FINE_PHASES = 128  # phases of the torque profile of a gait cycle

# number and indices of the regressors of a torque residual
REGRESSORS = 4
LOAD, FRICTION, LAG, LOAD_FRICTION = range(REGRESSORS)

LEG_MOTION = np.dtype(
    [
        ("base_ns", "i8"),  # stamp of the stepper's time 0
        ("runs", "i8"),  # 1 where the leg runs
        ("lost", "i8"),  # 1 after a failure, until the next start
        # the present piece of the crank's motion
        ("piece_begin_ns", "i8"),  # stamp
        ("piece_end_ns", "i8"),  # stamp
        ("turns_before", "i8"),  # whole crank turns to add to the leg's angle
        # the next passage of crank angle 0, which ends a gait cycle
        ("cut_ns", "i8"),  # stamp, 0 if not in this piece
        ("cut_turn", "i8"),  # whole crank turns there
        ("cut_rises", "i8"),  # 1 if forward
        # the last passage of crank angle 0
        ("anchored", "i8"),  # 1 if there was one
        ("anchor_turn", "i8"),  # whole crank turns there
        ("whole_cycles", "i8"),  # complete gait cycles since the leg was set in motion
        ("cycle_before_ns", "i8"),  # duration of the last of them
        # the gait cycle
        ("cycle_begin_ns", "i8"),  # stamp
        ("cycle_bridged_ns", "i8"),  # time bridged in it
        ("cycle_is_whole", "i8"),  # 1 if the cycle that has ended is complete
        # counts
        ("cycles", "i8"),  # complete gait cycles
        ("failures", "i8"),  # failures of the integration
        ("failed_at_ns", "i8"),  # stamp of the last failure
        ("failed_ns", "i8"),  # time lost by failures
        ("moving_ns", "i8"),  # time in motion
    ]
)

LEG_TORQUE = np.dtype(
    [
        # predicted drive torque since the last sample
        ("impulse", "f8"),  # integral [N m s]
        ("time", "f8"),  # time [s]
        ("mean_before", "f8"),  # mean before this sample [N m]
        # predicted drive torque since the last torque sample
        ("sensed_impulse", "f8"),  # integral [N m s]
        ("sensed_squares", "f8"),  # integral of the square [N^2 m^2 s]
        ("sensed_time", "f8"),  # time [s]
        # comparison
        ("last_lever", "f8"),  # drive torque per foot load at the last torque sample [N m/N]
        ("last_predicted", "f8"),  # predicted torque after the low-pass filter [N m]
        ("period", "f8"),  # period of the torque sensor [s]
        ("period_scatter", "f8"),  # mean departure of sample intervals from the period, as a fraction
        ("unfiltered", "f8"),  # time since the last filtered sample [s]
    ]
)

LOW_PASS = np.dtype(
    [
        ("stage", "i8"),  # 0 empty, 1 after the first sample, 2 after the first filtered one
        # the filter's two stages, for each signal
        ("measured", "f8", (2,)),  # [N m]
        ("predicted", "f8", (2,)),  # [N m]
        ("of_load", "f8", (2,)),  # torque per foot load [N m/N]
        ("of_friction", "f8", (2,)),  # torque per friction [-]
        ("of_load_friction", "f8", (2,)),  # torque per friction under load [N m]
        # for a sensor of instantaneous values
        ("weight", "f8", (2,)),  # weight of an instant
        ("weighted_residual", "f8", (2,)),  # weight times residual [N m]
        ("weighted_regressor", "f8", (REGRESSORS, 2)),  # weight times regressors
    ]
)

WAITING_INSTANT = np.dtype(
    [
        ("measured", "f8"),  # torque [N m]
        ("mean_predicted", "f8"),  # mean of the predicted torque since the previous instant [N m]
        ("variance", "f8"),  # variance of the predicted torque [N^2 m^2]
        ("regressor", "f8", (REGRESSORS,)),  # torque per load, friction, lag, load friction
        ("time", "f8"),  # since the previous instant [s], 0 if none is stored
        ("angle", "f8"),  # crank angle [rad]
    ]
)
"""An instant that is stored until the next one."""

TORQUE_SUMS = np.dtype(
    [
        ("number", "f8"),  # number of compared torques
        ("weight", "f8"),  # weight of the following sums, in samples
        ("residual_squares", "f8"),  # [N^2 m^2]
        ("measured_squares", "f8"),  # [N^2 m^2]
        ("predicted_squares", "f8"),  # [N^2 m^2]
        ("gram", "f8", (REGRESSORS, REGRESSORS)),  # products of the regressors with each other
        ("along", "f8", (REGRESSORS,)),  # products of the regressors with the residual
        # for a sensor of instantaneous values: rows of weight, then weight times residual and regressors
        ("by_phase", "f8", (2 + REGRESSORS, PHASES)),
        # before the low-pass filter: weight, crank angle, measured torque, predicted torque, torque per load
        ("profile", "f8", (5, FINE_PHASES)),
    ]
)
"""Sums over a gait cycle."""

LOAD_SUMS = np.dtype(
    [
        ("gap_ns", "i8"),  # time in gaps between samples
        ("samples", "i8"),
        ("least", "f8"),  # vertical force, 0 before the first sample [N]
        ("largest", "f8"),  # [N]
        ("profile", "f8", (3, FINE_PHASES)),  # number, force x and y [N]
    ]
)
"""Sums over the foot load samples of a gait cycle, along the axes of the mechanism."""

LAST_LOAD = np.dtype(
    [
        ("stamp_ns", "i8"),  # time of the last sample of the foot load, 0 before the first
        ("force", "f8", (2,)),  # its force [N]
        ("is_frozen", "i8"),  # 1 while the samples are wrong: the mean of earlier gait cycles stays
    ]
)

LEG_STATE = np.dtype(
    [
        ("motion", LEG_MOTION),
        ("load", LOAD_SUMS),
        ("last_load", LAST_LOAD),
        ("torque", LEG_TORQUE),
        ("low_pass", LOW_PASS),
        ("waiting", WAITING_INSTANT),
        ("regressor", "f8", (REGRESSORS,)),  # torque per load, friction, lag and load friction
        ("sums", TORQUE_SUMS),
    ]
)

TORQUE_SENSOR = np.dtype(
    [
        ("cutoff", "f8"),  # cutoff of the low-pass filter [rad/s]
        ("usual", "f8"),  # RMS of the ideal torque [N m]
        ("instants", "i8"),  # 1 if it samples instants instead of averages
        # drive, as estimated up to the last gait cycle
        ("friction", "f8"),  # constant [N m]
        ("load_friction", "f8"),  # friction over the size of the torque
    ]
)

EVALUATED = np.dtype(
    [
        ("stamp_ns", "i8"),  # stamp of the sample
        ("kind", "i8"),  # kind of `twin.sample`
        ("angle", "f8"),  # crank angle [rad], NaN while the leg does not run
        # mean drive torque since the previous sample, with the drive's friction [N m]; NaN while at rest
        ("torque", "f8"),
    ]
)
"""The leg at a sample."""


class FollowerState(NamedTuple):
    """State of the follower, in addition to the stepper's.

    ``records`` (1,): of `LEG_STATE`; ``polynomial`` (7,): present piece of the crank's motion; ``force`` (k,)
    [N]: contact forces at the end of the last step.
    """

    records: Records
    polynomial: Floats
    force: Floats


def leg_state(clearance_joints: int) -> FollowerState:
    """State before the first step."""
    return FollowerState(new_records(1, LEG_STATE), np.zeros(7), np.zeros(clearance_joints))


# Phase of the crank, in whose bins torques are summed over a gait cycle.


_TURN = 2.0 * math.pi


@kernel
def in_turn(angle):
    """Crank angle [rad] in [0, 2 pi)."""
    return angle - _TURN * math.floor(angle / _TURN)


@kernel
def phase_of(angle, phases):
    """Index below ``phases`` of a crank angle [rad]."""
    return min(int(in_turn(angle) / _TURN * phases), phases - 1)


# Low-pass filter of measured and predicted drive torque, two first-order stages (physics.md section 9).


@kernel
def pass_low(fraction, fresh, value, stages):
    """Output of the filter with ``stages`` (2,), ``fraction`` 1 - exp(-w dt); if fresh, it is the input."""
    for stage in range(2):
        if fresh:
            stages[stage] = value
        stages[stage] += fraction * (value - stages[stage])
        value = stages[stage]
    return value


# Torque comparisonfor a sensor of instantaneous values instead of averages (physics.md section 9).
#
# With clearances the drive torque has peaks that are shorter than the time between two samples, so an instant
# may or may not contain one: even for a healthy leg, low-pass filtered instants deviate from the mean by a
# quarter of the torque. Therefore the weight of an instant decreases with the variance of the predicted
# torque around it, its deviation is bounded by a few times the RMS torque, and only the part of the residual
# that repeats over gait cycles is evaluated (`repeating`).


# as fractions of the RMS torque: standard deviation that halves an instant's weight, bound of its deviation;
# these values clearly separate a healthy leg from one with strong impacts
_VARIES, _FURTHEST = 0.5, 4.0


@kernel
def take_instant(sensor, leg, measured, mean, variance, lever, direction, dt, angle):
    """Store an instantaneous torque, and compare the previous value, whose prediction is now complete.

    ``mean`` [N m] and ``variance`` [N^2 m^2] are the mean and variance of the predicted torque since the
    previous instant, ``dt`` [s] before; ``lever`` [N m/N] is the drive torque per foot load, ``angle`` [rad]
    the crank angle.

    Returns
    -------
    float
        The residual after the low-pass filter [N m], NaN before the second instant. Its regressors are in
        ``leg.regressor``.
    """
    w = leg.waiting
    residual = math.nan
    if w.time > 0.0:
        residual = _compare_waiting(sensor, leg, max(variance, w.variance))
    rate = (mean - w.mean_predicted) / dt if w.time > 0.0 else 0.0
    w.measured, w.mean_predicted, w.variance, w.time, w.angle = measured, mean, variance, dt, angle
    w.regressor[LOAD], w.regressor[FRICTION], w.regressor[LAG] = lever, direction, -rate
    w.regressor[LOAD_FRICTION] = direction * abs(mean)
    return residual


@kernel
def _compare_waiting(sensor, leg, variance):
    """Compare the stored instant; returns its residual after the low-pass filter [N m]."""
    w, low_pass, by_phase = leg.waiting, leg.low_pass, leg.sums.by_phase
    fresh, fraction = low_pass.stage == 1, 1.0 - math.exp(-sensor.cutoff * w.time)
    low_pass.stage = 2
    weight = 1.0 / (1.0 + variance / (_VARIES * sensor.usual) ** 2)
    furthest = _FURTHEST * sensor.usual
    off = min(max(w.measured - w.mean_predicted, -furthest), furthest)
    leg.torque.last_predicted = pass_low(fraction, fresh, w.mean_predicted, low_pass.predicted)
    of_all = pass_low(fraction, fresh, weight, low_pass.weight)
    phase = phase_of(w.angle, PHASES)
    by_phase[0, phase] += of_all
    residual = pass_low(fraction, fresh, weight * off, low_pass.weighted_residual)
    by_phase[1, phase] += residual
    for i in range(REGRESSORS):
        weighted = pass_low(fraction, fresh, weight * w.regressor[i], low_pass.weighted_regressor[i])
        by_phase[2 + i, phase] += weighted
        leg.regressor[i] = weighted / of_all
    return residual / of_all


# Comparison of measured and predicted drive torque after one low-pass filter (physics.md section 9).


# weight of a time between samples in the running means of the sensor's period and of its scatter, and longest
# time in periods: in a longer time samples were lost, and it counts as this many periods in the mean. Where
# times scatter by themselves, this many times their scatter are allowed for: even times from 0 to 2 periods
# scatter by 0.375, as far as counted; with a quarter of the samples lost, the scatter is below 0.125
_WEIGHT, _LONGEST_PERIOD, _OF_SCATTER = 0.05, 1.5, 4.0


@kernel
def compare(sensor, signature, leg, stepper, measured):
    """Compare a measured torque [N m] with the mean predicted torque since the previous torque sample.

    ``signature`` (N + 1,) is the drive torque per foot load [N m/N]. After lost torque samples, the predicted
    mean covers a longer time than the sensor's, and the sample is left out.
    """
    torque, by, low_pass = leg.torque, leg.regressor, leg.low_pass
    i, w = blend(signature.shape[0] - 1, stepper.drive[ANGLE])
    lever = signature[i] + w * (signature[i + 1] - signature[i])
    mean, duration = torque.sensed_impulse, torque.sensed_time
    squares = torque.sensed_squares
    torque.sensed_impulse, torque.sensed_time, torque.sensed_squares = 0.0, 0.0, 0.0
    before, torque.last_lever = torque.last_lever, lever
    if low_pass.stage == 0 or not duration > 0.0:  # the first sample since the leg moves
        low_pass.stage = max(low_pass.stage, 1)
        torque.unfiltered, leg.waiting.time = 0.0, 0.0
        return
    dt = torque.unfiltered + duration
    torque.unfiltered = dt
    longest = torque.period * max(_LONGEST_PERIOD, 1.0 + _OF_SCATTER * torque.period_scatter)
    if torque.period > 0.0:
        away = min(abs(duration / torque.period - 1.0), _LONGEST_PERIOD - 1.0)
        torque.period_scatter += _WEIGHT * (away - torque.period_scatter)
        torque.period += _WEIGHT * (min(duration, torque.period * _LONGEST_PERIOD) - torque.period)
    else:
        torque.period = duration
    if 0.0 < longest < duration:
        return
    torque.unfiltered = 0.0
    # an average is weighted by its duration; an instantaneous torque has the weight 1
    weight = 1.0 if sensor.instants != 0 else duration / torque.period
    angle, toe = stepper.drive[ANGLE], 0.5 * (before + lever)
    add_to_profile(leg.sums.profile, angle, measured, mean / duration, toe, weight)
    direction = 1.0 if stepper.drive[SPEED] > 0.0 else -1.0
    if sensor.instants != 0:
        mean /= duration
        variance = max(squares / duration - mean * mean, 0.0)
        r = take_instant(sensor, leg, measured, mean, variance, lever, direction, dt, angle)
        if math.isfinite(r):
            p = torque.last_predicted
            _add_up(p + r, p, by, leg.sums, weight)
        return
    fresh, fraction = low_pass.stage == 1, 1.0 - math.exp(-sensor.cutoff * dt)
    low_pass.stage = 2
    m = pass_low(fraction, fresh, measured, low_pass.measured)
    p = pass_low(fraction, fresh, mean / duration, low_pass.predicted)
    by[LOAD] = pass_low(fraction, fresh, toe, low_pass.of_load)
    by[FRICTION] = pass_low(fraction, fresh, direction, low_pass.of_friction)
    rubbing = direction * abs(mean / duration)
    by[LOAD_FRICTION] = pass_low(fraction, fresh, rubbing, low_pass.of_load_friction)
    by[LAG] = 0.0 if fresh else (torque.last_predicted - p) / dt
    torque.last_predicted = p
    _add_up(m, p, by, leg.sums, weight)


@kernel
def add_to_profile(profile, angle, measured, predicted, lever, weight):
    """Add a measured and a predicted torque [N m] and the torque per load [N m/N] to the sums of a phase."""
    phase = phase_of(angle, profile.shape[1])
    profile[0, phase] += weight
    profile[1, phase] += weight * in_turn(angle)
    profile[2, phase] += weight * measured
    profile[3, phase] += weight * predicted
    profile[4, phase] += weight * lever


@kernel
def _add_up(m, p, by, sums, weight):
    """Add measured torque m, predicted torque p [N m] and regressors ``by`` (4,) to a cycle's sums."""
    r = m - p
    sums.number += 1.0
    sums.weight += weight
    sums.residual_squares += weight * r * r
    sums.measured_squares += weight * m * m
    sums.predicted_squares += weight * p * p
    for a in range(REGRESSORS):
        sums.along[a] += weight * by[a] * r
        for b in range(REGRESSORS):
            sums.gram[a, b] += weight * by[a] * by[b]


# reasons for which the kernel returns before the last step: a cycle has ended; the caller must start the leg,
# stop following, or record an event. Other values are the status codes of dynamics.run.
CYCLE, NEEDS_START, LEFT, REPORTED = range(100, 104)

_advance = ADVANCE.call
_REBASE = 65536  # intervals after which time 0 is moved; even, because of the stepper's `RENEWAL`


@kernel
def _angle_at(polynomial, tau):
    """Crank angle [rad] of a piece of motion, ``tau`` [s] after its begin; polynomial (7,)."""
    angle = 0.0
    for i in range(6, 0, -1):
        angle = angle * tau + polynomial[i]
    return angle


@kernel
def _find_cut(motion, polynomial, begin):
    """Find the next passage of crank angle 0 in the present piece, from a stamp on: a cycle may end there."""
    motion.cut_ns = 0
    origin = motion.piece_begin_ns
    low, high = 1.0e-9 * (begin - origin), 1.0e-9 * (motion.piece_end_ns - origin)
    first, last = _angle_at(polynomial, low) / _TURN, _angle_at(polynomial, high) / _TURN
    up, down = math.floor(first) + 1.0, math.ceil(first) - 1.0
    rising = first < up <= last
    if not (rising or last <= down < first):
        return
    boundary = (up if rising else down) * _TURN
    for _ in range(50):
        middle = 0.5 * (low + high)
        if (_angle_at(polynomial, middle) >= boundary) == rising:
            high = middle
        else:
            low = middle
    motion.cut_ns = min(origin + math.ceil(1.0e9 * high), motion.piece_end_ns)
    motion.cut_turn = motion.turns_before + int(up if rising else down)
    motion.cut_rises = 1 if rising else 0


@kernel
def _load_piece(model, stepper, leg, polynomial, step):
    """Begin the next piece of the crank's motion; times and angles are kept small and thus exact."""
    motion = leg.motion
    if stepper.intervals[0] >= _REBASE:
        move_time_origin(stepper, model.interval, _REBASE)
        motion.base_ns += round(_REBASE * model.interval * 1.0e9)
    if step.begin_ns != motion.piece_end_ns:  # the leg rested in between
        motion.base_ns += step.begin_ns - motion.piece_end_ns
        leg.low_pass.stage = 0
    turns = step.turns - motion.turns_before
    if turns != 0:
        stepper.drive[ANGLE] -= turns * _TURN
    motion.piece_begin_ns, motion.piece_end_ns, motion.turns_before = step.begin_ns, step.end_ns, step.turns
    motion.cycle_bridged_ns += step.bridged_ns
    motion.moving_ns += step.end_ns - step.begin_ns
    polynomial[0] = 1.0e-9 * (step.begin_ns - motion.base_ns)
    for i in range(6):
        polynomial[1 + i] = step.motion[i]
    _find_cut(motion, polynomial, step.begin_ns)


@kernel
def _evaluate(sensor, signature, leg, polynomial, stepper, step, out):
    """Evaluate the running leg at a sample, into the record ``out`` of `EVALUATED`."""
    motion, torque = leg.motion, leg.torque
    if torque.time > 0.0:
        torque.mean_before = torque.impulse / torque.time
        torque.impulse, torque.time = 0.0, 0.0
    at = min(max(step.end_ns, motion.piece_begin_ns), motion.piece_end_ns)
    angle = _angle_at(polynomial, 1.0e-9 * (at - motion.piece_begin_ns))
    out.angle = angle - _TURN * math.floor(angle / _TURN)
    direction = 1.0 if stepper.drive[SPEED] > 0.0 else -1.0
    rubbing = sensor.friction + sensor.load_friction * abs(torque.mean_before)
    out.torque = torque.mean_before + direction * rubbing
    if motion.piece_begin_ns <= step.end_ns <= motion.piece_end_ns and math.isfinite(step.torque):
        compare(sensor, signature, leg, stepper, step.torque)


@kernel
def _push(load, leg, polynomial, step):
    """Add a sample of the foot load to the sums of the gait cycle, and to the mean over gait cycles."""
    motion, sums, last, n = leg.motion, leg.load, leg.last_load, load.axis.shape[0]
    at = min(max(step.begin_ns, motion.piece_begin_ns), motion.piece_end_ns)
    tau, speed, force = 1.0e-9 * (at - motion.piece_begin_ns), 0.0, step.motion
    for i in range(6, 1, -1):
        speed = speed * tau + (i - 1) * polynomial[i]
    angle, since_ns = _angle_at(polynomial, tau), step.begin_ns - last.stamp_ns
    row = angle * (n / _TURN)
    force[0], force[1] = in_mechanism(load.axis, row, force[0], force[1])
    if last.stamp_ns != 0:
        if since_ns > 1.0e9 * LONGEST_PUSH:
            sums.gap_ns += since_ns
        elif last.is_frozen == 0 and load.learned.shape[0] > 0:
            learn(load, row - 1.0e-9 * since_ns * speed * (n / _TURN), row, last.force, force)
    phase, up = phase_of(angle, sums.profile.shape[1]), 0.0
    sums.profile[0, phase] += 1.0
    for c in range(2):
        last.force[c] = force[c]
        sums.profile[1 + c, phase] += force[c]
        up += load.up[c] * force[c]
    sums.least = min(sums.least, up) if sums.samples else up
    sums.largest = max(sums.largest, up) if sums.samples else up
    sums.samples, last.stamp_ns = sums.samples + 1, step.begin_ns


@kernel
def _add_torque(torque, impulse, squares, time):
    """Add a step's integrals: drive torque [N m s], its square [N^2 m^2 s], and time [s]."""
    torque.impulse += impulse
    torque.time += time
    torque.sensed_impulse += impulse
    torque.sensed_time += time
    torque.sensed_squares += squares


@entry
def follow(
    advance_address,
    model,
    feeds_back,
    stepper,
    statistics,
    work,
    sensors,
    signature,
    load,
    state,
    steps,
    first,
    n,
    m,
    evaluated,
    forces,
):
    """Follow steps from index ``first`` to n; ``stepper`` is the ClearanceState, ``state`` the FollowerState.

    ``sensors`` (1,) contains the torque sensor, ``load`` the `LoadRows`. Values at samples are written to
    ``evaluated`` (n,) from index m on, joint forces [N] to ``forces`` (n, k), NaN while the leg does not run.

    Returns
    -------
    reason, i, k, m
        DONE, or the reason for which the caller must act before step i; k is the clearance joint concerned
        (for CYCLE the stamp of its end [ns]), -1 if none; m is the number of evaluated samples.
    """
    sensor, leg, polynomial, force = sensors[0], state.records[0], state.polynomial, state.force
    motion, i = leg.motion, first
    while i < n:
        step, code = steps[i], steps[i].code
        if motion.runs != 0:
            until = motion.piece_end_ns
            if code == EVALUATE:
                until = min(step.end_ns, until)
            elif code == PUSH:
                until = min(step.begin_ns, until)
            cuts = motion.cut_ns != 0 and motion.cut_ns <= until
            if cuts:
                until = motion.cut_ns
            impulse, squares = statistics.drive_integral[TORQUE], statistics.drive_integral[TORQUE_SQUARED]
            time, before = statistics.time[0], stepper.intervals[0]
            t_end = 1.0e-9 * (until - motion.base_ns)
            status, k = _advance(
                advance_address, (model, feeds_back, stepper, polynomial, t_end, statistics, work)
            )
            if stepper.intervals[0] > before:
                impulse = statistics.drive_integral[TORQUE] - impulse
                squares = statistics.drive_integral[TORQUE_SQUARED] - squares
                _add_torque(leg.torque, impulse, squares, statistics.time[0] - time)
                for j in range(force.shape[0]):
                    force[j] = force_in_joint(j, work.start)
            if status != DONE:
                motion.runs, motion.lost = 0, 1
                motion.failures += 1
                motion.failed_at_ns = motion.base_ns + round(1.0e9 * stepper.intervals[0] * model.interval)
                return status, i, k, m
            if cuts:
                # a cycle that ends at the passage where it began is not a gait cycle
                is_whole = motion.anchored != 0 and motion.anchor_turn != motion.cut_turn
                motion.cycle_is_whole = 1 if is_whole else 0
                motion.anchored, motion.anchor_turn = 1, motion.cut_turn
                _find_cut(motion, polynomial, until)
                return CYCLE, i, until, m
        if code == MOVE:
            if motion.runs == 0:
                return NEEDS_START, i, -1, m
            _load_piece(model, stepper, leg, polynomial, step)
        elif code == EVALUATE:
            out = evaluated[m]
            out.stamp_ns, out.kind, out.angle, out.torque = step.end_ns, step.detail, math.nan, math.nan
            if motion.runs != 0:
                _evaluate(sensor, signature, leg, polynomial, stepper, step, out)
            for j in range(force.shape[0]):
                forces[m, j] = force[j] if motion.runs != 0 else math.nan
            m += 1
        elif code == PUSH:
            if motion.runs != 0:
                _push(load, leg, polynomial, step)
        elif code == START:
            return NEEDS_START, i, -1, m
        elif code == LEAVE:
            return LEFT, i, -1, m
        elif code == REPORT:
            return REPORTED, i, -1, m
        i += 1
    return DONE, i, -1, m

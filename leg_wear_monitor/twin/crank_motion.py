"""Crank motion from filtered samples: steps for the leg, filter, spline, rest (physics.md section 9).

A spline node is a crank sample at least a fixed time after the previous node. Once enough later samples have
arrived, it is smoothed and the leg is advanced to it; the leg is evaluated at all samples up to it.
"""

import math
from typing import NamedTuple

import numpy as np

from leg_wear_monitor.compiled.kernel import Record, Records, kernel, new_records, record_of
from leg_wear_monitor.twin import CRANK, KINDS, LOAD
from leg_wear_monitor.twin.sample import (
    BANDWIDTH_HZ,
    BRIDGE_LIMIT_S,
    FAULTS,
    GAIT_SAMPLE,
    GATE_RAD,
    REORDER_WINDOW_S,
    TrackerSettings,
)

# Steps: the tracker's instructions to the leg, in the order of stamps.


# Codes of steps: set the leg in motion; move it along a polynomial; rest; evaluate it at a sample; stop
# following; report an event only; push the foot at a sample of its load.
START, MOVE, REST, EVALUATE, LEAVE, REPORT, PUSH = range(7)

# Reasons of LEAVE, then events of REPORT.
LOST_IN_GAP, LOST_BY_OUTLIERS, LOST_BY_OVERFLOW, LOST_BY_JUMP = range(4)
STOPPED, MOVING, REVERSED = range(4, 7)

STEP = np.dtype(
    [
        ("code", "i8"),  # one of the codes above
        ("begin_ns", "i8"),  # stamp at which it begins
        ("end_ns", "i8"),  # stamp at which it ends
        ("detail", "i8"),  # EVALUATE: kind of the sample; LEAVE: reason; REPORT: event
        ("turns", "i8"),  # whole crank turns to add to the angle of the motion
        ("bridged_ns", "i8"),  # part of the duration that bridges a gap
        ("torque", "f8"),  # drive torque measured at a sample [N m]
        # START: angle [rad], speed, acceleration; MOVE: coefficients over time [s]; PUSH: force x and y [N]
        ("motion", "f8", (6,)),
    ]
)

SPLINE_NODE = np.dtype(
    [
        ("angle", "f8"),  # crank angle [rad]
        ("speed", "f8"),  # crank speed [rad/s]
        ("acceleration", "f8"),  # crank acceleration [rad/s^2]
    ]
)

Steps = Records
"""Records of `STEP`, shape (m,)."""


def room_for_steps(m: int) -> Steps:
    """Empty records (m,) of steps."""
    return new_records(m, STEP)


@kernel
def add_step(steps, n, code, begin_ns, end_ns, detail):
    """Write step n with zero motion; returns n + 1."""
    step = steps[n]
    step.code, step.begin_ns, step.end_ns, step.detail = code, begin_ns, end_ns, detail
    step.turns, step.bridged_ns, step.torque = 0, 0, 0.0
    for i in range(6):
        step.motion[i] = 0.0
    return n + 1


@kernel
def join_smoothly(before, after, h, out_polynomial):
    """Coefficients (6,) of the quintic over a time h [s] between two spline nodes; physics.md section 9."""
    far = after.angle - (before.angle + h * (before.speed + 0.5 * h * before.acceleration))
    fast = h * (after.speed - (before.speed + h * before.acceleration))
    bent = 0.5 * h * h * (after.acceleration - before.acceleration)
    out_polynomial[0], out_polynomial[1] = before.angle, before.speed
    out_polynomial[2] = 0.5 * before.acceleration
    out_polynomial[3] = (10.0 * far - 4.0 * fast + bent) / h**3
    out_polynomial[4] = (-15.0 * far + 7.0 * fast - 2.0 * bent) / h**4
    out_polynomial[5] = (6.0 * far - 3.0 * fast + bent) / h**5


# State of the crank tracker: settings, counts, clocks, filter, queues.


ARRIVALS, QUEUE = 2048, 4096  # capacities for samples that wait for their order, and for the leg


def _nanoseconds(time_s: float) -> int:
    return round(1.0e9 * time_s)


# Constants of the tracker. Noise refers to 200 Hz; only the ratio of both noises and, for the gate, the first
# noise have an effect.
ANGLE_NOISE, VELOCITY_NOISE = (sigma**2 * (1.0 / 200.0) for sigma in (1.0e-3, 0.05))  # rad^2 s, rad^2/s
VELOCITY_GATE = 0.5  # rad/s, as `GATE_RAD` of the angle
MARK_GAP_NS = 50_000_000  # shortest gap that is counted
BACKWARD_JUMP_NS = 1_000_000_000  # a larger backward jump of stamps begins a new time base
ACQUIRE_NS = 100_000_000  # time for which samples must agree before the leg is set in motion
STOP_HOLD_NS = 300_000_000  # time of slow motion before the crank is at rest
SETTLE_NS = 500_000_000  # time of a speed within tolerance, or beyond, before the state changes
REORDER_WINDOW_NS, BRIDGE_LIMIT_NS = _nanoseconds(REORDER_WINDOW_S), _nanoseconds(BRIDGE_LIMIT_S)
RUN_UP_NS = _nanoseconds(0.8 / BANDWIDTH_HZ)  # time for a smooth start from rest
LONGEST_SPREAD = 1.0 / (2.0 * np.pi * BANDWIDTH_HZ)  # s: longest time that a sample's noise is spread over
JERK = ANGLE_NOISE * (2.0 * np.pi * BANDWIDTH_HZ) ** 6  # rad^2/s^5: power density of the jerk
# a crank is slow below this speed [rad/s], or below this fraction of the commanded speed
_STOP_SPEED, _STOP_FRACTION = 0.1, 0.2

TRACKER_MODEL = np.dtype(
    [
        ("lag_ns", "i8"),  # time of samples after a spline node
        ("node_interval_ns", "i8"),  # least time between spline nodes
        ("stop_speed", "f8"),  # least speed of a moving crank [rad/s]
        ("slowest", "f8"),  # least speed of a gait in step [rad/s]
        ("fastest", "f8"),  # largest speed of a gait within the tolerance [rad/s]
        ("commanded_speed", "f8"),  # crank speed of the gait [rad/s]
        ("largest_speed", "f8"),  # largest plausible speed [rad/s]
    ]
)
"""Constants: the settings, with times in ns and everything else in SI units."""

TRACKER_COUNTS = np.dtype(
    [
        # samples
        ("received", "i8"),  # all
        ("used", "i8", (len(KINDS),)),  # with a used value of each kind
        ("duplicates", "i8"),  # repeated
        ("late", "i8"),  # behind the released stamps
        ("stray_stamps", "i8"),  # with a stamp far from all others
        ("outliers", "i8"),  # with an angle beyond the gate
        ("velocity_outliers", "i8"),  # with a velocity beyond the gate
        ("load_outliers", "i8"),  # with a foot load that both neighbours contradict
        # events
        ("gaps_bridged", "i8"),  # bridged gaps
        ("lost", "i8"),  # losses of tracking
        ("backward_jumps", "i8"),  # backward jumps of stamps
        ("reversals", "i8"),  # reversals of the crank
        # times
        ("bridged_ns", "i8"),  # in bridged gaps
        ("standing_ns", "i8"),  # at rest
        ("unmonitored_ns", "i8"),  # without tracking
        ("faults", "i8", (len(FAULTS),)),  # samples with each fault
    ]
)

TRACKER_CLOCK = np.dtype(
    [
        ("newest_ns", "i8"),  # youngest received stamp
        ("newest_of_ns", "i8", (len(KINDS),)),  # youngest stamp of each kind
        ("released_ns", "i8"),  # stamp up to which samples are released
        ("released_kinds", "i8"),  # kinds released at that stamp, as bits
        ("waiting", "i8"),  # number of waiting arrivals
        ("head", "i8"),  # begin of the queue
        ("tail", "i8"),  # end of the queue
        ("last_crank_ns", "i8"),  # stamp of the last used crank sample, 0 if none
        ("refused", "i8"),  # outliers since then
        ("filter_ns", "i8"),  # stamp of the estimate
        ("acquiring_ns", "i8"),  # stamp of the first crank sample since the last loss
        ("last_node_ns", "i8"),  # stamp of the last spline node
        ("out_since_ns", "i8"),  # stamp of the begin of the present loss of tracking
        ("followed", "i8"),  # 1 while the leg is in motion or at rest
        ("at_rest", "i8"),  # 1 at rest
        ("rested_ns", "i8"),  # stamp up to which that rest is reported
        ("slow_since_ns", "i8"),  # stamp of the begin of slow motion, 0 if not slow
        ("tracking", "i8"),  # IS_… of `crank_motion`
        ("tolerance_since_ns", "i8"),  # stamp since which the speed is within tolerance, or beyond
        ("in_tolerance", "i8"),  # 1 within tolerance
        ("direction", "i8"),  # 1 or -1, 0 if unknown
        ("turns", "i8"),  # whole crank turns, counted separately
        ("velocity_credit", "i8"),  # successive velocities that agreed with the angles
        ("period_ns", "i8"),  # shortest recent time between crank samples
        ("foot_force", "f8"),  # largest foot load that two neighbouring samples share in recent turns [N]
    ]
)

_ESTIMATE = [
    ("angle", "f8"),  # crank angle [rad]
    ("speed", "f8"),  # [rad/s]
    ("acceleration", "f8"),  # [rad/s^2]
    # covariances of angle, speed and acceleration
    ("p00", "f8"),  # angle [rad^2]
    ("p01", "f8"),  # angle and speed [rad^2/s]
    ("p02", "f8"),  # angle and acceleration [rad^2/s^2]
    ("p11", "f8"),  # speed [rad^2/s^2]
    ("p12", "f8"),  # speed and acceleration [rad^2/s^3]
    ("p22", "f8"),  # acceleration [rad^2/s^4]
]
CRANK_ESTIMATE = np.dtype(_ESTIMATE)

QUEUED = np.dtype(
    [
        ("stamp_ns", "i8"),  # stamp of its header
        ("kind", "i8"),  # kind of `twin.sample`
        ("torque", "f8"),  # drive torque [N m], NaN if absent
        ("foot_force", "f8", (2,)),  # foot load [N], only in its samples
        # crank samples only; pairs are angle and velocity
        ("step", "f8"),  # time since the previous crank sample [s]
        ("bridged", "i8"),  # 1 if that is a bridged gap
        *_ESTIMATE,  # predicted from the previous samples
        ("innovation_variance", "f8", (2,)),  # [rad^2, rad^2/s^2]; 0 for an unused value
        ("innovation", "f8", (2,)),  # measured minus predicted [rad, rad/s]
        ("gain", "f8", (2, 3)),  # angle, speed and acceleration per innovation
    ]
)
"""A sample that waits for the leg, with the smoother's data."""


TRACKER_STATE = np.dtype(
    [
        ("counts", TRACKER_COUNTS),
        ("clock", TRACKER_CLOCK),
        ("estimate", CRANK_ESTIMATE),  # after the last sample
        ("node", SPLINE_NODE),  # the last spline node, which the leg has reached
        ("ahead", SPLINE_NODE),  # the next piece, during its computation
        ("candidate", GAIT_SAMPLE),  # sample that may begin a new time base, stamp 0 if there is none
    ]
)
"""State of the tracker without its queues."""


class TrackerState(NamedTuple):
    """Complete state of the tracker for its kernels.

    The fields of `TRACKER_STATE`; ``arrivals`` (ARRIVALS,): `GAIT_SAMPLE` that wait for their order;
    ``queue``
    (QUEUE,): `QUEUED` that wait for the leg.
    """

    counts: Record
    clock: Record
    estimate: Record
    node: Record
    ahead: Record
    candidate: Record
    arrivals: Records
    queue: Records


def tracker_model(settings: TrackerSettings) -> Records:
    """The settings as a record."""
    models, speed = new_records(1, TRACKER_MODEL), abs(settings.commanded_speed_radps)
    model = record_of(models)
    model.lag_ns = _nanoseconds(settings.lag_s)
    model.node_interval_ns = _nanoseconds(settings.knot_interval_s)
    model.stop_speed = min(_STOP_SPEED, _STOP_FRACTION * speed)
    model.slowest = speed * (1.0 - settings.speed_tolerance)
    model.fastest = speed * (1.0 + settings.speed_tolerance)
    model.commanded_speed = settings.commanded_speed_radps
    model.largest_speed = settings.largest_speed
    return models


# Kalman filter and modified Bryson-Frazier smoother of the crank's motion (physics.md section 9).
#
# The crank's angle, speed and acceleration are driven by a jerk that is white noise. With the sensor's noise
# spread over the time between samples, the filter's bandwidth is (jerk / noise)^(1/6) rad/s at any rate. The
# smoother follows Bierman (1973, *Fixed interval smoothing with discrete measurements*): it propagates an
# adjoint vector back over the later samples and needs no matrix inverse.


_TURN = 2.0 * math.pi
_WIDEST_GATE = 2.5  # rad: above it, an innovation's direction is ambiguous (near half a turn)
_SIGMAS = 5.0  # standard deviations of the prediction that are added to a gate


@kernel
def begin_filter(model, angle, out_estimate):
    """Initialise the estimate by a first angle [rad], reduced to [0, 2 pi), and the commanded speed."""
    e, speed = out_estimate, model.commanded_speed
    e.angle, e.speed, e.acceleration = angle - _TURN * math.floor(angle / _TURN), speed, 0.0
    e.p00, e.p01, e.p02 = ANGLE_NOISE / LONGEST_SPREAD, 0.0, 0.0
    e.p11, e.p12, e.p22 = speed**2, 0.0, (speed / LONGEST_SPREAD) ** 2


@kernel
def predict(h, estimate):
    """Propagate the filter's state and covariance by a time h [s], in place."""
    e, x, v, a = estimate, estimate.angle, estimate.speed, estimate.acceleration
    e.angle, e.speed = x + h * (v + 0.5 * h * a), v + h * a
    p00, p01, p02, p11, p12, p22 = e.p00, e.p01, e.p02, e.p11, e.p12, e.p22
    q, g = JERK * h, 0.5 * h * h
    # rows of F P, F = [1 h g; 0 1 h; 0 0 1]
    a00, a01, a02 = p00 + h * p01 + g * p02, p01 + h * p11 + g * p12, p02 + h * p12 + g * p22
    a11, a12 = p11 + h * p12, p12 + h * p22
    e.p00 = a00 + h * a01 + g * a02 + q * h**4 / 20.0
    e.p01 = a01 + h * a02 + q * h**3 / 8.0
    e.p02 = a02 + q * h**2 / 6.0
    e.p11 = a11 + h * a12 + q * h**2 / 3.0
    e.p12 = a12 + 0.5 * q * h
    e.p22 = p22 + q


@kernel
def note_prediction(estimate, step, out_row):
    """Begin the queue's row of a crank sample ``step`` [s] after the last one: the predicted state."""
    e, row = estimate, out_row
    row.step, row.bridged = step, 0
    row.angle, row.speed, row.acceleration = e.angle, e.speed, e.acceleration
    row.p00, row.p01, row.p02, row.p11, row.p12, row.p22 = e.p00, e.p01, e.p02, e.p11, e.p12, e.p22
    row.innovation_variance[0], row.innovation_variance[1] = 0.0, 0.0


@kernel
def _correct(i, variance, innovation, estimate, row):
    """Correct by a measurement of state i (0 angle, 1 speed); store the smoother's data in the row."""
    e = estimate
    b0 = e.p00 if i == 0 else e.p01  # column i of P
    b1 = e.p01 if i == 0 else e.p11
    b2 = e.p02 if i == 0 else e.p12
    s = (b0 if i == 0 else b1) + variance
    k0, k1, k2 = b0 / s, b1 / s, b2 / s
    e.angle += k0 * innovation
    e.speed += k1 * innovation
    e.acceleration += k2 * innovation
    e.p00 -= k0 * b0
    e.p01 -= k0 * b1
    e.p02 -= k0 * b2
    e.p11 -= k1 * b1
    e.p12 -= k1 * b2
    e.p22 -= k2 * b2
    row.innovation_variance[i], row.innovation[i] = s, innovation
    row.gain[i, 0], row.gain[i, 1], row.gain[i, 2] = k0, k1, k2


@kernel
def update(h, step, angle, velocity, trusted, estimate, row):
    """Filter a crank sample (angle [rad], velocity [rad/s]) and fill its row of the queue.

    It is h [s] after the filter's time and ``step`` [s] after the last used sample. Its velocity is used if
    ``trusted``.

    Returns
    -------
    used, verdict
        True if the sample passed its gate (otherwise the filter contains the prediction); 1 for a velocity
        that agrees with the angles, -1 for one that does not, 0 without velocity.
    """
    predict(h, estimate)
    note_prediction(estimate, step, row)
    innovation = angle - estimate.angle
    innovation -= _TURN * math.floor(innovation / _TURN + 0.5)
    if not abs(innovation) < min(_WIDEST_GATE, GATE_RAD + _SIGMAS * math.sqrt(estimate.p00)):
        return False, 0
    spread = min(max(step, 1.0e-6), LONGEST_SPREAD)
    _correct(0, ANGLE_NOISE / spread, innovation, estimate, row)
    if not math.isfinite(velocity):
        return True, 0
    innovation = velocity - estimate.speed
    if not abs(innovation) < VELOCITY_GATE + _SIGMAS * math.sqrt(estimate.p11):
        return True, -1
    if trusted:
        _correct(1, VELOCITY_NOISE / spread, innovation, estimate, row)
    return True, 1


@kernel
def _adjoin(i, row, l0, l1, l2):
    """Adjoint vector (l0, l1, l2) before a measurement of state i, from that after it."""
    s, gain = row.innovation_variance[i], row.gain
    if s > 0.0:
        along = gain[i, 0] * l0 + gain[i, 1] * l1 + gain[i, 2] * l2 + row.innovation[i] / s
        if i == 0:
            l0 -= along
        else:
            l1 -= along
    return l0, l1, l2


@kernel
def smooth(queue, spline_node, tail, out_node):
    """Smoothed crank motion at index ``spline_node`` of the queue, from all samples before index ``tail``."""
    l0, l1, l2 = 0.0, 0.0, 0.0
    for j in range(tail - 1, spline_node - 1, -1):
        row = queue[j]
        if row.kind != CRANK:
            continue
        l0, l1, l2 = _adjoin(1, row, l0, l1, l2)
        l0, l1, l2 = _adjoin(0, row, l0, l1, l2)
        if j > spline_node:
            h = row.step
            l2 += h * (l1 + 0.5 * h * l0)
            l1 += h * l0
    row = queue[spline_node]
    out_node.angle = row.angle - (row.p00 * l0 + row.p01 * l1 + row.p02 * l2)
    out_node.speed = row.speed - (row.p01 * l0 + row.p11 * l1 + row.p12 * l2)
    out_node.acceleration = row.acceleration - (row.p02 * l0 + row.p12 * l1 + row.p22 * l2)


_RESTING = 0.02  # largest change of the angle of a resting crank [rad]
_PATIENCE = 10  # largest duration of a start, in settling times

IS_STOPPED, IS_STARTING, IS_IN_STEP, IS_OUT_OF_STEP = range(4)


# A sample of the foot load is an outlier if it departs from both neighbours by more than _FAR times the
# largest force of recent turns, and they from each other by less than _AGREED of that. A force is known once
# two neighbours have it; it decays over _TURNS. In 10 000 steps of the synthetic leg at 40 to 1000 Hz, with
# noise of 5 % of the peak, no heel strike was an outlier whose transient, a single sample at 100 Hz, is up to
# 1.5 times the peak of stance. Noise in the air is none by the least known force, the start by the first.
_FAR, _AGREED, _TURNS = 2.0, 0.1, 10.0
_LEAST_LOAD_N, FIRST_LOAD_N = 100.0, 500.0


@kernel
def _apart(one, other):
    """Size of the difference of two forces (2,)."""
    return math.hypot(one[0] - other[0], one[1] - other[1])


@kernel
def judge_load(state, sample):
    """Judge the last queued sample of the foot load by its two neighbours.

    An outlier is counted, and gets the force between both neighbours.
    """
    clock, queue, at, before = state.clock, state.queue, -1, -1
    for j in range(clock.tail - 1, clock.head - 1, -1):
        if queue[j].kind == LOAD:
            if at >= 0:
                before = j
                break
            at = j
    if before < 0:
        return
    force, first, last = queue[at].foot_force, queue[before].foot_force, sample.foot_force_n
    away, passed_ns = min(_apart(force, first), _apart(force, last)), sample.stamp_ns - queue[at].stamp_ns
    turns = 1.0e-9 * passed_ns * abs(state.estimate.speed) / _TURN
    known = max(clock.foot_force * math.exp(-turns / _TURNS), _LEAST_LOAD_N)
    if away > _FAR * known and _apart(first, last) < _AGREED * away:
        state.counts.load_outliers += 1
        state.counts.used[LOAD] -= 1
        w = passed_ns / (sample.stamp_ns - queue[before].stamp_ns)
        for i in range(2):
            force[i] = w * first[i] + (1.0 - w) * last[i]
    else:
        beside = max(math.hypot(first[0], first[1]), math.hypot(last[0], last[1]))
        known = max(known, min(math.hypot(force[0], force[1]), beside))
    clock.foot_force = known


@kernel
def evaluate_up_to(state, spline_node, steps, n):
    """Add steps that evaluate the leg at all queued samples before an index, and drop these samples.

    Samples of the foot load push it instead.
    """
    clock = state.clock
    for j in range(clock.head, spline_node):
        row = state.queue[j]
        if row.kind == LOAD:
            n = add_step(steps, n, PUSH, row.stamp_ns, row.stamp_ns, 0)
            steps[n - 1].motion[0], steps[n - 1].motion[1] = row.foot_force[0], row.foot_force[1]
            continue
        n = add_step(steps, n, EVALUATE, row.stamp_ns, row.stamp_ns, row.kind)
        steps[n - 1].torque = row.torque
    clock.head = spline_node
    return n


@kernel
def lose(state, stamp, reason, steps, n):
    """End tracking at a stamp: release waiting samples without the leg; the next crank sample restarts."""
    clock = state.clock
    if clock.last_crank_ns != 0:
        state.counts.lost += 1
    n = add_step(steps, n, LEAVE, stamp, stamp, reason)
    n = evaluate_up_to(state, clock.tail, steps, n)
    if clock.followed != 0:
        clock.out_since_ns = clock.last_node_ns
    clock.head, clock.tail, clock.last_crank_ns = 0, 0, 0
    clock.followed, clock.at_rest, clock.slow_since_ns, clock.tolerance_since_ns = 0, 0, 0, 0
    clock.tracking, clock.in_tolerance, clock.direction = IS_STARTING, 0, 0
    return n


@kernel
def _next_spline_node(model, state):
    """Index of the next spline node in the queue; -1 if it, or a later sample that it needs, is missing."""
    clock = state.clock
    due = clock.acquiring_ns + ACQUIRE_NS
    if clock.followed != 0:
        due = clock.last_node_ns + model.node_interval_ns
    newest = clock.last_crank_ns
    if newest == 0 or newest - due < model.lag_ns:
        return -1
    for j in range(clock.head, clock.tail):
        row = state.queue[j]
        if row.kind == CRANK and row.stamp_ns >= due:
            return j if newest - row.stamp_ns >= model.lag_ns else -1
    return -1


@kernel
def _drop_turns(state):
    """Count whole turns separately, so that angles stay small and exact."""
    turns = math.floor(state.ahead.angle / _TURN)
    if turns != 0.0:
        shift = turns * _TURN
        state.clock.turns += int(turns)
        state.ahead.angle -= shift
        state.node.angle -= shift
        state.estimate.angle -= shift
        for j in range(state.clock.head, state.clock.tail):
            state.queue[j].angle -= shift


@kernel
def _evaluate_speed(model, clock, stamp, speed):
    """Update the tracking state from the time that the speed was within or beyond the tolerance."""
    within = 1 if model.slowest <= abs(speed) <= model.fastest else 0
    if clock.tolerance_since_ns == 0 or within != clock.in_tolerance:
        clock.tolerance_since_ns, clock.in_tolerance = stamp, within
    patience = SETTLE_NS
    if within == 0 and clock.tracking == IS_STARTING:
        patience *= _PATIENCE
    if stamp - clock.tolerance_since_ns >= patience:
        clock.tracking = IS_IN_STEP if within != 0 else IS_OUT_OF_STEP


@kernel
def _stops(model, state, stamp, node):
    """True if the crank is at rest at a spline node; updates the fields of rest in the clock."""
    clock, least = state.clock, model.stop_speed
    if clock.at_rest != 0:
        if abs(node.speed) > 2.0 * least or abs(node.angle - state.node.angle) > _RESTING:
            clock.slow_since_ns, clock.tolerance_since_ns, clock.tracking = 0, 0, IS_STARTING
            return False
        return True
    if abs(node.speed) > least:
        clock.slow_since_ns = 0
    elif clock.slow_since_ns == 0:
        clock.slow_since_ns = stamp
    return clock.slow_since_ns != 0 and stamp - clock.slow_since_ns >= STOP_HOLD_NS


@kernel
def _report_direction(model, state, stamp, speed, steps, n):
    """Update the direction of rotation; add a report of a reversal."""
    clock = state.clock
    if abs(speed) > model.stop_speed:
        direction = 1 if speed > 0.0 else -1
        if clock.direction == -direction:
            state.counts.reversals += 1
            n = add_step(steps, n, REPORT, stamp, stamp, REVERSED)
        clock.direction = direction
    return n


@kernel
def _bridged(state, spline_node):
    """Total time [ns] of bridged gaps up to a spline node."""
    total = 0
    for j in range(state.clock.head, spline_node + 1):
        row = state.queue[j]
        if row.kind == CRANK and row.bridged != 0:
            total += round(1.0e9 * row.step)
    return total


@kernel
def _move(model, state, spline_node, stamp, steps, n):
    """Add the steps from the last spline node to the next: motion or rest."""
    clock, ahead, rested = state.clock, state.ahead, state.clock.at_rest != 0
    rests = _stops(model, state, stamp, ahead)
    if rests:
        ahead.speed, ahead.acceleration = 0.0, 0.0
    begin = clock.last_node_ns
    if rested:
        # a rest is reported up to a run-up time before the node, to leave time for a smooth start
        begin = max(clock.rested_ns, stamp - RUN_UP_NS)
        if begin > clock.rested_ns:
            state.counts.standing_ns += begin - clock.rested_ns
            n = add_step(steps, n, REST, clock.rested_ns, begin, 0)
            clock.rested_ns = begin
        if rests:
            ahead.angle = state.node.angle
            return n
        n = add_step(steps, n, REPORT, begin, begin, MOVING)
        clock.at_rest = 0
    bridged = _bridged(state, spline_node)
    state.counts.bridged_ns += bridged
    move = steps[n]
    n = add_step(steps, n, MOVE, begin, stamp, 0)
    move.turns, move.bridged_ns = clock.turns, bridged
    join_smoothly(state.node, ahead, 1.0e-9 * (stamp - begin), move.motion)
    if rests:
        clock.at_rest, clock.rested_ns, clock.tracking = 1, stamp, IS_STOPPED
        n = add_step(steps, n, REPORT, stamp, stamp, STOPPED)
    return n


@kernel
def reach_spline_nodes(model, state, steps, n):
    """Advance to all spline nodes with enough later samples; add steps from index n; return their number."""
    clock, node, ahead, largest = state.clock, state.node, state.ahead, model.largest_speed
    while True:
        spline_node = _next_spline_node(model, state)
        if spline_node < 0:
            return n
        stamp = state.queue[spline_node].stamp_ns
        smooth(state.queue, spline_node, clock.tail, ahead)
        if not (abs(ahead.speed) <= largest and abs(ahead.acceleration) <= largest**2):
            return lose(state, stamp, LOST_BY_OUTLIERS, steps, n)
        _drop_turns(state)
        if clock.followed == 0:
            n = evaluate_up_to(state, spline_node, steps, n)
            start = steps[n]
            n = add_step(steps, n, START, stamp, stamp, 0)
            start.motion[0], start.motion[1] = ahead.angle, ahead.speed
            start.motion[2] = ahead.acceleration
            start.turns = clock.turns
            state.counts.unmonitored_ns += max(0, stamp - clock.out_since_ns)
            clock.followed = 1
        else:
            n = _move(model, state, spline_node, stamp, steps, n)
        if clock.at_rest == 0:
            n = _report_direction(model, state, stamp, ahead.speed, steps, n)
            _evaluate_speed(model, clock, stamp, ahead.speed)
        node.angle, node.speed, node.acceleration = ahead.angle, ahead.speed, ahead.acceleration
        clock.last_node_ns = stamp
        n = evaluate_up_to(state, spline_node + 1, steps, n)

"""The leg along the tracker's steps: advanced from sample to sample, looked at, compared with the torque."""

import math

from leg_wear_monitor.dynamics.clearance.advance import advance_clearances
from leg_wear_monitor.dynamics.clearance.contact import F_T
from leg_wear_monitor.dynamics.clearance.model import ANGLE
from leg_wear_monitor.dynamics.joint.contact_event import F_N
from leg_wear_monitor.dynamics.run.protocol import DONE
from leg_wear_monitor.dynamics.run.run_statistics import TORQUE, TORQUE_SQUARED
from leg_wear_monitor.kernel import entry, kernel
from leg_wear_monitor.twin.follower.compare import compare
from leg_wear_monitor.twin.follower.state import (
    AFRESH,
    ANCHOR,
    ANCHORED,
    BASE,
    CUT,
    CUT_RISES,
    CUT_TURN,
    CYCLE_BRIDGED,
    FAILED_AT,
    FAILURES,
    FILTERING,
    IMPULSE,
    LOOKS,
    MEAN_TORQUE,
    MOVING_NS,
    PIECE_BEGIN,
    PIECE_END,
    RUNNING,
    TIME,
    TORQUE_IMPULSE,
    TORQUE_SQUARES,
    TORQUE_TIME,
    TURNS_BEFORE,
    WHOLE,
)
from leg_wear_monitor.twin.steps import EVALUATE, LEAVE, MOVE, REPORT, START

# why the leg's kernel returns before the last step: a cycle has ended; somebody must start the leg, leave it,
# or take note of a happening. Other values are those of dynamics.run.
CYCLE, NEEDS_START, LEFT, TOLD = range(100, 104)

_TURN = 2.0 * math.pi
_REBASE = 65536  # intervals: even, since the stepper renews things every other interval


@kernel
def _angle_at(polynomial, tau):
    """Angle [rad] of a piece a time tau [s] after its begin."""
    angle = 0.0
    for i in range(6, 0, -1):
        angle = angle * tau + polynomial[i]
    return angle


@kernel
def _find_cut(leg, begin):
    """Where in its piece, from a stamp on, the crank passes the next 0, either way: a gait cycle may end."""
    mark, polynomial = leg.mark, leg.polynomial
    mark[CUT] = 0
    origin = mark[PIECE_BEGIN]
    low, high = 1.0e-9 * (begin - origin), 1.0e-9 * (mark[PIECE_END] - origin)
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
    mark[CUT] = min(origin + math.ceil(1.0e9 * high), mark[PIECE_END])
    mark[CUT_TURN] = mark[TURNS_BEFORE] + int(up if rising else down)
    mark[CUT_RISES] = 1 if rising else 0


@kernel
def _load_piece(model, stepper, leg, step):
    """Take up the next piece of the crank's motion; times and angles are kept small."""
    mark = leg.mark
    if stepper.intervals[0] >= _REBASE:
        stepper.intervals[0] -= _REBASE
        mark[BASE] += round(_REBASE * model.interval * 1.0e9)
        for k in range(stepper.recent.shape[0]):
            stepper.recent[k, 0] -= _REBASE * model.interval
            stepper.recent[k, 2] -= _REBASE * model.interval
    if step.begin_ns != mark[PIECE_END]:  # it rested meanwhile
        mark[BASE] += step.begin_ns - mark[PIECE_END]
        mark[FILTERING] = 0
    turns = step.turns - mark[TURNS_BEFORE]
    if turns != 0:
        stepper.drive[ANGLE] -= turns * _TURN
    mark[PIECE_BEGIN], mark[PIECE_END], mark[TURNS_BEFORE] = step.begin_ns, step.end_ns, step.turns
    mark[CYCLE_BRIDGED] += step.bridged_ns
    mark[MOVING_NS] += step.end_ns - step.begin_ns
    leg.polynomial[0] = 1.0e-9 * (step.begin_ns - mark[BASE])
    for i in range(6):
        leg.polynomial[1 + i] = step.motion[i]
    _find_cut(leg, step.begin_ns)


@kernel
def _look(sensor, signature, leg, stepper, step, looks):
    """Note the leg at a sample, NaN where it does not run."""
    mark, value, m = leg.mark, leg.value, leg.mark[LOOKS]
    mark[LOOKS] += 1
    looks.stamp[m, 0], looks.stamp[m, 1] = step.end_ns, step.detail
    running = mark[RUNNING] != 0
    if running and value[TIME] > 0.0:
        value[MEAN_TORQUE] = value[IMPULSE] / value[TIME]
        value[IMPULSE], value[TIME] = 0.0, 0.0
    angle = math.nan
    if running:
        at = min(max(step.end_ns, mark[PIECE_BEGIN]), mark[PIECE_END])
        angle = _angle_at(leg.polynomial, 1.0e-9 * (at - mark[PIECE_BEGIN]))
        angle -= _TURN * math.floor(angle / _TURN)
    looks.figure[m, 0] = angle
    looks.figure[m, 1] = value[MEAN_TORQUE] if running else math.nan
    for k in range(leg.force.shape[0]):
        looks.force[m, k] = leg.force[k] if running else math.nan
    if running and mark[PIECE_BEGIN] <= step.end_ns <= mark[PIECE_END] and math.isfinite(step.torque):
        compare(sensor, signature, leg, stepper, step.torque)


@entry
def follow(model, feeds_back, stepper, statistics, work, sensor, signature, leg, steps, first, n, looks):
    """Follow steps from index ``first`` to n; ``stepper`` is the ClearanceState.

    Returns
    -------
    reason, i, k
        DONE, or why the caller has to act before going on at step i; k is the clearance joint concerned, -1
        if none.
    """
    mark, value, i = leg.mark, leg.value, first
    while i < n:
        step, code = steps[i], steps[i].code
        if mark[RUNNING] != 0:
            until = min(step.end_ns, mark[PIECE_END]) if code == EVALUATE else mark[PIECE_END]
            cuts = mark[CUT] != 0 and mark[CUT] <= until
            if cuts:
                until = mark[CUT]
            impulse, time, before = (
                statistics.drive_integral[TORQUE],
                statistics.time[0],
                stepper.intervals[0],
            )
            squares = statistics.drive_integral[TORQUE_SQUARED]
            status, k = advance_clearances(
                model, feeds_back, stepper, leg.polynomial, 1.0e-9 * (until - mark[BASE]), statistics, work
            )
            if stepper.intervals[0] > before:
                impulse, time = statistics.drive_integral[TORQUE] - impulse, statistics.time[0] - time
                value[IMPULSE] += impulse
                value[TIME] += time
                value[TORQUE_IMPULSE] += impulse
                value[TORQUE_TIME] += time
                value[TORQUE_SQUARES] += statistics.drive_integral[TORQUE_SQUARED] - squares
                for j in range(leg.force.shape[0]):
                    leg.force[j] = math.hypot(work.start[j, F_N], work.start[j, F_T])
            if status != DONE:
                mark[RUNNING], mark[AFRESH] = 0, 1
                mark[FAILURES] += 1
                mark[FAILED_AT] = mark[BASE] + round(1.0e9 * stepper.intervals[0] * model.interval)
                return status, i, k
            if cuts:
                # back at the 0 where it began, a cycle is none
                mark[WHOLE] = 1 if mark[ANCHORED] != 0 and mark[ANCHOR] != mark[CUT_TURN] else 0
                mark[ANCHORED], mark[ANCHOR] = 1, mark[CUT_TURN]
                _find_cut(leg, until)
                return CYCLE, i, until
        if code == MOVE:
            if mark[RUNNING] == 0:
                return NEEDS_START, i, -1
            _load_piece(model, stepper, leg, step)
        elif code == EVALUATE:
            _look(sensor, signature, leg, stepper, step, looks)
        elif code == START:
            return NEEDS_START, i, -1
        elif code == LEAVE:
            return LEFT, i, -1
        elif code == REPORT:
            return TOLD, i, -1
        i += 1
    return DONE, i, -1

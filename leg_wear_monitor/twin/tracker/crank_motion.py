"""From filtered samples to the crank's motion: smooth pieces between knots, rest, and how the gait goes.

A knot is a crank sample some time after the knot before; once enough samples after it are there it is
smoothed, and the leg can go there. All samples up to it are looked at on the way.
"""

import math

from leg_wear_monitor.kernel import kernel
from leg_wear_monitor.twin.sample import CRANK
from leg_wear_monitor.twin.steps import (
    BRIDGE_NS,
    LEAVE,
    LOOK,
    LOST_BY_OUTLIERS,
    MOVE,
    MOVING,
    REST,
    REVERSED,
    START,
    STOPPED,
    TELL,
    TURNS,
    add_step,
    join_smoothly,
)
from leg_wear_monitor.twin.tracker.crank_filter import smooth
from leg_wear_monitor.twin.tracker.state import (
    ACQUIRE,
    ACQUIRING,
    BRIDGED,
    BRIDGED_NS,
    DIRECTION,
    FASTEST,
    FOLLOWED,
    HEAD,
    LAG,
    LARGEST_SPEED,
    LAST_CRANK,
    LAST_SPLINE_NODE,
    LOST_TIMES,
    OUT_SINCE,
    RESTED,
    RESTS,
    REVERSALS,
    RUN_UP,
    SETTLE,
    SINCE,
    SLOW_SINCE,
    SLOWEST,
    SPLINE_NODE,
    STANDING_NS,
    STEP,
    STOP_HOLD,
    STOP_SPEED,
    TAIL,
    TORQUE_VALUE,
    TRACKING,
    TURN_COUNT,
    UNMONITORED_NS,
    WITHIN,
    X,
)

_TURN = 2.0 * math.pi
_RESTING = 0.02  # rad that a crank at rest may creep before it moves again
_PATIENCE = 10  # times the settling time that a start may take

IS_STOPPED, IS_STARTING, IS_IN_STEP, IS_OUT_OF_STEP = range(4)


@kernel
def look_up_to(state, spline_node, steps, n):
    """Look at all queued samples before index ``spline_node``, and drop them."""
    clock = state.clock
    for j in range(clock[HEAD], spline_node):
        i, stamp = n, state.queue_stamp[j]
        n = add_step(steps, n, LOOK, stamp, stamp, state.queue_kind[j])
        steps.motion[i, 0] = state.queue[j, TORQUE_VALUE]
    clock[HEAD] = spline_node
    return n


@kernel
def lose(state, stamp, reason, steps, n):
    """Lose the crank: what waits is looked at without the leg, and the next crank sample starts afresh."""
    clock = state.clock
    if clock[LAST_CRANK] != 0:
        state.counts[LOST_TIMES] += 1
    n = add_step(steps, n, LEAVE, stamp, stamp, reason)
    n = look_up_to(state, clock[TAIL], steps, n)
    if clock[FOLLOWED] != 0:
        clock[OUT_SINCE] = clock[LAST_SPLINE_NODE]
    clock[HEAD], clock[TAIL], clock[LAST_CRANK] = 0, 0, 0
    clock[FOLLOWED], clock[RESTS], clock[SLOW_SINCE], clock[SINCE] = 0, 0, 0, 0
    clock[TRACKING], clock[WITHIN], clock[DIRECTION] = IS_STARTING, 0, 0
    return n


@kernel
def _next_spline_node(model, state):
    """Index of the next knot in the queue, -1 where it or what must come after it is not there yet."""
    clock, ns = state.clock, model.ns
    due = (
        clock[LAST_SPLINE_NODE] + ns[SPLINE_NODE] if clock[FOLLOWED] != 0 else clock[ACQUIRING] + ns[ACQUIRE]
    )
    newest = clock[LAST_CRANK]
    if newest == 0 or newest - due < ns[LAG]:
        return -1
    for j in range(clock[HEAD], clock[TAIL]):
        if state.queue_kind[j] == CRANK and state.queue_stamp[j] >= due:
            return j if newest - state.queue_stamp[j] >= ns[LAG] else -1
    return -1


@kernel
def _drop_turns(state, out_target):
    """Count whole turns apart, so that angles stay small and exact however long it goes on."""
    turns = math.floor(out_target[0] / _TURN)
    if turns != 0.0:
        shift = turns * _TURN
        state.clock[TURN_COUNT] += int(turns)
        out_target[0] -= shift
        state.target[0] -= shift
        state.filtered[0] -= shift
        for j in range(state.clock[HEAD], state.clock[TAIL]):
            state.queue[j, X] -= shift


@kernel
def _evaluate(model, clock, stamp, speed):
    """Starting, in step or out of it, by how long the speed has been within tolerance or beyond."""
    within = 1 if model.real[SLOWEST] <= abs(speed) <= model.real[FASTEST] else 0
    if clock[SINCE] == 0 or within != clock[WITHIN]:
        clock[SINCE], clock[WITHIN] = stamp, within
    patience = model.ns[SETTLE]
    if within == 0 and clock[TRACKING] == IS_STARTING:
        patience *= _PATIENCE
    if stamp - clock[SINCE] >= patience:
        clock[TRACKING] = IS_IN_STEP if within != 0 else IS_OUT_OF_STEP


@kernel
def _stops(model, state, stamp, target):
    """Whether the crank is at rest at a knot; changes what was known of that."""
    clock, least = state.clock, model.real[STOP_SPEED]
    if clock[RESTS] != 0:
        if abs(target[1]) > 2.0 * least or abs(target[0] - state.target[0]) > _RESTING:
            clock[SLOW_SINCE], clock[SINCE], clock[TRACKING] = 0, 0, IS_STARTING
            return False
        return True
    if abs(target[1]) > least:
        clock[SLOW_SINCE] = 0
    elif clock[SLOW_SINCE] == 0:
        clock[SLOW_SINCE] = stamp
    return clock[SLOW_SINCE] != 0 and stamp - clock[SLOW_SINCE] >= model.ns[STOP_HOLD]


@kernel
def _tell_direction(model, state, stamp, speed, steps, n):
    """Note which way the crank turns, and tell where that changes."""
    clock = state.clock
    if abs(speed) > model.real[STOP_SPEED]:
        direction = 1 if speed > 0.0 else -1
        if clock[DIRECTION] == -direction:
            state.counts[REVERSALS] += 1
            n = add_step(steps, n, TELL, stamp, stamp, REVERSED)
        clock[DIRECTION] = direction
    return n


@kernel
def _bridged(state, spline_node):
    """Time [ns] of bridged gaps up to a knot."""
    total = 0
    for j in range(state.clock[HEAD], spline_node + 1):
        if state.queue_kind[j] == CRANK and state.queue[j, BRIDGED] > 0.0:
            total += round(1.0e9 * state.queue[j, STEP])
    return total


@kernel
def _move(model, state, spline_node, stamp, out_target, steps, n):
    """Steps that bring the leg from the last knot to the next: it moves, or it rests."""
    clock, rested = state.clock, state.clock[RESTS] != 0
    rests = _stops(model, state, stamp, out_target)
    if rests:
        out_target[1], out_target[2] = 0.0, 0.0
    begin = clock[LAST_SPLINE_NODE]
    if rested:
        # a rest is told only up to a while before now, which is time for a smooth start
        begin = max(clock[RESTED], stamp - model.ns[RUN_UP])
        if begin > clock[RESTED]:
            state.counts[STANDING_NS] += begin - clock[RESTED]
            n = add_step(steps, n, REST, clock[RESTED], begin, 0)
            clock[RESTED] = begin
        if rests:
            out_target[0] = state.target[0]
            return n
        n = add_step(steps, n, TELL, begin, begin, MOVING)
        clock[RESTS] = 0
    bridged = _bridged(state, spline_node)
    state.counts[BRIDGED_NS] += bridged
    i = n
    n = add_step(steps, n, MOVE, begin, stamp, 0)
    steps.what[i, TURNS], steps.what[i, BRIDGE_NS] = clock[TURN_COUNT], bridged
    join_smoothly(state.target, out_target, 1.0e-9 * (stamp - begin), steps.motion[i])
    if rests:
        clock[RESTS], clock[RESTED], clock[TRACKING] = 1, stamp, IS_STOPPED
        n = add_step(steps, n, TELL, stamp, stamp, STOPPED)
    return n


@kernel
def reach_spline_nodes(model, state, out_target, steps, n):
    """Go on to all knots that can be reached; steps from index n on, returns their number."""
    clock = state.clock
    while True:
        spline_node = _next_spline_node(model, state)
        if spline_node < 0:
            return n
        stamp = state.queue_stamp[spline_node]
        smooth(state.queue_kind, state.queue, spline_node, clock[TAIL], out_target)
        largest = model.real[LARGEST_SPEED]
        if not (abs(out_target[1]) <= largest and abs(out_target[2]) <= largest**2):
            return lose(state, stamp, LOST_BY_OUTLIERS, steps, n)
        _drop_turns(state, out_target)
        if clock[FOLLOWED] == 0:
            n = look_up_to(state, spline_node, steps, n)
            i = n
            n = add_step(steps, n, START, stamp, stamp, 0)
            for c in range(3):
                steps.motion[i, c] = out_target[c]
            steps.what[i, TURNS] = clock[TURN_COUNT]
            state.counts[UNMONITORED_NS] += max(0, stamp - clock[OUT_SINCE])
            clock[FOLLOWED] = 1
        else:
            n = _move(model, state, spline_node, stamp, out_target, steps, n)
        if clock[RESTS] == 0:
            n = _tell_direction(model, state, stamp, out_target[1], steps, n)
            _evaluate(model, clock, stamp, out_target[1])
        for i in range(3):
            state.target[i] = out_target[i]
        clock[LAST_SPLINE_NODE] = stamp
        n = look_up_to(state, spline_node + 1, steps, n)

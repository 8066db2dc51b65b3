"""Crank motion from filtered samples: spline, rest, tracking state (physics.md section 9).

A spline node is a crank sample at least a fixed time after the previous node. Once enough later samples have
arrived, it is smoothed and the leg is advanced to it; the leg is evaluated at all samples up to it.
"""

import math

from leg_wear_monitor.kernel import kernel
from leg_wear_monitor.twin.kinds import CRANK, LOAD
from leg_wear_monitor.twin.steps import (
    AHEAD_NS,
    EVALUATE,
    LEAVE,
    LOST_BY_OUTLIERS,
    MOVE,
    MOVING,
    PUSH,
    REPORT,
    REST,
    REVERSED,
    START,
    STOPPED,
    add_step,
    join_smoothly,
)
from leg_wear_monitor.twin.tracker.crank_filter import smooth

_TURN = 2.0 * math.pi
_RESTING = 0.02  # largest change of the angle of a resting crank [rad]
_PATIENCE = 10  # largest duration of a start, in settling times

IS_STOPPED, IS_STARTING, IS_IN_STEP, IS_OUT_OF_STEP = range(4)


@kernel
def _push(state, j, steps, n):
    """Add the step of a queued sample of the foot load, with the one that is a filter's delay ahead."""
    row, after, ahead = state.queue[j], -1, j
    for k in range(j + 1, state.clock.tail):
        other = state.queue[k]
        if other.kind == LOAD:
            after, ahead = k if after < 0 else after, k
            # the filtered force is then right until the next sample
            if other.stamp_ns >= state.queue[after].stamp_ns + AHEAD_NS:
                break
    n = add_step(steps, n, PUSH, row.stamp_ns, state.queue[ahead].stamp_ns, 0)
    push = steps[n - 1]
    push.until_next_ns = state.queue[after].stamp_ns - row.stamp_ns if after >= 0 else 0
    for i in range(2):
        push.motion[i], push.motion[2 + i] = row.foot_force[i], state.queue[ahead].foot_force[i]
    return n


@kernel
def evaluate_up_to(state, spline_node, steps, n):
    """Add steps that evaluate the leg at all queued samples before an index, and drop these samples.

    Samples of the foot load push it instead; those ahead have arrived within the lag.
    """
    clock = state.clock
    for j in range(clock.head, spline_node):
        row = state.queue[j]
        if row.kind == LOAD:
            n = _push(state, j, steps, n)
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
    due = clock.acquiring_ns + model.acquire_ns
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
    """Update the tracking state by the time for which the speed has been within tolerance or beyond."""
    within = 1 if model.slowest <= abs(speed) <= model.fastest else 0
    if clock.tolerance_since_ns == 0 or within != clock.in_tolerance:
        clock.tolerance_since_ns, clock.in_tolerance = stamp, within
    patience = model.settle_ns
    if within == 0 and clock.tracking == IS_STARTING:
        patience *= _PATIENCE
    if stamp - clock.tolerance_since_ns >= patience:
        clock.tracking = IS_IN_STEP if within != 0 else IS_OUT_OF_STEP


@kernel
def _stops(model, state, stamp, node):
    """Whether the crank is at rest at a spline node; updates the clock's fields of rest."""
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
    return clock.slow_since_ns != 0 and stamp - clock.slow_since_ns >= model.stop_hold_ns


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
        begin = max(clock.rested_ns, stamp - model.run_up_ns)
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

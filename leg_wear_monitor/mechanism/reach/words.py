"""What is wrong with a mechanism that does not close or turn, in words."""

from collections import deque

import numpy as np

from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.mechanism.plausible import suspects
from leg_wear_monitor.mechanism.reach.dead_point import DeadPoint
from leg_wear_monitor.mechanism.reach.reach import Reach
from leg_wear_monitor.mechanism.spec import Mechanism


def headline(reach: Reach) -> str:
    """In a few words, whether the mechanism works."""
    if reach.mobility != 1:
        return f"mobility is {reach.mobility}, expected 1"
    if reach.open_joint:
        return f"does not close: {gap_words(reach, 0)}"
    if not reach.turns:
        return f"the crank does not turn through: {_range(reach)}"
    return "closes, and the crank turns through" if not reach.fault else "closes far from the given start"


def findings(reach: Reach) -> tuple[str, ...]:
    """What is wrong, a sentence each with its numbers; empty for a mechanism that works."""
    found = [*_mobility(reach), *_open(reach), *_turns(reach)]
    if reach.fault:
        found.append(f"assembly.{reach.fault}")
    doubts = suspects(reach.mechanism)
    return (*found[:-1], found[-1] + doubts) if found else ()


def gap_words(reach: Reach, i: int) -> str:
    """The gap of the open joint at position ``i``."""
    joint = reach.mechanism.joint_words(reach.open_joint)
    return f"joint {joint} is open by {1e3 * reach.gap_m[i]:.3g} mm"


def dead_words(dead: DeadPoint) -> str:
    """Which bodies are in line at a dead point."""
    joints = ", ".join(dead.joints)
    if dead.is_in_line:
        how = "folded" if dead.is_folded else "stretched"
        return f"{dead.bodies[0]} and {dead.bodies[1]} are in line, {how} (joints {joints})"
    if dead.joints:
        return f"{dead.bodies[0]} is at a right angle to the guide of joint {dead.joints[1]}"
    return f"no two bodies are in line; {', '.join(dead.bodies)} can move with the crank locked"


def loop_of(mechanism: Mechanism, joint: str) -> tuple[str, ...]:
    """Bodies of the shortest loop through a joint, from one of its bodies to the other; empty without one."""
    first, last = mechanism.sides(joint)
    ways: deque[tuple[str, ...]] = deque([(first,)])
    seen = {first}
    while ways:
        way = ways.popleft()
        if way[-1] == last:
            return way
        for other in mechanism.joints:
            sides = mechanism.sides(other)
            if other != joint and way[-1] in sides:
                body = sides[1] if sides[0] == way[-1] else sides[0]
                if body not in seen:
                    seen.add(body)
                    ways.append((*way, body))
    return ()


def _mobility(reach: Reach) -> list[str]:
    if reach.mobility == 1:
        return []
    bodies, joints = len(reach.mechanism.bodies), len(reach.mechanism.joints)
    sum_ = f"3 x {bodies} bodies - 2 x {joints} joints"
    more = "a joint is missing" if reach.mobility > 1 else "a joint is too many, or a body is missing"
    return [f"joints: mobility is {reach.mobility} ({sum_}), expected 1: {more}"]


def _open(reach: Reach) -> list[str]:
    if not reach.open_joint:
        return []
    mechanism, least = reach.mechanism, int(reach.gap_m.argmin())
    bodies = " and ".join(mechanism.sides(reach.open_joint))
    text = (
        f"assembly: {gap_words(reach, 0)} between {bodies} at crank angle {_degrees(reach.crank_angle[0])}, "
        "with all other joints closed"
    )
    if reach.low is not None:
        text += f"; it closes only {_range(reach)}"
    else:
        angle = _degrees(reach.crank_angle[least] % TURN)
        text += f"; the least gap is {1e3 * reach.gap_m[least]:.3g} mm, at {angle}"
    if loop := loop_of(mechanism, reach.open_joint):
        text += f"; check the lengths of {', '.join(loop)}"
    return [text, *_ends(reach)]


def _turns(reach: Reach) -> list[str]:
    if reach.open_joint or reach.low is None:
        return []
    return [f"drive.body: {reach.mechanism.drive.body} turns only {_range(reach)}", *_ends(reach)]


def _ends(reach: Reach) -> list[str]:
    dead_points = [dead for dead in (reach.low, reach.high) if dead is not None]
    return [
        f"dead point at crank angle {_degrees(dead.crank_angle)}: {dead_words(dead)}" for dead in dead_points
    ]


def _range(reach: Reach) -> str:
    if reach.low is None or reach.high is None:
        return ""
    low, high = reach.low.crank_angle, reach.high.crank_angle
    return f"from {_degrees(low)} to {_degrees(high)}, {np.rad2deg(high - low):.1f} of 360 deg"


def _degrees(angle: float) -> str:
    return f"{np.rad2deg(angle):.1f} deg"

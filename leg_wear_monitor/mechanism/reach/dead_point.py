"""Which bodies are in line where the crank cannot go on.

At a dead point, the Jacobian is singular: with the crank locked, some bodies can still move a little. Where
two of them are joined to each other, and each to something that stays, the three joints are in line
(Aronhold and Kennedy's theorem). A body between something that stays and a slider is at a right angle to the
guide instead. Other linkages have dead points without two bodies in line.
"""

from collections.abc import Iterator

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats, body_names
from leg_wear_monitor.mechanism.ideal import point_path
from leg_wear_monitor.mechanism.position import Linkage, evaluate
from leg_wear_monitor.mechanism.spec import Mechanism, PrismaticJoint

# the position is not exactly that of the dead point
_STILL = 0.05  # speed of a joint that stays, as a fraction of that of the joint that moves
_STRAIGHT = 0.1  # sine of the angle between bodies in line


@attrs.frozen(eq=False)
class DeadPoint:
    """A position that the crank cannot pass.

    Attributes
    ----------
    crank_angle : float
        [rad].
    q : (n, 3) array
        Coordinates there.
    bodies : tuple of str
        The two bodies in line, or the one at a right angle to a guide; those that can move with the crank
        locked if it is neither.
    joints : tuple of str
        The three joints in line, that of both bodies in the middle; the joint with the slider, then that of
        the guide; empty if it is neither.
    is_in_line : bool
    is_folded : bool
        Whether the two bodies lie on each other, and are not stretched.
    """

    crank_angle: float
    q: Floats
    bodies: tuple[str, ...]
    joints: tuple[str, ...] = ()
    is_in_line: bool = False
    is_folded: bool = False


def dead_point(linkage: Linkage, crank_angle: float, q: Floats) -> DeadPoint:
    """The dead point beside coordinates q (n, 3) at a crank angle [rad]."""
    mechanism = linkage.mechanism
    velocity = _locked_velocity(linkage, q)
    speed = {body: _joint_speeds(mechanism, q, velocity, body) for body in mechanism.bodies}
    dyads = list(_dyads(mechanism, q, speed))
    if dyads:
        _, bodies, joints, is_folded = min(dyads)
        return DeadPoint(crank_angle, q, bodies, joints, is_in_line=True, is_folded=is_folded)
    for joint, a, b in _pairs(mechanism, speed):
        for rod, slider in ((a, b), (b, a)):
            guide = _guide(mechanism, slider, speed, _STILL * speed[rod][joint])
            if guide and _still_joint(speed[rod], joint):
                return DeadPoint(crank_angle, q, (rod,), (joint, guide))
    limit = _STILL * max((value for each in speed.values() for value in each.values()), default=0.0)
    moving = tuple(body for body, each in speed.items() if max(each.values(), default=0.0) > limit)
    return DeadPoint(crank_angle, q, moving)


def _dyads(
    mechanism: Mechanism, q: Floats, speed: dict[str, dict[str, float]]
) -> Iterator[tuple[float, tuple[str, str], tuple[str, str, str], bool]]:
    """Two bodies whose common joint moves while another joint of each stays, all three in line.

    How still these are, the bodies, the joints, and whether the bodies are folded.
    """
    for joint, a, b in _pairs(mechanism, speed):
        first, last = _still_joint(speed[a], joint), _still_joint(speed[b], joint)
        if first and last:
            joints = first, joint, last
            sine, is_folded = _bend(mechanism, q, joints)
            if abs(sine) < _STRAIGHT:
                yield (speed[a][first] + speed[b][last]) / speed[a][joint], (a, b), joints, is_folded


def _locked_velocity(linkage: Linkage, q: Floats) -> Floats:
    """Velocities (1, n, 3) that the closures restrict least, with the crank locked, in any unit of size."""
    jacobian = evaluate(linkage, q, np.zeros_like(q), (q[linkage.arrays.drive_body, 2], 0.0, 0.0)).jacobian
    size = max(float(np.abs(q[:, :2]).max()), 1.0e-12)  # lengths in this unit are comparable to angles
    scale = np.tile([size, size, 1.0], len(q) - 1)
    weakest = np.linalg.svd(jacobian * scale)[2][-1] * scale
    velocity = np.zeros((1, *q.shape))
    velocity[0, 1:] = weakest.reshape(-1, 3)
    return velocity


def _joint_speeds(mechanism: Mechanism, q: Floats, velocity: Floats, body: str) -> dict[str, float]:
    """Speed of every joint of a body, as a point of this body."""
    i = body_names(mechanism).index(body)
    speeds = {}
    for joint in mechanism.joints:
        if body in mechanism.sides(joint):
            lever = point_path(mechanism, q[None], body, joint)[0] - q[i, :2]
            x, y, turn = velocity[0, i]
            speeds[joint] = float(np.hypot(x - turn * lever[1], y + turn * lever[0]))
    return speeds


def _pairs(mechanism: Mechanism, speed: dict[str, dict[str, float]]) -> Iterator[tuple[str, str, str]]:
    """Revolute joints of two moving bodies that move with the crank locked, with the bodies."""
    for joint in mechanism.joints:
        a, b = mechanism.sides(joint)
        is_revolute = not isinstance(mechanism.joints[joint], PrismaticJoint)
        if is_revolute and a in speed and b in speed and min(speed[a][joint], speed[b][joint]) > 0.0:
            yield joint, a, b


def _still_joint(speeds: dict[str, float], moving: str) -> str:
    """The joint of a body that stays while another moves, empty without one."""
    limit = _STILL * speeds[moving]
    still = {name: value for name, value in speeds.items() if name != moving and value <= limit}
    return min(still, key=lambda name: still[name], default="")


def _guide(mechanism: Mechanism, slider: str, speed: dict[str, dict[str, float]], limit: float) -> str:
    """The prismatic joint in which a body slides along another that stays, empty without one."""
    for name, joint in mechanism.joints.items():
        if isinstance(joint, PrismaticJoint) and slider in mechanism.sides(name):
            other = next(body for body in mechanism.sides(name) if body != slider)
            if max(speed.get(other, {}).values(), default=0.0) <= limit:
                return name
    return ""


def _bend(mechanism: Mechanism, q: Floats, joints: tuple[str, str, str]) -> tuple[float, bool]:
    """Sine of the angle at the middle one of three joints, and whether the outer two lie on one side."""
    places = [point_path(mechanism, q[None], mechanism.sides(joint)[1], joint)[0] for joint in joints]
    a, b = places[0] - places[1], places[2] - places[1]
    length = float(np.hypot(*a) * np.hypot(*b)) or 1.0
    return float(a[0] * b[1] - a[1] * b[0]) / length, bool(np.dot(a, b) > 0.0)

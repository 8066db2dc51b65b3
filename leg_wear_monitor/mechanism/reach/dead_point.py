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

_STILL = 0.05  # of the fastest joint: the position is not exactly that of the dead point


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
    fastest = max((value for each in speed.values() for value in each.values()), default=0.0)
    limit = _STILL * fastest
    for joint, a, b in _pairs(mechanism, speed, limit):
        ends = _still_joint(speed[a], joint, limit), _still_joint(speed[b], joint, limit)
        if ends[0] and ends[1]:
            joints = ends[0], joint, ends[1]
            return DeadPoint(
                crank_angle, q, (a, b), joints, is_in_line=True, is_folded=_is_folded(mechanism, q, joints)
            )
    for joint, a, b in _pairs(mechanism, speed, limit):
        for rod, slider in ((a, b), (b, a)):
            guide = _guide(mechanism, slider, speed, limit)
            if guide and _still_joint(speed[rod], joint, limit):
                return DeadPoint(crank_angle, q, (rod,), (joint, guide))
    moving = tuple(body for body, each in speed.items() if max(each.values(), default=0.0) > limit)
    return DeadPoint(crank_angle, q, moving)


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


def _pairs(
    mechanism: Mechanism, speed: dict[str, dict[str, float]], limit: float
) -> Iterator[tuple[str, str, str]]:
    """Revolute joints that move with the crank locked, with their two bodies."""
    for joint in mechanism.joints:
        a, b = mechanism.sides(joint)
        is_revolute = not isinstance(mechanism.joints[joint], PrismaticJoint)
        if is_revolute and a in speed and b in speed and speed[a][joint] > limit:
            yield joint, a, b


def _still_joint(speeds: dict[str, float], moving: str, limit: float) -> str:
    """The joint of a body that stays, empty without one."""
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


def _is_folded(mechanism: Mechanism, q: Floats, joints: tuple[str, str, str]) -> bool:
    """Whether the outer two of three joints in line lie on one side of the middle one."""
    places = [point_path(mechanism, q[None], mechanism.sides(joint)[1], joint)[0] for joint in joints]
    return bool(np.dot(places[0] - places[1], places[2] - places[1]) > 0.0)

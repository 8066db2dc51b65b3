"""A linkage as URDF: a tree of its bodies with its loops cut, and the angles of the joints in the tree.

The plane of the mechanism is -x and z of ROS, as in the markers: a leg walks towards its own -x, and by REP
103 towards x. So bodies turn about y. A link has the axes of its body, and its origin in the joint that
carries it. Where a loop is cut, each of the two bodies has a frame in the joint; the frames coincide (of a
slider, along its axis) at the angles of `joint_positions`.
"""

import math
from collections.abc import Iterator
from xml.etree import ElementTree

import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats, body_names, point_from_com
from leg_wear_monitor.mechanism.position import (
    Linkage,
    assemble,
    build_linkage,
    corners,
    rotated,
)
from leg_wear_monitor.mechanism.spec import GROUND, Mechanism, PrismaticJoint, Vector

_RADIUS = 0.03  # radius of the cylinders as a fraction of the longest distance between points of a body


def tree(mechanism: Mechanism) -> dict[str, tuple[str, str]]:
    """Parent and child body of each joint that carries a body, from the ground; other joints close loops."""
    found: dict[str, tuple[str, str]] = {}
    reached = [GROUND]
    for parent in reached:  # grows meanwhile: the nearest to the ground come first
        for joint in mechanism.joints:
            sides = mechanism.sides(joint)
            if parent not in sides:
                continue
            child = sides[0] if sides[1] == parent else sides[1]
            if child not in reached:
                reached.append(child)
                found[joint] = parent, child
    return found


def joint_positions(linkage: Linkage, q: Floats) -> dict[str, Floats]:
    """Positions of the tree's joints, as a JointState has them.

    Parameters
    ----------
    linkage : Linkage
    q : (N, n, 3) array
        Coordinates of the bodies, as in `IdealMotion`.

    Returns
    -------
    dict of str to (N,) array
        Angles [rad] from parent to child, and the way of a slider along its axis [m].
    """
    mechanism, found = linkage.mechanism, {}
    number = {body: k for k, body in enumerate(body_names(mechanism))}
    for joint, bodies in tree(mechanism).items():
        parent, child = (q[:, number[body]] for body in bodies)
        if not isinstance(mechanism.joints[joint], PrismaticJoint):
            found[joint] = child[:, 2] - parent[:, 2]
            continue
        arm = [
            body[:, :2] + rotated(point_from_com(mechanism, name, joint), body[:, 2])
            for name, body in zip(bodies, (parent, child), strict=True)
        ]
        guide, axis = _guide(mechanism, joint)
        along = rotated(axis, q[:, number[guide], 2])
        found[joint] = ((arm[1] - arm[0]) * along).sum(axis=1)
    return found


def urdf(mechanism: Mechanism) -> str:
    """The mechanism as URDF.

    Moments of inertia about axes in the plane are half of that about its normal, as for a thin plate; the
    motion in the plane does not depend on them.

    Parameters
    ----------
    mechanism : Mechanism

    Returns
    -------
    str
        XML.

    Raises
    ------
    AssemblyError
        If the mechanism does not close.
    """
    branches = tree(mechanism)
    angle = dict(zip(body_names(mechanism), assemble(build_linkage(mechanism))[:, 2].tolist(), strict=True))
    carried = {child: joint for joint, (_, child) in branches.items()}
    origins = {body: mechanism.points_of(body)[joint] for body, joint in carried.items()}
    origins[GROUND] = (0.0, 0.0)
    robot = ElementTree.Element("robot", name=mechanism.name)
    robot.extend(_link(mechanism, body, origins[body]) for body in origins)
    robot.extend(_joint(mechanism, joint, *sides, origins, angle) for joint, sides in branches.items())
    for joint in mechanism.joints:
        if joint not in carried.values():
            for body in mechanism.sides(joint):
                robot.extend(_cut(mechanism, body, joint, origins[body]))
    ElementTree.indent(robot)
    return f'<?xml version="1.0"?>\n{ElementTree.tostring(robot, encoding="unicode")}\n'


def _link(mechanism: Mechanism, body: str, origin: Vector) -> ElementTree.Element:
    link = ElementTree.Element("link", name=body)
    if body != GROUND:
        spec = mechanism.bodies[body]
        inertial = ElementTree.SubElement(link, "inertial")
        _origin(inertial, spec.com, origin)
        ElementTree.SubElement(inertial, "mass", value=f"{spec.mass:.9g}")
        half, whole = (f"{fraction * spec.inertia:.9g}" for fraction in (0.5, 1.0))
        moments = {"ixx": half, "ixy": "0", "ixz": "0", "iyy": whole, "iyz": "0", "izz": half}
        ElementTree.SubElement(inertial, "inertia", moments)
    sides = [*_sides(mechanism, body)]
    radius = _RADIUS * max((math.dist(*side) for side in sides), default=0.0)
    for begin, end in sides:
        length = math.dist(begin, end)
        visual = ElementTree.SubElement(link, "visual")
        middle = (0.5 * (begin[0] + end[0]), 0.5 * (begin[1] + end[1]))
        # rotation from the cylinder's axis z to the side
        pitch = math.atan2(begin[0] - end[0], end[1] - begin[1])
        _origin(visual, middle, origin, pitch)
        geometry = ElementTree.SubElement(visual, "geometry")
        ElementTree.SubElement(geometry, "cylinder", radius=f"{radius:.9g}", length=f"{length:.9g}")
    return link


def _sides(mechanism: Mechanism, body: str) -> Iterator[tuple[Vector, Vector]]:
    """Sides of a body's shape between its points."""
    points = mechanism.points_of(body)
    if len(points) < 2 or body == GROUND:
        return
    around = [(float(x), float(y)) for x, y in corners({name: np.array(at) for name, at in points.items()})]
    ends = around[1:] if len(around) == 2 else [*around[1:], around[0]]
    yield from zip(around, ends, strict=False)


def _joint(
    mechanism: Mechanism,
    name: str,
    parent: str,
    child: str,
    origins: dict[str, Vector],
    angle: dict[str, float],
) -> ElementTree.Element:
    slides = isinstance(mechanism.joints[name], PrismaticJoint)
    kind = "prismatic" if slides else "continuous"
    joint = ElementTree.Element("joint", name=name, type=kind)
    turned = angle[child] - angle[parent] if slides else 0.0
    _origin(joint, mechanism.points_of(parent)[name], origins[parent], turned)
    ElementTree.SubElement(joint, "parent", link=parent)
    ElementTree.SubElement(joint, "child", link=child)
    if slides:
        # the axis of a joint is given in its own frame, which has the child's directions
        guide, axis = _guide(mechanism, name)
        x, y = axis if guide == child else rotated(axis, -turned).tolist()
        ElementTree.SubElement(joint, "axis", xyz=f"{-x:.12g} 0 {y:.12g}")
        far = f"{_reach(mechanism):.9g}"
        ElementTree.SubElement(joint, "limit", lower=f"-{far}", upper=far, effort="0", velocity="0")
    else:
        ElementTree.SubElement(joint, "axis", xyz="0 1 0")
    return joint


def _cut(mechanism: Mechanism, body: str, joint: str, origin: Vector) -> Iterator[ElementTree.Element]:
    """A frame of a body in a joint that closes a loop."""
    frame = f"{joint}_on_{body}"
    yield ElementTree.Element("link", name=frame)
    fixed = ElementTree.Element("joint", name=frame, type="fixed")
    _origin(fixed, mechanism.points_of(body)[joint], origin)
    ElementTree.SubElement(fixed, "parent", link=body)
    ElementTree.SubElement(fixed, "child", link=frame)
    yield fixed


def _origin(of: ElementTree.Element, point: Vector, origin: Vector, pitch: float = 0.0) -> None:
    """Place of a point of a body in the frame of its link; a pitch [rad] is about y."""
    x, z = origin[0] - point[0], point[1] - origin[1]
    ElementTree.SubElement(of, "origin", xyz=f"{x:.12g} 0 {z:.12g}", rpy=f"0 {pitch:.12g} 0")


def _guide(mechanism: Mechanism, joint: str) -> tuple[str, Vector]:
    """Guide of a slider, and the unit vector of its axis in the guide's frame."""
    spec = mechanism.joints[joint]
    if not isinstance(spec, PrismaticJoint):
        raise ValueError(f"joint {joint} does not slide")
    length = math.hypot(*spec.axis)
    return spec.guide, (spec.axis[0] / length, spec.axis[1] / length)


def _reach(mechanism: Mechanism) -> float:
    """Longer than any way in the mechanism [m]."""
    points = [list(mechanism.points_of(body).values()) for body in (GROUND, *mechanism.bodies)]
    return sum(max((math.dist(a, b) for a in one for b in one), default=0.0) for one in points)

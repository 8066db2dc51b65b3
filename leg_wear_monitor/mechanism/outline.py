"""The ideal mechanism at crank angle 0 as places in its plane, for pictures."""

from collections.abc import Mapping

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import ideal_motion, point_motion
from leg_wear_monitor.mechanism.position import build_linkage
from leg_wear_monitor.mechanism.spec import GROUND, Mechanism, PrismaticJoint


@attrs.frozen(eq=False)
class Outline:
    """Shapes and places [m].

    Attributes
    ----------
    bodies : dict of str to (n, 2) array
        Corners of each moving body.
    joints : dict of str to (2,) array
    """

    bodies: dict[str, Floats]
    joints: dict[str, Floats]


def outline_of(mechanism: Mechanism) -> Outline:
    """Outline of a mechanism.

    Raises
    ------
    AssemblyError
        If it does not close.
    """
    linkage = build_linkage(mechanism)
    motion = ideal_motion(linkage, [0.0], 1.0)

    def place(body: str, point: str) -> Floats:
        return np.asarray(point_motion(motion, linkage, body, point)[0][0], np.float64)

    bodies = {
        body: corners({point: place(body, point) for point in mechanism.points_of(body)})
        for body in mechanism.bodies
    }
    return Outline(bodies, {joint: place(mechanism.sides(joint)[1], joint) for joint in mechanism.joints})


def is_on_ground(mechanism: Mechanism, joint: str) -> bool:
    """Whether a joint joins a body to the ground."""
    return GROUND in mechanism.sides(joint)


def carriers(mechanism: Mechanism, joint: str) -> tuple[str, str]:
    """The two bodies of a joint, last the one at whose point it is drawn: the ground, or the journal."""
    bushing, journal = mechanism.sides(joint)
    is_fixed = bushing == GROUND and not isinstance(mechanism.joints[joint], PrismaticJoint)
    return (journal, bushing) if is_fixed else (bushing, journal)


def corners(points: Mapping[str, Floats]) -> Floats:
    """Corners (n, 2) of a body's shape: its distinct points [m], ordered by angle around their mean."""
    distinct = np.unique(np.array(list(points.values())).round(9), axis=0)
    around = distinct - distinct.mean(axis=0)
    return np.asarray(distinct[np.argsort(np.arctan2(around[:, 1], around[:, 0]))])

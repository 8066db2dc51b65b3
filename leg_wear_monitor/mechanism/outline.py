"""The ideal mechanism at crank angle 0 as places in its plane, for pictures."""

from collections.abc import Mapping

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import one_cycle, point_motion
from leg_wear_monitor.mechanism.position import build_linkage
from leg_wear_monitor.mechanism.spec import GROUND, Mechanism

_POINTS = 72  # of the toe's path: every 5 degrees of the crank


@attrs.frozen(eq=False)
class Outline:
    """Shapes and places [m].

    Attributes
    ----------
    bodies : dict of str to (n, 2) array
        Corners of each moving body.
    joints : dict of str to (2,) array
    toe_path : (n, 2) array
        Over one turn of the crank; empty without a toe.
    """

    bodies: dict[str, Floats]
    joints: dict[str, Floats]
    toe_path: Floats


def outline_of(mechanism: Mechanism) -> Outline:
    """Outline of a mechanism.

    Raises
    ------
    AssemblyError
        If it does not close or has a dead point.
    """
    linkage = build_linkage(mechanism)
    motion = one_cycle(linkage, _POINTS, 1.0)

    def path(body: str, point: str) -> Floats:
        return point_motion(motion, linkage, body, point)[0]

    bodies = {
        body: corners({point: path(body, point)[0] for point in mechanism.points_of(body)})
        for body in mechanism.bodies
    }
    joints = {joint: path(mechanism.sides(joint)[1], joint)[0] for joint in mechanism.joints}
    toe = path(*mechanism.toe) if mechanism.toe else np.empty((0, 2))
    return Outline(bodies, joints, toe)


def is_on_ground(mechanism: Mechanism, joint: str) -> bool:
    """Whether a joint joins a body to the ground."""
    return GROUND in mechanism.sides(joint)


def corners(points: Mapping[str, Floats]) -> Floats:
    """Corners (n, 2) of a body's shape: its distinct points [m], ordered by angle around their mean."""
    distinct = np.unique(np.array(list(points.values())).round(9), axis=0)
    around = distinct - distinct.mean(axis=0)
    return np.asarray(distinct[np.argsort(np.arctan2(around[:, 1], around[:, 0]))])

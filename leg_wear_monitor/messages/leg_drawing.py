"""Geometry of the leg's markers: bodies, joints and toe over the crank angle, and rings beside the leg."""

import itertools
import math

import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN, IdealMotion, ideal_motion, point_motion
from leg_wear_monitor.mechanism.position import Linkage, build_linkage
from leg_wear_monitor.mechanism.spec import GROUND, Mechanism

_STEPS = 180  # positions per turn; the nearest one is drawn
_PATH_STEP = 2  # every such position is a point of the toe's path
_SAME = 1.0e-3  # distance of joints that have one name tag, as a fraction of the leg's size
_PER_COLUMN = 5  # rings
_RING_PITCH, _RING_GAP = 0.24, 0.2  # distance of rings, and of the first column from the leg, likewise


class LegDrawing:
    """The ideal leg, because the clearances are too small to be visible; rings show them magnified.

    All points are (…, 3) [m] in the frame of the pelvis by REP 103: x forwards, z up.

    Parameters
    ----------
    mechanism : Mechanism

    Attributes
    ----------
    size : float
        Largest extent of the leg in its plane [m].
    lines : (STEPS, 2 b, 3) array
        Both ends of b lines of the bodies.
    joints : (STEPS, k, 3) array
        The clearance joints.
    tags : tuple of (str, int)
        Names of joints at one place, such as ``A B``, and the index of the first of them.
    path : (p, 3) array
        Closed path of the toe; empty without a toe.
    rings : (k, 3) array
        Centres of the magnified bushings, beside the leg.
    title : (3,) array
        Place above the rings.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        linkage = build_linkage(mechanism)
        motion = ideal_motion(linkage, TURN / _STEPS * np.arange(_STEPS), TURN)
        self.lines = _lines(mechanism, motion, linkage)
        names = mechanism.clearance_joints
        joints = [_path(motion, linkage, mechanism.sides(name)[0], name) for name in names]
        self.joints = np.stack(joints, axis=1) if joints else np.zeros((_STEPS, 0, 3))
        all_points = np.concatenate([self.lines, self.joints], axis=1)
        corners = np.array([all_points.min(axis=(0, 1)), all_points.max(axis=(0, 1))])
        self.size = float(np.ptp(corners, axis=0).max())
        self.tags = _tags(names, self.joints, _SAME * self.size)
        toe = mechanism.toe
        self.path = _closed(_path(motion, linkage, *toe)[::_PATH_STEP]) if toe else np.zeros((0, 3))
        begin = np.array([corners[1, 0] + _RING_GAP * self.size, 0.0, corners[1, 2]])
        k = np.arange(len(names))
        places = np.stack([k // _PER_COLUMN, np.zeros(len(k)), -(k % _PER_COLUMN)], axis=1)
        self.rings = begin + _RING_PITCH * self.size * places
        self.title = begin + _RING_PITCH * self.size * np.array([0.0, 0.0, 0.8])

    def step_at(self, crank_angle: float) -> int:
        """Index of the position nearest to a crank angle [rad]."""
        return round(crank_angle / TURN * _STEPS) % _STEPS


def circle(radius: float) -> Floats:
    """Closed circle (33, 3) [m] in the plane of the leg."""
    angle = np.linspace(0.0, TURN, 33)
    return radius * np.stack([np.cos(angle), np.zeros_like(angle), np.sin(angle)], axis=1)


def in_rep_103(plane: Floats) -> Floats:
    """Points (…, 3) of points (…, 2) in the leg's plane: the leg walks towards its own -x, REP 103 to +x."""
    return np.stack([-plane[..., 0], np.zeros(plane.shape[:-1]), plane[..., 1]], axis=-1)


def _path(motion: IdealMotion, linkage: Linkage, body: str, point: str) -> Floats:
    """Positions (STEPS, 3) [m] of a point of a body."""
    return in_rep_103(point_motion(motion, linkage, body, point)[0])


def _lines(mechanism: Mechanism, motion: IdealMotion, linkage: Linkage) -> Floats:
    """Lines from each moving body's first point to its other points, as pairs of points."""
    ends: list[Floats] = []
    for body in mechanism.bodies:
        places = [_path(motion, linkage, body, point) for point in mechanism.points_of(body)]
        for other in places[1:]:
            ends += [places[0], other]
    ground = [_path(motion, linkage, GROUND, point) for point in mechanism.points_of(GROUND)]
    for one, other in itertools.pairwise(ground):
        if math.dist(one[0], other[0]) > 0.0:
            ends += [one, other]
    return np.stack(ends, axis=1) if ends else np.zeros((_STEPS, 0, 3))


def _tags(names: tuple[str, ...], joints: Floats, same: float) -> tuple[tuple[str, int], ...]:
    """Names of joints that stay within a distance [m] of each other, with the index of the first."""
    groups: dict[int, list[str]] = {}
    for k, name in enumerate(names):
        near = (i for i in groups if np.abs(joints[:, i] - joints[:, k]).max() <= same)
        groups.setdefault(next(near, k), []).append(name)
    return tuple((" ".join(group), k) for k, group in groups.items())


def _closed(path: Floats) -> Floats:
    return np.concatenate([path, path[:1]])

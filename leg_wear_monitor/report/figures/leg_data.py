"""A mechanism over its crank's range as plain data [mm, degrees] for the interactive picture, y downwards."""

from itertools import cycle
from typing import Any

import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import point_path, rotated
from leg_wear_monitor.mechanism.outline import carriers, corners, is_on_ground
from leg_wear_monitor.mechanism.reach.dead_point import DeadPoint
from leg_wear_monitor.mechanism.reach.reach import Reach
from leg_wear_monitor.mechanism.spec import GROUND
from leg_wear_monitor.report.figures.figure import BODY_COLOURS

ARROW_FRACTION = 0.3  # length of the longest arrow, as a fraction of the picture's height


def leg_data(reach: Reach) -> dict[str, Any]:
    """Bodies, joints, the toe's path, and what is open or in line."""
    mechanism = reach.mechanism
    every = [
        reach.path(body, point)
        for body in (GROUND, *mechanism.bodies)
        for point in mechanism.points_of(body)
        if body != GROUND or point in mechanism.joints
    ]
    low, high = np.concatenate(every).min(axis=0), np.concatenate(every).max(axis=0)
    margin = 0.09 * float((high - low).max())
    corner = 1.0e3 * np.array([low[0] - margin, -high[1] - margin])
    size = 1.0e3 * (high - low + 2.0 * margin)
    return {
        "bodies": _bodies(reach),
        "joints": [_joint(reach, name) for name in mechanism.joints],
        "box": [round(float(value), 1) for value in (*corner, *size)],
        "toe": [] if mechanism.toe is None else millimetres(reach.path(*mechanism.toe)),
        "angles": np.rad2deg(reach.crank_angle).round(1).tolist(),
        "turns": reach.turns or (bool(reach.open_joint) and len(reach.q) > 1),
        "marks": [
            _mark(reach, dead, i)
            for dead, i in ((reach.low, 0), (reach.high, len(reach.q) - 1))
            if dead is not None and dead.is_in_line and not reach.open_joint
        ],
        "said": {},
        "first": 0,
        "digits": 1,
        "skip": 1,
        "frames": len(reach.crank_angle),
        "arrow_mm": round(ARROW_FRACTION * float(size[1]), 1),
    }


def _bodies(reach: Reach) -> list[dict[str, Any]]:
    """The bodies, the largest first; shapes [mm] in their own frames, and poses of these."""
    mechanism = reach.mechanism
    colours = cycle(BODY_COLOURS)
    bodies = []
    for i, (name, body) in enumerate(mechanism.bodies.items(), start=1):
        shape = corners({point: np.array(place) for point, place in body.points.items()})
        angle = reach.q[:, i, 2]
        origin = reach.q[:, i, :2] - rotated(body.com, angle)
        poses = np.column_stack([1.0e3 * origin[:, 0], -1.0e3 * origin[:, 1]]).round(1)
        turns = (-np.rad2deg(angle)).round(2)
        bodies.append({
            "name": name,
            "colour": next(colours),
            "outline": millimetres(shape),
            "poses": [[x, y, turn] for (x, y), turn in zip(poses.tolist(), turns.tolist(), strict=True)],
        })  # fmt: skip
    return sorted(bodies, key=lambda body: -float(np.ptp(np.array(body["outline"]), axis=0).sum()))


def _joint(reach: Reach, name: str) -> dict[str, Any]:
    """Name and path of a joint; of an open one, also the path of its other point and the gap [mm]."""
    other, carrier = carriers(reach.mechanism, name)
    joint = {
        "name": name,
        "path": millimetres(reach.path(carrier, name)),
        "ground": is_on_ground(reach.mechanism, name),
    }
    if reach.is_open(name):
        joint |= {
            "other": millimetres(reach.path(other, name)),
            "gap_mm": [float(f"{1.0e3 * gap:.3g}") for gap in reach.gap_of(name)],
        }
    return joint


def _mark(reach: Reach, dead: DeadPoint, frame: int) -> dict[str, Any]:
    """Line through the three joints that are in line at a dead point."""
    places = [
        point_path(reach.mechanism, dead.q[None], reach.mechanism.sides(joint)[1], joint)[0]
        for joint in dead.joints
    ]
    return {"frame": frame, "line": millimetres(np.array(places))}


def millimetres(points: Floats) -> list[list[float]]:
    """Places (n, 2) [m] in mm, with y downwards."""
    return [[round(1.0e3 * float(x), 1), round(-1.0e3 * float(y), 1)] for x, y in points]

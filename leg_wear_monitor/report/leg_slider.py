"""Data of the interactive picture of a leg, which leg_slider.js draws.

A mechanism over its crank's range in mm and degrees. The y axis points down, as in SVG.
"""

from collections.abc import Sequence
from itertools import cycle
from typing import Any

import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import carriers, corners, is_on_ground, point_path, rotated
from leg_wear_monitor.mechanism.reach import DeadPoint, Reach
from leg_wear_monitor.mechanism.spec import GROUND
from leg_wear_monitor.report.figure import BODY_COLOURS
from leg_wear_monitor.report.leg_picture import in_line
from leg_wear_monitor.report.page import Fragment, render, template_text

ARROW_FRACTION = 0.3  # length of the longest arrow, as a fraction of the picture's height


def leg_data(reach: Reach) -> dict[str, Any]:
    """Data of the interactive picture: bodies, joints, path of the toe, open joints, and joints in line."""
    mechanism = reach.mechanism
    every = [
        reach.path(body, point)
        for body in (GROUND, *mechanism.bodies)
        for point in mechanism.points_of(body)
        if body != GROUND or point in mechanism.joints
    ]
    given = picture_data(
        _bodies(reach),
        [_joint(reach, name) for name in mechanism.joints],
        np.concatenate(every),
        np.rad2deg(reach.crank_angle).round(1).tolist(),
    )
    return given | {
        "toe": [] if mechanism.toe is None else millimetres(reach.path(*mechanism.toe)),
        "turns": reach.turns or (bool(reach.open_joint) and len(reach.q) > 1),
        "marks": [_mark(reach, dead, i) for i, dead in in_line(reach)],
    }


def picture_data(
    bodies: Sequence[dict[str, Any]],
    joints: Sequence[dict[str, Any]],
    extent: Floats,
    angles: Sequence[float],
) -> dict[str, Any]:
    """Data of the interactive picture of a leg that turns through, without the path of a toe.

    Parameters
    ----------
    bodies, joints : sequence of dict
        As `leg_slider.js` draws them.
    extent : (n, 2) array
        Points that fit into the picture [m].
    angles : sequence of float
        Crank angle of each position [deg].
    """
    low, high = extent.min(axis=0), extent.max(axis=0)
    margin = 0.09 * float((high - low).max())
    corner = 1.0e3 * np.array([low[0] - margin, -high[1] - margin])
    size = 1.0e3 * (high - low + 2.0 * margin)
    return {
        "bodies": sorted(bodies, key=lambda body: -float(np.ptp(np.array(body["outline"]), axis=0).sum())),
        "joints": joints,
        "box": [round(float(value), 1) for value in (*corner, *size)],
        "toe": [],
        "angles": angles,
        "turns": True,
        "marks": [],
        "said": {},
        "live": False,
        "first": 0,
        "digits": 1,
        "skip": 1,
        "frames": len(angles),
        "arrow_mm": round(ARROW_FRACTION * float(size[1]), 1),
    }


def _bodies(reach: Reach) -> list[dict[str, Any]]:
    """The bodies; shapes [mm] in their own frames, and poses of these."""
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
    return bodies


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


_FLIP = np.array([1.0, -1.0])  # y is downwards in the picture


def run_data(
    label: str, joints: Sequence[str], forces_n: Floats, places: Floats | None = None
) -> dict[str, Any]:
    """Forces (s, k, 2) [N] in joints over a cycle, and places of the pins in their bushings [clearances]."""
    pins = {name: {"f": (forces_n[:, k] * _FLIP).round(1).tolist()} for k, name in enumerate(joints)}
    if places is not None:
        for k, name in enumerate(joints):
            pins[name]["e"] = (places[:, k] * _FLIP).round(3).tolist()
    largest_n = float(np.linalg.norm(forces_n, axis=-1).max())
    return {"label": label, "pins": pins, "largest_n": largest_n}


def leg_slider(data: dict[str, Any], alt: str, caption: str) -> Fragment:
    """The interactive picture as a part of a page."""
    names = [run["label"] for run in data["runs"]]
    markup = render("leg_slider.html", data=data, names=names, alt=alt)
    return Fragment(markup, template_text("leg_slider.js"), caption)


def millimetres(points: Floats) -> list[list[float]]:
    """Places (n, 2) [m] in mm, with y downwards."""
    return [[round(1.0e3 * float(x), 1), round(-1.0e3 * float(y), 1)] for x, y in points]

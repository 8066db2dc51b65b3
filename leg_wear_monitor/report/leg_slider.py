"""The interactive picture of a mechanism, which leg_slider.js draws in mm and degrees, y downwards."""

from itertools import cycle
from typing import Any

import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import carriers, corners, is_on_ground, rotated
from leg_wear_monitor.mechanism.reach import Reach
from leg_wear_monitor.mechanism.spec import GROUND
from leg_wear_monitor.report.figure import BODY_COLOURS
from leg_wear_monitor.report.page import Fragment, render, template_text


def leg_slider(reach: Reach, first: int, caption: str) -> Fragment:
    """The picture as a part of a page, at the position with the number ``first``."""
    data, alt = leg_data(reach) | {"first": first}, "The mechanism at the chosen crank angle"
    markup = render("leg_slider.html", data=data, alt=alt)
    return Fragment(markup, template_text("leg_slider.js"), caption)


def leg_data(reach: Reach) -> dict[str, Any]:
    """Data of the picture: bodies, joints, path of the toe, and open joints."""
    mechanism = reach.mechanism
    every = [
        reach.path(body, point)
        for body in (GROUND, *mechanism.bodies)
        for point in mechanism.points_of(body)
        if body != GROUND or point in mechanism.joints
    ]
    extent = np.concatenate(every)
    low, high = extent.min(axis=0), extent.max(axis=0)
    margin = 0.09 * float((high - low).max())
    corner = 1.0e3 * np.array([low[0] - margin, -high[1] - margin])
    size = 1.0e3 * (high - low + 2.0 * margin)
    ends = ((0, reach.low), (len(reach.q) - 1, reach.high))
    said = {i: "Dead point: the crank cannot pass it." for i, dead in ends if dead and not reach.open_joint}
    return {
        "bodies": sorted(_bodies(reach), key=lambda body: -float(np.ptp(body["outline"], axis=0).sum())),
        "joints": [_joint(reach, name) for name in mechanism.joints],
        "box": [round(float(value), 1) for value in (*corner, *size)],
        "toe": [] if mechanism.toe is None else _millimetres(reach.path(*mechanism.toe)),
        "angles": np.rad2deg(reach.crank_angle).round(1).tolist(),
        "turns": reach.turns or (bool(reach.open_joint) and len(reach.q) > 1),
        "said": said,
        "frames": len(reach.q),
    }


def _bodies(reach: Reach) -> list[dict[str, Any]]:
    """The bodies: shapes [mm] in their own frames, and the poses of these frames."""
    bodies, colours = [], cycle(BODY_COLOURS)
    for i, (name, body) in enumerate(reach.mechanism.bodies.items(), start=1):
        shape = corners({point: np.array(place) for point, place in body.points.items()})
        angle = reach.q[:, i, 2]
        origin = reach.q[:, i, :2] - rotated(body.com, angle)
        poses = np.column_stack([_millimetres(origin), -np.rad2deg(angle)]).round(2).tolist()
        outline = _millimetres(shape)
        bodies.append({"name": name, "colour": next(colours), "outline": outline, "poses": poses})
    return bodies


def _joint(reach: Reach, name: str) -> dict[str, Any]:
    """Name and path of a joint; for an open joint, also the path of its other point and the gap [mm]."""
    other, carrier = carriers(reach.mechanism, name)
    joint = {
        "name": name,
        "path": _millimetres(reach.path(carrier, name)),
        "ground": is_on_ground(reach.mechanism, name),
    }
    if reach.is_open(name):
        joint |= {
            "other": _millimetres(reach.path(other, name)),
            "gap_mm": [float(f"{1.0e3 * gap:.3g}") for gap in reach.gap_of(name)],
        }
    return joint


def _millimetres(points: Floats) -> list[list[float]]:
    """Places (n, 2) [m] in mm, with y downwards."""
    return [[round(1.0e3 * float(x), 1), round(-1.0e3 * float(y), 1)] for x, y in points]

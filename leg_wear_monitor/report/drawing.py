"""The page of a mechanism: its motion, and its lengths for comparison with their source."""

import math
from itertools import combinations, cycle
from typing import Any

import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.loader import understood
from leg_wear_monitor.mechanism.position import carriers, corners, is_on_ground, rotated
from leg_wear_monitor.mechanism.reach import Reach, findings, headline
from leg_wear_monitor.mechanism.spec import GROUND, Mechanism, PrismaticJoint, TorqueDrive
from leg_wear_monitor.report.figure import BODY_COLOURS
from leg_wear_monitor.report.page import (
    Fragment,
    Page,
    Section,
    Sentences,
    Table,
    page_html,
    render,
    template_text,
)

CREATOR = "leg-wear-monitor draw"  # in the head of every drawing


def first_position(reach: Reach) -> int:
    """First position in the picture: crank angle 0, or the dead point in the direction of the drive."""
    if not reach.rocks:
        return 0
    drive = reach.mechanism.drive
    forwards = drive.torque if isinstance(drive, TorqueDrive) else drive.speed
    return len(reach.q) - 1 if forwards >= 0.0 else 0


def drawing_html(reach: Reach) -> str:
    """The page as HTML text."""
    mechanism, found, shown = reach.mechanism, findings(reach), first_position(reach)
    text = "Drawn to scale, without clearances."
    if mechanism.toe is not None and len(reach.q) > 1:
        text += " Dashed: path of the toe."
    units = understood(reach.linkage) if reach.turns and not found else []
    page = Page(
        title=mechanism.name,
        summary=f"{len(mechanism.bodies)} moving bodies, {len(mechanism.joints)} joints: {headline(reach)}.",
        sections=[
            *([Section("Faults", [Sentences(found)])] if found else []),
            Section("The mechanism", [leg_slider(reach, shown, text)]),
            *([Section("In everyday units", [Sentences(units)])] if units else []),
            Section("Lengths", [_lengths(mechanism)]),
            Section("Joints", [_joints(reach, shown)]),
        ],
        styles=("leg_slider.css",),
        generator=CREATOR,
        versions={"drawn from": mechanism.source},
    )
    return page_html(page)


def _lengths(mechanism: Mechanism) -> Table:
    """Distance between any two points of a body, which lie apart."""
    named = {name: body.points for name, body in mechanism.bodies.items()}
    rows = [
        (body, f"{a} – {b}", f"{1e3 * length:.2f}")
        for body, points in [(GROUND, mechanism.ground.points), *named.items()]
        for (a, p), (b, q) in combinations(points.items(), 2)
        if (length := math.dist(p, q)) > 0.0
    ]
    caption = "Distances between the points of each body"
    return Table(caption=caption, head=("body", "points", "mm"), rows=rows)


def _joints(reach: Reach, shown: int) -> Table:
    mechanism = reach.mechanism
    rows = []
    for name, joint in mechanism.joints.items():
        sides = mechanism.sides(name)
        x, y = 1.0e3 * reach.path(sides[1], name)[shown]
        kind = "slider" if isinstance(joint, PrismaticJoint) else "pin"
        rows.append((mechanism.joint_words(name), kind, " and ".join(sides), f"{x:.1f}", f"{y:.1f}"))
    angle = np.rad2deg(reach.crank_angle[shown])
    return Table(
        caption=f"Joints, and their places at crank angle {angle:.1f}°",
        head=("joint", "kind", "bodies", "x [mm]", "y [mm]"),
        rows=rows,
    )


# The interactive picture of a mechanism, which leg_slider.js draws in mm and degrees, y downwards.


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
    ends = (0, len(reach.q) - 1) if reach.rocks else ()
    return {
        "bodies": sorted(_bodies(reach), key=lambda body: -float(np.ptp(body["outline"], axis=0).sum())),
        "joints": [_joint(reach, name) for name in mechanism.joints],
        "box": [round(float(value), 1) for value in (*corner, *size)],
        "toe": [] if mechanism.toe is None else _millimetres(reach.path(*mechanism.toe)),
        "angles": np.rad2deg(reach.crank_angle).round(1).tolist(),
        "turns": reach.turns,
        "said": dict.fromkeys(ends, "Dead point: the crank cannot pass it."),
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

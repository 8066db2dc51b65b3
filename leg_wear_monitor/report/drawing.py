"""The page of a mechanism: through its cycle, with its lengths to compare with their source."""

import math
from itertools import combinations

import numpy as np

from leg_wear_monitor.mechanism.loader import understood
from leg_wear_monitor.mechanism.reach import Reach, findings, headline
from leg_wear_monitor.mechanism.spec import GROUND, Mechanism, PrismaticJoint, SpeedDrive, TorqueDrive
from leg_wear_monitor.report.leg_slider import leg_slider
from leg_wear_monitor.report.page import Page, Section, Sentences, Table, page_html

CREATOR = "leg-wear-monitor draw"  # mark of every drawing; only such files are overwritten


def first_position(reach: Reach) -> int:
    """Position that is shown first: crank angle 0, or the dead point in the direction of the drive."""
    if reach.turns or reach.open_joint or reach.low is None:
        return 0
    drive = reach.mechanism.drive
    forwards = (
        drive.torque
        if isinstance(drive, TorqueDrive)
        else (drive.speed if isinstance(drive, SpeedDrive) else drive.track.speed_radps)
    )
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

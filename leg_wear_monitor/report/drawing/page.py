"""A mechanism as one HTML page: through its cycle, with its lengths to compare with the source of them."""

import math
from itertools import combinations
from typing import Any

import numpy as np

from leg_wear_monitor.mechanism.reach.reach import Reach
from leg_wear_monitor.mechanism.reach.words import dead_words
from leg_wear_monitor.mechanism.spec import GROUND, Mechanism, PrismaticJoint
from leg_wear_monitor.mechanism.understood import understood
from leg_wear_monitor.report.drawing.drawing import CREATOR, Drawing
from leg_wear_monitor.report.figures.leg_data import leg_data
from leg_wear_monitor.report.page import Page, Section, page_html, render, template_text
from leg_wear_monitor.report.parts import Live, Sentences, Table

_FLIP = np.array([1.0, -1.0])  # y is downwards in the page


def drawing_html(drawing: Drawing, is_watched: bool = False) -> str:
    """The page as HTML text.

    Parameters
    ----------
    drawing : Drawing
    is_watched : bool
        Whether the page loads itself again every second, to show what has been written meanwhile.
    """
    reach, found = drawing.reach, drawing.findings
    mechanism = reach.mechanism
    faults = [Section("What is wrong", [Sentences(found)])] if found else []
    told = (
        [Section("In everyday units", [Sentences(understood(reach.linkage))])]
        if reach.turns and not found
        else []
    )
    reload = [Section("Redrawn on save", [_reload()])] if is_watched else []
    page = Page(
        title=mechanism.name,
        summary=f"{len(mechanism.bodies)} moving bodies, {len(mechanism.joints)} joints: {drawing.headline}.",
        sections=[
            *faults,
            Section("The mechanism", [_live(drawing)]),
            *reload,
            *told,
            Section("Lengths", [_lengths(mechanism)]),
            Section("Joints", [_joints(reach, drawing.shown)]),
        ],
        generator=CREATOR,
        versions={"drawn from": mechanism.source},
    )
    return page_html(page)


def _live(drawing: Drawing) -> Live:
    """The interactive picture."""
    reach = drawing.reach
    data = leg_data(reach) | {"first": drawing.shown, "runs": [], "said": _said(reach)}
    names: list[str] = []
    if drawing.forces_n is not None:
        data |= _force_data(reach.mechanism, drawing.forces_n)
        names = [""]
    words = "The mechanism at the chosen crank angle" if len(reach.q) > 1 else "The mechanism"
    return Live(
        markup=render("leg_slider.html", data=data, names=names, alt=words),
        script=template_text("leg_slider.js"),
        caption=_caption(drawing, data),
    )


def _said(reach: Reach) -> dict[int, str]:
    """What is said beside the picture at a position: which bodies are in line."""
    if reach.open_joint:
        return {}
    ends = ((0, reach.low), (len(reach.q) - 1, reach.high))
    return {i: f"Dead point: {dead_words(dead)}." for i, dead in ends if dead is not None}


def _caption(drawing: Drawing, data: dict[str, Any]) -> str:
    mechanism = drawing.reach.mechanism
    text = "To scale, all joints without clearance."
    if mechanism.toe is not None and len(drawing.reach.q) > 1:
        text += " Dashed: path of the toe."
    if drawing.forces_n is not None:
        text += (
            " Arrows: force on the pin at the speed of the drive; their length grows with the root of the "
            f"force, up to {data['longest_n']:.0f} N."
        )
    return text


def _force_data(mechanism: Mechanism, forces_n: np.ndarray) -> dict[str, Any]:
    """The forces as the script takes them, N."""
    flipped = (forces_n * _FLIP).round(1)
    pins = {name: {"f": flipped[:, k].tolist()} for k, name in enumerate(mechanism.joints)}
    longest = float(np.linalg.norm(forces_n, axis=-1).max())
    return {"runs": [{"label": "", "pins": pins}], "longest_n": longest or 1.0}


def _reload() -> Live:
    return Live(markup=render("drawing/reload.html"), script=template_text("drawing/reload.js"))


def _lengths(mechanism: Mechanism) -> Table:
    """Distance between any two points of a body, which lie apart."""
    points = {
        GROUND: mechanism.ground.points,
        **{name: body.points for name, body in mechanism.bodies.items()},
    }
    rows = [
        (body, f"{a} – {b}", f"{1e3 * length:.2f}")
        for body, named in points.items()
        for (a, p), (b, q) in combinations(named.items(), 2)
        if (length := math.dist(p, q)) > 0.0
    ]
    return Table(
        caption="Distances between the points of each body", head=("body", "points", "mm"), rows=rows
    )


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

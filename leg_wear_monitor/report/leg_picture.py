"""The leg as a figure."""

from collections.abc import Collection

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from leg_wear_monitor.mechanism.position import carriers, corners
from leg_wear_monitor.mechanism.reach import Reach, reach_of
from leg_wear_monitor.mechanism.spec import GROUND, Mechanism
from leg_wear_monitor.report.figure import (
    BODY_COLOURS,
    INK,
    PALE,
    PAPER,
    SMALL,
    USUAL,
    VERMILION,
    finish,
    new_figure,
    plain,
)


def draw_leg(axes: Axes, reach: Reach, shown: int, clearance_joints: Collection[str]) -> None:
    """Draw one position of a mechanism to scale: bodies, joints, the path of its toe, an open joint.

    ``shown`` is the number of the position, from 0, among the positions of the reach.
    """
    mechanism = reach.mechanism
    for k, (name, body) in enumerate(mechanism.bodies.items()):
        outline = corners({point: reach.path(name, point)[shown] for point in body.points})
        colour = BODY_COLOURS[k % len(BODY_COLOURS)]
        axes.fill(*outline.T, color=colour, alpha=0.35, linewidth=0.0)
        mark = "s" if len(outline) == 1 else None  # a slider
        closed = np.vstack([outline, outline[:1]])
        axes.plot(*closed.T, color=colour, linewidth=4.0, marker=mark, markersize=14.0, label=plain(name))
    for spring in mechanism.springs.values():
        ends = [
            reach.path(body, point)[shown] for body, point in zip(spring.bodies, spring.points, strict=True)
        ]
        axes.plot(*np.array(ends).T, ":", color=INK, linewidth=1.5)
    for name in mechanism.joints:
        x, y = reach.path(carriers(mechanism, name)[1], name)[shown]
        colour = VERMILION if name in clearance_joints else INK
        if GROUND in mechanism.sides(name):
            axes.plot(x, y, "^", color=PALE, markersize=16.0)
        axes.plot(x, y, "o", markerfacecolor=PAPER, markeredgecolor=colour, markersize=6.0)
        axes.annotate(plain(name), (x, y), (7, 7), textcoords="offset points", color=colour, fontsize=USUAL)
        if reach.is_open(name):
            ends = [reach.path(body, name)[shown] for body in carriers(mechanism, name)]
            axes.plot(*np.array(ends).T, "--", color=VERMILION, linewidth=1.8)
    if mechanism.toe is not None:
        axes.plot(*reach.path(*mechanism.toe).T, "--", color=INK, linewidth=1.0, label="path of the toe")
    axes.set_aspect("equal", adjustable="datalim")


def leg_picture(mechanism: Mechanism, joints: Collection[str]) -> Figure:
    """Figure of a mechanism at crank angle 0 with the path of its toe; the clearance joints in colour."""
    figure = new_figure(7.0, 5.0)
    axes = figure.subplots()
    draw_leg(axes, reach_of(mechanism), 0, joints)
    finish(axes, plain(mechanism.name), x="x [m]", y="y [m]")
    axes.legend(fontsize=SMALL, frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5))
    return figure

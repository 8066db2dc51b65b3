"""Drawing of bodies, joints, supports and springs of a mechanism."""

from collections.abc import Mapping

import numpy as np
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.report.figures.figure import INK, PAPER, USUAL, VERMILION, plain

_WIDTH = 9.0  # of a bar [points]
_HALO = [patheffects.withStroke(linewidth=3.0, foreground=PAPER)]


def lighter(colour: str, fraction: float) -> tuple[float, float, float]:
    """A colour (red, green, blue) mixed with a fraction of white, 0 to 1."""
    red, green, blue = (fraction + (1.0 - fraction) * part for part in to_rgb(colour))
    return red, green, blue


def draw_body(axes: Axes, corners: Floats, colour: str, layer: float) -> None:
    """Draw a plate or a bar with round ends around the corners (n, 2) [m], a square for one corner."""
    if len(corners) == 1:  # a slider
        axes.plot(*corners[0], marker="s", markersize=2.4 * _WIDTH, color=lighter(colour, 0.55), zorder=layer)
        return
    for edge, line in ((colour, _WIDTH + 2.0), (lighter(colour, 0.55), _WIDTH)):
        shape = Polygon(
            corners, closed=len(corners) > 2, facecolor=edge, edgecolor=edge, linewidth=line, zorder=layer
        )
        shape.set_joinstyle("round")
        shape.set_capstyle("round")
        axes.add_patch(shape)


def draw_support(axes: Axes, place: Floats, away: Floats) -> None:
    """Draw a ground support: a triangle above or below the pivot, on the side of the vector ``away`` (2,)."""
    up = 1.6 if away[1] > 0.0 else -1.6
    triangle = [(0.0, 0.0), (-0.8, up), (0.8, up), (0.0, 0.0)]
    axes.plot(*place, marker=triangle, markersize=32.0, color=lighter(INK, 0.6), zorder=1.0, linewidth=0.0)


def draw_spring(axes: Axes, ends: tuple[Floats, Floats], layer: float) -> None:
    """Draw a spring as a zigzag between two points (2,) [m]."""
    start, end = ends
    fraction = np.array([0.0, 0.15, *np.linspace(0.2, 0.8, 11), 0.85, 1.0])
    side = np.array([0.0, 0.0, *(1.0 if i % 2 else -1.0 for i in range(11)), 0.0, 0.0])
    across = 0.04 * np.array([start[1] - end[1], end[0] - start[0]])
    line = start + fraction[:, None] * (end - start) + side[:, None] * across
    axes.plot(*line.T, color=INK, linewidth=1.0, zorder=layer)


def draw_joint(axes: Axes, place: Floats, names: Mapping[str, bool], away: Floats) -> None:
    """Draw the joints that share one place; ``names`` maps each name to whether the joint has clearance.

    The names are written side by side on the side of the vector ``away`` (2,).
    """
    axes.add_line(joint_mark(any(names.values()), place))
    dx, dy = 13.0 * away / (np.hypot(*away) or 1.0)
    wide = [6.0 * len(name) + 5.0 for name in names]
    start = dx - 0.5 * sum(wide) + 0.5 * np.sign(dx) * (abs(dx) > 8.0) * (sum(wide) - wide[0])
    for i, (name, has_clearance) in enumerate(names.items()):  # side by side, each in its own colour
        along = start + sum(wide[:i]) + 0.5 * wide[i]
        write_beside(axes, place, name, (along, dy), VERMILION if has_clearance else INK)


def write_beside(axes: Axes, place: Floats, text: str, offset: tuple[float, float], colour: str) -> None:
    """Write bold text at an offset (2,) [points] from a place (2,) [m]."""
    axes.annotate(
        plain(text),
        (float(place[0]), float(place[1])),
        xytext=offset,
        textcoords="offset points",
        ha="center",
        va="center",
        fontsize=USUAL,
        fontweight="bold",
        color=colour,
        path_effects=_HALO,
        zorder=30.0,
    )


def draw_gap(axes: Axes, ends: tuple[Floats, Floats], text: str) -> None:
    """Draw the distance between the two points (2,) [m] of an open joint."""
    axes.plot(*np.array(ends).T, "--", color=VERMILION, linewidth=1.8, zorder=19.0)
    axes.plot(*ends[0], "o", markerfacecolor=PAPER, markeredgecolor=VERMILION, markersize=5.5, zorder=20.0)
    write_beside(axes, 0.5 * (ends[0] + ends[1]), text, (0.0, 22.0), VERMILION)


def joint_mark(has_clearance: bool, place: Floats | tuple[float, float] = (0.0, 0.0)) -> Line2D:
    """The marker of a joint, for the picture or for its legend."""
    return Line2D(
        [place[0]],
        [place[1]],
        linestyle="none",
        marker="o",
        markersize=8.5 if has_clearance else 5.5,
        markerfacecolor=PAPER,
        markeredgecolor=VERMILION if has_clearance else INK,
        markeredgewidth=2.4 if has_clearance else 1.2,
        zorder=20.0,
    )

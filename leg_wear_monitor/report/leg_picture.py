"""The leg as a figure, and the figures of a simulation."""

from collections.abc import Collection, Mapping
from itertools import cycle
from typing import Any

import numpy as np
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon

from leg_wear_monitor.dynamics.result import SimulationResult
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import (
    build_linkage,
    carriers,
    corners,
    one_cycle,
    point_path,
)
from leg_wear_monitor.mechanism.reach import DeadPoint, Reach
from leg_wear_monitor.mechanism.spec import GROUND, Mechanism, PrismaticJoint
from leg_wear_monitor.report.figure import (
    BODY_COLOURS,
    INK,
    PAPER,
    SMALL,
    USUAL,
    VERMILION,
    finish,
    force_traces,
    new_figure,
    plain,
    png,
    worn_bushings,
)

# Drawing of single bodies, joints, supports and springs.


_BAR_WIDTH = 9.0  # points
# white edge of texts, so that they can be read on any body
_HALO = [patheffects.withStroke(linewidth=3.0, foreground=PAPER)]


def lighter(colour: str, fraction: float) -> tuple[float, float, float]:
    """A colour (red, green, blue) mixed with a fraction of white, 0 to 1."""
    red, green, blue = (fraction + (1.0 - fraction) * part for part in to_rgb(colour))
    return red, green, blue


def draw_body(axes: Axes, outline: Floats, colour: str, layer: float) -> None:
    """Draw a plate or a bar with round ends around the corners (n, 2) [m], a square for one corner."""
    if len(outline) == 1:  # a slider
        fill, side = lighter(colour, 0.55), 2.4 * _BAR_WIDTH
        axes.plot(*outline[0], marker="s", markersize=side, color=fill, zorder=layer)
        return
    # a dark shape, and on it a lighter one that is narrower by the outline
    for edge, line in ((colour, _BAR_WIDTH + 2.0), (lighter(colour, 0.55), _BAR_WIDTH)):
        look = {"color": edge, "linewidth": line, "joinstyle": "round", "capstyle": "round"}
        axes.add_patch(Polygon(outline, closed=len(outline) > 2, zorder=layer, **look))


def draw_support(axes: Axes, place: Floats, away: Floats) -> None:
    """Draw a ground support: a triangle above or below the pivot, on the side of the vector ``away`` (2,)."""
    up = 1.6 if away[1] > 0.0 else -1.6
    triangle = [(0.0, 0.0), (-0.8, up), (0.8, up), (0.0, 0.0)]
    axes.plot(*place, marker=triangle, markersize=32.0, color=lighter(INK, 0.6), zorder=1.0, linewidth=0.0)


def draw_spring(axes: Axes, ends: tuple[Floats, Floats]) -> None:
    """Draw a spring as a zigzag between two points (2,) [m]."""
    start, end = ends
    fraction = np.array([0.0, 0.15, *np.linspace(0.2, 0.8, 11), 0.85, 1.0])
    side = np.array([0.0, 0.0, *(1.0 if i % 2 else -1.0 for i in range(11)), 0.0, 0.0])
    across = 0.04 * np.array([start[1] - end[1], end[0] - start[0]])
    line = start + fraction[:, None] * (end - start) + side[:, None] * across
    axes.plot(*line.T, color=INK, linewidth=1.0, zorder=15.0)  # above the bodies, below the joints


def draw_joint(axes: Axes, place: Floats, names: Mapping[str, bool], away: Floats) -> None:
    """Draw the joints that share one place; ``names`` maps each name to whether the joint has clearance.

    The names are written side by side on the side of the vector ``away`` (2,).
    """
    axes.add_line(joint_mark(any(names.values()), place))
    dx, dy = 13.0 * away / (np.hypot(*away) or 1.0)
    # estimated widths of the names [points]; beside the joint the row of names starts or ends at it, above or
    # below it the row is centred
    wide = [6.0 * len(name) + 5.0 for name in names]
    is_beside = abs(dx) > 8.0
    start = dx - 0.5 * sum(wide) + 0.5 * np.sign(dx) * is_beside * (sum(wide) - wide[0])
    for i, (name, has_clearance) in enumerate(names.items()):  # each in its own colour
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


# Figures of the whole leg to scale: its bodies, its joints and the path of its toe.


PATH_POINTS = 360  # of a gait cycle
_TOE_STEP_DEG, _BODIES_STEP_DEG = 30, 60  # of the crank, between dots of the toe and between drawn positions
_ONE_PLACE_M = 1.0e-3  # joints closer than this are drawn at one place [m]
_PANEL_IN, _LEGEND_IN = 4.4, 1.2  # widths [inch]

Paths = dict[str, dict[str, Floats]]  # path (N, 2) [m] of each point, by body and point


def leg_picture(mechanism: Mechanism, clearance_joints: Collection[str] | None = None) -> Figure:
    """Figure of the ideal mechanism at crank angle 0 (left) and over one gait cycle (right), to one scale.

    Parameters
    ----------
    mechanism : Mechanism
    clearance_joints : collection of str, optional
        Joints to mark as clearance joints; default: ``mechanism.clearance_joints``.

    Returns
    -------
    Figure

    Raises
    ------
    AssemblyError
        If the mechanism does not close or has a dead point.
    """
    joints = mechanism.clearance_joints if clearance_joints is None else clearance_joints
    paths = _paths(mechanism, one_cycle(build_linkage(mechanism), PATH_POINTS, 1.0).q)
    low, high = _extent(paths)
    height = (_PANEL_IN - 0.5) * (high[1] - low[1]) / (high[0] - low[0]) + 0.75
    figure = new_figure(2.0 * _PANEL_IN + _LEGEND_IN, float(np.clip(height, 2.8, 6.4)))
    position, cycle_axes, legend = figure.subplots(1, 3, width_ratios=(_PANEL_IN, _PANEL_IN, _LEGEND_IN))
    _draw_position(position, mechanism, paths, 0, joints)
    _draw_cycle(cycle_axes, mechanism, paths)
    _draw_legend(legend, mechanism)
    toe = f", the toe every {_TOE_STEP_DEG}° of the crank" if mechanism.toe else ""
    position.set_title(f"{plain(mechanism.name)}, crank at 0°", fontsize=USUAL, color=INK)
    cycle_axes.set_title(f"one cycle{toe}", fontsize=USUAL, color=INK)
    for axes, y in ((position, "y [m]"), (cycle_axes, "")):
        finish(axes, x="x [m]", y=y)
        axes.set(aspect="equal", xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    return figure


def draw_leg(axes: Axes, reach: Reach, shown: int) -> None:
    """Draw one position of a mechanism to scale, the path of its toe, an open joint, and joints in line.

    ``shown`` is the number of the position, from 0, among those that the reach has.
    """
    mechanism, paths = reach.mechanism, _paths(reach.mechanism, reach.q)
    low, high = _extent(paths)
    _draw_position(axes, mechanism, paths, shown, mechanism.clearance_joints)
    _draw_toe_path(axes, mechanism, paths, is_closed=reach.turns)
    for joint in mechanism.joints:
        if reach.is_open(joint):
            first, last = (paths[body][joint][shown] for body in carriers(mechanism, joint))
            draw_gap(axes, (first, last), f"{1e3 * reach.gap_of(joint)[shown]:.3g} mm")
    for i, dead in in_line(reach):
        if i == shown:
            line = np.array([paths[mechanism.sides(joint)[1]][joint][i] for joint in dead.joints])
            axes.plot(*line.T, "--", color=VERMILION, linewidth=1.8, zorder=19.0)
    axes.set(aspect="equal", xlim=(low[0], high[0]), ylim=(low[1], high[1]))


def in_line(reach: Reach) -> list[tuple[int, DeadPoint]]:
    """Numbers of the positions in which three joints are in line, with the dead points."""
    ends = ((0, reach.low), (len(reach.q) - 1, reach.high))
    return [(i, dead) for i, dead in ends if dead and dead.is_in_line and not reach.open_joint]


def _paths(mechanism: Mechanism, q: Floats) -> Paths:
    """Paths of all points at coordinates q (N, n, 3): x, y [m] and angle [rad] of n bodies in N positions."""
    return {
        body: {point: point_path(mechanism, q, body, point) for point in mechanism.points_of(body)}
        for body in (GROUND, *mechanism.bodies)
    }


def _extent(paths: Paths) -> tuple[Floats, Floats]:
    """Lower left and upper right corner (2,) [m] of the box around all paths, with a margin."""
    every = np.concatenate([path for body in paths.values() for path in body.values()])
    low, high = every.min(axis=0), every.max(axis=0)
    margin = 0.07 * float((high - low).max())
    return low - margin, high + margin


def _colours(mechanism: Mechanism) -> dict[str, str]:
    return dict(zip(mechanism.bodies, cycle(BODY_COLOURS), strict=False))


def _draw_position(
    axes: Axes, mechanism: Mechanism, paths: Paths, shown: int, clearance_joints: Collection[str]
) -> None:
    """Draw the mechanism in one position of its paths, and the whole paths of sliders."""
    here = {body: {name: path[shown] for name, path in of.items()} for body, of in paths.items()}
    shapes = {body: corners(here[body]) for body in mechanism.bodies}
    colours = _colours(mechanism)
    largest_first = sorted(shapes, key=lambda name: -float(np.ptp(shapes[name], axis=0).sum()))
    for layer, body in enumerate(largest_first):
        draw_body(axes, shapes[body], colours[body], 2.0 + 0.5 * layer)
    for names, place in _places(mechanism, here):
        sides = {body for name in names for body in mechanism.sides(name)}
        away = place - np.mean([shapes[body].mean(axis=0) for body in sides - {GROUND}], axis=0)
        for name in names:
            joint = mechanism.joints[name]
            if isinstance(joint, PrismaticJoint):
                axes.plot(*paths[joint.slider][name].T, color=lighter(INK, 0.6), linewidth=4.0, zorder=1.0)
            elif GROUND in mechanism.sides(name):
                draw_support(axes, place, away)
                away = np.array([-1.0, 0.3 * np.sign(away[1])])  # the name beside the support, not on it
        draw_joint(axes, place, {name: name in clearance_joints for name in names}, away)
    for spring in mechanism.springs.values():
        a, b = (here[body][point] for body, point in zip(spring.bodies, spring.points, strict=True))
        draw_spring(axes, (a, b))
    if mechanism.toe is not None:
        body, point = mechanism.toe
        place = here[body][point]
        axes.plot(*place, "o", color=INK, markersize=4.5, zorder=20.0)
        dx, dy = place - shapes[body].mean(axis=0)
        write_beside(axes, place, "toe", (16.0 if dx > 0.0 else -16.0, 8.0 if dy > 0.0 else -8.0), INK)


def _places(mechanism: Mechanism, here: Mapping[str, Mapping[str, Floats]]) -> list[tuple[list[str], Floats]]:
    """Groups of joints at one place: their names, and the place (2,) [m]."""
    groups: list[tuple[list[str], Floats]] = []
    for name in mechanism.joints:
        place = here[carriers(mechanism, name)[1]][name]
        near = [names for names, other in groups if np.hypot(*(place - other)) < _ONE_PLACE_M]
        if near:
            near[0].append(name)
        else:
            groups.append(([name], place))
    return groups


def _draw_cycle(axes: Axes, mechanism: Mechanism, paths: Paths) -> None:
    """Draw outlines of the bodies in positions over a gait cycle, and the path of the toe."""
    for body, colour in _colours(mechanism).items():
        for i in range(0, PATH_POINTS, PATH_POINTS * _BODIES_STEP_DEG // 360):
            outline = corners({name: path[i] for name, path in paths[body].items()})
            closed, mark = np.vstack([outline, outline[:1]]), "s" if len(outline) == 1 else None
            look: dict[str, Any] = {
                "color": lighter(colour, 0.35),
                "marker": mark,
                "linewidth": 1.6,
                "alpha": 0.7,
            }
            axes.plot(*closed.T, solid_capstyle="round", **look)
    _draw_toe_path(axes, mechanism, paths, is_closed=True)


def _draw_toe_path(axes: Axes, mechanism: Mechanism, paths: Paths, is_closed: bool) -> None:
    if mechanism.toe is None:
        return
    body, point = mechanism.toe
    path = paths[body][point]
    line = np.vstack([path, path[:1]]) if is_closed else path
    axes.plot(*line.T, color=INK, linewidth=2.0, zorder=20.0)
    if is_closed:
        every = PATH_POINTS * _TOE_STEP_DEG // 360
        axes.plot(*path[::every].T, "o", color=INK, markersize=4.0, zorder=21.0)


def _draw_legend(axes: Axes, mechanism: Mechanism) -> None:
    axes.set_axis_off()
    entries = {
        plain(body): Line2D([], [], color=lighter(colour, 0.4), linewidth=7.0, solid_capstyle="round")
        for body, colour in _colours(mechanism).items()
    }
    entries |= {"clearance joint": joint_mark(True), "ideal joint": joint_mark(False)}
    if mechanism.toe is not None:
        entries["path of the toe"] = Line2D([], [], color=INK, linewidth=2.0, marker="o", markersize=4.0)
    axes.legend(
        list(entries.values()), list(entries), fontsize=SMALL, frameon=False, loc="center", labelspacing=0.9
    )


# Figures of a simulation as PNG files.


def pictures(mechanism: Mechanism, result: SimulationResult) -> dict[str, bytes | None]:
    """PNG files by file name; None for a figure that needs data which the result does not contain."""
    joints = result.clearance_joints
    files = {"leg.png": png(leg_picture(mechanism, joints)), "wear.png": None, "forces.png": None}
    if result.trace is not None:
        files["forces.png"] = png(force_traces(result.trace, joints or tuple(mechanism.joints)))
    if result.surfaces is not None and joints:
        radii = tuple(mechanism.clearances[name].bushing_radius for name in joints)
        cycles = abs(result.speed_rpm) / 60.0 * result.simulated_s
        title = f"Wear after {cycles:.4g} gait cycles"
        files["wear.png"] = png(worn_bushings(result.surfaces.depth, joints, radii, title))
    return files

"""The leg to scale: its bodies, its joints and the path of its toe."""

from collections.abc import Collection
from itertools import cycle

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import ideal_motion, one_cycle, point_path
from leg_wear_monitor.mechanism.outline import carriers
from leg_wear_monitor.mechanism.outline import corners as body_corners
from leg_wear_monitor.mechanism.position import build_linkage
from leg_wear_monitor.mechanism.reach.reach import Reach
from leg_wear_monitor.mechanism.spec import GROUND, Mechanism, PrismaticJoint
from leg_wear_monitor.report.figures.bodies import (
    draw_body,
    draw_gap,
    draw_joint,
    draw_spring,
    draw_support,
    joint_mark,
    lighter,
    write_beside,
)
from leg_wear_monitor.report.figures.figure import (
    BODY_COLOURS,
    INK,
    SMALL,
    USUAL,
    VERMILION,
    new_figure,
    plain,
    tidy,
)

PATH_POINTS = 360
_TOE_EVERY, _BODIES_EVERY = 30, 60
_NEAR_M = 1.0e-3  # joints closer than this are drawn at one place [m]
_PANEL_IN, _KEY_IN = 4.4, 1.2

Paths = dict[str, dict[str, Floats]]


def leg_picture(
    mechanism: Mechanism, clearance_joints: Collection[str] | None = None, crank_angle_rad: float = 0.0
) -> Figure:
    """Figure of the ideal mechanism at one crank angle (left) and over one gait cycle (right), to one scale.

    Parameters
    ----------
    mechanism : Mechanism
    clearance_joints : collection of str, optional
        Joints to mark as clearance joints; default: ``mechanism.clearance_joints``.
    crank_angle_rad : float
        Crank angle of the left panel [rad].

    Returns
    -------
    Figure

    Raises
    ------
    AssemblyError
        If the mechanism does not close or has a dead point.
    """
    linkage = build_linkage(mechanism)
    here = _paths(mechanism, ideal_motion(linkage, [crank_angle_rad], 1.0).q)
    paths = _paths(mechanism, one_cycle(linkage, PATH_POINTS, 1.0).q)
    low, high = _extent(paths)
    height = (_PANEL_IN - 0.5) * (high[1] - low[1]) / (high[0] - low[0]) + 0.75
    figure = new_figure(2.0 * _PANEL_IN + _KEY_IN, float(np.clip(height, 2.8, 6.4)))
    still, moving, key = figure.subplots(1, 3, width_ratios=(_PANEL_IN, _PANEL_IN, _KEY_IN))
    _draw_still(
        still,
        mechanism,
        here,
        paths,
        mechanism.clearance_joints if clearance_joints is None else clearance_joints,
    )
    _draw_cycle(moving, mechanism, paths)
    _draw_key(key, mechanism)
    still.set_title(
        f"{plain(mechanism.name)}, crank at {np.rad2deg(crank_angle_rad):.0f}°", fontsize=USUAL, color=INK
    )
    toe = f", the toe every {_TOE_EVERY}° of the crank" if mechanism.toe else ""
    moving.set_title(f"one cycle{toe}", fontsize=USUAL, color=INK)
    for axes in (still, moving):
        tidy(axes)
        axes.set(aspect="equal", xlim=(low[0], high[0]), ylim=(low[1], high[1]))
        axes.set_xlabel("x [m]", fontsize=SMALL)
    still.set_ylabel("y [m]", fontsize=SMALL)
    return figure


def draw_leg(axes: Axes, reach: Reach, shown: int) -> None:
    """Draw one position of a mechanism to scale, the path of its toe, and which joint is open or in line."""
    mechanism = reach.mechanism
    paths, here = _paths(mechanism, reach.q), _paths(mechanism, reach.q[shown : shown + 1])
    low, high = _extent(paths)
    _draw_still(axes, mechanism, here, paths, mechanism.clearance_joints)
    _draw_toe_path(axes, mechanism, paths, is_closed=reach.turns)
    for joint in mechanism.joints:
        if reach.is_open(joint):
            first, last = (here[body][joint][0] for body in carriers(mechanism, joint))
            draw_gap(axes, (first, last), f"{1e3 * reach.gap_of(joint)[shown]:.3g} mm")
    for dead, i in ((reach.low, 0), (reach.high, len(reach.q) - 1)):
        if dead is not None and dead.is_in_line and i == shown and not reach.open_joint:
            line = np.array([here[mechanism.sides(joint)[1]][joint][0] for joint in dead.joints])
            axes.plot(*line.T, "--", color=VERMILION, linewidth=1.8, zorder=19.0)
    axes.set(aspect="equal", xlim=(low[0], high[0]), ylim=(low[1], high[1]))


def _paths(mechanism: Mechanism, q: Floats) -> Paths:
    """Path (N, 2) [m] of every point at coordinates q (N, n, 3), by body and point."""
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


def _outline_at(paths: Paths, body: str, i: int) -> Floats:
    return body_corners({name: path[i] for name, path in paths[body].items()})


def _draw_still(
    axes: Axes, mechanism: Mechanism, here: Paths, paths: Paths, clearance_joints: Collection[str]
) -> None:
    shapes = {body: _outline_at(here, body, 0) for body in mechanism.bodies}
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
                away = np.array([-1.0, 0.3 * np.sign(away[1])])
        draw_joint(axes, place, {name: name in clearance_joints for name in names}, away)
    for spring in mechanism.springs.values():
        a, b = (here[body][point][0] for body, point in zip(spring.bodies, spring.points, strict=True))
        draw_spring(axes, (a, b), 15.0)
    if mechanism.toe is not None:
        body, point = mechanism.toe
        place = here[body][point][0]
        axes.plot(*place, "o", color=INK, markersize=4.5, zorder=20.0)
        dx, dy = place - shapes[body].mean(axis=0)
        write_beside(axes, place, "toe", (16.0 if dx > 0.0 else -16.0, 8.0 if dy > 0.0 else -8.0), INK)


def _places(mechanism: Mechanism, here: Paths) -> list[tuple[list[str], Floats]]:
    """Groups of joints that share a place: their names, and the place (2,) [m]."""
    groups: list[tuple[list[str], Floats]] = []
    for name in mechanism.joints:
        place = here[carriers(mechanism, name)[1]][name][0]
        near = [names for names, other in groups if np.hypot(*(place - other)) < _NEAR_M]
        if near:
            near[0].append(name)
        else:
            groups.append(([name], place))
    return groups


def _draw_cycle(axes: Axes, mechanism: Mechanism, paths: Paths) -> None:
    for body, colour in _colours(mechanism).items():
        for i in range(0, PATH_POINTS, PATH_POINTS * _BODIES_EVERY // 360):
            corners = _outline_at(paths, body, i)
            axes.plot(
                *np.vstack([corners, corners[:1]]).T,
                color=lighter(colour, 0.35),
                marker="s" if len(corners) == 1 else None,
                linewidth=1.6,
                alpha=0.7,
                solid_capstyle="round",
            )
    _draw_toe_path(axes, mechanism, paths)


def _draw_toe_path(axes: Axes, mechanism: Mechanism, paths: Paths, is_closed: bool = True) -> None:
    if mechanism.toe is not None:
        body, point = mechanism.toe
        path = paths[body][point]
        if not is_closed:
            axes.plot(*path.T, color=INK, linewidth=2.0, zorder=20.0)
            return
        axes.plot(*np.vstack([path, path[:1]]).T, color=INK, linewidth=2.0, zorder=20.0)
        every = PATH_POINTS * _TOE_EVERY // 360
        axes.plot(*path[::every].T, "o", color=INK, markersize=4.0, zorder=21.0)


def _draw_key(axes: Axes, mechanism: Mechanism) -> None:
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

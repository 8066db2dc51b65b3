"""Drawings of a mechanism: still, as a page, with its reach."""

import math
import textwrap
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import combinations

import attrs
import numpy as np
from matplotlib.axes import Axes

from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.loader import understood
from leg_wear_monitor.mechanism.position import TURN, ideal_motion
from leg_wear_monitor.mechanism.reach import POINTS, Reach, dead_words, findings, headline, reach_of
from leg_wear_monitor.mechanism.spec import GROUND, Mechanism, PrismaticJoint, SpeedDrive, TorqueDrive
from leg_wear_monitor.report.figure import INK, SMALL, USUAL, VERMILION, finish, new_figure, plain, svg
from leg_wear_monitor.report.leg_picture import draw_leg
from leg_wear_monitor.report.leg_slider import leg_data, leg_slider, run_data
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

# What a picture of a mechanism shows, whatever it is written as.


CREATOR = "leg-wear-monitor draw"  # in the head of every drawing: the command replaces no other file
_SAME = 1.0e-9  # rad


@attrs.frozen(eq=False)
class Drawing:
    """A picture of a mechanism.

    Attributes
    ----------
    reach : Reach
        Its positions.
    shown : int
        Position that is shown first.
    forces_n : (p, j, 2) array or None
        Force on the journal's or slider's body in each joint; None if they are not drawn.
    """

    reach: Reach
    shown: int
    forces_n: Floats | None = None

    @property
    def headline(self) -> str:
        """In a few words, whether the mechanism works."""
        return headline(self.reach)

    @property
    def findings(self) -> tuple[str, ...]:
        """What is wrong with the mechanism; empty if it closes and turns."""
        return findings(self.reach)


def drawing_of(
    mechanism: Mechanism, crank_angle: float | None = None, has_forces: bool = False, points: int = POINTS
) -> Drawing:
    """The picture of a mechanism.

    Parameters
    ----------
    mechanism : Mechanism
    crank_angle : float, optional
        Crank angle [rad] of the position that is shown first. Default: 0 if the crank turns through, else the
        dead point in its direction; that of the assembly if the mechanism does not close there.
    has_forces : bool
        Whether the forces in the joints are drawn: those at the speed of the drive, without clearance.
    points : int
        Positions over the range of the crank.

    Raises
    ------
    ConfigError
        If the crank does not reach the angle, or the forces are not known.
    """
    reach = reach_of(mechanism, crank_angle, points)
    shown = _first(reach) if crank_angle is None else _position(reach, crank_angle)
    return Drawing(reach, shown, _forces(reach) if has_forces else None)


def _first(reach: Reach) -> int:
    if reach.turns or reach.open_joint or reach.low is None:
        return 0
    return len(reach.q) - 1 if _drive(reach.mechanism) >= 0.0 else 0


def _drive(mechanism: Mechanism) -> float:
    """Speed [rad/s] of the drive, or its torque [N m]."""
    drive = mechanism.drive
    if isinstance(drive, TorqueDrive):
        return drive.torque
    return drive.speed if isinstance(drive, SpeedDrive) else drive.track.speed_radps


def _position(reach: Reach, crank_angle: float) -> int:
    """The position at a crank angle [rad]."""
    away = np.abs((reach.crank_angle - crank_angle + 0.5 * TURN) % TURN - 0.5 * TURN)
    i = int(away.argmin())
    if away[i] > _SAME:
        fault = f"{np.rad2deg(crank_angle):g} deg cannot be drawn: {headline(reach)}"
        raise ConfigError("--crank-angle", "", fault)
    return i


def _forces(reach: Reach) -> Floats:
    if not reach.turns:
        raise ConfigError("--forces", "", f"there are no forces over a cycle: {headline(reach)}")
    if isinstance(reach.mechanism.drive, TorqueDrive):
        raise ConfigError(
            "--forces", "", "drive.torque does not tell the speed, expected drive.speed in the file"
        )
    return ideal_motion(reach.linkage, reach.crank_angle, _drive(reach.mechanism)).joint_force


# A mechanism as one HTML page: through its cycle, with its lengths to compare with the source of them.


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
    everyday = understood(reach.linkage) if reach.turns and not found else []
    units = [Section("In everyday units", [Sentences(everyday)])] if everyday else []
    again = Fragment(render("drawing/reload.html"), template_text("drawing/reload.js"))
    reload = [Section("Redrawn on save", [again])] if is_watched else []
    page = Page(
        title=mechanism.name,
        summary=f"{len(mechanism.bodies)} moving bodies, {len(mechanism.joints)} joints: {drawing.headline}.",
        sections=[
            *faults,
            Section("The mechanism", [_live(drawing)]),
            *reload,
            *units,
            Section("Lengths", [_lengths(mechanism)]),
            Section("Joints", [_joints(reach, drawing.shown)]),
        ],
        generator=CREATOR,
        versions={"drawn from": mechanism.source},
    )
    return page_html(page)


def _live(drawing: Drawing) -> Fragment:
    """The interactive picture."""
    reach, mechanism, text = drawing.reach, drawing.reach.mechanism, "To scale, all joints without clearance."
    data = leg_data(reach) | {"first": drawing.shown, "runs": [], "said": _dead_points(reach)}
    if mechanism.toe is not None and len(reach.q) > 1:
        text += " Dashed: path of the toe."
    if drawing.forces_n is not None:
        run = run_data("", tuple(mechanism.joints), drawing.forces_n)
        data |= {"runs": [run], "longest_n": run["largest_n"] or 1.0}
        text += (
            " Arrows: force on the pin at the speed of the drive; their length grows with the root of the "
            f"force, up to {data['longest_n']:.0f} N."
        )
    words = "The mechanism at the chosen crank angle" if len(reach.q) > 1 else "The mechanism"
    return leg_slider(data, words, text)


def _dead_points(reach: Reach) -> dict[int, str]:
    """Sentence beside the picture at a position: which bodies are in line."""
    if reach.open_joint:
        return {}
    ends = ((0, reach.low), (len(reach.q) - 1, reach.high))
    return {i: f"Dead point: {dead_words(dead)}." for i, dead in ends if dead is not None}


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


# A mechanism in one position as SVG, or on matplotlib's axes.


_LINE = 88  # letters of a finding in a line
_SIDE_IN, _LINE_IN = 6.0, 0.17


def drawing_svg(drawing: Drawing) -> bytes:
    """The picture as SVG, with what is wrong below it."""
    found = [line for text in drawing.findings for line in textwrap.wrap(text, _LINE)]
    below = _LINE_IN * len(found)
    figure = new_figure(_SIDE_IN, _SIDE_IN + below)
    with _any_letter():
        if found:
            axes, words = figure.subplots(2, 1, height_ratios=(_SIDE_IN, below))
            words.set_axis_off()
            text = "\n".join(plain(line) for line in found)
            words.text(0.0, 1.0, text, fontsize=SMALL, color=VERMILION, va="top")
        else:
            axes = figure.subplots()
        draw_drawing(axes, drawing)
        return svg(figure, CREATOR)


def draw_drawing(axes: Axes, drawing: Drawing) -> None:
    """Draw the position that is shown first, titled with the name, the crank angle and what is wrong."""
    reach = drawing.reach
    draw_leg(axes, reach, drawing.shown)
    title = f"{plain(reach.mechanism.name)}, crank at {np.rad2deg(reach.crank_angle[drawing.shown]):.4g}°"
    if drawing.findings:
        title += "\n" + "\n".join(plain(line) for line in textwrap.wrap(drawing.headline, 60))
    axes.set_title(title, fontsize=USUAL, color=VERMILION if drawing.findings else INK)
    finish(axes, x="x [m]", y="y [m]")


@contextmanager
def _any_letter() -> Iterator[None]:
    """Do not warn of letters that the font lacks: a box stands for them."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing from")
        yield

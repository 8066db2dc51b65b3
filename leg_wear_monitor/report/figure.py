"""Figures in one style: a life, a leg."""

import io
from collections.abc import Collection

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from leg_wear_monitor.errors import printable
from leg_wear_monitor.life.result import Life
from leg_wear_monitor.mechanism.arrays import Floats, Ints
from leg_wear_monitor.mechanism.position import carriers, corners
from leg_wear_monitor.mechanism.reach import Reach, reach_of
from leg_wear_monitor.mechanism.spec import GROUND, Mechanism
from leg_wear_monitor.recordings.result import ReplaySummary

# Style of the figures: matplotlib without pyplot, in colours that colour-blind readers can distinguish.


# Okabe and Ito, Color Universal Design, 2008
BLUE, ORANGE, GREEN, VERMILION = "#0072b2", "#e69f00", "#009e73", "#d55e00"
PURPLE, SKY, YELLOW = "#cc79a7", "#56b4e9", "#f0e442"
BODY_COLOURS = (ORANGE, BLUE, GREEN, PURPLE, SKY, VERMILION, YELLOW)
INK, PALE, PAPER = "#222222", "#d9d9d9", "#ffffff"

SMALL, USUAL = 8.0, 9.5  # font sizes in points


def use_own_style() -> None:
    """Draw with the defaults of matplotlib, because a ``matplotlibrc`` here could stop a command."""
    matplotlib.rcdefaults()


def new_figure(width: float, height: float) -> Figure:
    """An empty figure of the given width and height [inch], with the Agg backend."""
    figure = Figure(figsize=(width, height), facecolor=PAPER, layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def png(figure: Figure, dots_per_inch: float = 100.0) -> bytes:
    """The figure as PNG; with the same libraries, equal figures give equal bytes."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=dots_per_inch, metadata={"Software": None})
    return buffer.getvalue()


def plain(text: str) -> str:
    """A name from a file for matplotlib: on one line, with escaped dollar signs, which begin formulas."""
    return printable(text, 200).replace("$", r"\$")


def tidy(axes: Axes) -> None:
    """Format axes: left and bottom frame lines only, a pale grid below the data."""
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_color(PALE)
    axes.tick_params(labelsize=SMALL, color=PALE, labelcolor=INK)
    axes.grid(color=PALE, linewidth=0.6, alpha=0.7)
    axes.set_axisbelow(True)


def finish(axes: Axes, title: str = "", x: str = "", y: str = "", columns: int = 0) -> None:
    """Format axes, with a title, labels, and a legend of at most so many columns for several named lines."""
    tidy(axes)
    if title:
        axes.set_title(title, fontsize=SMALL + 1.0, color=INK, fontweight="bold")
    axes.set_xlabel(x, fontsize=SMALL)
    axes.set_ylabel(y, fontsize=SMALL)
    names = axes.get_legend_handles_labels()[1]
    if columns and len(names) > 1:
        axes.legend(fontsize=SMALL, frameon=False, ncols=min(columns, len(names)), handletextpad=0.3)


# Units that make values easy to read.


_LENGTHS = ((1.0e12, "pm"), (1.0e9, "nm"), (1.0e6, "µm"), (1.0e3, "mm"))


def length_unit(greatest_m: float) -> tuple[float, str]:
    """The smallest unit that shows a length [m] below 1000: its factor from metres, and its name."""
    return next(((scale, unit) for scale, unit in _LENGTHS if scale * greatest_m < 1000.0), _LENGTHS[-1])


def time_unit(longest_s: float) -> tuple[float, str]:
    """A unit that shows a time [s] as a readable number: its factor from seconds, and its name."""
    if longest_s > 3.0 * 3600.0:
        return 1.0 / 3600.0, "h"
    return (1.0 / 60.0, "min") if longest_s > 300.0 else (1.0, "s")


# Series of a replay's summary over the time since the start of the recording.


def time_of(summary: ReplaySummary, stamps_ns: Ints) -> tuple[Floats, str]:
    """Stamps (n,) [ns] as times since the start of the recording, and their common unit."""
    factor, unit = time_unit(summary.recording.duration_s)
    return np.asarray(factor * (stamps_ns - summary.recording.begin_ns) / 1.0e9, np.float64), unit


def opened(summary: ReplaySummary) -> tuple[dict[str, Floats], str]:
    """Growth of each clearance since the first gait cycle, by joint, and the unit."""
    columns = summary.history.modelled_m if len(summary.history.stamp_ns) else {}
    metres = {joint: values - values[0] for joint, values in columns.items()}
    scale, unit = length_unit(max((_greatest(values) for values in metres.values()), default=0.0))
    return {joint: scale * values for joint, values in metres.items()}, unit


def _greatest(values: Floats) -> float:
    known = np.abs(values[np.isfinite(values)])
    return float(known.max()) if len(known) else 0.0


LEAST_N = 0.1  # lower end of a logarithmic axis [N]: the force of a journal in free flight is 0


# Figure of a leg's wear life: clearances and peak forces over gait cycles.


def life_picture(life: Life) -> bytes:
    """PNG: mean (solid) and largest (dashed) clearance, and peak force, over the gait cycles."""
    use_own_style()
    figure = new_figure(9.0, 3.6)
    clearance, peak = figure.subplots(1, 2)
    draw_life(clearance, life)
    clearance.plot([], [], color=INK, ls="--", lw=0.7, label="deepest")
    for k in range(len(life.clearance_joints)):
        peak.plot(life.cycles, 1e-3 * life.peak_force_n[:, k], color=_colour(k))
    finish(clearance, x="gait cycles", y="radial clearance [µm]", columns=3)
    finish(peak, x="gait cycles", y="peak contact force [kN]")
    return png(figure)


def draw_life(axes: Axes, life: Life) -> None:
    """Mean (and dashed, largest) clearance [µm] of each joint over the gait cycles."""
    for k, joint in enumerate(life.clearance_joints):
        axes.plot(life.cycles, 1e6 * life.clearance_m[:, k], color=_colour(k), label=joint)
        axes.plot(life.cycles, 1e6 * life.clearance_max_m[:, k], color=_colour(k), ls="--", lw=0.7)


def _colour(k: int) -> str:
    return BODY_COLOURS[k % len(BODY_COLOURS)]


# The leg.


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

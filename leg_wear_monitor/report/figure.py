"""Figures in one style: forces, lives, worn bushings."""

import io
from collections.abc import Sequence

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from leg_wear_monitor.dynamics.result import Trace
from leg_wear_monitor.errors import printable
from leg_wear_monitor.life.result import Life
from leg_wear_monitor.mechanism.arrays import Floats, Ints
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.recordings.result import ReplaySummary
from leg_wear_monitor.wear import BUSHING, JOURNAL, wear_zone

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


# Drive torque and joint forces over the crank angle, from a trace.


LEAST_N = 0.1  # lower end of the logarithmic axis [N]: the force of a journal in free flight is 0


def force_traces(trace: Trace, joints: Sequence[str]) -> Figure:
    """Figure of a simulation's trace: a panel for the drive torque and one for each joint.

    Parameters
    ----------
    trace : Trace
    joints : sequence of str
        Joints to show, in this order.

    Returns
    -------
    Figure
    """
    turns = trace.crank_angle_rad / TURN
    figure = new_figure(9.0, 1.1 * (1 + len(joints)) + 0.6)
    panels = np.atleast_1d(figure.subplots(1 + len(joints), 1, sharex=True))
    _draw(panels[0], turns, trace.drive_torque_nm, "drive\n[N m]", VERMILION)
    for axes, name in zip(panels[1:], joints, strict=True):
        _draw(axes, turns, np.maximum(trace.force_n[name], LEAST_N), f"{name}\n[N]", BLUE)
        axes.set_yscale("log")
    panels[-1].set_xlabel("turns of the crank, from the first used turn", fontsize=SMALL)
    panels[0].set_xlim(turns.min(), turns.max())
    title = f"Drive torque and joint forces; at {LEAST_N} N the journal is free"
    figure.suptitle(title, fontsize=USUAL, fontweight="bold", color=INK)
    return figure


def _draw(axes: Axes, turns: Floats, values: Floats, label: str, colour: str) -> None:
    axes.plot(turns, values, color=colour, linewidth=0.7)
    axes.set_ylabel(label, fontsize=SMALL, rotation=0.0, ha="right", va="center")
    tidy(axes)


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
    mean, largest = 1e6 * life.clearance_m, 1e6 * life.clearance_max_m
    draw_clearances(axes, life.cycles, mean, largest, life.clearance_joints)


def draw_clearances(
    axes: Axes, cycles: Floats, mean: Floats, largest: Floats, names: Sequence[str | None]
) -> None:
    """Mean clearance and, dashed, largest clearance (n, k) of joints over the gait cycles (n,)."""
    for k, joint in enumerate(names):
        axes.plot(cycles, mean[:, k], color=_colour(k), label=joint)
        axes.plot(cycles, largest[:, k], color=_colour(k), ls="--", lw=0.7)


def _colour(k: int) -> str:
    return BODY_COLOURS[k % len(BODY_COLOURS)]


def worn_bushings(depth: Floats, names: Sequence[str], title: str) -> Figure:
    """Figure of the wear depth (k, 2, N) [m] of bushing and journal over the angle, joint by joint.

    The angles that contain 90 % of the bushing's wear are shaded.
    """
    scale, unit = length_unit(float(depth.max()))
    figure = new_figure(max(2, len(names)) * 2.3, 2.8)
    panels = figure.subplots(1, len(names), squeeze=False)[0]
    angle = (np.arange(depth.shape[-1]) + 0.5) * (360.0 / depth.shape[-1])
    for axes, name, worn in zip(panels, names, depth, strict=True):
        if (zone := wear_zone(worn[BUSHING])) is not None:
            for turn in (0.0, -360.0):  # a zone may cross 360 degrees
                axes.axvspan(zone[0] + turn, zone[1] + turn, color=PALE, alpha=0.6, linewidth=0.0)
        axes.plot(angle, scale * worn[BUSHING], color=BLUE, linewidth=1.2, label="bushing")
        axes.plot(angle, scale * worn[JOURNAL], color=VERMILION, linewidth=1.2, label="journal")
        axes.set(xlim=(0.0, 360.0), xticks=(0.0, 90.0, 180.0, 270.0, 360.0), ylim=(0.0, None))
        finish(axes, name, x="angle in its own body [°]", columns=1)
    panels[0].set_ylabel(f"depth [{unit}]", fontsize=SMALL)
    figure.suptitle(title, fontsize=USUAL, fontweight="bold", color=INK)
    return figure

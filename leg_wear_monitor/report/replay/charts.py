"""What a replay found, over time: clearances, forces, input, alarms."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.alarms.alarm import Level
from leg_wear_monitor.playback.result.replay_summary import ReplaySummary
from leg_wear_monitor.report.figures.figure import (
    BLUE,
    GREEN,
    INK,
    ORANGE,
    PALE,
    PURPLE,
    SKY,
    SMALL,
    VERMILION,
    new_figure,
    tidy,
)

COLOURS = (BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY, INK)
LEVEL_COLOURS = {Level.OK: GREEN, Level.WARN: ORANGE, Level.ERROR: VERMILION}
_WIDTH_IN, _PANEL_IN = 9.0, 2.3
_UNITS = ((1.0e12, "pm"), (1.0e9, "nm"), (1.0e6, "µm"), (1.0e3, "mm"))


def time_axis(summary: ReplaySummary) -> tuple[Floats, str]:
    """Time of each entry of the history since the recording's begin, and its unit."""
    seconds = (summary.history.stamp_ns.astype(float) - summary.recording.begin_ns) / 1.0e9
    longest = float(seconds.max()) if len(seconds) else 0.0
    if longest > 3.0 * 3600.0:
        return seconds / 3600.0, "h"
    return (seconds / 60.0, "min") if longest > 300.0 else (seconds, "s")


def clearance_chart(summary: ReplaySummary) -> Figure:
    """How much each clearance has opened since the first gait cycle."""
    figure = new_figure(_WIDTH_IN, 3.2)
    axes = figure.add_subplot()
    unit = draw_openings(axes, summary)
    _finish([axes], unit, len(summary.history.clearance_m))
    return figure


def draw_openings(axes: Axes, summary: ReplaySummary) -> str:
    """Draw how much each clearance has opened since the first gait cycle; gives the unit of the time."""
    time, unit = time_axis(summary)
    clearances = summary.history.clearance_m if len(time) else {}
    opened = {joint: values - values[0] for joint, values in clearances.items()}
    greatest = max((float(np.nanmax(np.abs(values))) for values in opened.values()), default=0.0)
    scale, name = next(((s, n) for s, n in _UNITS if s * greatest < 1000.0), _UNITS[-1])
    for colour, (joint, values) in zip(COLOURS, opened.items(), strict=False):
        axes.plot(time, scale * values, color=colour, label=joint, linewidth=1.3)
    axes.ticklabel_format(useOffset=False)
    axes.set_ylabel(f"opened by [{name}]", fontsize=SMALL)
    return unit


def force_chart(summary: ReplaySummary) -> Figure:
    """Peak and mean contact force of each joint in each gait cycle, a panel a joint."""
    time, unit = time_axis(summary)
    history, limits = summary.history, summary.monitor.limits
    joints = list(history.peak_force_n)
    figure = new_figure(_WIDTH_IN, 0.6 + 1.25 * max(1, len(joints)))
    panels = list(np.atleast_1d(figure.subplots(max(1, len(joints)), 1, sharex=True)))
    for k, (axes, joint) in enumerate(zip(panels, joints, strict=False)):
        peak, mean = history.peak_force_n[joint], history.mean_force_n[joint]
        axes.fill_between(time, mean, peak, color=SKY, alpha=0.4, linewidth=0.0)
        axes.plot(time, peak, color=BLUE, linewidth=0.9)
        axes.plot(time, mean, color=INK, linewidth=0.9)
        own = limits.joint_impact_force_n
        limit = own[k] if own else limits.impact_force_n
        if limit < 3.0 * np.nanmax(peak):
            axes.axhline(limit, color=VERMILION, linewidth=1.0, linestyle=(0, (4, 2)))
        axes.set_ylim(bottom=0.0)
        axes.set_ylabel(f"{joint} [N]", fontsize=SMALL)
    _finish(panels, unit, 0)
    return figure


def health_chart(summary: ReplaySummary) -> Figure:
    """Cadence, the torque's mismatch, and the load and friction that explain the rest."""
    time, unit = time_axis(summary)
    history = summary.history
    figure = new_figure(_WIDTH_IN, 3.0 * _PANEL_IN * 0.75)
    panels = list(figure.subplots(3, 1, sharex=True))
    panels[0].plot(time, history.cadence_rpm, color=BLUE, linewidth=1.1)
    panels[0].axhline(summary.monitor.commanded_rpm, color=INK, linewidth=0.8, linestyle=(0, (4, 2)))
    panels[0].ticklabel_format(useOffset=False)
    panels[0].set_ylabel("cadence [rpm]", fontsize=SMALL)
    for label, torque, colour in (
        ("measured", history.measured_torque_rms_nm, VERMILION),
        ("predicted", history.predicted_torque_rms_nm, BLUE),
    ):
        panels[1].plot(time, torque, color=colour, linewidth=1.1, label=label)
    panels[1].set_ylabel("torque, RMS [N m]", fontsize=SMALL)
    panels[1].legend(fontsize=SMALL, frameon=False, loc="upper right", ncols=2)
    panels[2].plot(time, history.torque_mismatch, color=BLUE, linewidth=1.1)
    limit = summary.monitor.limits.torque_mismatch
    panels[2].axhline(limit, color=VERMILION, linewidth=1.0, linestyle=(0, (4, 2)))
    panels[2].set_ylabel("mismatch", fontsize=SMALL)
    panels[2].set_ylim(bottom=0.0)
    _finish(panels, unit, 0)
    return figure


def alarm_chart(summary: ReplaySummary) -> Figure:
    """When each alarm that was ever raised was at which level."""
    begin, end = summary.recording.begin_ns, summary.recording.end_ns
    changes = summary.alarms.changes
    names = list(dict.fromkeys(change.alarm.name for change in changes))
    span, unit = _span((end - begin) / 1.0e9)
    figure = new_figure(_WIDTH_IN, 0.9 + 0.28 * max(1, len(names)))
    axes = figure.add_subplot()
    for row, name in enumerate(reversed(names)):
        own = [change for change in changes if change.alarm.name == name]
        times = [(change.stamp_ns - begin) / 1.0e9 / span for change in own]
        times.append((end - begin) / 1.0e9 / span)
        for k, change in enumerate(own):
            colour = LEVEL_COLOURS[change.alarm.level]
            width = max(times[k + 1] - times[k], 0.0)
            axes.barh(row, width, left=times[k], height=0.7, color=colour, linewidth=0.0)
            axes.plot([times[k]] * 2, [row - 0.35, row + 0.35], color=colour, linewidth=1.2)
    axes.set_yticks(range(len(names)), list(reversed(names)), fontsize=SMALL)
    axes.set_xlim(0.0, max((end - begin) / 1.0e9 / span, 1.0e-9))
    tidy(axes)
    axes.set_xlabel(f"time [{unit}]", fontsize=SMALL)
    keys = {
        level.name: Line2D([], [], color=colour, linewidth=5.0) for level, colour in LEVEL_COLOURS.items()
    }
    axes.legend(
        list(keys.values()),
        list(keys),
        ncols=3,
        fontsize=SMALL,
        frameon=False,
        loc="lower right",
        bbox_to_anchor=(1.0, 1.0),
    )
    return figure


def _span(seconds: float) -> tuple[float, str]:
    if seconds > 3.0 * 3600.0:
        return 3600.0, "h"
    return (60.0, "min") if seconds > 300.0 else (1.0, "s")


def _finish(panels: list[Axes], unit: str, lines: int) -> None:
    for axes in panels:
        tidy(axes)
        axes.spines["left"].set_color(PALE)
    panels[-1].set_xlabel(f"time since the recording's begin [{unit}]", fontsize=SMALL)
    if lines:
        panels[0].legend(fontsize=SMALL, frameon=False, ncols=lines, loc="upper left")

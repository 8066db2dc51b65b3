"""How much each clearance of a replay has opened, on matplotlib's axes."""

from matplotlib.axes import Axes

from leg_wear_monitor.playback.result.replay_summary import ReplaySummary
from leg_wear_monitor.report.figures.figure import BLUE, GREEN, INK, ORANGE, PURPLE, SKY, SMALL, VERMILION
from leg_wear_monitor.report.figures.replay_series import opened, time_of

_COLOURS = (BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY, INK)


def draw_openings(axes: Axes, summary: ReplaySummary) -> str:
    """Draw how much each clearance has opened since the first gait cycle; gives the unit of the time."""
    time, time_unit = time_of(summary, summary.history.stamp_ns)
    columns, unit = opened(summary)
    for colour, (joint, values) in zip(_COLOURS, columns.items(), strict=False):
        axes.plot(time, values, color=colour, label=joint, linewidth=1.3)
    axes.ticklabel_format(useOffset=False)
    axes.set_ylabel(f"opened by [{unit}]", fontsize=SMALL)
    return time_unit

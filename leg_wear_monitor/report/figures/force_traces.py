"""Drive torque and joint forces over the crank angle, from a trace."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from leg_wear_monitor.dynamics.result.parts import Trace
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.report.figures.figure import BLUE, INK, SMALL, USUAL, VERMILION, new_figure, tidy

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
    panels[-1].set_xlabel("turns of the crank, from the first one counted", fontsize=SMALL)
    panels[0].set_xlim(turns.min(), turns.max())
    title = f"Drive torque and joint forces; at {LEAST_N} N the journal is free"
    figure.suptitle(title, fontsize=USUAL, fontweight="bold", color=INK)
    return figure


def _draw(axes: Axes, turns: Floats, values: Floats, label: str, colour: str) -> None:
    axes.plot(turns, values, color=colour, linewidth=0.7)
    axes.set_ylabel(label, fontsize=SMALL, rotation=0.0, ha="right", va="center")
    tidy(axes)

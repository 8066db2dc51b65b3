"""A result, or a mechanism, on matplotlib's axes, for a notebook or a script to go on with."""

from functools import singledispatch
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from leg_wear_monitor.dynamics.result.simulation_result import SimulationResult
from leg_wear_monitor.life.result import Life
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.verdict.verdict import Figure
from leg_wear_monitor.playback.result.replay_summary import ReplaySummary
from leg_wear_monitor.playback.summary import ReplayResult
from leg_wear_monitor.report.drawing.drawing import drawing_of
from leg_wear_monitor.report.drawing.still import draw_drawing
from leg_wear_monitor.report.figures.figure import BODY_COLOURS, SMALL, tidy
from leg_wear_monitor.report.figures.force_traces import LEAST_N
from leg_wear_monitor.report.figures.leg_picture import PATH_POINTS
from leg_wear_monitor.report.figures.life_picture import draw_clearances
from leg_wear_monitor.report.figures.openings import draw_openings


@singledispatch
def plot(result: Any, axes: Axes | None = None) -> Axes:
    """Draw a result, or a mechanism.

    Parameters
    ----------
    result : SimulationResult, Life, ReplayResult, ReplaySummary or Mechanism
        Of a simulation, the force in each clearance joint over the turns of the crank, or without a trace the
        mean, 99 % and largest force in every joint [N]; of a life, the clearance of each joint over the gait
        cycles [µm]; of a replay, how much each clearance has opened over time, dotted and named
        in the title where the verdict says that this is not valid; of a mechanism, its bodies at crank
        angle 0, to scale, and the path of its toe [m]; where it does not close or turn, the bodies apart, or
        at the dead point.
    axes : matplotlib.axes.Axes, optional
        Where to draw; new axes of pyplot without.

    Returns
    -------
    matplotlib.axes.Axes

    Examples
    --------
    >>> import leg_wear_monitor as lw
    >>> axes = lw.plot(lw.simulate("four_bar", clearances=[], cycles=1))
    >>> axes.get_ylabel()
    'force [N]'
    """
    raise TypeError(
        f"{type(result).__name__} has no picture, expected SimulationResult, Life, ReplaySummary or Mechanism"
    )


@plot.register
def _simulation(result: SimulationResult, axes: Axes | None = None) -> Axes:
    axes = _new() if axes is None else axes
    if result.trace is None:
        _bars(axes, result)
    else:
        names = result.clearance_joints or tuple(result.joints)
        for k, name in enumerate(names):
            force = np.maximum(result.trace.force_n[name], LEAST_N)
            colour = BODY_COLOURS[k % len(BODY_COLOURS)]
            axes.plot(result.trace.crank_angle_rad / TURN, force, color=colour, linewidth=0.7, label=name)
        axes.set_yscale("log")
        axes.set_xlabel("turns of the crank", fontsize=SMALL)
    axes.set_ylabel("force [N]", fontsize=SMALL)
    return _finished(axes)


def _bars(axes: Axes, result: SimulationResult) -> None:
    """Mean, 99 % and largest force of every joint side by side."""
    place = np.arange(len(result.joints))
    for k, (label, field) in enumerate((("mean", "mean"), ("99 %", "p99"), ("max", "max"))):
        forces = [getattr(joint, f"{field}_force_n") for joint in result.joints.values()]
        axes.bar(place + 0.27 * (k - 1), forces, 0.25, color=BODY_COLOURS[k], label=label)
    axes.set_xticks(place, list(result.joints))


@plot.register
def _life(result: Life, axes: Axes | None = None) -> Axes:
    axes = _new() if axes is None else axes
    draw_clearances(axes, result)
    axes.set_xlabel("gait cycles", fontsize=SMALL)
    axes.set_ylabel("radial clearance [µm]", fontsize=SMALL)
    return _finished(axes)


@plot.register
def _replay(result: ReplaySummary, axes: Axes | None = None) -> Axes:
    axes = _new() if axes is None else axes
    unit = draw_openings(axes, result)
    if Figure.CLEARANCES in result.verdict.not_valid:
        for line in axes.get_lines():
            line.set_linestyle(":")
        axes.set_title(f"not valid: {Figure.CLEARANCES.words} ({result.verdict.fault_code})", fontsize=SMALL)
    axes.set_xlabel(f"time since the recording's begin [{unit}]", fontsize=SMALL)
    return _finished(axes)


@plot.register
def _replay_result(result: ReplayResult, axes: Axes | None = None) -> Axes:
    return _replay(result.summary(), axes)


@plot.register
def _mechanism(result: Mechanism, axes: Axes | None = None) -> Axes:
    axes = _new() if axes is None else axes
    draw_drawing(axes, drawing_of(result, points=PATH_POINTS))
    return _finished(axes)


def _new() -> Axes:
    """Axes of pyplot, which a notebook shows by itself and ``pyplot.show()`` in a window."""
    from matplotlib import pyplot

    axes: Axes = pyplot.subplots(layout="constrained")[1]
    return axes


def _finished(axes: Axes) -> Axes:
    tidy(axes)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize=SMALL, frameon=False)
    return axes

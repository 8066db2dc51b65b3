"""Pictures of results and mechanisms on matplotlib axes."""

from functools import singledispatch
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from leg_wear_monitor.dynamics.result import SimulationResult
from leg_wear_monitor.life.result import Life
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.mechanism.reach import findings, reach_of
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.playback.result import ReplaySummary
from leg_wear_monitor.playback.summary import ReplayResult
from leg_wear_monitor.report.drawing import first_position
from leg_wear_monitor.report.figure import (
    BLUE,
    BODY_COLOURS,
    GREEN,
    INK,
    LEAST_N,
    ORANGE,
    PURPLE,
    SKY,
    SMALL,
    VERMILION,
    draw_life,
    finish,
    opened,
    plain,
    time_of,
)
from leg_wear_monitor.report.leg_picture import draw_leg
from leg_wear_monitor.state import Figure

_COLOURS = (BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY, INK)

# A result, or a mechanism, on matplotlib's axes, for a notebook or a script to go on with.


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
    axes, across = _new() if axes is None else axes, ""
    if result.trace is None:
        _bars(axes, result)
    else:
        for k, name in enumerate(result.clearance_joints or tuple(result.joints)):
            force = np.maximum(result.trace.force_n[name], LEAST_N)
            colour = BODY_COLOURS[k % len(BODY_COLOURS)]
            axes.plot(result.trace.crank_angle_rad / TURN, force, color=colour, linewidth=0.7, label=name)
        axes.set_yscale("log")
        across = "turns of the crank"
    return _finished(axes, across, "force [N]")


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
    draw_life(axes, result)
    return _finished(axes, "gait cycles", "radial clearance [µm]")


@plot.register
def _replay(result: ReplaySummary | ReplayResult, axes: Axes | None = None) -> Axes:
    axes = _new() if axes is None else axes
    summary = result.summary() if isinstance(result, ReplayResult) else result
    time, time_unit = time_of(summary, summary.history.stamp_ns)
    columns, unit = opened(summary)
    is_valid = Figure.CLEARANCES not in summary.verdict.not_valid
    for colour, (joint, values) in zip(_COLOURS, columns.items(), strict=False):
        axes.plot(time, values, "-" if is_valid else ":", color=colour, label=joint, linewidth=1.3)
    axes.ticklabel_format(useOffset=False)
    if not is_valid:
        words = f"not valid: {Figure.CLEARANCES.words} ({summary.verdict.fault_code})"
        axes.set_title(words, fontsize=SMALL)
    return _finished(axes, f"time since the recording's begin [{time_unit}]", f"opened by [{unit}]")


@plot.register
def _mechanism(result: Mechanism, axes: Axes | None = None) -> Axes:
    axes, reach = _new() if axes is None else axes, reach_of(result)
    shown = first_position(reach)
    draw_leg(axes, reach, shown, result.clearance_joints)
    title = f"{plain(result.name)}, crank at {np.rad2deg(reach.crank_angle[shown]):.4g}°"
    axes.set_title("\n".join([title, *map(plain, findings(reach))]), fontsize=SMALL)
    return _finished(axes, "x [m]", "y [m]")


def _new() -> Axes:
    """Axes of pyplot, which a notebook shows by itself and ``pyplot.show()`` in a window."""
    from matplotlib import pyplot

    axes: Axes = pyplot.subplots(layout="constrained")[1]
    return axes


def _finished(axes: Axes, x: str, y: str) -> Axes:
    finish(axes, x=x, y=y)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize=SMALL, frameon=False)
    return axes

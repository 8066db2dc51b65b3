"""Pictures of results and mechanisms on matplotlib axes."""

from collections.abc import Sequence
from functools import singledispatch
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.projections.polar import PolarAxes
from matplotlib.ticker import MaxNLocator

from leg_wear_monitor.dynamics.result import SimulationResult, Trace
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.life.result import Life
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.mechanism.reach import findings, reach_of
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.recordings.result import ReplaySummary
from leg_wear_monitor.recordings.summary import ReplayResult
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
    draw_leg,
    draw_life,
    finish,
    leg_picture,
    length_unit,
    new_figure,
    opened,
    plain,
    png,
    time_of,
    use_own_style,
)
from leg_wear_monitor.state import Figure
from leg_wear_monitor.wear import BUSHING, JOURNAL

_COLOURS = (BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY, INK)

# A result, or a mechanism, on matplotlib axes, so that a notebook or a script can add to it.


@singledispatch
def plot(result: Any, axes: Axes | None = None, **of_simulation: str) -> Axes:
    """Draw a result, or a mechanism, at the width of a column.

    Parameters
    ----------
    result : SimulationResult, Life, ReplayResult, ReplaySummary or Mechanism
        A simulation: the force in each clearance joint over the turns of the crank, or without a trace the
        mean, 99 % and largest force in every joint [N]. A life: the clearance of each joint over the gait
        cycles [µm]. A replay: how much each clearance has opened over time, dotted and named
        in the title where the verdict says that this is not valid. A mechanism: its bodies at crank
        angle 0, to scale, and the path of its toe [m]; if it does not close or turn, the bodies apart, or
        at the dead point.
    axes : matplotlib.axes.Axes, optional
        Where to draw; default: new axes of pyplot.
    kind : str, optional
        Quantity of a simulation to draw: ``force``, ``portrait`` (place of a journal in its bushing against
        its rate), ``poincare`` (the same once per gait cycle), ``wear`` (depth around bushing and journal),
        ``torque``, or the deviation of the toe from the ideal leg: ``displacement``, ``velocity``,
        ``acceleration``. All but ``wear`` need a trace.
    joint : str, optional
        Clearance joint of a portrait, a Poincaré section or the wear; default: the first.

    Returns
    -------
    matplotlib.axes.Axes
        Its figure saves as PDF or SVG: ``axes.figure.savefig("portrait.pdf")``.

    Raises
    ------
    ConfigError
        If the result lacks the trace or the joint, or the kind does not exist.

    Examples
    --------
    >>> import leg_wear_monitor as lw
    >>> axes = lw.plot(lw.simulate("four_bar", clearances=[], cycles=1))
    >>> axes.get_ylabel()
    'force [N]'
    """
    raise TypeError(
        f"{type(result).__name__} has no picture. Expected SimulationResult, Life, ReplaySummary or Mechanism"
    )


_TURNS = "turns of the crank"
# kinds of a trace's column: field, factor, label
_OF_TRACE = {
    "torque": ("drive_torque_nm", 1.0, "drive torque [N m]"),
    "displacement": ("toe_error_m", 1.0e3, "toe displacement error [mm]"),
    "velocity": ("toe_error_mps", 1.0, "toe velocity error [m/s]"),
    "acceleration": ("toe_error_mps2", 1.0, "toe acceleration error [m/s²]"),
}


@plot.register
def _simulation(
    result: SimulationResult, axes: Axes | None = None, kind: str = "force", joint: str = ""
) -> Axes:
    if kind == "force":
        return _force(result, _new() if axes is None else axes)
    if kind not in (*_OF_TRACE, "portrait", "poincare", "wear"):
        known = ", ".join(("force", "portrait", "poincare", "wear", *_OF_TRACE))
        raise ConfigError("kind", "", f"{kind!r} is not one of {known}")
    if kind in _OF_TRACE:
        return _column(_trace(result), kind, _new() if axes is None else axes)
    name = joint or next(iter(result.clearance_joints), "")
    if name not in result.clearance_joints:
        known = ", ".join(result.clearance_joints) or "none, the leg is ideal"
        raise ConfigError("joint", "", f"{name!r} has no clearance. Expected one of: {known}")
    if kind == "wear":
        return _wear(result, name, _new(projection="polar") if axes is None else axes)
    return _plane(_trace(result), name, kind, _new() if axes is None else axes)


def _trace(result: SimulationResult) -> Trace:
    if result.trace is None:
        raise ConfigError("trace", "", "the result has no trace. Expected a simulation with trace=N")
    return result.trace


def _force(result: SimulationResult, axes: Axes) -> Axes:
    if result.trace is None:
        _bars(axes, result)
        return _finished(axes, "", "force [N]")
    return _forces(result.trace, result.clearance_joints or tuple(result.joints), axes)


def _forces(trace: Trace, joints: Sequence[str], axes: Axes) -> Axes:
    """Forces over the turns of the crank; a journal in free flight is at the lower end of the axis."""
    for k, name in enumerate(joints):
        force, colour = np.maximum(trace.force_n[name], LEAST_N), BODY_COLOURS[k % len(BODY_COLOURS)]
        axes.plot(trace.crank_angle_rad / TURN, force, color=colour, linewidth=0.7, label=name)
    axes.set_yscale("log")
    return _finished(axes, _TURNS, "force [N]")


def _column(trace: Trace, kind: str, axes: Axes) -> Axes:
    """The drive torque, or the size of a deviation of the toe, over the turns of the crank."""
    field, factor, label = _OF_TRACE[kind]
    values = getattr(trace, field)
    if values is None:
        raise ConfigError("kind", "", f"the result has no {kind} error. Expected a toe and a steady crank")
    size = values if values.ndim == 1 else np.linalg.norm(values, axis=1)
    axes.plot(trace.crank_angle_rad / TURN, factor * size, color=BLUE, linewidth=0.7)
    return _finished(axes, _TURNS, label)


def _plane(trace: Trace, name: str, kind: str, axes: Axes) -> Axes:
    """Place of a journal against its rate: a line, or one point per gait cycle."""
    joint, step = trace.joints[name], 1
    look: dict[str, Any] = {"linewidth": 0.5}
    if kind == "poincare":
        look = {"linestyle": "", "marker": ".", "ms": 3.0}
        step = max(1, round(TURN / abs(float(np.diff(trace.crank_angle_rad[:2])[0]))))
    for i, (axis, colour) in enumerate((("x", BLUE), ("y", VERMILION))):
        place, rate = joint.eccentricity_m[::step, i], joint.eccentricity_rate_mps[::step, i]
        axes.plot(1.0e3 * place, 1.0e3 * rate, color=colour, label=f"{name}, {axis}", **look)
    axes.xaxis.set_major_locator(MaxNLocator(5))  # more labels would overlap at this width
    return _finished(axes, "eccentricity [mm]", "eccentricity rate [mm/s]")


def _wear(result: SimulationResult, name: str, axes: Axes) -> Axes:
    """Depth around bushing and journal, on polar axes or over the angle."""
    depth = result.surfaces.depth[result.clearance_joints.index(name)]  # type: ignore[union-attr]
    scale, unit = length_unit(float(depth.max()))
    angle = (np.arange(depth.shape[1]) + 0.5) * (TURN / depth.shape[1])
    is_polar = isinstance(axes, PolarAxes)
    for surface, label, colour in ((BUSHING, "bushing", BLUE), (JOURNAL, "journal", ORANGE)):
        around = np.append(depth[surface], depth[surface, 0]) if is_polar else depth[surface]
        at = np.append(angle, angle[0] + TURN) if is_polar else np.rad2deg(angle)
        axes.plot(at, scale * around, color=colour, linewidth=0.9, label=f"{name}, {label}")
    if isinstance(axes, PolarAxes):  # has no left and bottom frame line to format
        axes.set_title(f"wear depth [{unit}], angle in the body's frame", fontsize=SMALL)
        axes.tick_params(labelsize=SMALL)
        axes.yaxis.set_major_locator(MaxNLocator(3))
        axes.set_rlabel_position(135.0)
        axes.legend(fontsize=SMALL, frameon=False, loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=2)
        return axes
    return _finished(axes, "angle in the body's frame [°]", f"wear depth [{unit}]")


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
    return _finished(axes, f"time since the start of the recording [{time_unit}]", f"opened by [{unit}]")


@plot.register
def _mechanism(result: Mechanism, axes: Axes | None = None) -> Axes:
    axes, reach = _new() if axes is None else axes, reach_of(result)
    shown = first_position(reach)
    draw_leg(axes, reach, shown, result.clearance_joints)
    title = f"{plain(result.name)}, crank at {np.rad2deg(reach.crank_angle[shown]):.4g}°"
    axes.set_title("\n".join([title, *map(plain, findings(reach))]), fontsize=SMALL)
    return _finished(axes, "x [m]", "y [m]")


_COLUMN_INCH = 3.6, 2.7  # column width of a paper, so that fonts keep their size in print
_SCREEN_DPI = 150.0


def _new(projection: str | None = None) -> Axes:
    """Axes of pyplot, which a notebook shows by itself and ``pyplot.show()`` in a window."""
    from matplotlib import pyplot

    figure = pyplot.figure(figsize=_COLUMN_INCH, dpi=_SCREEN_DPI, layout="constrained")
    axes: Axes = figure.add_subplot(projection=projection)
    return axes


def _finished(axes: Axes, x: str, y: str) -> Axes:
    finish(axes, x=x, y=y)
    if axes.get_legend_handles_labels()[0]:
        axes.legend(fontsize=SMALL, frameon=False)
    return axes


def pictures(mechanism: Mechanism, result: SimulationResult) -> dict[str, bytes | None]:
    """PNG files by file name; None for a figure that needs data which the result does not contain."""
    use_own_style()
    joints = result.clearance_joints
    files = {"leg.png": png(leg_picture(mechanism, joints)), "wear.png": None, "forces.png": None}
    if result.trace is not None:
        shown = joints or tuple(result.joints)
        figure = new_figure(9.0, 1.4 * (1 + len(shown)) + 0.6)
        first, *others = figure.subplots(1 + len(shown), 1, sharex=True)
        _column(result.trace, "torque", first)
        for name, axes in zip(shown, others, strict=True):
            _forces(result.trace, [name], axes)
        for axes in figure.axes:
            axes.label_outer()
        files["forces.png"] = png(figure)
    if result.surfaces is not None and joints:
        figure = new_figure(2.3 * max(2, len(joints)), 2.8)
        for name, axes in zip(joints, figure.subplots(1, len(joints), squeeze=False)[0], strict=True):
            _wear(result, name, axes)
        files["wear.png"] = png(figure)
    return files

"""Pictures and notebook HTML of all results."""

from functools import singledispatch
from typing import Any

import attrs
import numpy as np
from matplotlib.axes import Axes

from leg_wear_monitor.dynamics.result import SimulationResult
from leg_wear_monitor.life.result import Life
from leg_wear_monitor.mechanism.materials import Material
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.verdict.situation import SOURCES
from leg_wear_monitor.playback.result import ReplaySummary
from leg_wear_monitor.playback.summary import ReplayResult
from leg_wear_monitor.report.drawing import draw_drawing, drawing_of, drawing_svg
from leg_wear_monitor.report.figure import BODY_COLOURS, LEAST_N, SMALL, draw_clearances, draw_openings, tidy
from leg_wear_monitor.report.leg_picture import PATH_POINTS
from leg_wear_monitor.report.page import Picture, Table, render
from leg_wear_monitor.state import Figure, Verdict

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


# What a notebook shows of a result or a mechanism: a line, a small table or picture; no script.


_NOT_VALID = "not valid"


@attrs.frozen
class _Shown:
    """What is shown: a heading, lines below it, and a table or a picture."""

    heading: str
    lines: tuple[str, ...] = ()
    table: Table | None = None
    picture: Picture | None = None


@singledispatch
def _shown(result: Any) -> _Shown:
    raise TypeError(f"{type(result).__name__} has no HTML")


def notebook_html(result: Any) -> str:
    """HTML of a result, a verdict, a mechanism or a material; names are escaped."""
    return render("notebook.html", shown=_shown(result))


@_shown.register
def _mechanism_html(mechanism: Mechanism) -> _Shown:
    drawing = drawing_of(mechanism)
    joints = ", ".join(map(mechanism.joint_words, mechanism.joints))
    return _Shown(
        mechanism.name,
        (f"{len(mechanism.bodies)} moving bodies: {drawing.headline}", f"joints {joints}"),
        picture=Picture(image=drawing_svg(drawing), alt=f"{mechanism.name}: {drawing.headline}"),
    )


@_shown.register
def _simulation_html(result: SimulationResult) -> _Shown:
    torque = result.drive_torque_nm
    head = ["joint", "mean force [N]", "99 % [N]", "largest [N]", "in contact [%]", "wear [pm/cycle]"]
    rows = []
    for name, joint in result.joints.items():
        wear = joint.wear_depth_m_per_cycle
        contact = None if joint.contact_fraction is None else 100.0 * joint.contact_fraction
        rows.append((
            name,
            *map(_number, (joint.mean_force_n, joint.p99_force_n, joint.max_force_n, contact)),
            _number(None if wear is None else 1.0e12 * wear.bushing_mean),
        ))  # fmt: skip
    lines = (
        f"{result.model} model, {result.speed_rpm:.4g} rpm, {result.cycles:.4g} gait cycles",
        f"drive torque {_number(torque.min)} to {_number(torque.max)} N m, rms {_number(torque.rms)} N m",
    )
    return _Shown(result.mechanism, lines, Table(caption="Joints", head=head, rows=rows))


@_shown.register
def _life_html(life: Life) -> _Shown:
    head = ["joint", "clearance when new [µm]", "at the end [µm]", "growth at the end [pm/cycle]"]
    rows = [
        (
            name,
            _number(1.0e6 * life.clearance_m[0, k]),
            _number(1.0e6 * life.clearance_m[-1, k]),
            _number(1.0e12 * life.growth_m_per_cycle[-1, k]),
        )
        for k, name in enumerate(life.clearance_joints)
    ]
    lines = (f"{life.cycles[-1]:.4g} gait cycles",)
    return _Shown("Life", lines, Table(caption="Clearance joints", head=head, rows=rows))


@_shown.register
def _replay_html(summary: ReplaySummary) -> _Shown:
    shown = _verdict(summary.verdict)
    head = ["joint", "clearance [mm]", "according to", "limit [mm]"]
    rows = [
        (
            name,
            _NOT_VALID if each.believed_m is None else _number(1.0e3 * each.believed_m),
            "" if each.believed_by is None else SOURCES[each.believed_by],
            _number(1.0e3 * each.limit_m),
        )
        for name, each in summary.clearances.items()
    ]
    return attrs.evolve(
        shown,
        lines=(*shown.lines, summary.advice),
        table=Table(caption="Clearance joints", head=head, rows=rows),
    )


@_shown.register
def _verdict(verdict: Verdict) -> _Shown:
    whose = f" (joint {', '.join(verdict.joints)})" if verdict.joints else ""
    not_valid = ", ".join(figure.words for figure in verdict.not_valid)
    lines = (f"{verdict.why} [{verdict.fault_code}]", f"to do: {verdict.do}")
    more = (f"{_NOT_VALID}: {not_valid}",) if not_valid else ()
    return _Shown(f"Verdict: {verdict.state.words}{whose}", (*lines, *more))


@_shown.register
def _material(pair: Material) -> _Shown:
    rows = [(key, value.text, value.conditions, value.source) for key, value in pair.values()]
    notes = (f"note: {pair.notes}",) if pair.notes else ()
    lines = (
        pair.title,
        f"bushing: {pair.bushing.material}; journal: {pair.journal.material}; lubricant: {pair.lubricant}",
        f"regime: {pair.regime}",
        *notes,
    )
    head = ["value", "given", "conditions", "source"]
    return _Shown(
        pair.name, lines, Table(caption="Values with their sources", head=head, rows=rows, is_text=True)
    )


@_shown.register
def _replay_result_html(result: ReplayResult) -> _Shown:
    return _replay_html(result.summary())


def _number(value: float | None) -> str:
    return "" if value is None else f"{float(f'{value:.4g}'):g}"  # 11640, not 1.164e+04

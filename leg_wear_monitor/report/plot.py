"""Pictures and notebook HTML of all results."""

from functools import singledispatch
from typing import Any

import attrs
import numpy as np
from matplotlib.axes import Axes

from leg_wear_monitor.dynamics.result import SimulationResult
from leg_wear_monitor.estimate.cause import SURE_SIGMAS, Change
from leg_wear_monitor.life.result import Life
from leg_wear_monitor.mechanism.materials import Material
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.alarms import ADVICE
from leg_wear_monitor.monitor.diagnosis.state import Diagnosis, ExplainedTorque
from leg_wear_monitor.monitor.verdict.decision import decision_of
from leg_wear_monitor.monitor.verdict.situation import SEEN, SOURCES
from leg_wear_monitor.monitor.verdict.verdict import EVIDENCE, diagnosis_words, estimate
from leg_wear_monitor.playback.result import ReplaySummary
from leg_wear_monitor.playback.summary import ReplayResult
from leg_wear_monitor.report.drawing import draw_drawing, drawing_of, drawing_svg
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
    new_figure,
    opened,
    svg,
    time_of,
)
from leg_wear_monitor.report.leg_picture import PATH_POINTS
from leg_wear_monitor.report.page import NOT_VALID, Picture, Table, render
from leg_wear_monitor.state import Figure, LegState, Verdict

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
    axes = _new() if axes is None else axes
    draw_drawing(axes, drawing_of(result, points=PATH_POINTS))
    return _finished(axes, axes.get_xlabel(), axes.get_ylabel())


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


# What a notebook shows of a result or a mechanism: a line, a small table or picture; no script.


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
    head, rows = ["joint", "clearance when new [µm]", "at the end [µm]", "growth at the end [pm/cycle]"], []
    for k, name in enumerate(life.clearance_joints):
        new, end = (_number(1.0e6 * life.clearance_m[at, k]) for at in (0, -1))
        rows.append((name, new, end, _number(1.0e12 * life.growth_m_per_cycle[-1, k])))
    lines = (f"{life.cycles[-1]:.4g} gait cycles",)
    return _Shown("Life", lines, Table(caption="Clearance joints", head=head, rows=rows))


@_shown.register
def _state_html(state: LegState | ReplayResult) -> _Shown:
    """Of a leg now, and of a replay: verdict and decision, clearances in a table and against their limits."""
    state = state.summary() if isinstance(state, ReplayResult) else state
    words = state.leg.joint_words if isinstance(state, ReplaySummary) else str
    shown, decision = _verdict(state.verdict), decision_of(state, words)
    lines = (*shown.lines, *(f"{title.lower()}: {text}" for title, text in decision.notes))
    head, rows = ["joint", "clearance [mm]", "according to", "limit [mm]"], []
    for name, each in state.clearances.items():
        believed = NOT_VALID if each.believed_m is None else _number(1.0e3 * each.believed_m)
        source = "" if each.believed_by is None else SOURCES[each.believed_by]
        rows.append((name, believed, source, _number(1.0e3 * each.limit_m)))
    return attrs.evolve(
        shown,
        lines=(*lines, ADVICE),
        table=Table(caption="Clearance joints", head=head, rows=rows),
        picture=_clearance_picture(state),
    )


def _clearance_picture(state: LegState) -> Picture | None:
    """Believed clearance of each joint with two standard deviations, against its limit; None without any."""
    known = [(joint, each) for joint, each in state.clearances.items() if each.believed_m is not None]
    if not known:
        return None
    figure = new_figure(5.0, 0.7 + 0.32 * len(known))
    axes = figure.subplots()
    for row, (_, each) in enumerate(known):
        reach = 1.0e3 * SURE_SIGMAS * (each.believed_sigma_m or 0.0)
        value, limit = 1.0e3 * (each.believed_m or 0.0), 1.0e3 * each.limit_m
        colour = VERMILION if value >= limit else BLUE
        axes.errorbar(value, row, xerr=reach, fmt="o", color=colour, capsize=3.0)
        axes.plot([limit, limit], [row - 0.35, row + 0.35], color=VERMILION, linewidth=2.0)
        if each.seen_m is not None and each.believed_by not in SEEN:  # an estimate beside it
            sigma = 1.0e3 * SURE_SIGMAS * (each.seen_sigma_m or 0.0)
            axes.errorbar(1.0e3 * each.seen_m, row + 0.2, xerr=sigma, fmt="D", ms=3.0, color=INK, capsize=2.0)
    axes.set_yticks(range(len(known)), [joint for joint, _ in known])
    axes.set_ylim(len(known) - 0.5, -0.5)
    axes.set_xlim(0.0, None)
    finish(axes, x="clearance [mm], two standard deviations; black: estimate beside it; red: limit")
    values = "; ".join(f"{joint} {1.0e3 * (each.believed_m or 0.0):.3g} mm" for joint, each in known)
    return Picture(image=svg(figure), alt=f"Clearances against their limits: {values}")


@_shown.register
def _diagnosis_html(found: Diagnosis) -> _Shown:
    """What the drive torque shows, with odds, the estimates, and the torque that they rest on."""
    heading, *lines = diagnosis_words(found, found.joints).split("; ")
    lines += [f"over {found.cycles} gait cycles"] if found.cycles else []
    lines += map(_change_words, found.changes)
    estimates = zip(found.joints, found.clearance_m, found.sigma_m, strict=False)
    rows = [
        (joint, *("not observable" if np.isnan(each) else _number(1.0e3 * each) for each in pair))
        for joint, *pair in estimates
    ]
    head = ["joint", "estimate [mm]", "±, one standard deviation [mm]"]
    table = Table(caption="Clearances by the drive torque", head=head, rows=rows) if rows else None
    picture = _torque_picture(found.torque) if found.torque else None
    return _Shown(f"Diagnosis: {heading}", tuple(lines), table, picture)


def _change_words(change: Change) -> str:
    """A change with the odds for it."""
    subject = f" of {change.subject}" if change.subject else ""
    size = estimate(change.value, change.sigma, EVIDENCE.get(change.cause, ("", "m"))[1])
    words = f"{change.cause.value}{subject}: {size}, odds {_odds(change.log_odds)} against the leg as counted"
    if change.runner_up:
        words += f", {_odds(change.runner_up_log_odds)} against {change.runner_up}"
    return words


def _odds(log_odds: float) -> str:
    """Odds as a power of ten; above a hundred digits, more say no more."""
    digits = log_odds / np.log(10.0)
    return "over 10^100 to 1" if digits > 100.0 else f"10^{digits:.0f} to 1"


def _torque_picture(torque: ExplainedTorque) -> Picture:
    """Torque over the crank angle: measured, as the counted clearances give it, and as the estimates do."""
    figure = new_figure(5.0, 2.6)
    axes = figure.subplots()
    angle = 360.0 * (np.arange(len(torque.measured_nm)) + 0.5) / len(torque.measured_nm)
    axes.plot(angle, torque.measured_nm, color=INK, linewidth=1.6, label="measured")
    axes.plot(angle, torque.counted_nm, "--", color=BLUE, linewidth=1.2, label="of the counted clearances")
    axes.plot(angle, torque.estimated_nm, color=VERMILION, linewidth=1.0, label="of the estimated clearances")
    axes.set_xlim(0.0, 360.0)
    _finished(axes, "crank angle [°]", "drive torque [N m]")
    rests = (torque.measured_nm - each for each in (torque.counted_nm, torque.estimated_nm))
    counted, estimated = (f"{np.sqrt(np.mean(rest**2)):.3g} N m RMS" for rest in rests)
    alt = f"Drive torque: {counted} off the counted clearances, {estimated} off the estimated ones"
    return Picture(image=svg(figure), alt=alt)


@_shown.register
def _verdict(verdict: Verdict) -> _Shown:
    whose = f" (joint {', '.join(verdict.joints)})" if verdict.joints else ""
    not_valid = ", ".join(figure.words for figure in verdict.not_valid)
    lines = (f"{verdict.why} [{verdict.fault_code}]", f"to do: {verdict.do}")
    more = (f"{NOT_VALID}: {not_valid}",) if not_valid else ()
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


def _number(value: float | None) -> str:
    return "" if value is None else f"{float(f'{value:.4g}'):g}"  # 11640, not 1.164e+04

"""What a notebook shows of a result or a mechanism: a line, a small table or picture; no script."""

from functools import singledispatch
from typing import Any

import attrs

from leg_wear_monitor.dynamics.result.simulation_result import SimulationResult
from leg_wear_monitor.life.result import Life
from leg_wear_monitor.mechanism.materials.material import Material
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.verdict.verdict import Figure, Verdict
from leg_wear_monitor.playback.result.replay_summary import ReplaySummary
from leg_wear_monitor.playback.summary import ReplayResult
from leg_wear_monitor.report.drawing.drawing import drawing_of
from leg_wear_monitor.report.drawing.still import drawing_svg
from leg_wear_monitor.report.page import render
from leg_wear_monitor.report.parts import Picture, Table

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
def _mechanism(mechanism: Mechanism) -> _Shown:
    drawing = drawing_of(mechanism)
    joints = ", ".join(map(mechanism.joint_words, mechanism.joints))
    return _Shown(
        mechanism.name,
        (f"{len(mechanism.bodies)} moving bodies: {drawing.headline}", f"joints {joints}"),
        picture=Picture(image=drawing_svg(drawing), alt=f"{mechanism.name}: {drawing.headline}"),
    )


@_shown.register
def _simulation(result: SimulationResult) -> _Shown:
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
def _life(life: Life) -> _Shown:
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
def _replay(summary: ReplaySummary) -> _Shown:
    shown, verdict = _verdict(summary.verdict), summary.verdict
    is_valid = Figure.CLEARANCES not in verdict.not_valid
    head = ["joint", "counted clearance [mm]", "limit [mm]"]
    rows = [
        (name, _number(1.0e3 * each.counted_m) if is_valid else _NOT_VALID, _number(1.0e3 * each.limit_m))
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
def _replay_result(result: ReplayResult) -> _Shown:
    return _replay(result.summary())


def _number(value: float | None) -> str:
    return "" if value is None else f"{float(f'{value:.4g}'):g}"  # 11640, not 1.164e+04

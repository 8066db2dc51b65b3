"""Results as tables on a terminal."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Console
from rich.table import Table

from leg_wear_monitor.cli.common import joints_words
from leg_wear_monitor.files import share_directory
from leg_wear_monitor.monitor.alarms import ADVICE

if TYPE_CHECKING:
    from leg_wear_monitor.dynamics.result import (
        EnergyBalance,
        JointResult,
        SimulationResult,
        ToeResult,
        TorqueResult,
    )
    from leg_wear_monitor.monitor.forecast.forecast import JointForecast, LegForecast
    from leg_wear_monitor.monitor.reports import CycleReport, JointReport
    from leg_wear_monitor.playback.summary import ReplayResult
    from leg_wear_monitor.state import LegState
    from leg_wear_monitor.wear import Surfaces


# Tables, numbers.


def plain_table(columns: Iterable[str], *left: int) -> Table:
    """A table without lines, whose columns of these numbers, from 1 on, are of words.

    Where it is too wide, words after the first column are folded, down to twelve characters.
    """
    table = Table(box=None, pad_edge=False, padding=(0, 1), header_style="bold")
    for number, column in enumerate(columns, start=1):
        if number in left and number > 1:
            table.add_column(column, overflow="fold", min_width=12)
        else:
            table.add_column(column, justify="left" if number in left else "right", no_wrap=True)
    return table


def figure(value: float) -> str:
    """Three significant digits, without exponent as far as that is readable."""
    size = abs(value)
    if size < 1.0e-9:  # rounding
        return "0"
    if not 1.0e-4 <= size < 1.0e7:
        return f"{value:.2e}"
    return f"{value:.{max(0, 2 - math.floor(math.log10(size)))}f}"


# A simulation's statistics as text: 80 columns, on a terminal and in a pipe.


_MODELS = {"ideal": "ideal joints", "full": "full coordinates", "clearance": "clearance coordinates"}


def print_result(result: "SimulationResult", wall_s: float) -> None:
    """Print the result of a simulation.

    Parameters
    ----------
    result : SimulationResult
    wall_s : float
        What it took [s].
    """
    console = Console(highlight=False)
    console.print(f"\n[bold]{result.mechanism}[/bold]: {_settings(result)}\n")
    console.print(joint_table(result))
    if result.standard_error and result.clearance_joints:
        console.print(f"\n[bold]standard errors[/bold], from the scatter of {_cycles(result.cycles)}")
        console.print(_error_table(result.standard_error, list(result.joints)))
    summary = Table.grid(padding=(0, 2), pad_edge=False)
    for label, text in _summary(result, wall_s):
        summary.add_row(label, text)
    console.print()
    console.print(summary)


def joint_table(result: "SimulationResult") -> Table:
    """Forces of every joint; contact and wear of the clearance joints."""
    columns = ["\njoint", "mean\nN", "p99\nN", "max\nN"]
    if any(joint.has_clearance for joint in result.joints.values()):
        columns += ["contact\n%", "Archard\nJ/cycle", "bushing\npm/cycle", "journal\npm/cycle", "zone\ndeg"]
    table = plain_table(columns, 1)
    for name, joint in result.joints.items():
        forces = (joint.mean_force_n, joint.p99_force_n, joint.max_force_n)
        table.add_row(name, *map(figure, forces), *_wear_cells(joint))
    return table


def _error_table(errors: dict[str, float], joints: list[str]) -> Table:
    """Standard errors of the table of joints, in its units."""
    columns = {
        "mean\nN": ("mean_force_n", 1.0), "p99\nN": ("p99_force_n", 1.0),
        "contact\n%": ("contact_fraction", 1e2),
        "Archard\nJ/cycle": ("archard_integral_j_per_cycle", 1.0),
        "bushing\npm/cycle": ("wear_depth_m_per_cycle.bushing_max", 1e12),
        "journal\npm/cycle": ("wear_depth_m_per_cycle.journal_max", 1e12),
    }  # fmt: skip
    table = plain_table(("\njoint", *columns), 1)
    for joint in joints:
        found = [(errors.get(f"joints.{joint}.{name}"), scale) for name, scale in columns.values()]
        table.add_row(joint, *("" if error is None else figure(scale * error) for error, scale in found))
    return table


def _wear_cells(joint: "JointResult") -> list[str]:
    depth, zone = joint.wear_depth_m_per_cycle, joint.wear_zone_deg
    if depth is None or joint.contact_fraction is None or joint.archard_integral_j_per_cycle is None:
        return []
    return [
        f"{100.0 * joint.contact_fraction:.1f}",
        figure(joint.archard_integral_j_per_cycle),
        figure(1.0e12 * depth.bushing_max),
        figure(1.0e12 * depth.journal_max),
        "-" if zone is None else f"{zone[0]:.0f} to {zone[1]:.0f}",
    ]


def _settings(result: "SimulationResult") -> str:
    model = _MODELS.get(result.model, result.model)
    joints = joints_words(result.clearance_joints)
    return f"{joints}, {model}, {result.speed_rpm:g} rpm, {_cycles(result.cycles)} counted"


def _cycles(number: float) -> str:
    return "1 cycle" if number == 1.0 else f"{number:.4g} cycles"


def _summary(result: "SimulationResult", wall_s: float) -> Iterator[tuple[str, str]]:
    """Rows of a label and a text."""
    torque = result.drive_torque_nm
    if result.clearance_joints:
        yield "wear", "greatest depth; 1 pm per cycle is 1 um in a million cycles"
        yield "zone", "contains 90 % of the bushing's wear, in angles of its own body"
    values = {name: getattr(torque, name) for name in ("mean", "rms", "min", "max", "p99")}
    errors = result.standard_error or {}
    signed = ", ".join(
        f"{name} {figure(value)}{_plus_minus(errors, f'drive_torque_nm.{name}')}"
        for name, value in values.items()
    )
    yield "drive torque", f"{signed} N m; largest magnitude {figure(torque.max_abs)} N m"
    if result.clearance_joints and result.toe is not None:
        yield "largest errors", _response(result.toe, torque)
    if result.energy_j is not None:
        yield "energy", _energy(result.energy_j, _plus_minus(errors, "energy_j.residual"))
    loads = [(name, joint) for name, joint in result.joints.items() if joint.has_clearance]
    for label, (name, joint) in zip(["load", *[""] * len(loads)], loads, strict=False):
        yield label, f"{name}: {_load(joint)}"
    for regime in _regimes(loads):
        yield "wear holds for", regime
    if result.surfaces is not None and result.surfaces.feeds_back:
        yield "opened by", f"{_opened(result.surfaces, result.clearance_joints)} pm, mean (greatest)"
    yield (
        "speed",
        f"{result.simulated_s:.4g} s of motion in {wall_s:.3g} s: "
        f"{figure(result.simulated_s / wall_s)} times real time",
    )


def _load(joint: "JointResult") -> str:
    """Pressure and sliding speed, and what of them is outside the limits of the material."""
    pressure, speed = joint.mean_pressure_pa or 0.0, joint.mean_sliding_speed_mps or 0.0
    values = f"p {figure(1e-6 * pressure)} (p99 {figure(1e-6 * (joint.p99_pressure_pa or 0.0))}) MPa"
    product = figure(1e-6 * (joint.mean_pressure_speed_pa_mps or 0.0))
    beyond = "".join(f"; {doubt}" for doubt in (joint.outside_limits, joint.outside_contact_law) if doubt)
    return f"{values}, v {figure(speed)} m/s, p v {product} MPa m/s{beyond}"


def _regimes(loads: list[tuple[str, "JointResult"]]) -> Iterator[str]:
    """What the wear of the clearance joints holds for, a text for all joints alike."""
    for regime in dict.fromkeys(joint.holds_for for _, joint in loads):
        yield f"{', '.join(name for name, joint in loads if joint.holds_for == regime)}: {regime}"


def _response(toe: "ToeResult", torque: "TorqueResult") -> str:
    return (
        f"{figure(1e3 * toe.max_position_error_m)} mm, {figure(toe.max_velocity_error_mps)} m/s, "
        f"{figure(toe.max_acceleration_error_mps2)} m/s^2 at the toe, "
        f"{figure(torque.max_error)} N m at the drive"
    )


def _plus_minus(errors: dict[str, float], path: str) -> str:
    return f" ± {figure(errors[path])}" if path in errors else ""


def _energy(energy: "EnergyBalance", scatter: str) -> str:
    return (
        f"work in {figure(energy.work_in)} = stored {figure(energy.stored)} + friction "
        f"{figure(energy.friction_loss)} + impacts {figure(energy.contact_loss)} J, "
        f"residual {figure(energy.residual)}{scatter} J"
    )


def _opened(surfaces: "Surfaces", names: tuple[str, ...]) -> str:
    """What wear has added to the clearances since the start, skipped cycles included."""
    added = 1.0e12 * surfaces.depth.sum(axis=1)
    parts = zip(names, added, strict=True)
    return ", ".join(f"{name} {figure(depth.mean())} ({figure(depth.max())})" for name, depth in parts)


# A replay's statistics as text.


NOT_VALID = "not valid"


def print_replay(result: "ReplayResult", wall_s: float) -> None:
    """Print the result of a replay.

    Parameters
    ----------
    result : ReplayResult
    wall_s : float
        What it took [s].
    """
    from leg_wear_monitor.monitor.ledger.entry import walked_words
    from leg_wear_monitor.monitor.verdict.situation import COUNTED, believed_words
    from leg_wear_monitor.state import Figure, as_plain

    console = Console(highlight=False)
    monitor, verdict = result.monitor, result.monitor.verdict.verdict
    _print_verdict(console, monitor.state, monitor.mechanism.joint_words)
    console.print(
        f"\n[bold]{monitor.config.hardware}[/bold]: {monitor.mechanism.name}, "
        f"clearance joints {', '.join(monitor.clearance_joints)}; "
        f"{result.crank_samples} crank and {result.torque_samples} torque "
        f"samples, {len(result.history)} gait cycles\n"
    )
    if result.evidence.doubtful:
        console.print(f"{result.evidence.doubtful} of the gait cycles do not fit this leg\n")
    last = result.history.last
    if result.is_believable and last is not None:
        if Figure.CLEARANCES in verdict.not_valid:
            console.print(_believed(result))
            console.print(f"{NOT_VALID}: the counted clearances, growth and forces; see the verdict")
        else:
            console.print(_joints(result))
            for joint, one in monitor.state.clearances.items():
                if one.best_estimate_source not in (None, COUNTED):
                    console.print(f"joint {joint}: {believed_words(one)}")
        console.print(f"torque {_by_torque(result)}", soft_wrap=True)
        if words := walked_words(monitor.walked):
            console.print(words, soft_wrap=True)
        console.print()
        if Figure.FORECAST in verdict.not_valid:
            console.print(f"lasts  {NOT_VALID}: {as_plain(verdict.why)}\n", soft_wrap=True)
        else:
            _print_lifetimes(console, last, monitor.config.forecast.duty_hours_per_day)
    from leg_wear_monitor.monitor.alarms import raised_values, state_of, time_words

    raised = [alarm for alarm in monitor.alarms.alarms if alarm.level]
    for alarm in raised:
        words = raised_values(state_of(alarm), alarm.worst, alarm.limit, alarm.unit, alarm.cause)
        since = time_words(alarm.raised_ns)
        console.print(f"{alarm.level.name:<6} {alarm.name}: {words}, since {since}", soft_wrap=True)
    if not raised:
        console.print("no alarm is raised at the end")
    if result.is_believable:
        factor = result.duration_s / wall_s
        console.print(f"speed  {result.duration_s:.4g} s in {wall_s:.3g} s: {figure(factor)} times real time")
    console.print(ADVICE, soft_wrap=True)


def _print_verdict(console: Console, state: "LegState", joint_words: Callable[[str], str]) -> None:
    """State, joints and reason; what a person does next, and the page on it; which values are not valid."""
    from leg_wear_monitor.monitor.alarms import time_words
    from leg_wear_monitor.monitor.verdict.decision import decision_of
    from leg_wear_monitor.monitor.verdict.verdict import guide_to
    from leg_wear_monitor.state import as_plain

    verdict = state.verdict
    whose = f" joint {', '.join(map(joint_words, verdict.joints))}" if verdict.joints else ""
    head = f"{verdict.state.words.upper()}{whose}"
    console.print(f"\n[bold]{head}[/bold]: {as_plain(verdict.why)}", soft_wrap=True)
    for title, text in (("to do", verdict.do), *decision_of(state)):
        console.print(f"{title.lower():<10} {as_plain(text)}", soft_wrap=True, markup=False)
    page = share_directory() / guide_to(verdict)
    console.print(f"code       {verdict.fault_code}, see {page}", soft_wrap=True)
    if verdict.not_valid:
        console.print(f"{NOT_VALID}  {', '.join(figure.words for figure in verdict.not_valid)}")
    if verdict.since_ns:
        console.print(f"since      {time_words(verdict.since_ns)}")


def _joints(result: "ReplayResult") -> Table:
    """Counted clearance, growth and peak force, as far as the verdict believes them."""
    from leg_wear_monitor.state import Figure

    doubted = result.monitor.verdict.verdict.not_valid
    columns = ("\njoint", "counted clearance\nmm", "growth\npm/cycle", "±\npm/cycle", "peak\nN")
    table = plain_table(columns, 1)
    peaks = np.fmax.reduce(result.history.joint_column("peak_force_n"))
    last = result.history.last
    for joint, peak in zip(last.joints if last else (), peaks, strict=True):
        growth = [_known(1.0e12, each) for each in (joint.growth_m_per_cycle, joint.growth_error_m_per_cycle)]
        table.add_row(
            result.monitor.mechanism.joint_words(joint.joint),
            _counted(joint),
            *([NOT_VALID, "-"] if Figure.GROWTH in doubted else growth),
            NOT_VALID if Figure.IMPACT_FORCES in doubted else figure(float(peak)),
        )
    return table


def _believed(result: "ReplayResult") -> Table:
    """Clearance of each joint by what is believed of it, while the counted ones are not valid."""
    from leg_wear_monitor.monitor.verdict.situation import SOURCES

    table = plain_table(("\njoint", "clearance\nmm", "±\nmm", "\naccording to"), 1, 4)
    for joint, one in result.monitor.state.clearances.items():
        name = result.monitor.mechanism.joint_words(joint)
        if one.best_estimate_m is None or one.best_estimate_source is None:
            table.add_row(name, NOT_VALID, "-", "-")
            continue
        sigma = "-" if one.best_estimate_sigma_m is None else f"{1.0e3 * one.best_estimate_sigma_m:.3f}"
        table.add_row(name, f"{1.0e3 * one.best_estimate_m:.3f}", sigma, SOURCES[one.best_estimate_source])
    return table


def _by_torque(result: "ReplayResult") -> str:
    """What the drive torque shows: state of the diagnosis, and the clearances that it observes."""
    from leg_wear_monitor.monitor.verdict.verdict import diagnosis_words, estimate

    diagnosis, joints = result.monitor.diagnosis, result.monitor.clearance_joints
    words = diagnosis_words(diagnosis, joints)
    if not diagnosis.clearance_m:
        return words
    seen = zip(joints, diagnosis.clearance_m, diagnosis.sigma_m, strict=True)
    values = [
        f"{joint} {estimate(value, sigma, 'm')}" for joint, value, sigma in seen if not math.isnan(value)
    ]
    return f"{words}; over {diagnosis.cycles} gait cycles: {', '.join(values)}"


def _counted(joint: "JointReport") -> str:
    from leg_wear_monitor.monitor.forecast.forecast import clearance_mm

    if joint.forecast is None or joint.forecast.clearance_m is None:
        return f"{1.0e3 * joint.clearance_m:.3f}"
    may_be = joint.forecast.clearance_m
    return clearance_mm(joint.clearance_m, may_be.p10, may_be.p90)


def _print_lifetimes(console: Console, report: "CycleReport", duty_hours: float) -> None:
    """How long each joint and the leg last: hours of walking, and days of duty; or why that is not known."""
    from leg_wear_monitor.monitor.forecast.forecast import Answer, bases

    forecasts = {joint.joint: joint.forecast for joint in report.joints if joint.forecast is not None}
    both: dict[str, JointForecast | LegForecast] = {**forecasts}
    if report.forecast is not None:
        both["leg"] = report.forecast
    if any(each.hours for each in both.values()):
        console.print(_lifetime_table(both))
        console.print(f"hours of walking and days of {duty_hours:g} h until the limit of the clearance")
    for answer in Answer:
        names = [name for name, each in both.items() if each.answer is answer]
        if names and answer is not Answer.KNOWN:
            console.print(f"lasts  {', '.join(names)}: {answer.value}", soft_wrap=True)
    for basis in bases(forecasts):
        console.print(f"lasts  {basis}", soft_wrap=True)
    console.print()


def _lifetime_table(forecasts: "Mapping[str, JointForecast | LegForecast]") -> Table:
    quantiles = (f"{fraction}\n{unit}" for unit in ("h", "days") for fraction in ("p10", "p50", "p90"))
    table = plain_table(("\nlasts", *quantiles), 1)
    for name, each in forecasts.items():
        table.add_row(name, *_lifetime(each))
    return table


def _lifetime(forecast: "JointForecast | LegForecast") -> list[str]:
    from leg_wear_monitor.monitor.forecast.forecast import lifetime_values, three_digits

    values = lifetime_values(forecast)
    keys = (f"{fraction}_{unit}" for unit in ("hours", "days") for fraction in ("p10", "p50", "p90"))
    return [three_digits(values[key]) if key in values else "-" for key in keys]


def _known(factor: float, value: float | None) -> str:
    return "-" if value is None else figure(factor * value)

"""A replay's statistics as text."""

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Console
from rich.table import Table

from leg_wear_monitor.cli.tables import figure
from leg_wear_monitor.monitor.alarms.words import ADVICE
from leg_wear_monitor.share import share_directory

if TYPE_CHECKING:
    from leg_wear_monitor.monitor.forecast.forecast import JointForecast, LegForecast
    from leg_wear_monitor.monitor.reports import CycleReport, JointReport
    from leg_wear_monitor.monitor.verdict.verdict import Verdict
    from leg_wear_monitor.playback.summary import ReplayResult

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
    from leg_wear_monitor.monitor.verdict.belief import COUNTED, believed_words
    from leg_wear_monitor.monitor.verdict.verdict import Figure

    console = Console(highlight=False)
    monitor, verdict = result.monitor, result.monitor.verdict.verdict
    _print_verdict(console, verdict, monitor.mechanism.joint_words)
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
            for joint, one in monitor.believed_clearances.items():
                if one is not None and one.by != COUNTED:
                    console.print(f"joint {joint}: {believed_words(one)}")
        console.print(f"torque {_by_torque(result)}", soft_wrap=True)
        errors = [f"{joint.joint} {figure(1.0e9 * joint.sampling_sigma_m)} nm" for joint in last.joints]
        if any(joint.sampling_sigma_m for joint in last.joints):
            console.print(f"standard errors of the clearances by sampling: {', '.join(errors)}")
        if words := walked_words(monitor.walked):
            console.print(words, soft_wrap=True)
        console.print()
        if Figure.FORECAST in verdict.not_valid:
            console.print(f"lasts  {NOT_VALID}: {verdict.why}\n", soft_wrap=True)
        else:
            _print_lifetimes(console, last, monitor.config.forecast.duty_hours_per_day)
    from leg_wear_monitor.monitor.alarms.words import raised_words, state_of

    raised = [alarm for alarm in monitor.alarms.alarms if alarm.level]
    for alarm in raised:
        words = raised_words(state_of(alarm), alarm.worst, alarm.limit, alarm.unit, alarm.raised_ns)
        console.print(f"{alarm.level.name:<6} {alarm.name}: {words}", soft_wrap=True)
    if not raised:
        console.print("no alarm is raised at the end")
    if result.is_believable:
        factor = result.duration_s / wall_s
        console.print(f"speed  {result.duration_s:.4g} s in {wall_s:.3g} s: {figure(factor)} times real time")
    console.print(ADVICE, soft_wrap=True)


def _print_verdict(console: Console, verdict: "Verdict", joint_words: Callable[[str], str]) -> None:
    """State, joints and reason; what a person does next, and the page on it; which values are not valid."""
    from leg_wear_monitor.monitor.alarms.words import time_words

    whose = f" joint {', '.join(map(joint_words, verdict.joints))}" if verdict.joints else ""
    console.print(f"\n[bold]{verdict.state.words.upper()}{whose}[/bold]: {verdict.why}", soft_wrap=True)
    console.print(f"to do      {verdict.do}", soft_wrap=True)
    console.print(f"code       {verdict.fault_code}, see {share_directory() / verdict.guide}", soft_wrap=True)
    if verdict.not_valid:
        console.print(f"{NOT_VALID}  {', '.join(figure.words for figure in verdict.not_valid)}")
    if verdict.since_ns:
        console.print(f"since      {time_words(verdict.since_ns)}")


def _joints(result: "ReplayResult") -> Table:
    """Counted clearance, growth and peak force."""
    columns = ("\njoint", "counted clearance\nmm", "growth\npm/cycle", "±\npm/cycle", "peak\nN")
    table = _table(columns, 1)
    peaks = np.fmax.reduce(result.history.joint_column("peak_force_n"))
    last = result.history.last
    for joint, peak in zip(last.joints if last else (), peaks, strict=True):
        table.add_row(
            result.monitor.mechanism.joint_words(joint.joint),
            _counted(joint),
            _known(1.0e12, joint.growth_m_per_cycle),
            _known(1.0e12, joint.growth_error_m_per_cycle),
            figure(float(peak)),
        )
    return table


def _believed(result: "ReplayResult") -> Table:
    """Clearance of each joint by what is believed of it, while the counted ones are not valid."""
    from leg_wear_monitor.monitor.verdict.belief import SOURCES

    table = _table(("\njoint", "clearance\nmm", "±\nmm", "\naccording to"), 1, 4)
    for joint, one in result.monitor.believed_clearances.items():
        name = result.monitor.mechanism.joint_words(joint)
        if one is None:
            table.add_row(name, NOT_VALID, "-", "-")
            continue
        sigma = "-" if math.isnan(one.sigma_m) else f"{1.0e3 * one.sigma_m:.3f}"
        table.add_row(name, f"{1.0e3 * one.clearance_m:.3f}", sigma, SOURCES[one.by])
    return table


def _table(columns: tuple[str, ...], *left: int) -> Table:
    """A table whose columns of these numbers are of words."""
    table = Table(box=None, pad_edge=False, padding=(0, 1), header_style="bold")
    for number, column in enumerate(columns, start=1):
        table.add_column(column, justify="left" if number in left else "right")
    return table


def _by_torque(result: "ReplayResult") -> str:
    """What the drive torque shows: state of the diagnosis, and the clearances that it observes."""
    from leg_wear_monitor.monitor.verdict.diagnosis_words import diagnosis_words
    from leg_wear_monitor.monitor.verdict.words import estimate

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
    from leg_wear_monitor.monitor.forecast.words import clearance_mm

    if joint.forecast is None:
        return f"{1.0e3 * joint.clearance_m:.3f}"
    may_be = joint.forecast.clearance_m
    return clearance_mm(joint.clearance_m, may_be.p10, may_be.p90)


def _print_lifetimes(console: Console, report: "CycleReport", duty_hours: float) -> None:
    """How long each joint and the leg last: hours of walking, and days of duty; or why that is not known."""
    from leg_wear_monitor.monitor.forecast.forecast import Answer
    from leg_wear_monitor.monitor.forecast.words import bases

    told = {joint.joint: joint.forecast for joint in report.joints if joint.forecast is not None}
    both: dict[str, JointForecast | LegForecast] = {**told}
    if report.forecast is not None:
        both["leg"] = report.forecast
    if any(each.hours for each in both.values()):
        console.print(_lifetime_table(both))
        console.print(f"hours of walking and days of {duty_hours:g} h until the limit of the clearance")
    for answer in Answer:
        names = [name for name, each in both.items() if each.answer is answer]
        if names and answer is not Answer.KNOWN:
            console.print(f"lasts  {', '.join(names)}: {answer.value}", soft_wrap=True)
    for basis in bases(told):
        console.print(f"lasts  {basis}", soft_wrap=True)
    console.print()


def _lifetime_table(told: "Mapping[str, JointForecast | LegForecast]") -> Table:
    table = Table(box=None, pad_edge=False, padding=(0, 1), header_style="bold")
    table.add_column("\nlasts", min_width=5)
    for unit in ("h", "days"):
        for fraction in ("p10", "p50", "p90"):
            table.add_column(f"{fraction}\n{unit}", justify="right", no_wrap=True)
    for name, each in told.items():
        table.add_row(name, *_lifetime(each))
    return table


def _lifetime(told: "JointForecast | LegForecast") -> list[str]:
    from leg_wear_monitor.monitor.forecast.words import lifetime_values, three_digits

    values = lifetime_values(told)
    keys = (f"{fraction}_{unit}" for unit in ("hours", "days") for fraction in ("p10", "p50", "p90"))
    return [three_digits(values[key]) if key in values else "-" for key in keys]


def _known(factor: float, value: float | None) -> str:
    return "-" if value is None else figure(factor * value)

"""Results as text on a terminal, at most 80 columns wide in a pipe."""

import math
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from leg_wear_monitor.files import share_directory
from leg_wear_monitor.monitor.alarm_specs import QUANTITIES
from leg_wear_monitor.monitor.alarms import ADVICE, duration, raised_values, time_words
from leg_wear_monitor.monitor.forecast.forecast import three_digits
from leg_wear_monitor.monitor.verdict.situation import SOURCES
from leg_wear_monitor.monitor.verdict.verdict import decision_of, guide_to
from leg_wear_monitor.state import as_plain

if TYPE_CHECKING:
    from leg_wear_monitor.dynamics.result import JointResult, SimulationResult
    from leg_wear_monitor.recordings.summary import ReplayResult
    from leg_wear_monitor.state import LegState, LifeHours


def plain_table(columns: Iterable[str], *left: int) -> Table:
    """A table without lines; the columns with these numbers, counted from 1, contain words.

    If the table is too wide, the words after the first column wrap, down to twelve characters.
    """
    table = Table(box=None, pad_edge=False, padding=(0, 1), header_style="bold")
    for number, column in enumerate(columns, start=1):
        if number in left and number > 1:
            table.add_column(column, overflow="fold", min_width=12)
        else:
            table.add_column(column, justify="left" if number in left else "right", no_wrap=True)
    return table


def figure(value: float | None) -> str:
    """Three significant digits, without exponent as long as that is readable; a dash for an unknown value."""
    if value is None:
        return "-"
    size = abs(value)
    if size < 1.0e-9:  # rounding
        return "0"
    if not 1.0e-4 <= size < 1.0e7:
        return f"{value:.2e}"
    return f"{value:.{max(0, 2 - math.floor(math.log10(size)))}f}"


# The statistics of a simulation.


def print_result(result: "SimulationResult", wall_s: float) -> None:
    """Print the result of a simulation that took ``wall_s``."""
    console = Console(highlight=False)
    joints = ", ".join(result.clearance_joints) or "none"
    console.print(
        f"\n[bold]{result.mechanism}[/bold]: clearance joints {joints}, model {result.model}, "
        f"{result.speed_rpm:g} rpm, {result.cycles:.4g} cycles\n"
    )
    console.print(_forces(result))
    torque, rows = result.drive_torque_nm, list[tuple[str, str]]()
    values = {name: getattr(torque, name) for name in ("mean", "rms", "min", "max", "p99")}
    rows.append(
        ("drive torque", ", ".join(f"{name} {figure(each)}" for name, each in values.items()) + " N m")
    )
    for name, joint in result.joints.items():
        if joint.has_clearance:
            beyond = filter(None, (joint.outside_limits, joint.outside_contact_law))
            rows.append((f"wear of {name}", "; ".join([f"holds for {joint.holds_for}", *beyond])))
    speed = figure(result.simulated_s / wall_s)
    rows.append(("speed", f"{result.simulated_s:.4g} s of motion in {wall_s:.3g} s: {speed} times real time"))
    summary = Table.grid(padding=(0, 2), pad_edge=False)
    for row in rows:
        summary.add_row(*row)
    console.print()
    console.print(summary)


def _forces(result: "SimulationResult") -> Table:
    """Forces of every joint, with their standard errors; contact and wear of the clearance joints."""
    columns = ["\njoint", "mean\nN", "±\nN", "p99\nN", "max\nN"]
    if result.clearance_joints:
        columns += ["contact\n%", "Archard\nJ/cycle", "bushing\npm/cycle", "journal\npm/cycle"]
    table, errors = plain_table(columns, 1), result.standard_error or {}
    for name, joint in result.joints.items():
        mean = figure(joint.mean_force_n), figure(errors.get(f"joints.{name}.mean_force_n"))
        table.add_row(name, *mean, figure(joint.p99_force_n), figure(joint.max_force_n), *_wear(joint))
    return table


def _wear(joint: "JointResult") -> list[str]:
    depth = joint.wear_depth_m_per_cycle
    if depth is None or joint.contact_fraction is None:
        return []
    per_cycle = joint.archard_integral_j_per_cycle, 1.0e12 * depth.bushing_max, 1.0e12 * depth.journal_max
    return [f"{100.0 * joint.contact_fraction:.1f}", *map(figure, per_cycle)]


# The state of a leg, and the replay that gave it.


def print_replay(result: "ReplayResult", wall_s: float, files: Mapping[str, Path | None]) -> None:
    """Print the result of a replay that took ``wall_s``; ``files`` are the options that name its files."""
    console, monitor = Console(highlight=False), result.monitor
    print_state(console, monitor.state, monitor.mechanism.joint_words, files)
    console.print(
        f"\n[bold]{monitor.config.hardware}[/bold]: {monitor.mechanism.name}; {result.crank_samples} crank "
        f"and {result.torque_samples} torque samples, {len(result.history)} gait cycles, "
        f"{result.evidence.doubtful} of them not from this leg"
    )
    if result.is_believable:
        factor = figure(result.duration_s / wall_s)
        console.print(f"speed  {duration(result.duration_s)} in {duration(wall_s)}: {factor} times real time")
    console.print(ADVICE, soft_wrap=True)


def print_state(
    console: Console, state: "LegState", joint_words: Callable[[str], str], files: Mapping[str, Path | None]
) -> None:
    """Print the verdict, a row per joint and the raised alarms; commands name the files that are known."""
    verdict = state.verdict.with_files(files)
    whose = f" joint {', '.join(map(joint_words, verdict.joints))}" if verdict.joints else ""
    head = f"{verdict.state.words.upper()}{whose}"
    console.print(f"\n[bold]{head}[/bold]: {as_plain(verdict.why)}", soft_wrap=True)
    rows = [("to do", verdict.do), *decision_of(state)]
    rows.append(("code", f"{verdict.fault_code}, see {share_directory() / guide_to(verdict)}"))
    if verdict.not_valid:
        rows.append(("not valid", ", ".join(figure.words for figure in verdict.not_valid)))
    if verdict.since_ns:
        rows.append(("since", time_words(verdict.since_ns)))
    for title, text in rows:
        console.print(f"{title.lower():<10} {as_plain(text)}", soft_wrap=True, markup=False)
    if state.clearances:
        console.print()
        console.print(_joints(state, joint_words))
        console.print("p10, p50: remaining hours of walking, exceeded with a probability of 90 % and 50 %")
    console.print()
    raised = [alarm for alarm in state.alarms.now if alarm.level]
    for alarm in raised:
        values = raised_values(alarm.state, alarm.worst, alarm.limit, alarm.unit)
        since = time_words(alarm.raised_ns)
        quantity = QUANTITIES.get(alarm.name, QUANTITIES.get(alarm.name.partition(" ")[0], ""))
        console.print(
            f"{alarm.level.name:<6} {alarm.name}: {quantity}: {values}, since {since}", soft_wrap=True
        )
    if not raised:
        console.print("no alarm is raised at the end")


def _joints(state: "LegState", joint_words: Callable[[str], str]) -> Table:
    """Best estimate of each clearance, its limit, the remaining life, and the change since the baseline."""
    has_change = any(one.change_m is not None for one in state.clearances.values())
    columns = ["\njoint", "clearance\nmm", "limit\nmm", "p10\nh", "p50\nh", "\nsource"]
    table = plain_table([*columns, *(["change\nmm"] if has_change else [])], 1, 6)
    table.collapse_padding = has_change  # otherwise 80 columns cut the last column off
    for joint, one in state.clearances.items():
        table.add_row(
            joint_words(joint),
            _millimetres(one.best_estimate_m, one.best_estimate_sigma_m),
            f"{1.0e3 * one.limit_m:.3g}",
            *_hours(state.life.get(joint)),
            SOURCES[one.best_estimate_source] if one.best_estimate_source else "not valid",
            *([_millimetres(one.change_m, one.change_sigma_m)] if has_change else []),
        )
    if life := state.life.get("leg"):
        table.add_row("leg", "", "", *_hours(life))
    return table


def _millimetres(value_m: float | None, sigma_m: float | None) -> str:
    if value_m is None:
        return "-"
    return f"{1.0e3 * value_m:.3f}" + (f" ± {1.0e3 * sigma_m:.3f}" if sigma_m else "")


def _hours(life: "LifeHours | None") -> tuple[str, str]:
    return (three_digits(life.p10_h), three_digits(life.p50_h)) if life else ("-", "-")

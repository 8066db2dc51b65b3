"""A simulation's statistics as text: 80 columns, on a terminal and in a pipe."""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.table import Table

if TYPE_CHECKING:
    from leg_wear_monitor.dynamics.result import SimulationResult
    from leg_wear_monitor.wear.surfaces import Surfaces

_MODELS = {
    "ideal": "ideal joints",
    "full": "full coordinates",
    "clearance": "clearance coordinates",
}


def print_result(record: dict[str, Any], result: "SimulationResult") -> None:
    """Print the result of a simulation.

    Parameters
    ----------
    record : dict
        What ``--json`` writes.
    result : SimulationResult
    """
    console = Console(highlight=False)
    console.print(f"\n[bold]{record['mechanism']}[/bold]: {_settings(record, result)}\n")
    console.print(joint_table(record))
    summary = Table.grid(padding=(0, 2), pad_edge=False)
    for label, text in _summary(record, result):
        summary.add_row(label, text)
    console.print()
    console.print(summary)


def joint_table(record: dict[str, Any]) -> Table:
    """Forces of every joint; contact and wear of the clearance joints."""
    table = Table(box=None, pad_edge=False, padding=(0, 1), header_style="bold")
    table.add_column("\njoint")
    columns = ["mean\nN", "p99\nN", "max\nN"]
    worn = any("wear_depth_m_per_cycle" in statistics for statistics in record["joints"].values())
    if worn:
        columns += ["contact\n%", "Archard\nJ/cycle", "bushing\npm/cycle", "journal\npm/cycle", "zone\ndeg"]
    for column in columns:
        table.add_column(column, justify="right")
    for name, statistics in record["joints"].items():
        cells = [figure(statistics[f"{key}_force_n"]) for key in ("mean", "p99", "max")]
        table.add_row(name, *cells, *_wear_cells(statistics))
    return table


def _wear_cells(statistics: dict[str, Any]) -> list[str]:
    if "wear_depth_m_per_cycle" not in statistics:
        return []
    depth, zone = statistics["wear_depth_m_per_cycle"], statistics["wear_zone_deg"]
    return [
        f"{100.0 * statistics['contact_fraction']:.1f}",
        figure(statistics["archard_integral_j_per_cycle"]),
        figure(1.0e12 * depth["bushing_max"]),
        figure(1.0e12 * depth["journal_max"]),
        "-" if zone is None else f"{zone[0] % 360.0:.0f} to {zone[1] % 360.0:.0f}",
    ]


def _settings(record: dict[str, Any], result: "SimulationResult") -> str:
    clearance_joints = (
        f"clearance joints {', '.join(result.clearance_joints)}"
        if result.clearance_joints
        else "no clearance joint"
    )
    model = _MODELS.get(record["model"], record["model"])
    return f"{clearance_joints}, {model}, {record['speed_rpm']:g} rpm, {_cycles(record['cycles'])} counted"


def _cycles(number: float) -> str:
    return "1 cycle" if number == 1.0 else f"{number:.4g} cycles"


def _summary(record: dict[str, Any], result: "SimulationResult") -> Iterator[tuple[str, str]]:
    """Rows of a label and a text."""
    torque = record["drive_torque_nm"]
    if result.clearance_joints:
        yield "wear", "greatest depth; 1 pm a cycle makes 1 um in a million cycles"
        yield "zone", "holds 90 % of the bushing's wear, in angles of its own body"
    names = ("mean", "rms", "min", "max", "p99")
    signed = ", ".join(f"{name} {figure(torque[name])}" for name in names)
    yield "drive torque", f"{signed} N m; largest magnitude {figure(torque['max_abs'])} N m"
    if result.clearance_joints and record["toe"] is not None:
        yield "off the ideal", f"at most {_response(record['toe'], torque)}"
    if record["energy_j"] is not None:
        yield "energy", _energy(record["energy_j"])
    if result.surfaces is not None and result.surfaces.feeds_back:
        yield "opened by", f"{_opened(result.surfaces, result.clearance_joints)} pm, mean (greatest)"
    yield (
        "speed",
        f"{record['simulated_s']:.4g} s of motion in {record['wall_s']:.3g} s: "
        f"{figure(record['real_time_factor'])} times real time",
    )


def _response(toe: dict[str, float], torque: dict[str, float]) -> str:
    return (
        f"{figure(1e3 * toe['max_position_error_m'])} mm, {figure(toe['max_velocity_error_mps'])} m/s, "
        f"{figure(toe['max_acceleration_error_mps2'])} m/s^2 at the toe, "
        f"{figure(torque['max_error'])} N m at the drive"
    )


def _energy(energy: dict[str, float]) -> str:
    return (
        f"work in {figure(energy['work_in'])} = stored {figure(energy['stored'])} + friction "
        f"{figure(energy['friction_loss'])} + impacts {figure(energy['contact_loss'])} J, "
        f"but for {figure(energy['residual'])} J"
    )


def _opened(surfaces: "Surfaces", names: tuple[str, ...]) -> str:
    """What wear has added to the clearances since the start, skipped cycles included."""
    added = 1.0e12 * surfaces.depth.sum(axis=1)
    parts = zip(names, added, strict=True)
    return ", ".join(f"{name} {figure(depth.mean())} ({figure(depth.max())})" for name, depth in parts)


def figure(value: float) -> str:
    """Three significant digits, without exponent as far as that is readable."""
    size = abs(value)
    if size < 1.0e-9:  # rounding
        return "0"
    if not 1.0e-4 <= size < 1.0e7:
        return f"{value:.2e}"
    return f"{value:.{max(0, 2 - math.floor(math.log10(size)))}f}"

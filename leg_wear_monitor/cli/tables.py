"""A simulation's statistics as text: 80 columns, on a terminal and in a pipe."""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

if TYPE_CHECKING:
    from leg_wear_monitor.dynamics.result.parts import EnergyBalance, JointResult, ToeResult, TorqueResult
    from leg_wear_monitor.dynamics.result.simulation_result import SimulationResult
    from leg_wear_monitor.wear.surfaces import Surfaces

_MODELS = {
    "ideal": "ideal joints",
    "full": "full coordinates",
    "clearance": "clearance coordinates",
}


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
    table = Table(box=None, pad_edge=False, padding=(0, 1), header_style="bold")
    table.add_column("\njoint")
    columns = ["mean\nN", "p99\nN", "max\nN"]
    if any(joint.has_clearance for joint in result.joints.values()):
        columns += ["contact\n%", "Archard\nJ/cycle", "bushing\npm/cycle", "journal\npm/cycle", "zone\ndeg"]
    for column in columns:
        table.add_column(column, justify="right")
    for name, joint in result.joints.items():
        forces = (joint.mean_force_n, joint.p99_force_n, joint.max_force_n)
        table.add_row(name, *map(figure, forces), *_wear_cells(joint))
    return table


def _error_table(errors: dict[str, float], joints: list[str]) -> Table:
    """Standard errors of the table of joints, in its units."""
    table = Table(box=None, pad_edge=False, padding=(0, 1), header_style="bold")
    columns = {
        "mean\nN": ("mean_force_n", 1.0), "p99\nN": ("p99_force_n", 1.0),
        "contact\n%": ("contact_fraction", 1e2),
        "Archard\nJ/cycle": ("archard_integral_j_per_cycle", 1.0),
        "bushing\npm/cycle": ("wear_depth_m_per_cycle.bushing_max", 1e12),
        "journal\npm/cycle": ("wear_depth_m_per_cycle.journal_max", 1e12),
    }  # fmt: skip
    for column in ("\njoint", *columns):
        table.add_column(column, justify="right" if column in columns else "left")
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
        "-" if zone is None else f"{zone[0] % 360.0:.0f} to {zone[1] % 360.0:.0f}",
    ]


def _settings(result: "SimulationResult") -> str:
    clearance_joints = (
        f"clearance joints {', '.join(result.clearance_joints)}"
        if result.clearance_joints
        else "no clearance joint"
    )
    model = _MODELS.get(result.model, result.model)
    return f"{clearance_joints}, {model}, {result.speed_rpm:g} rpm, {_cycles(result.cycles)} counted"


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


def figure(value: float) -> str:
    """Three significant digits, without exponent as far as that is readable."""
    size = abs(value)
    if size < 1.0e-9:  # rounding
        return "0"
    if not 1.0e-4 <= size < 1.0e7:
        return f"{value:.2e}"
    return f"{value:.{max(0, 2 - math.floor(math.log10(size)))}f}"

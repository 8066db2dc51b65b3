"""A replay's figures as text for people."""

from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from leg_wear_monitor.cli.tables import figure

if TYPE_CHECKING:
    from leg_wear_monitor.recording.replay import ReplayResult


def print_replay(result: "ReplayResult", wall_s: float) -> None:
    """Print the result of a replay.

    Parameters
    ----------
    result : ReplayResult
    wall_s : float
        What it took [s].
    """
    console = Console(highlight=False)
    monitor = result.monitor
    console.print(
        f"\n[bold]{monitor.config.hardware}[/bold]: {monitor.mechanism.name}, "
        f"{', '.join(monitor.loose)} loose; {result.crank_samples} crank and {result.torque_samples} torque "
        f"samples, {len(result.history)} gait cycles\n"
    )
    if result.evidence.doubtful:
        console.print(f"{result.evidence.doubtful} of the gait cycles can hardly be this leg's\n")
    if result.is_believable:
        console.print(_joints(result))
        console.print()
    raised = [alarm for alarm in monitor.alarms.alarms if alarm.level]
    for alarm in raised:
        console.print(f"{alarm.level.name:<6} {alarm.name}: {figure(alarm.value)} {alarm.unit}".rstrip())
    if not raised:
        console.print("no alarm stands at the end")
    if result.is_believable:
        factor = result.duration_s / wall_s
        console.print(f"speed  {result.duration_s:.4g} s in {wall_s:.3g} s: {figure(factor)} times real time")
    console.print("The monitor advises; no alarm is no proof of health.")


def _joints(result: "ReplayResult") -> Table:
    table = Table(box=None, pad_edge=False, padding=(0, 1), header_style="bold")
    for column in ("\njoint", "clearance\nmm", "growth\npm/cycle", "±\npm/cycle", "remaining\nh", "peak\nN"):
        table.add_column(column, justify="left" if column == "\njoint" else "right")
    peaks = result.history.joint_column("peak_force_n").max(axis=0)
    last = result.history.last
    for joint, peak in zip(last.joints if last else (), peaks, strict=True):
        table.add_row(
            joint.joint,
            f"{1.0e3 * joint.clearance_m:.6f}",
            _known(1.0e12, joint.growth_m_per_cycle),
            _known(1.0e12, joint.growth_error_m_per_cycle),
            _known(1.0, joint.remaining.hours if joint.remaining else None),
            figure(float(peak)),
        )
    return table


def _known(factor: float, value: float | None) -> str:
    return "-" if value is None else figure(factor * value)

"""``leg-wear-monitor measure``: a clearance that somebody measured, into the ledger."""

import getpass
import time
from pathlib import Path
from typing import Any

import click

from leg_wear_monitor.cli.measurements import LAST, leg_of, list_measurements, opened, withdraw
from leg_wear_monitor.cli.node import need_rclpy
from leg_wear_monitor.cli.number import bounded
from leg_wear_monitor.cli.options import config_option, ledger_option, node_option, wait_option

WITH_FINDINGS = 1


@click.command(short_help="Enter a measured clearance, which updates the forecast.")
@click.argument("joint", required=False)
@click.argument("mm", type=float, required=False, callback=bounded("mm", above=0.0))
@click.option(
    "--sigma",
    type=float,
    callback=bounded("mm", above=0.0),
    metavar="MM",
    help="Standard deviation of the measurement.",
)
@config_option
@ledger_option
@click.option("--accept", is_flag=True, help="Use it even if it contradicts the model.")
@click.option("--dry-run", is_flag=True, help="Print the result and write nothing.")
@node_option
@wait_option
@click.option("--list", "listed", is_flag=True, help="Print the ledger's measurements with their numbers.")
@click.option(
    "--withdraw",
    "withdrawn",
    metavar=f"NUMBER|{LAST}",
    help=f"Withdraw a measurement: it stays in the ledger and no longer counts. {LAST}: the last one, of "
    "JOINT if given.",
)
def measure(
    joint: str | None,
    mm: float | None,
    sigma: float | None,
    listed: bool,
    withdrawn: str | None,
    node: str | None,
    wait_s: float,
    **options: Any,
) -> int:
    """Enter the measured mean radial clearance of JOINT, a name or a label such as knee, in millimetres.

    Measure with a feeler gauge, a micrometer or a dial. A dial shows twice the radial clearance if the pin is
    moved to and fro. A running monitor locks its ledger: name it with --node, or stop it first. The counted
    clearance stays as it is. Exit code 1 if the measurement contradicts the model or is at its limit.
    """
    if node is not None:
        _check_alone(listed, withdrawn, **options)
    if (listed or withdrawn) and (mm is not None or sigma is not None or (listed and withdrawn)):
        raise click.UsageError("--list and --withdraw cannot be combined, nor used with MM or --sigma")
    if listed:
        list_measurements(options["config"], options["ledger"])
        return 0
    if withdrawn:
        del options["accept"]
        withdraw(joint, withdrawn, getpass.getuser(), **options)
        return 0
    if joint is None or mm is None or sigma is None:
        raise click.UsageError("expected JOINT MM --sigma MM, or --list, or --withdraw")
    size = joint, 1.0e-3 * mm, 1.0e-3 * sigma
    if node is not None:
        return _on_node(node, *size, accept=options["accept"], wait_s=wait_s)
    lines, has_findings = _measured(*size, **options)
    for line in lines:
        click.echo(line)
    if options["dry_run"]:
        click.echo("dry run: nothing was written")
    return WITH_FINDINGS if has_findings else 0


def _check_alone(
    listed: bool, withdrawn: str | None, config: Path | None, ledger: Path | None, dry_run: bool, accept: bool
) -> None:
    """A running monitor has its own parameters and ledger."""
    if listed or withdrawn or config or ledger or dry_run:
        raise click.UsageError(
            "--node cannot be combined with --config, --ledger, --dry-run, --list or --withdraw"
        )


def _on_node(node: str, joint: str, clearance_m: float, sigma_m: float, accept: bool, wait_s: float) -> int:
    """Enter it into a running monitor, which says the same as the verb does with a ledger."""
    need_rclpy()
    from leg_wear_monitor.monitor.forecast.measurement import asks_to_act
    from leg_wear_monitor.ros.measure_client import measure_on

    told = measure_on(node, joint, clearance_m, sigma_m, accept, wait_s)
    click.echo(told)
    return WITH_FINDINGS if asks_to_act(told) else 0


def _measured(
    joint: str,
    clearance_m: float,
    sigma_m: float,
    config: Path | None,
    ledger: Path | None,
    accept: bool,
    dry_run: bool,
) -> tuple[tuple[str, ...], bool]:
    """What came of a measurement, a line each, and whether the caller has to act."""
    import attrs

    from leg_wear_monitor.monitor.evaluation.board import AlarmBoard
    from leg_wear_monitor.monitor.forecast.coefficient_prior import prior_source
    from leg_wear_monitor.monitor.forecast.measurement import measure as evaluate
    from leg_wear_monitor.monitor.ledger.entry import new_part
    from leg_wear_monitor.monitor.resets import overrule_in, shown_in
    from leg_wear_monitor.monitor.verdict.belief import SOURCES

    settings, leg = leg_of(config, ledger)
    joint = leg.clearance_joint(joint)
    limits_m = AlarmBoard(settings, leg.clearance_joints).clearance_limits_m
    limit_m = limits_m[leg.clearance_joints.index(joint)]
    with opened(settings, dry_run) as kept:
        parts = {wear.name: wear for wear in kept.entry.joints} if kept.entry else {}
        part = parts.get(joint) or new_part(joint)
        found = evaluate(
            settings.forecast,
            leg.clearances[joint],
            part,
            kept.measurements,
            clearance_m=clearance_m,
            sigma_m=sigma_m,
            stamp_ns=time.time_ns(),
            who=getpass.getuser(),
            kept_ns=kept.kept_ns,
            accept=accept,
            prior=prior_source(leg, settings.forecast).prior(joint, part.replaced_ns),
            corrections=kept.corrections,
        )
        shown = shown_in(kept, joint)
        if shown:
            by = SOURCES[shown.by]
            found = attrs.evolve(found, shown_m=shown.clearance_m, shown_sigma_m=shown.sigma_m, shown_by=by)
        kept.note(found.measurement)
        kept.record(overrule_in(kept, leg, settings, found.measurement))
    told = found.told(limit_m, settings.limits.warn_fraction, kept.measurements)
    return told, found.has_findings(limit_m)

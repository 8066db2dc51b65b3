"""``leg-wear-monitor measure``: a clearance that somebody measured, into the ledger."""

import getpass
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from leg_wear_monitor.cli.measurements import LAST, leg_of, list_measurements, opened, withdraw
from leg_wear_monitor.cli.number import bounded
from leg_wear_monitor.configuration.nearest import did_you_mean
from leg_wear_monitor.errors import ConfigError

if TYPE_CHECKING:
    from leg_wear_monitor.monitor.forecast.measurement import MeasurementResult

CONTRADICTS = 1


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
@click.option(
    "--config",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Parameter file of the node.  [default: the one that comes with the package]",
)
@click.option(
    "--ledger",
    type=click.Path(path_type=Path, dir_okay=False, exists=True),
    metavar="FILE",
    help="Ledger to write into.  [default: the one in the parameters]",
)
@click.option("--accept", is_flag=True, help="Use it even if it contradicts the model.")
@click.option("--dry-run", is_flag=True, help="Print the result and write nothing.")
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
    **options: Any,
) -> int:
    """Enter the measured mean radial clearance of JOINT, in millimetres.

    Measure with a feeler gauge, a micrometer or a dial. A dial shows twice the radial clearance if the pin is
    moved to and fro. Stop the monitor of this leg first. Exit code 1 if the measurement contradicts the
    model.
    """
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
    found, record = _measured(joint, 1.0e-3 * mm, 1.0e-3 * sigma, **options)
    click.echo(
        f"{joint}: {mm:g} mm ± {sigma:g} mm, {found.measurement.cycles} gait cycles after the part was new"
    )
    for line in (*found.words, record):
        click.echo(line)
    if options["dry_run"]:
        click.echo("dry run: nothing was written")
    return CONTRADICTS if found.contradicts else 0


def _measured(
    joint: str,
    clearance_m: float,
    sigma_m: float,
    config: Path | None,
    ledger: Path | None,
    accept: bool,
    dry_run: bool,
) -> tuple["MeasurementResult", str]:
    """What a measurement says, and what all of the ledger's together do."""
    from leg_wear_monitor.monitor.forecast.coefficient_prior import prior_source
    from leg_wear_monitor.monitor.forecast.measurement import measure as evaluate
    from leg_wear_monitor.monitor.forecast.validity import validity
    from leg_wear_monitor.monitor.ledger.entry import new_part

    settings, leg = leg_of(config, ledger)
    if joint not in leg.clearance_joints:
        fault = f"{joint!r} is not a clearance joint, expected one of {', '.join(leg.clearance_joints)}"
        raise ConfigError("JOINT", "", fault + did_you_mean(joint, leg.clearance_joints))
    with opened(leg, settings, dry_run) as kept:
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
        )
        kept.note(found.measurement)
        kept.record()
    return found, validity([*kept.measurements, found.measurement]).words

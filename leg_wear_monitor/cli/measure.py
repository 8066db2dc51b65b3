"""``leg-wear-monitor measure``: a clearance that somebody measured, into the ledger."""

import getpass
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from leg_wear_monitor.cli.number import bounded
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.mechanism.nearest import did_you_mean

if TYPE_CHECKING:
    from leg_wear_monitor.mechanism.spec import Mechanism
    from leg_wear_monitor.monitor.config import MonitorConfig
    from leg_wear_monitor.monitor.ledger import Ledger
    from leg_wear_monitor.monitor.measure import Finding

CONTRADICTS = 1


@click.command(short_help="A measured clearance, for the forecast to learn from.")
@click.argument("joint")
@click.argument("mm", type=float, callback=bounded("mm", above=0.0))
@click.option(
    "--sigma",
    type=float,
    required=True,
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
@click.option("--accept", is_flag=True, help="Let it count even if it contradicts the model.")
@click.option("--dry-run", is_flag=True, help="Print what it says, and write nothing.")
def measure(joint: str, mm: float, sigma: float, **options: Any) -> int:
    """Tell that the mean radial clearance of JOINT was measured as MM millimetres.

    By feeler gauge, micrometer or dial; a dial that is moved to and fro shows twice the radial clearance. The
    monitor of this leg must not run meanwhile. Exit code 1 if the measurement contradicts the model.
    """
    found, record = _measured(joint, 1.0e-3 * mm, 1.0e-3 * sigma, **options)
    click.echo(f"{joint}: {mm:g} mm ± {sigma:g} mm, {found.measurement.cycles} gait cycles after it was new")
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
) -> tuple["Finding", str]:
    """What a measurement says, and what all of the ledger's together do."""
    from leg_wear_monitor.monitor.ledger_entry import new_part
    from leg_wear_monitor.monitor.measure import measure as judge
    from leg_wear_monitor.monitor.validity import validity

    settings, leg = _leg(config, ledger)
    if joint not in leg.loose:
        fault = f"{joint!r} is no loose joint, expected one of {', '.join(leg.loose)}"
        raise ConfigError("JOINT", "", fault + did_you_mean(joint, leg.loose))
    with _open(leg, settings, dry_run) as kept:
        parts = {wear.name: wear for wear in kept.entry.joints} if kept.entry else {}
        found = judge(
            settings.forecast,
            leg.clearances[joint],
            parts.get(joint) or new_part(joint),
            kept.measurements,
            clearance_m=clearance_m,
            sigma_m=sigma_m,
            stamp_ns=time.time_ns(),
            who=getpass.getuser(),
            kept_ns=kept.kept_ns,
            accept=accept,
        )
        kept.note(found.measurement)
        kept.record()
    return found, validity([*kept.measurements, found.measurement]).words


def _leg(config: Path | None, ledger: Path | None) -> tuple["MonitorConfig", "Mechanism"]:
    """The parameters, with the ledger that is asked for, and the leg as they want it."""
    import attrs

    from leg_wear_monitor.mechanism.loader import load_mechanism
    from leg_wear_monitor.monitor.fitting import fitted
    from leg_wear_monitor.monitor.parameter_file import load_config

    settings = load_config(config)
    if ledger is not None:
        settings = attrs.evolve(settings, ledger=attrs.evolve(settings.ledger, path=str(ledger)))
    if not settings.ledger.path:
        raise ConfigError("--ledger", "", "no ledger is named, neither here nor by ledger.path")
    return settings, fitted(load_mechanism(settings.mechanism), settings)


@contextmanager
def _open(leg: "Mechanism", settings: "MonitorConfig", dry_run: bool) -> Iterator["Ledger"]:
    """The ledger; a copy of it that is thrown away, if nothing shall be written."""
    import attrs

    from leg_wear_monitor.monitor.ledger import open_ledger
    from leg_wear_monitor.monitor.ledger_copy import copy_of

    with copy_of(settings.ledger.path) if dry_run else nullcontext(settings.ledger.path) as path:
        kept = open_ledger(leg, attrs.evolve(settings, ledger=attrs.evolve(settings.ledger, path=str(path))))
        if kept is None:
            raise ConfigError("--ledger", "", "no ledger is named, neither here nor by ledger.path")
        with closing(kept):
            yield kept

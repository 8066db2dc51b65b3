"""``leg-wear-monitor measure``: a clearance that somebody measured, into the ledger."""

import getpass
import time
from pathlib import Path
from typing import TYPE_CHECKING

import click

from leg_wear_monitor.cli.number import bounded
from leg_wear_monitor.errors import ConfigError

if TYPE_CHECKING:
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
def measure(
    joint: str, mm: float, sigma: float, config: Path | None, ledger: Path | None, accept: bool
) -> int:
    """Tell that the mean radial clearance of JOINT was measured as MM millimetres.

    By feeler gauge, micrometer or dial; a dial that is moved to and fro shows twice the radial clearance. The
    monitor of this leg must not run meanwhile. Exit code 1 if the measurement contradicts the model.
    """
    found, record = _measured(joint, 1.0e-3 * mm, 1.0e-3 * sigma, config, ledger, accept)
    click.echo(f"{joint}: {mm:g} mm ± {sigma:g} mm, {found.measurement.cycles} gait cycles after it was new")
    for line in (*found.words, record):
        click.echo(line)
    return CONTRADICTS if found.contradicts else 0


def _measured(
    joint: str, clearance_m: float, sigma_m: float, config_file: Path | None, path: Path | None, accept: bool
) -> tuple["Finding", str]:
    import attrs

    from leg_wear_monitor.mechanism.loader import load_mechanism
    from leg_wear_monitor.monitor.fitting import fitted
    from leg_wear_monitor.monitor.ledger import open_ledger
    from leg_wear_monitor.monitor.ledger_entry import new_part
    from leg_wear_monitor.monitor.measure import measure as judge
    from leg_wear_monitor.monitor.parameter_file import load_config
    from leg_wear_monitor.monitor.validity import validity

    config = load_config(config_file)
    if path is not None:
        config = attrs.evolve(config, ledger=attrs.evolve(config.ledger, path=str(path)))
    mechanism = load_mechanism(config.mechanism)
    leg = fitted(mechanism, config)
    if joint not in leg.loose:
        raise ConfigError("JOINT", "", f"{joint!r} is no loose joint, expected one of {', '.join(leg.loose)}")
    ledger = open_ledger(mechanism, config)
    if ledger is None:
        raise ConfigError("--ledger", "", "no ledger is named, neither here nor by ledger.path")
    try:
        parts = {wear.name: wear for wear in ledger.entry.joints} if ledger.entry else {}
        found = judge(
            config.forecast,
            leg.clearances[joint].radial_clearance,
            parts.get(joint) or new_part(joint),
            ledger.measurements,
            clearance_m=clearance_m,
            sigma_m=sigma_m,
            stamp_ns=time.time_ns(),
            who=getpass.getuser(),
            kept_ns=ledger.kept_ns,
            accept=accept,
        )
        ledger.note(found.measurement)
        ledger.record()
    finally:
        ledger.close()
    return found, validity([*ledger.measurements, found.measurement]).words

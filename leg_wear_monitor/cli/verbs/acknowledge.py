"""``leg-wear-monitor acknowledge``: alarms that an operator has seen to."""

import time
from pathlib import Path

import click

from leg_wear_monitor.cli.measurements import leg_of, opened
from leg_wear_monitor.cli.node import check_alone, trigger
from leg_wear_monitor.cli.options import config_option, ledger_option, node_option, wait_option


@click.command(short_help="Acknowledge the alarms.")
@config_option
@ledger_option
@node_option
@wait_option
@click.option("--dry-run", is_flag=True, help="Print the result and write nothing.")
def acknowledge(
    config: Path | None, ledger: Path | None, node: str | None, wait_s: float, dry_run: bool
) -> int:
    """Acknowledge all alarms: those that have returned to normal clear, the others stay, marked as seen.

    The service ~/acknowledge_alarms does the same. The others clear when their values return. A running
    monitor locks its ledger: name it with --node, or stop it first.
    """
    if node is not None:
        check_alone(config=config, ledger=ledger, dry_run=dry_run)
        click.echo(trigger(node, "acknowledge_alarms", wait_s))
        return 0
    from leg_wear_monitor.monitor.resets import acknowledge_in

    settings, leg = leg_of(config, ledger)
    with opened(settings, dry_run) as kept:
        click.echo(acknowledge_in(kept, leg, settings, time.time_ns()).words)
    if dry_run:
        click.echo("dry run: nothing was written")
    return 0

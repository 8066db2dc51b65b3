"""``leg-wear-monitor reset``: a part that was replaced, into a ledger that no monitor uses."""

import getpass
import time
from pathlib import Path

import click

from leg_wear_monitor.cli.measurements import check_joint, leg_of, opened
from leg_wear_monitor.cli.options import config_option, ledger_option


@click.command(short_help="Enter a replaced part into a ledger.")
@click.argument("joint")
@config_option
@ledger_option
@click.option("--undo", is_flag=True, help="Undo the last reset: the part was not replaced.")
@click.option("--dry-run", is_flag=True, help="Print the result and write nothing.")
def reset(joint: str, config: Path | None, ledger: Path | None, undo: bool, dry_run: bool) -> int:
    """Enter that the parts of JOINT were replaced: its wear is 0 again, its history stays in the ledger.

    For recordings: the services ~/reset_wear/JOINT and ~/undo_reset/JOINT of a running monitor do the same.
    The joint's alarms are acknowledged.
    """
    from leg_wear_monitor.monitor.resets import reset_in, undo_in, wear_words

    settings, leg = leg_of(config, ledger)
    check_joint(joint, leg)
    with opened(leg, settings, dry_run) as kept:
        if kept.loss:
            click.echo(f"warning: {kept.path}: {kept.loss}", err=True)
        change = undo_in if undo else reset_in
        words = wear_words(change(kept, joint, time.time_ns(), getpass.getuser()))
    if undo:
        click.echo(
            f"joint {joint}: the reset is undone, {words} are counted, including those since the reset"
        )
    else:
        click.echo(f"joint {joint}: new surfaces, {words} are set to 0, history kept; --undo reverts it")
    if dry_run:
        click.echo("dry run: nothing was written")
    return 0

"""``leg-wear-monitor reset``: a part that was replaced, into a ledger or into a running monitor."""

import getpass
import time
from pathlib import Path

import click

from leg_wear_monitor.cli.measurements import leg_of, opened
from leg_wear_monitor.cli.node import check_alone, trigger
from leg_wear_monitor.cli.options import config_option, ledger_option, node_option, wait_option


@click.command(short_help="Enter a replaced part.")
@click.argument("joint")
@config_option
@ledger_option
@node_option
@wait_option
@click.option("--undo", is_flag=True, help="Undo the last reset: the part was not replaced.")
@click.option("--dry-run", is_flag=True, help="Print the result and write nothing.")
def reset(
    joint: str,
    config: Path | None,
    ledger: Path | None,
    node: str | None,
    wait_s: float,
    undo: bool,
    dry_run: bool,
) -> int:
    """Enter that the parts of JOINT were replaced: its wear is 0 again, its history stays in the ledger.

    JOINT is a name or a label, such as knee; with --node, a name. The alarms that rested on the former part
    are acknowledged and clear. A running monitor locks its ledger: name it with --node, or stop it first.
    """
    if node is not None:
        check_alone(config=config, ledger=ledger, dry_run=dry_run)
        service = f"{'undo_reset' if undo else 'reset_wear'}/{joint}"
        click.echo(trigger(node, service, wait_s, times=1 if undo else 2))  # a reset is confirmed
        return 0
    _reset_in(joint, config, ledger, undo, dry_run)
    if dry_run:
        click.echo("dry run: nothing was written")
    return 0


def _reset_in(joint: str, config: Path | None, ledger: Path | None, undo: bool, dry_run: bool) -> None:
    """Enter it into a ledger, and print what came of it."""
    from leg_wear_monitor.monitor.resets import reset_in, undo_in, wear_words

    settings, leg = leg_of(config, ledger)
    joint, now_ns, who = leg.clearance_joint(joint), time.time_ns(), getpass.getuser()
    with opened(settings, dry_run) as kept:
        if undo:
            words = wear_words(undo_in(kept, joint, now_ns, who))
            click.echo(
                f"joint {joint}: the reset is undone, {words} are counted, including those since the reset"
            )
            return
        was, done = reset_in(kept, leg, settings, joint, now_ns, who)
    words = wear_words(was)
    click.echo(f"joint {joint}: new surfaces, {words} are set to 0, history kept; --undo reverts it")
    click.echo(f"alarms {done.words}")
    click.echo("confirm by walking: the next gait cycles show whether the repair is good")

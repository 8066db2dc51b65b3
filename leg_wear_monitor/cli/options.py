"""Options that several verbs share."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from leg_wear_monitor.cli.number import bounded

Option = Callable[[Callable[..., Any]], Callable[..., Any]]

mechanism_option: Option = click.option(
    "--mechanism",
    metavar="FILE",
    default="bionic_leg",
    show_default=True,
    help="A mechanism file, or the name of one that comes with the package.",
)

speed_option: Option = click.option(
    "--speed-rpm",
    type=float,
    callback=bounded("rpm"),
    metavar="RPM",
    help="Crank speed, negative for clockwise.  [default: the mechanism's own]",
)

config_option: Option = click.option(
    "--config",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Parameter file of the node.  [default: the one that comes with the package]",
)

ledger_option: Option = click.option(
    "--ledger",
    type=click.Path(path_type=Path, dir_okay=False, exists=True),
    metavar="FILE",
    help="Ledger to write into.  [default: the one in the parameters]",
)

node_option: Option = click.option(
    "--node",
    metavar="NAME",
    help="Full name of a running monitor to enter it into, such as /left/leg_wear_monitor.",
)

wait_option: Option = click.option(
    "--wait",
    "wait_s",
    type=click.FloatRange(min=0.0, min_open=True),
    default=10.0,
    show_default=True,
    metavar="S",
    help="With --node: longest wait for the monitor, and again for its answer.",
)

sample_option: Option = click.option(
    "--sample",
    type=click.FloatRange(0.0, 1.0, min_open=True),
    metavar="FRACTION",
    help="Follow this fraction of the gait cycles, track and check the others, and estimate their wear; for "
    "long recordings, where no impact needs to be seen.  [default: all]",
)

workers_option: Option = click.option(
    "--workers", type=click.IntRange(min=1), metavar="N", help="Number of local processes.  [default: cores]"
)


def clearances_option(metavar: str) -> Option:
    """``--clearances``: names of the clearance joints, separated by commas."""
    text = "The clearance joints.  [default: the mechanism's own]"
    return click.option("--clearances", metavar=metavar, help=text)


def json_option(what: str) -> Option:
    """``--json FILE`` for an object, such as ``the result``; ``-`` is standard output."""
    return click.option(
        "--json",
        "json_file",
        type=click.Path(allow_dash=True, path_type=Path),
        metavar="FILE",
        help=f"Write {what} as JSON; - for stdout, without other output there.",
    )


def out_option(text: str) -> Option:
    """``--out DIR``."""
    return click.option("--out", type=click.Path(path_type=Path), metavar="DIR", help=text)

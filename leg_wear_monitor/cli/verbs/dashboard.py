"""``leg-wear-monitor dashboard``: a live page in a browser, for reading only."""

import asyncio
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

import click

from leg_wear_monitor.cli.node import need_rclpy
from leg_wear_monitor.cli.options import config_option
from leg_wear_monitor.errors import LegWearError

if TYPE_CHECKING:
    from leg_wear_monitor.dashboard.leg_view import LegSetup
    from leg_wear_monitor.dashboard.server import Place
    from leg_wear_monitor.dashboard.source import Source

_NODE = "/leg_wear_monitor"


@click.command(short_help="Show a leg or a fleet live in a browser, for reading only.")
@click.option(
    "--node",
    is_flag=False,
    flag_value=_NODE,
    metavar="[NAME]",
    help=f"Full name of a running monitor, such as /left/leg_wear_monitor.  [default: {_NODE}]",
)
@click.option(
    "--ledger",
    type=click.Path(path_type=Path, dir_okay=False, exists=True),
    metavar="FILE",
    help="A ledger instead, which a monitor may be writing meanwhile.",
)
@click.option(
    "--fleet",
    type=click.Path(path_type=Path, dir_okay=False, exists=True),
    metavar="FLEET.yaml",
    help="A fleet instead, as the last fleet update left it.",
)
@config_option
@click.option(
    "--host",
    default="127.0.0.1",
    show_default=True,
    metavar="HOST",
    help="Address to listen on; 0.0.0.0 for all of this machine.",
)
@click.option(
    "--port",
    type=click.IntRange(0, 65535),
    default=8350,
    show_default=True,
    metavar="PORT",
    help="Port to listen on; 0 for any free one.",
)
def dashboard(
    node: str | None, ledger: Path | None, fleet: Path | None, config: Path | None, host: str, port: int
) -> int:
    """Serve a page with the verdict, the leg and the trends, renewed while you look, until Ctrl-C.

    The page cannot change anything. It is served to this machine only, unless --host says otherwise: it has
    no password. --config is needed for a leg with a mechanism file of its own.
    """
    if sum(each is not None for each in (node, ledger, fleet)) > 1:
        raise click.UsageError("--node, --ledger and --fleet cannot be combined")
    if fleet and config:
        raise click.UsageError("--config cannot be combined with --fleet")
    _need_tornado()
    from leg_wear_monitor.dashboard.server import listen

    with _source(node, ledger, fleet, config) as source:
        _serve(source, listen(host, port))
    return 0


def _need_tornado() -> None:
    try:
        import_module("tornado")
    except ImportError as error:
        raise LegWearError(f"{error}; pip install 'leg_wear_monitor[dashboard]'") from error


@contextmanager
def _source(
    node: str | None, ledger: Path | None, fleet: Path | None, config: Path | None
) -> Iterator["Source"]:
    if ledger:
        from leg_wear_monitor.cli.measurements import leg_of
        from leg_wear_monitor.dashboard.ledger_leg import LedgerLeg

        settings, leg = leg_of(config, ledger)
        yield LedgerLeg(ledger, settings, leg, time.time)
    elif fleet:
        from leg_wear_monitor.cli.main import version
        from leg_wear_monitor.dashboard.fleet_source import FleetSource

        yield FleetSource(fleet, time.time, {"leg_wear_monitor": version()})
    else:
        with _live(node or _NODE, config) as source:
            yield source


@contextmanager
def _live(node: str, config: Path | None) -> Iterator["Source"]:
    need_rclpy()
    from leg_wear_monitor.dashboard.live_leg import LiveLeg
    from leg_wear_monitor.ros.dashboard_listener import full_name, listening, topics_of

    name = full_name(node)
    leg = LiveLeg(name, topics_of(name), time.monotonic)
    with listening(name, leg, _setup(config, name) if config else None):
        yield leg


def _setup(config: Path, node: str) -> "LegSetup":
    from leg_wear_monitor.dashboard.leg_view import leg_setup
    from leg_wear_monitor.mechanism.loader import load_mechanism
    from leg_wear_monitor.monitor.config.fitting import fitted
    from leg_wear_monitor.monitor.config.parameter_file import load_config

    settings = load_config(config, node)
    return leg_setup(settings, fitted(load_mechanism(settings.mechanism), settings))


def _serve(source: "Source", place: "Place") -> None:
    """Serve until a signal."""
    from leg_wear_monitor.dashboard.hosts import is_local
    from leg_wear_monitor.dashboard.hub import Hub
    from leg_wear_monitor.dashboard.server import serve

    def ready(ended: asyncio.Event) -> None:
        loop = asyncio.get_running_loop()
        for number in (signal.SIGINT, signal.SIGTERM):
            loop.add_signal_handler(number, ended.set)
        if not is_local(place.host):
            click.echo(
                f"warning: whoever reaches {place.host}:{place.port} can read this page: it has no password "
                "and no encryption",
                err=True,
            )
        waits = source.freshness()
        if waits.age_s is None:
            click.echo(waits.silence)
        click.echo(f"serving {place.address} (read-only, Ctrl-C ends it)")

    async def run() -> None:
        await serve(Hub(source), place, ready)

    asyncio.run(run())

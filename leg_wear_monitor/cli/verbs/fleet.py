"""``leg-wear-monitor fleet``: many legs, many recordings."""

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from leg_wear_monitor.cli import common

if TYPE_CHECKING:
    from leg_wear_monitor.fleet.chain import Chain
    from leg_wear_monitor.fleet.description import FleetDescription
    from leg_wear_monitor.fleet.update import FleetUpdate, Followed


@click.group(short_help="Monitor many legs from their recordings.", no_args_is_help=False)
def fleet() -> None:
    """Keep the ledgers, tables and the overview of many legs."""


@fleet.command(short_help="Count the recordings that are not counted yet.")
@click.argument("description", type=click.Path(path_type=Path), metavar="FLEET.yaml")
@common.out_option("Directory of the fleet.  [default: out of the description, or fleet beside it]")
@common.workers_option
@common.scheduler_option("count")
@common.memory_option
@common.sample_option
@click.option("--follow", is_flag=True, help="Go on with new recordings as they are completed, until ^C.")
@common.option(
    "--every-s",
    "S",
    "With --follow: time between two looks for new recordings [s].",
    type=click.FloatRange(min=0.1),
    default=10.0,
)
def update(
    description: Path,
    out: Path | None,
    workers: int | None,
    scheduler: str | None,
    memory_mb: float,
    sample: float | None,
    follow: bool,
    every_s: float,
) -> int:
    """Bring the ledger of each leg up to date with its recordings, in the order of time.

    Writes ledgers, tables of the gait cycles and fleet.json. A recording counts once, whatever its name. An
    interrupted update keeps every finished recording, and the next one goes on there. Exits with 1 if parts
    of a recording are lost, if no gait cycle in it fits its leg, if all of its time is counted already, or if
    a leg could not be updated.
    """
    from leg_wear_monitor.fleet.description import load_fleet
    from leg_wear_monitor.fleet.update import update_fleet

    legs = load_fleet(description)
    out = out or legs.out
    common.check_directory("--out", out)

    def count(now: "FleetDescription") -> "FleetUpdate":
        with common.progress_bar("updating the fleet") as progress:
            return update_fleet(
                now,
                out,
                workers=workers or os.cpu_count() or 1,
                scheduler=scheduler,
                memory_mb=memory_mb,
                sample=sample,
                begin=None if scheduler else _compile,
                progress=progress,
            )

    if follow:
        return _follow(description, count, every_s)
    done = count(legs)
    found = [f"warning: {leg}: {text}" for leg, text in done.findings]
    common.print_findings(found, f" in {out}/legs/*/log")
    _print_counts(done, out)
    return common.WITH_FINDINGS if done.findings else 0


@fleet.command(short_help="Write the tables of a fleet as CSV and Parquet files.")
@click.argument("path", type=click.Path(path_type=Path), metavar="DIR|FLEET.yaml")
@common.out_option("Directory of the tables.  [default: tables in the directory of the fleet]")
def export(path: Path, out: Path | None) -> None:
    """Write verdicts, cycles, recordings and lives, each as a CSV and a Parquet file."""
    from leg_wear_monitor.fleet.update import Fleet

    found = Fleet(path)
    out = out or found.path / "tables"
    common.check_directory("--out", out)
    for file in found.export(out):
        click.echo(f"written: {file}")


def _follow(description: Path, count: "Callable[[FleetDescription], FleetUpdate]", every_s: float) -> int:
    """Update again and again; the exit code at the end.

    Only the first update has to succeed: later on, the description may be half written, or another process
    may update the fleet, and the next look finds what this one could not.
    """
    import signal
    import time

    from leg_wear_monitor.errors import LegWearError
    from leg_wear_monitor.fleet.update import Followed

    signal.signal(signal.SIGTERM, signal.getsignal(signal.SIGINT))
    followed, reported, fault = Followed(), set[tuple[str, str]](), ""
    click.echo("following; ^C ends it")
    try:
        _look(description, count, followed, reported)
        while True:
            time.sleep(every_s)
            try:
                _look(description, count, followed, reported)
                fault = ""
            except LegWearError as error:
                if str(error) != fault:
                    fault = str(error)
                    click.echo(f"warning: {fault}; tried again", err=True)
    except KeyboardInterrupt:
        return common.WITH_FINDINGS if reported else 0


def _look(
    description: Path,
    count: "Callable[[FleetDescription], FleetUpdate]",
    followed: "Followed",
    reported: set[tuple[str, str]],
) -> None:
    """Count what is complete, and report what is not among ``reported`` yet."""
    import warnings

    from leg_wear_monitor.errors import ConfigWarning
    from leg_wear_monitor.fleet.chain import words_of
    from leg_wear_monitor.fleet.description import load_fleet

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConfigWarning)  # said at the start
        legs = followed.complete(load_fleet(description))
    done = count(legs)
    for chain in done.chains:
        for line in chain.new:
            click.echo(f"{chain.leg.id}: {words_of(line)}")
    for leg, text in dict.fromkeys(done.findings):
        if (leg, text) not in reported:
            click.echo(f"warning: {leg}: {text}", err=True)
    reported.update(done.findings)


def _compile(chains: Sequence["Chain"]) -> None:
    """Compile all that the monitors of these legs need: once, and not in every worker at the same time."""
    if common.is_compiled("monitor"):
        return
    from leg_wear_monitor.dynamics.clearance.stepper import advance_beside
    from leg_wear_monitor.mechanism.loader import load_mechanism
    from leg_wear_monitor.monitor.wear_monitor import open_monitor

    with common.compilation("monitor", how_long="about a minute"), advance_beside():
        config: Any = chains[0].leg.config
        open_monitor(load_mechanism(config.mechanism), config, at_end=True).warm_up()


def _print_counts(done: "FleetUpdate", out: Path) -> None:
    from leg_wear_monitor.fleet.overview import FILE, load_overview

    overview = load_overview(out)
    if done.is_up_to_date and not any(leg.recordings.counted for leg in overview.legs):
        click.echo("nothing to count, and nothing is counted yet")
    elif done.is_up_to_date:
        click.echo("everything is in the ledger already")
    else:
        click.echo(f"recordings: {done.counted} counted now")
        if done.renewed:
            click.echo(f"forecasts: {done.renewed} renewed after measurements or repairs")
        if legs := done.with_new_settings:
            click.echo(
                f"settings changed since the last forecast, lives follow the new ones: {', '.join(legs)}"
            )
    states = [f"{number} {state.replace('_', ' ')}" for state, number in overview.counts.items() if number]
    click.echo(f"legs: {', '.join(states)}")
    if demonstrations := [leg.id for leg in overview.legs if leg.is_accelerated]:
        click.echo(f"accelerated wear, not ranked: {', '.join(demonstrations)}")
    for name in overview.first:
        verdict = overview.leg(name).verdict
        if verdict:
            click.echo(f"{name}: {verdict.words}")
    click.echo(f"written: {out / FILE}")


@fleet.command(short_help="Write the page of the fleet, and a page for each leg.")
@click.argument("description", type=click.Path(path_type=Path), metavar="FLEET.yaml")
@common.out_option("Directory of the fleet.  [default: out of the description, or fleet beside it]")
@common.option(
    "--fresh-days",
    "DAYS",
    "Age of its last recording up to which a leg counts as monitored.",
    type=click.FloatRange(min=0.0, min_open=True, max=3650.0),
    default=7.0,
)
@common.workers_option
def report(description: Path, out: Path | None, fresh_days: float, workers: int | None) -> int:
    """Write DIR/report.html from what the last update found, and legs/ID/report.html for each leg.

    A leg of the description that was never updated is on the page, without a recording. Nothing is computed.
    Exits with 1 if the page of a leg cannot be made.
    """
    from leg_wear_monitor.cli.pages import write_pages
    from leg_wear_monitor.fleet.description import fleet_directory

    out = out or fleet_directory(description)
    common.check_directory("--out", out)
    changed, faults = write_pages(description, out, fresh_days, workers or os.cpu_count() or 1)
    common.print_findings([f"warning: no page of its own: {fault}" for fault in faults])
    click.echo(f"pages of legs that have changed: {changed}")
    click.echo(f"written: {out / common.PAGE}")
    return common.WITH_FINDINGS if faults else 0

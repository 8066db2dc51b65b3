"""``leg-wear-monitor fleet``: many legs, many recordings."""

import os
import time
from pathlib import Path
from typing import TYPE_CHECKING

import click

from leg_wear_monitor.cli import common

if TYPE_CHECKING:
    from leg_wear_monitor.fleet.overview import FleetOverview

_OUT = "Directory of the fleet.  [default: the key out of the fleet file, or fleet/ next to that file]"

_fresh_option = common.option(
    "--fresh-days",
    "DAYS",
    "A leg is outdated if its last recording is older than this.",
    type=click.FloatRange(min=0.0, min_open=True, max=3650.0),
    default=7.0,
)


@click.group(short_help="Monitor many legs from their recordings.", no_args_is_help=False)
def fleet() -> None:
    """Keep the ledgers of many legs, with one table and one page."""


@fleet.command(short_help="Replay the new recordings into the ledgers of their legs.")
@click.argument("description", type=click.Path(path_type=Path), metavar="FLEET.yaml")
@common.out_option(_OUT)
@common.workers_option
@common.scheduler_option
@_fresh_option
def update(
    description: Path,
    out: Path | None,
    workers: int | None,
    scheduler: str | None,
    fresh_days: float,
) -> int:
    """Replay the new recordings of each leg into the ledger of this leg, in the order of time.

    Writes fleet.json, fleet.csv and report.html. Time that is already in a ledger is skipped. After an
    interruption, the next update continues. Exits with 1 if a recording could not be added completely, or if
    a leg could not be updated.
    """
    from leg_wear_monitor.fleet.description import load_fleet
    from leg_wear_monitor.fleet.update import update_fleet

    legs = load_fleet(description)
    out = out or legs.out
    common.check_directory("--out", out)
    if not scheduler:
        common.compile_monitor(legs.legs[0].config)
    with common.progress_bar("updating the fleet") as progress:
        done = update_fleet(
            legs,
            out,
            workers=workers or os.cpu_count() or 1,
            scheduler=scheduler,
            progress=progress,
        )
    _write_pages(out, done.overview, fresh_days)
    common.print_findings([f"warning: {leg}: {text}" for leg, text in done.findings], f" in {out}/fleet.json")
    click.echo(f"recordings added now: {done.counted}")
    states = [f"{number} {word.replace('_', ' ')}" for word, number in done.overview.counts.items() if number]
    click.echo(f"legs: {', '.join(states)}")
    for leg in done.overview.legs:
        if leg.state and leg.word != "healthy":
            click.echo(f"{leg.id}: {leg.state.verdict.words}")
    click.echo(f"written: {out / common.PAGE}")
    return common.WITH_FINDINGS if done.findings else 0


@fleet.command(short_help="Write the page of the fleet again, without an update.")
@click.argument("path", type=click.Path(path_type=Path), metavar="FLEET.yaml|DIR")
@common.out_option(_OUT)
@_fresh_option
def report(path: Path, out: Path | None, fresh_days: float) -> None:
    """Write DIR/report.html again from fleet.json."""
    from leg_wear_monitor.fleet.description import fleet_directory
    from leg_wear_monitor.fleet.overview import load_overview

    out = out or fleet_directory(path)
    _write_pages(out, load_overview(out), fresh_days)
    click.echo(f"written: {out / common.PAGE}")


def _write_pages(out: Path, overview: "FleetOverview", fresh_days: float) -> None:
    """Write the page of the fleet, and the page of each leg that has a newer recording than its page."""
    import json

    from leg_wear_monitor.errors import ConfigError
    from leg_wear_monitor.fleet.overview import leg_directory
    from leg_wear_monitor.recordings.result import summary_of
    from leg_wear_monitor.report.fleet_page import fleet_page
    from leg_wear_monitor.report.page import page_html

    pages = set()
    for leg in overview.legs:
        home = leg_directory(out, leg.id)
        source, page = home / common.SUMMARY, home / common.PAGE
        if not source.is_file():
            continue
        if not page.is_file() or page.stat().st_mtime_ns < source.stat().st_mtime_ns:
            try:
                summary = summary_of(json.loads(source.read_bytes()), str(source))
            except (ValueError, ConfigError):  # damaged, or of an older version: the next recording renews it
                page.unlink(missing_ok=True)
                continue
            common.write_directory(home, {common.PAGE: common.page_of(summary)})
        pages.add(leg.id)
    text = page_html(fleet_page(overview, time.time_ns(), fresh_days, pages))
    common.write_directory(out, {common.PAGE: text.encode()})

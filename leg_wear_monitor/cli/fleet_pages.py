"""Writes the page of a fleet, and the pages of its legs."""

import json
import time
from pathlib import Path

import attrs

from leg_wear_monitor.cli.main import version
from leg_wear_monitor.cli.output import write_directory
from leg_wear_monitor.cli.verbs.replay import PAGE, SUMMARY, page_of
from leg_wear_monitor.cli.waiting import progress_bar
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.fleet.description.loader import load_fleet
from leg_wear_monitor.fleet.overview.described import described
from leg_wear_monitor.fleet.overview.read import load_overview
from leg_wear_monitor.playback.result.replay_summary import summary_of
from leg_wear_monitor.report.fleet.page import fleet_page
from leg_wear_monitor.report.fleet.standing import Day
from leg_wear_monitor.report.page import page_html


@attrs.define
class WrittenPages:
    """Pages that were written.

    Attributes
    ----------
    fleet : pathlib.Path
        The page of the fleet.
    legs : int
        Number of legs whose page was written now; those that are up to date are not written again.
    faults : list of str
        Why the page of a leg cannot be made.
    """

    fleet: Path
    legs: int = 0
    faults: list[str] = attrs.Factory(list)


def write_pages(description: Path, out: Path, fresh_days: float) -> WrittenPages:
    """Write the page of a fleet, and those of its legs that have changed.

    Raises
    ------
    ConfigError
        If the description or the overview is unusable, or the disk does not take a page.
    """
    overview = described(load_overview(out), load_fleet(description))
    written, pages = WrittenPages(out / PAGE), set()
    with progress_bar("writing the pages") as progress:
        for number, leg in enumerate(overview.legs):
            home = out / "legs" / leg.id
            _write_leg(home, written)
            if (home / PAGE).is_file():
                pages.add(leg.id)
            progress((number + 1) / len(overview.legs))
    day = Day(now_ns=time.time_ns(), fresh_days=fresh_days)
    page = fleet_page(overview, day, pages, {"leg_wear_monitor": version()})
    write_directory(out, {PAGE: page_html(page).encode()})
    return written


def _write_leg(home: Path, written: WrittenPages) -> None:
    """Write the page of a leg if its summary is newer; one that cannot be made any more is removed."""
    source, page = home / SUMMARY, home / PAGE
    if not source.is_file() or (page.is_file() and page.stat().st_mtime_ns > source.stat().st_mtime_ns):
        return
    try:
        text = page_of(summary_of(_record(source), str(source)))
    except ConfigError as error:  # of an earlier version, or damaged: the page of the fleet does without
        written.faults.append(str(error))
        write_directory(home, {PAGE: None})
        return
    write_directory(home, {PAGE: text})
    written.legs += 1


def _record(source: Path) -> object:
    try:
        return json.loads(source.read_bytes())
    except ValueError as error:
        raise ConfigError(str(source), "", "is damaged: it is not JSON") from error

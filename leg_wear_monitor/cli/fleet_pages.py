"""Writes the page of a fleet, and the pages of its legs."""

import json
import time
from collections.abc import Sequence
from pathlib import Path

import attrs

from leg_wear_monitor.cli.main import version
from leg_wear_monitor.cli.output import PAGE, SUMMARY, page_of, write_directory
from leg_wear_monitor.cli.waiting import progress_bar
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.fleet.description.loader import load_fleet
from leg_wear_monitor.fleet.overview.described import described
from leg_wear_monitor.fleet.overview.read import load_overview
from leg_wear_monitor.playback.result.replay_summary import summary_of
from leg_wear_monitor.report.fleet.page import fleet_page
from leg_wear_monitor.report.fleet.standing import Day
from leg_wear_monitor.report.page import page_html
from leg_wear_monitor.workers.job import Job
from leg_wear_monitor.workers.processes import run_here, run_in_processes

_WORTH_WORKERS = 8
"""Pages from which on workers, which take a second or two to start, write them sooner than one process."""


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


def write_pages(description: Path, out: Path, fresh_days: float, workers: int = 1) -> WrittenPages:
    """Write the page of a fleet, and those of its legs that have changed.

    Parameters
    ----------
    description, out : pathlib.Path
        File of the description, and directory of the fleet.
    fresh_days : float
        Age of its last recording up to which a leg counts as monitored.
    workers : int
        Number of local processes for the pages of the legs; pages do not depend on it.

    Raises
    ------
    ConfigError
        If the description or the overview is unusable, or the disk does not take a page.
    """
    overview = described(load_overview(out), load_fleet(description))
    written = WrittenPages(out / PAGE)
    homes = [out / "legs" / leg.id for leg in overview.legs]
    _write_legs([home for home in homes if _is_due(home)], written, workers)
    pages = {home.name for home in homes if (home / PAGE).is_file()}
    day = Day(now_ns=time.time_ns(), fresh_days=fresh_days)
    page = fleet_page(overview, day, pages, {"leg_wear_monitor": version()})
    write_directory(out, {PAGE: page_html(page).encode()})
    return written


def _is_due(home: Path) -> bool:
    """Whether the summary of a leg is newer than its page."""
    source, page = home / SUMMARY, home / PAGE
    return source.is_file() and not (page.is_file() and page.stat().st_mtime_ns > source.stat().st_mtime_ns)


def _write_legs(homes: Sequence[Path], written: WrittenPages, workers: int) -> None:
    with progress_bar("writing the pages") as progress:
        done = 0

        def take(_job: Job, fault: str) -> None:
            nonlocal done
            done += 1
            progress(done / len(homes))
            if fault:
                written.faults.append(fault)
            else:
                written.legs += 1

        jobs = [Job(home.name, write_leg, (home,)) for home in homes]
        if workers > 1 and len(jobs) >= _WORTH_WORKERS:
            run_in_processes(jobs, workers, take)
        else:
            run_here(jobs, take)
    written.faults.sort()


def write_leg(home: Path) -> str:
    """Write the page of a leg from its summary; why that is not possible, empty if it is.

    A page that cannot be made any more is removed: the page of the fleet does without.
    """
    source = home / SUMMARY
    try:
        text = page_of(summary_of(_record(source), str(source)))
    except ConfigError as error:  # of an earlier version, or damaged
        write_directory(home, {PAGE: None})
        return str(error)
    write_directory(home, {PAGE: text})
    return ""


def _record(source: Path) -> object:
    try:
        return json.loads(source.read_bytes())
    except ValueError as error:
        raise ConfigError(str(source), "", "is damaged: it is not JSON") from error

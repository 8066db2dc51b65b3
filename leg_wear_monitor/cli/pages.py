"""What verbs print and write: proposals, pages of a fleet."""

import math
import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from leg_wear_monitor.cli.common import PAGE, SUMMARY, page_of, progress_bar, write_directory
from leg_wear_monitor.cli.tables import figure, plain_table
from leg_wear_monitor.errors import ConfigError, printable
from leg_wear_monitor.files import package_version
from leg_wear_monitor.fleet.description import load_fleet
from leg_wear_monitor.fleet.directory import json_object
from leg_wear_monitor.fleet.overview import described, load_overview
from leg_wear_monitor.playback.result import summary_of
from leg_wear_monitor.report.fleet_page import fleet_page
from leg_wear_monitor.report.fleet_standing import Day
from leg_wear_monitor.report.page import page_html
from leg_wear_monitor.workers import results

if TYPE_CHECKING:
    from leg_wear_monitor.commissioning.result import CommissioningItem, CommissioningResult


# A proposal of parameters as text.


_NEVER = 1000  # gait cycles, from which on their number is of no interest


def print_commissioning(result: "CommissioningResult") -> None:
    """Print what was found, what cannot be determined, and what does not fit."""
    console = Console(highlight=False, markup=False)
    console.print(f"\nfrom {result.turns:.3g} turns of the crank\n")
    console.print(_table(result))
    console.print("\nmismatch: RMS of the torque that stays unexplained, as a fraction of the torque's\n")
    for item in result.items:
        if item.better:
            console.print(f"better known: {item.name}: {item.better}", soft_wrap=True)
    _print_joints(console, result)
    texts = (
        ("not enough to tell", result.not_told),
        ("does not fit", result.findings),
        ("note", result.notes),
    )
    for label, sentences in texts:
        for text in sentences:
            console.print(f"{label}: {printable(text)}", soft_wrap=True)
    if result.config is None:
        console.print("no parameters are proposed, because a choice between them is not certain")


def _print_joints(console: Console, result: "CommissioningResult") -> None:
    """Print what the torque will show of each joint."""
    if result.joints:
        console.print(
            "\ngait cycles until the drive torque shows a wider joint: detected, as expected;\n"
            "named, in four of five legs whose masses are 4 % off\n"
        )
        console.print(_joints(result))
        console.print(f"\n{result.judgement}", soft_wrap=True)
    if result.reference_used:
        label = "reference: " if result.joints else ""
        console.print(f"{label}{printable(result.reference_used)}", soft_wrap=True)
    console.print()


def _joints(result: "CommissioningResult") -> Table:
    table = plain_table(("joint", "clearance", "detected", "named", "what else explains it"), 1, 5)
    for one in result.joints:
        last = len(one.clearances_m) - 1
        for i, clearance_m in enumerate(one.clearances_m):
            table.add_row(
                "" if i else one.joint,
                f"{1.0e3 * clearance_m:.3g} mm",
                _cycles(one.cycles[i]),
                _cycles(one.named_cycles[i]),
                one.runner_up if i == last else "",
            )
    return table


def _cycles(number: float) -> str:
    return f"{math.ceil(number)}" if number < _NEVER else "never" if math.isnan(number) else f"over {_NEVER}"


def _table(result: "CommissioningResult") -> Table:
    head = ("\nparameter", "\nvalue", "\n±", "mis-\nmatch", "\nrunner-up", "mis-\nmatch")
    table = plain_table(head, 1, 2, 5)
    for item in result.items:
        table.add_row(*_cells(item))
    return table


def _cells(item: "CommissioningItem") -> list[str]:
    return [
        item.name,
        f"{_shown(item.value)} {item.unit}".strip() if _is_known(item.value) else "-",
        "" if item.sigma is None else figure(item.sigma),
        "" if item.mismatch is None else f"{item.mismatch:.3f}",
        "" if item.other is None else _shown(item.other),
        "" if item.other_mismatch is None else f"{item.other_mismatch:.3f}",
    ]


def _is_known(value: str | int | float) -> bool:
    return not isinstance(value, float) or math.isfinite(value)


def _shown(value: str | int | float) -> str:
    if isinstance(value, str):
        return printable(value, 60)
    return str(value) if isinstance(value, int) else f"{value:.5g}"


# Writes the page of a fleet, and the pages of its legs.


_WORTH_WORKERS = 8
"""Pages from which on workers, which take a second or two to start, write them sooner than one process."""


def write_pages(description: Path, out: Path, fresh_days: float, workers: int) -> tuple[int, list[str]]:
    """Write the page of a fleet, and those of its legs that have changed.

    Parameters
    ----------
    description, out : pathlib.Path
        File of the description, and directory of the fleet.
    fresh_days : float
        Age of its last recording up to which a leg counts as monitored.
    workers : int
        Number of local processes for the pages of the legs; pages do not depend on it.

    Returns
    -------
    changed : int
        Number of legs whose page was written now; those that are up to date are not written again.
    faults : list of str
        Why the page of a leg cannot be made.

    Raises
    ------
    ConfigError
        If the description or the overview is unusable, or the disk does not take a page.
    """
    overview = described(load_overview(out), load_fleet(description))
    homes = [out / "legs" / leg.id for leg in overview.legs]
    due = [home for home in homes if _is_due(home)]
    faults = _write_legs(due, workers)
    pages = {home.name for home in homes if (home / PAGE).is_file()}
    day = Day(now_ns=time.time_ns(), fresh_days=fresh_days)
    page = fleet_page(overview, day, pages, {"leg_wear_monitor": package_version()})
    write_directory(out, {PAGE: page_html(page).encode()})
    return len(due) - len(faults), faults


def _is_due(home: Path) -> bool:
    """Whether the summary of a leg is newer than its page."""
    source, page = home / SUMMARY, home / PAGE
    return source.is_file() and not (page.is_file() and page.stat().st_mtime_ns > source.stat().st_mtime_ns)


def _write_legs(homes: Sequence[Path], workers: int) -> list[str]:
    """Write the pages of legs; why some cannot be made."""
    calls = {home.name: partial(write_leg, home) for home in homes}
    faults: list[str] = []
    with progress_bar("writing the pages") as progress:
        for _, fault in results(calls, workers if len(calls) >= _WORTH_WORKERS else 1):
            faults.append(fault)
            progress(len(faults) / len(calls))
    return sorted(filter(None, faults))


def write_leg(home: Path) -> str:
    """Write the page of a leg from its summary; why that is not possible, empty if it is.

    A page that cannot be made any more is removed: the page of the fleet does without.
    """
    source = home / SUMMARY
    try:
        text = page_of(summary_of(json_object(source), str(source)))
    except ConfigError as error:  # of an earlier version, or damaged
        write_directory(home, {PAGE: None})
        return str(error)
    write_directory(home, {PAGE: text})
    return ""

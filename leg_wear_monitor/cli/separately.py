"""``replay --separately``: each recording through a monitor of its own, several at a time, and one table."""

import csv
import io
import time
from collections import Counter
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from leg_wear_monitor.cli import common
from leg_wear_monitor.cli.replays import is_failed, write_replay
from leg_wear_monitor.dynamics.clearance.stepper import advance_beside
from leg_wear_monitor.errors import ConfigError, LegWearError, printable
from leg_wear_monitor.mechanism.loader import load_mechanism
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.wear_monitor import WearMonitor
from leg_wear_monitor.playback.replay import replay
from leg_wear_monitor.workers import results

if TYPE_CHECKING:
    from leg_wear_monitor.playback.summary import ReplayResult

TABLE = "recordings.csv"
Row = dict[str, Any]


def replay_separately(
    bags: tuple[Path, ...],
    config: MonitorConfig,
    out: Path,
    workers: int,
    *,
    allow_partial: bool,
    fail_on: tuple[str, ...],
    **options: Any,
) -> int:
    """Replay recordings into directories of ``out``, and write a table of them; the exit code.

    Parameters
    ----------
    bags : tuple of pathlib.Path
    config : MonitorConfig
    out : pathlib.Path
    workers : int
        Number of local processes.
    allow_partial, fail_on
        As of the verb.
    **options
        Of `leg_wear_monitor.replay`.

    Raises
    ------
    ConfigError
        If two recordings have the same name.
    """
    names = [_name(bag) for bag in bags]
    name, count = Counter(names).most_common(1)[0]
    if count > 1:
        fault = f"{count} recordings have this name. Expected a different name for each directory in --out"
        raise ConfigError("--separately", name, fault)
    with common.compilation("monitor", how_long="about a minute"), advance_beside():
        WearMonitor(load_mechanism(config.mechanism)).warm_up()
    call = partial(_replay_one, config=config, allow_partial=allow_partial, fail_on=fail_on, **options)
    calls = {name: partial(call, bag, out / name) for name, bag in zip(names, bags, strict=True)}
    rows: dict[str, Row] = {}
    with common.progress_bar("replaying") as progress:
        for name, (row, lines) in results(calls, workers):
            rows[name] = row
            common.print_findings(lines)
            common.write_directory(out, {TABLE: _table([rows[name] for name in names if name in rows])})
            progress(len(rows) / len(names))
    click.echo(f"written: {out / TABLE}: {len(rows)} recordings")
    return common.WITH_FINDINGS if any(row["failed"] for row in rows.values()) else 0


def _name(bag: Path) -> str:
    place = bag.resolve()
    return place.name if place.is_dir() else place.stem


def _replay_one(
    bag: Path,
    out: Path,
    config: MonitorConfig,
    allow_partial: bool,
    fail_on: tuple[str, ...],
    **options: Any,
) -> tuple[Row, list[str]]:
    """Row of a recording, and lines on its faults. The others go on if this one cannot be read."""
    began = [0.0]

    def ready(monitor: WearMonitor) -> None:
        monitor.warm_up()
        began[0] = time.perf_counter()

    def finish(result: "ReplayResult") -> None:
        write_replay(result, time.perf_counter() - began[0], out, None)

    try:
        result = replay([bag], config, out=out, ready=ready, finish=finish, **options)
    except LegWearError as error:
        fault = printable(str(error))
        return {"recording": out.name, "failed": True, "fault": fault}, [f"error: {fault}"]
    lines = [finding.line for finding in result.findings]
    return _row(out.name, result, is_failed(result, allow_partial, fail_on)), lines


def _row(name: str, result: "ReplayResult", failed: bool) -> Row:
    state = result.monitor.state
    wear = {
        f"wear_{joint}_m": f"{one.counted_m - one.new_m:.6g}"
        for joint, one in state.clearances.items()
        if result.is_believable
    }
    return {
        "recording": name,
        "verdict": state.verdict.state.value,
        "code": state.verdict.fault_code,
        "joints": " ".join(state.verdict.joints),
        "hours": f"{result.duration_s / 3600.0:.6g}",
        "gait_cycles": len(result.history),
        "failed": failed,
        "fault": "",
        **wear,
    }


def _table(rows: list[Row]) -> bytes:
    text = io.StringIO()
    head = ("recording", "verdict", "code", "joints", "hours", "gait_cycles", "failed", "fault")
    columns = dict.fromkeys((*head, *(name for row in rows for name in row)))
    writer = csv.DictWriter(text, list(columns), lineterminator="\n")
    writer.writeheader()
    writer.writerows(row | {"failed": int(row["failed"])} for row in rows)
    return text.getvalue().encode()

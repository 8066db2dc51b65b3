"""What is understood of a table: its rows, its time, its columns with their ranges in SI units."""

from contextlib import ExitStack
from pathlib import Path

from leg_wear_monitor.bags.bag import find_files
from leg_wear_monitor.bags.budget import Budget
from leg_wear_monitor.bags.findings import Finding
from leg_wear_monitor.bags.sources import open_sources
from leg_wear_monitor.bags.tables.file import TableFile
from leg_wear_monitor.bags.tables.layout import (
    CRANK_SPEED,
    DRIVE_TORQUE,
    FOOT_LOAD,
    FOOT_LOAD_ALONG,
    STAMP,
    Column,
    columns_of,
)
from leg_wear_monitor.errors import printable
from leg_wear_monitor.monitor.config.settings import MonitorConfig

_SI = {CRANK_SPEED: "rad/s", DRIVE_TORQUE: "N m", FOOT_LOAD: "N", FOOT_LOAD_ALONG: "N"}


def understood(path: Path, config: MonitorConfig) -> tuple[list[str], list[Finding]]:
    """Read a table as a whole: what was understood, a line each, and the findings.

    Parameters
    ----------
    path : pathlib.Path
        CSV or Parquet file.
    config : MonitorConfig
        Names the columns and their units.

    Raises
    ------
    RecordingError
        If the table cannot be read.
    """
    files, findings = find_files([path])
    with ExitStack() as stack:
        (source,), _ = open_sources(files, config, Budget(), stack)
        table = source.file
        if not isinstance(table, TableFile):
            raise TypeError(f"{path} is no table")
        for due in table.pieces({}):
            due.load()
        columns = columns_of(config)
        lines = [_time(table, columns), *(_column(table, one) for one in columns if one.key != STAMP)]
        return [*lines, *_others(table, columns)], findings + table.findings


def _time(table: TableFile, columns: tuple[Column, ...]) -> str:
    counts = table.counts
    seconds = ((counts.last_ns or 0) - (counts.first_ns or 0)) * 1.0e-9
    rate = f", {(counts.rows - 1) / seconds:.4g} rows a second" if seconds > 0.0 else ""
    of = next((f"time {_named(one)}" for one in columns if one.key == STAMP), "no column of the time")
    return f"table of {counts.rows} rows over {seconds:.6g} s{rate}; {of}"


def _column(table: TableFile, column: Column) -> str:
    counts, unit = table.counts, _SI.get(column.key, "rad")
    found = f"{counts.measured.get(column.key, 0)} values"
    if column.key in counts.least:
        found += f", {counts.least[column.key]:.4g} to {counts.most[column.key]:.4g} {unit}"
    return f"{column.key} {_named(column)}: {found}"


def _others(table: TableFile, columns: tuple[Column, ...]) -> list[str]:
    read = {column.name for column in columns}
    others = [printable(name, 100) for name in table.names if name not in read]
    return [f"not read: {', '.join(others)}"] if others else []


def _named(column: Column) -> str:
    return f"from {column.name!r} in {column.unit}"

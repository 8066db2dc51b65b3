"""Columns that are arrays already (Parquet, data frames) as rows in SI units."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.bags.findings import RecordingError
from leg_wear_monitor.bags.tables.damage import LostLines
from leg_wear_monitor.bags.tables.layout import STAMP, Column, Rows
from leg_wear_monitor.bags.tables.stamps import MOST_NS, Clock
from leg_wear_monitor.monitor.config.tables import DATE, TableInput

NUMBERS, TIMES = "iuf", "iufM"


def check_kind(source: str, column: Column, kind: str, shown: str, table: TableInput) -> None:
    """Check that a column has numbers, or the time dates.

    Parameters
    ----------
    source : str
        File name in errors.
    column : Column
    kind : str
        Its kind as numpy names it, such as ``f``.
    shown : str
        Its type, for the message.
    table : TableInput

    Raises
    ------
    RecordingError
    """
    expected = "numbers or dates" if column.key == STAMP else "numbers"
    if kind not in (TIMES if column.key == STAMP else NUMBERS):
        fault = f"column {column.name!r} is of type {shown}, expected {expected}"
        raise RecordingError(source, column.parameter, fault)
    if column.key == STAMP and (table.units.stamp == DATE) != (kind == "M"):
        found = "dates" if kind == "M" else "numbers"
        fault = f"{table.units.stamp!r} does not fit column {column.name!r}, which has {found}"
        raise RecordingError(source, "input.units.stamp", fault)


def rows_of(
    columns: Sequence[Column],
    arrays: Mapping[str, NDArray[np.generic]],
    measured: Mapping[str, NDArray[np.bool_]],
    first: int,
    stored: int,
    table: TableInput,
    lost: LostLines,
) -> Rows:
    """Rows in SI units; a row without a time is reported.

    Parameters
    ----------
    columns : sequence of Column
    arrays, measured : mapping
        Values (n,) and whether there is a value (n,), by the column's key.
    first : int
        Rows before these.
    stored : int
        Their bytes.
    table : TableInput
    lost : LostLines
    """
    row = first + np.arange(len(next(iter(arrays.values()))), dtype=np.int64)
    if STAMP in arrays:
        stamps, good = _stamps(arrays[STAMP], table)
        good &= measured[STAMP]
    else:
        stamps = table.start_ns + np.rint(row * (1.0e9 / table.rate_hz)).astype(np.int64)
        good = np.ones(len(row), bool)
    values = {one.key: one.to_si(arrays[one.key].astype(float)) for one in columns if one.key != STAMP}
    there = {one.key: measured[one.key] for one in columns if one.key != STAMP}
    rows = Rows(row + 1, stamps, values, there, stored)
    if good.all():
        return rows
    bad = np.flatnonzero(~good)
    shown = bad[: lost.left]
    for k in shown:
        time, unit = arrays[STAMP][k], table.units.stamp
        is_there = measured[STAMP][k] and not (isinstance(time, np.floating) and np.isnan(time))
        fault = f"{time} {unit} is no time from 1902 to 2038" if is_there else "has no time"
        lost.add(int(row[k]) + 1, fault)
    lost.count += len(bad) - len(shown)
    return rows.part(good)


def _stamps(times: NDArray[np.generic], table: TableInput) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Stamps [ns] of times, and whether each can be one."""
    if times.dtype.kind != "M":
        return Clock.of(table).of_numbers(times)  # type: ignore[arg-type]
    seconds = times.astype("datetime64[s]").astype(np.int64)  # of any year: nanoseconds would overflow
    good = np.abs(seconds) <= MOST_NS // 10**9
    stamps = np.where(good, times, np.datetime64(0, "ns")).astype("datetime64[ns]").astype(np.int64)
    return stamps, np.asarray(good & ~np.isnat(times))

"""Layout of tables: columns, rows, dates, units."""

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.errors import printable
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.config import tables
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.recordings.findings import RecordingError
from leg_wear_monitor.twin.sample import CONTACT, NO_LOAD, WRENCH

# Columns of a table: the columns to read, their units, and the columns that the table has.


CSV, PARQUET = ".csv", ".parquet"
_RENAME = "not read under this name. Rename it to {path.stem}.csv if it is a table"
_EXPORT = "a spreadsheet. Save it as CSV (UTF-8)"
REMEDIES = dict.fromkeys((".txt", ".tsv", ".dat", ".log"), _RENAME)
REMEDIES |= dict.fromkeys((".xlsx", ".xls", ".ods"), _EXPORT)
REMEDIES |= dict.fromkeys((".zstd", ".zst"), "compressed as a whole. Run: zstd -d {path} -o {path.stem}")
REMEDIES[".bag"] = "a ROS 1 bag. Convert it: rosbags-convert --src {path} --dst {path.stem}"
"""Remedy for a file that is not read, by the end of its name."""
STAMP, CRANK_ANGLE, CRANK_SPEED, DRIVE_TORQUE = "stamp", "crank_angle", "crank_speed", "drive_torque"
FOOT_LOAD, FOOT_LOAD_ALONG = "foot_load", "foot_load_along"
_MAY_BE_NONE = (CRANK_SPEED, DRIVE_TORQUE, FOOT_LOAD, FOOT_LOAD_ALONG)
_MOST_LISTED = 20


def is_table_name(name: str) -> bool:
    """True if a file is a table by its name, or a recording of a kind that is refused with a remedy."""
    return Path(name).suffix.lower() in (CSV, PARQUET, *REMEDIES)


@attrs.frozen
class Column:
    """A column that is read.

    Attributes
    ----------
    key : str
        Meaning of the column: one of the keys above, or the name of a further encoder.
    name : str
        Its name in the table.
    parameter : str
        Parameter that gives the name.
    unit : str
    factor, divisor : float
        Factor and divisor that convert to SI.
    """

    key: str
    name: str
    parameter: str
    unit: str
    factor: float = 1.0
    divisor: float = 1.0

    def to_si(self, values: Floats) -> Floats:
        """Values in SI units; those that are in them already stay the same bit for bit."""
        return np.asarray(values * self.factor / self.divisor)


@attrs.frozen(eq=False)
class Rows:
    """Rows of a table, in SI units.

    Attributes
    ----------
    line : (n,) array of int
        Line or row in the table, from 1.
    stamp_ns : (n,) array of int
    values : dict
        Values (n,) by the column's key; NaN where nothing was measured.
    measured : dict
        True if a value was measured (n,), by the column's key: an empty cell was not, a NaN was.
    stored : int
        Bytes that the rows occupy in the file.
    """

    line: NDArray[np.int64]
    stamp_ns: NDArray[np.int64]
    values: dict[str, Floats]
    measured: dict[str, NDArray[np.bool_]]
    stored: int = 0

    def part(self, which: NDArray[np.bool_]) -> "Rows":
        """Some of the rows."""
        values = {key: column[which] for key, column in self.values.items()}
        measured = {key: column[which] for key, column in self.measured.items()}
        return Rows(self.line[which], self.stamp_ns[which], values, measured, self.stored)


def columns_of(config: MonitorConfig) -> tuple[Column, ...]:
    """Columns to read, the time first if there is one."""
    names, units = config.table.columns, config.table.units
    scales = {
        STAMP: (1.0, 1.0),
        CRANK_ANGLE: config.table.angle_scale,
        CRANK_SPEED: tables.SPEEDS[units.crank_speed],
        DRIVE_TORQUE: tables.TORQUES[units.drive_torque],
    }
    force = (1.0, 1.0) if config.foot_load.source == CONTACT else tables.FORCES[units.foot_load]
    if config.foot_load.source != NO_LOAD:
        scales[FOOT_LOAD] = force
    if config.foot_load.source == WRENCH:
        scales[FOOT_LOAD_ALONG] = force
    own = [
        Column(key, getattr(names, key), f"table.columns.{key}", _unit(key, units), *scale)
        for key, scale in scales.items()
        if getattr(names, key) and not (key == STAMP and config.table.rate_hz)
    ]
    further = [
        Column(name, name, "encoders.names", units.crank_angle, *config.table.angle_scale)
        for name in config.encoders.names
    ]
    return (*own, *further)


def _unit(key: str, units: tables.Units) -> str:
    return str(getattr(units, FOOT_LOAD if key == FOOT_LOAD_ALONG else key))


def places(source: str, names: Sequence[str], taken: str, columns: Sequence[Column]) -> list[int]:
    """Index of each column among the names of a table, which were taken from the line `taken`.

    Raises
    ------
    RecordingError
        If a column is missing, or there twice.
    """
    found = []
    for column in columns:
        if names.count(column.name) != 1:
            what = "is there more than once" if column.name in names else "does not exist"
            nothing = ', or "" if there is none' if column.key in _MAY_BE_NONE else ""
            line = f"; {taken} was taken for the names" if taken else ""
            fault = f"column {column.name!r} {what}{line}. Expected one of: {listed(names)}{nothing}"
            remedy = f"'leg-wear-monitor check {source}' proposes the parameters"
            raise RecordingError(source, column.parameter, f"{fault}. {remedy}")
        found.append(names.index(column.name))
    return found


def listed(names: Sequence[str]) -> str:
    """Names as text, the first 20 of them."""
    more = f" and {len(names) - _MOST_LISTED} more" if len(names) > _MOST_LISTED else ""
    return ", ".join(printable(name, 100) for name in names[:_MOST_LISTED]) + more


# Dates and times as stamps, exact to the nanosecond.


MOST_NS = (2**31 - 1) * 1_000_000_000  # the seconds of a ROS stamp are an int32: until 2038
_UTC = ("Z", "+00:00", "+0000")


def dates(texts: Sequence[str], form: str = "") -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Stamps [ns] of dates and times, and whether each text is one.

    Parameters
    ----------
    texts : sequence of str
    form : str
        Format of `datetime.strptime`; empty: ISO 8601. Without a time zone in it, the texts are in UTC.
    """
    plain = [text.strip() if form else _without_zone(text.strip()) for text in texts]
    try:
        return _parsed(plain, form), np.ones(len(plain), bool)
    except ValueError:
        stamps, good = np.zeros(len(plain), np.int64), np.zeros(len(plain), bool)
    for k, text in enumerate(plain):
        try:
            stamps[k], good[k] = _parsed([text], form)[0], bool(text)
        except ValueError:
            continue
    return stamps, good


def _without_zone(text: str) -> str:
    """Text without the UTC mark; refuses other time zones, because numpy would only warn."""
    for mark in _UTC:
        text = text.removesuffix(mark)
    text = text.replace(",", ".")  # ISO 8601 permits a decimal comma, numpy does not
    is_one = len(text) >= 10 and "1970" <= text[:4] < "2038" and "+" not in text and text.count("-") == 2
    return text.strip() if is_one else "?"


def _parsed(texts: Sequence[str], form: str) -> NDArray[np.int64]:
    if form:
        times = [datetime.strptime(text, form) for text in texts]
        texts = [_without_zone((time.astimezone(UTC) if time.tzinfo else time).isoformat()) for time in times]
    parsed = np.array(texts, "datetime64[ns]")
    if np.isnat(parsed).any():
        raise ValueError("not a time")
    return parsed.astype(np.int64)


# Numbers and units in text.


_UNITS: Mapping[str, tuple[str, str]] = {
    text: (key, unit)
    for key, units in {
        STAMP: {"s": "s sec seconds sekunden", "ms": "ms", "us": "us µs μs", "ns": "ns"},
        CRANK_ANGLE: {
            "rad": "rad", "deg": "deg degree degrees grad °", "rev": "rev turn turns umdrehungen",
            tables.COUNTS: "counts ticks",
        },
        CRANK_SPEED: {
            "rad/s": "rad/s rads 1/s", "deg/s": "deg/s degs °/s", "rev/s": "rev/s rps",
            "rpm": "rpm 1/min u/min",
        },
        DRIVE_TORQUE: {"N m": "nm newtonmeter", "N mm": "nmm mnm"},
    }.items()
    for unit, texts in units.items()
    for text in texts.split()
}  # fmt: skip
"""Kind of column and unit of a parameter, by the unit as tables spell it."""


def units_named(text: str) -> tuple[str, str] | None:
    """Key of a column and unit of its parameter, by the text of a unit such as ``[Nm]``; None if unknown."""
    bare = text.strip().strip("[]()").lower()
    return _UNITS.get("".join(each for each in bare if each not in " ·*_."))


def is_number(text: str) -> bool:
    """True if a text is a number, NaN or infinity."""
    try:
        float(text)
    except ValueError:
        return False
    return "_" not in text

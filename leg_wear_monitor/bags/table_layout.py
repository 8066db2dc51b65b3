"""Layout of tables: columns, rows, dates, and hints at columns that are likely in a different unit."""

import math
from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.bags.findings import RecordingError
from leg_wear_monitor.errors import printable
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.monitor.config import tables
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.twin.sample import CONTACT, NO_LOAD, WRENCH

# Which columns of a table are read, in which units, and which of them it has.


CSV, PARQUET = ".csv", ".parquet"
_RENAME = "not read under this name. Rename it to {path.stem}.csv if it is a table"
_EXPORT = "a spreadsheet. Save it as CSV (UTF-8)"
REMEDIES = dict.fromkeys((".txt", ".tsv", ".dat", ".log"), _RENAME)
REMEDIES |= dict.fromkeys((".xlsx", ".xls", ".ods"), _EXPORT)
REMEDIES[".bag"] = "a ROS 1 bag. Convert it: rosbags-convert --src {path} --dst {path.stem}"
"""What to do with a file that is not read, by the end of its name."""
STAMP, CRANK_ANGLE, CRANK_SPEED, DRIVE_TORQUE = "stamp", "crank_angle", "crank_speed", "drive_torque"
FOOT_LOAD, FOOT_LOAD_ALONG = "foot_load", "foot_load_along"
_MAY_BE_NONE = (CRANK_SPEED, DRIVE_TORQUE, FOOT_LOAD, FOOT_LOAD_ALONG)
_MOST_LISTED = 20


def is_table_name(name: str) -> bool:
    """Whether a file is a table by its name, or a recording of a kind that is refused with a remedy."""
    return Path(name).suffix.lower() in (CSV, PARQUET, *REMEDIES)


@attrs.frozen
class Column:
    """A column that is read.

    Attributes
    ----------
    key : str
        What it is: one of the above, or the name of a further encoder.
    name : str
        Its name in the table.
    parameter : str
        Parameter that gives the name.
    unit : str
    factor, divisor : float
        To SI.
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
        Whether a value was measured (n,), by the column's key: an empty cell was not, a NaN was.
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
    """Text without the mark of UTC; another zone is refused, as numpy reads it with a warning only."""
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
    """Whether a text is a number, NaN or infinity."""
    try:
        float(text)
    except ValueError:
        return False
    return "_" not in text


# Columns that are likely in another unit: the wrap of the angle, its speed, the cadence.


_LEAST_ROWS = 50
_LEAST_TURNS = 2.0
_MOST_RADIANS = 360.0 / TURN  # as which fraction of its turns an angle in radians is read in degrees
_SAME = 1.02  # a wrapped angle reaches its turn within a sample
_NEAR = 1.5  # a hint fits if it gives the speed within this factor
_FAR = 2.0  # beyond this factor of the commanded speed no gait cycle counts (`monitor.evaluation`)
_APART = 1.25  # speed column against the speed of the angle


def unit_doubts(rows: Rows, config: MonitorConfig) -> Iterator[str]:
    """Doubts about units from the first rows of a table."""
    chosen = rows.measured[CRANK_ANGLE] & np.isfinite(rows.values[CRANK_ANGLE])
    angle, stamps = rows.values[CRANK_ANGLE][chosen], rows.stamp_ns[chosen]
    if len(angle) < _LEAST_ROWS:
        return
    turn = _other_turn(angle, config)
    if turn:
        yield turn
        return
    steps_s = np.diff(stamps) * 1.0e-9
    turned = np.diff(angle)
    if _wraps(angle):
        turned = (turned + math.pi) % TURN - math.pi
    ahead = steps_s > 0.0
    turns = float(turned[ahead].sum()) / TURN
    if abs(turns) < _LEAST_TURNS / _MOST_RADIANS:
        return
    has_turned = abs(turns) >= _LEAST_TURNS
    # below that only if it turns all the time, as an angle in radians that is read in degrees
    if not has_turned and not 0.5 < float(np.median(turned[ahead]) / turned[ahead].mean()) < 2.0:
        return
    if hint := _cadence(60.0 * turns / float(steps_s[ahead].sum()), has_turned, config):
        yield hint
    if CRANK_SPEED in rows.values:
        speed = rows.values[CRANK_SPEED][chosen][1:][ahead]
        known = np.isfinite(speed)
        if hint := _speed(speed[known], steps_s[ahead][known], turned[ahead][known], config):
            yield hint


def _wraps(angle: Floats) -> int:
    """How often an angle jumps by more than half of its range: a continuous one never does."""
    return int(np.count_nonzero(np.abs(np.diff(angle)) > 0.5 * np.ptp(angle)))


def _other_turn(angle: Floats, config: MonitorConfig) -> str:
    """Doubt about the unit of an angle that jumps back by a turn of another unit; empty if there is none."""
    unit, (factor, divisor) = config.table.units.crank_angle, config.table.angle_scale
    of_unit = factor / divisor
    if _wraps(angle) < _LEAST_TURNS:
        return ""
    span = float(angle.max() - angle.min())
    step = float(np.median(np.abs(np.diff(angle))))
    turns = {one: TURN * over / by for one, (by, over) in tables.ANGLES.items()} | {unit: TURN / of_unit}
    raw = (span + step) / of_unit
    for other, turn in turns.items():
        if other != unit and max(raw / turn, turn / raw) < _SAME:
            value = f"the angle jumps back by about {raw:.3g} each turn"
            text = f"{value}, in {unit!r} a turn is {turns[unit]:.4g}: is it in {other!r}"
            return f"{text} (table.units.crank_angle)?"
    return ""


def _cadence(joint_rpm: float, has_turned: bool, config: MonitorConfig) -> str:
    """Doubt about the angle, or the time once it has turned, if another unit gives the commanded cadence."""
    units, found = config.table.units, []
    rpm, commanded = abs(joint_rpm) / config.crank.gear_ratio, abs(config.cadence.commanded_rpm)
    if 1.0 / _FAR <= rpm / commanded <= _FAR:
        return ""
    if has_turned and units.stamp in tables.STAMPS and not config.table.rate_hz:
        for other, power in tables.STAMPS.items():
            found.append((rpm * 10.0 ** (tables.STAMPS[units.stamp] - power), "table.units.stamp", other))
    factor, divisor = config.table.angle_scale
    for other, (its_factor, its_divisor) in tables.ANGLES.items():
        of_other = rpm * (its_factor / its_divisor) / (factor / divisor)
        found.append((of_other, "table.units.crank_angle", other))
    sentence = f"the crank turns at {rpm:.3g} rpm, commanded are {commanded:g} rpm"
    best, key, other = min(found, key=lambda each: abs(math.log(each[0] / commanded)))
    fits = 1.0 / _NEAR < best / commanded < _NEAR
    return f"{sentence}; with {key} {other!r} it would turn at {best:.3g} rpm" if fits else ""


def _speed(speed: Floats, steps_s: Floats, turned: Floats, config: MonitorConfig) -> str:
    """Doubt about the column of the speed, if it is not the speed of the angle."""
    passed_s = float(steps_s.sum())
    by_speed, by_angle = float((speed * steps_s).sum()), float(turned.sum())
    if (
        not passed_s
        or abs(by_angle) < TURN
        or (by_speed / by_angle > 1.0 / _APART and by_speed / by_angle < _APART)
    ):
        return ""
    unit = config.table.units.crank_speed
    of_unit = tables.SPEEDS[unit][0] / tables.SPEEDS[unit][1]
    text = (
        f"crank_speed is {by_speed / passed_s / of_unit:.4g} {unit} in the mean, but the angle turns at "
        f"{by_angle / passed_s / of_unit:.4g} {unit}"
    )
    for other, (factor, divisor) in tables.SPEEDS.items():
        ratio = by_speed / of_unit * (factor / divisor) / by_angle
        if other != unit and 1.0 / _APART < ratio < _APART:
            return f"{text}: is it in {other!r} (table.units.crank_speed)?"
    return f"{text}: one of the two columns or its unit is wrong"

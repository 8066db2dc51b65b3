"""Checks tables: how a table is read, and the parameters to read it by the names and units of its columns."""

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.errors import printable
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.config.tables import COUNTS, DATE, Columns
from leg_wear_monitor.recordings.bag import find_files
from leg_wear_monitor.recordings.findings import Finding, listed, open_recording
from leg_wear_monitor.recordings.reader import clock_steps
from leg_wear_monitor.recordings.table_file import FOOT_LOAD, FOOT_LOAD_ALONG, TableFile, open_table
from leg_wear_monitor.recordings.table_head import (
    CRANK_ANGLE,
    CRANK_SPEED,
    DRIVE_TORQUE,
    STAMP,
    dates,
    is_date,
    is_number,
    units_named,
)

_SI = {CRANK_SPEED: "rad/s", DRIVE_TORQUE: "N m", FOOT_LOAD: "N", FOOT_LOAD_ALONG: "N"}
_WORDS = {
    STAMP: "time timestamp stamp date t zeit uhrzeit zeitstempel datum",
    CRANK_SPEED: "speed velocity omega rpm drehzahl geschwindigkeit",
    DRIVE_TORQUE: "torque effort tau moment drehmoment",
    CRANK_ANGLE: "angle position pos theta phi crank winkel",
}
"""Words for each column. The speed precedes the angle, because a crank_speed has the word crank as well."""

_DAYS = "%d.%m.%Y", "%d/%m/%Y", "%m/%d/%Y", "%Y/%m/%d"
_TIMES = "%H:%M:%S.%f", "%H:%M:%S,%f", "%H:%M:%S"
_EPOCHS = {"ns": 1.0e17, "us": 1.0e14, "ms": 1.0e11, "s": 1.0e8}  # least time since 1970, from 1973 on
_STEPS = {"s": 0.5, "ms": 200.0, "us": 2.0e5}  # rows come at 5 to 2000 Hz


@attrs.frozen
class Proposal:
    """Parameters of a table.

    Attributes
    ----------
    values : dict
        Parameters by dotted name.
    notes : dict
        Remarks about some of the parameters.
    missing : tuple of str
        Parameters that a user has to set.
    columns : str
        Names of all columns, with the value in the first row.
    """

    values: dict[str, Any]
    notes: dict[str, str]
    missing: tuple[str, ...]
    columns: str

    @property
    def text(self) -> str:
        """A parameter file."""
        lines, before = ["/**:", "  ros__parameters:"], [""]
        for name, value in sorted(self.values.items(), key=lambda item: item[0].rpartition(".")[0]):
            parts = name.split(".")
            for k, part in enumerate(parts[:-1]):
                if parts[: k + 1] != before[: k + 1]:
                    lines.append(f"{'  ' * (k + 2)}{part}:")
            shown = json.dumps(value, ensure_ascii=False)
            note = f"  # {self.notes[name]}" if name in self.notes else ""
            lines.append(f"{'  ' * (len(parts) + 1)}{parts[-1]}: {shown}{note}")
            before = parts
        return "\n".join(lines)


def propose(path: Path) -> Proposal | None:
    """Parameters for a CSV or Parquet file; None if the default names of the columns are there.

    Raises
    ------
    RecordingError
        If the file is not a table.
    """
    (file,) = find_files([path])
    with open_recording(path) as content:
        source = open_table(path, content, file.storage, Columns().crank_angle)
        names = source.head.names
        if {Columns().stamp, Columns().crank_angle, Columns().drive_torque} <= set(names):
            return None
        first = next((read for line, read, _ in source.batches(range(len(names))) if len(line)), [])
        rows = [column.slice(0, 200).to_pylist() for column in first]
    texts = [["" if cell is None else str(cell).strip() for cell in column] for column in rows]
    texts = texts or [[] for _ in names]
    if source.head.has_decimal_comma:
        texts = [[re.sub(r"^([-+]?\d*),(\d+)$", r"\1.\2", cell) for cell in column] for column in texts]
    units = source.head.units or [""] * len(names)
    return _proposal(names, [*units, *[""] * len(names)], texts)


def _proposal(names: Sequence[str], units: Sequence[str], texts: Sequence[Sequence[str]]) -> Proposal:
    values: dict[str, Any] = {}
    notes: dict[str, str] = {}
    found = _columns(names)
    for key in (STAMP, CRANK_ANGLE, DRIVE_TORQUE, CRANK_SPEED):
        places = found[key]
        parameter = f"table.columns.{key}"
        if not places and key == CRANK_SPEED:
            continue
        values[parameter] = names[places[0]] if places else ""
        if not places:
            optional = "" if key in (STAMP, CRANK_ANGLE) else ', or "" if there is none'
            notes[parameter] = f"name the column{optional}"
        elif len(places) > 1:
            notes[parameter] = f"or {listed([names[k] for k in places[1:]])}"
    for key in (STAMP, CRANK_ANGLE, DRIVE_TORQUE, CRANK_SPEED):
        for place in found[key][:1]:
            named = _unit(key, names[place], units[place])
            found_values = _of_time(texts[place], named) if key == STAMP else [(f"units.{key}", named)]
            values |= {f"table.{name}": value for name, value in found_values if value}
            if not named and key != STAMP:
                notes[f"table.columns.{key}"] = f"unit unknown: set table.units.{key}"
    if values.get(f"table.units.{CRANK_ANGLE}") == COUNTS:
        values["table.counts_per_turn"], notes["table.counts_per_turn"] = 4096.0, "counts of your encoder"
    if "%d/%m" in values.get("table.date_format", ""):
        notes["table.date_format"] = "%m/%d/%Y if the month comes first"
    shown = [f"{name} ({cells[0]})" if cells else name for name, cells in zip(names, texts, strict=True)]
    needed = (f"table.columns.{key}" for key in (STAMP, CRANK_ANGLE))
    return Proposal(values, notes, tuple(name for name in needed if not values[name]), listed(shown))


def _columns(names: Sequence[str]) -> Mapping[str, list[int]]:
    """Positions of the columns that may belong to each key; a crank's columns come first."""
    found: dict[str, list[int]] = {key: [] for key in _WORDS}
    for place, name in enumerate(names):
        words = re.findall(r"[a-zäöüß]+", re.sub(r"([a-z])([A-Z])", r"\1 \2", name).lower())
        for key, known in _WORDS.items():
            if any(_means(word, known.split()) for word in words):
                found[key].append(place)
                break
    for places in found.values():
        places.sort(key=lambda place: not re.search("crank|kurbel", names[place].lower()))
    return found


def _means(word: str, known: Sequence[str]) -> bool:
    """True if a word is known or ends with a known word, like the German Kurbelwinkel."""
    return word in known or any(len(each) > 4 and word.endswith(each) for each in known)


def _unit(key: str, name: str, below: str) -> str:
    """Unit of a column, from the row of units or from the end of its name; empty if there is none."""
    bracketed = re.findall(r"[\[(]([^\])]*)[\])]", name)
    words = re.split(r"[\s_]+", name)
    for text in (below, *bracketed, " ".join(words[-2:]), words[-1] if len(words) > 1 else ""):
        named = units_named(text)
        if named and named[0] == key:
            return named[1]
    return ""


def _of_time(cells: Sequence[str], named: str) -> Iterator[tuple[str, str]]:
    """Parameters of the time: its unit, and the format of a date."""
    cells = [cell for cell in cells if cell]
    if cells and not is_number(cells[0]):
        yield "units.stamp", DATE
        if not is_date(cells[0]):
            forms = (f"{day} {time}" for day in _DAYS for time in _TIMES)
            yield "date_format", next((form for form in forms if dates(cells, form)[1].all()), "")
        return
    times = np.array([float(cell) for cell in cells if is_number(cell)])
    if named or not len(times):
        yield "units.stamp", named
        return
    since_1970 = (unit for unit, least in _EPOCHS.items() if times[0] >= least)
    step = float(np.median(np.diff(times))) if len(times) > 1 else 0.0
    by_step = next((unit for unit, most in _STEPS.items() if step < most), "ns")
    yield "units.stamp", next(since_1970, by_step)


# A table as the reader understands it: rows, time, columns with their ranges in SI units.


def understood(path: Path, config: MonitorConfig) -> tuple[list[str], list[Finding]]:
    """Read a table as a whole; return how it was interpreted, one line per item, and the findings.

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
    (file,) = find_files([path])
    with open_recording(path) as content:
        table = TableFile(path, content, file.storage, config)
        parts = list[NDArray[np.int64]]()
        numbers = dict.fromkeys((column.key for column in table.columns), 0)
        ranges: dict[str, tuple[float, float]] = {}
        for rows in table.rows:
            parts.append(rows.stamp_ns)
            for key, values in rows.values.items():
                numbers[key] += int(np.count_nonzero(rows.measured[key]))
                if len(finite := values[np.isfinite(values)]):
                    least, most = ranges.get(key, (np.inf, -np.inf))
                    ranges[key] = min(least, finite.min()), max(most, finite.max())
    stamps = np.concatenate(parts)
    seconds = 1.0e-9 * int(stamps[-1] - stamps[0])
    rate = f", {(len(stamps) - 1) / seconds:.4g} rows per second" if seconds > 0.0 else ""
    of = next((f"time {one}" for one in table.columns if one.key == STAMP), "no column of the time")
    lines = [f"table of {len(stamps)} rows over {seconds:.6g} s{rate}; {of}"]
    for column in table.columns:
        if column.key != STAMP:
            found = ", all of them NaN or infinite" if numbers[column.key] else ""
            if column.key in ranges:
                least, most = ranges[column.key]
                found = f", {least:.4g} to {most:.4g} {_SI.get(column.key, 'rad')}"
            lines.append(f"{column.key} {column}: {numbers[column.key]} values{found}")
    others = [f"not read: {', '.join(printable(name, 100) for name in table.others)}"] if table.others else []
    return [*lines, *others], table.findings + clock_steps(path, stamps)[1]

"""Rows of tables: lines of CSV, arrays, data frames."""

import csv
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.bags import table_layout
from leg_wear_monitor.bags.budget import Budget
from leg_wear_monitor.bags.findings import Finding, RecordingError
from leg_wear_monitor.errors import printable
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.config.tables import DATE, TableInput

# Lines of a CSV file in blocks, in bounded memory, whatever the file contains.


_UTF8_MARK = b"\xef\xbb\xbf"
_UTF16_MARKS = (b"\xff\xfe", b"\xfe\xff")
_SEPARATORS = ",;\t"


def blocks(
    path: Path, file: IO[bytes], size: int, findings: list[Finding]
) -> Iterator[tuple[list[str], int, int]]:
    """Complete lines, about `size` bytes at a time; what is not a complete line becomes a finding.

    Yields
    ------
    texts : list of str
        Lines without line breaks.
    first : int
        Number of the first one, from 1.
    stored : int
        Their bytes in the file.
    """
    file.seek(0)
    number, rest, at = 1, b"", 0
    while part := file.read(size):
        text, found, rest = (rest + part).rpartition(b"\n")
        if found:
            if not at:
                text = text.removeprefix(_UTF8_MARK)
            texts = text.decode("utf-8", "surrogateescape").split("\n")
            yield texts, number, len(text) + 1
            number += len(texts)
        elif len(rest) >= size:
            findings.append(
                Finding(path, f"line {number} has no end within {size} bytes: all from it on is lost")
            )
            return
        at += len(part)
    if rest.strip():
        fault = "it has no line break at its end, so it may be cut short"
        findings.append(Finding(path, f"line {number} is lost: {fault}"))


def separator_of(path: Path, header: str) -> str:
    """The separator of the cells: the most frequent of comma, semicolon and tab, else the space.

    Raises
    ------
    RecordingError
        If the file is not a text in UTF-8.
    """
    if header.encode("utf-8", "surrogateescape").startswith(_UTF16_MARKS) or "\0" in header:
        raise RecordingError(str(path), "", "is not a text in UTF-8, expected a CSV file in UTF-8")
    best = max(_SEPARATORS, key=header.count)
    return best if best in header else " "


def is_number(text: str) -> bool:
    """Whether a cell is a number."""
    try:
        float(text)
    except ValueError:
        return False
    return True


# CSV files: rows by the standard library's reader, numbers correctly rounded, faults by line.


_BLOCK = 2**21
_OF_A_BYTE = 32  # memory of cells, rows and samples per byte of text
_Row = list[str]


class CsvFile:
    """An open CSV file.

    Parameters
    ----------
    path : pathlib.Path
        Name of the file in findings and errors.
    file : binary file
        Seekable.
    config : MonitorConfig
    budget : Budget
    findings : list of Finding
        Where the findings go.

    Raises
    ------
    RecordingError
        If the file is empty, is no text, or lacks a column.
    """

    def __init__(
        self, path: Path, file: IO[bytes], config: MonitorConfig, budget: Budget, findings: list[Finding]
    ) -> None:
        self._path, self._file, self._findings = path, file, findings
        self.size = file.seek(0, 2)
        self._block = min(_BLOCK, budget.part_limit // _OF_A_BYTE)
        self._config, self._clock = config.input, table_layout.Clock.of(config.input)
        self._lost = table_layout.LostLines(path, findings)
        if not self.size:
            raise RecordingError(str(path), "", "is empty, expected a line with the names of the columns")
        first = next(blocks(path, file, self._block, []), None)
        if first is None:
            raise RecordingError(str(path), "", "has no complete line, expected the names of the columns")
        self._separator = separator_of(path, first[0][0])
        names = self._names(first[0][0])
        self._has_header = not all(map(is_number, names))
        self.names = names if self._has_header else [str(k + 1) for k in range(len(names))]
        self._columns = table_layout.columns_of(config)
        self._places = table_layout.places(str(path), self.names, self._columns)

    def parts(self) -> Iterator[table_layout.Rows]:
        """All sound rows, block by block."""
        for texts, first, stored in blocks(self._path, self._file, self._block, self._findings):
            rows, line = self._rows(texts), first + np.arange(len(texts))
            skipped = 1 if first == 1 and self._has_header else 0
            yield self._converted(rows[skipped:], line[skipped:], stored)
        self._lost.close()

    def _names(self, header: str) -> list[str]:
        """Names of the columns; numpy.savetxt writes them behind a number sign."""
        cells = next(self._reader([header.removeprefix("#").strip()]), [])
        return [cell.strip() for cell in cells]

    def _reader(self, texts: Sequence[str]) -> "Iterator[_Row]":
        return csv.reader(texts, delimiter=self._separator, skipinitialspace=self._separator == " ")

    def _rows(self, texts: list[str]) -> list[_Row]:
        """Cells of lines."""
        try:
            rows = list(self._reader(texts))
        except csv.Error:
            rows = []
        # otherwise, a cell in quotes contains a line break
        return rows if len(rows) == len(texts) else [self._one(text) for text in texts]

    def _one(self, text: str) -> _Row:
        try:
            return next(self._reader([text]), [])
        except csv.Error:
            return [text]

    def _converted(self, rows: list[_Row], line: NDArray[np.int64], stored: int) -> table_layout.Rows:
        """Rows in SI units; those that cannot be read are reported."""
        rows, line = self._complete(rows, line)
        sound = np.ones(len(rows), bool)
        values, measured = {}, {}
        stamps = self._regular(line)
        for column, place in zip(self._columns, self._places, strict=True):
            texts = [row[place] for row in rows]
            if column.key == table_layout.STAMP:
                stamps = self._stamps(column, texts, line, sound)
                continue
            found, is_there, bad = _numbers(texts)
            self._report(column, texts, line, bad & sound)
            sound &= ~bad
            values[column.key], measured[column.key] = column.to_si(found), is_there
        every = table_layout.Rows(line, stamps, values, measured, stored)
        return every if sound.all() else every.part(sound)

    def _complete(self, rows: list[_Row], line: NDArray[np.int64]) -> tuple[list[_Row], NDArray[np.int64]]:
        """Rows with as many cells as there are columns."""
        expected = len(self.names)
        if all(len(row) == expected for row in rows):
            return rows, line
        complete = np.array([len(row) == expected for row in rows], bool)
        is_blank = np.array([not any(cell.strip() for cell in row) for row in rows], bool)

        def fault(k: int) -> str:
            hint = "; decimal commas?" if self._separator == "," and len(rows[k]) > expected else ""
            return f"{len(rows[k])} cells, expected {expected}{hint}"

        self._lost.add(line, np.flatnonzero(~complete & ~is_blank), fault)
        return [row for row in rows if len(row) == expected], line[complete]

    def _regular(self, line: NDArray[np.int64]) -> NDArray[np.int64]:
        """Stamps of rows without a column of the time."""
        if not self._config.rate_hz:
            return line
        row = line - 1 - self._has_header
        passed = np.rint(row * (1.0e9 / self._config.rate_hz)).astype(np.int64)
        return np.asarray(passed + self._config.start_ns)

    def _stamps(
        self, column: table_layout.Column, texts: list[str], line: NDArray[np.int64], sound: NDArray[np.bool_]
    ) -> NDArray[np.int64]:
        """Stamps of rows; a row without a time is not sound."""
        if self._config.units.stamp == DATE:
            stamps, good = table_layout.dates(texts)
        else:
            times, is_there, _ = _numbers(texts)
            stamps, good = self._clock.of_texts(texts, times)
            good &= is_there
        self._report(column, texts, line, ~good & sound)
        sound &= good
        return stamps

    def _report(
        self, column: table_layout.Column, texts: list[str], line: NDArray[np.int64], bad: NDArray[np.bool_]
    ) -> None:
        self._lost.add(
            line, np.flatnonzero(bad), lambda k: f"column {column.name!r}: {_fault(column, texts[k])}"
        )


def _numbers(texts: list[str]) -> tuple[Floats, NDArray[np.bool_], NDArray[np.bool_]]:
    """Numbers of cells, whether anything is in the cell, and whether that is not a number."""
    is_there, bad = np.ones(len(texts), bool), np.zeros(len(texts), bool)
    try:
        return np.array(list(map(float, texts)), float), is_there, bad
    except ValueError:
        found = np.full(len(texts), np.nan)
    for k, text in enumerate(texts):
        is_there[k] = bool(text.strip())
        bad[k] = is_there[k] and not is_number(text)
        if is_there[k] and not bad[k]:
            found[k] = float(text)
    return found, is_there, bad


def _fault(column: table_layout.Column, text: str) -> str:
    """What is wrong with a cell."""
    shown, unit = printable(text.strip(), 60), column.unit
    if column.key == table_layout.STAMP and unit == DATE:
        return f"{shown!r} is no date and time in UTC, expected one such as 2026-03-01 09:00:00.001"
    if not shown:
        return f"empty, expected a time in {unit}"
    if is_number(text) and not math.isfinite(float(text)):
        return f"{shown} is no time, expected one in {unit}"
    if is_number(text):
        return f"{shown} {unit} is no time from 1902 to 2038; another unit (input.units.stamp)?"
    hint = "; a decimal comma?" if is_number(text.replace(",", ".", 1)) else ""
    if column.key == table_layout.STAMP and table_layout.dates([text])[1][0]:
        hint = f"; a date ({column.parameter.replace('columns', 'units')}: {DATE})?"
    return f"{shown!r} is not a number, expected one in {unit}{hint}"


# Columns that are arrays already (Parquet, data frames) as rows in SI units.


NUMBERS, TIMES = "iuf", "iufM"


def check_kind(source: str, column: table_layout.Column, kind: str, shown: str, table: TableInput) -> None:
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
    expected = "numbers or dates" if column.key == table_layout.STAMP else "numbers"
    if kind not in (TIMES if column.key == table_layout.STAMP else NUMBERS):
        fault = f"column {column.name!r} is of type {shown}, expected {expected}"
        raise RecordingError(source, column.parameter, fault)
    if column.key == table_layout.STAMP and (table.units.stamp == DATE) != (kind == "M"):
        found = "dates" if kind == "M" else "numbers"
        fault = f"{table.units.stamp!r} does not fit column {column.name!r}, which has {found}"
        raise RecordingError(source, "input.units.stamp", fault)


def rows_of(
    columns: Sequence[table_layout.Column],
    arrays: Mapping[str, NDArray[np.generic]],
    measured: Mapping[str, NDArray[np.bool_]],
    first: int,
    stored: int,
    table: TableInput,
    lost: table_layout.LostLines,
) -> table_layout.Rows:
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
    if table_layout.STAMP in arrays:
        stamps, good = _stamps(arrays[table_layout.STAMP], table)
        good &= measured[table_layout.STAMP]
    else:
        stamps = table.start_ns + np.rint(row * (1.0e9 / table.rate_hz)).astype(np.int64)
        good = np.ones(len(row), bool)
    values = {
        one.key: one.to_si(arrays[one.key].astype(float)) for one in columns if one.key != table_layout.STAMP
    }
    there = {one.key: measured[one.key] for one in columns if one.key != table_layout.STAMP}
    rows = table_layout.Rows(row + 1, stamps, values, there, stored)
    if good.all():
        return rows

    def fault(k: int) -> str:
        time = arrays[table_layout.STAMP][k]
        is_there = measured[table_layout.STAMP][k] and not (isinstance(time, np.floating) and np.isnan(time))
        return f"{time} {table.units.stamp} is no time from 1902 to 2038" if is_there else "has no time"

    lost.add(row + 1, np.flatnonzero(~good), fault)
    return rows.part(good)


def _stamps(times: NDArray[np.generic], table: TableInput) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Stamps [ns] of times, and whether each can be one."""
    if times.dtype.kind != "M":
        return table_layout.Clock.of(table).of_numbers(times)  # type: ignore[arg-type]
    seconds = times.astype("datetime64[s]").astype(np.int64)  # of any year: nanoseconds would overflow
    good = np.abs(seconds) <= table_layout.MOST_NS // 10**9
    stamps = np.where(good, times, np.datetime64(0, "ns")).astype("datetime64[ns]").astype(np.int64)
    return stamps, np.asarray(good & ~np.isnat(times))


# Columns in memory: a mapping of arrays, or a data frame.


_ROWS = 65536


class Frame:
    """Columns in memory, read like a file.

    Parameters
    ----------
    path : pathlib.Path
        Name of the table in findings and errors.
    table : mapping of str to array, or data frame
        The index of a frame counts as a column if it has a name. NaN: not measured.
    config : MonitorConfig
    findings : list of Finding
        Where the findings go.

    Raises
    ------
    RecordingError
        If a column is missing, is no array of numbers, or has another length.
    """

    def __init__(self, path: Path, table: Any, config: MonitorConfig, findings: list[Finding]) -> None:
        self._config, self._lost = config.input, table_layout.LostLines(path, findings, "row")
        self._columns = table_layout.columns_of(config)
        content = table if isinstance(table, Mapping) else _named(table)
        self.names = [str(name) for name in content]
        table_layout.places(str(path), self.names, self._columns)
        self._arrays = {one.key: self._array(path, one, content[one.name]) for one in self._columns}
        lengths = {one.name: len(self._arrays[one.key]) for one in self._columns}
        self._rows = next(iter(lengths.values()))
        if len(set(lengths.values())) > 1:
            words = ", ".join(f"{name} {length}" for name, length in lengths.items())
            raise RecordingError(str(path), "", f"has columns of different lengths: {words}")
        self.size = sum(array.nbytes for array in self._arrays.values())

    def parts(self) -> Iterator[table_layout.Rows]:
        """All sound rows, block by block."""
        for begin in range(0, self._rows, _ROWS):
            chosen = {key: array[begin : begin + _ROWS] for key, array in self._arrays.items()}
            # neither NaN nor NaT equals itself
            there = {key: np.asarray(array == array) for key, array in chosen.items()}
            stored = self.size * min(_ROWS, self._rows - begin) // self._rows
            yield rows_of(self._columns, chosen, there, begin, stored, self._config, self._lost)
        self._lost.close()

    def _array(self, path: Path, column: table_layout.Column, values: Any) -> NDArray[np.generic]:
        """A column as an array of numbers or dates."""
        array = np.asarray(values.to_numpy() if hasattr(values, "to_numpy") else values)
        if array.dtype.kind == "O":  # what pandas has beside missing values, and dates of a time zone
            array = _plain(values, array)
        if array.ndim != 1:
            fault = f"column {column.name!r} has the shape {array.shape}, expected one number a row"
            raise RecordingError(str(path), column.parameter, fault)
        check_kind(str(path), column, array.dtype.kind, str(array.dtype), self._config)
        return array


def _plain(values: Any, array: NDArray[Any]) -> NDArray[Any]:
    """Objects as numbers or dates, if they are some; else the objects."""
    kind = str(getattr(values, "dtype", ""))
    try:
        if kind.startswith("datetime64"):
            return np.asarray(values, "datetime64[ns]")
        if kind[:1] in "IUF" and hasattr(values, "to_numpy"):
            return np.asarray(values.to_numpy(dtype=float, na_value=np.nan))
    except (TypeError, ValueError):
        pass
    return array


def _named(frame: Any) -> dict[str, Any]:
    """Columns of a data frame, its index among them if it has a name."""
    columns = {str(name): frame[name] for name in frame.columns}
    index: Any = getattr(frame, "index", None)  # pandas has one
    if getattr(index, "name", None) is not None:
        columns.setdefault(str(index.name), index)
    return columns

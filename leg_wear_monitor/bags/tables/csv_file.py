"""CSV files: rows by the standard library's reader, numbers correctly rounded, faults by line."""

import csv
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import IO

import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.bags.budget import Budget
from leg_wear_monitor.bags.findings import Finding, RecordingError
from leg_wear_monitor.bags.tables.csv_lines import Lines, blocks, is_number, separator_of
from leg_wear_monitor.bags.tables.damage import LostLines
from leg_wear_monitor.bags.tables.layout import STAMP, Column, Rows, columns_of, places
from leg_wear_monitor.bags.tables.stamps import Clock, dates
from leg_wear_monitor.errors import printable
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.config.tables import DATE

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
        self._block = min(_BLOCK, budget.at_once // _OF_A_BYTE)
        self._config, self._clock = config.input, Clock.of(config.input)
        self._lost = LostLines(path, findings)
        if not self.size:
            raise RecordingError(str(path), "", "is empty, expected a line with the names of the columns")
        first = next(blocks(path, file, self._block, []), None)
        if first is None:
            raise RecordingError(str(path), "", "has no complete line, expected the names of the columns")
        self._separator = separator_of(path, first.texts[0])
        names = self._names(first.texts[0])
        self._has_header = not all(map(is_number, names))
        self.names = names if self._has_header else [str(k + 1) for k in range(len(names))]
        self._columns = columns_of(config)
        self._places = places(str(path), self.names, self._columns)

    def parts(self) -> Iterator[Rows]:
        """All sound rows, block by block."""
        for lines in blocks(self._path, self._file, self._block, self._findings):
            rows, numbers = self._rows(lines)
            skipped = 1 if lines.first == 1 and self._has_header else 0
            yield self._converted(rows[skipped:], numbers[skipped:], lines.stored)
        self._lost.close()

    def _names(self, header: str) -> list[str]:
        """Names of the columns; numpy.savetxt writes them behind a number sign."""
        cells = next(self._reader([header.removeprefix("#").strip()]), [])
        return [cell.strip() for cell in cells]

    def _reader(self, texts: Sequence[str]) -> "Iterator[_Row]":
        return csv.reader(texts, delimiter=self._separator, skipinitialspace=self._separator == " ")

    def _rows(self, lines: Lines) -> tuple[list[_Row], NDArray[np.int64]]:
        """Cells of complete rows and their line numbers; blank lines are none."""
        try:
            rows = list(self._reader(lines.texts))
        except csv.Error:
            rows = [self._one(text) for text in lines.texts]
        numbers = lines.first + np.arange(len(rows))
        if len(rows) != len(lines.texts):  # a cell in quotes contains a line break
            rows = [self._one(text) for text in lines.texts]
            numbers = lines.first + np.arange(len(rows))
        return rows, numbers

    def _one(self, text: str) -> _Row:
        try:
            return next(self._reader([text]), [])
        except csv.Error:
            return [text]

    def _converted(self, rows: list[_Row], line: NDArray[np.int64], stored: int) -> Rows:
        """Rows in SI units; those that cannot be read are reported."""
        rows, line = self._complete(rows, line)
        sound = np.ones(len(rows), bool)
        values, measured = {}, {}
        stamps = self._regular(line)
        for column, place in zip(self._columns, self._places, strict=True):
            texts = [row[place] for row in rows]
            if column.key == STAMP:
                stamps = self._stamps(column, texts, line, sound)
                continue
            found, is_there, bad = _numbers(texts)
            self._report(column, texts, line, bad & sound)
            sound &= ~bad
            values[column.key], measured[column.key] = column.to_si(found), is_there
        every = Rows(line, stamps, values, measured, stored)
        return every if sound.all() else every.part(sound)

    def _complete(self, rows: list[_Row], line: NDArray[np.int64]) -> tuple[list[_Row], NDArray[np.int64]]:
        """Rows with as many cells as there are columns."""
        expected = len(self.names)
        if all(len(row) == expected for row in rows):
            return rows, line
        complete = np.array([len(row) == expected for row in rows], bool)
        for k in np.flatnonzero(~complete):
            if any(cell.strip() for cell in rows[k]):  # else a blank line
                hint = "; decimal commas?" if self._separator == "," and len(rows[k]) > expected else ""
                self._lost.add(int(line[k]), f"{len(rows[k])} cells, expected {expected}{hint}")
        return [row for row in rows if len(row) == expected], line[complete]

    def _regular(self, line: NDArray[np.int64]) -> NDArray[np.int64]:
        """Stamps of rows without a column of the time."""
        if not self._config.rate_hz:
            return line
        row = line - 1 - self._has_header
        passed = np.rint(row * (1.0e9 / self._config.rate_hz)).astype(np.int64)
        return np.asarray(passed + self._config.start_ns)

    def _stamps(
        self, column: Column, texts: list[str], line: NDArray[np.int64], sound: NDArray[np.bool_]
    ) -> NDArray[np.int64]:
        """Stamps of rows; a row without a time is not sound."""
        if self._config.units.stamp == DATE:
            stamps, good = dates(texts)
        else:
            times, is_there, _ = _numbers(texts)
            stamps, good = self._clock.of_texts(texts, times)
            good &= is_there
        self._report(column, texts, line, ~good & sound)
        sound &= good
        return stamps

    def _report(
        self, column: Column, texts: list[str], line: NDArray[np.int64], bad: NDArray[np.bool_]
    ) -> None:
        for k in np.flatnonzero(bad):
            self._lost.add(int(line[k]), f"column {column.name!r}: {_fault(column, texts[k])}")


def _numbers(texts: list[str]) -> tuple[Floats, NDArray[np.bool_], NDArray[np.bool_]]:
    """Numbers of cells, whether anything is in the cell, and whether that is not a number."""
    try:
        found = np.array(list(map(float, texts)), float)
    except ValueError:
        found, is_there, bad = (
            np.full(len(texts), np.nan),
            np.ones(len(texts), bool),
            np.zeros(len(texts), bool),
        )
        for k, text in enumerate(texts):
            is_there[k] = bool(text.strip())
            bad[k] = is_there[k] and not is_number(text)
            if is_there[k] and not bad[k]:
                found[k] = float(text)
        return found, is_there, bad
    return found, np.ones(len(texts), bool), np.zeros(len(texts), bool)


def _fault(column: Column, text: str) -> str:
    """What is wrong with a cell."""
    shown, unit = printable(text.strip(), 60), column.unit
    if column.key == STAMP and unit == DATE:
        return f"{shown!r} is no date and time in UTC, expected one such as 2026-03-01 09:00:00.001"
    if not shown:
        return f"empty, expected a time in {unit}"
    if is_number(text) and not math.isfinite(float(text)):
        return f"{shown} is no time, expected one in {unit}"
    if is_number(text):
        return f"{shown} {unit} is no time from 1902 to 2038; another unit (input.units.stamp)?"
    hint = "; a decimal comma?" if is_number(text.replace(",", ".", 1)) else ""
    if column.key == STAMP and dates([text])[1][0]:
        hint = f"; a date ({column.parameter.replace('columns', 'units')}: {DATE})?"
    return f"{shown!r} is not a number, expected one in {unit}{hint}"

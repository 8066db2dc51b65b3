"""Rows of tables: CSV, Parquet, arrays and data frames, read by pyarrow, as numbers in SI units."""

import io
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO, Any, Protocol

import attrs
import numpy as np
import pyarrow as pa
import pyarrow.compute
import pyarrow.csv
import pyarrow.parquet
from numpy.typing import NDArray

from leg_wear_monitor.errors import one_line, printable
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.config.tables import DATE, STAMPS
from leg_wear_monitor.recordings.findings import DamageError, Finding, RecordingError, check_size
from leg_wear_monitor.recordings.table_head import Head, head_of
from leg_wear_monitor.recordings.table_layout import (
    CSV,
    MOST_NS,
    PARQUET,
    STAMP,
    Column,
    Rows,
    columns_of,
    dates,
    is_number,
    places,
)

_ROWS = 65536
_Bools = NDArray[np.bool_]
_Stamps = NDArray[np.int64]


@attrs.frozen(eq=False)
class Part:
    """Some rows as the table has them.

    Attributes
    ----------
    line : (n,) array of int
        Line or row in the table, from 1.
    columns : list of pyarrow.Array
        Texts, numbers or dates (n,) of each column that is read. A null was not measured.
    stored : int
        Bytes that the rows occupy in the file.
    """

    line: NDArray[np.int64]
    columns: list[Any]
    stored: int


class Source(Protocol):
    """A table of any kind.

    Attributes
    ----------
    head : Head
        Names of all columns, and the text before the first row.
    size : int
        Bytes of the table.
    word : str
        Name of a row in messages: ``line`` or ``row``.
    """

    head: Head
    size: int
    word: str

    def parts(self, columns: list[int], lost: "Lost") -> Iterator[Part]:
        """Rows of the columns with these indices, part by part."""


class Lost:
    """Findings about rows that cannot be read: lists the first five, and counts the rest."""

    MOST = 5

    def __init__(self, path: Path, word: str, findings: list[Finding]) -> None:
        self._path, self._word, self._findings, self._count = path, word, findings, 0

    def add(self, lines: Sequence[int], fault: Callable[[int], str]) -> None:
        """Report rows, with the fault of each row by its index."""
        for k, line in enumerate(lines):
            if self._count + k >= self.MOST:
                break
            self.tell(f"{self._word} {line} is lost: {fault(k)}")
        self._count += len(lines)

    def tell(self, text: str) -> None:
        """Report a loss of any kind."""
        self._findings.append(Finding(self._path, text))

    def close(self) -> None:
        """Report how many rows are not listed."""
        if self._count > self.MOST:
            self.tell(f"{self._count - self.MOST} more {self._word}s are lost")


def open_table(path: Path, content: IO[bytes] | Any, storage: str, wanted: str = "") -> Source:
    """Open a table.

    Parameters
    ----------
    path : pathlib.Path
        Name of the table in errors.
    content : binary file, mapping of arrays or data frame
        A file is seekable.
    storage : str
        `CSV`, `PARQUET`, or empty for columns in memory.
    wanted : str
        Name of a column that identifies the line with the column names.

    Raises
    ------
    RecordingError
        If it is not a table of this kind.
    """
    if storage == CSV:
        return _Csv(path, content, wanted)
    return _Parquet(path, content) if storage == PARQUET else _Frame(path, content)


# Rows in SI units, from texts, numbers or dates.


class TableRows:
    """The columns of a table that the configuration names.

    Parameters
    ----------
    path : pathlib.Path
    source : Source
    config : MonitorConfig
    findings : list of Finding
        List that receives the findings.

    Raises
    ------
    RecordingError
        If a column is missing.
    """

    def __init__(self, path: Path, source: Source, config: MonitorConfig, findings: list[Finding]) -> None:
        self._path, self._source, self._table = path, source, config.table
        self._columns = columns_of(config)
        self._places = places(str(path), source.head.names, source.head.taken, self._columns)
        self._lost = Lost(path, source.word, findings)

    def parts(self) -> Iterator[Rows]:
        """All sound rows, part by part.

        Raises
        ------
        RecordingError
            If a column has neither numbers nor texts, or the time does not fit its unit.
        """
        for part in self._source.parts(self._places, self._lost):
            yield self._rows(part)
        self._lost.close()

    def _rows(self, part: Part) -> Rows:
        sound = np.ones(len(part.line), bool)
        values, measured = {}, {}
        stamps = self._regular(part.line)
        for column, array in zip(self._columns, part.columns, strict=True):
            if column.key == STAMP:
                stamps, good = self._stamps(column, array)
            else:
                found, there, good = self._numbers(column, array)
                values[column.key], measured[column.key] = column.to_si(found), there
            self._report(column, array, part.line, np.flatnonzero(sound & ~good))
            sound &= good
        rows = Rows(part.line, stamps, values, measured, part.stored)
        return rows if sound.all() else rows.part(sound)

    def _report(self, column: Column, array: Any, line: NDArray[np.int64], bad: NDArray[np.int64]) -> None:
        def fault(k: int) -> str:
            cell = array.slice(bad[k], 1)
            text = _text((cell if _is_text(array.type) else cell.cast(pa.string()))[0].as_py())
            return f"column {column.name!r}: {_fault(column, text)}"

        self._lost.add(line[bad].tolist(), fault)

    def _regular(self, line: NDArray[np.int64]) -> _Stamps:
        """Stamps of rows without a column of the time."""
        if not self._table.rate_hz:
            return line
        row = line - 1 - self._source.head.lines
        passed = np.rint(row * (1.0e9 / self._table.rate_hz)).astype(np.int64)
        return np.asarray(passed + self._table.start_ns)

    def _numbers(self, column: Column, array: Any) -> tuple[Floats, _Bools, _Bools]:
        """Numbers of cells, whether each cell has something, and whether that is a number or nothing."""
        array = array.cast(pa.float64()) if pa.types.is_null(array.type) else array
        kind = array.type
        if _is_text(kind):
            return numbers(self._with_points(array))
        if not (pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_boolean(kind)):
            fault = f"column {column.name!r} is of type {kind}, expected numbers"
            raise RecordingError(str(self._path), column.parameter, fault)
        there = np.asarray(array.is_valid())
        return _numpy(array.cast(pa.float64(), safe=False), np.nan), there, np.ones(len(array), bool)

    def _stamps(self, column: Column, array: Any) -> tuple[_Stamps, _Bools]:
        """Stamps [ns] of times, and whether each is one."""
        array = array.cast(pa.float64()) if pa.types.is_null(array.type) else array
        kind, unit = array.type, self._table.units.stamp
        if _is_text(kind):
            texts = [_text(text) for text in array.to_pylist()] if unit == DATE else []
            if unit == DATE:
                return dates(texts, self._table.date_format)
            return self._of_texts(self._with_points(array), 10 ** STAMPS[unit])
        is_date = pa.types.is_timestamp(kind) or pa.types.is_date(kind)
        if not (is_date or pa.types.is_integer(kind) or pa.types.is_floating(kind)):
            fault = f"column {column.name!r} is of type {kind}, expected numbers or dates"
            raise RecordingError(str(self._path), column.parameter, fault)
        if is_date != (unit == DATE):
            found = "dates" if is_date else "numbers"
            fault = f"{unit!r} does not fit column {column.name!r}, which has {found}"
            raise RecordingError(str(self._path), "table.units.stamp", fault)
        if is_date:
            return _of_dates(array)
        wide = array if kind == pa.uint64() else array.cast(_WIDE[pa.types.is_integer(kind)])
        stamps, within = self._of_numbers(_numpy(wide, 0), 10 ** STAMPS[unit])
        return stamps, within & np.asarray(array.is_valid())

    def _with_points(self, texts: Any) -> Any:
        """Texts of numbers with decimal points."""
        comma = self._source.head.has_decimal_comma
        return pa.compute.replace_substring(texts, ",", ".") if comma else texts

    def _of_numbers(self, times: NDArray[Any], scale: int) -> tuple[_Stamps, _Bools]:
        """Stamps of times in a unit of `scale` nanoseconds, exact to the precision of a double."""
        with np.errstate(invalid="ignore"):
            within = np.asarray((times <= MOST_NS // scale) & (times >= -(MOST_NS // scale)))
        times = np.where(within, times, 0)
        whole = times.astype(np.int64)
        # integers have no rest, and a double could not hold them
        rest = np.rint((times - whole) * scale).astype(np.int64) if times.dtype.kind == "f" else 0
        stamps = whole * scale + rest + self._table.start_ns
        return stamps, within & (np.abs(stamps) <= MOST_NS)

    def _of_texts(self, texts: Any, scale: int) -> tuple[_Stamps, _Bools]:
        """Stamps of times as texts; whole numbers are exact, a double of seconds since 1970 has 0.24 µs."""
        try:
            whole = texts.cast(pa.int64())
        except pa.ArrowInvalid:
            times, there, _ = numbers(texts)
            stamps, within = self._of_numbers(times, scale)
            return stamps, within & there
        stamps, within = self._of_numbers(_numpy(whole, 0), scale)
        return stamps, within & np.asarray(whole.is_valid())


_WIDE = {True: pa.int64(), False: pa.float64()}


def numbers(texts: Any) -> tuple[Floats, _Bools, _Bools]:
    """Numbers of cells of text.

    Parameters
    ----------
    texts : (n,) pyarrow.Array of binary or string

    Returns
    -------
    values : (n,) array
        Correctly rounded; NaN without a number.
    there : (n,) array of bool
        True if the cell is not empty.
    good : (n,) array of bool
        True if it is empty or has a number.
    """
    there = np.ones(len(texts), bool)
    try:
        return _numpy(texts.cast(pa.float64()), np.nan), there & texts.is_valid().to_numpy(False), there
    except pa.ArrowInvalid:
        values, good = np.full(len(texts), np.nan), there.copy()
    for k, cell in enumerate(texts.to_pylist()):
        text = _text(cell).strip()
        there[k] = bool(text)
        good[k] = not text or is_number(text)
        values[k] = float(text) if text and good[k] else np.nan
    return values, there, good


def _of_dates(array: Any) -> tuple[_Stamps, _Bools]:
    """Stamps [ns] of dates, and whether each is within the range of a stamp."""
    of = np.datetime64(0, "s")
    dated = array.cast(pa.timestamp(array.type.unit if pa.types.is_timestamp(array.type) else "s"))
    times = dated.to_numpy(zero_copy_only=False)
    seconds = (times.astype("datetime64[s]") - of).astype(np.int64)  # nanoseconds of any year would overflow
    good = ~np.isnat(times) & (np.abs(seconds) <= MOST_NS // 10**9)
    return np.where(good, times, of).astype("datetime64[ns]").astype(np.int64), np.asarray(good)


def _numpy(array: Any, nothing: float) -> NDArray[Any]:
    """Values of numbers, `nothing` where one is null."""
    return np.asarray(array.fill_null(nothing).to_numpy(zero_copy_only=False))


def _is_text(kind: Any) -> bool:
    return bool(pa.types.is_binary(kind) or pa.types.is_string(kind) or pa.types.is_large_string(kind))


def _text(cell: Any) -> str:
    """A cell as text; empty without a value."""
    if isinstance(cell, bytes):
        return cell.decode("utf-8", "replace")
    return "" if cell is None else str(cell)


def _fault(column: Column, text: str) -> str:
    """Description of the fault in a cell."""
    shown, unit = printable(text.strip(), 60), column.unit
    if column.key != STAMP:
        return f"{shown!r} is not a number. Expected a value in {unit}"
    if unit == DATE:
        return f"{shown!r} does not match table.date_format (default: 2026-03-01 09:00:00.001, in UTC)"
    hint = f". Set table.units.stamp to {DATE} if it is a date" if dates([text])[1][0] else ""
    return f"{shown!r} is not a time from 1902 to 2038 in {unit}{hint}"


# CSV files, by pyarrow: the cells stay texts, so that each fault has its line.


_BLOCK = 2**21
_UTF16_MARKS = b"\xff\xfe", b"\xfe\xff"


class _Lines(io.RawIOBase):
    """The complete lines of a file: a last line without a line break may be cut in a number."""

    def __init__(self, file: IO[bytes], end: int) -> None:
        self._file, self._end = file, end
        file.seek(0)

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: Any) -> int:
        data = self._file.read(min(len(buffer), self._end - self._file.tell()))
        buffer[: len(data)] = data
        return len(data)


def _end_of_lines(file: IO[bytes], size: int, block: int) -> int:
    """Offset behind the last line break of a file."""
    at = size
    while at:
        begin = max(0, at - block)
        file.seek(begin)
        if found := file.read(at - begin).rfind(b"\n") + 1:
            return begin + found
        at = begin
    return 0


def _decoded(data: bytes) -> str:
    """Text of a file: UTF-8, or the encoding of spreadsheets in Western Europe."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp1252", "replace")


class _Csv:
    word = "line"

    def __init__(self, path: Path, file: IO[bytes], wanted: str) -> None:
        self._file, self.size = file, file.seek(0, 2)
        self._end = _end_of_lines(file, self.size, _BLOCK)
        file.seek(0)
        start = file.read(_BLOCK)
        if not self.size:
            raise RecordingError(str(path), "", "is empty, expected a line with the names of the columns")
        if start.startswith(_UTF16_MARKS) or b"\0" in start:
            raise RecordingError(str(path), "", "is not a text in UTF-8, expected a CSV file in UTF-8")
        if b"\n" not in start:
            raise RecordingError(str(path), "", "has no complete line, expected the names of the columns")
        self.head = head_of(_decoded(start[: start.rindex(b"\n")]).split("\n"), wanted)

    def parts(self, columns: list[int], lost: Lost) -> Iterator[Part]:
        """Rows of some columns, as texts."""
        skipped: list[int] = []
        names = [str(k) for k in range(len(self.head.names))]
        wanted = [names[k] for k in columns]

        def skip(row: Any) -> str:
            skipped.append(row.number)
            if row.text.strip():
                more = row.actual_columns > row.expected_columns and self.head.separator == ","
                hint = "; decimal commas?" if more else ""
                if lines := row.text.count("\n"):
                    hint = f"; a quote has no end on its line, and takes {lines} lines with it"
                fault = f"{row.actual_columns} cells, expected {row.expected_columns}{hint}"
                lost.add([row.number], lambda _: fault)
            return "skip"

        reader = self._reader(names, wanted, skip)
        line, at = 1 + self.head.lines, 0
        try:
            for batch in reader:
                texts = [batch.column(name) for name in wanted]
                lines = line + np.arange(batch.num_rows + len(skipped))
                lines = np.setdiff1d(lines, skipped)[: batch.num_rows]
                line = int(lines[-1]) + 1 if len(lines) else line
                filled = np.any([np.asarray(pa.compute.binary_length(each)) > 0 for each in texts], axis=0)
                at, stored = self._file.tell(), self._file.tell() - at
                chosen = pa.array(filled)
                yield Part(lines[filled], [each.filter(chosen) for each in texts], stored)
        except pa.ArrowInvalid as error:
            lost.tell(f"all from line {line} on is lost: {one_line(error)}")
        if self._end < self.size:
            last = max([line, *(number + 1 for number in skipped)])
            lost.tell(f"line {last} is lost: it has no line break at its end, so it may be cut short")

    def _reader(self, names: list[str], wanted: list[str], skip: Any) -> Any:
        read = pyarrow.csv.ReadOptions(
            use_threads=False, block_size=_BLOCK, skip_rows=self.head.lines, column_names=names
        )
        parse = pyarrow.csv.ParseOptions(
            delimiter=self.head.separator, ignore_empty_lines=False, invalid_row_handler=skip
        )
        convert = pyarrow.csv.ConvertOptions(
            include_columns=wanted, column_types=dict.fromkeys(wanted, pa.binary())
        )
        return pyarrow.csv.open_csv(_Lines(self._file, self._end), read, parse, convert)


# Parquet files, by pyarrow: one group of rows at a time.


class _Parquet:
    word = "row"

    def __init__(self, path: Path, file: IO[bytes]) -> None:
        self.size = file.seek(0, 2)
        try:
            self._file = pyarrow.parquet.ParquetFile(file, page_checksum_verification=True)
            self.head = Head(list(self._file.schema_arrow.names))
        except (pa.ArrowException, OSError, UnicodeDecodeError) as error:
            fault = f"is not a readable Parquet file: {one_line(error)}"
            raise RecordingError(str(path), "", fault) from error

    def parts(self, columns: list[int], lost: Lost) -> Iterator[Part]:
        """Rows of some columns; the remaining rows of a damaged group are lost."""
        head, first = self._file.metadata, 0
        names = [self.head.names[k] for k in columns]
        for group in range(head.num_row_groups):
            end = first + head.row_group(group).num_rows
            at = first
            try:
                check_size(2 * _expanded_size(head.row_group(group), set(names)))
                for batch in self._file.iter_batches(_ROWS, row_groups=[group], columns=names):
                    row = at + 1 + np.arange(batch.num_rows)
                    stored = self.size * batch.num_rows // max(1, head.num_rows)
                    yield Part(row, [batch.column(name) for name in names], stored)
                    at += batch.num_rows
            except (DamageError, pa.ArrowException, OSError) as error:
                lost.tell(f"rows {at + 1} to {end} cannot be read: {one_line(error)}: they are lost")
            first = end


def _expanded_size(group: Any, names: set[str]) -> int:
    """Bytes of some columns in a group of rows."""
    columns = (group.column(k) for k in range(group.num_columns))
    return sum(one.total_uncompressed_size for one in columns if one.path_in_schema in names)


# Columns in memory: a mapping of arrays, or a data frame.


class _Frame:
    word = "row"

    def __init__(self, path: Path, table: Any) -> None:
        self._path, self._table = path, table if isinstance(table, Mapping) else _named(table)
        self.head = Head([str(name) for name in self._table])
        self.size = len(next(iter(self._table.values()), ()))  # number of rows, used to count progress

    def parts(self, columns: list[int], lost: Lost) -> Iterator[Part]:
        """Rows of some columns; NaN is null."""
        content = list(self._table.values())
        arrays = [self._array(self.head.names[k], content[k]) for k in columns]
        lengths = {self.head.names[k]: len(array) for k, array in zip(columns, arrays, strict=True)}
        if len(set(lengths.values())) > 1:
            words = ", ".join(f"{name} {length}" for name, length in lengths.items())
            raise RecordingError(str(self._path), "", f"has columns of different lengths: {words}")
        for begin in range(0, len(arrays[0]), _ROWS):
            chosen = [array[begin : begin + _ROWS] for array in arrays]
            yield Part(begin + 1 + np.arange(len(chosen[0])), chosen, len(chosen[0]))

    def _array(self, name: str, values: Any) -> Any:
        shape = np.shape(values)
        if len(shape) != 1:
            fault = f"column {name!r} has the shape {shape}, expected one number a row"
            raise RecordingError(str(self._path), "", fault)
        try:
            return pa.array(values, from_pandas=True)
        except (pa.ArrowException, TypeError) as error:
            fault = f"column {name!r} has neither numbers nor dates: {one_line(error)}"
            raise RecordingError(str(self._path), "", fault) from error


def _named(frame: Any) -> dict[str, Any]:
    """Columns of a data frame, its index among them if it has a name."""
    columns = {str(name): frame[name] for name in frame.columns}
    index: Any = getattr(frame, "index", None)  # pandas has one
    if getattr(index, "name", None) is not None:
        columns.setdefault(str(index.name), index)
    return columns

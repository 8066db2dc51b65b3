"""Tables as recordings: CSV and Parquet files, arrays and data frames, read by pyarrow into samples."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import IO, Any

import attrs
import numpy as np
import pyarrow as pa
import pyarrow.compute
import pyarrow.csv
import pyarrow.parquet
from numpy.typing import NDArray

from leg_wear_monitor.errors import one_line, printable
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.config import tables
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.config.tables import DATE, STAMPS
from leg_wear_monitor.recordings.cdr import MESSAGE
from leg_wear_monitor.recordings.findings import (
    CSV,
    PARQUET,
    Channel,
    Due,
    Finding,
    Piece,
    RecordingError,
    listed,
)
from leg_wear_monitor.recordings.streams import streams_of
from leg_wear_monitor.recordings.table_head import (
    CRANK_ANGLE,
    CRANK_SPEED,
    DRIVE_TORQUE,
    STAMP,
    Head,
    dates,
    head_of,
    is_date,
    is_number,
)
from leg_wear_monitor.twin import CRANK, LOAD, TORQUE
from leg_wear_monitor.twin.sample import (
    CONTACT,
    GAIT_SAMPLE,
    NO_FAULT,
    NO_LOAD,
    NOT_FINITE,
    WRENCH,
    Samples,
    gait_samples,
)

FOOT_LOAD, FOOT_LOAD_ALONG = "foot_load", "foot_load_along"
_KEYS = {CRANK: CRANK_ANGLE, TORQUE: DRIVE_TORQUE, LOAD: FOOT_LOAD}
"""Column whose values are samples, by the kind of the samples."""
_MOST_NS = (2**31 - 1) * 1_000_000_000  # the seconds of a ROS stamp are an int32: until 2038
_ROWS, _BLOCK_BYTES = 65536, 2**21
_MOST_LOST = 5  # largest number of findings about lost rows; further rows are only counted

_Bools = NDArray[np.bool_]
_Ints = NDArray[np.int64]


@attrs.frozen
class Column:
    """A column that is read.

    Attributes
    ----------
    key : str
        Meaning of the column: last part of the parameter, or the name of a further encoder.
    name : str
        Its name in the table.
    parameter : str
        Parameter that gives the name.
    unit : str
    scale : tuple of float
        Factor and divisor that convert to SI.
    """

    key: str
    name: str
    parameter: str
    unit: str
    scale: tuple[float, float] = (1.0, 1.0)

    def __str__(self) -> str:
        return f"from {self.name!r} in {self.unit}"


def columns_of(config: MonitorConfig) -> tuple[Column, ...]:
    """Columns to read; the time, if there is a column, comes first."""
    table, load = config.table, config.foot_load.source
    units = attrs.asdict(table.units)
    scales = {
        STAMP: (1.0, 1.0),
        CRANK_ANGLE: table.angle_scale,
        CRANK_SPEED: tables.SPEEDS[table.units.crank_speed],
        DRIVE_TORQUE: tables.TORQUES[table.units.drive_torque],
    }
    if load != NO_LOAD:
        scales[FOOT_LOAD] = (1.0, 1.0) if load == CONTACT else tables.FORCES[table.units.foot_load]
    if load == WRENCH:
        scales[FOOT_LOAD_ALONG] = scales[FOOT_LOAD]
        units[FOOT_LOAD_ALONG] = table.units.foot_load
    own = [
        Column(key, name, f"table.columns.{key}", units[key], scale)
        for key, scale in scales.items()
        if (name := getattr(table.columns, key)) and not (key == STAMP and table.rate_hz)
    ]
    further = [
        Column(name, name, "encoders.names", table.units.crank_angle, table.angle_scale)
        for name in config.encoders.names
    ]
    return (*own, *further)


# Tables of any kind: `names` has the names of the columns, `batches` gives the rows.


Batch = tuple[_Ints, list[Any], int]
"""Some rows as the table has them.

Lines or rows in the table (n,), from 1; texts, numbers or dates (n,) of each column that is read, where a
null was not measured; bytes that the rows occupy in the file.
"""


class Table:
    """Columns in memory: a mapping of arrays, or a data frame.

    Parameters
    ----------
    path : pathlib.Path
        Name of the table in findings and errors.
    content : mapping of arrays or data frame

    Attributes
    ----------
    head : Head
    size : int
        Bytes of the table, or another number to which those of the batches sum up.
    findings : list of Finding
        Faults of the table.

    Raises
    ------
    RecordingError
        If it is not a table of this kind.
    """

    word = "row"

    def __init__(self, path: Path, content: Any) -> None:
        self.path, self.findings, self._lost = path, list[Finding](), 0
        self._open(content)

    def _open(self, content: Any) -> None:
        if not isinstance(content, Mapping):
            frame = content
            content = {str(name): frame[name] for name in frame.columns}
            index: Any = getattr(frame, "index", None)  # pandas has one
            if getattr(index, "name", None) is not None:
                content.setdefault(str(index.name), index)
        self._content = {str(name): column for name, column in content.items()}
        self.head = Head(list(self._content))
        self.size = self._rows = next(map(len, self._content.values()), 0)

    def batches(self, columns: Sequence[int]) -> Iterator[Batch]:
        """Rows of the columns with these indices."""
        names, at = [self.head.names[k] for k in columns], 0
        try:
            for batch in self._read(names):
                stored = self.size * batch.num_rows // max(1, self._rows)
                yield at + 1 + np.arange(batch.num_rows), [batch.column(name) for name in names], stored
                at += batch.num_rows
        except (pa.ArrowException, OSError) as error:
            self.lose(f"all from row {at + 1} on is lost: {one_line(error)}")

    def _read(self, names: list[str]) -> Iterator[Any]:
        try:
            arrays = [pa.array(self._content[name], from_pandas=True) for name in names]
            return iter(pa.Table.from_arrays(arrays, names).to_batches(_ROWS))
        except (pa.ArrowException, TypeError) as error:
            fault = f"has a column without numbers or dates, or of a different length: {one_line(error)}"
            raise RecordingError(str(self.path), "", fault) from error

    def lose(self, text: str) -> None:
        """Report lost rows."""
        self.findings.append(Finding(self.path, text))

    def lose_row(self, line: int, fault: str) -> None:
        """Report a lost row."""
        self._lost += 1
        if self._lost <= _MOST_LOST:
            self.lose(f"{self.word} {line} is lost: {fault}")

    def close(self) -> None:
        """Report how many lost rows are not listed."""
        if self._lost > _MOST_LOST:
            self.lose(f"{self._lost - _MOST_LOST} more {self.word}s are lost")


class CsvTable(Table):
    """A CSV file; the cells stay texts, so that each fault has its line."""

    word = "line"

    def __init__(self, path: Path, content: Any, wanted: str) -> None:
        self._wanted = wanted
        super().__init__(path, content)

    def _open(self, content: Any) -> None:
        self._file, self.size = content, content.seek(0, 2)
        self._file.seek(0)
        start = self._file.read(_BLOCK_BYTES)
        if len(start) < self.size:
            start = start[: start.rfind(b"\n") + 1]
        if not start.strip():
            raise RecordingError(
                str(self.path), "", "is empty. Expected a line with the names of the columns"
            )
        if b"\0" in start:  # as in UTF-16
            raise RecordingError(str(self.path), "", "is not a text in UTF-8. Expected a CSV file in UTF-8")
        self._encoding = "utf8"
        try:
            lines = start.decode("utf-8-sig")
        except UnicodeDecodeError:  # a spreadsheet in Western Europe
            self._encoding, lines = "cp1252", start.decode("cp1252", "replace")
        self.head = head_of(lines.split("\n"), self._wanted)

    def batches(self, columns: Sequence[int]) -> Iterator[Batch]:
        """Rows of some columns, as texts; an empty cell is null."""
        skipped: list[int] = []

        def skip(row: Any) -> str:
            skipped.append(row.number)
            if row.text.strip():
                more = row.actual_columns > row.expected_columns and self.head.separator == ","
                hint = "; decimal commas?" if more else ""
                self.lose_row(
                    row.number, f"{row.actual_columns} cells. Expected {row.expected_columns}{hint}"
                )
            return "skip"

        names, line, at = [str(k) for k in range(len(self.head.names))], 1 + self.head.lines, 0
        self._file.seek(0)
        try:
            for batch in self._reader(names, [names[k] for k in columns], skip):
                lines = line + np.arange(batch.num_rows + len(skipped))
                lines = np.setdiff1d(lines, skipped)[: batch.num_rows] if skipped else lines
                line = int(lines[-1]) + 1 if len(lines) else line
                filled = np.any([np.asarray(column.is_valid()) for column in batch.columns], axis=0)
                chosen = [column.filter(pa.array(filled)) for column in batch.columns]
                at, stored = self._file.tell(), self._file.tell() - at
                yield lines[filled], chosen, stored
        except pa.ArrowInvalid as error:
            self.lose(f"all from line {line} on is lost: {one_line(error)}")

    def _reader(self, names: list[str], wanted: list[str], skip: Callable[[Any], str]) -> Any:
        read = pyarrow.csv.ReadOptions(
            use_threads=False,
            block_size=_BLOCK_BYTES,
            skip_rows=self.head.lines,
            column_names=names,
            encoding=self._encoding,
        )
        parse = pyarrow.csv.ParseOptions(
            delimiter=self.head.separator, ignore_empty_lines=False, invalid_row_handler=skip
        )
        convert = pyarrow.csv.ConvertOptions(
            include_columns=wanted,
            column_types=dict.fromkeys(wanted, pa.string()),
            null_values=[""],
            strings_can_be_null=True,
        )
        return pyarrow.csv.open_csv(self._file, read, parse, convert)


class ParquetTable(Table):
    """A Parquet file."""

    def _open(self, content: Any) -> None:
        self.size = content.seek(0, 2)
        try:
            self._file = pyarrow.parquet.ParquetFile(content, page_checksum_verification=True)
            self.head = Head(list(self._file.schema_arrow.names))
        except (pa.ArrowException, OSError, UnicodeDecodeError) as error:
            fault = f"is not a readable Parquet file: {one_line(error)}"
            raise RecordingError(str(self.path), "", fault) from error
        self._rows = self._file.metadata.num_rows

    def _read(self, names: list[str]) -> Iterator[Any]:
        return iter(self._file.iter_batches(_ROWS, columns=names))


def open_table(path: Path, content: IO[bytes] | Any, storage: str, wanted: str) -> Table:
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
        return CsvTable(path, content, wanted)
    return ParquetTable(path, content) if storage == PARQUET else Table(path, content)


# Rows in SI units, from texts, numbers or dates.


@attrs.frozen(eq=False)
class Rows:
    """Sound rows of a table, in SI units.

    Attributes
    ----------
    stamp_ns : (n,) array of int
    values : dict
        Values (n,) by the column's key; NaN where nothing was measured.
    measured : dict
        True if a value was measured (n,), by the column's key: an empty cell was not, a NaN was.
    stored : int
        Bytes that the rows occupy in the file.
    """

    stamp_ns: _Ints
    values: dict[str, Floats]
    measured: dict[str, _Bools]
    stored: int


def _rows(table: Table, columns: Sequence[Column], config: MonitorConfig) -> Iterator[Rows]:
    """Rows that the configuration can read; lines with a faulty cell become findings."""
    places = [_place(table, column) for column in columns]
    for line, read, stored in table.batches(places):
        sound = np.ones(len(line), bool)
        stamps, values, measured = _regular(table, line, config), {}, {}
        for column, cells in zip(columns, read, strict=True):
            array = _checked(table, column, cells)
            if column.key == STAMP:
                stamps, good = _stamps(array, column.unit, config.table)
            else:
                found, there, good = _numbers(array)
                factor, divisor = column.scale
                values[column.key], measured[column.key] = found * factor / divisor, there
            for k in np.flatnonzero(sound & ~good).tolist():
                table.lose_row(int(line[k]), f"column {column.name!r}: {_fault(column, array[k])}")
            sound &= good
        yield Rows(
            stamps[sound],
            {key: column[sound] for key, column in values.items()},
            {key: column[sound] for key, column in measured.items()},
            stored,
        )
    table.close()


def _place(table: Table, column: Column) -> int:
    """Index of a column among the names of a table."""
    names = table.head.names
    if names.count(column.name) != 1:
        what = "occurs more than once" if column.name in names else "does not exist"
        may_be_none = column.key in (CRANK_SPEED, DRIVE_TORQUE, FOOT_LOAD, FOOT_LOAD_ALONG)
        nothing = ', or "" if there is none' if may_be_none else ""
        line = f"; {table.head.taken} was read as the names" if table.head.taken else ""
        fault = f"column {column.name!r} {what}{line}. Expected one of: {listed(names)}{nothing}"
        remedy = f"'leg-wear-monitor check {table.path}' proposes the parameters"
        raise RecordingError(str(table.path), column.parameter, f"{fault}. {remedy}")
    return names.index(column.name)


def _regular(table: Table, line: _Ints, config: MonitorConfig) -> _Ints:
    """Stamps of rows without a column of the time."""
    if not config.table.rate_hz:
        return line
    passed = np.rint((line - 1 - table.head.lines) * (1.0e9 / config.table.rate_hz))
    return np.asarray(passed.astype(np.int64) + config.table.start_ns)


def _checked(table: Table, column: Column, array: Any) -> Any:
    """Cells of a column with an accepted type; texts of numbers get decimal points."""
    if pa.types.is_null(array.type):
        array = array.cast(pa.float64())
    if pa.types.is_large_string(array.type):
        array = array.cast(pa.string())
    kind, is_date = array.type, column.unit == DATE
    if pa.types.is_string(kind):
        comma = table.head.has_decimal_comma and not is_date
        return pa.compute.replace_substring(array, ",", ".") if comma else array
    if is_date:
        fits = pa.types.is_timestamp(kind) or pa.types.is_date(kind)
    else:
        fits = pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_boolean(kind)
    if not fits:
        what = f"dates, as table.units.stamp is {DATE!r}" if is_date else f"numbers in {column.unit}"
        fault = f"column {column.name!r} is of type {kind}. Expected {what}"
        raise RecordingError(str(table.path), column.parameter, fault)
    return array


def _numbers(array: Any) -> tuple[Floats, _Bools, _Bools]:
    """Numbers of cells, whether each cell has something, and whether that is a number or nothing."""
    there, good = np.array(array.is_valid()), np.ones(len(array), bool)
    try:
        return _numpy(array.cast(pa.float64(), safe=False), np.nan), there, good
    except pa.ArrowInvalid:
        values = np.full(len(array), np.nan)
    for k, cell in enumerate(array.to_pylist()):
        text = (cell or "").strip()
        there[k], good[k] = bool(text), not text or is_number(text)
        values[k] = float(text) if text and good[k] else np.nan
    return values, there, good


def _stamps(array: Any, unit: str, table: tables.TableInput) -> tuple[_Ints, _Bools]:
    """Stamps [ns] of times, exact to the precision of a double, and whether each is one."""
    kind = array.type
    if unit == DATE:
        if pa.types.is_string(kind):
            return dates([text or "" for text in array.to_pylist()], table.date_format)
        times = array.cast(pa.timestamp(getattr(kind, "unit", "s"))).to_numpy(zero_copy_only=False)
        seconds = times.astype("datetime64[s]").astype(np.int64)  # nanoseconds of any year would overflow
        good = ~np.isnat(times) & (np.abs(seconds) <= _MOST_NS // 10**9)
        return np.where(good, times, np.datetime64(0, "s")).astype("datetime64[ns]").astype(np.int64), good
    if pa.types.is_string(kind):
        try:
            array = array.cast(pa.int64())  # exact: a double of seconds since 1970 has 0.24 µs
        except pa.ArrowInvalid:
            array = pa.array(_numbers(array)[0], from_pandas=True)
    elif not pa.types.is_uint64(kind):
        array = array.cast(pa.int64() if pa.types.is_integer(kind) else pa.float64())
    times, scale = _numpy(array, 0), 10 ** STAMPS[unit]
    with np.errstate(invalid="ignore"):
        good = np.asarray(array.is_valid()) & (np.abs(times.astype(float)) <= _MOST_NS // scale)
    times = np.where(good, times, 0)
    whole = times.astype(np.int64)
    # integers have no rest, and a double could not hold them
    rest = np.rint((times - whole) * scale).astype(np.int64) if times.dtype.kind == "f" else 0
    stamps = whole * scale + rest + table.start_ns
    return stamps, good & (np.abs(stamps) <= _MOST_NS)


def _numpy(array: Any, nothing: float) -> NDArray[Any]:
    """Values of numbers, with `nothing` for null."""
    return np.asarray(array.fill_null(nothing).to_numpy(zero_copy_only=False))


def _fault(column: Column, cell: Any) -> str:
    """Description of the fault in a cell."""
    text = str(cell.as_py() if cell.is_valid else "").strip()
    shown, unit = printable(text, 60), column.unit
    if column.key != STAMP:
        return f"{shown!r} is not a number. Expected a value in {unit}"
    if unit == DATE:
        return f"{shown!r} does not match table.date_format (default: 2026-03-01 09:00:00.001, in UTC)"
    hint = f". Set table.units.stamp to {DATE} if it is a date" if is_date(text) else ""
    return f"{shown!r} is not a time from 1902 to 2038 in {unit}{hint}"


# One table as a file of a recording: its rows are the samples that a decoder would make of messages.


class TableFile:
    """An open table.

    Parameters
    ----------
    path : pathlib.Path
        Name of the table in findings and errors.
    content : binary file, mapping of arrays or data frame
    storage : str
        `CSV`, `PARQUET`, or empty for columns in memory.
    config : MonitorConfig
        Names the columns and their units.

    Attributes
    ----------
    columns : tuple of Column
    others : list of str
        Names of the columns that are not read.
    rows : iterator of Rows
        All sound rows, once.

    Raises
    ------
    RecordingError
        If a column is missing, or no row can be read.
    """

    def __init__(self, path: Path, content: IO[bytes] | Any, storage: str, config: MonitorConfig) -> None:
        self.path, self._config = path, config
        table = open_table(path, content, storage, config.table.columns.crank_angle)
        self.size, self.findings = table.size, table.findings
        self.columns = columns_of(config)
        read = {column.name for column in self.columns}
        self.others = [name for name in table.head.names if name not in read]
        rows = _rows(table, self.columns, config)
        first = next((part for part in rows if len(part.stamp_ns)), None)
        if first is None:
            why = next((f"; {finding.text}" for finding in self.findings), "")
            raise RecordingError(str(path), "", f"has no row that can be read{why}")
        self.rows = chain([first], rows)
        self._last_ns = self._last_stamp_ns = int(first.stamp_ns[0])
        keys = {column.key for column in self.columns}
        self._has_effort = DRIVE_TORQUE in keys and config.drive_torque.source == "effort"
        self._streams = {
            1 + stream.kind: stream
            for stream in streams_of(config)
            if _KEYS[stream.kind] in keys and not (stream.kind == TORQUE and self._has_effort)
        }

    @property
    def channels(self) -> dict[int, Channel]:
        """Channels by channel number."""
        return {number: Channel(f"/{one.topic}", one.type) for number, one in self._streams.items()}

    def pieces(self, types: dict[int, int]) -> Iterator[Due]:
        """Pieces of the requested channels, once; lines that cannot be read become findings.

        Parameters
        ----------
        types : dict
            Stream code by channel number.
        """
        is_over = False

        def load() -> Piece | None:
            nonlocal is_over
            rows = next(self.rows, None)
            is_over = rows is None
            return None if rows is None else self._piece(rows, types)

        while not is_over:
            yield self._last_ns, load

    def _piece(self, rows: Rows, types: dict[int, int]) -> Piece:
        """Samples of rows in their order; of a row, the crank's comes before the torque's and the load's."""
        log_time_ns, start_ns = self._log_time_ns(rows.stamp_ns), self._last_ns
        parts = []
        for number, code in types.items():
            row = np.flatnonzero(rows.measured[_KEYS[self._streams[number].kind]])
            stamps = rows.stamp_ns if self._streams[number].has_stamp else log_time_ns
            messages = np.zeros(len(row), MESSAGE)
            messages["log_time_ns"] = log_time_ns[row]
            messages["type"] = code
            parts.append((row, self._samples(self._streams[number].kind, rows, row, stamps[row]), messages))
        if not parts:
            return Piece(start_ns, _NO_DATA, np.zeros(0, MESSAGE), rows.stored, np.zeros(0, GAIT_SAMPLE))
        places, samples, heads = zip(*parts, strict=True)
        order = np.argsort(np.concatenate(places), kind="stable")
        return Piece(start_ns, _NO_DATA, _in_order(heads, order), rows.stored, _in_order(samples, order))

    def _log_time_ns(self, stamp_ns: _Ints) -> _Ints:
        """Times that keep the rows in order: the stamps, but where a stamp goes back, the time stands."""
        steps = np.diff(stamp_ns, prepend=self._last_stamp_ns)
        times = self._last_ns + np.cumsum(np.maximum(steps, 0))
        if len(times):
            self._last_ns, self._last_stamp_ns = int(times[-1]), int(stamp_ns[-1])
        return np.asarray(times, np.int64)

    def _samples(self, kind: int, rows: Rows, row: _Ints, stamp_ns: _Ints) -> Samples:
        """Samples of one kind as messages have them, without sign, scale and offset."""
        values = {key: column[row] for key, column in rows.values.items()}
        if kind == TORQUE:
            torque = values[DRIVE_TORQUE]
            return gait_samples(stamp_ns, kind, torque_nm=torque, fault=_fault_of(np.isfinite(torque)))
        if kind == LOAD:
            up, along = values[FOOT_LOAD], values.get(FOOT_LOAD_ALONG, np.zeros(len(row)))
            up = (up != 0.0).astype(float) if self._config.foot_load.source == CONTACT else up
            force = np.column_stack([along, up])
            fault = _fault_of(np.isfinite(force).all(axis=1))
            return gait_samples(stamp_ns, kind, foot_force_n=force, fault=fault)
        angle, absent = values[CRANK_ANGLE], np.full(len(row), np.nan)
        speed = values.get(CRANK_SPEED, absent)
        torque = values[DRIVE_TORQUE] if self._has_effort else absent
        good = np.isfinite(angle) & ~np.isinf(speed) & ~np.isinf(torque)
        further = self._config.encoders.names
        encoders = np.full((len(row), max(1, len(further))), np.nan)
        for k, name in enumerate(further):
            is_wrong = rows.measured[name][row] & ~np.isfinite(values[name])
            encoders[good, k] = np.where(is_wrong, np.inf, values[name])[good]
        return gait_samples(
            stamp_ns,
            kind,
            crank_angle_rad=angle,
            crank_velocity_radps=speed,
            torque_nm=torque,
            encoder_rad=encoders,
            fault=_fault_of(good),
        )


_NO_DATA = np.zeros(0, np.uint8)


def _in_order(parts: Sequence[NDArray[Any]], order: _Ints) -> NDArray[Any]:
    """Records of all parts in an order; copied as bytes, because numpy copies each field on its own."""
    as_bytes = np.dtype((np.void, parts[0].itemsize))
    return np.concatenate([part.view(as_bytes) for part in parts])[order].view(parts[0].dtype)


def _fault_of(good: _Bools) -> NDArray[np.int64]:
    return np.where(good, NO_FAULT, NOT_FINITE)

"""Parquet files, page by page."""

from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.bags.budget import Budget
from leg_wear_monitor.bags.findings import DamageError, Finding, RecordingError, Severity
from leg_wear_monitor.bags.table_layout import LostLines, Rows, columns_of, places
from leg_wear_monitor.bags.table_rows import check_kind, rows_of
from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.monitor.config.settings import MonitorConfig

# Pages of a Parquet column, by their headers: how many rows there are, whatever the footer claims.
#
# A header is a struct in Thrift's compact protocol; the numbers of fields and types are those of
# https://github.com/apache/parquet-format/blob/master/src/main/thrift/parquet.thrift.


_WINDOW = 2**14  # bytes; the header of a page of numbers has about a hundred
_TRUE, _BYTE, _DOUBLE, _BINARY, _LIST, _SET, _STRUCT = 1, 3, 7, 8, 9, 10, 12
_INTEGERS = (4, 5, 6)
_UNCOMPRESSED, _COMPRESSED, _CHECKSUM, _DATA, _DATA_V2 = 2, 3, 4, 5, 8  # fields of a PageHeader
_VALUES = 1  # field of either header of data
_DEEPEST = 8


def pages_of(file: IO[bytes], begin: int, stored: int, most: int) -> tuple[int, int, bool]:
    """Pages of a column in a row group.

    Parameters
    ----------
    file : binary file
    begin, stored : int
        Offset and size of the column [bytes].
    most : int
        Values that are expected; there cannot be many more pages.

    Returns
    -------
    values : int
        With nulls: a value a row, if the column is no list.
    size : int
        Uncompressed [bytes].
    are_checked : bool
        Whether each has a checksum.

    Raises
    ------
    DamageError
        If the pages do not fill the column's bytes.
    """
    values, size, at, number, are_checked = 0, 0, begin, 0, True
    while at < begin + stored:
        number += 1
        file.seek(at)
        try:
            window = _Compact(file.read(_WINDOW))
            head = window.struct()
            compressed, expanded = int(head[_COMPRESSED]), int(head[_UNCOMPRESSED])
            data = head.get(_DATA) or head.get(_DATA_V2) or {}
            found = int(data.get(_VALUES, 0))
        except (IndexError, KeyError, TypeError, AttributeError) as error:
            raise DamageError(f"has no page at byte {at}") from error
        if min(compressed, expanded, found) < 0 or number > most + 2:
            raise DamageError(f"has no page at byte {at}")
        are_checked &= _CHECKSUM in head
        values, size, at = values + found, size + expanded, at + window.at + compressed
    if at != begin + stored:
        raise DamageError("has pages beyond its end")
    return values, size, are_checked


class _Compact:
    """Reader of values in Thrift's compact protocol; raises IndexError at the end of its bytes."""

    def __init__(self, data: bytes) -> None:
        self._data, self.at = data, 0

    def struct(self, depth: int = 0) -> dict[int, Any]:
        """Values by the numbers of their fields."""
        found: dict[int, Any] = {}
        field = 0
        while head := self._byte():
            field = field + (head >> 4) if head >> 4 else self._integer()
            kind = head & 15
            found[field] = kind == _TRUE if kind in (1, 2) else self._value(kind, depth + 1)
        return found

    def _value(self, kind: int, depth: int) -> Any:
        if depth > _DEEPEST:
            raise IndexError(depth)
        if kind in (1, 2, _BYTE):
            return self._byte()
        if kind in _INTEGERS:
            return self._integer()
        if kind == _STRUCT:
            return self.struct(depth)
        if kind in (_LIST, _SET):
            head = self._byte()
            return [
                self._value(head & 15, depth + 1) for _ in range(head >> 4 if head < 0xF0 else self._number())
            ]
        if kind not in (_DOUBLE, _BINARY):
            raise IndexError(kind)
        size = 8 if kind == _DOUBLE else self._number()
        self.at += size
        return self._data[self.at - size : self.at]

    def _byte(self) -> int:
        self.at += 1
        return self._data[self.at - 1]

    def _number(self) -> int:
        number, shift = 0, 0
        while True:
            byte = self._byte()
            number |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                return number

    def _integer(self) -> int:
        number = self._number()
        return (number >> 1) ^ -(number & 1)


# Parquet files, by pyarrow: one group of rows at a time.


_ROWS = 65536
# memory of the parsed footer per byte, at worst: a column of no more than a start has 3 bytes
_OF_A_FOOTER = 400
_MOST_ROWS = 2**53
_NO_CHECKSUMS = "has pages without checksums: a damaged number in them would not be detected"


class ParquetFile:
    """An open Parquet file.

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
        If the file is no Parquet file, or lacks a column.
    LegWearError
        If pyarrow is not installed.
    """

    def __init__(
        self, path: Path, file: IO[bytes], config: MonitorConfig, budget: Budget, findings: list[Finding]
    ) -> None:
        try:
            import pyarrow
            import pyarrow.parquet
        except ModuleNotFoundError as error:
            text = (
                "Parquet files need pyarrow, which is not installed; pip install 'leg_wear_monitor[parquet]'"
            )
            raise LegWearError(text) from error
        self._damage = (pyarrow.ArrowException, OSError, UnicodeDecodeError)
        self._path, self._config, self._budget, self._findings = path, config.input, budget, findings
        self._lost = LostLines(path, findings, "row")
        self._are_checked = True
        self._content, self.size = file, file.seek(0, 2)
        try:
            _check_footer(file, self.size, budget)
            self._file = pyarrow.parquet.ParquetFile(file, memory_map=False, page_checksum_verification=True)
            schema = self._file.schema_arrow
            self.names = list(schema.names)
            self._rows = self._checked_rows()
        except (*self._damage, DamageError) as error:
            why = "a name is not UTF-8" if isinstance(error, UnicodeDecodeError) else _one_line(error)
            raise RecordingError(str(path), "", f"is not a readable Parquet file: {why}") from error
        self._columns = columns_of(config)
        self._places = places(str(path), self.names, self._columns)
        for column, place in zip(self._columns, self._places, strict=True):
            kind = _kind(schema.field(place).type)
            check_kind(str(path), column, kind, str(schema.field(place).type), config.input)

    def parts(self) -> Iterator[Rows]:
        """All sound rows, block by block."""
        first, total = 0, max(1, sum(self._rows))
        for group, rows in enumerate(self._rows):
            try:
                yield from self._group(group, first, self.size / total)
            except DamageError as error:
                self._find(first, rows, str(error))
            except self._damage as error:
                self._find(first, rows, f"cannot be read: {_one_line(error)}")
            first += rows
        self._lost.close()
        if not self._are_checked:
            self._findings.append(Finding(self._path, _NO_CHECKSUMS, Severity.NOTE))

    def _group(self, group: int, first: int, stored: float) -> Iterator[Rows]:
        """Rows of a group."""
        self._check_pages(group)
        names = [column.name for column in self._columns]
        for batch in self._file.iter_batches(_ROWS, row_groups=[group], columns=names):
            arrays = {one.key: batch.column(one.name) for one in self._columns}
            there = {key: _is_there(array) for key, array in arrays.items()}
            values = {key: _values(array) for key, array in arrays.items()}
            size = int(stored * batch.num_rows)
            yield rows_of(self._columns, values, there, first, size, self._config, self._lost)
            first += batch.num_rows

    def _checked_rows(self) -> list[int]:
        """Rows of each group, of which the footer declares the sum.

        Raises
        ------
        DamageError
        """
        head = self._file.metadata
        rows = [head.row_group(group).num_rows for group in range(head.num_row_groups)]
        if head.num_rows != sum(rows) or min(rows, default=0) < 0:
            raise DamageError(f"it declares {head.num_rows} rows, and {sum(rows)} in its row groups")
        if head.num_rows > _MOST_ROWS:
            raise DamageError(f"it declares {head.num_rows} rows, expected at most {_MOST_ROWS}")
        return rows

    def _check_pages(self, group: int) -> None:
        """Check that group, columns and pages have the same number of rows, and fit into memory.

        Raises
        ------
        DamageError
        """
        head, size = self._file.metadata.row_group(group), 0
        if head.num_columns != self._file.metadata.num_columns:  # pyarrow ends the process beyond
            raise DamageError(f"the row group has {head.num_columns} columns, and the file another number")
        wanted = {column.name for column in self._columns}
        for column in (head.column(k) for k in range(head.num_columns)):
            if column.path_in_schema not in wanted:
                continue
            starts = (column.dictionary_page_offset, column.data_page_offset)
            begin = min(start for start in starts if start)
            stored = column.total_compressed_size
            values, expanded, are_checked = pages_of(self._content, begin, stored, head.num_rows)
            if not values == column.num_values == head.num_rows:
                text = f"column {column.path_in_schema!r} has {values} rows in its pages"
                declared = f"the footer declares {column.num_values} and {head.num_rows}"
                raise DamageError(f"{text}, of which {declared}")
            self._are_checked &= are_checked
            size += max(expanded, column.total_uncompressed_size)
        self._budget.check(2 * size)

    def _find(self, first: int, rows: int, fault: str) -> None:
        text = f"rows {first + 1} to {first + rows}: {fault}: what of them was not read yet is lost"
        self._findings.append(Finding(self._path, text))


def _check_footer(file: IO[bytes], size: int, budget: Budget) -> None:
    """Check that the parsed footer fits into memory; whether it is one is for pyarrow to say.

    Raises
    ------
    DamageError
    """
    file.seek(max(0, size - 8))
    declared = int.from_bytes(file.read(4), "little")
    budget.check(_OF_A_FOOTER * min(declared, size))


def _kind(of: Any) -> str:
    """Kind of a type as numpy names it."""
    try:
        return str(np.dtype(of.to_pandas_dtype()).kind)
    except (NotImplementedError, TypeError):
        return "M" if str(of).startswith("timestamp") else "O"


def _is_there(array: Any) -> NDArray[np.bool_]:
    return np.asarray(array.is_valid().to_numpy(zero_copy_only=False))


def _values(array: Any) -> NDArray[Any]:
    """Values of a column; anything where there is none."""
    if str(array.type).startswith("timestamp"):
        unit = array.type.unit
        return np.asarray(array.view("int64").fill_null(0).to_numpy(zero_copy_only=False)).view(f"M8[{unit}]")
    return np.asarray(array.fill_null(0).to_numpy(zero_copy_only=False))


def _one_line(error: BaseException) -> str:
    return " ".join(str(error).split())[:200]

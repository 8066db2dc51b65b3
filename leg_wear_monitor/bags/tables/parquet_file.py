"""Parquet files, by pyarrow: one group of rows at a time."""

from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.bags.budget import Budget
from leg_wear_monitor.bags.findings import DamageError, Finding, RecordingError
from leg_wear_monitor.bags.tables.arrays import check_kind, rows_of
from leg_wear_monitor.bags.tables.damage import LostLines
from leg_wear_monitor.bags.tables.layout import Rows, columns_of, places
from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.monitor.config.settings import MonitorConfig

_ROWS = 65536


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
        self._damage = (pyarrow.ArrowException, OSError)
        self._path, self._config, self._budget, self._findings = path, config.input, budget, findings
        self._lost = LostLines(path, findings, "row")
        self.size = file.seek(0, 2)
        try:
            self._file = pyarrow.parquet.ParquetFile(file, memory_map=False)
        except self._damage as error:
            fault = f"is not a readable Parquet file: {_one_line(error)}"
            raise RecordingError(str(path), "", fault) from error
        schema = self._file.schema_arrow
        self.names = list(schema.names)
        self._columns = columns_of(config)
        self._places = places(str(path), self.names, self._columns)
        for column, place in zip(self._columns, self._places, strict=True):
            kind = _kind(schema.field(place).type)
            check_kind(str(path), column, kind, str(schema.field(place).type), config.input)

    def parts(self) -> Iterator[Rows]:
        """All sound rows, block by block."""
        first, total = 0, max(1, self._file.metadata.num_rows)
        for group in range(self._file.metadata.num_row_groups):
            rows = self._file.metadata.row_group(group).num_rows
            try:
                yield from self._group(group, first, self.size / total)
            except DamageError as error:
                self._find(first, rows, str(error))
            except self._damage as error:
                self._find(first, rows, f"cannot be read: {_one_line(error)}")
            first += rows
        self._lost.close()

    def _group(self, group: int, first: int, stored: float) -> Iterator[Rows]:
        """Rows of a group."""
        head = self._file.metadata.row_group(group)
        sizes = {
            head.column(k).path_in_schema: head.column(k).total_uncompressed_size
            for k in range(head.num_columns)
        }
        self._budget.check(2 * sum(sizes.get(column.name, 0) for column in self._columns))
        names = [column.name for column in self._columns]
        for batch in self._file.iter_batches(_ROWS, row_groups=[group], columns=names):
            arrays = {one.key: batch.column(one.name) for one in self._columns}
            there = {key: _is_there(array) for key, array in arrays.items()}
            values = {key: _values(array) for key, array in arrays.items()}
            size = int(stored * batch.num_rows)
            yield rows_of(self._columns, values, there, first, size, self._config, self._lost)
            first += batch.num_rows

    def _find(self, first: int, rows: int, fault: str) -> None:
        text = f"rows {first + 1} to {first + rows}: {fault}: what of them was not read yet is lost"
        self._findings.append(Finding(self._path, text))


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

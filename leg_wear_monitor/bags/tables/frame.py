"""Columns in memory: a mapping of arrays, or a data frame."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.bags.findings import Finding, RecordingError
from leg_wear_monitor.bags.tables.arrays import check_kind, rows_of
from leg_wear_monitor.bags.tables.damage import LostLines
from leg_wear_monitor.bags.tables.layout import Column, Rows, columns_of, places
from leg_wear_monitor.monitor.config.settings import MonitorConfig

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
        self._config, self._lost = config.input, LostLines(path, findings, "row")
        self._columns = columns_of(config)
        content = table if isinstance(table, Mapping) else _named(table)
        self.names = [str(name) for name in content]
        places(str(path), self.names, self._columns)
        self._arrays = {one.key: self._array(path, one, content[one.name]) for one in self._columns}
        lengths = {one.name: len(self._arrays[one.key]) for one in self._columns}
        self._rows = next(iter(lengths.values()))
        if len(set(lengths.values())) > 1:
            told = ", ".join(f"{name} {length}" for name, length in lengths.items())
            raise RecordingError(str(path), "", f"has columns of different lengths: {told}")
        self.size = sum(array.nbytes for array in self._arrays.values())

    def parts(self) -> Iterator[Rows]:
        """All sound rows, block by block."""
        for begin in range(0, self._rows, _ROWS):
            chosen = {key: array[begin : begin + _ROWS] for key, array in self._arrays.items()}
            there = {
                key: ~np.isnan(array)
                if array.dtype.kind == "f"
                else ~np.isnat(array)
                if array.dtype.kind == "M"
                else np.ones(len(array), bool)
                for key, array in chosen.items()
            }
            stored = self.size * min(_ROWS, self._rows - begin) // self._rows
            yield rows_of(self._columns, chosen, there, begin, stored, self._config, self._lost)
        self._lost.close()

    def _array(self, path: Path, column: Column, values: Any) -> NDArray[np.generic]:
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

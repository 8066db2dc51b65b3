"""Vectors without a compiler: arrays of eight numbers."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from leg_wear_monitor.vectors.kinds import WIDTH

Floats = np.ndarray[Any, np.dtype[np.float64]]


def _row(array: Floats, index: int | tuple[int, ...]) -> Floats:
    *row, i = index if isinstance(index, tuple) else (index,)
    return np.asarray(array[tuple(row)][i : i + WIDTH])


def loaded(array: Floats, index: int | tuple[int, ...]) -> Floats:
    """Eight entries of a row from an index on; 0 beyond its end."""
    found = np.zeros(WIDTH)
    row = _row(array, index)
    found[: len(row)] = row
    return found


def stored(array: Floats, index: int | tuple[int, ...], value: Floats) -> None:
    """Store eight entries, or those that the row has."""
    row = _row(array, index)
    row[:] = value[: len(row)]


def gathered(array: Floats, first: int, row: int, index: Floats) -> Floats:
    """Entry array[first + j, row, index[j]] for each j; 0 beyond the end of the array."""
    found = np.zeros(WIDTH)
    for j in range(min(WIDTH, len(array) - first)):
        found[j] = array[first + j, row, int(index[j])]
    return found


def folded(value: Floats, combine: Callable[[Floats, Floats], Floats]) -> float:
    """All entries combined by halves."""
    while len(value) > 1:
        half = len(value) // 2
        value = combine(value[:half], value[half:])
    return float(value[0])


def replaced(value: Floats, i: int, number: float) -> Floats:
    """A vector with another number at an entry."""
    found = value.copy()
    found[i] = number
    return found


def chosen(flags: Any, a: Any, b: Any) -> Any:
    """A or b, entry by entry or whole."""
    if isinstance(flags, np.ndarray):
        return np.where(flags, a, b)
    return a if flags else b


def larger_of(a: Any, b: Any) -> Any:
    """The larger of two values; the second if they cannot be compared."""
    return chosen(a > b, a, b)


def whole_part_of(value: Any) -> Any:
    """The largest whole number that is not above a value, as a float."""
    return np.floor(value) if isinstance(value, np.ndarray) else float(math.floor(value))


def root_of(value: Any) -> Any:
    """Square root."""
    return np.sqrt(value) if isinstance(value, np.ndarray) else math.sqrt(value)


def picked(first: list[int]) -> Callable[[Floats, Floats], Floats]:
    """Take numbered entries of two vectors, 0 to 7 of the first and 8 to 15 of the second."""
    return lambda a, b: np.concatenate([a, b])[first]

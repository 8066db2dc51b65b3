"""Records of a structured dtype as state of compiled code, with the same access in compiled and plain Python.

An entry takes an array of records, also for a single one, and begins with ``record = records[0]``: numba
identifies the type of an array in half a microsecond, that of a `numpy.record` in ten.
"""

from collections.abc import Iterator
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

Record = Any
"""One record: ``state.speed`` reads and writes a field, ``state.speed[k]`` a value of an array field.

A `numpy.record` is an object for Python and a pointer for compiled code; no Python type describes its fields.
"""

Records = NDArray[Any]
"""Array (n,) of records: ``records["speed"]`` is a column, and in a kernel ``records[k].speed`` a value."""


def new_records(n: int, dtype: np.dtype[Any]) -> Records:
    """Records (n,) for an entry, all fields 0; a copy is a snapshot, ``records[:] = snapshot`` restores it.

    Raises
    ------
    ValueError
        For a field with the name of an attribute of numpy's records, which would hide it.
    """
    hidden = sorted(name for name in _names(dtype) if hasattr(np.record, name))
    if hidden:
        raise ValueError(f"fields {', '.join(hidden)}: numpy.record has attributes of these names")
    # uncompiled code needs elements with attributes
    return np.zeros(n, np.dtype((np.record, dtype)) if numba.config.DISABLE_JIT else dtype)


def _names(dtype: np.dtype[Any]) -> Iterator[str]:
    """Names of all fields, including those of nested records."""
    for name, (inner, *_) in (dtype.fields or {}).items():
        yield name
        yield from _names(inner.base)


def record_of(records: Records) -> Record:
    """The only record of an array, a view, to read and write by field names.

    Each access takes Python some microseconds; use `values_of` to read many fields.
    """
    (record,) = records.view(np.recarray)
    return record


def values_of(records: Records) -> dict[str, Any]:
    """Fields of the only record of an array, as Python's own numbers."""
    (values,) = records.tolist()
    return dict(zip(records.dtype.names or (), values, strict=True))

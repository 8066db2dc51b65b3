"""Compiled state with names: records of a structured type, alike in compiled and in plain Python.

An entry takes an array of records, of one where there is but one, and begins with ``record = records[0]``:
compiled code knows the type of such an array in half a microsecond, that of a `numpy.record` in ten.
"""

from collections.abc import Iterator
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

Record = Any
"""One record: ``state.speed`` reads and writes a field, ``state.speed[k]`` a value of an array field.

A `numpy.record` is one object for Python and a pointer for compiled code; neither has a type that says
which fields there are.
"""

Records = NDArray[Any]
"""Array (n,) of records: ``records["speed"]`` is a column, and in a kernel ``records[k].speed`` a value."""


def new_records(n: int, dtype: np.dtype[Any]) -> Records:
    """Records for an entry, all fields 0; a copy is a snapshot, ``records[:] = snapshot`` goes back to it.

    Raises
    ------
    ValueError
        For a field that plain Python would not find: numpy's records have an attribute of its name.
    """
    hidden = sorted(name for name in _names(dtype) if hasattr(np.record, name))
    if hidden:
        raise ValueError(f"fields {', '.join(hidden)}: numpy.record has attributes of these names")
    # what is not compiled needs elements that have attributes
    return np.zeros(n, np.dtype((np.record, dtype)) if numba.config.DISABLE_JIT else dtype)


def _names(dtype: np.dtype[Any]) -> Iterator[str]:
    """Names of all fields, those of records within records as well."""
    for name, (inner, *_) in (dtype.fields or {}).items():
        yield name
        yield from _names(inner.base)


def record_of(records: Records) -> Record:
    """The only record of an array, to read and write by names; it is the array's own.

    Each name takes Python some microseconds; where many are read often, `values_of` is for.
    """
    (record,) = records.view(np.recarray)
    return record


def values_of(records: Records) -> dict[str, Any]:
    """Fields of the only record of an array, as Python's own numbers."""
    (values,) = records.tolist()
    return dict(zip(records.dtype.names or (), values, strict=True))

"""Compiled state with names: one record of a structured type, alike in compiled and in plain Python."""

from typing import Any

import numpy as np

Record = Any
"""One record: ``state.speed`` reads and writes a field, ``state.speed[k]`` a value of an array field.

A `numpy.record` is one object for Python and a pointer for compiled code; neither has a type that says
which fields there are.
"""


def new_record(dtype: np.dtype[Any]) -> Record:
    """Record of a structured type, all fields 0."""
    return np.zeros(1, dtype).view(np.recarray)[0]


def copy_record(source: Record, target: Record) -> None:
    """Set all fields of a record to those of another of the same type."""
    for name in source.dtype.names:
        target[name] = source[name]

"""Parquet files through pyarrow."""

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.fleet.directory.atomic import write_whole


def arrow() -> Any:
    """The module pyarrow, with its Parquet reader and writer.

    Raises
    ------
    LegWearError
        If it is not installed.
    """
    try:
        import pyarrow
        import pyarrow.parquet
    except ModuleNotFoundError as error:
        text = "a fleet's tables need pyarrow, which is not installed; pip install 'leg_wear_monitor[fleet]'"
        raise LegWearError(text) from error
    return pyarrow


def write_parquet(path: Path, columns: Mapping[str, Any]) -> None:
    """Write a table, whole or not at all; equal columns give equal files."""
    pyarrow = arrow()
    buffer = io.BytesIO()
    table = pyarrow.table(dict(columns))
    pyarrow.parquet.write_table(table, buffer, compression="zstd", compression_level=9)
    write_whole(path, buffer.getvalue())

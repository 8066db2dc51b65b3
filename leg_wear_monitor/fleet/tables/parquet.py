"""Parquet and CSV files through pyarrow."""

import io
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from leg_wear_monitor.errors import ConfigError, LegWearError
from leg_wear_monitor.whole_file import write_whole


def arrow() -> Any:
    """The module pyarrow, with its readers and writers of files.

    Raises
    ------
    LegWearError
        If it is not installed.
    """
    try:
        import pyarrow
        import pyarrow.csv
        import pyarrow.parquet
    except ModuleNotFoundError as error:
        text = "a fleet's tables need pyarrow, which is not installed; pip install 'leg_wear_monitor[fleet]'"
        raise LegWearError(text) from error
    return pyarrow


def write_parquet(path: Path, columns: Mapping[str, Any]) -> None:
    """Write columns as a Parquet file, whole or not at all; equal columns give equal files."""
    write_table(path, arrow().table(dict(columns)))


def write_table(path: Path, table: Any) -> None:
    """Write a table of pyarrow, whole or not at all, in the format that the name ends in."""
    pyarrow, buffer = arrow(), io.BytesIO()
    if path.suffix == ".csv":
        pyarrow.csv.write_csv(table, buffer)
    else:
        pyarrow.parquet.write_table(table, buffer, compression="zstd", compression_level=9)
    write_whole(path, buffer.getvalue())


def read_tables(files: Iterable[tuple[str, Path]]) -> Any:
    """Rows of Parquet files as one table of pyarrow, with the leg of each row as its first column.

    Parameters
    ----------
    files : iterable
        Leg and path of each file. A column that a file does not have is null in its rows.

    Raises
    ------
    ConfigError
        If a file cannot be read.
    """
    pyarrow, tables = arrow(), []
    for leg, path in files:
        try:
            table = pyarrow.parquet.ParquetFile(path).read()
        except (OSError, pyarrow.ArrowException) as error:
            fault = f"cannot be read: {' '.join(str(error).split())[:200]}"
            raise ConfigError(str(path), "", fault) from error
        legs = pyarrow.array([leg] * len(table), pyarrow.string())
        tables.append(table.add_column(0, "leg", legs))
    if not tables:
        return pyarrow.table({"leg": pyarrow.array([], pyarrow.string())})
    return pyarrow.concat_tables(tables, promote_options="default")

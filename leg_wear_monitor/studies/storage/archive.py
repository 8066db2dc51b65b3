"""File of one point: result arrays and their origin, protected by one checksum."""

import io
import json
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.studies.point import Arrays
from leg_wear_monitor.studies.storage.checksum import canonical, result_checksum

_ABOUT = "about"
_MOST_BYTES = 2**29  # limit of the uncompressed size; a small archive can declare any size

_UNREADABLE = (
    ArithmeticError, EOFError, KeyError, MemoryError, OSError, RuntimeError, TypeError, ValueError,
    zipfile.BadZipFile, zlib.error,
)  # fmt: skip


def archive(arrays: Arrays, about: dict[str, Any]) -> bytes:
    """Serialize a result to the content of its file.

    Parameters
    ----------
    arrays : dict of arrays
    about : dict
        Plain values: the point's key, task and settings, and versions.
    """
    buffer = io.BytesIO()
    text = np.array(canonical({**about, "checksum": result_checksum(about, arrays)}))
    np.savez_compressed(buffer, **arrays, **{_ABOUT: text})  # type: ignore[arg-type]
    return buffer.getvalue()


def read_archive(path: Path, key: str, task: str, settings: dict[str, Any]) -> Arrays:
    """Read the arrays in the file of a point.

    Parameters
    ----------
    path : pathlib.Path
    key, task, settings
        Key, task and settings of the expected point.

    Raises
    ------
    ConfigError
        If the file is unreadable, was altered, or is the result of another point.
    """
    source = str(path)
    try:
        with zipfile.ZipFile(path) as file:
            if sum(entry.file_size for entry in file.infolist()) > _MOST_BYTES:
                raise ValueError(f"it unpacks to more than {_MOST_BYTES // 2**20} MB")
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        about = json.loads(str(arrays.pop(_ABOUT)))
        checksum = about.pop("checksum")
        is_whole = checksum == result_checksum(about, arrays)
    except _UNREADABLE as error:
        fault = " ".join(str(error).split()) or type(error).__name__
        raise ConfigError(source, "", f"cannot be read: {fault}") from error
    except AttributeError as error:  # JSON, but no object
        raise ConfigError(source, "", "does not name its point") from error
    if not is_whole:
        raise ConfigError(source, "", "was altered after it was computed (its checksum differs)")
    if canonical([about[name] for name in ("key", "task", "settings")]) != canonical([key, task, settings]):
        raise ConfigError(source, "", "is the result of another point")
    return arrays

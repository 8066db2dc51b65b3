"""Directories of a fleet, and lines of its files, which are written whole or not at all."""

import os
from pathlib import Path

from leg_wear_monitor.errors import ConfigError


def make_directory(path: Path) -> None:
    """Make a directory if it does not exist.

    Raises
    ------
    ConfigError
        If the disk does not take it.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigError(str(path), "", f"cannot be made: {error.strerror}") from error


def append_line(path: Path, line: str) -> None:
    """Append a line to a file, and write it to the disk; a line that was cut off before is removed.

    Raises
    ------
    ConfigError
        If the disk does not take it.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("a+b") as file:
            file.truncate(_whole_bytes(path))
            file.write(line.encode() + b"\n")
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        raise ConfigError(str(path), "", f"cannot be written: {error.strerror}") from error


def _whole_bytes(path: Path) -> int:
    """Bytes up to the end of the last whole line."""
    step = 4096
    with path.open("rb") as file:
        end = file.seek(0, os.SEEK_END)
        while end:
            begin = max(0, end - step)
            file.seek(begin)
            at = file.read(end - begin).rfind(b"\n")
            if at >= 0:
                return begin + at + 1
            end = begin
    return 0

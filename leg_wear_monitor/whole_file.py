"""Files that are written whole or not at all."""

import fcntl
import glob
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from leg_wear_monitor.errors import ConfigError


def write_whole(path: Path, content: bytes) -> None:
    """Write a file and bring it to the disk; nobody ever sees a part of it.

    Several processes may write the same file at the same time: one waits for the other, and the last one
    counts. What a kill leaves is used by the next write.

    Parameters
    ----------
    path : pathlib.Path
        On a file system with locks; its directory is made if it does not exist. A symbolic link stays, and
        the file that it leads to is written.
    content : bytes

    Raises
    ------
    ConfigError
        If the disk does not take it; the file is then as it was.
    """
    target = path.resolve()
    part = target.with_name(f".{target.name}.part")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with _alone(part) as file:
            try:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
                os.replace(part, target)
            except BaseException:
                with suppress(OSError):  # the first fault is the one to report
                    part.unlink()
                raise
    except OSError as error:
        raise ConfigError(str(path), "", f"cannot be written: {error.strerror}") from error


@contextmanager
def unfinished(path: Path) -> Iterator[Path]:
    """A new file beside ``path`` to write into; it is removed at the end, unless it was put in its place.

    Those of processes that were killed are removed at the begin.

    Parameters
    ----------
    path : pathlib.Path
        In a directory that exists, on a file system with locks.

    Raises
    ------
    OSError
        If the disk does not take it.
    """
    remove_parts(path.parent, f"{glob.escape(path.name)}.[0-9]*")
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    with _alone(part):
        try:
            yield part
        finally:
            part.unlink(missing_ok=True)


def remove_parts(directory: Path, names: str) -> None:
    """Remove parts of files that killed processes left in a directory.

    Parameters
    ----------
    directory : pathlib.Path
        It may not exist.
    names : str
        Pattern of the names of the files.
    """
    for part in directory.glob(f".{names}.part"):
        with suppress(OSError):  # a process writes it, or it may not be removed: it harms nobody
            if part.is_file() and not part.is_symlink():
                with part.open("r+b") as file:
                    fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    part.unlink()


@contextmanager
def _alone(part: Path) -> Iterator[BinaryIO]:
    """An empty file with this name, which no other process writes meanwhile."""
    while True:
        with part.open("ab") as file:
            fcntl.flock(file, fcntl.LOCK_EX)
            if not _is_at(part, file):  # who had it before has put it in its place
                continue
            file.truncate(0)
            yield file
            return


def _is_at(path: Path, file: BinaryIO) -> bool:
    try:
        return os.path.samestat(path.stat(), os.fstat(file.fileno()))
    except FileNotFoundError:
        return False

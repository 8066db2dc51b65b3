"""Opening of untrusted paths: accepts regular files only, and never blocks on a pipe."""

import os
import stat
from pathlib import Path
from typing import IO

_KINDS = {
    stat.S_IFDIR: "a directory",
    stat.S_IFIFO: "a pipe",
    stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
}


def kind_of(mode: int) -> str:
    """File kind of an `os.stat` mode, with its article; empty for a regular file."""
    return "" if stat.S_ISREG(mode) else _KINDS.get(stat.S_IFMT(mode), "no file")


def open_regular(path: Path) -> IO[bytes]:
    """Open a regular file for reading.

    Raises
    ------
    OSError
        If it cannot be opened or is not a regular file (it may have been replaced since an earlier check).
    """
    descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC | getattr(os, "O_NONBLOCK", 0))
    what = kind_of(os.fstat(descriptor).st_mode)
    if what:
        os.close(descriptor)
        raise OSError(0, f"is {what}, expected a file", str(path))
    return os.fdopen(descriptor, "rb")

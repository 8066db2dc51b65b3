"""Directories for compiled code. Its index files are pickles, so no other user may be able to write them."""

import fcntl
import os
import stat
import tempfile
import warnings
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import cache
from pathlib import Path

from leg_wear_monitor.errors import ConfigWarning

PACKAGE, VARIABLE = "leg_wear_monitor", "NUMBA_CACHE_DIR"


def make_private(path: Path) -> str | None:
    """Create a directory for this user alone, or use an existing one; report why it cannot be used.

    Parameters
    ----------
    path : pathlib.Path
        Missing directories above it are made as well.

    Returns
    -------
    str or None
        Fault of the directory and how to mend it, None if it can be used.
    """
    try:
        path.mkdir(mode=0o700, parents=True, exist_ok=True)
        link, found = path.lstat(), path.stat()
    except OSError as error:
        return f"{path} cannot be made: {error.strerror}"
    for owner in (link.st_uid, found.st_uid):
        if owner != os.geteuid():
            return f"{path} belongs to a different user (uid {owner})"
    if found.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        return f"{path} can be written to by others (chmod go-w {path})"
    return None if os.access(path, os.W_OK | os.X_OK) else f"{path} cannot be written to"


def code_directory(name: str) -> Path | None:
    """Directory of this user alone for compiled code.

    Parameters
    ----------
    name : str
        Name of the directory itself.

    Returns
    -------
    pathlib.Path or None
        None if no place is safe: then nothing can be kept.

    Warns
    -----
    ConfigWarning
        If a directory that was asked for is refused, or compiled code is not kept.
    """
    place = _place()
    return place if place is None or make_private(place / name) else place / name


def kept_directories(place: Path) -> list[Path]:
    """Directories with compiled code below a place; symbolic links are none."""
    try:
        return sorted(each for each in place.iterdir() if each.is_dir() and not each.is_symlink())
    except OSError:
        return []


@contextmanager
def one_process_at_a_time(path: Path) -> Iterator[None]:
    """Wait until no other process is inside with the same lock file; without lock support, do not wait.

    A process that ends inside, even if it is killed, releases the lock.

    Parameters
    ----------
    path : pathlib.Path
    """
    with ExitStack() as stack:
        with suppress(OSError):
            fcntl.flock(stack.enter_context(path.open("ab")), fcntl.LOCK_EX)
        yield


@cache
def _place() -> Path | None:
    """The first usable directory of the usual places."""
    faults: list[str] = []
    for variable, place in _usual_places():
        fault = make_private(place)
        if fault is None:
            if faults:
                _warn(faults, f"compiled code goes to {place}")
            return place
        faults.append(f"{variable}: {fault}" if variable else fault)
    _warn(faults, "compiled code is not stored, so every start compiles again")
    return None


def _usual_places() -> Iterator[tuple[str, Path]]:
    """Possible directories for compiled code in order of preference, each with the variable that names it."""
    for variable in (VARIABLE, "XDG_CACHE_HOME"):
        if os.environ.get(variable):
            yield variable, Path(os.environ[variable]).absolute() / PACKAGE
    user = Path(os.path.expanduser("~"))  # "~" itself where there is none
    if user.is_absolute():
        yield "", user / ".cache" / PACKAGE
    yield "", Path(tempfile.gettempdir()) / f"{PACKAGE}-{os.geteuid()}"


def _warn(faults: list[str], instead: str) -> None:
    warnings.warn(f"{'; '.join(faults)}; {instead}", ConfigWarning, stacklevel=2)

"""Directories for compiled code. Its index files are pickles, so no other user may be able to write them."""

import atexit
import fcntl
import os
import shutil
import stat
import tempfile
import warnings
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import cache
from pathlib import Path

from leg_wear_monitor.errors import ConfigWarning

PACKAGE, VARIABLE = "leg_wear_monitor", "NUMBA_CACHE_DIR"

_ASKED = (VARIABLE, "XDG_CACHE_HOME")
_NOT_KEPT = "compiled code is not stored, so every start compiles again"
_KEPT, _A_DAY_S = 2, 86400.0  # versions of the same code, and the age [s] at which more of them go
_MOST_LINKS = 40  # as the kernel follows
_OTHERS_WRITE, _OTHERS_ENTER, _OTHERS = 0o022, 0o011, 0o077


def fault_of(path: Path) -> str | None:
    """Say why another local user could write below a path, or replace its directory.

    Every directory and symbolic link on the way must belong to this user or to root. A directory that others
    can write to is accepted only with the sticky bit, as ``/tmp`` has it, and only on the way. Below a
    directory that no other user can enter, the modes do not matter.

    Parameters
    ----------
    path : pathlib.Path
        Need not exist; missing parts are not checked.

    Returns
    -------
    str or None
        The first thing wrong and how to mend it, None if nothing is.
    """
    here, pending, closed, links = Path("/"), _reversed_parts(path.absolute()), False, 0
    while pending:
        here, last = here / pending.pop(), not pending
        if here.name == "..":
            here, closed = here.parent.parent, False
            continue
        try:
            found = here.lstat()
        except FileNotFoundError:
            return None
        except OSError as error:
            return f"{here} cannot be read: {error.strerror}"
        if found.st_uid not in (0, os.geteuid()):
            return f"{here} belongs to a different user (uid {found.st_uid})"
        if stat.S_ISLNK(found.st_mode):
            links += 1
            if links > _MOST_LINKS:
                return f"{here} is a symbolic link in a loop"
            rest = [*reversed(pending)]
            pending = _reversed_parts(here.parent.joinpath(os.readlink(here), *rest))
            here, closed = Path("/"), False
        elif not closed and found.st_mode & _OTHERS_WRITE and (last or not found.st_mode & stat.S_ISVTX):
            return f"{here} can be written to by others (chmod go-w {here})"
        else:
            closed = closed or not found.st_mode & _OTHERS_ENTER
    return None


def _reversed_parts(path: Path) -> list[str]:
    return list(reversed(path.parts[1:]))


def make_private(path: Path) -> str | None:
    """Make a directory for this user alone, mode 0700, or take one that is there; say why it cannot be used.

    Parameters
    ----------
    path : pathlib.Path
        Directories above it are made with mode 0700 as well.

    Returns
    -------
    str or None
        Fault of the directory, None if it can be used.
    """
    fault = fault_of(path)
    if fault:
        return fault
    try:
        for directory in (*reversed(path.absolute().parents), path):
            if not directory.exists():
                directory.mkdir(mode=0o700, exist_ok=True)
        if path.stat().st_mode & _OTHERS:
            path.chmod(0o700)
    except OSError as error:
        return f"{path} cannot be made: {error.strerror}"
    if not os.access(path, os.W_OK | os.X_OK):
        return f"{path} cannot be written to"
    return fault_of(path)  # a concurrent process may have made a part of it


@cache
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
    home = _home()
    if home is None:
        return None
    leaf = home / PACKAGE / name
    fault = make_private(leaf)
    if fault:
        _warn([fault], _NOT_KEPT)
        return None
    with suppress(OSError):
        os.utime(leaf)  # used now
        _remove_old(leaf)
    return leaf


def _remove_old(leaf: Path) -> None:
    """Remove directories that a newer version of the same code has replaced.

    The two most recently used directories stay, and every directory used within a day, so that a developer
    with several copies compiles none of them again.
    """
    group, _, _ = leaf.name.rpartition("-")
    now = leaf.stat().st_mtime
    found = [(each.stat().st_mtime, each) for each in kept_directories(leaf.parent)]
    rivals = [(used, each) for used, each in found if each.name.rpartition("-")[0] == group]
    nameless = [(used, each) for used, each in found if "-" not in each.name]  # as older versions left them
    for used, each in [*sorted(rivals, reverse=True)[_KEPT:], *nameless]:
        if now - used > _A_DAY_S and each != leaf:
            shutil.rmtree(each, ignore_errors=True)


def kept_directories(place: Path) -> list[Path]:
    """Directories with compiled code below a place; symbolic links are none."""
    try:
        return sorted(each for each in place.iterdir() if each.is_dir() and not each.is_symlink())
    except OSError:
        return []


@contextmanager
def one_process_at_a_time(path: Path) -> Iterator[None]:
    """Wait until no other process is inside with the same lock file; without lock support, do not wait.

    A process that ends inside, however it does, lets the next one in.

    Parameters
    ----------
    path : pathlib.Path
    """
    with ExitStack() as stack:
        with suppress(OSError):
            fcntl.flock(stack.enter_context(path.open("ab")), fcntl.LOCK_EX)
        yield


@cache
def _home() -> Path | None:
    """The first of the usual places that is safe, else a new one that goes with this process."""
    faults: list[str] = []
    for name, home in _usual_homes():
        fault = make_private(home / PACKAGE)
        if fault is None:
            refused = [each for each in faults if each.startswith(_ASKED)]
            if refused:
                _warn(refused, f"compiled code goes to {home}")
                os.environ[VARIABLE] = str(home)  # or every child process would say so again
            return home
        faults.append(f"{name}: {fault}")
    _warn(faults, _NOT_KEPT)
    return _home_of_this_process()


def _usual_homes() -> list[tuple[str, Path]]:
    """Possible directories for compiled code in order of preference, each with the source of the path."""
    asked = [(name, os.environ.get(name)) for name in _ASKED]
    homes = [(name, Path(home).absolute()) for name, home in asked if home]
    user = Path(os.path.expanduser("~"))  # "~" itself where there is none
    if user.is_absolute():
        homes.append(("home directory", user / ".cache"))
    shared = Path(tempfile.gettempdir()) / f"{PACKAGE}-{os.geteuid()}"
    return [*homes, ("temporary directory", shared)]


def _home_of_this_process() -> Path | None:
    """A new private directory, removed at the end; child processes find it through the environment."""
    home, owner = Path(tempfile.mkdtemp(prefix=f"{PACKAGE}-")), os.getpid()

    def remove() -> None:
        if os.getpid() == owner:  # not a fork of it
            shutil.rmtree(home, ignore_errors=True)

    atexit.register(remove)
    if fault_of(home):  # other users can write to the temporary directory
        return None
    os.environ[VARIABLE] = str(home)
    return home


def _warn(faults: list[str], instead: str) -> None:
    warnings.warn(f"{'; '.join(faults)}; {instead}", ConfigWarning, stacklevel=2)

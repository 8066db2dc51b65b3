"""One update of a fleet at a time."""

import fcntl
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from leg_wear_monitor.errors import ConfigError


@contextmanager
def locked(out: Path, *, waits: bool = False) -> Iterator[None]:
    """Lock a directory; the system releases the lock of a process that is killed.

    Parameters
    ----------
    out : pathlib.Path
        Of a fleet, or of a leg.
    waits : bool
        Whether to wait for another process.

    Raises
    ------
    ConfigError
        If another process updates it, or it cannot be written to.
    """
    try:
        out.mkdir(parents=True, exist_ok=True)
        file = (out / ".lock").open("ab")
    except OSError as error:
        raise ConfigError(str(out), "", f"cannot be written: {error.strerror}") from error
    with file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | (0 if waits else fcntl.LOCK_NB))
        except OSError as error:
            raise ConfigError(
                str(out), "", "is being updated by another process; wait for its end"
            ) from error
        yield

"""One update of a fleet at a time."""

import fcntl
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from leg_wear_monitor.errors import ConfigError


@contextmanager
def locked(out: Path) -> Iterator[None]:
    """Lock the directory of a fleet; the system releases the lock of a process that is killed.

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
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            raise ConfigError(
                str(out), "", "is being updated by another process; wait for its end"
            ) from error
        yield

"""Python processes that this one starts, and compilation in a second one.

What that one compiles reaches this one through the cache.
"""

import os
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import IO

from leg_wear_monitor.errors import ConfigWarning
from leg_wear_monitor.interrupt import closed_at_the_end
from leg_wear_monitor.kernel import cache_directory, is_stored


def _processors() -> int:
    """Number of processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextmanager
def compiled_beside(compile_it: Callable[[], None], entry: Callable[..., object]) -> Iterator[None]:
    """Have a second process compile an entry while the work inside compiles others.

    Where the work inside needs the entry, it waits until the second process has stored it in the cache, and
    loads it. If the second process fails, it compiles the entry itself. There is no second process if the
    entry is stored already, if nothing can be stored, or on one processor.

    Parameters
    ----------
    compile_it : callable
        Function of a module that the second process calls.
    entry : callable
        What it compiles.

    Warns
    -----
    ConfigWarning
        If the second process fails.
    """
    if is_stored(entry) or cache_directory() is None or _processors() < 2:
        yield
        return
    with (
        tempfile.TemporaryFile() as log,
        _started(compile_it, log) as process,
        closed_at_the_end(process.kill),
    ):
        try:
            yield
            _check(process, log)
        finally:
            process.kill()


def python_command(call: Callable[[], None], *arguments: str) -> list[str]:
    """Command of a Python process that calls a function of a module.

    It finds the modules that this process finds, and none in the current directory besides.

    Parameters
    ----------
    call : callable
        Function of a module.
    *arguments : str
        Of the command line.
    """
    # set inside, since what stands beside a user's script must not replace what Python itself starts with
    found = f"import sys; sys.path[:] = {sys.path!r}"
    called = f"from {call.__module__} import {call.__name__} as run; run()"
    return [sys.executable, "-P", "-c", f"{found}; {called}", *arguments]


def _started(compile_it: Callable[[], None], log: IO[bytes]) -> subprocess.Popen[bytes]:
    """A process that compiles."""
    return subprocess.Popen(
        python_command(compile_it),
        stdin=subprocess.DEVNULL,
        stdout=log,
        stderr=log,
        start_new_session=True,  # Ctrl-C reaches it by us, once
    )


def _check(process: subprocess.Popen[bytes], log: IO[bytes]) -> None:
    """Warn if the second process has failed."""
    if process.poll():
        log.seek(0)
        lines = log.read().decode(errors="replace").strip().splitlines() or ["no message"]
        warnings.warn(
            f"compilation in a second process ended with {process.returncode}: {lines[-1]}; "
            "compiled in this process instead",
            ConfigWarning,
            stacklevel=4,
        )

"""Other processes: calls for workers, here or on a Dask cluster, and compilation in a second process."""

import hashlib
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache, partial
from pathlib import Path
from typing import IO, Any

from leg_wear_monitor.compiled.kernel import cache_directory, is_stored
from leg_wear_monitor.errors import ConfigError, ConfigWarning, LegWearError, closed_on_interrupt

# The code that a worker runs; it must be the same as the caller's code.


@cache
def package_digest(*parts: str) -> str:
    """Digest of the sources in files and folders of this package; of the whole package by default."""
    home, digest = Path(__file__).parent, hashlib.sha256()
    for source in sorted(home.rglob("*.py")):
        path = source.relative_to(home)
        if not parts or path.parts[0] in parts or path.as_posix() in parts:
            digest.update(f"{path.as_posix()}\n".encode())
            digest.update(source.read_bytes())
    return digest.hexdigest()[:20]


# Calls for workers.


Calls = Mapping[str, Callable[[], Any]]
"""Calls by their names; workers need picklable ones, such as a `functools.partial`."""

TRIES = 3  # attempts at a call if its worker dies
PATIENCE_S = 10.0  # time for a scheduler to answer
WORKERS_S = 60.0  # time for a scheduler to get a worker


def results(calls: Calls, workers: int = 1, scheduler: str | None = None) -> Iterator[tuple[str, Any]]:
    """Names and results of calls, each as soon as it is complete, so that the caller can store it at once.

    Parameters
    ----------
    calls : mapping of str to callable
        Calls begin in this order.
    workers : int
        Number of local processes with one thread each; 1 and less uses this process only.
    scheduler : str, optional
        Address of a Dask scheduler, such as ``tcp://127.0.0.1:8786``. Its workers run the calls instead.

    Raises
    ------
    ConfigError
        If dask.distributed is not installed, or the scheduler does not answer or has no worker.
    LegWearError
        If workers die repeatedly.
    """
    if scheduler is not None:
        yield from _from_cluster(calls, scheduler)
    elif min(workers, len(calls)) > 1:
        yield from _from_processes(calls, workers)
    else:
        yield from ((name, call()) for name, call in calls.items())


def _from_processes(calls: Calls, workers: int) -> Iterator[tuple[str, Any]]:
    try:
        from joblib import parallel_config
        from joblib.externals.loky.process_executor import TerminatedWorkerError
    except ImportError as error:
        fault = "needs joblib (pip install joblib). Expected 1"
        raise ConfigError("--workers", str(workers), fault) from error
    waiting = {name: partial(_in_worker, os.getpid(), call) for name, call in calls.items()}
    for _ in range(TRIES):
        try:
            with parallel_config("loky", inner_max_num_threads=1):
                for name, result in _unordered(dict(waiting), workers):
                    del waiting[name]
                    yield name, result
            return
        except TerminatedWorkerError:
            continue
    raise LegWearError(
        f"worker processes died {TRIES} times; finished results are kept; "
        f"is there enough memory for --workers {workers}?"
    )


def _from_cluster(calls: Calls, address: str) -> Iterator[tuple[str, Any]]:
    try:
        from distributed import Client
        from distributed.scheduler import KilledWorker
        from joblib import parallel_config
    except ImportError as error:
        raise ConfigError("--scheduler", address, "needs dask.distributed, the extra 'dask'") from error
    try:
        client = Client(address, timeout=PATIENCE_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise ConfigError("--scheduler", address, "no scheduler answers there") from error
    try:
        with client:
            _wait_for_a_worker(client, address)
            with parallel_config("dask", client=client):
                yield from _unordered(calls, -1)
    except KilledWorker as error:
        raise LegWearError(
            f"{address}: workers died repeatedly during one call; finished results are kept"
        ) from error


def _wait_for_a_worker(client: Any, address: str) -> None:
    try:
        client.wait_for_workers(1, timeout=WORKERS_S)
    except TimeoutError as error:
        fault = f"the scheduler has no worker after {WORKERS_S:g} s"
        raise ConfigError("--scheduler", address, fault) from error


def _unordered(calls: Calls, workers: int) -> Iterator[tuple[str, Any]]:
    """Names and results from the workers that joblib is configured for."""
    from joblib import Parallel, delayed

    parallel = Parallel(workers, return_as="generator_unordered", batch_size=1, pre_dispatch="all")
    with _no_imports_from_the_current_directory():
        named = parallel(delayed(_named)(name, call) for name, call in calls.items())
    yield from named


def _named(name: str, call: Callable[[], Any]) -> tuple[str, Any]:
    return name, call()


@contextmanager
def _no_imports_from_the_current_directory() -> Iterator[None]:
    """Python processes that start inside do not import modules from it, as `python -m` does."""
    before = os.environ.get("PYTHONSAFEPATH")
    os.environ["PYTHONSAFEPATH"] = "1"
    try:
        yield
    finally:
        if before is None:
            del os.environ["PYTHONSAFEPATH"]
        else:
            os.environ["PYTHONSAFEPATH"] = before


def _in_worker(parent: int, call: Callable[[], Any]) -> Any:
    _begin_worker(parent)
    return call()


@cache
def _begin_worker(parent: int) -> None:
    """Set up a worker, once: it leaves interrupts to its parent, and ends with it.

    Without its parent, a worker would continue to write to the files of the next run.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def _end_with(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(0.2)
    os._exit(1)


# Python processes that this process starts, and compilation in a second process.
#
# The cache passes the second process's compiled code to this process.


def _processors() -> int:
    """Number of processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextmanager
def compiled_beside(compile_it: Callable[[], None], entry: Callable[..., object]) -> Iterator[None]:
    """Have a second process compile an entry while the work inside compiles others.

    If the work inside needs the entry, it waits until the second process has stored it in the cache, and
    loads it. If the second process fails, it compiles the entry itself. There is no second process if the
    entry is stored already, if nothing can be stored, or on one processor.

    Parameters
    ----------
    compile_it : callable
        Function of a module that the second process calls.
    entry : callable
        Entry that this function compiles.

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
        closed_on_interrupt(process.kill),
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
        Arguments of the command line.
    """
    # The path is set inside the command, because files next to a user's script must not replace modules that
    # Python itself starts with.
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

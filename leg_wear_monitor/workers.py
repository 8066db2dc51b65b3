"""Calls for other processes: here, on a Dask cluster, and compilation in a second process.

A worker that dies loses only the jobs in progress there.
"""

import hashlib
import os
import signal
import subprocess
import sys
import tempfile
import threading
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from functools import cache
from multiprocessing import get_context, parent_process
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, NamedTuple

from leg_wear_monitor.compiled.kernel import cache_directory, is_stored
from leg_wear_monitor.errors import ConfigError, ConfigWarning, LegWearError, closed_on_interrupt

if TYPE_CHECKING:
    from loky import ProcessPoolExecutor


# The code that a worker runs: it has to be that of who asks.


@cache
def package_digest(*parts: str) -> str:
    """Digest of the sources in files and folders of this package; of all without."""
    home, digest = Path(__file__).parent, hashlib.sha256()
    for source in sorted(home.rglob("*.py")):
        path = source.relative_to(home)
        if not parts or path.parts[0] in parts or path.as_posix() in parts:
            digest.update(f"{path.as_posix()}\n".encode())
            digest.update(source.read_bytes())
    return digest.hexdigest()[:20]


# A call for a worker.


class Job(NamedTuple):
    """A call for a worker.

    Attributes
    ----------
    key : str
        Name of the job, unique in a run.
    call : callable
        Function of a module, so that a worker can import it.
    arguments : tuple
        Picklable.
    cost : float
        Approximate cost; costly jobs begin first.
    """

    key: str
    call: Callable[..., Any]
    arguments: tuple[Any, ...]
    cost: float = 1.0

    def run(self) -> Any:
        """Result of the call, computed in this process."""
        return self.call(*self.arguments)


Done = Callable[[Job, Any], Iterable[Job] | None]
"""Called with each job and its result, in order of completion; gives jobs that can begin now."""


def by_cost(jobs: Iterable[Job]) -> list[Job]:
    """Jobs, the costliest first."""
    return sorted(jobs, key=lambda job: -job.cost)


def run_jobs(jobs: Sequence[Job], done: Done, workers: int, scheduler: str | None = None) -> None:
    """Run jobs, and those that follow from them: on a cluster, in local processes, or in this process.

    Parameters
    ----------
    jobs : sequence of Job
    done : callable
        Called in this process with each job and its result, in order of completion.
    workers : int
        Number of local processes; 1 and less uses this process only.
    scheduler : str, optional
        Address of a Dask scheduler whose workers run the jobs instead.
    """
    if scheduler is not None:
        run_on_cluster(jobs, scheduler, done)
    elif workers > 1:
        run_in_processes(jobs, workers, done)
    else:
        run_here(jobs, done)


# Calls computed in local single-thread processes; if one dies, only jobs in progress are lost.


TRIES = 3  # attempts per job if its worker dies

_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")

# multiprocessing starts `python -c`, which would import from the current directory
_OF_A_WORKER = {**dict.fromkeys(_THREADS, "1"), "PYTHONSAFEPATH": "1"}


def run_here(jobs: Sequence[Job], done: Done) -> None:
    """Run jobs one after the other in this process, those that follow from one right after it."""
    waiting = list(reversed(jobs))
    while waiting:
        job = waiting.pop()
        waiting.extend(reversed(list(done(job, job.run()) or ())))


def run_in_processes(jobs: Sequence[Job], workers: int, done: Done) -> None:
    """Run jobs in worker processes.

    Parameters
    ----------
    jobs : sequence of Job
    workers : int
    done : callable
        Called in this process with each job and its result, in order of completion.

    Raises
    ------
    ConfigError
        If loky is not installed.
    LegWearError
        If workers die repeatedly.
    """
    open_jobs = {job.key: job for job in by_cost(jobs)}
    for _ in range(TRIES):
        try:
            with _pool(workers) as pool:
                _work_off(open_jobs, pool, done)
            return
        except BrokenProcessPool:
            continue
    raise LegWearError(
        f"worker processes died {TRIES} times; finished results are kept; "
        f"is there enough memory for --workers {workers}?"
    )


def _work_off(open_jobs: dict[str, Job], pool: "ProcessPoolExecutor", done: Done) -> None:
    """Run the open jobs and those that follow from them; what is finished is removed."""
    futures = {pool.submit(job.run): job for job in open_jobs.values()}
    while futures:
        finished, _ = wait(futures, return_when=FIRST_COMPLETED)
        for future in finished:
            job = futures.pop(future)
            more = done(job, future.result()) or ()
            del open_jobs[job.key]
            open_jobs |= {each.key: each for each in more}
            futures |= {pool.submit(each.run): each for each in more}


@contextmanager
def _pool(workers: int) -> Iterator["ProcessPoolExecutor"]:
    """A pool of single-thread workers, which is shut down at the end of the context.

    The pool is that of loky. In the pool of Python 3.11, a worker that dies while jobs are being submitted
    ends the thread that manages the workers, or raises OSError (both were observed).
    """
    try:
        from loky import ProcessPoolExecutor
    except ImportError as error:
        raise ConfigError("--workers", str(workers), "needs loky (pip install loky), expected 1") from error
    with _environment(_OF_A_WORKER), warnings.catch_warnings():
        # A worker that has grown starts anew between two jobs, which loses nothing.
        warnings.filterwarnings("ignore", "A worker was restarted", UserWarning)
        pool = ProcessPoolExecutor(workers, context=get_context("spawn"), initializer=_begin_worker)
        try:
            yield pool
        except BaseException:
            pool.shutdown(kill_workers=True)
            raise
        pool.shutdown()


@contextmanager
def _environment(changes: dict[str, str]) -> Iterator[None]:
    before = {name: os.environ.get(name) for name in changes}
    os.environ.update(changes)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def _begin_worker() -> None:
    """Set up a worker: it ignores interrupts, which the parent handles, and ends with its parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def _end_with(parent: Any) -> None:
    parent.join()
    os._exit(1)


# Calls computed on a Dask cluster. If a worker dies, only the jobs in progress there are lost.


PATIENCE_S = 10.0  # timeout for the scheduler's answer


def run_on_cluster(jobs: Sequence[Job], address: str, done: Done) -> None:
    """Run jobs on the workers of a scheduler.

    Parameters
    ----------
    jobs : sequence of Job
    address : str
        Address of the scheduler, such as ``tcp://127.0.0.1:8786``.
    done : callable
        Called in this process with each job and its result, in order of completion.

    Raises
    ------
    ConfigError
        If dask.distributed is not installed, or the scheduler does not answer.
    LegWearError
        If workers die repeatedly during one job.
    """
    try:
        from distributed import Client, as_completed
        from distributed.scheduler import KilledWorker
    except ImportError as error:
        raise ConfigError("--scheduler", address, "needs dask.distributed, the extra 'dask'") from error
    try:
        client = Client(address, timeout=PATIENCE_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise ConfigError("--scheduler", address, "no scheduler answers there") from error
    with client, client.as_current():
        futures = {}

        def submit(job: Job) -> Any:
            future = client.submit(job.call, *job.arguments, key=f"leg-wear-{job.key}", retries=TRIES)
            futures[future] = job
            return future

        finished = as_completed([submit(job) for job in by_cost(jobs)])
        for future in finished:
            try:
                result = future.result()
            except KilledWorker as error:
                raise LegWearError(
                    f"{address}: workers died repeatedly during one job; finished results are kept"
                ) from error
            finished.update([submit(job) for job in done(futures.pop(future), result) or ()])
            future.release()


# Python processes that this one starts, and compilation in a second one.
#
# What that one compiles reaches this one through the cache.


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

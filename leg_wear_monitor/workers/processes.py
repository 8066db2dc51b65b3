"""Calls computed in local single-thread processes; if one dies, only jobs in progress are lost."""

import os
import signal
import threading
import warnings
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import get_context, parent_process
from typing import TYPE_CHECKING, Any

from leg_wear_monitor.errors import ConfigError, LegWearError
from leg_wear_monitor.workers.job import Done, Job, by_cost

if TYPE_CHECKING:
    from loky import ProcessPoolExecutor

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

"""Points on this machine's cores, in processes of one thread; one that dies costs only its point."""

import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import active_children, get_context, parent_process
from typing import Any, NamedTuple

from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.studies.point import Arrays
from leg_wear_monitor.studies.tasks import compute

TRIES = 3  # of a point whose worker dies

_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


class Job(NamedTuple):
    """A point to compute: its key, what `leg_wear_monitor.studies.tasks.compute` takes, and its cost."""

    key: str
    task: str
    mechanism: Mechanism
    settings: dict[str, Any]
    code: str
    cost: float


Done = Callable[[Job, Arrays], None]


def run_here(jobs: Sequence[Job], done: Done) -> None:
    """Compute points one after the other in this process."""
    for job in jobs:
        done(job, _compute(job))


def run_in_processes(jobs: Sequence[Job], workers: int, done: Done) -> None:
    """Compute points in worker processes.

    Parameters
    ----------
    jobs : sequence of Job
    workers : int
    done : callable
        Called in this process with each job and its result, in the order in which they end.

    Raises
    ------
    LegWearError
        When workers keep dying.
    """
    open_jobs = {job.key: job for job in sorted(jobs, key=lambda job: -job.cost)}
    for _ in range(TRIES):
        try:
            with _pool(workers) as pool:
                futures = {pool.submit(_compute, job): job for job in open_jobs.values()}
                for future in as_completed(futures):
                    done(futures[future], future.result())
                    del open_jobs[futures[future].key]
            return
        except BrokenProcessPool:
            continue
    raise LegWearError(
        f"worker processes died {TRIES} times; finished points are kept; "
        f"is there enough memory for --workers {workers}?"
    )


def _compute(job: Job) -> Arrays:
    return compute(job.task, job.mechanism, job.settings, job.code)


@contextmanager
def _pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """A pool of workers with one thread each, which does not outlive what it is used for."""
    others = set(active_children())
    with _environment(dict.fromkeys(_THREADS, "1")):
        pool = ProcessPoolExecutor(workers, mp_context=get_context("spawn"), initializer=_begin_worker)
        try:
            yield pool
        except BaseException:
            for child in set(active_children()) - others:
                child.terminate()
            raise
        finally:
            pool.shutdown(cancel_futures=True)


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
    """An interrupt is for the parent to answer; without a parent there is nothing to work for."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def _end_with(parent: Any) -> None:
    parent.join()
    os._exit(1)

"""Calls computed on a Dask cluster. If a worker dies, only the jobs in progress there are lost."""

from collections.abc import Sequence
from typing import Any

from leg_wear_monitor.errors import ConfigError, LegWearError
from leg_wear_monitor.workers.job import Done, Job, by_cost
from leg_wear_monitor.workers.processes import TRIES

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

"""Computation of points on a Dask cluster. If a worker dies, only the points it was computing are lost."""

from collections.abc import Sequence

from leg_wear_monitor.errors import ConfigError, LegWearError
from leg_wear_monitor.studies.execution.processes import TRIES, Done, Job
from leg_wear_monitor.studies.tasks.compute import compute

PATIENCE_S = 10.0  # timeout for the scheduler's answer


def run_on_cluster(jobs: Sequence[Job], address: str, done: Done) -> None:
    """Compute points on the workers of a scheduler.

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
        If workers die repeatedly while computing a point.
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
        for job in sorted(jobs, key=lambda job: -job.cost):
            call = (compute, job.task, job.mechanism, job.settings, job.code)
            futures[client.submit(*call, key=f"leg-wear-{job.key}", retries=TRIES)] = job
        for future in as_completed(list(futures)):
            try:
                result = future.result()
            except KilledWorker as error:
                raise LegWearError(
                    f"{address}: workers died over a point; finished points are kept"
                ) from error
            done(futures.pop(future), result)
            future.release()

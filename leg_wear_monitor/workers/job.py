"""A call for a worker."""

from collections.abc import Callable, Iterable
from typing import Any, NamedTuple


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

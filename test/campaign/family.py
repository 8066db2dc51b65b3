"""A family of cases run whole: what came of each, and the row of the table."""

import multiprocessing
import pkgutil
import tempfile
from collections import Counter
from collections.abc import Iterable, Iterator
from importlib import import_module
from pathlib import Path
from typing import Protocol, cast

import attrs

from campaign import families
from campaign.case import Case, Outcome, evaluated
from campaign.child import idle_mb, ran

COLUMNS = ("family", "cases", *(outcome.value for outcome in Outcome), "worst memory [MB]", "worst time [s]")


class Family(Protocol):
    """What a module in families/ holds."""

    SHORT: int
    LONG: int

    def warm(self) -> None:
        """Import and compile what the cases share, once, in the parent."""

    def case(self, seed: int) -> Case:
        """Make the case of a seed, the same one always."""


@attrs.frozen
class Result:
    """What came of one case."""

    family: str
    seed: int
    description: str
    outcome: Outcome
    why: str
    memory_mb: float
    seconds: float

    def __str__(self) -> str:
        what = f"{self.family} {self.seed}: {self.outcome.value}: {self.why[:300]}"
        return f"{what} [{self.description}] ({self.memory_mb:.0f} MB, {self.seconds:.1f} s)"


def names() -> list[str]:
    """Families that there are."""
    return [each.name for each in pkgutil.iter_modules(families.__path__)]


def load(name: str) -> Family:
    """The module of a family."""
    return cast(Family, import_module(f"campaign.families.{name}"))


def missing(name: str) -> str:
    """Module that a family needs and that is not installed; empty if all are there."""
    try:
        load(name)
    except ModuleNotFoundError as error:
        if (error.name or "").split(".")[0] not in ("campaign", "leg_wear_monitor"):
            return error.name or "?"
        raise
    return ""


def run(name: str, seeds: Iterable[int], keep: Path | None = None) -> Iterator[Result]:
    """Run cases of a family one by one, in a process that is warm and in which nothing else runs."""
    family = load(name)
    family.warm()
    idle = idle_mb()
    for seed in seeds:
        case = family.case(seed)
        with tempfile.TemporaryDirectory(prefix=f"{name}_{seed}_", ignore_cleanup_errors=True) as place:
            directory = keep or Path(place)
            left = ran(case, directory, idle)
            outcome, why = evaluated(case, left)
        yield Result(name, seed, case.description, outcome, why, left.memory_mb, left.seconds)


def run_all(name: str, seeds: range, jobs: int) -> Iterator[Result]:
    """Run the cases of seeds in so many processes at once, in order of their seeds within each."""
    context = multiprocessing.get_context("spawn")
    results = context.SimpleQueue()
    workers = [context.Process(target=_work, args=(name, seeds[job::jobs], results)) for job in range(jobs)]
    for worker in workers:
        worker.start()
    running = jobs
    while running:
        result = results.get()
        if isinstance(result, Result):
            yield result
        else:
            running -= 1
            if result is not None:
                raise RuntimeError(f"{name}: {result}")
    for worker in workers:
        worker.join()


def _work(name: str, seeds: range, results: "multiprocessing.SimpleQueue[object]") -> None:
    fault: str | None = "the worker died"
    try:
        for result in run(name, seeds):
            results.put(result)
        fault = None
    except Exception as error:  # noqa: BLE001 - told to the parent, which raises it
        fault = f"{type(error).__name__}: {error}"
    finally:
        results.put(fault)


def row(name: str, results: list[Result]) -> tuple[str, ...]:
    """The row of a table: `COLUMNS`."""
    counts = Counter(result.outcome for result in results)
    memory = max((result.memory_mb for result in results), default=0.0)
    seconds = max((result.seconds for result in results), default=0.0)
    statistics = [str(counts[outcome]) for outcome in Outcome]
    return (name, str(len(results)), *statistics, f"{memory:.0f}", f"{seconds:.1f}")


def table(rows: list[tuple[str, ...]]) -> str:
    """Rows below their heads, in columns."""
    lines = [COLUMNS, *rows]
    widths = [max(len(line[k]) for line in lines) for k in range(len(COLUMNS))]
    return "\n".join(
        "  ".join(
            [line[0].ljust(widths[0]), *(cell.rjust(n) for cell, n in zip(line[1:], widths[1:], strict=True))]
        )
        for line in lines
    )

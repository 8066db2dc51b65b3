"""Worker processes in a directory of traps, some of which are killed: the same results, nothing imported."""

import operator
import os
import signal
import sys
from functools import partial
from pathlib import Path

import numpy as np

from campaign.case import Case, Outcome
from leg_wear_monitor.workers import Calls, results

SHORT, LONG = 4, 60

_JOBS = 20
_NAMES = sorted({*sys.stdlib_module_names, "leg_wear_monitor", "joblib", "numba", "numpy", "sitecustomize"})


def warm() -> None:
    """Nothing: a child starts its own."""


def _die_once(mark: str, number: int) -> int:
    """Kill the worker at the first call."""
    if not Path(mark).exists():
        Path(mark).touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return number + 1


def case(seed: int) -> Case:
    """Two or three workers, one of which dies in every second case."""
    rng = np.random.default_rng(seed)
    traps = [name for name in _NAMES if rng.random() < rng.choice([0.02, 0.5, 1.0])]
    workers, dies = 2 + int(rng.integers(2)), bool(seed % 2)

    def prepare(directory: Path) -> None:
        for name in traps:
            (directory / f"{name}.py").write_text(
                f"open({str(directory / 'told')!r}, 'a').write({name!r} + ' ')"
            )

    def run(directory: Path) -> tuple[Outcome, str]:
        sys.path[:] = [path for path in sys.path if path]
        calls: Calls = {f"{k}": partial(operator.add, k, 1) for k in range(_JOBS)}
        if dies:
            last = f"{_JOBS - 1}"
            calls = {**calls, last: partial(_die_once, str(directory / "died"), _JOBS - 1)}
        found = dict(results(calls, workers))
        if (imported := directory / "told").exists():
            return Outcome.SILENT, f"imported {imported.read_text()}"
        is_all = found == {f"{k}": k + 1 for k in range(_JOBS)}
        return (Outcome.SOUND, "") if is_all else (Outcome.SILENT, f"results {found}")

    return Case(
        description=f"{workers} workers, {len(traps)} traps{', one dies' if dies else ''}",
        run=run,
        prepare=prepare,
    )

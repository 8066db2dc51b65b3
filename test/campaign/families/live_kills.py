"""A live monitor killed at random instants: no damage, at most the interval lost, nothing counted twice."""

import os
import random
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from campaign.case import Case, Outcome
from campaign.warm_twin import keep_twin

KILLS = 4  # in each case, of one ledger
SHORT, LONG = 2, 50


def warm() -> None:
    """Import and compile all that a walk needs."""
    keep_twin()


def case(seed: int) -> Case:
    """Kills of the walks on one ledger."""
    return Case(
        description=f"{KILLS} kills of a live monitor",
        run=lambda directory: _killed(directory / "wear.ledger", random.Random(seed)),
        seconds=300.0,
    )


def _killed(path: Path, choose: random.Random) -> tuple[Outcome, str]:
    from monitor.ledger.test_kill import check, kept

    lost_s = []
    for _ in range(KILLS):
        before = kept(path)
        with _walk(path) as (pid, lines):
            said = [
                next(lines) for _ in range(choose.choice([0, choose.randrange(200), choose.randrange(200)]))
            ]
            time.sleep(choose.uniform(0.0, 0.02))
            os.kill(pid, signal.SIGKILL)
            said += lines
        told = [line.split() for line in said if line.endswith("\n")]
        try:
            lost_s.append(check(told[1:], before, kept(path)))
        except AssertionError as error:
            return Outcome.SILENT, " ".join(str(error).split())
    new = [f"{lost:.3f}" for lost in lost_s if lost is not None]
    return Outcome.SOUND, f"lost {', '.join(new)} s of new gait"


@contextmanager
def _walk(path: Path) -> Iterator[tuple[int, Iterator[str]]]:
    """A walker in a process of its own, and the lines that it says."""
    reading, writing = os.pipe()
    pid = os.fork()
    if pid == 0:
        try:
            os.dup2(writing, 1)
            os.close(reading)
            from monitor.ledger.test_kill import CHECKPOINT_S
            from monitor.ledger.walker import walk

            walk(str(path), CHECKPOINT_S, 0.0, 10_000.0)
        finally:
            os._exit(0)
    os.close(writing)
    with open(reading) as pipe:
        yield pid, iter(pipe.readline, "")
    os.waitpid(pid, 0)

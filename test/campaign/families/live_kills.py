"""A live monitor killed at random instants: no damage, at most the interval lost, nothing counted twice."""

import os
import random
import signal
import sqlite3
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from itertools import pairwise
from pathlib import Path

from campaign.case import Case, Outcome
from campaign.warm_twin import keep_twin

KILLS = 4  # in each case, of one ledger
SHORT, LONG = 2, 50
START_NS, RATE_HZ, BLOCK = 1_700_000_000_000_000_000, 200, 20
CHECKPOINT_S, LAG_S = 0.5, 0.25

Kept = tuple[int, dict[str, float], list[tuple[int, int]]]


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
    lost_s = []
    for _ in range(KILLS):
        before = _kept(path)
        with _walker(path) as (pid, lines):
            said = [
                next(lines) for _ in range(choose.choice([0, choose.randrange(200), choose.randrange(200)]))
            ]
            time.sleep(choose.uniform(0.0, 0.02))
            os.kill(pid, signal.SIGKILL)
            said += lines
        written = [line.split() for line in said if line.endswith("\n")]
        try:
            lost_s.append(_lost_s(written, before, _kept(path)))
        except AssertionError as error:
            return Outcome.SILENT, " ".join(str(error).split())
    new = [f"{lost:.3f}" for lost in lost_s if lost is not None]
    return Outcome.SOUND, f"lost {', '.join(new)} s of new gait"


@contextmanager
def _walker(path: Path) -> Iterator[tuple[int, Iterator[str]]]:
    """A monitor in a process of its own, and the lines that it says."""
    reading, writing = os.pipe()
    pid = os.fork()
    if pid == 0:
        try:
            os.dup2(writing, 1)
            os.close(reading)
            _walk(str(path))
        finally:
            os._exit(0)
    os.close(writing)
    with open(reading) as pipe:
        yield pid, iter(pipe.readline, "")
    os.waitpid(pid, 0)


def _walk(path: str) -> None:
    """An endless steady gait on a ledger, always the same one; says how far it is.

    Lines are ``begin NS`` before a block is handed on and ``end NS`` after; NS is the block's last stamp.
    """
    import numpy as np

    import leg_wear_monitor as lw
    from leg_wear_monitor.monitor.config.parameters import config_from

    config, leg = config_from({"ledger.path": path, "ledger.checkpoint_s": CHECKPOINT_S}), lw.load_mechanism()
    ledger = lw.open_ledger(leg, config)
    monitor = lw.WearMonitor(leg, config, ledger)
    monitor.warm_up()
    print("started", ledger.kept_ns, flush=True)
    for first in range(0, 10_000 * RATE_HZ, BLOCK):
        n = np.arange(first, first + BLOCK)
        stamps = START_NS + n * (10**9 // RATE_HZ)
        print("begin", int(stamps[-1]), flush=True)
        monitor.update(lw.gait_samples(stamps, crank_angle_rad=2.0 * np.pi * n / RATE_HZ % (2.0 * np.pi)))
        print("end", int(stamps[-1]), flush=True)


def _kept(path: Path) -> Kept:
    """What the ledger holds: last stamp, totals, spans; its loads are those of the gait cycles, each once."""
    from leg_wear_monitor.monitor.ledger.rows import read_entry, read_loads
    from leg_wear_monitor.monitor.ledger.schema import verify

    if not path.exists():
        return 0, {}, []
    with closing(sqlite3.connect(path)) as db:
        spans = sorted(set(db.execute("SELECT begin_ns, end_ns FROM span")))
        verify(db)
        entry, loads = read_entry(db), read_loads(db)
    if entry is None:
        return 0, {}, spans
    assert sum(load.cycles for load in loads) == entry.totals["cycles"]
    return entry.stamp_ns, entry.totals, spans


def _lost_s(said: list[list[str]], before: Kept, after: Kept) -> float | None:
    """Hold what a walker said to what its ledger held and holds; time lost [s], if any was new."""
    stamps = {word: [int(line[1]) for line in said if line[0] == word] for word in ("begin", "end")}
    reached, begun = max(stamps["end"], default=0), max(stamps["begin"], default=0)
    stamp_ns, totals, spans = after
    if said:
        assert said[0] == ["started", str(before[0])], "an entry was lost"
    assert all(first[1] < second[0] for first, second in pairwise(spans)), "time was counted twice"
    counted_s = sum(end - begin for begin, end in spans) * 1e-9
    assert totals.get("moving_s", 0.0) <= counted_s + 0.05 * (1 + len(spans)), "wear was counted twice"
    assert stamp_ns <= max(begun, before[0])
    if reached <= before[0]:
        return None
    lost_s = (reached - max(stamp_ns, START_NS)) * 1e-9  # there may be no entry yet
    assert lost_s <= CHECKPOINT_S + LAG_S + BLOCK / RATE_HZ, f"{lost_s:.3f} s were lost"
    return lost_s

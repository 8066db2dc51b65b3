"""``kill -9`` at random instants: no damage, at most the interval lost, nothing counted twice.

As a script, ``python test/monitor/ledger/test_kill.py [KILLS]``, it kills 200 times and prints what it found.
"""

import random
import sqlite3
import subprocess
import sys
import tempfile
import time
from contextlib import closing
from itertools import pairwise
from pathlib import Path

import pytest

from leg_wear_monitor.monitor.ledger.rows import read_entry, read_loads
from leg_wear_monitor.monitor.ledger.schema import verify

WALKER = Path(__file__).parent / "walker.py"
CHECKPOINT_S, LAG_S, BLOCK_S = 0.5, 0.25, 0.1
TIMEOUT_S = 900.0
START_NS = 1_700_000_000_000_000_000


class Run:
    """A walker, until it is killed or done."""

    def __init__(self, path, begin_s, end_s):
        command = [sys.executable, str(WALKER), str(path), str(CHECKPOINT_S), str(begin_s), str(end_s)]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        assert self.process.stdout.readline() == "opening\n"

    def kill_after(self, lines, seconds):
        """Kill it so long after so many lines; the whole lines that it said, as lists of words."""
        said = [self.process.stdout.readline() for _ in range(lines)]
        time.sleep(seconds)
        self.process.kill()
        said += self._rest().splitlines(keepends=True)
        return [line.split() for line in said if line.endswith("\n")]

    def finish(self):
        """Its exit code, once it is done."""
        self._rest()
        return self.process.returncode

    def _rest(self):
        with self.process.stdout as pipe:
            rest = pipe.read()
        self.process.wait(TIMEOUT_S)
        return rest


def kept(path):
    """What the ledger holds: last stamp, totals, spans; its loads are those of the gait cycles, each once."""
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


def check(said, before, after):
    """Hold what a walker said to what its ledger held and holds; time lost [s], if any was new."""
    stamps = {word: [int(line[1]) for line in said if line[0] == word] for word in ("begin", "end")}
    reached, begun = max(stamps["end"], default=0), max(stamps["begin"], default=0)
    stamp_ns, totals, spans = after
    if said:
        assert said[0][:2] == ["started", str(before[0])], "an entry was lost"
    assert all(first[1] < second[0] for first, second in pairwise(spans)), "time was counted twice"
    counted_s = sum(end - begin for begin, end in spans) * 1e-9
    assert totals.get("moving_s", 0.0) <= counted_s + 0.05 * (1 + len(spans)), "wear was counted twice"
    assert stamp_ns <= max(begun, before[0])
    if reached <= before[0]:
        return None
    lost_s = (reached - max(stamp_ns, START_NS)) * 1e-9  # there may be no entry yet
    assert lost_s <= CHECKPOINT_S + LAG_S + BLOCK_S, f"{lost_s:.3f} s were lost, more than the interval"
    return lost_s


def kill_often(path, kills, seed):
    """Kill a walker again and again, opening or walking; times lost [s], None without new gait."""
    choose = random.Random(seed)
    lost_s = []
    for _ in range(kills):
        before = kept(path)
        run = Run(path, 0.0, 10_000.0)  # begins where the first one did: the walk comes again
        lines = choose.choice([0, choose.randrange(100), choose.randrange(100)])
        said = run.kill_after(lines, choose.uniform(0.0, 0.02))
        lost_s.append(check(said, before, kept(path)))
    return lost_s


@pytest.mark.slow  # doors/test_kills.py holds the last entry, test_kept_wear.py its interval
def test_kills_lose_at_most_the_interval_and_count_nothing_twice(tmp_path):
    from monitor.ledger.walker import walk  # a script does not find it there

    path = tmp_path / "wear.ledger"
    kill_often(path, 3, seed=5)
    end_s = max(0.0, (kept(path)[0] - START_NS) * 1e-9) + 4.0
    walk(str(path), CHECKPOINT_S, max(0.0, end_s - 5.0), end_s)
    whole = kept(path)
    assert whole[1]["cycles"] >= 2
    walk(str(path), CHECKPOINT_S, max(0.0, end_s - 5.0), end_s)  # the same walk once more adds nothing
    assert kept(path)[1:] == whole[1:]


def worn_m(path):
    """Mean depth of bushing and journal of joint A together."""
    with closing(sqlite3.connect(path)) as db:
        (worn_m,) = db.execute("SELECT bushing_m + journal_m FROM joint WHERE name = 'A'").fetchone()
    return worn_m


def main(kills):
    with tempfile.TemporaryDirectory() as directory:
        path, calm = Path(directory) / "wear.ledger", Path(directory) / "calm.ledger"
        assert Run(path.with_name("other.ledger"), 0.0, 0.5).finish() == 0  # compiles, if nobody has
        lost_s = sorted(lost for lost in kill_often(path, kills, seed=1) if lost is not None)
        _, totals, spans = kept(path)
        Run(calm, 0.0, 60.0).finish()
        rates = [worn_m(each) / kept(each)[1]["moving_s"] for each in (path, calm)]
    print(f"{kills} kills, {len(lost_s)} of them after new gait was followed; no ledger damaged")
    median = lost_s[len(lost_s) // 2]
    print(f"an entry each {CHECKPOINT_S} s; lost: median {median:.3f} s, most {lost_s[-1]:.3f} s")
    print(f"ledger: {totals['cycles']:.0f} gait cycles, {totals['moving_s']:.2f} s in {len(spans)} spans")
    print(f"wear of A {rates[0]:.3g} m/s, {rates[1]:.3g} m/s without kills")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 200)

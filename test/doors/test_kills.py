"""Seams and kills: wear is exact to the last entry, nothing counts twice, reports go on as they were."""

import json
import random
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import leg_wear_monitor as lw

HERE = Path(__file__).parent
BAG = lw.share_directory() / "bags" / "healthy.mcap"
SECONDS = 6.0


@pytest.fixture
def walker():
    """The script that is killed, as a module."""
    sys.path.insert(0, str(HERE))
    try:
        import walker
    finally:
        sys.path.remove(str(HERE))
    return walker


@pytest.fixture
def parameters(tmp_path: Path) -> Path:
    """A parameter file with a ledger that is written when it is asked for."""
    file, ledger = tmp_path / "monitor.yaml", tmp_path / "wear.ledger"
    file.write_text(f"/**: {{ros__parameters: {{ledger: {{path: {ledger}, checkpoint_s: 600.0}}}}}}\n")
    return file


def told(reports) -> list[object]:
    """What reports say, to the bit."""
    cycles = [repr(cycle) for each in reports for cycle in each.cycles]
    alarms = [repr(change) for each in reports for change in (*each.alarms, *each.verdicts)]
    return [cycles, alarms, repr(reports[-1].lost)]


def test_a_restored_monitor_reports_to_the_bit_what_the_first_one_did(walker) -> None:
    blocks = list(walker.walk(0.0, SECONDS))
    monitor = lw.WearMonitor(lw.load_mechanism())
    for block in blocks[:23]:
        monitor.update(block)
    middle = monitor.snapshot()
    first, worn = told([monitor.update(block) for block in blocks[23:]]), walker.digest(monitor)
    monitor.restore(middle)
    assert told([monitor.update(np.concatenate(blocks[23:]))]) == first
    assert walker.digest(monitor) == worn
    assert len(first[0]) >= 3


def test_a_killed_monitor_has_kept_its_last_entry_exactly_and_counts_no_time_twice(
    walker, parameters
) -> None:
    choose, kept = random.Random(7), None
    for _ in range(2):
        line = [sys.executable, str(HERE / "walker.py"), str(parameters)]
        with subprocess.Popen(line, stdout=subprocess.PIPE, text=True) as process:
            said = [process.stdout.readline() for _ in range(choose.randrange(3, 20))]
            time.sleep(choose.uniform(0.0, 0.02))
            process.kill()
            said += process.stdout.readlines()
        words = [each.split() for each in said if each.endswith("\n")]
        assert kept in (None, words[0][1]), "it began with another wear than it had kept"
        saved = next((wear for word, wear in reversed(words) if word in ("started", "saved")))
        monitor = walker.opened(str(parameters))
        kept = walker.digest(monitor)
        assert kept in (saved, words[-1][1])  # killed while or after it was saved
        monitor.abandon()
    monitor = walker.opened(str(parameters))
    cycles = [cycle for block in walker.walk(0.0, SECONDS) for cycle in monitor.update(block).cycles]
    assert cycles and monitor.lost.already_counted > 0
    assert monitor.wear_of("A").moving_s <= SECONDS
    monitor.close()
    whole = walker.opened(str(parameters))
    before = walker.digest(whole)
    for block in walker.walk(0.0, SECONDS - 1.0):
        whole.update(block)
    assert walker.digest(whole) == before
    whole.close()


def contents(directory: Path) -> tuple[bytes, dict[str, object]]:
    """Reports and summary of a replay, but for what tells how long it took."""
    summary = json.loads((directory / "summary.json").read_text())
    left_out = ("wall_s", "real_time_factor", "made_with")
    return (directory / "reports.mcap").read_bytes(), {
        key: value for key, value in summary.items() if key not in left_out
    }


def test_a_killed_replay_that_is_repeated_gives_what_an_uninterrupted_one_gives(run, tmp_path: Path) -> None:
    def line(name: str) -> list[object]:
        parts = {"--config": BAG.with_suffix(".yaml"), "--ledger": tmp_path / f"{name}.ledger"}
        return [
            "replay",
            BAG,
            *(word for option in parts.items() for word in option),
            "--out",
            tmp_path / name,
        ]

    assert run(*line("whole")).code == 0
    killed, choose = tmp_path / "killed", random.Random(3)
    command = [sys.executable, "-m", "leg_wear_monitor", *line("killed")]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        while process.poll() is None and not any(killed.glob("*")):
            time.sleep(0.01)  # until it writes
        time.sleep(choose.uniform(0.0, 0.3))
        process.kill()
    assert run(*line("killed")).code in (0, 1)  # 1 if it came to its end before it was killed
    assert contents(killed) == contents(tmp_path / "whole")
    again = run(*line("killed"))
    assert (again.code, contents(killed)) == (1, contents(tmp_path / "whole"))  # all of it is counted already

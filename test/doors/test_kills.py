"""Seams and kills: wear is exact to the last entry, and nothing counts twice."""

import itertools
import json
import random
import shutil
import subprocess
import sys
import time
from pathlib import Path

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


def parameters(home: Path) -> str:
    """A parameter file with a ledger in a directory, which is written when it is asked for."""
    file, ledger = home / "monitor.yaml", home / "wear.ledger"
    file.write_text(f"/**: {{ros__parameters: {{ledger: {{path: {ledger}}}}}}}\n")
    return str(file)


def killed(walker, parameters: str, lines: int, blocks: int) -> int:
    """Kill a monitor some time after it has said so many lines; the number of blocks it said are kept."""
    line = [sys.executable, str(HERE / "walker.py"), parameters, str(blocks)]
    with subprocess.Popen(line, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        said = [process.stdout.readline() for _ in range(lines)]
        time.sleep(random.Random(lines).uniform(0.0, 0.02))
        process.kill()
        said += [each for each in process.stdout if each.endswith("\n")]
    return int(said[-1].split()[1])


def test_a_killed_monitor_has_kept_its_last_entry_exactly_and_counts_no_time_twice(walker, tmp_path) -> None:
    home, more = tmp_path / "killed", walker.TOGETHER
    home.mkdir()
    for lines, blocks in ((7, 10_000), (4, 3 * more)):  # while it walks, and while it waits
        before = parameters(shutil.copytree(home, tmp_path / f"before {lines}"))
        saved = killed(walker, parameters(home), lines, blocks)
        monitor = walker.opened(before)
        states = []
        for block in itertools.islice(walker.walk(0.0, 100.0), saved + more):
            monitor.update(block)
            states.append(monitor.wear_depth_m)
        least, most = states[saved - 1], states[-1]
        monitor.close()
        monitor = walker.opened(parameters(home))
        kept = monitor.wear_depth_m
        if blocks == saved:
            assert kept.tobytes() == least.tobytes()
        else:  # or the entry that came after the one that it said
            assert kept.tobytes() in (least.tobytes(), most.tobytes())
        monitor.abandon()
    for _ in range(2):  # the walk from its beginning, again and again
        monitor = walker.opened(parameters(home))
        for block in walker.walk(0.0, SECONDS):
            monitor.update(block)
        assert monitor.lost.already_counted > 0
        assert SECONDS - 2.0 < monitor.wear_of("A").moving_s <= SECONDS
        monitor.close()


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

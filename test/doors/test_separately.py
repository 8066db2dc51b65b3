"""``replay --separately``: the verdict of each recording as if it were replayed alone, and one table."""

import csv
import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import leg_wear_monitor as lw

pytest.importorskip("mcap", reason="the extra 'bags' is not installed")

BAGS = lw.share_directory() / "bags"
NAMES = ("healthy", "knocking", "bad_input")


@pytest.fixture(scope="module")
def separately(run, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Directory of three recordings, and of one that cannot be read."""
    home = tmp_path_factory.mktemp("separately")
    (home / "trash.mcap").write_text("no recording\n")
    bags = [*(BAGS / f"{name}.mcap" for name in NAMES), home / "trash.mcap"]
    options = ("--config", BAGS / "knocking.yaml", "--workers", 2, "--out", home / "out")
    done = run("replay", *bags, "--separately", *options)
    assert done.code == 1
    assert [line for line in done.lines if line.startswith("error")] == [
        f"error: {home}/trash.mcap: begins with b'no recor', "
        "expected b'\\x89MCAP0\\r\\n': is not an MCAP file"
    ]
    return home / "out"


def test_a_recording_is_what_it_is_alone(separately: Path, tmp_path: Path) -> None:
    """In a process of its own: the last digits depend on the process's threads for linear algebra."""
    line = ["replay", BAGS / "knocking.mcap", "--config", BAGS / "knocking.yaml", "--out", tmp_path]
    subprocess.run([sys.executable, "-m", "leg_wear_monitor", *line], check=True, capture_output=True)
    alone, among = (
        json.loads((out / "summary.json").read_text()) for out in (tmp_path, separately / "knocking")
    )
    for summary in (alone, among):
        del summary["wall_s"], summary["real_time_factor"]
    assert alone == among
    assert (tmp_path / "reports.mcap").read_bytes() == (separately / "knocking" / "reports.mcap").read_bytes()


def test_the_table_has_verdict_wear_and_hours(separately: Path) -> None:
    lines = (separately / "recordings.csv").read_text().splitlines()
    rows = {row["recording"]: row for row in csv.DictReader(lines)}
    assert list(rows) == [*NAMES, "trash"]
    verdicts = [(row["verdict"], row["code"], row["joints"]) for row in rows.values()]
    assert verdicts == [
        ("healthy", "NONE", ""),
        ("stop", "CLEARANCE_SEEN_G", "G"),
        ("not_monitored", "BAD_INPUT", ""),
        ("", "", ""),
    ]
    assert 11.9 < 3600.0 * float(rows["healthy"]["hours"]) < 12.1
    assert 1.0e-10 < float(rows["healthy"]["wear_A_m"]) < 1.0e-9
    assert [row["failed"] for row in rows.values()] == ["0", "0", "0", "1"]


def test_what_cannot_be_done_separately_is_one_line(run, tmp_path: Path) -> None:
    shutil.copy(BAGS / "healthy.mcap", tmp_path)
    two = (BAGS / "healthy.mcap", tmp_path / "healthy.mcap")
    for line, fault in (
        (("--separately",), "--separately needs --out DIR"),
        (("--workers", 2), "--workers needs --separately"),
        (("--separately", "--out", tmp_path, "--ledger", "l"), "a ledger counts recordings in their order"),
        (("--separately", "--out", tmp_path, "--json", "-"), "--separately and --json cannot be combined"),
        (("--separately", "--out", tmp_path), "healthy: 2 recordings have this name"),
    ):
        done = run("replay", *two, *line)
        assert done.code == 2
        assert len(done.lines) == 1
        assert fault in done.lines[0]

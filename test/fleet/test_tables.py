"""A fleet's history as tables: for Python, as files, and from the command line."""

import csv
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from click.testing import CliRunner

import leg_wear_monitor as lw
from leg_wear_monitor.cli.main import cli
from leg_wear_monitor.fleet.directory import LegDirectory
from leg_wear_monitor.fleet.update import TABLES

parquet = pytest.importorskip("pyarrow.parquet", reason="the extra 'fleet' is not installed")

pytestmark = pytest.mark.usefixtures("one_twin")


@pytest.fixture(scope="module")
def home(walk, describe, tmp_path_factory):
    """A fleet of two legs with a row a gait cycle; the walk of the first spans the end of a minute."""
    home = tmp_path_factory.mktemp("fleet")
    walk(home / "a/1.mcap", begin_s=38.0, seconds=5.0)
    walk(home / "b/1.mcap", seed=3)
    (home / "b/2.mcap").write_bytes(b"no recording" * 10)
    describe(home, "a", "b", row="cycle")
    return home


@pytest.fixture(scope="module")
def fleet(home, update):
    """The fleet after an update, found by its description."""
    update(home / "fleet.yaml", home / "fleet")
    return lw.Fleet(home / "fleet.yaml")


def test_the_overview_is_that_of_the_update(fleet, home):
    assert fleet.path == home / "fleet"
    assert [leg.id for leg in fleet.overview.legs] == ["a", "b"]
    assert sum(fleet.overview.counts.values()) == 2
    assert lw.Fleet(home / "fleet").overview == fleet.overview


def test_cycles_have_a_row_a_gait_cycle(fleet):
    table = fleet.table("cycles").to_pydict()
    assert sorted(table["leg"]) == table["leg"]
    assert set(table["cycles"]) == {1}
    ends = zip(table["leg"], table["stamp_ns"], strict=True)
    steps = np.diff([stamp for leg, stamp in ends if leg == "a"])
    assert steps == pytest.approx(1.0e9, rel=1.0e-3)
    assert np.array(table["cadence_rpm"]) == pytest.approx(60.0, rel=1.0e-3)
    for joint in "ABGIJ":
        used = np.array(table[f"used_fraction.{joint}"])
        assert used == pytest.approx((np.array(table[f"clearance_m.{joint}"]) - 0.3e-3) / 0.3e-3, abs=1.0e-9)
        assert np.all(np.array(table[f"peak_force_n.{joint}"]) >= np.array(table[f"mean_force_n.{joint}"]))


def test_what_was_counted_last_stands_last_though_it_was_found_first(tmp_path):
    directory = LegDirectory(tmp_path, "a")
    for key, outcome in (("1", "unreadable"), ("2", "counted"), ("1", "counted"), ("3", "unreadable")):
        directory.renew({"key": key, "outcome": outcome})
    assert [line["key"] for line in directory.last_lines()] == ["2", "1", "3"]
    assert directory.last_counted()["key"] == "1"


def test_a_row_a_minute_sums_up_its_gait_cycles(fleet, home, describe, update, tmp_path):
    cycles = fleet.table("cycles").to_pydict()
    (tmp_path / "a").symlink_to(home / "a")
    update(describe(tmp_path, "a"), tmp_path / "fleet")
    minutes = lw.Fleet(tmp_path / "fleet").table("cycles").to_pydict()
    of_a = [k for k, leg in enumerate(cycles["leg"]) if leg == "a"]
    minute = np.array([cycles["stamp_ns"][k] // (60 * 10**9) for k in of_a])
    assert len(minutes["leg"]) == len(set(minute)) == 2
    for row, begin in enumerate(sorted(set(minute))):
        group = [of_a[k] for k in np.flatnonzero(minute == begin)]
        assert minutes["cycles"][row] == len(group)
        assert minutes["clearance_m.A"][row] == cycles["clearance_m.A"][group[-1]]
        assert minutes["peak_force_n.A"][row] == max(cycles["peak_force_n.A"][k] for k in group)
        assert minutes["impacts.A"][row] == sum(cycles["impacts.A"][k] for k in group)
        mean = np.mean([cycles["mean_force_n.A"][k] for k in group])
        assert minutes["mean_force_n.A"][row] == pytest.approx(mean, rel=1.0e-6)


def test_records_of_recordings_verdicts_and_lives(fleet):
    recordings = fleet.table("recordings").to_pydict()
    assert recordings["file"] == ["a/1.mcap", "b/2.mcap", "b/1.mcap"]
    assert recordings["outcome"] == ["counted", "unreadable", "counted"]
    assert recordings["findings"][1].endswith("is not an MCAP file")
    assert recordings["unmonitored_s"][1] is None
    verdicts, legs = fleet.table("verdicts").to_pydict(), fleet.overview.legs
    assert verdicts["leg"] == ["a", "b"]
    assert verdicts["state"] == [leg.verdict.state.value for leg in legs]
    assert verdicts["stamp_ns"] == [leg.recordings.end_ns for leg in legs]
    lives = fleet.table("lives").to_pydict()
    assert lives["joint"] == ["A", "B", "G", "I", "J", "leg"] * 2
    assert lives["used_fraction"][:5] == list(legs[0].used_fraction.values())
    assert lives["used_fraction"][5] is None
    expected = [life.p50_h if life else None for life in legs[0].life.values()]
    assert lives["p50_h"][:6] == expected


def test_export_writes_each_table_as_csv_and_parquet(fleet, tmp_path):
    done = CliRunner().invoke(cli, ["fleet", "export", str(fleet.path), "--out", str(tmp_path / "x")])
    assert done.exit_code == 0
    names = [f"{name}.{end}" for name in TABLES for end in ("csv", "parquet")]
    assert done.output.splitlines() == [f"written: {tmp_path}/x/{name}" for name in names]
    for name in TABLES:
        table = fleet.table(name)
        written = parquet.read_table(tmp_path / "x" / f"{name}.parquet")
        assert written.schema.equals(table.schema)
        assert repr(written.to_pydict()) == repr(table.to_pydict())  # so that NaN equals NaN
        with (tmp_path / "x" / f"{name}.csv").open(newline="") as file:
            rows = list(csv.DictReader(file))
        assert [row["leg"] for row in rows] == table.column("leg").to_pylist()
        assert list(rows[0]) == table.column_names


def test_a_fleet_that_is_none_is_one_line(tmp_path):
    with pytest.raises(lw.ConfigError, match=r"fleet\.json: cannot be read: No such file.* fleet update"):
        lw.Fleet(tmp_path)


def test_with_pandas_they_are_frames(fleet):
    pytest.importorskip("pandas")
    lives = fleet.lives().query("leg == 'a'")
    assert list(lives.joint) == ["A", "B", "G", "I", "J", "leg"]
    assert set(lives.believed_by[:-1]) <= {"counted", "torque", "encoders", "measured", "both"}
    assert set(lives.status[:-1]) <= {"healthy", "watch", "not_monitored", "inspect", "stop"}
    assert len(fleet.cycles()) == fleet.table("cycles").num_rows
    assert len(fleet.verdicts()) == 2 and len(fleet.recordings()) == 3


def test_the_command_says_what_is_lost_and_then_that_nothing_is_left(home, tmp_path):
    arguments = ["fleet", "update", str(home / "fleet.yaml"), "--out", str(tmp_path / "o"), "--workers", "1"]
    first, second = (CliRunner().invoke(cli, arguments) for _ in range(2))
    assert (first.exit_code, second.exit_code) == (1, 0)
    assert "warning: b: b/2.mcap: unreadable" in first.stderr
    assert "recordings: 2 counted now" in first.stdout
    assert "everything is in the ledger already" in second.stdout
    assert second.stderr == ""


def test_followed_it_takes_what_is_completed_and_ends_well(home, walk, describe, tmp_path):
    (tmp_path / "a").mkdir()
    path = describe(tmp_path, "a")
    command = [sys.executable, "-m", "leg_wear_monitor", "fleet", "update", str(path), "--follow"]
    quiet = {**os.environ, "PYTHONUNBUFFERED": "1"}
    options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True, "env": quiet}
    with subprocess.Popen([*command, "--every-s", "0.2", "--workers", "1"], **options) as program:
        try:
            assert program.stdout.readline() == "following; ^C ends it\n"
            content = (home / "a/1.mcap").read_bytes()
            (tmp_path / "a/1.mcap").write_bytes(content[:5000])
            time.sleep(0.5)
            (tmp_path / "a/1.mcap").write_bytes(content)
            line = program.stdout.readline()
            program.send_signal(signal.SIGTERM)
            _, errors = program.communicate(timeout=60)
        finally:
            program.kill()
    assert line.startswith("a: a/1.mcap: counted, ")
    assert "parts of it are lost" not in line
    assert program.returncode == 0
    assert [text for text in errors.splitlines() if "matches no recording" not in text] == []

"""Bad input of a fleet by the command line: one line each, with file, key, value and what was expected."""

import csv
import inspect

import numpy as np
import pytest
from click.testing import CliRunner

import leg_wear_monitor as lw
from leg_wear_monitor.cli.main import cli

pytest.importorskip("pyarrow", reason="the extra 'fleet' is not installed")

pytestmark = pytest.mark.usefixtures("one_twin")

RATE_HZ, BEGIN_MS = 200, 1_772_352_000_000
NAMES = ["t_ms", "angle_deg", "torque_Nmm"]
CONFIG = """
/**:
  ros__parameters:
    input:
      columns: {stamp: t_ms, crank_angle: angle_deg, drive_torque: torque_Nmm}
      units: {stamp: ms, crank_angle: deg, drive_torque: N mm}
"""


@pytest.fixture(scope="module")
def torque_nm(leg):
    """Drive torque of the ideal leg over a gait cycle at 60 rpm."""
    ideal = lw.simulate(leg, clearances=[], cycles=1, trace=360).trace
    order = np.argsort(ideal.crank_angle_rad)
    angle = 2.0 * np.pi * np.arange(RATE_HZ) / RATE_HZ
    return np.interp(angle, ideal.crank_angle_rad[order], ideal.drive_torque_nm[order], period=2.0 * np.pi)


@pytest.fixture
def lab(tmp_path, torque_nm):
    """Write a walk of a leg as a table of a laboratory, and its fleet file."""
    (tmp_path / "lab.yaml").write_text(CONFIG)

    def write(name, begin_ms=BEGIN_MS, seconds=4.0, names=NAMES, factor=1000.0, zero_deg=0.0, seed=0):
        n = np.arange(round(seconds * RATE_HZ))
        angle = (n * 360.0 / RATE_HZ + np.random.default_rng(seed).normal(0.0, 0.01, len(n)) + zero_deg) % 360
        rows = zip(
            begin_ms + 5 * n,
            angle.round(4),
            (factor * np.take(torque_nm, n, mode="wrap")).round(5),
            strict=True,
        )
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        with path.open("w", newline="") as file:
            csv.writer(file).writerows([names, *rows])
        return path

    return write


@pytest.fixture
def command(tmp_path):
    """Run a verb on a description with these legs: exit code, lines on stdout and on stderr."""

    def call(*verb, legs='{id: a, recordings: "a/*"}'):
        path = tmp_path / "fleet.yaml"
        path.write_text(f"defaults: {{config: lab.yaml}}\nlegs: [{legs}]\n")
        more = ["--workers", "1"] if "update" in verb else []
        old = "mix_stderr" in inspect.signature(CliRunner).parameters  # before click 8.2
        runner = CliRunner(mix_stderr=False) if old else CliRunner()
        done = runner.invoke(cli, [*verb, str(path), *more])
        assert done.exception is None or isinstance(done.exception, SystemExit), done.exception
        return done.exit_code, done.stdout.splitlines(), done.stderr.splitlines()

    return call


def test_two_legs_in_one_chain(lab, command):
    lab("a/1.csv")
    lab("a/2.csv", begin_ms=BEGIN_MS + 60_000, zero_deg=140.0, seed=1)
    code, _, (line,) = command("fleet", "update")
    assert code == 1
    assert line.startswith(
        "warning: a: a/2.csv: no gait; no gait cycle fits this leg: the drive torque does not "
    )


def test_a_column_that_is_missing(lab, command):
    lab("a/1.csv", names=["t_ms", "angle_deg", "torque"])
    expected = (
        "a/1.csv: input.columns.drive_torque: column 'torque_Nmm' does not exist, "
        "expected one of: t_ms, angle_deg, torque"
    )
    code, _, (line,) = command("check")
    assert code == 1 and expected in line
    code, _, (line,) = command("fleet", "update")
    assert code == 1 and expected.removeprefix("a/1.csv: ") in line


def test_when_the_parameters_are_mended_it_is_counted(lab, command, tmp_path):
    lab("a/1.csv", names=["t_ms", "angle_deg", "torque"])
    assert command("fleet", "update")[0] == 1
    (tmp_path / "lab.yaml").write_text(CONFIG.replace("torque_Nmm", "torque"))
    code, lines, warned = command("fleet", "update")
    assert (code, lines[0], warned) == (0, "recordings: 1 counted now", [])


@pytest.mark.parametrize(("factor", "size"), [(1.0, "only "), (1.0e6, "")])
def test_a_unit_that_is_wrong_by_1000(lab, command, factor, size):
    lab("a/1.csv", factor=factor)
    code, _, (line,) = command("fleet", "update")
    assert code == 1
    assert f"the drive torque is {size}" in line and "N m are predicted; that is a factor of 1000" in line
    assert "input.units.drive_torque" in line


def test_a_clock_that_begins_anew_in_each_file(lab, command):
    lab("a/1.csv", begin_ms=5)
    lab("a/2.csv", begin_ms=5, seed=1)
    code, lines, (line,) = command("fleet", "update")
    assert code == 1 and lines[0] == "recordings: 1 counted now"
    assert line.startswith("warning: a: a/") and "csv: already counted; " in line
    assert "all of its time is that of recordings before it" in line and "its clock is wrong" in line
    assert any("stamps without a date" in each for each in command("check")[1])


def test_clocks_that_overlap_in_part(lab, command, tmp_path):
    lab("a/1.csv")
    lab("a/2.csv", begin_ms=BEGIN_MS + 2000, seed=1)
    code, lines, warned = command("fleet", "update")
    assert (code, warned, lines[0]) == (0, [], "recordings: 2 counted now")
    log = (tmp_path / "fleet/legs/a/log").read_text().splitlines()
    assert "s of it are in the ledger already: not counted again" in log[1]


def test_check_says_what_was_understood(lab, command):
    lab("a/1.csv")
    lab("a/2.csv", begin_ms=BEGIN_MS + 60_000)
    code, lines, warned = command(
        "check", legs='{id: a, recordings: "a/*", lot: x}, {id: b, recordings: "b/*"}'
    )
    assert code == 1
    assert lines[0].startswith("lab.yaml      parameters of the monitor: bionic_leg")
    assert "fleet of 2 legs, 2 recordings, kept in " in lines[1]
    assert lines[2].strip().startswith("a: 2 recordings, 0.0") and lines[2].endswith(
        "parameters lab.yaml; lot x"
    )
    assert lines[3].strip() == "b: 0 recordings, 0 MB; parameters lab.yaml"
    assert len(warned) == 1 and warned[0].endswith("legs.b.recordings: b/* matches no recording")

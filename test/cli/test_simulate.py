"""What `simulate` prints and writes, and that it writes it whole or not at all."""

import json
import os
import signal
import subprocess
import sys
import threading

import pytest

FORCES = {"mean_force_n", "rms_force_n", "p99_force_n", "max_force_n"}

SHORT = ("simulate", "--mechanism", "four_bar", "--cycles", "0.25", "--skip-cycles", "0")


def test_json_on_stdout_tells_contact_and_wear_of_the_clearance_joints_only(run):
    """All keys, and that the numbers are the library's: doors/test_fields.py."""
    result = run(*SHORT, "--trace", "8", "--json", "-")
    assert (result.code, result.err.count("\n") <= 1) == (0, True)
    record = json.loads(result.out)
    assert [name for name, joint in record["joints"].items() if set(joint) > FORCES] == ["B", "C"]
    assert list(record["joints"]) == list(record["trace"]["force_n"]) == ["A", "B", "C", "D"]
    assert set(record["impacts"]) == {"B", "C"}
    assert record["standard_error"] is None  # of a quarter of a cycle
    assert record["trace"]["crank_angle_rad"][0] == 0.0


def test_an_ideal_run_has_no_contact_figures_and_no_picture_of_wear(run, tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "wear.png").write_bytes(b"of an earlier run")
    result = run(*SHORT, "--clearances", "none", "--out", "out", "--json", "figures.json")
    assert result.code == 0
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["leg.png", "result.json"]
    record = json.loads((tmp_path / "figures.json").read_text())
    assert record == json.loads((tmp_path / "out" / "result.json").read_text())
    assert record["model"] == "ideal"
    assert all(set(joint) == FORCES for joint in record["joints"].values())


def test_out_holds_result_and_pictures(run, tmp_path):
    result = run(*SHORT, "--trace", "90", "--out", "deep/out")
    assert result.code == 0
    files = {path.name: path.read_bytes() for path in (tmp_path / "deep" / "out").iterdir()}
    assert sorted(files) == ["forces.png", "leg.png", "result.json", "wear.png"]
    for name in ("forces.png", "leg.png", "wear.png"):
        assert files[name].startswith(b"\x89PNG\r\n\x1a\n")
    for name in files:
        assert f"written: deep/out/{name}" in result.out


def test_settings_of_libraries_in_the_current_directory_are_not_read(run, tmp_path):
    """With text.usetex, the first letter needs LaTeX; numba would import the class, if PyYAML is there."""
    (tmp_path / "matplotlibrc").write_text("text.usetex: True\n")
    (tmp_path / ".numba_config.yaml").write_text("cache_locator_classes: no_such_module.Locator\n")
    line = [sys.executable, "-m", "leg_wear_monitor", *SHORT, "--trace", "90", "--out", "out"]
    done = subprocess.run(line, capture_output=True, text=True, cwd=tmp_path, check=False)
    assert (done.returncode, "numba_config" in done.stderr) == (0, False), done.stderr


def test_the_table_has_every_joint_and_fits_80_columns(run):
    result = run(*SHORT, "--wear", "on")
    lines = result.out.splitlines()
    assert max(len(line) for line in lines) <= 80
    first_words = [line.split()[0] for line in lines if line.strip()]
    for word in ("A", "B", "C", "D", "drive", "wear", "speed"):
        assert word in first_words
    assert "\x1b" not in result.out


@pytest.mark.parametrize(
    ("line", "joint", "advice"),
    [
        ("--mechanism slider_crank --speed-rpm 1e7 --cycles 1 --model full", "joint B", "try a lower speed"),
        ("--mechanism soft.yaml --cycles 1 --model full", "joint B", "higher stiffness"),
        ("--mechanism soft.yaml --cycles 1 --model clearance", "joint B", "higher stiffness"),
    ],
)
def test_a_run_that_diverges_says_where_and_leaves_nothing(refused, shipped, tmp_path, line, joint, advice):
    (tmp_path / "soft.yaml").write_text(shipped("slider_crank").replace("6.6102e10", "1.0e-3"))
    complaint = refused("simulate", *line.split(), "--json", "result.json", "--out", "out")
    for part in (joint, " at t = ", " s: ", advice):
        assert part in complaint
    assert [path.name for path in tmp_path.iterdir()] == ["soft.yaml"]


def test_an_interrupted_run_leaves_nothing(run, tmp_path):
    """The run would take hours."""
    timer = threading.Timer(1.0, signal.raise_signal, [signal.SIGINT])
    timer.start()
    result = run("simulate", "--cycles", "1e5", "--json", "result.json", "--out", "out")
    timer.join()
    assert result.code == 130
    assert result.lines == ["error: interrupted"]
    assert list(tmp_path.iterdir()) == []


def test_a_file_is_replaced_whole_or_stays(run, tmp_path, monkeypatch):
    def full(*_arguments):
        raise OSError(28, "No space left on device")

    (tmp_path / "result.json").write_text("as it was")
    monkeypatch.setattr(os, "replace", full)
    result = run(*SHORT, "--clearances", "none", "--json", "result.json")
    assert result.code == 2
    assert result.lines == ["error: result.json: cannot be written: No space left on device"]
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("result.json", "as it was")]


@pytest.mark.parametrize(
    ("option", "value"),
    [
        ("--clearance-m", "0.0001"),
        ("--wear", "on"),
        ("--normal-law", "hunt-crossley"),
        ("--model", "full"),
    ],
)
def test_the_ideal_leg_takes_no_option_of_clearance_joints(refused, option, value):
    line = refused(*SHORT, "--clearances", "none", option, value)
    assert line == f"error: {option}: is for clearance joints, and no joint has clearance"


def test_a_bug_keeps_its_traceback(run, monkeypatch):
    def fail(*_arguments, **_keywords):
        raise ZeroDivisionError("a bug")

    monkeypatch.setattr(json, "dumps", fail)
    with pytest.raises(ZeroDivisionError, match="a bug"):
        run(*SHORT, "--json", "-")


def test_a_clearance_that_is_doubtful_in_a_file_is_so_as_an_option(run):
    result = run("simulate", "--clearance-m", "0.0079", *SHORT[1:])
    assert result.code == 0
    (line,) = result.lines
    assert line.startswith("warning: --clearance-m: 0.0079 m is ")
    assert "% of the bushing's radius" in line


def test_a_restitution_that_the_law_does_not_give_is_warned_of_once(run, shipped, tmp_path):
    (tmp_path / "soft.yaml").write_text(shipped("four_bar").replace("restitution: 0.9", "restitution: 0.5"))
    result = run("simulate", "--mechanism", "soft.yaml", "--duration", "0.001")
    assert result.code == 0
    (line,) = result.lines
    for part in ("warning: soft.yaml: joint B, C: ", "lankarani-nikravesh", "0.5", "0.725", "0.7"):
        assert part in line
    result = run("simulate", "--mechanism", "soft.yaml", "--duration", "0.001", "--normal-law", "flores")
    assert (result.code, result.lines) == (0, [])

"""How the command line starts: light, from three places, with names that are the library's."""

import os
import re
import subprocess
import sys

import pytest

import leg_wear_monitor as lw

HEAVY = {"numba", "numpy", "matplotlib", "rich", "cattrs", "ruamel.yaml"}


def test_help_loads_nothing_heavy():
    lines = [["--version"], *([*verb, "--help"] for verb in ((), ("simulate",), ("study",), ("replay",)))]
    code = (
        "import sys\n"
        "from leg_wear_monitor.cli.main import cli\n"
        f"for arguments in {lines}:\n"
        "    try:\n"
        "        cli(arguments)\n"
        "    except SystemExit:\n"
        f"        print(arguments, sorted({HEAVY} & set(sys.modules)), file=sys.stderr)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr.splitlines() == [f"{arguments} []" for arguments in lines]
    assert done.stdout.count("Usage: ") == len(lines) - 1


def test_module_and_script_are_the_same(run):
    done = subprocess.run(
        [sys.executable, "-m", "leg_wear_monitor", "--version"], capture_output=True, text=True, check=True
    )
    assert done.stdout == run("--version").out
    assert done.stdout.startswith("leg-wear-monitor ")


def test_an_error_leaves_one_line_on_the_real_stderr():
    line = [sys.executable, "-m", "leg_wear_monitor", "check", "no_such_leg.yaml"]
    done = subprocess.run(line, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "error: no_such_leg.yaml: cannot be read: No such file or directory\n"


def test_models_that_help_shows_are_the_library_s(run):
    """The help does not wait for the library."""
    (shown,) = re.findall(r"--model \[(.+?)\]", run("simulate", "--help").out)
    for model in shown.split("|"):
        assert lw.simulate("four_bar", model=model, cycles=0.1, skip_cycles=0.0).model == model
    with pytest.raises(lw.ConfigError, match=f"one of {shown.replace('|', ', ')}"):
        lw.simulate("four_bar", model="none of these")
    assert lw.simulate("four_bar", cycles=0.1, skip_cycles=0.0).model == "clearance"
    assert lw.simulate("andrews", duration_s=0.001).model == "full"


def test_help_lists_the_verbs_that_are_there(run):
    listed = run("--help").out.split("Commands:\n")[1]
    verbs = [line.split()[0] for line in listed.splitlines()]
    assert {"check", "gait-publisher", "monitor", "simulate"} <= set(verbs)
    assert [run(verb, "--help").code for verb in verbs] == [0] * len(verbs)


def test_check_finds_this_installation_in_order(run):
    result = run("check")
    assert (result.code, result.lines) == (0, [])
    found = {line.split()[0]: line for line in result.out.splitlines()}
    assert {"python", "kernels", "share", "bionic_leg", "klann_leg", "andrews"} <= set(found)
    assert "turns through" in found["bionic_leg"]


@pytest.mark.parametrize("verb", ["monitor", "gait-publisher", "demo"])
def test_without_ros_a_node_says_so_in_a_line(run, monkeypatch, verb):
    monkeypatch.setitem(sys.modules, "rclpy", None)
    result = run(verb)
    (line,) = result.lines
    assert (result.code, "leg_wear_monitor[ros]" in line) == (2, True)


@pytest.mark.parametrize("node", ["monitor", "gait_publisher"])
def test_the_help_of_a_node_shows_the_line_that_starts_it(node):
    """It said `monitor monitor`."""
    code = f"import sys; sys.argv = ['x', '--help']; from leg_wear_monitor.cli.start import {node}; {node}()"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[0] == f"Usage: ros2 run leg_wear_monitor {node} [--ros-args ...]"


@pytest.mark.parametrize(("given", "threads"), [({}, "1"), ({"OMP_NUM_THREADS": "3"}, "3")])
def test_linear_algebra_takes_one_thread_if_nothing_else_is_asked_for(given, threads):
    code = (
        "import atexit, os, sys; sys.argv = ['x', '--help']; "
        "atexit.register(lambda: print(os.environ['OPENBLAS_NUM_THREADS'])); "
        "from leg_wear_monitor.cli.start import main; main()"
    )
    free = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, env={**free, **given}
    )
    assert done.stdout.splitlines()[-1] == threads


def test_without_the_libraries_of_an_extra_it_is_named_in_a_line(tmp_path):
    """Only in ``replay`` and ``commission`` before; a live dashboard ended in a traceback, too."""
    (tmp_path / "leg.mcap").touch()
    (tmp_path / "fleet.yaml").write_text("legs: [{id: left, recordings: '*.mcap'}]\n")
    lines = ["check fleet.yaml", "fleet update fleet.yaml", "demo",
             "replay leg.mcap", "commission leg.mcap"]  # fmt: skip
    code = (
        "import sys\n"
        "sys.modules['mcap'] = None\n"
        "import leg_wear_monitor.dashboard.live_leg, leg_wear_monitor.fleet.description\n"
        "from leg_wear_monitor.cli import common\n"
        "from leg_wear_monitor.cli.main import cli\n"
        "common.need_rclpy = lambda: None\n"
        f"for line in {lines}:\n"
        "    try:\n"
        "        cli(line.split())\n"
        "    except SystemExit as end:\n"
        "        print(end.code, file=sys.stderr)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path, check=True
    )
    said = done.stderr.splitlines()
    assert said[1::2] == ["2"] * len(lines)
    for line in said[::2]:
        assert line.startswith("error: ") and line.endswith(
            "is not installed; pip install 'leg_wear_monitor[bags]'"
        )


def test_without_an_extra_the_library_names_it_and_the_other_files_are_checked(tmp_path):
    (tmp_path / "fleet.yaml").write_text("legs: [{id: left, recordings: '*.mcap'}]\n")
    code = (
        "import sys\n"
        "sys.modules['mcap'] = None\n"
        "import leg_wear_monitor as lw\n"
        "for name in ('replay', 'plot'):\n"
        "    try:\n"
        "        getattr(lw, name)\n"
        "    except lw.LegWearError as error:\n"
        "        print(name, error)\n"
        "from leg_wear_monitor.cli.main import cli\n"
        "cli(['check', 'fleet.yaml', 'bionic_leg'])\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, cwd=tmp_path, check=False
    )
    line = "mcap is not installed; pip install 'leg_wear_monitor[bags]'"
    first, checked, *_ = done.stdout.splitlines()
    assert first == f"replay {line}"  # a picture of a simulation needs none
    assert (done.returncode, done.stderr) == (2, f"error: {line}\n")
    assert checked.startswith("bionic_leg    7 moving bodies")

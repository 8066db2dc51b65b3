"""The nodes as processes: the whole demo, and an end by SIGTERM."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from ledger_contents import rows_of

from leg_wear_monitor.cli.start import LOADING

pytest.importorskip("rclpy")


def started(verb: str, log: Path, *arguments: str) -> "subprocess.Popen[bytes]":
    command = [sys.executable, "-m", "leg_wear_monitor", verb, "--ros-args", *arguments]
    with log.open("wb") as stream:
        return subprocess.Popen(command, stdout=stream, stderr=subprocess.STDOUT, cwd=log.parent)


def closed_runs(ledger: Path) -> list[tuple[int]]:
    return rows_of(ledger, "SELECT closed FROM run")


def test_sigterm_ends_both_nodes_in_order(stage, tmp_path: Path) -> None:
    """The monitor has said what it judges by, where it keeps the wear, and which file is none of its."""
    ledger, truth, other = tmp_path / "wear.db", tmp_path / "truth.json", tmp_path / "other.yaml"
    other.write_text("monitor: {ros__parameters: {ledger: {path: lost.db}}}\n")
    logs = {"monitor": tmp_path / "monitor.log", "gait-publisher": tmp_path / "leg.log"}
    own = ("-p", "ledger.path:=wear.db", "--params-file", str(other))
    nodes = [
        started("monitor", logs["monitor"], *own),
        started("gait-publisher", logs["gait-publisher"], "-p", f"truth.path:={truth}"),
    ]
    try:
        for log, word in zip(logs.values(), (b"this file is not used", b"walking"), strict=True):
            stage.wait_for(lambda log=log, word=word: word in log.read_bytes(), f"{word} in {log}")
        for node in nodes:
            node.send_signal(signal.SIGTERM)
        assert [node.wait(60) for node in nodes] == [0, 0]
    finally:
        for node in nodes:
            node.kill()
            node.wait()
    assert json.loads(truth.read_text())["walked_s"] > 0.0
    assert closed_runs(ledger) == [(1,)]
    said = logs["monitor"].read_text()
    for line in (
        "The monitor advises.",
        f"ledger {ledger} is new",
        "of bionic_leg at 60 rpm, hardware leg",
        f"{other}: this file is not used: its sections are for /monitor, and this node is /leg_wear_monitor",
    ):
        assert line in said
    assert all(b"Traceback" not in log.read_bytes() for log in logs.values())


# a signal that comes when the node is complete and has not been handed over yet
STOPPED_THERE = """
import sys
from leg_wear_monitor.ros.monitor_node import MonitorNode
from leg_wear_monitor.ros.running import run

def make():
    MonitorNode()
    raise KeyboardInterrupt

sys.exit(run(make, lambda *_: None, sys.argv))
"""


def test_a_signal_between_the_making_and_the_serving_of_a_node_leaves_an_ordered_ledger(
    tmp_path: Path,
) -> None:
    ledger = tmp_path / "wear.db"
    command = [sys.executable, "-c", STOPPED_THERE, "--ros-args", "-p", f"ledger.path:={ledger}"]
    assert subprocess.run(command, check=False, capture_output=True).returncode == 0
    assert closed_runs(ledger) == [(1,)]


def test_a_node_whose_last_entry_cannot_be_written_says_so_in_one_line(tmp_path: Path) -> None:
    ledger = tmp_path / "wear.db"
    for made, end in (("MonitorNode()", "raise KeyboardInterrupt"), ("node = MonitorNode()", "return node")):
        script = "from pathlib import Path" + STOPPED_THERE.replace(
            "    MonitorNode()\n    raise KeyboardInterrupt",
            f"    {made}\n    Path({str(ledger)!r}).rename({str(tmp_path / 'away')!r})\n    {end}",
        )
        command = [sys.executable, "-c", script, "--ros-args", "-p", f"ledger.path:={ledger}"]
        done = subprocess.run(command, check=False, capture_output=True, text=True)
        assert done.returncode == 2
        (line,) = [line for line in done.stderr.splitlines() if "[INFO]" not in line]
        assert "moved away" in line and line.startswith("error: ")


@pytest.mark.parametrize(
    ("name", "verb", "module"),
    [
        ("SIGTERM", ("monitor",), "rclpy.node"),
        ("SIGINT", (), "leg_wear_monitor.ros.running"),
    ],
)
def test_a_node_stopped_while_it_imports_ends_in_order(name: str, verb: tuple[str, ...], module: str) -> None:
    """The signal comes within an import, where Python would print a traceback or go on with half a module."""
    start = "main" if verb else "monitor"
    code = (
        "import os, signal, sys\n"
        f"sys.argv = ['program', *{verb!r}]\n"
        "def stop(event, arguments):\n"
        f"    if event == 'import' and arguments[0] == {module!r}:\n"
        f"        os.kill(os.getpid(), signal.{name})\n"
        f"from leg_wear_monitor.cli.start import {start}\n"
        "sys.addaudithook(stop)\n"
        f"{start}()\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    name = verb[0] if verb else "monitor"
    assert (done.returncode, done.stdout, done.stderr) == (0, LOADING.format(name=name) + "\n", "")


def test_a_monitor_stopped_while_it_compiles_leaves_an_ordered_ledger(tmp_path: Path) -> None:
    """In a callback of LLVM, where Python prints an exception and goes on: the node went on, too."""
    ledger = tmp_path / "wear.db"
    code = (
        "import os, signal, sys\n"
        f"sys.argv = ['monitor', '--ros-args', '-p', 'ledger.path:={ledger}']\n"
        "def on_call(frame, event, _):\n"
        "    if event == 'call' and frame.f_code.co_name == '_object_compiled_hook':\n"
        "        sys.setprofile(None)\n"
        "        os.kill(os.getpid(), signal.SIGTERM)\n"
        "from leg_wear_monitor.cli.start import monitor\n"
        "sys.setprofile(on_call)\n"
        "monitor()\n"
    )
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    line = [sys.executable, "-c", code]
    done = subprocess.run(line, env=environment, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 0, done.stderr
    assert "Exception ignored" not in done.stderr
    assert "Traceback" not in done.stderr
    assert closed_runs(ledger) == [(1,)]


@pytest.mark.slow  # CI runs `make demo`; test_live.py and test_node.py hold its parts in one process
@pytest.mark.usefixtures("traps")
def test_the_demo_tells_its_story(tmp_path: Path) -> None:
    command = [sys.executable, "-P", "-m", "leg_wear_monitor", "demo", "--out", str(tmp_path / "demo")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "verdict: live stop G, replayed stop G" in done.stdout
    assert "the same, byte for byte" in done.stdout
    page = Path(done.stdout.rsplit("report: ", 1)[1].strip())
    assert "<html" in page.read_text()[:1000].lower()
    assert (tmp_path / "demo" / "live.mcap").stat().st_size > 100_000

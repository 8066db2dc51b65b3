"""``dashboard``: what it refuses, what it warns of, and that a signal ends it in order."""

import re
import signal
import socket
import subprocess
import sys
import urllib.request

import pytest

from leg_wear_monitor.cli.verbs import nodes
from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.mechanism.loader import load_mechanism
from leg_wear_monitor.monitor.config.fitting import fitted
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.ledger.entry import binding_of
from leg_wear_monitor.monitor.ledger.ledger import Ledger

pytest.importorskip("tornado")
pytestmark = pytest.mark.plain


@pytest.fixture
def ledger(tmp_path):
    """A new one."""
    config = MonitorConfig(hardware_id="left")
    Ledger(tmp_path / "wear.db", binding_of(fitted(load_mechanism(), config), config), 5.0).close()
    return tmp_path / "wear.db"


WRONG = [
    ("--node /a --ledger wear.db", ["--node and --ledger cannot be combined"]),
    ("--ledger none.db", ["--ledger", "none.db", "does not exist"]),
    ("--ledger wear.db --port 70000", ["--port", "70000"]),
    ("--ledger wear.db --port 0 --host no.such.host.invalid", ["--host", "no.such.host.invalid"]),
    ("--ledger leg.yaml", ["leg.yaml", "not a ledger"]),
]


@pytest.mark.parametrize(("line", "said"), WRONG, ids=[line for line, _ in WRONG])
def test_a_wrong_command_line_is_one_line(run, complaints, ledger, tmp_path, line, said):
    (tmp_path / "leg.yaml").write_text("legs: []\n" * 100)
    result = run("dashboard", *line.split())
    assert (result.exit_code, result.stdout) == (2, "")
    (complaint,) = complaints(result)
    for part in said:
        assert part in complaint


def test_without_its_library_it_says_how_to_install_it(refused, ledger, monkeypatch):
    monkeypatch.setitem(sys.modules, "tornado", None)
    assert "pip install 'leg_wear_monitor[dashboard]'" in refused("dashboard", "--ledger", str(ledger))


def test_without_ros_a_node_is_one_line(run, complaints, monkeypatch):
    def without():
        raise LegWearError("rclpy: no module")

    monkeypatch.setattr(nodes.common, "need_rclpy", without)
    result = run("dashboard", "--node", "/left/leg_wear_monitor")
    assert (result.exit_code, complaints(result)) == (2, ["error: rclpy: no module"])


def test_a_port_in_use_is_one_line(run, complaints, ledger):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        result = run("dashboard", "--ledger", str(ledger), "--port", str(taken.getsockname()[1]))
    assert result.exit_code == 2
    (complaint,) = complaints(result)
    assert "in use" in complaint and "--port" in complaint


@pytest.mark.parametrize(("host", "name"), [("127.0.0.1", "SIGTERM"), ("0.0.0.0", "SIGINT")])
def test_it_serves_until_a_signal(ledger, name, host):
    command = [sys.executable, "-m", "leg_wear_monitor", "dashboard", "--ledger", str(ledger), "--port", "0"]
    process = subprocess.Popen(
        [*command, "--host", host], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    try:
        line = process.stdout.readline()
        port = int(re.fullmatch(r"serving http://[0-9.]+:(\d+)/ \(read-only, Ctrl-C ends it\)\n", line)[1])
        address = f"http://127.0.0.1:{port}"
        with urllib.request.urlopen(f"{address}/events", timeout=30) as events:
            assert events.readline() == b"event: state\n"
            with urllib.request.urlopen(address, timeout=30) as page:
                assert b"there is no verdict on the leg yet" in page.read()
            process.send_signal(getattr(signal, name))
            assert process.wait(30) == 0
    finally:
        process.kill()
        _, stderr = process.communicate()
    warnings = stderr.splitlines()
    assert len(warnings) == (host != "127.0.0.1")
    assert all("no password" in warning for warning in warnings)

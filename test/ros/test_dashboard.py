"""The dashboard beside a real monitor, in a real browser: while somebody looks, a joint breaks out."""

import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("rclpy")
pytest.importorskip("tornado")

from browser import NEEDS_CHROMIUM
from diagnostic_msgs.msg import DiagnosticArray
from live_browser import LivePage, wait_for

from leg_wear_monitor.gait.config import KnockConfig
from leg_wear_monitor.ros.gait_publisher import PublisherConfig

PARAMETERS = {
    "cadence__tolerance_rpm": 30.0,
    "alarms__on_delay_cycles": 1,
    "alarms__knock_on_delay_cycles": 1,
    "limits__impact_force_n": 1.0e7,
}


@pytest.fixture
def dashboard(domain: int, tmp_path: Path):
    """A dashboard of the node in a namespace, as a process of its own; its address."""
    command = [sys.executable, "-m", "leg_wear_monitor", "dashboard", "--node", "left/leg_wear_monitor"]
    log = tmp_path / "dashboard.log"
    with log.open("wb") as stream:
        process = subprocess.Popen([*command, "--port", "0"], stdout=stream, stderr=subprocess.STDOUT)
    try:
        found = wait_for(lambda: re.search(r"serving (http://[0-9.:]+/)", log.read_text()), "the dashboard")
        assert "/left/leg_wear_monitor/state" in log.read_text()  # it waits for it, and says so
        yield found[1]
        process.send_signal(signal.SIGTERM)
        assert process.wait(60) == 0
    finally:
        process.kill()
        process.wait()
    assert "Traceback" not in log.read_text()


@NEEDS_CHROMIUM
def test_a_joint_that_opens_is_seen_while_somebody_looks(stage, dashboard, tmp_path: Path) -> None:
    page = LivePage(dashboard, tmp_path, 390)
    try:
        page.wait("document.querySelector('.freshness')", "the page")
        assert "WAITING for the monitor /left/leg_wear_monitor" in page.text(".freshness")
        monitor = stage.monitor("/left", **PARAMETERS)
        page.wait("document.querySelector('.joints .letter')", "the joints")
        verdicts = stage.listen("/left/leg_wear_monitor/verdict", DiagnosticArray, latched=True)
        legs = stage.legs("/left")
        knock = KnockConfig(joint="G", at_s=3.0, clearance_m=1.0e-3)
        walk = stage.walk(PublisherConfig(duration_s=8.0, knock=knock))
        legs.play(walk, monitor, end_s=3.0)
        before = page.text("[data-region=verdict] .verdict")
        assert not re.search("INSPECT|STOP", before)
        legs.play(walk, monitor, begin_s=3.0)
        page.wait("/INSPECT|STOP/.test(document.querySelector('.banner .verdict').innerText)", "the verdict")
        page.wait("document.querySelector('[data-region=alarms] .alarms li')", "an alarm")
        assert re.search("clearance|torque_mismatch", page.text("[data-region=alarms]"))
        stage.wait_for(lambda: is_as_said(page, verdicts), "the page to say what the topic says")
        legs.leave()
        monitor.stop()
        page.wait("document.documentElement.hasAttribute('data-old')", "the page to turn grey")
        assert page.text(".freshness").startswith("NO DATA for ")
        assert page.console == []
    finally:
        page.close()


def is_as_said(page: LivePage, verdicts: list) -> bool:
    """Whether the page has state and code of the last message of the verdict's topic."""
    status = verdicts[-1].status[0]
    state = re.match("healthy|watch|not monitored|inspect|stop", status.message)[0]
    code = next(pair.value for pair in status.values if pair.key == "fault_code")
    text = page.text("[data-region=verdict]")
    return state.upper() in text and code in text

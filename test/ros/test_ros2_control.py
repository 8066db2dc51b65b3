"""The monitor reads a robot on ros2_control, as examples/ros2_control has it."""

import itertools
import math
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("rclpy")

from diagnostic_msgs.msg import DiagnosticArray
from dynamic_messages import dynamic_joint_state

from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.gait.config import GaitConfig, KnockConfig
from leg_wear_monitor.monitor.config.parameters import load_config
from leg_wear_monitor.recordings.cdr import Decoder
from leg_wear_monitor.recordings.message_checks import MessageChecks
from leg_wear_monitor.recordings.streams import INTERFACES
from leg_wear_monitor.ros import inputs
from leg_wear_monitor.state import State

EXAMPLE = Path(__file__).parents[2] / "examples" / "ros2_control"
ME = "/leg_wear_monitor"
START_NS = 1_700_000_000_000_000_000
SECONDS = 6.0


@pytest.fixture(scope="module")
def stand_ins() -> Any:
    """The module of the example."""
    sys.path.insert(0, str(EXAMPLE))
    try:
        import stand_ins as module
    finally:
        sys.path.remove(str(EXAMPLE))
    return module


class Walking:
    """The stand-ins and a monitor with the parameters of the example, which walk as one asks.

    Attributes
    ----------
    monitor : Monitor
        Of the stage.
    """

    def __init__(self, stage: Any, stand_ins: Any, leg: Any = None) -> None:
        pytest.importorskip("control_msgs")
        given = load_config(EXAMPLE / "monitor.yaml")
        torque, load = given.drive_torque, given.foot_load
        # before the monitor, which would call it silent while its kernels are compiled
        self._robot = stand_ins.Robot(
            leg,
            context=stage.node.context,
            cli_args=["--ros-args", "-r", "foot_sensor_broadcaster:~/wrench:=foot_load"],
        )
        self.monitor = stage.monitor(
            crank_joint=given.crank_joint,
            drive_torque__source=torque.source,
            drive_torque__interface=torque.interface,
            drive_torque__scale=torque.scale,
            drive_torque__gear_ratio=torque.gear_ratio,
            drive__temperature_interface=given.drive.temperature_interface,
            foot_load__source=load.source,
            foot_load__frame=load.frame,
            load__model=given.load.model,
        )
        self._stage, self._rate_hz = stage, stand_ins.UPDATE_HZ
        self._numbers, self._sent = itertools.count(1), 0
        for topic in ("joint_states", "dynamic_joint_states", "foot_load"):
            stage.wait_for(lambda topic=topic: stage.node.count_subscribers(topic) > 0, topic)
            stage.wait_for(lambda topic=topic: self.monitor.node.count_publishers(topic) > 0, topic)

    def status_after(self, seconds: float) -> dict[str, Any]:
        """Walk on; the statuses afterwards."""
        monitor = self.monitor
        for number in itertools.islice(self._numbers, round(seconds * self._rate_hz)):
            self._sent += self._robot.update(number, START_NS)
            self._stage.wait_for(lambda: monitor.received >= self._sent, "a message on its way")
        self._stage.wait_for(lambda: monitor.waiting == 0, "the monitor to take what it got")
        return {one.name: one for one in monitor.node.monitor.status()}

    def end(self) -> None:
        """Take the robot down."""
        for node in self._robot.nodes:
            node.destroy_node()


def test_the_leg_on_ros2_control_is_healthy(stage: Any, stand_ins: Any) -> None:
    """NaN, another publisher's joints and a sensor that turns with the foot included."""
    walking = Walking(stage, stand_ins)
    node = walking.monitor.node
    alarms = stage.listen(f"{ME}/alarms", DiagnosticArray, latched=True)
    status = walking.status_after(SECONDS)
    # a node that was late with a turn, as on a busy machine, does not know rates until it has caught up
    stage.wait_for(
        lambda: (
            not math.isnan(status["input"].values["torque_rate_hz"])
            or status.update(walking.status_after(1.0))
        ),
        "the rate of the torque",
    )
    stage.wait_for(lambda: bool(alarms), "the alarms")
    assert [line.name for message in alarms for line in message.status if line.level[0]] == []
    assert status["input"].values["torque_rate_hz"] == pytest.approx(200.0, rel=0.05)
    assert status["input"].values["foot_load_rate_hz"] == pytest.approx(200.0, rel=0.05)
    assert status["torque"].message == "the measured torque agrees with the prediction"
    # 25 °C at the start, and 60 °C after half an hour
    assert 25.0 < node.monitor.state.drive.temperature_c.value < 26.0
    assert status["diagnosis"].values["drive_temperature_c"] == pytest.approx(25.5, abs=0.5)
    topics = {one.name: one for one in node._supervision.statuses(())}["topics"]
    assert "Expected one" not in topics.message
    walking.end()


def test_an_opened_knee_is_shown_by_the_current_in_the_air(stage: Any, stand_ins: Any) -> None:
    """As the page has it, 0.452 mm ± 0.032 mm; and what the sensor at the foot shows in the air."""
    leg = GaitConfig(knock=KnockConfig(joint="G", at_s=0.0, clearance_m=0.45e-3))
    walking = Walking(stage, stand_ins, leg)
    status = walking.status_after(13.0)
    verdict = walking.monitor.node.monitor.verdict.verdict
    assert (verdict.state, verdict.joints) == (State.INSPECT, ("G",))
    shown_m = walking.monitor.node.monitor.state.clearances["G"].best_estimate_m
    assert shown_m == pytest.approx(0.45e-3, abs=5.0 * 0.032e-3)
    assert "its sensor is stuck, or the leg walks in the air" in status["foot_load"].message
    walking.end()


def test_an_interface_that_is_not_there_is_reported_with_those_that_are() -> None:
    config = load_config(EXAMPLE / "monitor.yaml")
    box = inputs.Inbox(Decoder(config), 10)
    has_no = "leg_crank has no interface"
    for joint, there, report in (
        ("hip", {"effort": 1.0}, "no joint is named 'leg_crank'; the joints are hip"),
        (
            "leg_crank",
            {"effort": 1.0, "position": 2.0},
            f"{has_no} 'motor_current' and 'motor_temperature'. It has effort, position; "
            "set drive_torque.interface and drive.temperature_interface",
        ),
        (
            "leg_crank",
            {"motor_current": 1.0},
            f"{has_no} 'motor_temperature'. It has motor_current; set drive.temperature_interface",
        ),
        (
            "leg_crank",
            {"motor_current": 1.0, "motor_temperature": math.nan},
            "leg_crank has no value of motor_current or motor_temperature yet",
        ),
        ("leg_crank", {"motor_current": 1.0, "motor_temperature": 41.0}, ""),
    ):
        box.add(INTERFACES, dynamic_joint_state(1, {joint: there}), 1)
        arrivals = box.take(1)
        checks = MessageChecks(config)
        codes = np.array([one.code for one in arrivals])
        checks.add(codes, box.decoded(arrivals), lambda i, arrivals=arrivals: arrivals[i].raw)
        assert checks.interface_fault == report


def test_without_control_msgs_a_line_names_the_parameter_and_the_package(
    stage: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "control_msgs", None)
    line = (
        "drive_torque.source: 'interface' needs control_msgs, which is not installed. "
        "Install ros-jazzy-control-msgs"
    )
    with pytest.raises(ConfigError, match=f"^{re.escape(line)}$"):
        stage.monitor(drive_torque__source="interface")


def test_a_node_needs_no_library_that_no_ros_package_has() -> None:
    """Without a recording: Ubuntu has packages for all others."""
    only_of_recordings = ("apsw", "joblib", "lz4", "mcap", "rosbags", "zstandard")
    text = (
        f"import sys; sys.modules.update(dict.fromkeys({only_of_recordings}))\n"
        "import leg_wear_monitor.ros.gait_publisher, leg_wear_monitor.ros.monitor_node"
    )
    subprocess.run([sys.executable, "-c", text], check=True, cwd=Path(__file__).parents[2])

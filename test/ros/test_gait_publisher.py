"""The synthetic leg as a node: everything it walks is published, in order, with its truth."""

import json
import threading
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rclpy")

from made_node import made_node
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from leg_wear_monitor.gait.config import EncoderConfig, TorqueSensorConfig
from leg_wear_monitor.gait.leg import SyntheticLeg
from leg_wear_monitor.gait.sensors import readings
from leg_wear_monitor.ros.gait_publisher import GaitPublisher, PublisherConfig
from leg_wear_monitor.twin import CRANK


@pytest.mark.parametrize("precompute", [True, False])
def test_a_walk_is_published_as_it_was_walked(stage, tmp_path: Path, precompute: bool) -> None:
    truth = tmp_path / "truth.json"
    parameters = {
        "duration_s": 0.5,
        "time_scale": 2.0,
        "precompute": precompute,
        "reliable": True,
        "wait_for_subscribers": 1,
        "further_joints": ["hip"],
        "encoder__wrapped": True,
        "torque_sensor__source": "float64",
        "truth__path": str(truth),
    }
    cranks = stage.listen("/joint_states", JointState, matched=False)
    torques = stage.listen("/drive_torque", Float64, matched=False)
    with made_node(make=GaitPublisher, **parameters) as node:
        walking = threading.Thread(target=node.walk)
        walking.start()
        walking.join()
        stage.wait_for(lambda: len(cranks) + len(torques) == node.published, "all of the walk")

    config = PublisherConfig(
        duration_s=0.5,
        encoder=EncoderConfig(wrapped=True),
        torque_sensor=TorqueSensorConfig(source="float64"),
    )
    walk = list(readings(SyntheticLeg(config), config))
    expected = [one for one in walk if one.kind == CRANK]
    assert [list(message.name) for message in cranks] == [["hip", "crank"]] * len(expected)
    assert [message.position[1] for message in cranks] == [one.crank_angle_rad for one in expected]
    assert [message.data for message in torques] == [one.torque_nm for one in walk if one.kind != CRANK]
    start_ns = json.loads(truth.read_text())["start_ns"]
    stamps = [one.header.stamp.sec * 1_000_000_000 + one.header.stamp.nanosec for one in cranks]
    assert np.array(stamps) - start_ns == pytest.approx([1e9 * one.taken_s for one in expected], abs=1.0)

"""Nodes over real DDS: who the monitor hears, through what it goes on, a foot load; the synthetic leg."""

import json
import threading
from pathlib import Path

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from made_node import made_node
from raw_messages import messages_of
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from leg_wear_monitor import replay
from leg_wear_monitor.gait.config import (
    EncoderConfig,
    FootLoadSensorConfig,
    LoadConfig,
    TorqueSensorConfig,
)
from leg_wear_monitor.gait.leg import SyntheticLeg
from leg_wear_monitor.gait.sensors import readings
from leg_wear_monitor.monitor.config.parameters import config_from
from leg_wear_monitor.ros.gait_publisher import GaitPublisher, PublisherConfig
from leg_wear_monitor.twin import CRANK

# The monitor over real DDS: who it hears, through what it goes on, and what it takes of a foot load.


pytest.importorskip("rclpy")


ME = "/leg_wear_monitor"
FAST = {"wear_acceleration": 1.0e5}


def levels(message: DiagnosticArray) -> dict[str, int]:
    """Level of each line by its name, without the node's."""
    return {status.name.split(": ", 1)[1]: status.level[0] for status in message.status}


def test_messages_are_taken_while_the_monitor_is_busy(stage, walk, monkeypatch) -> None:
    """Seen before: while a leg was identified on a busy machine, the middleware lost 1467 of 1.2 million."""
    monkeypatch.setattr("leg_wear_monitor.ros.monitor_node._RECEIVE_S", 0.005)
    monitor, legs, goes_on = stage.monitor(), stage.legs(), threading.Event()
    update, waited = monitor.node.monitor.update, []

    def update_later(samples):
        waited.append(goes_on.wait(300.0))
        return update(samples)

    def before(at_s: float) -> None:
        if at_s > 0.9:
            goes_on.set()

    monkeypatch.setattr(monitor.node.monitor, "update", update_later)
    legs.play(walk, monitor, end_s=1.0, before=before)
    sent = sum(one.arrival_s < 1.0 for one in walk.readings)
    assert monitor.received == sent
    assert waited and all(waited)  # each block before 0.9 s came while the monitor was busy with the first


def test_a_publisher_may_die_and_return(stage, walk) -> None:
    monitor = stage.monitor(**FAST)
    clearances = stage.listen(f"{ME}/clearance_states", JointState)
    first = stage.legs()
    first.play(walk, monitor, end_s=2.5)
    first.leave()
    # from 2.5 to 4 s nobody publishes
    stage.legs(reliable=True).play(walk, monitor, begin_s=4.0)
    lost = monitor.node.monitor.lost
    assert lost.unmonitored_s == pytest.approx(1.6, abs=0.3)
    assert lost.gaps_lost == 1
    assert gait_of(monitor).message.startswith(("in step", "starting"))
    stage.wait_for(lambda: bool(clearances), "a gait cycle")


def test_reliable_and_best_effort_publishers_are_heard_whatever_time_ros_has(stage, walk) -> None:
    monitor = stage.monitor(use_sim_time=True)  # and nobody publishes /clock
    for reliable, begin_s in ((False, 0.0), (True, 0.5)):
        legs = stage.legs(reliable=reliable)
        legs.play(walk, monitor, begin_s=begin_s, end_s=begin_s + 0.5)
        legs.leave()
    assert monitor.received == sum(one.arrival_s < 1.0 for one in walk.readings)


def test_a_publisher_that_does_not_fit_is_reported(stage, walk) -> None:
    override = "qos_overrides./joint_states.subscription.reliability"
    monitor = stage.monitor(**{override: "reliable"})
    heard = stage.listen("/diagnostics", DiagnosticArray)
    stage.legs(reliable=False)

    def is_named() -> bool:
        why = "/joint_states: has a publisher, but no message has arrived. Compare its type and quality of"
        return any(why in line.message for message in heard for line in message.status)

    stage.wait_for(is_named, "a line about the quality of service")
    assert levels(heard[-1])["topics"] == 2
    assert monitor.received == 0


def gait_of(monitor):
    """Status of the gait."""
    return next(one for one in monitor.node.monitor.status() if one.name == "gait")


@pytest.mark.parametrize("model", ["measured", "none"])
def test_a_foot_load_is_taken_reported_recorded_and_replayed(
    stage, tmp_path: Path, model: str, arrive_at
) -> None:
    """A wrench, which acts, or a contact switch, which has no stamp: it is of the time at which it comes.

    In the last second there are no samples.
    """
    source = "wrench" if model == "measured" else "contact"
    recording = tmp_path / "live.mcap"
    sensor = FootLoadSensorConfig(source=source, silent_from_s=3.0)
    config = PublisherConfig(duration_s=4.0, load=LoadConfig(ground_n=300.0), foot_load_sensor=sensor)
    values = {"foot_load__source": source, "load__model": model, "diagnosis__enabled": False}
    monitor = stage.monitor(record__path=str(recording), **values)
    diagnostics = stage.listen("/diagnostics", DiagnosticArray)
    block_s = 1.0e-4 if source == "contact" else 0.015
    stage.legs(load=source).play(stage.walk(config), monitor, block_s=block_s, before=arrive_at)
    stage.wait_for(lambda: diagnostics and levels(diagnostics[-1]).get("foot_load") == 2, "the silence")
    monitor.stop()
    live = monitor.node.monitor
    assert live.state.load.source == "measured"
    assert live.state.load.cycles >= 2
    assert live.used["foot_load"] == pytest.approx(600, abs=3)
    parameters = {name.replace("__", "."): value for name, value in values.items()}
    again = replay(recording, config_from(parameters), out=tmp_path)
    assert again.monitor.state.load == live.state.load
    lived, replayed = messages_of(recording), messages_of(tmp_path / "reports.mcap")
    assert len(replayed[f"{ME}/clearance_states"]) >= 2
    for topic in ("clearance_states", "predicted_torque", "impact_forces"):
        assert lived[f"{ME}/{topic}"] == replayed[f"{ME}/{topic}"]


# The synthetic leg as a node: everything it walks is published, in order, with its truth.


pytest.importorskip("rclpy")


def test_a_walk_is_published_as_it_was_walked(stage, tmp_path: Path) -> None:
    truth = tmp_path / "truth.json"
    parameters = {
        "duration_s": 0.5,
        "qos_overrides./joint_states.publisher.reliability": "reliable",
        "qos_overrides./drive_torque.publisher.reliability": "reliable",
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

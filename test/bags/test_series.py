"""All joints and torques of a recording as series: how many topics, and how many joints of one."""

from pathlib import Path

from raw_messages import encode

from leg_wear_monitor import MonitorConfig
from leg_wear_monitor.bags.mcap_writer import McapWriter
from leg_wear_monitor.bags.series import JointName, read_signals


def recorded(path: Path, joints: dict[str, list[str]]) -> Path:
    """A recording with one message of joint states a topic."""
    with McapWriter(path) as writer:
        for topic, names in joints.items():
            raw = encode.joint_states([10**9], names, position=[[0.5] * len(names)])[0].tobytes()
            writer.write(writer.channel(topic, encode.JOINT_STATE), 10**9, raw)
    return path


def test_all_topics_are_read_however_many_there_are(tmp_path: Path) -> None:
    topics = {f"/robot_{k}/joint_states": ["crank"] for k in range(300)}
    signals, findings = read_signals([recorded(tmp_path / "fleet.mcap", topics)], MonitorConfig())
    assert list(signals.joints) == [JointName(topic, "crank") for topic in topics]
    assert findings == []


def test_joints_beyond_the_first_two_hundred_are_not_read_and_reported(tmp_path: Path) -> None:
    path = recorded(tmp_path / "many.mcap", {"/joint_states": [f"joint_{k}" for k in range(201)]})
    signals, findings = read_signals([path], MonitorConfig())
    assert list(signals.joints)[-1] == JointName("/joint_states", "joint_199")
    assert [one.line for one in findings] == [
        f"note: {path}: /joint_states: only the first 200 of its joints are read"
    ]

"""An even gait over real DDS: followed, recorded, replayed; and all that a layout of a tool names."""

import json
from pathlib import Path
from typing import Any

import attrs
import layouts
import numpy as np
import pytest

pytest.importorskip("rclpy")

from made_node import made_node
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from raw_messages import messages_of

import leg_wear_monitor as lw
from leg_wear_monitor.messages.outputs import Messages
from leg_wear_monitor.messages.streams import topic_of
from leg_wear_monitor.ros.inputs import message_class
from leg_wear_monitor.state import SCHEMA_VERSION, State

ME = "/leg_wear_monitor"
PARAMETERS = {
    "publish_scalars": True,
    "publish_markers": True,
    "wear_acceleration": 1.0e5,
    "limits__clearance_m": 3.00001e-4,  # all is at its limit: its life is known
    "encoders__names": ["hip", "knee", "shin"],
    "encoders__joints": ["B", "G", "I"],
    "diagnostics__period_s": 0.2,
}
RARE = "seen_m"  # there is none unless encoders or the drive torque show a clearance
BY_A_CLOCK = ("/diagnostics", f"{ME}/forecast")  # when it comes, a replay does not know

Run = dict[str, tuple[str, list[Any]]]
"""Type and messages by topic."""


@attrs.frozen
class Followed:
    """A live run and its replay: what a subscriber of every topic got, files, and the monitors afterwards."""

    live: Run
    replay: Run
    recording: Path
    stops: Path
    reports: Path
    monitor: lw.WearMonitor
    replayed: lw.WearMonitor


@pytest.fixture(scope="module")
def followed(shared_stage, walk, tmp_path_factory: pytest.TempPathFactory) -> Followed:
    out = tmp_path_factory.mktemp("out")
    recording, stops = out / "live.mcap", out / "stops"
    monitor = shared_stage.monitor(record__path=str(recording), record__stops=str(stops), **PARAMETERS)
    live = monitor.node.monitor
    outputs = Messages(live.config, live.clearance_joints).outputs
    heard = {
        topic_of(one, ME): shared_stage.listen(
            topic_of(one, ME), message_class(one.type), one.qos.durability != "volatile"
        )
        for one in outputs
    }
    shared_stage.legs().play(walk, monitor)
    for topic in heard:
        if not topic.endswith(RARE):
            shared_stage.wait_for(lambda topic=topic: bool(heard[topic]), f"a message on {topic}")
    shared_stage.wait_for(lambda: len(heard["/diagnostics"]) > 5, "diagnostics")
    graph = dict(shared_stage.node.get_topic_names_and_types())
    monitor.stop()
    replayed = lw.replay(recording, live.config, out=out).monitor
    received = {topic: (graph[topic][0], list(messages)) for topic, messages in heard.items()}
    reports = out / "reports.mcap"
    return Followed(received, decoded(reports), recording, stops, reports, live, replayed)


def decoded(path: Path) -> Run:
    """A recording, decoded by mcap's own library for ROS 2 from the definitions in the file."""
    found: Run = {}
    with path.open("rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()], validate_crcs=True)
        summary = reader.get_summary()
        for channel in summary.channels.values():
            found[channel.topic] = summary.schemas[channel.schema_id].name, []
        for _, channel, _, message in reader.iter_decoded_messages():
            found[channel.topic][1].append(message)
    return found


def seconds(message) -> float:
    """Stamp of a message since the start of the walk."""
    stamp = message.header.stamp
    return stamp.sec - 1_700_000_000 + 1e-9 * stamp.nanosec


def test_clearances_are_those_of_the_leg_after_each_gait_cycle(followed, walk) -> None:
    """Of a few gait cycles, which scatter: B's by 5 % between leg and twin, as its single cycles by 6 %."""
    _, clearances = followed.live[f"{ME}/clearance_states"]
    last = clearances[-1]
    assert list(last.name) == [f"{joint}_clearance" for joint in "ABGIJ"]
    assert np.diff([seconds(message) for message in clearances]) == pytest.approx(1.0, abs=0.01)
    for joint, k in (("A", 0), ("B", 1), ("G", 2)):
        true = np.interp(seconds(last), walk.truth["cycle_end_s"], walk.truth["clearance_m"][joint][:-1])
        assert last.position[k] - 3.0e-4 == pytest.approx(true - 3.0e-4, rel=0.3)


def test_statuses_keep_their_lines_and_have_one_number_a_value(followed) -> None:
    _, diagnostics = followed.live["/diagnostics"]
    names = [[line.name.split(": ", 1)[1] for line in message.status] for message in diagnostics]
    assert all(each == names[0] for each in names) and names[0][0] == "verdict"
    expected = {"gait", "input", "torque", "joint A", "ledger", "load", "topics", "recording"}
    assert expected <= set(names[0])
    lines = diagnostics[-1].status
    assert all(line.level in (b"\0", b"\1", b"\2") and line.hardware_id == "leg" for line in lines)
    assert all([value.key for value in line.values].count("fault_code") == 1 for line in lines)
    values = [value for line in lines for value in line.values if value.key != "fault_code"]
    assert len(values) > 40
    for value in values:
        float(value.value)


def test_markers_draw_the_leg(followed) -> None:
    """Seven bodies, the pelvis, and five clearance joints, A and B on the hip's axis; for two seconds."""
    drawn = followed.live[f"{ME}/markers"][1][-1]
    assert {(marker.lifetime.sec, marker.lifetime.nanosec) for marker in drawn.markers} == {(2, 0)}
    (lines,) = (marker for marker in drawn.markers if marker.ns == "bodies")
    assert len(lines.points) == 2 * (1 + 2 + 2 + 1 + 2 + 2 + 1 + 1)
    joints = [marker for marker in drawn.markers if marker.ns == "joints"]
    assert [marker.id for marker in joints] == [0, 1, 2, 3, 4]
    positions = [(joint.pose.position.x, joint.pose.position.z) for joint in joints]
    assert np.array(positions[:2]) == pytest.approx(np.zeros((2, 2)), abs=1e-12)
    assert max(z for _, z in positions[2:]) < -0.3


def test_forces_torques_and_state_are_reported(followed) -> None:
    forces = followed.live[f"{ME}/impact_forces"][1][-1]
    assert list(forces.name) == [f"{joint}_impact" for joint in "ABGIJ"] and len(forces.effort) == 5
    torques = [message.wrench.torque.z for message in followed.live[f"{ME}/predicted_torque"][1]]
    assert np.ptp(torques) > 50.0
    state = json.loads(followed.live[f"{ME}/state"][1][-1].data)
    assert (state["schema_version"], list(state["clearances"])) == (SCHEMA_VERSION, list("ABGIJ"))


def test_a_replay_reports_what_was_published_bit_for_bit(followed) -> None:
    lived, replayed = messages_of(followed.recording), messages_of(followed.reports)
    for topic in ("alarms", "verdict", "state"):
        lived[f"{ME}/{topic}"] = without_silence(lived[f"{ME}/{topic}"])
    for found in (lived, replayed):
        found[f"{ME}/markers"] = [raw for raw in found[f"{ME}/markers"] if b"no current data" not in raw]
    counts = {topic: len(messages) for topic, messages in replayed.items()}
    assert counts[f"{ME}/clearance_states"] >= 4 and counts[f"{ME}/predicted_torque"] > 1900
    assert counts[f"{ME}/markers"] > 50 and counts[f"{ME}/measured_torque"] > 1000
    assert counts[f"{ME}/joints/G/clearance_m"] == counts[f"{ME}/clearance_states"]
    assert counts[f"{ME}/verdict"] > 2  # at the start, no gait cycle yet, the first
    assert counts[f"{ME}/state"] >= counts[f"{ME}/clearance_states"]
    for topic in replayed.keys() - set(BY_A_CLOCK):
        assert lived[topic] == replayed[topic], topic
    (now,) = (one for one in followed.monitor.status() if one.name == "encoders")
    assert now.message.startswith("shin is not in joint_states with the crank")
    assert now.values["cycles"] >= 4
    assert repr(now) in map(repr, followed.replayed.status())


def without_silence(messages: list[bytes]) -> list[bytes]:
    """Without what tells of silence and of its end: it is seen by a clock, which a replay has not."""
    kept, was_silent = [], False
    for raw in messages:
        is_silent = b"input_silence" in raw
        if not is_silent and not was_silent:
            kept.append(raw)
        was_silent = is_silent
    return kept


def test_the_seconds_around_a_stop_are_kept(followed) -> None:
    """Here all of the recording, which a replay leads to the stop."""
    (kept,) = followed.stops.iterdir()
    found, whole = messages_of(kept), messages_of(followed.recording)
    for topic in ("/joint_states", "/drive_torque", f"{ME}/clearance_states"):
        assert found[topic] == whole[topic]
    assert followed.replayed.verdict.verdict.state is State.STOP


@pytest.fixture(params=["live", "replay"])
def run(request: pytest.FixtureRequest, followed: Followed) -> Run:
    return getattr(followed, request.param)


def is_number(value: Any) -> bool:
    return isinstance(value, int | float) or (isinstance(value, bytes) and len(value) == 1)


def test_all_that_foxglove_s_layout_names_is_there(run: Run) -> None:
    references = list(layouts.references_of(layouts.foxglove()))
    assert len(references) > 30
    for one in references:
        kind, messages = run[one.topic]
        assert one.type in ("", kind), one
        if one.topic.endswith(RARE):
            assert (kind, one.path) == ("std_msgs/msg/Float64", ".data")
            continue
        values = layouts.values_at(messages[-1], one.path) if one.path else [0]
        assert values and all(map(is_number, values)), one
    (names,) = {tuple(message.name) for message in run[f"{ME}/impact_forces"][1]}
    paths = layouts.foxglove()["configById"]["Plot!forces"]["paths"]
    assert {one["value"]: f"{one['label']}_impact" for one in paths} == {
        f"{ME}/impact_forces.effort[{k}]": name for k, name in enumerate(names)
    }


def test_all_that_plotjuggler_s_layout_names_is_there(run: Run) -> None:
    there = {
        series
        for topic, (_, messages) in run.items()
        for message in messages
        for series in layouts.series_of(topic, message)
    }
    curves = layouts.plotjuggler_curves()
    rare = {curve for curve in curves if f"/{RARE}/" in curve}
    assert len(curves) > 30 and len(rare) == 5
    assert set(curves) - rare <= there
    assert {curve.removesuffix("/data") for curve in rare} <= set(run)


def test_all_that_rviz_s_layout_names_is_there(run: Run) -> None:
    (one,) = layouts.rviz_references()
    (display,) = (each for each in layouts.rviz()["Displays"] if each["Name"] == one.panel)
    assert run[one.topic][0] == one.type
    markers = [marker for message in run[one.topic][1] for marker in message.markers]
    assert {marker.ns for marker in markers} == set(display["Namespaces"])
    # without a transform, what is in the fixed frame is drawn, and nothing else
    frames = {marker.header.frame_id for marker in markers}
    assert frames == {layouts.rviz()["Global Options"]["Fixed Frame"]}
    assert frames == {layouts.foxglove()["configById"]["3D!leg"]["followTf"]}


def test_the_layouts_name_all_that_is_published_for_them(followed: Followed) -> None:
    scalars = {topic for topic, (kind, _) in followed.live.items() if kind == "std_msgs/msg/Float64"}
    assert len(scalars) == 20
    assert scalars <= {curve.removesuffix("/data") for curve in layouts.plotjuggler_curves()}
    assert {f"{ME}/measured_torque", f"{ME}/markers"} <= set(followed.live) & set(followed.replay)


def test_the_parameters_for_the_layouts_prevail_over_those_of_a_leg() -> None:
    config = lw.share_directory() / "config"
    files = [
        word for name in ("monitor.yaml", "tools.yaml") for word in ("--params-file", str(config / name))
    ]
    with made_node(*files, namespace="left") as node:
        assert node.monitor.config.publish_scalars and node.monitor.config.publish_markers

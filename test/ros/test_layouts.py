"""Every topic and field that a layout names is in a live run, and in the reports of its replay."""

from pathlib import Path
from typing import Any

import layouts
import pytest

pytest.importorskip("rclpy")

import rclpy
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rclpy.utilities import try_shutdown

import leg_wear_monitor as lw
from leg_wear_monitor.messages.outputs import Messages
from leg_wear_monitor.messages.streams import topic_of
from leg_wear_monitor.ros.inputs import message_class
from leg_wear_monitor.ros.monitor_node import MonitorNode

ME = "/leg_wear_monitor"
PLOTTED = {"publish_scalars": True, "publish_markers": True}
WEAR = {
    "wear_acceleration": 1.0e5,
    "limits__clearance_m": 3.00001e-4,
}  # all is at its limit: its life is known
RARE = "seen_m"  # there is none unless encoders or the drive torque show a clearance

Run = dict[str, tuple[str, list[Any]]]
"""Type and messages by topic."""


@pytest.fixture(scope="module")
def runs(shared_stage, walk, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Run]:
    """A live run, heard by a subscriber of every topic, and the reports of the replay of its recording."""
    out = tmp_path_factory.mktemp("out")
    recording = out / "live.mcap"
    monitor = shared_stage.monitor(record__path=str(recording), diagnostics__period_s=0.2, **(PLOTTED | WEAR))
    config = monitor.node.monitor.config
    outputs = Messages(config, monitor.node.monitor.clearance_joints).outputs
    topics = {topic_of(output, ME): output for output in outputs}
    heard = {
        topic: shared_stage.listen(topic, message_class(output.type), output.qos.durability != "volatile")
        for topic, output in topics.items()
    }
    shared_stage.legs().play(walk, monitor)
    often = [topic for topic in heard if not topic.endswith(RARE)]
    for topic in often:
        shared_stage.wait_for(lambda topic=topic: bool(heard[topic]), f"a message on {topic}")
    shared_stage.wait_for(lambda: len(heard["/diagnostics"]) > 5, "diagnostics")
    graph = dict(shared_stage.node.get_topic_names_and_types())
    monitor.stop()
    live = {topic: (graph[topic][0], list(messages)) for topic, messages in heard.items()}
    lw.replay(recording, config, out=out)
    return {"live": live, "replay": read(out / "reports.mcap")}


def read(path: Path) -> Run:
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


@pytest.fixture(params=["live", "replay"])
def run(request: pytest.FixtureRequest, runs: dict[str, Run]) -> Run:
    return runs[request.param]


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


def test_a_curve_by_index_has_the_name_of_its_joint(run: Run) -> None:
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
    ((name, topic, _, kind),) = (
        (one.panel, one.topic, one.path, one.type) for one in layouts.rviz_references()
    )
    (display,) = (one for one in layouts.rviz()["Displays"] if one["Name"] == name)
    assert run[topic][0] == kind
    markers = [marker for message in run[topic][1] for marker in message.markers]
    assert {marker.ns for marker in markers} == set(display["Namespaces"])
    # without a transform, what is in the fixed frame is drawn, and nothing else
    frames = {marker.header.frame_id for marker in markers}
    assert frames == {layouts.rviz()["Global Options"]["Fixed Frame"]}
    assert frames == {layouts.foxglove()["configById"]["3D!leg"]["followTf"]}


def test_the_layouts_name_all_that_is_published_for_them(runs: dict[str, Run]) -> None:
    scalars = {topic for topic, (kind, _) in runs["live"].items() if kind == "std_msgs/msg/Float64"}
    assert len(scalars) == 20
    named = {curve.removesuffix("/data") for curve in layouts.plotjuggler_curves()}
    assert scalars <= named
    assert {f"{ME}/measured_torque", f"{ME}/markers"} <= set(runs["live"]) & set(runs["replay"])


def test_the_parameters_for_the_layouts_prevail_over_those_of_a_leg(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(MonitorNode, "_compile", lambda self, decoder: None)
    config = lw.share_directory() / "config"
    context = rclpy.Context()
    files = [
        word for name in ("monitor.yaml", "tools.yaml") for word in ("--params-file", str(config / name))
    ]
    rclpy.init(args=["--ros-args", "--log-level", "fatal", *files], context=context)
    try:
        node = MonitorNode(context=context, namespace="left")
        assert node.monitor.config.publish_scalars and node.monitor.config.publish_markers
        node.close()
        node.destroy_node()
    finally:
        try_shutdown(context=context)

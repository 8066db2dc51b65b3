"""The table of streams: what it says of messages is what ROS and the decoder say."""

import pytest

from leg_wear_monitor.messages.cdr import Decoder
from leg_wear_monitor.messages.streams import STREAMS, streams_of, streams_read, types
from leg_wear_monitor.monitor.config.inputs import TORQUE_SOURCES, DriveTorque, FootLoad
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.twin import CRANK, LOAD, TORQUE
from leg_wear_monitor.twin.sample import LOAD_SOURCES

pytestmark = pytest.mark.plain


@pytest.mark.parametrize("stream", STREAMS, ids=lambda stream: stream.type)
def test_fields_are_those_of_ros(stream):
    text, _ = types().generate_msgdef(stream.type, ros_version=2)
    own = [line.split() for line in text.split("=====")[0].splitlines() if line.strip()]
    assert tuple(f"{kind.split('/')[-1]} {name}" for kind, name in own) == stream.fields
    assert (stream.fields[0] == "Header header") is stream.has_stamp


def test_a_message_becomes_a_sample_of_its_stream_even_if_it_cannot_be_read():
    for stream in STREAMS:
        assert Decoder(MonitorConfig()).one(b"", stream.code)["kind"][0] == stream.kind


@pytest.mark.parametrize("source", TORQUE_SOURCES)
def test_each_source_of_torque_reads_the_crank_and_one_topic_a_stream(source):
    read = streams_read({TORQUE: source})
    assert len({stream.topic for stream in read}) == len(read) == (1 if source == "effort" else 2)
    assert [stream.topic for stream in read if stream.is_needed] == ["joint_states"]


@pytest.mark.parametrize("source", LOAD_SOURCES[1:])
def test_each_source_of_the_foot_load_adds_one_topic(source):
    added = set(streams_read({TORQUE: "wrench", LOAD: source})) - set(streams_read({TORQUE: "wrench"}))
    assert [stream.topic for stream in added] == ["foot_load"]
    assert {stream.source for stream in STREAMS if stream.kind == LOAD} == set(LOAD_SOURCES[1:])
    assert FootLoad(source=source).source == source


def test_a_stream_is_read_by_a_parameter_of_its_kind_or_always():
    assert {stream.kind for stream in STREAMS if stream.source} == {TORQUE, LOAD}
    config = MonitorConfig(drive_torque=DriveTorque(source="float64"), foot_load=FootLoad(source="contact"))
    assert [stream.source for stream in streams_of(config)] == ["", "float64", "contact"]
    assert [stream.kind for stream in streams_read({})] == [CRANK]

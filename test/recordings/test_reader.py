"""However messages were stored, the same samples come out, in order of log time."""

from collections.abc import Callable
from typing import Any

import attrs
import numpy as np
import pytest
from made_recordings import losses

from leg_wear_monitor.monitor.config.inputs import DriveTorque
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.recordings import encode
from leg_wear_monitor.recordings.findings import RecordingError
from leg_wear_monitor.twin import TORQUE
from leg_wear_monitor.twin.sample import NO_FAULT

Read = Callable[..., Any]


@pytest.fixture(scope="module")
def sent(traffic):
    return traffic()


@pytest.mark.parametrize("compression", ["ZSTD", "LZ4", "NONE"])
@pytest.mark.parametrize(
    "options",
    [
        {},
        {"enable_crcs": False},
        {"use_chunking": False},
        {"use_statistics": False},
        {"repeat_channels": False, "repeat_schemas": False},
        {"enable_data_crcs": True},
        {"definitions": False},
    ],
    ids=lambda options: "-".join(options) or "usual",
)
def test_every_way_to_store_gives_the_same_samples(
    tmp_path, sent, write_bag, expected, read, compression, options
):
    samples, recording = read(write_bag(tmp_path / "a.mcap", sent, compression, **options))
    assert samples.tobytes() == expected(sent).tobytes()
    assert not recording.is_partial
    assert recording.topics == {"joint_states": "/joint_states", "drive_torque": "/drive_torque"}


def test_messages_stored_out_of_order_come_in_order(tmp_path, sent, write_bag, expected, read):
    """Topic after topic, as some tools write: the whole file is one overlap."""
    by_topic = sorted(sent, key=lambda each: each.topic)
    samples, _ = read(write_bag(tmp_path / "a.mcap", by_topic))
    assert np.array_equal(np.sort(samples["stamp_ns"]), np.sort(expected(sent)["stamp_ns"]))
    assert set(map(bytes, samples)) == set(map(bytes, expected(sent)))
    assert (samples["kind"][:40] == TORQUE).any() and (samples["kind"][:40] != TORQUE).any()


def test_split_bags_and_several_files_are_one_recording(tmp_path, sent, write_bag, expected, read):
    parts = [write_bag(tmp_path / f"run_{i}.mcap", sent[i * 60 : (i + 1) * 60]) for i in range(15)]
    assert sum(len(sent[i * 60 : (i + 1) * 60]) for i in range(15)) >= len(sent)
    for paths in ([tmp_path], parts, parts[::-1]):
        samples, recording = read(*paths)
        assert samples.tobytes() == expected(sent).tobytes()
        assert not recording.is_partial


def test_topics_in_files_of_their_own_are_merged(tmp_path, sent, write_bag, expected, read):
    paths = []
    for topic in ("/joint_states", "/drive_torque"):
        only = [each for each in sent if each.topic == topic]
        paths.append(write_bag(tmp_path / f"{topic[1:]}.mcap", only))
    samples, _ = read(*paths)
    assert np.array_equal(samples["stamp_ns"], expected(sent)["stamp_ns"])


@pytest.mark.parametrize(
    ("storage", "mode", "remedy"),
    [
        (storage, mode, remedy)
        for storage in ("MCAP", "SQLITE3")
        for mode, remedy in (("MESSAGE", "ros2 bag convert"), ("FILE", "Run: zstd -d"))
    ],
)
def test_a_compressed_file_is_refused_with_the_remedy(
    tmp_path, sent, write_rosbag, read, storage, mode, remedy
):
    bag = write_rosbag(tmp_path / "bag", sent, storage, mode)
    with pytest.raises(RecordingError, match=remedy):
        read(bag)


@pytest.mark.parametrize(
    ("storage", "mode"),
    [("MCAP", "NONE"), ("MCAP", "STORAGE"), ("SQLITE3", "NONE")],
)
def test_bags_that_rosbags_writes(tmp_path, sent, write_rosbag, expected, read, storage, mode):
    samples, recording = read(write_rosbag(tmp_path / "bag", sent, storage, mode))
    assert samples.tobytes() == expected(sent).tobytes()
    assert not losses(recording)
    (tmp_path / "bag" / "metadata.yaml").unlink()
    assert read(tmp_path / "bag")[0].tobytes() == samples.tobytes()


def test_times_are_those_asked_for(tmp_path, sent, write_bag, read):
    path = write_bag(tmp_path / "a.mcap", sent)
    log = np.array([each.log_time_ns for each in sent if "service" not in each.topic])
    assert np.array_equal(read(path, time="log")[0]["stamp_ns"], log)
    assert np.array_equal(read(path, time="publish")[0]["stamp_ns"], log - 5)
    assert not np.array_equal(read(path)[0]["stamp_ns"], log)
    with pytest.raises(RecordingError, match="'wall' is not one of header, log, publish"):
        read(path, time="wall")


def test_a_log_time_heals_a_stamp_of_zero(tmp_path, write_bag, traffic, read):
    sent = [
        attrs.evolve(each, raw=each.raw[:4] + bytes(8) + each.raw[12:])
        for each in traffic(0.2)
        if each.topic != "/joint_states/_service_event"
    ]
    path = write_bag(tmp_path / "a.mcap", sent)
    assert (read(path)[0]["fault"] != NO_FAULT).all()
    assert (read(path, time="log")[0]["fault"] == NO_FAULT).all()


def test_a_torque_without_header_far_from_the_crank_is_reported(tmp_path, sent, store, write_bag, read):
    number = bytes(store.serialize_cdr(store.types["std_msgs/msg/Float64"](2.5), "std_msgs/msg/Float64"))
    bare = [
        attrs.evolve(each, type="std_msgs/msg/Float64", raw=number, log_time_ns=each.log_time_ns)
        if each.topic == "/drive_torque"
        else each
        for each in sent
    ]
    later = [attrs.evolve(each, log_time_ns=each.log_time_ns + 10**12) for each in bare]
    config = MonitorConfig(drive_torque=DriveTorque(source="float64"))
    samples, recording = read(write_bag(tmp_path / "a.mcap", later), config=config)
    assert (samples["torque_nm"][samples["kind"] == TORQUE] == 2.5).all()
    assert any("1000 s after" in str(finding) for finding in recording.findings)
    _, recording = read(write_bag(tmp_path / "b.mcap", bare), config=config)
    assert not recording.findings


def renamed(sent, prefix):
    return [attrs.evolve(each, topic=prefix + each.topic) for each in sent]


def test_topics_in_a_namespace_are_found_and_several_must_be_named(tmp_path, sent, write_bag, expected, read):
    path = write_bag(tmp_path / "one.mcap", renamed(sent, "/left"))
    samples, recording = read(path)
    assert recording.topics["joint_states"] == "/left/joint_states"
    assert samples.tobytes() == expected(sent).tobytes()
    both = write_bag(tmp_path / "two.mcap", renamed(sent, "/left") + renamed(sent, "/right"))
    with pytest.raises(RecordingError, match="could be /left/joint_states, /right/joint_states; select"):
        read(both)
    named = {"joint_states": "right/joint_states", "drive_torque": "/right/drive_torque"}
    assert read(both, **named)[0].tobytes() == expected(sent).tobytes()
    with pytest.raises(RecordingError, match="/up/joint_states: is not a topic of the recording"):
        read(both, joint_states="/up/joint_states")


def test_a_torque_in_the_namespace_of_another_leg_is_not_read(tmp_path, sent, write_bag, expected, read):
    cranks = [each for each in sent if each.topic == "/joint_states"]
    torques = [each for each in sent if each.topic == "/drive_torque"]
    path = write_bag(tmp_path / "apart.mcap", renamed(cranks, "/left") + renamed(torques, "/right"))
    samples, recording = read(path)
    assert recording.topics == {"joint_states": "/left/joint_states"}
    assert samples.tobytes() == expected(cranks).tobytes()
    assert any("drive_torque: is not a topic" in finding.text for finding in recording.findings)
    both = write_bag(tmp_path / "two.mcap", renamed(sent, "/left") + renamed(sent, "/right"))
    samples, recording = read(both, joint_states="/right/joint_states")
    assert recording.topics["drive_torque"] == "/right/drive_torque"
    assert samples.tobytes() == expected(sent).tobytes()


def test_what_cannot_be_used_is_refused_by_name(tmp_path, sent, write_bag, read):
    torque_only = [each for each in sent if each.topic == "/drive_torque"]
    with pytest.raises(
        RecordingError,
        match=r"a.mcap: joint_states: is not a topic .* it has /drive_torque; select .* --joint-states",
    ):
        read(write_bag(tmp_path / "a.mcap", torque_only))
    joints_only = [each for each in sent if each.topic == "/joint_states"]
    _, recording = read(write_bag(tmp_path / "b.mcap", joints_only))
    assert any("drive_torque: is not a topic" in str(finding) for finding in recording.findings)
    assert not any("select" in str(finding) for finding in recording.findings)
    other = [attrs.evolve(each, topic="/motor/torque") for each in torque_only]
    _, recording = read(write_bag(tmp_path / "d.mcap", joints_only + other))
    (note,) = recording.findings
    assert str(note).endswith("it has /joint_states, /motor/torque; select one with --drive-torque")
    config = MonitorConfig(drive_torque=DriveTorque(source="float64"))
    expected = "/drive_torque: is of type geometry_msgs/msg/WrenchStamped. Expected std_msgs/msg/Float64"
    with pytest.raises(RecordingError, match=expected):
        read(write_bag(tmp_path / "c.mcap", sent), config=config)


@pytest.fixture
def write_as(tmp_path):
    """Write topics, times and bytes with any encoding, and one schema for all or none."""
    writer_module = pytest.importorskip("mcap.writer")

    def write(messages, encoding="cdr", schema=None):
        with (tmp_path / "a.mcap").open("wb") as file:
            writer = writer_module.Writer(file)
            writer.start("ros2", "test")
            known = writer.register_schema(*schema) if schema else 0
            topics = {topic for topic, *_ in messages}
            channels = {topic: writer.register_channel(topic, encoding, known) for topic in topics}
            for topic, time, raw in messages:
                writer.add_message(channels[topic], time, raw, 0)
            writer.finish()
        return tmp_path / "a.mcap"

    return write


@pytest.mark.parametrize("encoding", ["json", "protobuf", ""])
def test_other_encodings_are_refused(write_as, read, encoding):
    path = write_as([("/joint_states", 1, b"{}")], encoding, (encode.JOINT_STATE, "jsonschema", b"{}"))
    with pytest.raises(RecordingError, match=f"/joint_states: is encoded as '{encoding}'. Expected 'cdr'"):
        read(path)


def test_a_topic_without_a_type_is_read_as_what_it_must_be(sent, expected, write_as, read):
    path = write_as([(each.topic, each.log_time_ns, each.raw) for each in sent])
    assert read(path)[0].tobytes() == expected(sent).tobytes()


def test_an_effort_is_the_torque_where_it_is_asked_for(tmp_path, sent, write_bag, read):
    config = MonitorConfig(drive_torque=DriveTorque(source="effort"))
    samples, recording = read(write_bag(tmp_path / "a.mcap", sent), config=config)
    assert recording.topics == {"joint_states": "/joint_states"}
    assert np.isfinite(samples["torque_nm"]).all()


def test_memory_stays_flat(tmp_path, write_bag, traffic):
    """No block holds more than a few chunks, however long the recording."""
    from leg_wear_monitor.recordings.reader import Recording

    path = write_bag(tmp_path / "a.mcap", traffic(40.0))
    with Recording([path], MonitorConfig()) as recording:
        fractions, sizes = zip(
            *((block.fraction, len(block.samples)) for block in recording.blocks()), strict=True
        )
    assert sum(sizes) == 16000
    assert max(sizes) < 5000
    assert list(fractions) == sorted(fractions) and fractions[-1] == 1.0

"""What we write, the libraries read: message by message, indexed, with sound checksums."""

import resource

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leg_wear_monitor.recordings import encode
from leg_wear_monitor.recordings.findings import RecordingError
from leg_wear_monitor.recordings.mcap_file import McapWriter
from leg_wear_monitor.recordings.streams import LATCHED, SENSOR_DATA, definition

mcap_reader = pytest.importorskip("mcap.reader")
EndOfFile = pytest.importorskip("mcap.exceptions").EndOfFile
Message = pytest.importorskip("mcap.records").Message
StreamReader = pytest.importorskip("mcap.stream_reader").StreamReader

numbers = st.floats(width=64, allow_nan=False)
stamps = st.integers(0, 2**31 * 10**9 - 1)


@given(
    stamp_ns=st.lists(stamps, min_size=1, max_size=3),
    names=st.lists(st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"])), max_size=3),
    given_parts=st.sets(st.sampled_from(["position", "velocity", "effort"])),
    data=st.data(),
)
def test_joint_states_are_as_rosbags_writes_them(store, joint_state, stamp_ns, names, given_parts, data):
    shape = (len(stamp_ns), len(names))
    values = st.lists(numbers, min_size=shape[0] * shape[1], max_size=shape[0] * shape[1])
    parts = {part: np.reshape(data.draw(values), shape) for part in sorted(given_parts)}
    rows = encode.joint_states(stamp_ns, names, frame_id="pelvis", **parts)
    for i, stamp in enumerate(stamp_ns):
        theirs = {part: values[i] for part, values in parts.items()}
        message = joint_state(names, stamp_ns=stamp, frame="pelvis", **theirs)
        assert rows[i].tobytes() == bytes(store.serialize_cdr(message, encode.JOINT_STATE))


@given(
    stamp_ns=stamps, torque=st.tuples(numbers, numbers, numbers), frame=st.sampled_from(["", "a", "pelvis"])
)
def test_wrenches_are_as_rosbags_writes_them(store, wrench, stamp_ns, torque, frame):
    rows = encode.wrenches([stamp_ns], torque=[torque], frame_id=frame)
    expected = store.serialize_cdr(wrench((0, 0, 0), torque, stamp_ns, frame), encode.WRENCH_STAMPED)
    assert rows[0].tobytes() == bytes(expected)


texts = st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]), max_size=9)
statuses = st.tuples(texts, st.integers(0, 3), texts, texts, st.dictionaries(texts, texts, max_size=3))


@given(stamp_ns=stamps, reported=st.lists(statuses, max_size=3), frame=texts)
def test_diagnostics_are_as_rosbags_writes_them(store, stamp_ns, reported, frame):
    make = store.types
    pair = make["diagnostic_msgs/msg/KeyValue"]
    status = [
        make["diagnostic_msgs/msg/DiagnosticStatus"](
            level=level,
            name=name,
            message=message,
            hardware_id=hardware,
            values=[pair(*each) for each in values.items()],
        )
        for name, level, message, hardware, values in reported
    ]
    stamp = make["builtin_interfaces/msg/Time"](*divmod(stamp_ns, 10**9))
    array = make[encode.DIAGNOSTIC_ARRAY](make["std_msgs/msg/Header"](stamp, frame), status)
    expected = bytes(store.serialize_cdr(array, encode.DIAGNOSTIC_ARRAY))
    assert encode.diagnostic_array(stamp_ns, reported, frame) == expected


@pytest.fixture
def written(tmp_path):
    """A file of two topics in many chunks, and what is in it."""
    path = tmp_path / "out.mcap"
    times = np.arange(1000, dtype=np.int64) * 1_000_000 + 7
    joints = encode.joint_states(times, ["A", "B"], effort=np.random.default_rng(1).normal(size=(1000, 2)))
    with McapWriter(path, chunk_bytes=5000) as writer:
        one = writer.channel("/monitor/impact_forces", encode.JOINT_STATE, SENSOR_DATA)
        other = writer.channel("/monitor/alarms", encode.DIAGNOSTIC_ARRAY, LATCHED)
        single = encode.diagnostic_array(1, [])
        for begin in range(0, 1000, 100):
            writer.write_many(one, times[begin : begin + 100], joints[begin : begin + 100])
            writer.write(other, int(times[begin]), single)
    return path, {
        "/monitor/impact_forces": list(zip(times.tolist(), map(bytes, joints), strict=True)),
        "/monitor/alarms": [(int(time), single) for time in times[::100]],
    }


def test_the_mcap_library_reads_all_of_it(written):
    path, expected = written
    with path.open("rb") as file:
        reader = mcap_reader.make_reader(file, validate_crcs=True)
        assert reader.get_header().profile == "ros2"
        summary = reader.get_summary()
        assert summary.statistics.message_count == 1010
        assert len(summary.chunk_indexes) == summary.statistics.chunk_count > 5
        got = {topic: [] for topic in expected}
        for schema, channel, message in reader.iter_messages():
            assert (schema.encoding, channel.message_encoding) == ("ros2msg", "cdr")
            assert schema.data.decode() == definition(schema.name)
            got[channel.topic].append((message.log_time, message.data))
    assert got == expected
    with path.open("rb") as file:  # the data and summary checksums of the records in between
        assert sum(1 for _ in StreamReader(file, validate_crcs=True).records) > 1010


def test_rosbags_plays_it_with_its_quality_of_service(written):
    path, expected = written
    from rosbags.rosbag2 import Reader

    with Reader(path) as bag:
        offered = {each.topic: each.ext.offered_qos_profiles for each in bag.connections}
        assert [profile.durability.name for profile in offered["/monitor/alarms"]] == ["TRANSIENT_LOCAL"]
        assert [profile.reliability.name for profile in offered["/monitor/impact_forces"]] == ["BEST_EFFORT"]
        assert bag.message_count == 1010
        assert sorted((each.topic, time, bytes(raw)) for each, time, raw in bag.messages()) == sorted(
            (topic, time, raw) for topic, messages in expected.items() for time, raw in messages
        )


def test_what_was_flushed_is_there_without_an_end(tmp_path):
    writer = McapWriter(tmp_path / "killed.mcap")
    channel = writer.channel("/joint_states", encode.JOINT_STATE)
    raw = encode.joint_states([1], ["crank"], position=[[0.5]])[0].tobytes()
    for i in range(10):
        writer.write(channel, i + 1, raw)
    writer.flush()
    writer.write(channel, 99, raw)
    content = writer.path.read_bytes()  # as a killed process leaves it
    writer.close()
    (tmp_path / "left.mcap").write_bytes(content)
    messages = []
    with (tmp_path / "left.mcap").open("rb") as file, pytest.raises(EndOfFile):
        for record in StreamReader(file).records:
            if isinstance(record, Message):
                messages.append(record)
    assert [message.log_time for message in messages] == list(range(1, 11))


def test_an_empty_recording_is_a_sound_file(tmp_path):
    with McapWriter(tmp_path / "empty.mcap"):
        pass
    with (tmp_path / "empty.mcap").open("rb") as file:
        assert mcap_reader.make_reader(file).get_summary().statistics.message_count == 0


def test_a_full_disk_is_said():
    with pytest.raises(RecordingError, match="/dev/full: cannot be written: No space left on device"):
        McapWriter("/dev/full")


def test_what_fits_on_a_full_disk_stays_readable(tmp_path):
    raw = encode.joint_states([1], ["crank"], position=[[0.5]])[0].tobytes()
    noise = np.random.default_rng(1).bytes(20000)
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    with McapWriter(tmp_path / "out.mcap") as writer:
        channel = writer.channel("/joint_states", encode.JOINT_STATE)
        writer.write(channel, 1, raw)
        writer.flush()
        resource.setrlimit(resource.RLIMIT_FSIZE, (8000, limits[1]))
        try:
            writer.write(channel, 2, noise)
            with pytest.raises(RecordingError, match="cannot be written: File too large"):
                writer.flush()
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    with writer.path.open("rb") as file, pytest.raises(EndOfFile):
        records = StreamReader(file, validate_crcs=True).records
        assert next(one.log_time for one in records if isinstance(one, Message)) == 1
        list(records)


def test_a_place_that_cannot_be_written_is_named(tmp_path):
    with pytest.raises(RecordingError, match="nowhere"):
        McapWriter(tmp_path / "nowhere" / "out.mcap")

"""Reading recordings: MCAP and SQLite, whole and damaged, within memory."""

import os
import shutil
import sqlite3
import struct
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import attrs
import lz4.frame
import numpy as np
import pytest
import zstandard
from made_recordings import losses

from leg_wear_monitor.monitor.config.inputs import DriveTorque
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.recordings import encode, findings
from leg_wear_monitor.recordings.findings import RecordingError
from leg_wear_monitor.twin import TORQUE
from leg_wear_monitor.twin.sample import NO_FAULT

# However messages were stored, the same samples come out, in order of log time.


Read = Callable[..., Any]


@pytest.fixture(scope="module")
def sent(traffic):
    return traffic()


@pytest.fixture(scope="module")
def few(traffic):
    return traffic(0.5)


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


# A .db3 file with all that was committed to it, whatever it is called and however it was left.


@pytest.fixture
def path(tmp_path, few, write_database):
    """A closed database."""
    return Path(shutil.copy(write_database(tmp_path / "bag", few), tmp_path / "x.db3"))


def test_a_file_that_was_not_closed_is_a_loss_with_the_remedy(tmp_path, path, few, read):
    """As a recorder leaves it that was killed."""
    with closing(sqlite3.connect(path, isolation_level=None)) as database:
        rows = database.execute("SELECT * FROM messages WHERE id > 20").fetchall()
        database.execute("DELETE FROM messages WHERE id > 20")
        database.execute("PRAGMA journal_mode = wal")
        database.executemany("INSERT INTO messages VALUES (?, ?, ?, ?)", rows)
        for end in ("", "-wal"):
            shutil.copy(f"{path}{end}", tmp_path / f"left.db3{end}")
    _, recording = read(tmp_path / "left.db3")
    (text,) = losses(recording)
    assert text == ('was not closed: left.db3-wal is not read. Run: sqlite3 left.db3 "PRAGMA wal_checkpoint"')


def test_without_an_index_of_time_the_order_is_the_same(path, few, expected, read):
    with closing(sqlite3.connect(path)) as database, database:
        query = "SELECT name FROM sqlite_master WHERE sql LIKE 'CREATE INDEX%'"
        for (name,) in database.execute(query).fetchall():
            database.execute(f"DROP INDEX {name}")
    samples, _ = read(path)
    assert samples.tobytes() == expected(few).tobytes()


# What a recording claims does not decide how much memory it gets; what it is not given is reported.


BOMB_BYTES = 100_000_000


def with_a_chunk(whole, data, compression, size, is_cut=False):
    """A file without an index, and one chunk more at its end."""
    content = whole[: whole.rindex(struct.pack("<BQ", 0x0F, 4))]
    head = struct.pack("<QQQII", 0, 0, size, 0, len(compression)) + compression + struct.pack("<Q", len(data))
    chunk = struct.pack("<BQ", 0x06, len(head) + len(data)) + head + data
    end = struct.pack("<BQI", 0x0F, 4, 0) + struct.pack("<BQQQI", 0x02, 20, 0, 0, 0) + b"\x89MCAP0\r\n"
    return content + (chunk[: len(chunk) * 9 // 10] if is_cut else chunk + end)


@pytest.mark.parametrize("is_cut", [False, True])
@pytest.mark.parametrize("claimed", [BOMB_BYTES, 1000])
@pytest.mark.parametrize("compression", ["zstd", "lz4"])
def test_a_chunk_that_grows_is_left_out_and_reported(
    tmp_path, monkeypatch, few, write_bag, expected, read, compression, claimed, is_cut
):
    monkeypatch.setattr(findings, "MOST_BYTES", 8_000_000)
    index_types = pytest.importorskip("mcap.writer").IndexType
    whole = write_bag(tmp_path / "whole.mcap", few, index_types=index_types.NONE).read_bytes()
    compress = zstandard.compress if compression == "zstd" else lz4.frame.compress
    path = tmp_path / "bomb.mcap"
    bomb = compress(bytes(BOMB_BYTES))
    path.write_bytes(with_a_chunk(whole, bomb, compression.encode(), claimed, is_cut))
    samples, recording = read(path)
    assert samples.tobytes() == expected(few).tobytes()
    assert recording.is_partial
    if claimed == BOMB_BYTES and not is_cut:
        texts = [str(finding) for finding in recording.findings]
        assert any("needs 100 MB to be read. Expected at most 8 MB" in text for text in texts)


def test_a_hole_that_claims_gigabytes_is_passed_over(tmp_path, few, write_bag, expected, read):
    index_types = pytest.importorskip("mcap.writer").IndexType
    whole = write_bag(tmp_path / "whole.mcap", few, index_types=index_types.NONE).read_bytes()
    content = whole[: whole.rindex(struct.pack("<BQ", 0x0F, 4))] + struct.pack("<BQ", 0x05, 2**33)
    path = tmp_path / "hole.mcap"
    path.write_bytes(content)
    os.truncate(path, len(content) + 2**33)
    samples, recording = read(path)
    assert samples.tobytes() == expected(few).tobytes()
    assert any("is cut off or damaged at byte" in str(finding) for finding in recording.findings)


@pytest.mark.parametrize(("name", "in_a_bag"), [("x.mcap", False), ("x.db3", False), ("x.mcap", True)])
def test_a_pipe_is_refused_without_a_wait(tmp_path, read, name, in_a_bag):
    home = tmp_path / "bag" if in_a_bag else tmp_path
    home.mkdir(exist_ok=True)
    os.mkfifo(home / name)
    with pytest.raises(RecordingError, match=r"not a file\. Expected|contains no \.mcap or \.db3 file"):
        read(home if in_a_bag else home / name)


@pytest.mark.parametrize("name", ["x" * 300 + ".mcap", "x\0y.mcap"])
def test_a_name_that_cannot_be_is_refused_in_a_line(tmp_path, read, name):
    with pytest.raises(RecordingError, match=r"cannot be read: |does not exist") as caught:
        read(tmp_path / name)
    assert str(caught.value).isprintable()

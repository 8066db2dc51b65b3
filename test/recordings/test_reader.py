"""Recordings: bags, tables and arrays as samples; one recording of one leg."""

import os
import shutil
import sqlite3
import struct
from contextlib import closing
from decimal import Decimal
from pathlib import Path

import attrs
import lz4.frame
import numpy as np
import pytest
import zstandard
from made_recordings import losses

from leg_wear_monitor.errors import printable
from leg_wear_monitor.monitor.config.inputs import TORQUE_SOURCES, DriveTorque
from leg_wear_monitor.monitor.config.parameters import config_from
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.recordings import encode, findings
from leg_wear_monitor.recordings.findings import Finding, RecordingError, Severity
from leg_wear_monitor.recordings.mcap_file import McapWriter
from leg_wear_monitor.twin import TORQUE
from leg_wear_monitor.twin.sample import NO_FAULT

# Reading recordings: MCAP and SQLite, whole and damaged, within memory.


# However messages were stored, the same samples come out, in order of log time.


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
    assert not np.array_equal(read(path)[0]["stamp_ns"], log)
    with pytest.raises(RecordingError, match="'wall' is not one of header, log"):
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


# Several files are one recording of one leg, or are refused; names in them obey nobody.


START_NS, RATE_HZ = 1_700_000_000 * 10**9, 200


def write(path, *, begin=0, end=400, topic="/joint_states", names=("hip", "crank")):
    """Part of a crank's motion, of which each sample is the same in any file that has it."""
    k = np.arange(begin, end, dtype=np.int64)
    stamps = START_NS + k * (10**9 // RATE_HZ)
    angle = 2.0 * np.pi * k / RATE_HZ
    rows = encode.joint_states(stamps, list(names), position=np.stack([0.0 * angle, angle], axis=1))
    with McapWriter(path, chunk_bytes=8000) as writer:
        channel = writer.channel(topic, encode.JOINT_STATE)
        for i in range(0, len(k), 40):
            writer.write_many(channel, stamps[i : i + 40], rows[i : i + 40])
            writer.flush()
    return path


def test_another_namespace_is_another_leg_unless_one_is_named(tmp_path, read):
    left = write(tmp_path / "left.mcap")
    right = write(tmp_path / "right.mcap", topic="/right/joint_states")
    with pytest.raises(RecordingError, match=r"right\.mcap: joint_states: has /right/joint_states, where"):
        read(left, right)
    samples, recording = read(left, right, joint_states="/right/joint_states")
    assert len(samples) == 400
    assert any("has no topic /right/joint_states" in finding.text for finding in recording.findings)


def test_a_part_of_a_split_bag_may_have_no_crank(tmp_path, read):
    """Its first message may be of another publisher, and the recording end there."""
    write(tmp_path / "walk_0.mcap")
    write(tmp_path / "walk_1.mcap", begin=400, end=401, names=("hip", "knee"))
    samples, recording = read(tmp_path)
    assert np.count_nonzero(samples["fault"] == 0) == 400
    assert any("joint crank is not in 1 messages" in one.text for one in recording.findings)


def test_parts_and_overlaps_of_one_leg_are_one(tmp_path, read):
    parts = [
        write(tmp_path / f"{begin}_{end}.mcap", begin=begin, end=end)
        for begin, end in ((0, 200), (150, 300), (300, 400), (0, 400))
    ]
    samples, recording = read(*parts)
    assert len(samples) == 850
    assert len(np.unique(samples["stamp_ns"])) == 400
    assert not recording.is_partial


def test_messages_without_the_crank_among_others_are_a_finding(tmp_path, read):
    """As where two drivers publish their joints on one topic."""
    arm = write(tmp_path / "arm.mcap", names=("elbow", "wrist\x1b[2J"))
    both = tmp_path / "both.mcap"
    with pytest.raises(RecordingError, match=r"the joints are elbow, wrist\\x1b\[2J; set crank_joint"):
        read(arm)
    stamps = START_NS + np.arange(400, dtype=np.int64) * 5_000_000
    with McapWriter(both) as writer:
        channel = writer.channel("/joint_states", encode.JOINT_STATE)
        for names in (["elbow"], ["crank"]):
            writer.write_many(
                channel, stamps, encode.joint_states(stamps, names, position=np.zeros((400, 1)))
            )
    samples, recording = read(both)
    assert len(samples) == 800
    texts = [finding.text for finding in recording.findings if "crank" in finding.text]
    assert texts == ["joint crank is not in 400 messages; 400 messages have it"]
    assert not recording.is_partial


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("/joint_states", "/joint_states"),
        ("Größe μ", "Größe μ"),
        ("\x1b[2J", "\\x1b[2J"),
        ("a\nb\r\x9b", "a\\nb\\r\\x9b"),
        ("\u202e", "\\u202e"),
        ("\udcff", "\\udcff"),
        ("x" * 3000, "x" * 2000 + " and 1000 characters more"),
    ],
)
def test_what_is_shown_can_be_shown(text, shown):
    assert printable(text) == shown
    assert printable(text).isprintable()
    assert str(RecordingError(text, text, text)) == f"{shown}: {shown}: {shown}"
    assert str(Finding(Path("x"), text, Severity.NOTE)) == f"x: {shown}"


def test_names_in_a_file_obey_nobody(tmp_path, read):
    path = write(tmp_path / "x.mcap", topic="/\x1b]0;owned\x07/states")
    with pytest.raises(RecordingError) as caught:
        read(path)
    assert str(caught.value).isprintable()
    assert "\\x1b]0;owned\\x07" in str(caught.value)


# The same values as CSV, as Parquet, as arrays and as MCAP give the same samples, bit for bit.


NS = {"table.units.stamp": "ns", "table.columns.crank_speed": "crank_speed"}
NAMES = ("time", "crank_angle", "crank_speed", "drive_torque")
FIELDS = ("stamp_ns", "crank_angle_rad", "crank_velocity_radps", "torque_nm")


@pytest.fixture(scope="module")
def bag_messages(traffic):
    return traffic()


def columns_of(samples):
    """A row a sample, with NaN where it has no value."""
    return {name: samples[field].copy() for name, field in zip(NAMES, FIELDS, strict=True)}


def cell(value):
    if isinstance(value, int):
        return str(value)
    return "" if np.isnan(value) else repr(value)


def write_csv(path, columns, separator=","):
    rows = zip(*(np.asarray(column).tolist() for column in columns.values()), strict=True)
    lines = [separator.join(columns), *(separator.join(map(cell, row)) for row in rows)]
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize("separator", [",", ";", "\t", " "])
def test_a_csv_file_gives_the_samples_of_the_bag(tmp_path, bag_messages, write_bag, read, separator):
    """Their stamps go back now and then, as torques are late: the order of the rows is that of arrival."""
    samples, _ = read(write_bag(tmp_path / "a.mcap", bag_messages))
    columns = columns_of(samples)
    if separator == " ":  # in which an empty cell cannot be written
        columns = {name: np.nan_to_num(column) for name, column in columns.items()}
        samples = read(columns, config=config_from(NS))[0]
    found, _ = read(write_csv(tmp_path / "a.csv", columns, separator), config=config_from(NS))
    assert found.tobytes() == samples.tobytes()


def test_arrays_frames_and_parquet_give_the_samples_of_the_bag(tmp_path, bag_messages, expected, read):
    columns = columns_of(expected(bag_messages))
    assert read(columns, config=config_from(NS))[0].tobytes() == expected(bag_messages).tobytes()
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame(columns)
    assert read(frame, config=config_from(NS))[0].tobytes() == expected(bag_messages).tobytes()
    assert (
        read(frame.set_index("time"), config=config_from(NS))[0].tobytes() == expected(bag_messages).tobytes()
    )
    pytest.importorskip("pyarrow")
    frame.to_parquet(tmp_path / "a.parquet")
    assert (
        read(tmp_path / "a.parquet", config=config_from(NS))[0].tobytes() == expected(bag_messages).tobytes()
    )


def test_dates_are_stamps_to_the_nanosecond(tmp_path, bag_messages, expected, read):
    config = config_from(NS | {"table.units.stamp": "date"})
    columns = columns_of(expected(bag_messages))
    dates = columns["time"].view("datetime64[ns]")
    assert read(columns | {"time": dates}, config=config)[0].tobytes() == expected(bag_messages).tobytes()
    for mark in ("", "Z", "+00:00"):
        lines = write_csv(tmp_path / "a.csv", columns).read_text().splitlines()
        cells = [f"{str(date).replace('T', ' ')}{mark}" for date in dates]
        dated = [f"{date},{line.partition(',')[2]}" for date, line in zip(cells, lines[1:], strict=True)]
        (tmp_path / "a.csv").write_text("\n".join([lines[0], *dated]) + "\n")
        assert read(tmp_path / "a.csv", config=config)[0].tobytes() == expected(bag_messages).tobytes()


@pytest.mark.parametrize(("unit", "power"), [("s", 9), ("ms", 6), ("us", 3), ("ns", 0)])
@pytest.mark.parametrize("start_ns", [0, 1_700_000_000 * 10**9])
def test_times_in_any_unit_are_exact_to_a_microsecond(tmp_path, read, unit, power, start_ns):
    stamps = start_ns + np.random.default_rng(power).integers(1, 10**13, 300)
    lines = [f"{Decimal(int(stamp)).scaleb(-power)},0.5" for stamp in stamps]
    (tmp_path / "a.csv").write_text("\n".join(["time,crank_angle", *lines]) + "\n")
    config = config_from({"table.units.stamp": unit, "table.columns.drive_torque": ""})
    found = read(tmp_path / "a.csv", config=config)[0]["stamp_ns"]
    assert np.abs(found - stamps).max() < 1000
    assert unit != "ns" or np.array_equal(found, stamps)


@pytest.mark.parametrize("source", TORQUE_SOURCES)
def test_a_torque_comes_as_the_parameters_say(read, source):
    config = config_from({"drive_torque.source": source, "drive_torque.axis": "x", "drive_torque.sign": -1})
    columns = {
        "time": np.arange(1.0, 4.0),
        "crank_angle": np.arange(3.0),
        "drive_torque": np.arange(5.0, 8.0),
    }
    samples, _ = read(columns, config=config)
    assert len(samples) == (3 if source == "effort" else 6)
    torques = samples[np.isfinite(samples["torque_nm"])]
    assert torques["torque_nm"].tolist() == [-5.0, -6.0, -7.0]
    assert torques["stamp_ns"].tolist() == [10**9, 2 * 10**9, 3 * 10**9]


def test_units_become_si(read):
    config = config_from(
        {
            "table.units.stamp": "ms",
            "table.units.crank_angle": "deg",
            "table.units.crank_speed": "rpm",
            "table.units.drive_torque": "N mm",
            "table.columns.crank_speed": "speed",
            "table.start": "2026-03-01T00:00:00Z",
        }
    )
    columns = {"time": [0, 1], "crank_angle": [90, 180], "speed": [60, 30], "drive_torque": [12345, 0.1]}
    samples, _ = read(columns, config=config)
    assert samples["crank_angle_rad"][::2].tolist() == [np.pi / 2.0, np.pi]
    assert samples["crank_velocity_radps"][::2].tolist() == pytest.approx([2.0 * np.pi, np.pi], rel=1e-15)
    assert samples["torque_nm"][1::2].tolist() == [12.345, 0.0001]
    first_ns = int(np.datetime64("2026-03-01", "ns").astype(np.int64))
    assert samples["stamp_ns"].tolist() == [first_ns, first_ns, first_ns + 10**6, first_ns + 10**6]


def test_further_encoders_are_columns_by_their_names(read):
    config = config_from(
        {"encoders.names": ["knee", "hip"], "encoders.joints": ["C", "B"], "encoders.signs": [1.0, -1.0]}
    )
    columns = {
        "time": [1.0, 2.0, 3.0],
        "crank_angle": [0.1, 0.2, 0.3],
        "drive_torque": [np.nan] * 3,
        "knee": [1.0, np.nan, 3.0],
        "hip": [4.0, 5.0, np.nan],
    }
    samples, _ = read(columns, config=config)
    assert samples["crank_angle_rad"].tolist() == [0.1, 0.2, 0.3]
    assert np.array_equal(
        samples["encoder_rad"][:, :2], [[1.0, -4.0], [np.nan, -5.0], [3.0, np.nan]], equal_nan=True
    )


def test_rows_without_a_time_come_at_their_rate(tmp_path, read):
    config = config_from(
        {
            "table.columns.drive_torque": "",
            "table.columns.crank_angle": "2",
            "table.rate_hz": 400.0,
            "table.start": "1970-01-01T00:00:01",
        }
    )
    (tmp_path / "a.csv").write_text("7,0.1\n7,x\n7,0.3\n")  # and no names: columns have numbers
    samples, recording = read(tmp_path / "a.csv", config=config)
    assert samples["stamp_ns"].tolist() == [10**9, 10**9 + 5 * 10**6]
    assert [finding.text for finding in recording.findings] == [
        "drive_torque: is not a topic of the recording; it has /joint_states",
        "line 2 is lost: column '2': 'x' is not a number. Expected a value in rad",
    ]


def test_several_files_and_a_bag_are_one_recording(tmp_path, traffic, write_bag, expected, read):
    first, second = traffic(), traffic(start_ns=1_700_000_003 * 10**9)
    bag = write_bag(tmp_path / "a.mcap", second)
    table = write_csv(tmp_path / "b.csv", columns_of(expected(first)))
    samples, recording = read(bag, table, config=config_from(NS))
    assert samples.tobytes() == np.concatenate([expected(first), expected(second)]).tobytes()
    assert any("begins" in finding.text for finding in recording.findings)


def test_a_file_larger_than_a_block_is_read_whole(tmp_path, read):
    stamps = 1 + np.arange(60_000)
    columns = {"time": stamps, "crank_angle": np.random.default_rng(0).normal(size=len(stamps))}
    config = config_from({"table.units.stamp": "ms", "table.columns.drive_torque": ""})
    path = write_csv(tmp_path / "a.csv", columns)
    samples, _ = read(path, config=config)
    assert np.array_equal(samples["crank_angle_rad"], columns["crank_angle"])
    assert np.array_equal(samples["stamp_ns"], stamps * 10**6)


def test_a_number_that_is_none_is_a_faulty_sample_and_an_empty_cell_is_no_sample(tmp_path, read):
    (tmp_path / "a.csv").write_text("time,crank_angle,drive_torque\n1.1,nan,\n1.2,0.5,nan\n1.3,,4\n")
    samples, _ = read(tmp_path / "a.csv", config=config_from({}))
    assert samples["stamp_ns"].tolist() == [1_100_000_000, 1_200_000_000, 1_200_000_000, 1_300_000_000]
    assert (samples["fault"] != 0).tolist() == [True, False, True, False]

"""Messages and files of MCAP: what libraries write we read, and what we write they read."""

import math
import resource

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from leg_wear_monitor.monitor.config.inputs import Crank, DriveTorque, Encoders, FootLoad
from leg_wear_monitor.monitor.config.settings import DriveParameters, MonitorConfig
from leg_wear_monitor.recordings import encode
from leg_wear_monitor.recordings.cdr import MESSAGE, Decoder
from leg_wear_monitor.recordings.findings import RecordingError
from leg_wear_monitor.recordings.mcap_file import McapWriter
from leg_wear_monitor.recordings.streams import (
    CONTACT,
    FLOAT64,
    INTERFACES,
    JOINT_STATE,
    LATCHED,
    LOAD_FLOAT64,
    LOAD_WRENCH,
    SENSOR_DATA,
    STREAMS,
    WRENCH_STAMPED,
    definition,
    types,
)
from leg_wear_monitor.twin import CRANK, LOAD, TORQUE
from leg_wear_monitor.twin.sample import (
    EMPTY,
    FAULTS,
    MISSING_JOINT,
    NO_FAULT,
    NOT_FINITE,
    UNDECODABLE,
    WRONG_LENGTH,
    ZERO_STAMP,
)

# Every message is read as rosbags and mcap-ros2-support read it, whole or not.


NAME = {stream.code: stream.type for stream in STREAMS}
CRANK_NAME = "ζ_crank"
BY_EFFORT = MonitorConfig(crank_joint=CRANK_NAME, drive_torque=DriveTorque(source="effort"))

numbers = st.floats(width=64)
stamps = st.integers(0, 2**31 * 10**9 - 1)
frames = st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]), max_size=9)
joints = st.lists(st.sampled_from(["hip", "knee", "a", "", CRANK_NAME, "crank"]), max_size=8)


def same(mine, theirs):
    """Bit for bit, but for the sign and the payload of a NaN."""
    return mine == theirs or (math.isnan(mine) and math.isnan(theirs))


def expected_crank(message, crank):
    """What a JointState means, given once more in plain words: fault, position, velocity, effort."""
    nothing = (math.nan, math.nan, math.nan)
    count = len(message.name)
    if not count or not len(message.position):
        return EMPTY, *nothing
    if len(message.position) != count or {len(message.velocity), len(message.effort)} - {0, count}:
        return WRONG_LENGTH, *nothing
    if list(message.name).count(crank) != 1:  # twice: nothing says which of them is the crank
        return MISSING_JOINT, *nothing
    index = list(message.name).index(crank)
    position, velocity, effort = (
        float(values[index]) if len(values) else math.nan
        for values in (message.position, message.velocity, message.effort)
    )
    well = math.isfinite(position) and not math.isinf(velocity) and not math.isinf(effort)
    return NO_FAULT if well else NOT_FINITE, position, velocity, effort


@st.composite
def joint_states(draw):
    """Parts of a JointState: mostly consistent, at times not."""
    name = draw(joints)
    lengths = st.one_of(st.just(len(name)), st.just(len(name)), st.integers(0, 3))
    values = {
        part: draw(lengths.flatmap(lambda size: st.lists(numbers, min_size=size, max_size=size)))
        for part in ("position", "velocity", "effort")
    }
    return {"name": name, "stamp_ns": draw(stamps), "frame": draw(frames), **values}


@given(parts=joint_states(), padding=st.integers(0, 15))
@example(parts={"name": [], "stamp_ns": 0, "frame": ""}, padding=0)
def test_a_joint_state_is_read_as_the_libraries_read_it(store, joint_state, foreign, parts, padding):
    raw = bytes(store.serialize_cdr(joint_state(**parts), NAME[JOINT_STATE]))
    ours = Decoder(BY_EFFORT).one(raw + bytes(padding), JOINT_STATE)[0]
    for message in (store.deserialize_cdr(raw, NAME[JOINT_STATE]), foreign(NAME[JOINT_STATE], raw)):
        fault, position, velocity, effort = expected_crank(message, CRANK_NAME)
        stamp = message.header.stamp
        assert ours["stamp_ns"] == stamp.sec * 10**9 + stamp.nanosec == parts["stamp_ns"]
        assert ours["kind"] == CRANK
        zero = parts["stamp_ns"] == 0 and fault == NO_FAULT
        assert FAULTS[ours["fault"]] == FAULTS[ZERO_STAMP if zero else fault]
        assert same(ours["crank_angle_rad"], position)
        assert same(ours["crank_velocity_radps"], velocity)
        assert same(ours["torque_nm"], effort)


@given(
    force=st.tuples(numbers, numbers, numbers),
    torque=st.tuples(numbers, numbers, numbers),
    stamp_ns=stamps.filter(bool),
    frame=frames,
    axis=st.sampled_from("xyz"),
)
def test_a_wrench_is_read_as_the_libraries_read_it(store, wrench, foreign, axis, **parts):
    raw = bytes(store.serialize_cdr(wrench(**parts), NAME[WRENCH_STAMPED]))
    ours = Decoder(MonitorConfig(drive_torque=DriveTorque(axis=axis))).one(raw, WRENCH_STAMPED)[0]
    for message in (store.deserialize_cdr(raw, NAME[WRENCH_STAMPED]), foreign(NAME[WRENCH_STAMPED], raw)):
        stamp, about = message.header.stamp, getattr(message.wrench.torque, axis)
        assert ours["stamp_ns"] == stamp.sec * 10**9 + stamp.nanosec
        assert ours["kind"] == TORQUE
        assert same(ours["torque_nm"], about)
        assert ours["fault"] == (NO_FAULT if math.isfinite(about) else NOT_FINITE)
        assert math.isnan(ours["crank_angle_rad"])


INTERFACE, WARMTH = "motor_current", "temperature"
BY_INTERFACE = MonitorConfig(
    crank_joint=CRANK_NAME,
    drive_torque=DriveTorque(source="interface", interface=INTERFACE),
    drive=DriveParameters(temperature_interface=WARMTH),
)
interface_values = st.one_of(
    st.lists(st.tuples(st.sampled_from([INTERFACE, WARMTH, "effort", "", "motor"]), numbers), max_size=4).map(
        lambda pairs: ([name for name, _ in pairs], [value for _, value in pairs])
    ),
    st.tuples(st.lists(st.just(INTERFACE), max_size=2), st.lists(numbers, max_size=2)),
)


def expected_interface(message):
    """What a DynamicJointState means, given once more in plain words: fault, torque, temperature."""
    names, values = list(message.joint_names), list(message.interface_values)
    if not names or not values:
        return EMPTY, math.nan, math.nan
    if len(names) != len(values):
        return WRONG_LENGTH, math.nan, math.nan
    if names.count(CRANK_NAME) != 1:
        return MISSING_JOINT, math.nan, math.nan
    there = values[names.index(CRANK_NAME)]
    if list(there.interface_names).count(INTERFACE) != 1:
        return MISSING_JOINT, math.nan, math.nan
    if len(there.interface_names) != len(there.values):
        return WRONG_LENGTH, math.nan, math.nan
    of = dict(zip(there.interface_names, there.values, strict=True))
    value, warmth = float(of[INTERFACE]), math.nan
    if list(there.interface_names).count(WARMTH) == 1:
        warmth = float(of[WARMTH])
    return (NO_FAULT if math.isfinite(value) else NOT_FINITE), value, warmth


@given(
    names=joints,
    groups=st.lists(interface_values, max_size=8),
    is_whole=st.booleans(),
    stamp_ns=stamps.filter(bool),
    frame=frames,
    cut=st.integers(1, 400),
)
@example([CRANK_NAME], [([INTERFACE], [2.5])], True, 9, "", 1)
@example([CRANK_NAME], [([WARMTH, INTERFACE], [41.0, 2.5])], True, 9, "", 1)
@example(["hip", CRANK_NAME], [([], []), ([INTERFACE], [math.nan])], True, 9, "base_link", 30)
def test_an_interface_is_read_as_the_libraries_read_it(
    foreign, names, groups, is_whole, stamp_ns, frame, cut
):
    store, kind = types(), NAME[INTERFACES]
    if is_whole:
        names, groups = names[: len(groups)], groups[: len(names)]
    values = [store.types["control_msgs/msg/InterfaceValue"](each, np.array(of)) for each, of in groups]
    time = store.types["builtin_interfaces/msg/Time"](stamp_ns // 10**9, stamp_ns % 10**9)
    message = store.types[kind](store.types["std_msgs/msg/Header"](time, frame), names, values)
    raw = bytes(store.serialize_cdr(message, kind))
    ours = Decoder(BY_INTERFACE).one(raw, INTERFACES)[0]
    for read in (store.deserialize_cdr(raw, kind), foreign(kind, raw)):
        fault, value, temperature = expected_interface(read)
        assert FAULTS[ours["fault"]] == FAULTS[fault]
        assert ours["stamp_ns"] == read.header.stamp.sec * 10**9 + read.header.stamp.nanosec == stamp_ns
        assert ours["kind"] == TORQUE
        assert same(ours["torque_nm"], value)
        assert same(ours["temperature_c"], temperature)
    short = Decoder(BY_INTERFACE).one(raw[: max(0, len(raw) - cut)], INTERFACES)[0]
    assert short["fault"] == UNDECODABLE
    assert math.isnan(short["torque_nm"])


@given(number=numbers)
def test_a_float64_is_read_and_stamped_with_its_log_time(store, number):
    message = store.types[NAME[FLOAT64]](number)
    raw = bytes(store.serialize_cdr(message, NAME[FLOAT64]))
    ours = Decoder(MonitorConfig(drive_torque=DriveTorque(source="float64"))).one(
        raw, FLOAT64, log_time_ns=17
    )[0]
    assert ours["stamp_ns"] == 17
    assert same(ours["torque_nm"], number)
    assert ours["fault"] == (NO_FAULT if math.isfinite(number) else NOT_FINITE)


@given(parts=joint_states(), data=st.data())
def test_a_message_cut_short_is_undecodable(store, joint_state, parts, data):
    raw = bytes(store.serialize_cdr(joint_state(**parts), NAME[JOINT_STATE]))
    cut = data.draw(st.integers(0, len(raw) - 1))
    sample = Decoder(MonitorConfig()).one(raw[:cut], JOINT_STATE)[0]
    assert sample["fault"] == UNDECODABLE
    assert math.isnan(sample["crank_angle_rad"])


@given(
    raw=st.binary(max_size=200), kind=st.sampled_from(list(NAME)), start=st.sampled_from([b"", b"\0\1\0\0"])
)
def test_any_bytes_give_one_sample_and_no_crash(raw, kind, start):
    sample = Decoder(MonitorConfig()).one(start + raw, kind)
    assert sample.shape == (1,)
    assert sample["fault"][0] in FAULTS


@pytest.mark.parametrize("kind", [0, 2, 3, 6, 7, 8, 9, 10, 11, 0x0101])
def test_other_encapsulations_are_not_guessed_at(store, joint_state, kind):
    raw = bytes(store.serialize_cdr(joint_state(["crank"], [1.0]), NAME[JOINT_STATE]))
    other = kind.to_bytes(2, "big") + raw[2:]
    assert Decoder(MonitorConfig()).one(other, JOINT_STATE)["fault"][0] == UNDECODABLE


def test_a_message_of_another_type_does_not_pass(store, joint_state, wrench):
    joints_raw = bytes(store.serialize_cdr(joint_state(["crank"], [1.0], stamp_ns=9), NAME[JOINT_STATE]))
    wrench_raw = bytes(store.serialize_cdr(wrench((1, 2, 3), (4, 5, 6), 9), NAME[WRENCH_STAMPED]))
    decoder = Decoder(MonitorConfig())
    assert decoder.one(wrench_raw, JOINT_STATE)["fault"][0] == UNDECODABLE
    assert decoder.one(joints_raw, WRENCH_STAMPED)["fault"][0] == UNDECODABLE
    assert decoder.one(joints_raw, FLOAT64)["fault"][0] == UNDECODABLE


def test_sign_scale_and_offset_are_applied(store, joint_state):
    config = MonitorConfig(
        crank=Crank(sign=-1, gear_ratio=2.0, offset_rad=0.25),
        drive_torque=DriveTorque(source="effort", sign=-1, scale=0.5, gear_ratio=40.0),
    )
    raw = bytes(store.serialize_cdr(joint_state(["crank"], [3.0], [4.0], [0.125]), NAME[JOINT_STATE]))
    sample = Decoder(config).one(raw, JOINT_STATE)[0]
    assert sample["crank_angle_rad"] == -1.25
    assert sample["crank_velocity_radps"] == -2.0
    assert sample["torque_nm"] == -2.5
    beyond = joint_state(["crank"], [3.0], [4.0], [1.0e307])  # 2e308 N m
    sample = Decoder(config).one(bytes(store.serialize_cdr(beyond, NAME[JOINT_STATE])), JOINT_STATE)[0]
    assert FAULTS[sample["fault"]] == FAULTS[NOT_FINITE]


@given(parts=st.lists(joint_states(), min_size=1, max_size=6), gap=st.integers(0, 9))
def test_many_at_once_are_as_one_by_one(store, joint_state, parts, gap):
    """Wherever messages lie among other bytes, aligned or not."""
    raws = [bytes(store.serialize_cdr(joint_state(**each), NAME[JOINT_STATE])) for each in parts]
    data, messages = b"", np.zeros(len(raws), MESSAGE)
    for i, raw in enumerate(raws):
        data += b"\xff" * gap
        messages[i] = (len(data), len(data) + len(raw), 5, JOINT_STATE)
        data += raw
    decoder = Decoder(MonitorConfig())
    together = decoder.many(np.frombuffer(data, np.uint8), messages)
    alone = np.concatenate([decoder.one(raw, JOINT_STATE, 5) for raw in raws])
    assert together.tobytes() == alone.tobytes()


ENCODERS_TOO = MonitorConfig(
    crank_joint=CRANK_NAME, encoders=Encoders(names=("hip", "a"), joints=("B", "G"), signs=(1.0, -1.0))
)


@given(parts=joint_states())
def test_further_encoders_are_read_with_the_crank(store, joint_state, parts):
    """Absent or no angle, it is no fault of the sample; a faulty sample has none."""
    message = joint_state(**parts)
    raw = bytes(store.serialize_cdr(message, NAME[JOINT_STATE]))
    sample = Decoder(ENCODERS_TOO).one(raw, JOINT_STATE)[0]
    plain = Decoder(BY_EFFORT).one(raw, JOINT_STATE)[0]
    assert sample["fault"] == plain["fault"]
    names, angles = list(message.name), sample["encoder_rad"]
    assert np.isnan(angles[2:]).all()
    for angle, name, sign in zip(angles[:2], ("hip", "a"), (1.0, -1.0), strict=True):
        if expected_crank(message, CRANK_NAME)[0] != NO_FAULT or names.count(name) != 1:
            assert math.isnan(angle)
            continue
        position = float(message.position[names.index(name)])
        assert angle == sign * position if math.isfinite(position) else math.isinf(angle)


@given(force=st.tuples(numbers, numbers, numbers), stamp_ns=stamps.filter(bool))
@example(force=(0.0, -1.0e305, 0.0), stamp_ns=1)
def test_the_force_of_a_wrench_is_read_with_sign_and_scale(store, wrench, force, stamp_ns):
    message = wrench(force=force, torque=(1.0, 2.0, 3.0), stamp_ns=stamp_ns, frame="foot")
    raw = bytes(store.serialize_cdr(message, NAME[LOAD_WRENCH]))
    config = MonitorConfig(foot_load=FootLoad(source="wrench", sign=-1, scale=1000.0))
    ours = Decoder(config).one(raw, LOAD_WRENCH)[0]
    assert ours["kind"] == LOAD and ours["stamp_ns"] == stamp_ns
    scaled = [-1000.0 * each for each in force[:2]]  # not finite from 1.8e305 on
    assert FAULTS[ours["fault"]] == FAULTS[NO_FAULT if np.isfinite(scaled).all() else NOT_FINITE]
    assert all(map(same, ours["foot_force_n"], scaled))
    assert np.isnan([ours["torque_nm"], ours["crank_angle_rad"]]).all()
    assert Decoder(config).one(raw[:-1], LOAD_WRENCH)[0]["fault"] == UNDECODABLE


def test_a_vertical_force_and_a_contact_are_read(store):
    types = store.types
    config = MonitorConfig(foot_load=FootLoad(source="float64", scale=0.5))
    force = types[NAME[LOAD_FLOAT64]](data=600.0)
    raw = bytes(store.serialize_cdr(force, NAME[LOAD_FLOAT64]))
    ours = Decoder(config).one(raw, LOAD_FLOAT64, 7)[0]
    assert (ours["stamp_ns"], ours["kind"], *ours["foot_force_n"]) == (7, LOAD, 0.0, 300.0)
    config = MonitorConfig(foot_load=FootLoad(source="contact", scale=0.5))
    for stands in (True, False):
        raw = bytes(store.serialize_cdr(types[NAME[CONTACT]](data=stands), NAME[CONTACT]))
        ours = Decoder(config).one(raw + bytes(3), CONTACT, 7)[0]
        assert (ours["stamp_ns"], ours["fault"], *ours["foot_force_n"]) == (7, NO_FAULT, 0.0, float(stands))


def test_markers_are_messages_of_the_library(store):
    markers = [
        encode.Marker(
            namespace="joints",
            id=3,
            type=encode.SPHERE,
            scale=(0.1, 0.2, 0.3),
            colour=(0.0, 0.5, 1.0),
            position=np.array([1.0, 2.0, 3.0]),
        ),
        encode.Marker(
            namespace="bodies",
            type=encode.LINE_LIST,
            scale=(0.1, 0.0, 0.0),
            colour=(1.0, 1.0, 1.0),
            points=np.arange(6.0).reshape(2, 3),
            text="A: OK",
        ),
    ]
    raw = encode.marker_array(1_700_000_000_000_000_005, markers, "pelvis")
    found = store.deserialize_cdr(raw, encode.MARKER_ARRAY)
    sphere, lines = found.markers
    assert (sphere.ns, sphere.id, sphere.type, sphere.pose.position.z) == ("joints", 3, encode.SPHERE, 3.0)
    assert (sphere.scale.y, sphere.color.b, sphere.color.a, sphere.lifetime.sec) == (0.2, 1.0, 1.0, 2)
    assert [(one.x, one.y, one.z) for one in lines.points] == [(0.0, 1.0, 2.0), (3.0, 4.0, 5.0)]
    assert (lines.header.frame_id, lines.header.stamp.nanosec, lines.text) == ("pelvis", 5, "A: OK")
    assert bytes(store.serialize_cdr(found, encode.MARKER_ARRAY)) == raw


# What we write, the libraries read: message by message, indexed, with sound checksums.


mcap_reader = pytest.importorskip("mcap.reader")
EndOfFile = pytest.importorskip("mcap.exceptions").EndOfFile
Message = pytest.importorskip("mcap.records").Message
StreamReader = pytest.importorskip("mcap.stream_reader").StreamReader

doubles = st.floats(width=64, allow_nan=False)
any_stamps = st.integers(0, 2**31 * 10**9 - 1)


@given(
    stamp_ns=st.lists(any_stamps, min_size=1, max_size=3),
    names=st.lists(st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"])), max_size=3),
    given_parts=st.sets(st.sampled_from(["position", "velocity", "effort"])),
    data=st.data(),
)
def test_joint_states_are_as_rosbags_writes_them(store, joint_state, stamp_ns, names, given_parts, data):
    shape = (len(stamp_ns), len(names))
    values = st.lists(doubles, min_size=shape[0] * shape[1], max_size=shape[0] * shape[1])
    parts = {part: np.reshape(data.draw(values), shape) for part in sorted(given_parts)}
    rows = encode.joint_states(stamp_ns, names, frame_id="pelvis", **parts)
    for i, stamp in enumerate(stamp_ns):
        theirs = {part: values[i] for part, values in parts.items()}
        message = joint_state(names, stamp_ns=stamp, frame="pelvis", **theirs)
        assert rows[i].tobytes() == bytes(store.serialize_cdr(message, encode.JOINT_STATE))


@given(
    stamp_ns=any_stamps,
    torque=st.tuples(doubles, doubles, doubles),
    frame=st.sampled_from(["", "a", "pelvis"]),
)
def test_wrenches_are_as_rosbags_writes_them(store, wrench, stamp_ns, torque, frame):
    rows = encode.wrenches([stamp_ns], torque=[torque], frame_id=frame)
    expected = store.serialize_cdr(wrench((0, 0, 0), torque, stamp_ns, frame), encode.WRENCH_STAMPED)
    assert rows[0].tobytes() == bytes(expected)


texts = st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]), max_size=9)
statuses = st.tuples(texts, st.integers(0, 3), texts, texts, st.dictionaries(texts, texts, max_size=3))


@given(stamp_ns=any_stamps, reported=st.lists(statuses, max_size=3), frame=texts)
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

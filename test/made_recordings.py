"""Fixtures: messages and bags made by the libraries that ours is held against."""

import attrs
import numpy as np
import pytest

from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.recordings import encode
from leg_wear_monitor.recordings.cdr import Decoder
from leg_wear_monitor.recordings.findings import Severity
from leg_wear_monitor.recordings.reader import Recording
from leg_wear_monitor.recordings.streams import JOINT_STATE, STREAMS, WRENCH_STAMPED, definition
from leg_wear_monitor.twin import LOAD
from leg_wear_monitor.twin.sample import GAIT_SAMPLE


@pytest.fixture(scope="session")
def store():
    """Types of ROS 2 Jazzy, as rosbags knows them."""
    rosbags_types = pytest.importorskip("rosbags.typesys")
    return rosbags_types.get_typestore(rosbags_types.Stores.ROS2_JAZZY)


@pytest.fixture(scope="session")
def joint_state(store):
    """Make a sensor_msgs/JointState of rosbags."""
    types = store.types

    def make(name, position=(), velocity=(), effort=(), stamp_ns=1, frame=""):
        stamp = types["builtin_interfaces/msg/Time"](*divmod(stamp_ns, 10**9))
        head = types["std_msgs/msg/Header"](stamp=stamp, frame_id=frame)
        values = [np.asarray(numbers, float) for numbers in (position, velocity, effort)]
        return types["sensor_msgs/msg/JointState"](head, name, *values)

    return make


@pytest.fixture(scope="session")
def wrench(store):
    """Make a geometry_msgs/WrenchStamped of rosbags."""
    types = store.types

    def make(force, torque, stamp_ns=1, frame=""):
        stamp = types["builtin_interfaces/msg/Time"](*divmod(stamp_ns, 10**9))
        vector = types["geometry_msgs/msg/Vector3"]
        body = types["geometry_msgs/msg/Wrench"](vector(*force), vector(*torque))
        return types["geometry_msgs/msg/WrenchStamped"](types["std_msgs/msg/Header"](stamp, frame), body)

    return make


@pytest.fixture(scope="session")
def foreign():
    """Read a message with mcap-ros2-support."""
    decoder = pytest.importorskip("mcap_ros2.decoder").DecoderFactory()
    schema = pytest.importorskip("mcap.records").Schema

    def read(name, raw):
        text = definition(name)
        return decoder.decoder_for("cdr", schema(CODES[name], text.encode(), "ros2msg", name))(raw)

    return read


CODES = {stream.type: stream.code for stream in STREAMS if stream.kind != LOAD}

START_NS = 1_700_000_000 * 10**9


@attrs.frozen
class Sent:
    """One message that a bag was made of."""

    topic: str
    type: str
    log_time_ns: int
    raw: bytes


@pytest.fixture(scope="session")
def traffic():
    """Messages of a leg: joint_states and drive_torque, and topics that are not ours, in order of time."""

    def make(seconds=2.0, rate_hz=200, seed=0, start_ns=START_NS):
        rng = np.random.default_rng(seed)
        n = round(seconds * rate_hz)
        stamps = start_ns + np.arange(n, dtype=np.int64) * (10**9 // rate_hz)
        names = ["hip", "crank", "knee"]
        position, effort = rng.normal(size=(n, 3)), rng.normal(size=(n, 3))
        joints = encode.joint_states(stamps, names, position=position, velocity=position, effort=effort)
        torque = encode.wrenches(stamps + 400_000, torque=rng.normal(size=(n, 3)), frame_id="pelvis")
        late = rng.integers(0, 10**6, (2, n)).tolist()
        sent = []
        for i, stamp in enumerate(stamps.tolist()):
            sent.append(Sent("/joint_states", encode.JOINT_STATE, stamp + late[0][i], bytes(joints[i])))
            sent.append(Sent("/drive_torque", encode.WRENCH_STAMPED, stamp + late[1][i], bytes(torque[i])))
            if i % 10 == 0:
                sent.append(Sent("/joint_states/_service_event", "a/srv/B_Event", stamp, b"\0\1\0\0none"))
        return sorted(sent, key=lambda each: each.log_time_ns)

    return make


@pytest.fixture(scope="session")
def write_bag():
    """Write messages with the mcap library's own writer."""
    writer_module = pytest.importorskip("mcap.writer")

    def write(path, sent, compression="ZSTD", definitions=True, **options):
        with path.open("wb") as file:
            kind = writer_module.CompressionType[compression]
            writer = writer_module.Writer(file, **{"chunk_size": 20_000, "compression": kind, **options})
            writer.start("ros2", "test")
            channels = {}
            for each in sent:
                if each.topic not in channels:
                    known = definitions and each.type in CODES
                    text = definition(each.type).encode() if known else b""
                    schema = writer.register_schema(each.type, "ros2msg", text)
                    channels[each.topic] = writer.register_channel(each.topic, "cdr", schema)
                writer.add_message(channels[each.topic], each.log_time_ns, each.raw, each.log_time_ns - 5)
            writer.finish()
        return path

    return write


@pytest.fixture(scope="session")
def write_rosbag(store):
    """Write messages of known types as a bag directory with rosbags' own writer."""
    rosbag2 = pytest.importorskip("rosbags.rosbag2")

    def write(directory, sent, storage, mode="NONE"):
        writer = rosbag2.Writer(directory, version=9, storage_plugin=rosbag2.StoragePlugin[storage])
        if mode != "NONE":
            writer.set_compression(rosbag2.CompressionMode[mode], rosbag2.CompressionFormat.ZSTD)
        with writer:
            ours = [each for each in sent if each.type in store.types]
            connections = {
                topic: writer.add_connection(topic, kind, typestore=store)
                for topic, kind in sorted({(each.topic, each.type) for each in ours})
            }
            for each in ours:
                writer.write(connections[each.topic], each.log_time_ns, each.raw)
        return directory

    return write


@pytest.fixture(scope="session")
def write_database(write_rosbag):
    """The file of such a bag in SQLite."""
    return lambda directory, sent: next(write_rosbag(directory, sent, "SQLITE3").glob("*.db3"))


@pytest.fixture(scope="session")
def expected():
    """Samples that messages should give, one by one, in order of log time."""

    def make(sent, config=None):
        decoder = Decoder(config or MonitorConfig())
        roles = {"/joint_states": JOINT_STATE, "/drive_torque": WRENCH_STAMPED}
        ours = sorted((each for each in sent if each.topic in roles), key=lambda each: each.log_time_ns)
        return np.concatenate([decoder.one(each.raw, roles[each.topic], each.log_time_ns) for each in ours])

    return make


def losses(recording):
    """What is said of lost parts of a recording."""
    return [finding.text for finding in recording.findings if finding.weight is Severity.LOSS]


@pytest.fixture(scope="session")
def read():
    """Read a recording to its end: all samples, and the recording with its findings."""

    def all_of(*paths, config=None, **options):
        with Recording(paths, config or MonitorConfig(), **options) as recording:
            blocks = [block.samples for block in recording.blocks()]
        return np.concatenate([np.zeros(0, GAIT_SAMPLE), *blocks]), recording

    return all_of

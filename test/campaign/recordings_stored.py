"""Two seconds of a leg's messages, stored in each way that is read; and what came out of them undamaged."""

import tempfile
from functools import cache
from pathlib import Path

import numpy as np
import zstandard
from mcap.writer import CompressionType, IndexType, Writer
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Rosbag2Writer

from leg_wear_monitor.bags.reader import Recording
from leg_wear_monitor.messages import encode
from leg_wear_monitor.messages.streams import definition, types
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.twin.sample import GAIT_SAMPLE, Samples

TOPICS = {"/joint_states": encode.JOINT_STATE, "/drive_torque": encode.WRENCH_STAMPED}
START_NS = 1_700_000_000 * 10**9
_SECONDS, _RATE_HZ = 2, 200

Sent = list[tuple[str, int, bytes]]
Files = dict[str, bytes]


@cache
def traffic(crank: str = "crank", seed: int = 1, phase_rad: float = 0.0) -> Sent:
    """Topic, time and bytes of each message."""
    n, rng = _SECONDS * _RATE_HZ, np.random.default_rng(seed)
    stamps = START_NS + np.arange(n, dtype=np.int64) * (10**9 // _RATE_HZ)
    values = rng.normal(size=(n, 3))
    values[:, 1] = 2.0 * np.pi * np.arange(n) / _RATE_HZ + rng.normal(0.0, 1.0e-4, n) + phase_rad
    joints = encode.joint_states(stamps, ["hip", crank, "knee"], position=values, velocity=values)
    wrench = encode.wrenches(stamps, torque=values, frame_id="pelvis")
    sent = []
    for i, stamp in enumerate(stamps.tolist()):
        sent += [("/joint_states", stamp, bytes(joints[i])), ("/drive_torque", stamp + 1, bytes(wrench[i]))]
    return sent


def write_mcap(path: Path, sent: Sent, **options: object) -> Path:
    """Write with the mcap library."""
    with path.open("wb") as file:
        writer = Writer(file, **{"chunk_size": 20_000, **options})
        writer.start("ros2")
        channels: dict[str, int] = {}
        for topic, time, raw in sent:
            if topic not in channels:
                name = TOPICS.get("/" + topic.rsplit("/", 1)[-1], encode.JOINT_STATE)
                schema = writer.register_schema(name, "ros2msg", definition(name).text.encode())
                channels[topic] = writer.register_channel(topic, "cdr", schema)
            writer.add_message(channels[topic], time, raw, time)
        writer.finish()
    return path


def write_bag(path: Path, sent: Sent, storage: StoragePlugin, by_message: bool = False) -> Path:
    """Write a bag directory with rosbags."""
    writer = Rosbag2Writer(path, version=9, storage_plugin=storage)
    if by_message:
        writer.set_compression(CompressionMode.MESSAGE, CompressionFormat.ZSTD)
    with writer:
        connections = {
            topic: writer.add_connection(topic, name, typestore=types()) for topic, name in TOPICS.items()
        }
        for topic, time, raw in sent:
            writer.write(connections[topic], time, raw)
    return path


@cache
def stored() -> dict[str, tuple[str, Files]]:
    """What is to be named to be read, and the files, by the way of storing."""
    sent, ways = traffic(), {}
    with tempfile.TemporaryDirectory() as place:
        home = Path(place)
        for kind in CompressionType:
            path = write_mcap(home / "x.mcap", sent, compression=kind)
            ways[f"mcap, {kind.name.lower()}"] = _single("x.mcap", path)
        path = write_mcap(home / "x.mcap", sent, use_chunking=False, enable_data_crcs=True)
        ways["mcap, no chunks"] = _single("x.mcap", path)
        path = write_mcap(home / "x.mcap", sent, index_types=IndexType.NONE)
        ways["mcap, no index"] = _single("x.mcap", path)
        content = zstandard.compress(ways["mcap, none"][1]["x.mcap"])
        ways["mcap.zstd"] = "x.mcap.zstd", {"x.mcap.zstd": content}
        for storage in StoragePlugin:
            name = storage.name.lower()
            ways[f"bag, {name}"] = _directory(write_bag(home / name, sent, storage))
            ways[f"bag, {name}, by message"] = _directory(write_bag(home / f"{name}_m", sent, storage, True))
    database = next(content for name, content in ways["bag, sqlite3"][1].items() if name.endswith(".db3"))
    ways["db3"] = "x.db3", {"x.db3": database}
    ways["db3.zstd"] = "x.db3.zstd", {"x.db3.zstd": zstandard.compress(database)}
    return ways


def _single(name: str, path: Path) -> tuple[str, Files]:
    return name, {name: path.read_bytes()}


def _directory(path: Path) -> tuple[str, Files]:
    return "bag", {f"bag/{file.name}": file.read_bytes() for file in path.iterdir()}


def lay_out(directory: Path, files: Files) -> None:
    """Put files into a directory."""
    for name, content in files.items():
        (directory / name).parent.mkdir(exist_ok=True)
        (directory / name).write_bytes(content)


def read(*paths: Path) -> tuple[Samples, Recording]:
    """All samples, and the recording with its findings."""
    with Recording(paths, MonitorConfig()) as recording:
        blocks = [block.samples for block in recording.blocks()]
    return np.concatenate([np.zeros(0, GAIT_SAMPLE), *blocks]), recording


@cache
def expected() -> Samples:
    """Samples of the undamaged messages."""
    with tempfile.TemporaryDirectory() as place:
        samples, _ = read(write_mcap(Path(place) / "x.mcap", traffic()))
    return samples

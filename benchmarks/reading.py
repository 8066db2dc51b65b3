"""Reading bags: our reader beside rosbags and mcap-ros2-support, the same messages, the same values."""

import argparse
import statistics
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from watch import Watch

from leg_wear_monitor.bags.reader import Recording
from leg_wear_monitor.messages import encode
from leg_wear_monitor.messages.streams import definition
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.twin import CRANK

NAMES = ["hip", "knee", "ankle", "crank", "toe", "pelvis", "spare"]
TOPICS = {"/joint_states": encode.JOINT_STATE, "/drive_torque": encode.WRENCH_STAMPED}
RATE_HZ = 1000


def write_bag(path: Path, seconds: float, compression: CompressionType) -> int:
    """A bag of seven joints and a wrench at 1 kHz each, chunked as rosbag2 does; gives its messages."""
    n, rng = round(seconds * RATE_HZ), np.random.default_rng(1)
    stamps = 1_700_000_000 * 10**9 + np.arange(n, dtype=np.int64) * (10**9 // RATE_HZ)
    position = np.cumsum(rng.normal(1e-3, 1e-4, (n, len(NAMES))), axis=0)
    joints = encode.joint_states(stamps, NAMES, position=position, velocity=position, effort=position)
    torque = encode.wrenches(stamps, torque=rng.normal(size=(n, 3)), frame_id="pelvis")
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=768 * 1024, compression=compression)
        writer.start("ros2")
        channels = [
            writer.register_channel(
                topic, "cdr", writer.register_schema(name, "ros2msg", definition(name).text.encode())
            )
            for topic, name in TOPICS.items()
        ]
        for i, stamp in enumerate(stamps.tolist()):
            for channel, rows in zip(channels, (joints, torque), strict=True):
                writer.add_message(channel, stamp, rows[i].tobytes(), stamp)
        writer.finish()
    return 2 * n


def ours(path: Path) -> tuple[float, float]:
    """Sum of the crank's angles and of the torques."""
    angle = torque = 0.0
    with Recording([path], MonitorConfig()) as recording:
        for block in recording.blocks():
            is_crank = block.samples["kind"] == CRANK
            angle += float(block.samples["crank_angle_rad"][is_crank].sum())
            torque += float(block.samples["torque_nm"][~is_crank].sum())
    return angle, torque


def rosbags_decoded(path: Path) -> tuple[float, float]:
    """The same with rosbags."""
    angle = torque = 0.0
    with AnyReader([path]) as reader:
        for connection, _, raw in reader.messages():
            message: Any = reader.deserialize(raw, connection.msgtype)
            if connection.topic == "/joint_states":
                angle += float(message.position[message.name.index("crank")])
            else:
                torque += message.wrench.torque.z
    return angle, torque


def rosbags_raw(path: Path) -> int:
    """Messages that rosbags hands out, undecoded."""
    with AnyReader([path]) as reader:
        return sum(1 for _ in reader.messages())


def mcap_decoded(path: Path) -> tuple[float, float]:
    """The same with mcap and mcap-ros2-support."""
    angle = torque = 0.0
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for _, channel, _, message in reader.iter_decoded_messages():
            if channel.topic == "/joint_states":
                angle += message.position[message.name.index("crank")]
            else:
                torque += message.wrench.torque.z
    return angle, torque


def mcap_raw(path: Path) -> int:
    """Messages that mcap hands out, undecoded."""
    with path.open("rb") as file:
        return sum(1 for _ in make_reader(file).iter_messages())


READERS: dict[str, Callable[[Path], object]] = {
    "ours, decoded": ours,
    "rosbags, decoded": rosbags_decoded,
    "mcap-ros2-support, decoded": mcap_decoded,
    "rosbags, raw": rosbags_raw,
    "mcap, raw": mcap_raw,
}


def rates(path: Path, messages: int, repeats: int) -> dict[str, float]:
    """Median messages a second of each reader; all must come to the same sums."""
    ours(path)  # compiled before it is timed
    spent: dict[str, list[float]] = {name: [] for name in READERS}
    for _ in range(repeats):
        results = {}
        for name, reader in READERS.items():
            watch = Watch()
            results[name] = reader(path)
            spent[name].append(watch.processor)
        decoded = [result for name, result in results.items() if "decoded" in name]
        np.testing.assert_allclose(decoded, [decoded[0]] * len(decoded), rtol=1e-9)
    return {name: messages / statistics.median(seconds) for name, seconds in spent.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=30.0, help="length of the bag")
    parser.add_argument("--repeats", type=int, default=3)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as directory:
        for compression in (CompressionType.ZSTD, CompressionType.LZ4, CompressionType.NONE):
            path = Path(directory) / f"{compression.name}.mcap"
            messages = write_bag(path, arguments.seconds, compression)
            found = rates(path, messages, arguments.repeats)
            print(f"{compression.name.lower()}: {messages} messages, {path.stat().st_size / 1e6:.1f} MB")
            fastest = max(rate for name, rate in found.items() if "decoded" in name and "ours" not in name)
            for name, rate in found.items():
                print(f"  {name:28} {rate / 1e3:9,.0f} k/s  {rate / fastest:7.2f} of the fastest library's")
            print(f"  {2e6 * RATE_HZ / found['ours, decoded'] / 1e3:.2f} ms for a second of 1 kHz + 1 kHz")


if __name__ == "__main__":
    main()

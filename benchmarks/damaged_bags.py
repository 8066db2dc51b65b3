"""Bags of several kinds, truncated at 50 random bytes and with 200 random bits flipped: what comes out."""

import argparse
import signal
import tempfile
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from types import FrameType

import numpy as np
import zstandard
from mcap.writer import CompressionType, Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Rosbag2Writer

from leg_wear_monitor.bags.reader import Recording
from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.messages import encode
from leg_wear_monitor.messages.streams import definition, types
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.twin.sample import NO_FAULT, Samples

SECONDS, RATE_HZ, LIMIT_S = 10, 200, 30
TOPICS = {"/joint_states": encode.JOINT_STATE, "/drive_torque": encode.WRENCH_STAMPED}

Sent = list[tuple[str, int, bytes]]


def traffic() -> Sent:
    """Topic, time and bytes of each message."""
    n, rng = SECONDS * RATE_HZ, np.random.default_rng(1)
    stamps = 1_700_000_000 * 10**9 + np.arange(n, dtype=np.int64) * (10**9 // RATE_HZ)
    values = rng.normal(size=(n, 3))
    joints = encode.joint_states(stamps, ["hip", "crank", "knee"], position=values, velocity=values)
    wrench = encode.wrenches(stamps, torque=values, frame_id="pelvis")
    sent = []
    for i, stamp in enumerate(stamps.tolist()):
        sent += [("/joint_states", stamp, bytes(joints[i])), ("/drive_torque", stamp + 1, bytes(wrench[i]))]
    return sent


def mcap_writer(path: Path, sent: Sent, **options: object) -> Path:
    """Write with the mcap library."""
    with path.open("wb") as file:
        writer = Writer(file, **{"chunk_size": 50_000, **options})
        writer.start("ros2")
        channels = {}
        for topic, name in TOPICS.items():
            schema = writer.register_schema(name, "ros2msg", definition(name).text.encode())
            channels[topic] = writer.register_channel(topic, "cdr", schema)
        for topic, time, raw in sent:
            writer.add_message(channels[topic], time, raw, time)
        writer.finish()
    return path


def rosbag2_writer(path: Path, sent: Sent, storage: StoragePlugin) -> Path:
    """Write with rosbags: an MCAP without checksums, or a database."""
    with Rosbag2Writer(path, version=9, storage_plugin=storage) as writer:
        connections = {
            topic: writer.add_connection(topic, name, typestore=types()) for topic, name in TOPICS.items()
        }
        for topic, time, raw in sent:
            writer.write(connections[topic], time, raw)
    return next(file for file in path.iterdir() if file.suffix in (".mcap", ".db3"))


def stored(directory: Path, sent: Sent) -> dict[str, Path]:
    """The same messages, stored in each way."""
    bags = {}
    for kind in CompressionType:
        name = kind.name.lower()
        bags[f"mcap, {name}"] = mcap_writer(directory / f"{name}.mcap", sent, compression=kind)
    bags["mcap, unchunked, checksum of all"] = mcap_writer(
        directory / "unchunked.mcap", sent, use_chunking=False, enable_data_crcs=True
    )
    bags["mcap, no checksums"] = rosbag2_writer(directory / "bare", sent, StoragePlugin.MCAP)
    whole = directory / "whole.mcap.zstd"
    whole.write_bytes(zstandard.compress(bags["mcap, none"].read_bytes()))
    bags["mcap.zstd"] = whole
    bags["db3"] = rosbag2_writer(directory / "database", sent, StoragePlugin.SQLITE3)
    return bags


def read(path: Path) -> tuple[Samples, Recording]:
    with Recording([path], MonitorConfig()) as recording:
        blocks = [block.samples for block in recording.blocks()]
    return np.concatenate([np.zeros(0, blocks[0].dtype if blocks else np.void), *blocks]), recording


def evaluated(path: Path, true: Samples, known: set[bytes]) -> str:
    """What came of a damaged file."""
    try:
        samples, recording = read(path)
    except LegWearError as error:
        return "refused in one line" if "\n" not in str(error) else "REFUSED IN SEVERAL LINES"
    sound = samples[samples["fault"] == NO_FAULT] if len(samples) else samples
    wrong = sum(bytes(sample) not in known for sample in sound)
    if recording.is_partial:
        return f"told, {'nothing wrong in it' if not wrong else 'some values wrong'}"
    if samples.tobytes() == true.tobytes():
        return "no effect"
    unchecked = any("checksum" in finding.text for finding in recording.findings)
    return "wrong, and said that it could not be checked" if unchecked else "WRONG AND NOT TOLD"


def truncated(content: bytes, rng: np.random.Generator) -> bytes:
    return content[: int(rng.integers(len(content)))]


def flipped(content: bytes, rng: np.random.Generator) -> bytes:
    damaged = bytearray(content)
    damaged[int(rng.integers(len(content)))] ^= 1 << int(rng.integers(8))
    return bytes(damaged)


def too_long(_signal: int, _frame: FrameType | None) -> None:
    raise TimeoutError(f"not read within {LIMIT_S} s")


def statistics(
    path: Path, damage: Callable[[bytes, np.random.Generator], bytes], number: int
) -> Counter[str]:
    """What came of so many damaged copies of a file."""
    true, _ = read(path)
    known = {bytes(sample) for sample in true}
    rng, outcomes = np.random.default_rng(7), Counter[str]()
    content, copy = path.read_bytes(), path.parent / f"damaged_{path.name}"
    for _ in range(number):
        copy.write_bytes(damage(content, rng))
        signal.alarm(LIMIT_S)
        outcomes[evaluated(copy, true, known)] += 1
        signal.alarm(0)
    copy.unlink()
    return outcomes


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--truncations", type=int, default=50)
    parser.add_argument("--flips", type=int, default=200)
    arguments = parser.parse_args()
    signal.signal(signal.SIGALRM, too_long)
    with tempfile.TemporaryDirectory() as directory:
        for name, path in stored(Path(directory), traffic()).items():
            print(f"{name} ({path.stat().st_size / 1e3:.0f} kB)")
            for what, damage, number in (
                ("truncated", truncated, arguments.truncations),
                ("flipped", flipped, arguments.flips),
            ):
                outcomes = statistics(path, damage, number)
                print(f"  {what:10}", "; ".join(f"{count} {text}" for text, count in outcomes.most_common()))


if __name__ == "__main__":
    main()

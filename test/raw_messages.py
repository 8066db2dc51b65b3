"""Messages of a leg as bytes: made, written into a recording, and read by mcap's own library."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from mcap.reader import make_reader

from leg_wear_monitor.recordings import encode
from leg_wear_monitor.recordings.mcap_file import McapWriter
from leg_wear_monitor.recordings.streams import JOINT_STATE, WRENCH_STAMPED

Message = tuple[int, int, bytes]
"""Code of the stream, log time [ns], bytes."""

TOPICS = {
    JOINT_STATE: ("/joint_states", encode.JOINT_STATE),
    WRENCH_STAMPED: ("/drive_torque", encode.WRENCH_STAMPED),
}


def crank_and_torque(
    stamps: Any,
    position: Any,
    torque: Any,
    names: tuple[str, ...] = ("crank",),
    arrival_ns: tuple[int, int] = (100_000, 100_001),
) -> list[Message]:
    """A message of joints and one of the torque about z for each stamp, logged so much later.

    All joints but the last stand still.
    """
    still = np.zeros(len(stamps))
    positions = np.stack([*(still for _ in names[1:]), position], axis=1)
    joints = encode.joint_states(stamps, list(names), position=positions)
    wrenches = encode.wrenches(stamps, torque=np.stack([still, still, torque], axis=1), frame_id="pelvis")
    found = []
    for stamp, joint, wrench in zip(stamps.tolist(), joints, wrenches, strict=True):
        found.append((JOINT_STATE, stamp + arrival_ns[0], bytes(joint)))
        found.append((WRENCH_STAMPED, stamp + arrival_ns[1], bytes(wrench)))
    return found


def write_messages(path: Path, messages: Iterable[Message], namespace: str = "", **options: Any) -> Path:
    """Write a recording."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with McapWriter(path, **options) as writer:
        channels = {code: writer.channel(namespace + topic, kind) for code, (topic, kind) in TOPICS.items()}
        for code, log_time_ns, raw in messages:
            writer.write(channels[code], log_time_ns, raw)
    return path


def messages_of(path: Path) -> dict[str, list[bytes]]:
    """Messages of a recording by topic in the order of the file, all checksums looked at."""
    messages: dict[str, list[bytes]] = {}
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        for _, channel, message in reader.iter_messages(log_time_order=False):
            messages.setdefault(channel.topic, []).append(message.data)
    return messages

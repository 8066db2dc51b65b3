"""Messages as bytes: made as the library encodes them, and read from a recording by mcap's own library."""

from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from mcap.reader import make_reader

from leg_wear_monitor.recordings.streams import types

DYNAMIC_JOINT_STATE = "control_msgs/msg/DynamicJointState"


def dynamic_joint_state(stamp_ns: int, interfaces: Mapping[str, Mapping[str, float]]) -> bytes:
    """A message with these values by joint and interface, as the library encodes it."""
    store = types()
    kinds = store.types
    stamp = kinds["builtin_interfaces/msg/Time"](*divmod(stamp_ns, 10**9))
    values = [
        kinds["control_msgs/msg/InterfaceValue"](list(one), np.array([*one.values()], float))
        for one in interfaces.values()
    ]
    header = kinds["std_msgs/msg/Header"](stamp, "")
    message = kinds[DYNAMIC_JOINT_STATE](header, list(interfaces), values)
    return bytes(store.serialize_cdr(message, DYNAMIC_JOINT_STATE))


def messages_of(path: Path) -> dict[str, list[bytes]]:
    """Messages by topic in the order of the file, all checksums looked at."""
    found: dict[str, list[bytes]] = defaultdict(list)
    with path.open("rb") as file:
        for _, channel, message in make_reader(file, validate_crcs=True).iter_messages(log_time_order=False):
            found[channel.topic].append(message.data)
    return found

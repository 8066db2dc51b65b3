"""An output topic of the monitor, and messages for it."""

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.messages.qos import RELIABLE, Qos


@attrs.frozen
class Output:
    """An output topic of the monitor: name relative to the node, type and offered quality of service."""

    name: str
    type: str
    qos: Qos = RELIABLE


@attrs.frozen(eq=False)
class Outgoing:
    """Messages for one topic.

    Attributes
    ----------
    output : Output
    stamp_ns : (n,) array of int
    messages : (n, bytes) array of uint8
        One message per row.
    """

    output: Output
    stamp_ns: NDArray[np.int64]
    messages: NDArray[np.uint8]


def single(output: Output, stamp_ns: int, raw: bytes) -> Outgoing:
    """One message for a topic."""
    return Outgoing(output, np.array([stamp_ns], np.int64), np.frombuffer(raw, np.uint8)[None, :])


def topic_of(output: Output, node: str) -> str:
    """Full name of a topic, for a node such as ``/robot/leg_wear_monitor``."""
    return node + output.name[1:] if output.name.startswith("~") else output.name

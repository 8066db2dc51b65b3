"""Message definitions and type hashes, which a recording needs so that other tools can read it."""

from functools import cache

import attrs
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.store import Typestore


@attrs.frozen
class Definition:
    """A message type.

    Attributes
    ----------
    name : str
        Such as ``sensor_msgs/msg/JointState``.
    text : str
        Definition in ros2msg format, including those of all nested types.
    digest : str
        Type hash of REP-2011, ``RIHS01_...``.
    """

    name: str
    text: str
    digest: str


@cache
def types() -> Typestore:
    """Types of ROS 2 Jazzy."""
    return get_typestore(Stores.ROS2_JAZZY)


@cache
def definition(name: str) -> Definition:
    """Definition of a message type of ROS 2's common interfaces."""
    text, _ = types().generate_msgdef(name, ros_version=2)
    return Definition(name, text, types().hash_rihs01(name))

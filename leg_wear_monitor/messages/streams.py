"""Table of input streams, from which subscriptions, recording topics, decoding and checks are derived.

`cdr` parses the messages of a stream; `twin.kinds` defines the use of its samples.
"""

import attrs

from leg_wear_monitor.twin.kinds import CRANK, TORQUE

JOINT_STATE, WRENCH_STAMPED, FLOAT64 = 1, 2, 3


@attrs.frozen(kw_only=True)
class Stream:
    """Messages of one type on one topic.

    Attributes
    ----------
    code : int
        Identifies messages of the stream in `cdr.MESSAGE`.
    topic : str
        Relative topic name.
    type : str
        Message type, such as ``sensor_msgs/msg/JointState``.
    fields : tuple of str
        Fields of the type's main definition; names of nested types without their package.
    kind : int
        Kind of its samples, a key of `twin.kinds.KINDS`.
    torque_source : str
        Value of `drive_torque.source` for which the stream is read; empty if it is always read.
    has_stamp : bool
        Whether the type has a header; without one, the time of arrival stamps its samples.
    is_needed : bool
        Whether the stream is required.
    """

    code: int
    topic: str
    type: str
    fields: tuple[str, ...]
    kind: int
    torque_source: str = ""
    has_stamp: bool = True
    is_needed: bool = False


STREAMS = (
    Stream(
        code=JOINT_STATE,
        topic="joint_states",
        type="sensor_msgs/msg/JointState",
        fields=(
            "Header header",
            "string[] name",
            "float64[] position",
            "float64[] velocity",
            "float64[] effort",
        ),
        kind=CRANK,  # also carries the angles of further encoders, and the torque if its source is the effort
        is_needed=True,
    ),
    Stream(
        code=WRENCH_STAMPED,
        topic="drive_torque",
        type="geometry_msgs/msg/WrenchStamped",
        fields=("Header header", "Wrench wrench"),
        kind=TORQUE,
        torque_source="wrench",
    ),
    Stream(
        code=FLOAT64,
        topic="drive_torque",
        type="std_msgs/msg/Float64",
        fields=("float64 data",),
        kind=TORQUE,
        torque_source="float64",
        has_stamp=False,
    ),
)


def streams_read(torque_source: str) -> tuple[Stream, ...]:
    """Streams that are read with a value of `drive_torque.source`."""
    return tuple(stream for stream in STREAMS if stream.torque_source in ("", torque_source))

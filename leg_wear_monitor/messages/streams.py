"""Table of input streams, from which subscriptions, recording topics, decoding and checks are derived.

`cdr` parses the messages of a stream; `twin.kinds` defines the use of its samples.
"""

import attrs

from leg_wear_monitor.twin.kinds import CRANK, LOAD, TORQUE

JOINT_STATE, WRENCH_STAMPED, FLOAT64, LOAD_WRENCH, LOAD_FLOAT64, CONTACT = range(1, 7)


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
    torque_source, load_source : str
        Value of `drive_torque.source`, or of `foot_load.source`, for which the stream is read; both are empty
        if it is always read.
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
    load_source: str = ""
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
    Stream(
        code=LOAD_WRENCH,
        topic="foot_load",
        type="geometry_msgs/msg/WrenchStamped",
        fields=("Header header", "Wrench wrench"),
        kind=LOAD,
        load_source="wrench",
    ),
    Stream(
        code=LOAD_FLOAT64,
        topic="foot_load",
        type="std_msgs/msg/Float64",
        fields=("float64 data",),
        kind=LOAD,
        load_source="float64",
        has_stamp=False,
    ),
    Stream(
        code=CONTACT,
        topic="foot_load",
        type="std_msgs/msg/Bool",
        fields=("bool data",),
        kind=LOAD,
        load_source="contact",
        has_stamp=False,
    ),
)


def streams_read(torque_source: str, load_source: str = "none") -> tuple[Stream, ...]:
    """Streams that are read with values of `drive_torque.source` and `foot_load.source`."""
    sources = (("", ""), (torque_source, ""), ("", load_source))
    return tuple(stream for stream in STREAMS if (stream.torque_source, stream.load_source) in sources)

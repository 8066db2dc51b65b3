"""Table of input streams, the source of subscriptions, recording topics, decoding and checks.

`cdr` parses the messages of a stream; `twin` defines the use of its samples.
"""

from collections.abc import Iterator, Mapping
from functools import cache
from typing import TYPE_CHECKING

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.monitor.forecast.forecast import Answer
from leg_wear_monitor.monitor.reports import CycleReport, Reports
from leg_wear_monitor.twin import CRANK, LOAD, TORQUE

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

    from leg_wear_monitor.monitor.config.settings import MonitorConfig

JOINT_STATE, WRENCH_STAMPED, FLOAT64, LOAD_WRENCH, LOAD_FLOAT64, CONTACT, INTERFACES = range(1, 8)


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
    kind : int
        Kind of its samples, a key of `twin.KINDS`.
    source : str
        Value of the parameter of its kind, in `streams_of`, for which the stream is read; empty if it is
        always read.
    has_stamp : bool
        True if the type has a header; without one, the time of arrival stamps its samples.
    is_needed : bool
        True if the stream is required.
    """

    code: int
    topic: str
    type: str
    kind: int
    source: str = ""
    has_stamp: bool = True
    is_needed: bool = False


STREAMS = (
    # contains the angles of further encoders as well, and the torque if its source is the effort
    Stream(code=JOINT_STATE, topic="joint_states", type="sensor_msgs/msg/JointState", kind=CRANK,
           is_needed=True),
    Stream(code=WRENCH_STAMPED, topic="drive_torque", type="geometry_msgs/msg/WrenchStamped", kind=TORQUE,
           source="wrench"),
    Stream(code=FLOAT64, topic="drive_torque", type="std_msgs/msg/Float64", kind=TORQUE,
           source="float64", has_stamp=False),
    Stream(code=INTERFACES, topic="dynamic_joint_states", type="control_msgs/msg/DynamicJointState",
           kind=TORQUE, source="interface"),
    Stream(code=LOAD_WRENCH, topic="foot_load", type="geometry_msgs/msg/WrenchStamped", kind=LOAD,
           source="wrench"),
    Stream(code=LOAD_FLOAT64, topic="foot_load", type="std_msgs/msg/Float64", kind=LOAD,
           source="float64", has_stamp=False),
    Stream(code=CONTACT, topic="foot_load", type="std_msgs/msg/Bool", kind=LOAD,
           source="contact", has_stamp=False),
)  # fmt: skip


def streams_read(sources: Mapping[int, str]) -> tuple[Stream, ...]:
    """Streams that are read with the source of each kind of samples."""
    return tuple(stream for stream in STREAMS if stream.source in ("", sources.get(stream.kind)))


def streams_of(config: "MonitorConfig") -> tuple[Stream, ...]:
    """Streams that are read with the parameters of a monitor."""
    return streams_read({TORQUE: config.drive_torque.source, LOAD: config.foot_load.source})


# Quality of service of topics, in the format of rosbag2 (metadata version 9).


_PROFILE = """- history: keep_last
  depth: {depth}
  reliability: {reliability}
  durability: {durability}
  deadline: {forever}
  lifespan: {forever}
  liveliness: automatic
  liveliness_lease_duration: {forever}
  avoid_ros_namespace_conventions: false"""
_FOREVER = "{sec: 9223372036, nsec: 854775807}"


@attrs.frozen
class Qos:
    """Quality of service offered by a publisher."""

    reliability: str = "reliable"
    durability: str = "volatile"
    depth: int = 10

    def text(self) -> str:
        """YAML text for a channel's metadata."""
        return _PROFILE.format(forever=_FOREVER, **attrs.asdict(self))


RELIABLE = Qos()
SENSOR_DATA = Qos(reliability="best_effort", depth=200)
LATCHED = Qos(durability="transient_local", depth=1)


# An output topic of the monitor, and messages for it.


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


# Message definitions, which a recording needs so that other tools can read it.


# This type belongs to ros2_control and is not among ROS 2's common interfaces.
_FURTHER = {
    "control_msgs/msg/InterfaceValue": "string[] interface_names\nfloat64[] values",
    "control_msgs/msg/DynamicJointState": (
        "std_msgs/Header header\nstring[] joint_names\nInterfaceValue[] interface_values"
    ),
}


@cache
def types() -> "Typestore":
    """Types of ROS 2 Jazzy, and the types of ros2_control that the monitor reads."""
    # only recordings need them; rosbags is not available as a ROS package
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    for name, text in _FURTHER.items():
        store.register(get_types_from_msg(text, name))
    return store


def definition(name: str) -> str:
    """Definition of a message type of ROS 2's common interfaces or of ros2_control, with all nested types."""
    return types().generate_msgdef(name, ros_version=2)[0]


# Times of forecast messages: a minute after the last message, after an alarm change, on a new answer.


_MINUTE_NS = 60 * 10**9


class ForecastTimes:
    """Selects gait cycles by their stamps only, independent of how reports are grouped."""

    def __init__(self) -> None:
        self._published_ns: int | None = None
        self._changes_ns: list[int] = []
        self._answers: list[Answer] = []

    def due(self, reports: Reports) -> Iterator[CycleReport]:
        """Gait cycles after which a forecast is due."""
        self._changes_ns += [change.stamp_ns for change in reports.alarms]
        for cycle in reports.cycles:
            changes = [stamp for stamp in self._changes_ns if stamp <= cycle.stamp_ns]
            forecasts = [joint.forecast for joint in cycle.joints] + [cycle.forecast]
            answers = [each.answer for each in forecasts if each is not None]
            if changes or answers != self._answers or self._is_minute(cycle.stamp_ns):
                self._answers = answers
                self._changes_ns = [stamp for stamp in self._changes_ns if stamp > cycle.stamp_ns]
                self._published_ns = cycle.stamp_ns
                yield cycle

    def _is_minute(self, stamp_ns: int) -> bool:
        """True if the last forecast is a minute old, is missing, or has a different time base."""
        return self._published_ns is None or not 0 <= stamp_ns - self._published_ns < _MINUTE_NS

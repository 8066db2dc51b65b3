"""Inputs of the node: subscriptions, the queue of messages, checks of joint names."""

import itertools
import threading
from collections.abc import Iterable, Mapping, Sequence
from importlib import import_module
from operator import attrgetter
from typing import Any, NamedTuple

import attrs
import numpy as np
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import QoSCompatibility, QoSProfile, ReliabilityPolicy, qos_check_compatible
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.subscription import Subscription
from rclpy.topic_endpoint_info import TopicEndpointInfo

from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.recordings.cdr import MESSAGE, Decoder
from leg_wear_monitor.recordings.findings import listed
from leg_wear_monitor.recordings.message_checks import is_without, names_in, twice, without_interface
from leg_wear_monitor.recordings.streams import INTERFACES, JOINT_STATE, Stream, streams_of
from leg_wear_monitor.twin import LOAD
from leg_wear_monitor.twin.sample import MISSING_JOINT, NO_FAULT, Samples

# Bounded queue of received messages that wait for the monitor; adding a message is cheap.


# A message of seven joints has about 300 bytes, one of a hundred thousand joints 2.5 MB; messages taken
# together are copied for decoding.
HELD_BYTES = 64 * 2**20
TAKEN_BYTES = 8 * 2**20


class Arrival(NamedTuple):
    """A received message: stream code, time of arrival [ns], serialized bytes."""

    code: int
    log_time_ns: int
    raw: bytes


class Inbox:
    """Messages in order of arrival.

    Parameters
    ----------
    decoder : Decoder
    limit : int
        Maximum number of messages. On overflow the older half is shed, so that the rest has no gaps.
    limit_bytes : int
        Maximum number of bytes, likewise; a larger single message is itself shed.

    Attributes
    ----------
    received, shed : int
        Numbers of messages since the start.
    lock : threading.RLock
        Held while messages are added or removed; a caller that adds several in order holds it.
    """

    def __init__(self, decoder: Decoder, limit: int, limit_bytes: int = HELD_BYTES) -> None:
        self.lock = threading.RLock()
        self._decoder, self._limit, self._limit_bytes = decoder, limit, limit_bytes
        self._waiting: list[Arrival] = []
        self._bytes = 0
        self._last_ns = 0
        self.received, self.shed = 0, 0

    def __len__(self) -> int:
        return len(self._waiting)

    def add(self, code: int, raw: bytes, now_ns: int) -> None:
        """Add a message of a stream that arrived at a time [ns] of the wall clock.

        Log times strictly increase. A recording that is read in the order of log time thus keeps the order
        of arrival.
        """
        with self.lock:
            self._last_ns = max(now_ns, self._last_ns + 1)
            self.received += 1
            if len(raw) > self._limit_bytes:
                self.shed += 1
                return
            while len(self._waiting) >= self._limit or self._bytes + len(raw) > self._limit_bytes:
                self._drop((len(self._waiting) + 1) // 2)
            self._waiting.append(Arrival(code, self._last_ns, raw))
            self._bytes += len(raw)

    def _drop(self, number: int) -> None:
        self._bytes -= sum(len(one.raw) for one in self._waiting[:number])
        del self._waiting[:number]
        self.shed += number

    def delay_s(self, now_ns: int) -> float:
        """Waiting time of the oldest message [s]."""
        with self.lock:
            return max(0, now_ns - self._waiting[0].log_time_ns) * 1.0e-9 if self._waiting else 0.0

    def take(self, most: int, most_bytes: int = TAKEN_BYTES) -> list[Arrival]:
        """Remove and return the oldest messages within both limits; the first one may exceed `most_bytes`."""
        with self.lock:
            ends = itertools.accumulate(len(one.raw) for one in self._waiting[:most])
            number = max(1, sum(1 for end in ends if end <= most_bytes))
            taken, self._waiting = self._waiting[:number], self._waiting[number:]
            self._bytes -= sum(len(one.raw) for one in taken)
            return taken

    def decoded(self, arrivals: list[Arrival]) -> Samples:
        """Decode messages to samples in the same order."""
        messages = np.zeros(len(arrivals), MESSAGE)
        messages["type"] = [arrival.code for arrival in arrivals]
        messages["log_time_ns"] = messages["publish_time_ns"] = [one.log_time_ns for one in arrivals]
        messages["end"] = np.cumsum([len(arrival.raw) for arrival in arrivals])
        messages["begin"][1:] = messages["end"][:-1]
        data = np.frombuffer(b"".join(arrival.raw for arrival in arrivals), np.uint8)
        return self._decoder.many(data, messages)


# Check that messages contain the crank joint; otherwise report the joints they contain.


_MOST_BYTES = 100_000
_MOST_PUBLISHERS, _UNNAMED_OF_A_BLOCK = 8, 20


class CrankNames:
    """Searches messages for the name of the crank joint.

    Several nodes may publish joints of one robot on one topic, so messages without the crank are a fault
    only if no message has it.

    Parameters
    ----------
    crank_joint : str
    """

    def __init__(self, crank_joint: str) -> None:
        self._crank = crank_joint
        self._named = 0
        self._others: dict[tuple[str, ...], int] = {}
        self._unnamed: set[tuple[str, ...]] = set()
        self._report = ""

    def note(self, arrivals: Sequence[Arrival], samples: Samples, now_ns: int) -> None:
        """Record messages and the samples decoded from them, at a time [ns] of the monotonic clock."""
        joint_states = np.array([one.code == JOINT_STATE for one in arrivals], bool)
        unnamed = np.flatnonzero(joint_states & (samples["fault"] == MISSING_JOINT))
        for i in unnamed.tolist()[-_UNNAMED_OF_A_BLOCK:]:
            names = _names(arrivals[i].raw)
            if names in self._others or len(self._others) < _MOST_PUBLISHERS:
                self._others[names] = now_ns
                self._unnamed.add(names)
        self._named += int(np.count_nonzero(joint_states & (samples["fault"] == NO_FAULT)))

    def others(self, since_ns: int) -> int:
        """Number of different lists of joints without the crank that came since a time."""
        return sum(at_ns >= since_ns for at_ns in self._others.values())

    def report(self) -> str:
        """Report that no message since the last call named the crank, and which joints they named.

        Empty if a message named the crank; without any message, the report of the last call.
        """
        named, unnamed = self._named, self._unnamed
        self._named, self._unnamed = 0, set()
        if named:
            self._report = ""
        elif unnamed:
            names = sorted({name for joints in unnamed for name in joints})
            again = next(filter(None, (twice(joints, self._crank) for joints in unnamed)), "")
            there = listed(names) if names else "too many to list"
            text = f"no joint is named {self._crank!r}; the joints are {there}; set crank_joint"
            self._report = again or text
        return self._report


def _names(raw: bytes) -> tuple[str, ...]:
    """Joint names of a message; empty if there are too many."""
    return tuple(names_in(raw)) if len(raw) <= _MOST_BYTES else ()


class InterfaceNames:
    """Searches messages for the wanted interfaces of the crank.

    Parameters
    ----------
    crank_joint : str
    interfaces : mapping of str to str
        Interfaces returned by `wanted_interfaces`.
    """

    def __init__(self, crank_joint: str, interfaces: Mapping[str, str]) -> None:
        self._crank, self._interfaces = crank_joint, interfaces
        self._without = b""

    def note(self, arrivals: Sequence[Arrival], samples: Samples) -> None:
        """Record messages and the samples decoded from them."""
        of_interfaces = np.array([one.code == INTERFACES for one in arrivals], bool)
        without = np.flatnonzero(of_interfaces & is_without(samples, self._interfaces))
        if of_interfaces.any():
            self._without = arrivals[without[-1]].raw if len(without) else b""

    def report(self) -> str:
        """Report interfaces that the last messages lack, and those that exist; empty if none is missing."""
        if not self._without:
            return ""
        if len(self._without) > _MOST_BYTES:
            return "too many joints to list"
        return without_interface(self._without, self._crank, self._interfaces)


# Message classes by the names of their types.


def message_class(name: str) -> Any:
    """Class of a message type such as ``sensor_msgs/msg/JointState``.

    Raises
    ------
    ConfigError
        If its package is not installed. Only the ros2_control interface package may be missing.
    """
    package, _, message = name.split("/")
    try:
        found = import_module(f"{package}.msg")
    except ModuleNotFoundError as error:
        fault = f"'interface' needs {package}, which is not installed. Install ros-jazzy-control-msgs"
        raise ConfigError("drive_torque.source", "", fault) from error
    return getattr(found, message)


# Publishers of an input: node names, publishers of a different type, several publishers of one crank.


_STAMPED = "wrench, effort or interface"
_UNKNOWN = ("", "_NODE_NAME_UNKNOWN_", "_CREATED_BY_BARE_DDS_APP_")


@attrs.frozen
class Publishers:
    """Publishers of a topic according to the ROS graph.

    Attributes
    ----------
    fitting : tuple of str
        Full names of the nodes whose messages arrive.
    refused : tuple of (str, str)
        Full names of the other nodes, and why none of their messages arrives.
    """

    fitting: tuple[str, ...] = ()
    refused: tuple[tuple[str, str], ...] = ()


def publishers_of(node: Node, topic: str, expected: str, qos: QoSProfile) -> Publishers:
    """Publishers of a topic in the graph. Events do not report publishers that disappear; the graph does.

    Parameters
    ----------
    node : rclpy.node.Node
    topic : str
        Full name of the topic.
    expected : str
        Expected type, such as ``sensor_msgs/msg/JointState``.
    qos : QoSProfile
        Quality of service of the subscription.
    """
    there = node.get_publishers_info_by_topic(topic)
    found = [(_full_name(one), _refusal(one, expected, qos)) for one in there]
    return Publishers(
        tuple(sorted(name for name, why in found if not why)),
        tuple(sorted((name, why) for name, why in found if why)),
    )


def _refusal(publisher: TopicEndpointInfo, expected: str, qos: QoSProfile) -> str:
    """Why no message of a publisher arrives; empty if they do."""
    if publisher.topic_type != expected:
        return f"publishes {publisher.topic_type}. Expected {expected}"
    compatibility, why = qos_check_compatible(publisher.qos_profile, qos)
    if compatibility != QoSCompatibility.ERROR:
        return ""
    reason = why.removeprefix("ERROR:").strip(" ;")
    return f"has a lower quality of service than this node requests ({reason}); see qos_overrides"


def _full_name(info: object) -> str:
    name, space = getattr(info, "node_name", ""), getattr(info, "node_namespace", "")
    return "a publisher without a node" if name in _UNKNOWN else f"{space.rstrip('/')}/{name}"


def refusals(publishers: Publishers) -> str:
    """Fault text for publishers without any arriving message; empty if there are none."""
    listed = _listed(f"{name} {why}" for name, why in publishers.refused)
    who = "it" if len(publishers.refused) == 1 else "them"
    return f"{listed}; no message arrives from {who}" if listed else ""


def several(publishers: Publishers) -> str:
    """Fault text for several publishers; empty if there is at most one."""
    number = len(publishers.fitting)
    return f"{number} publishers: {_listed(publishers.fitting)}" if number > 1 else ""


def _listed(names: Iterable[str]) -> str:
    return ", ".join(dict.fromkeys(names))


# Inputs that simulation time cannot stamp.


def check_stamps(config: MonitorConfig, source: str) -> None:
    """Refuse inputs without stamps, for a node with ``use_sim_time``.

    Wall time of arrival does not match the time of the other inputs, and ``/clock`` comes 10 to 100 times a
    second. A torque stamped by it would be late by more than 5 ms, and a healthy leg would look like a
    different leg.

    Raises
    ------
    ConfigError
        Naming the parameter, and sources that have stamps.
    """
    for stream in streams_of(config):
        if not stream.has_stamp:
            key, stamped = ("foot_load", "wrench") if stream.kind == LOAD else ("drive_torque", _STAMPED)
            fault = (
                f"the messages of {stream.source} have no stamp, which use_sim_time needs. Expected {stamped}"
            )
            raise ConfigError(source, f"{key}.source", fault)


# Subscriptions of the monitor: serialized messages, and the middleware's events about them.


# Depth of a subscription's queue. Fast DDS holds 5000 messages by default, five seconds at 1 kHz, and reports
# further messages as lost; with a smaller depth it would drop them silently.
DEPTH = 10_000


def _best_effort() -> QoSProfile:
    """Profile of a subscription before its overrides, which rclpy writes into the profile itself."""
    return QoSProfile(depth=DEPTH, reliability=ReliabilityPolicy.BEST_EFFORT)


@attrs.define
class InputTopic:
    """A subscription and its faults.

    Attributes
    ----------
    name : str
        Full name of the topic.
    stream : Stream
        Expected stream.
    heard_ns, heard_wall_ns : int
        Arrival time of the last message on a monotonic clock and on the wall clock [ns]; 0 before the first.
    lost, lost_reported : int
        Messages lost in transport according to the middleware, and how many of them have already been
        reported.
    publishers : Publishers
        Publishers at the last query of the graph.
    sources : int
        Number of publishers that certainly send the expected data; 1 while this is unknown.
    without_crank : str
        Report on messages without the crank, or without its interface; empty if there are none.
    other_axis : str
        Report on a torque about a different axis than the axis that is read; empty if there is none.
    shared : int
        Number of different lists of joints without the crank; stands for the number of their publishers.
    qos : QoSProfile
        Quality of service of the subscription.
    """

    name: str
    stream: Stream
    heard_ns: int = 0
    heard_wall_ns: int = 0
    lost: int = 0
    lost_reported: int = 0
    publishers: Publishers = Publishers()
    sources: int = 1
    without_crank: str = ""
    other_axis: str = ""
    shared: int = 0
    qos: QoSProfile = attrs.field(factory=_best_effort)


class Inputs:
    """Subscriptions to the configured inputs, whose messages are taken all at once.

    Calls of an executor per message would take longer than the processing of the messages. They are best
    effort, which is compatible with reliable publishers.

    Parameters
    ----------
    node : rclpy.node.Node
    config : MonitorConfig

    Attributes
    ----------
    topics : tuple of InputTopic
    subscriptions : tuple of Subscription
        Subscriptions of the topics. No executor may serve them: messages are taken from rclpy's own handles.
    """

    def __init__(self, node: Node, config: MonitorConfig) -> None:
        streams = streams_of(config)
        self.topics = tuple(InputTopic(node.resolve_topic_name(each.topic), each) for each in streams)
        self.subscriptions = tuple(_subscribe(node, topic) for topic in self.topics)

    def taken(self, now_ns: int) -> list[Arrival]:
        """Messages that have come since the last call, in the order of their arrival.

        The caller holds the inbox's lock until it has added them, because a thread may take messages as well.

        Parameters
        ----------
        now_ns : int
            Time of arrival where the middleware does not give it [ns].
        """
        found = []
        for topic, subscription in zip(self.topics, self.subscriptions, strict=True):
            code, message_type, handle = topic.stream.code, subscription.msg_type, subscription.handle
            with handle:
                while (message := handle.take_message(message_type, True)) is not None:  # serialized
                    raw, info = message
                    found.append(Arrival(code, info["received_timestamp"] or now_ns, raw))
        return sorted(found, key=attrgetter("log_time_ns"))


def _subscribe(node: Node, topic: InputTopic) -> Subscription:
    def lost(event: Any) -> None:
        topic.lost += event.total_count_change

    def must_not_be_called(_raw: Any) -> None:
        raise RuntimeError(f"an executor takes messages of {topic.name}")

    return node.create_subscription(
        message_class(topic.stream.type),
        topic.stream.topic,
        must_not_be_called,
        topic.qos,  # with the overrides of parameters from here on
        raw=True,
        event_callbacks=SubscriptionEventCallbacks(message_lost=lost),
        qos_overriding_options=QoSOverridingOptions.with_default_policies(),
    )

"""Inputs of the node: subscriptions, the queue of messages, checks of joint names."""

import threading
from importlib import import_module
from operator import attrgetter
from typing import Any, NamedTuple

import attrs
import numpy as np
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.subscription import Subscription

from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.recordings.cdr import MESSAGE, Decoder
from leg_wear_monitor.recordings.streams import Stream, streams_of
from leg_wear_monitor.twin import LOAD
from leg_wear_monitor.twin.sample import Samples

# Bounded queue of received messages that wait for the monitor; adding a message is cheap.


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

    Attributes
    ----------
    received, shed : int
        Numbers of messages since the start.
    lock : threading.RLock
        Held while messages are added or removed; a caller that adds several in order holds it.
    """

    def __init__(self, decoder: Decoder, limit: int) -> None:
        self.lock = threading.RLock()
        self._decoder, self._limit = decoder, limit
        self._waiting: list[Arrival] = []
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
            if len(self._waiting) >= self._limit:
                older = (self._limit + 1) // 2
                del self._waiting[:older]
                self.shed += older
            self._waiting.append(Arrival(code, self._last_ns, raw))

    def delay_s(self, now_ns: int) -> float:
        """Waiting time of the oldest message [s]."""
        with self.lock:
            return max(0, now_ns - self._waiting[0].log_time_ns) * 1.0e-9 if self._waiting else 0.0

    def take(self, most: int) -> list[Arrival]:
        """Remove and return the oldest messages, at most so many."""
        with self.lock:
            taken, self._waiting = self._waiting[:most], self._waiting[most:]
            return taken

    def decoded(self, arrivals: list[Arrival]) -> Samples:
        """Decode messages to samples in the same order."""
        messages = np.zeros(len(arrivals), MESSAGE)
        messages["type"] = [arrival.code for arrival in arrivals]
        messages["log_time_ns"] = [one.log_time_ns for one in arrivals]
        messages["end"] = np.cumsum([len(arrival.raw) for arrival in arrivals])
        messages["begin"][1:] = messages["end"][:-1]
        data = np.frombuffer(b"".join(arrival.raw for arrival in arrivals), np.uint8)
        return self._decoder.many(data, messages)


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


# Inputs that simulation time cannot stamp.


_STAMPED = "wrench, effort or interface"


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
    publishers : int
        Number of publishers at the last query of the graph.
    content_fault : str
        Why the content of the messages is not that which is read; empty if it is.
    """

    name: str
    stream: Stream
    heard_ns: int = 0
    heard_wall_ns: int = 0
    lost: int = 0
    lost_reported: int = 0
    publishers: int = 0
    content_fault: str = ""


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
        QoSProfile(depth=DEPTH, reliability=ReliabilityPolicy.BEST_EFFORT),
        raw=True,
        event_callbacks=SubscriptionEventCallbacks(message_lost=lost),
        qos_overriding_options=QoSOverridingOptions.with_default_policies(),
    )

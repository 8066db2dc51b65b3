"""Subscriptions of the monitor: serialized messages, and the middleware's events about them."""

from collections.abc import Callable
from typing import Any

import attrs
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy, qos_policy_name_from_kind
from rclpy.qos_overriding_options import QoSOverridingOptions
from rclpy.subscription import Subscription

from leg_wear_monitor.messages.streams import Stream, streams_read
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.ros.inputs.message_class import message_class
from leg_wear_monitor.ros.inputs.publishers import Publishers

DEPTH = 2000  # messages: two seconds at 1 kHz, more than the longest evaluation between two of them takes


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
    incompatible : str
        Incompatibility of a publisher's quality of service or type; empty if there is none.
    publishers : Publishers
        Publishers at the last query of the graph.
    sources : int
        Number of publishers that certainly send the expected data; 1 while this is unknown.
    without_crank : str
        Report on messages without the crank; empty if there are none.
    other_axis : str
        Report on a torque about another axis than the one that is read; empty if there is none.
    shared : int
        Number of publishers that are known to publish other joints than the crank.
    """

    name: str
    stream: Stream
    heard_ns: int = 0
    heard_wall_ns: int = 0
    lost: int = 0
    lost_reported: int = 0
    incompatible: str = ""
    publishers: Publishers = Publishers()
    sources: int = 1
    without_crank: str = ""
    other_axis: str = ""
    shared: int = 0


def subscribe(
    node: Node, config: MonitorConfig, take: Callable[[InputTopic, bytes], None]
) -> list[tuple[InputTopic, Subscription]]:
    """Subscribe to the configured inputs; best effort, which is compatible with reliable publishers."""
    return [
        _subscribe(node, stream, take)
        for stream in streams_read(config.drive_torque.source, config.foot_load.source)
    ]


def _subscribe(
    node: Node, stream: Stream, take: Callable[[InputTopic, bytes], None]
) -> tuple[InputTopic, Subscription]:
    topic = InputTopic(node.resolve_topic_name(stream.topic), stream)

    def lost(event: Any) -> None:
        topic.lost += event.total_count_change

    def misfit(what: str) -> None:
        topic.incompatible = what
        node.get_logger().warning(
            f"{topic.name}: a publisher is incompatible: {what}; no message arrives from it"
        )

    def quality(event: Any) -> None:
        policy = qos_policy_name_from_kind(event.last_policy_kind)
        misfit(f"its {policy.lower()} is lower than this node requests; see qos_overrides")

    callbacks = SubscriptionEventCallbacks(
        incompatible_qos=quality,
        incompatible_type=lambda _: misfit(f"its type is not {stream.type}"),
        message_lost=lost,
    )

    def come(raw: Any) -> None:  # bytes, because of `raw`; rclpy's type hints omit this
        take(topic, raw)

    subscription = node.create_subscription(
        message_class(stream.type),
        stream.topic,
        come,
        QoSProfile(depth=DEPTH, reliability=ReliabilityPolicy.BEST_EFFORT),
        raw=True,
        event_callbacks=callbacks,
        qos_overriding_options=QoSOverridingOptions.with_default_policies(),
    )
    return topic, subscription

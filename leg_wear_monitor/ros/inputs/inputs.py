"""The monitor's subscriptions: bytes as they come, and what the middleware says of them."""

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

DEPTH = 200


@attrs.define
class InputTopic:
    """A subscription, and what went wrong with it.

    Attributes
    ----------
    name : str
        Full name of the topic.
    stream : Stream
        What is expected on it.
    heard_ns, heard_wall_ns : int
        When its last message came, by a clock that only goes forward and by the one that people read;
        0 before the first.
    lost, lost_told : int
        Messages that were sent and did not come through, as the middleware says; and how many of them had
        been reported before.
    incompatible : str
        What of a publisher's quality of service or type does not fit; empty if nothing.
    publishers : Publishers
        As the graph last had them.
    sources : int
        How many of them certainly send what this topic is for; 1 while that is not known.
    without_crank : str
        What is known of messages in which the crank is missing; empty if it is in all of them.
    """

    name: str
    stream: Stream
    heard_ns: int = 0
    heard_wall_ns: int = 0
    lost: int = 0
    lost_told: int = 0
    incompatible: str = ""
    publishers: Publishers = Publishers()
    sources: int = 1
    without_crank: str = ""


def subscribe(
    node: Node, config: MonitorConfig, take: Callable[[InputTopic, bytes], None]
) -> list[tuple[InputTopic, Subscription]]:
    """Subscribe to what the configuration asks for; best effort hears reliable publishers, too."""
    return [_subscribe(node, stream, take) for stream in streams_read(config.drive_torque.source)]


def _subscribe(
    node: Node, stream: Stream, take: Callable[[InputTopic, bytes], None]
) -> tuple[InputTopic, Subscription]:
    topic = InputTopic(node.resolve_topic_name(stream.topic), stream)

    def lost(event: Any) -> None:
        topic.lost += event.total_count_change

    def misfit(what: str) -> None:
        topic.incompatible = what
        node.get_logger().warning(f"{topic.name}: a publisher does not fit: {what}; nothing comes from it")

    def quality(event: Any) -> None:
        policy = qos_policy_name_from_kind(event.last_policy_kind)
        misfit(f"its {policy.lower()} is less than this node asks for, see qos_overrides")

    callbacks = SubscriptionEventCallbacks(
        incompatible_qos=quality,
        incompatible_type=lambda _: misfit(f"its type is not {stream.type}"),
        message_lost=lost,
    )

    def come(raw: Any) -> None:  # bytes, for `raw` says so; rclpy's types do not know
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

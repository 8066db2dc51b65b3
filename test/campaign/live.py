"""A monitor's node in this process, and publishers that flood it over real DDS."""

import os
import time
from collections.abc import Callable, Iterable
from pathlib import Path

os.environ["FASTRTPS_DEFAULT_PROFILES_FILE"] = str(Path(__file__).parents[1] / "ros" / "fast_discovery.xml")
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"

import numpy as np
import rclpy
from rclpy.context import Context
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState

from leg_wear_monitor import WearMonitor, load_mechanism
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.reports import Status
from leg_wear_monitor.ros import monitor_node

START_NS = 1_700_000_000_000_000_000
TURN = 2.0 * np.pi
_PATIENCE_S = 20.0
_warm: list[WearMonitor] = []


def warm() -> None:
    """Build a monitor once: every child takes its own copy of it by the fork."""
    if not _warm:
        _warm.append(WearMonitor(load_mechanism(), MonitorConfig()))
        _warm[0].warm_up()


def crank(t_s: float, **changes: object) -> JointState:
    """A crank message of a steady gait at a time."""
    angle = TURN * t_s % TURN
    message = JointState(name=["hip", "crank"], position=[0.0, angle], velocity=[0.0, TURN])
    stamp_ns = START_NS + round(1e9 * t_s)
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp_ns, 10**9)
    for name, value in changes.items():
        setattr(message, name, value)
    return message


def walk(begin_s: float, end_s: float, rate_hz: float = 200.0) -> Iterable[bytes]:
    """A steady gait as bytes."""
    for i in range(round(begin_s * rate_hz), round(end_s * rate_hz)):
        yield serialize_message(crank(i / rate_hz))


class Stage:
    """A monitor's node and a node that publishes to it, both served by this thread."""

    def __init__(self) -> None:
        monitor_node.open_monitor = lambda *_: _warm[0]  # type: ignore[assignment]
        self._domain = domain = 1 + os.getpid() % 100
        self._context = Context()
        rclpy.init(args=["--ros-args", "--log-level", "fatal"], context=self._context, domain_id=domain)
        overrides = [Parameter("diagnostics.period_s", value=0.1)]
        self.monitor = monitor_node.MonitorNode(context=self._context, parameter_overrides=overrides)
        self._nodes: list[Node] = []
        self.messages: dict[str, set[str]] = {}
        self._keep_what_is_said()
        self._executor = EventsExecutor(context=self._context)
        self._executor.add_node(self.monitor)

    def publisher(
        self, kind: type, topic: str, name: str = "flood", *, matches: bool = True, depth: int = 200
    ) -> Callable[[object], None]:
        """Publish with a node of its own, once it is matched; one participant has one type a topic."""
        context = Context()
        rclpy.init(args=[], context=context, domain_id=self._domain)
        node = Node(name, context=context)
        self._nodes.append(node)
        qos = QoSProfile(depth=depth, reliability=ReliabilityPolicy.BEST_EFFORT)
        publisher = node.create_publisher(kind, topic, qos)
        if matches:  # both know the other: what is sent before is lost
            self.serve(lambda: publisher.get_subscription_count() > 0, "the monitor's subscription")
            self.serve(lambda: self.monitor.count_publishers(publisher.topic_name) > 0, "the publisher")
        return publisher.publish  # type: ignore[no-any-return]

    def serve(self, until: Callable[[], bool], what: str) -> None:
        """Serve the monitor until something is there."""
        given_up = time.monotonic() + _PATIENCE_S
        while not until():
            if time.monotonic() > given_up:
                raise TimeoutError(f"waited in vain for {what}; {self.reported()}")
            self._executor.spin_once(timeout_sec=0.01)

    def send(self, publish: Callable[[object], None], messages: Iterable[object], together: int = 20) -> int:
        """Publish messages, some at once, and serve the monitor in between; how many there were."""
        sent = 0
        for message in messages:
            publish(message)
            sent += 1
            if sent % together == 0:
                self.work(together)
        self.settle()
        return sent

    def work(self, events: int) -> None:
        """Serve the monitor as far as so many events."""
        for _ in range(events):
            self._executor.spin_once(timeout_sec=0.0)

    def settle(self) -> None:
        """Serve the monitor until nothing new comes and all that came was followed."""
        before, since = -1, time.monotonic()
        while time.monotonic() < since + 0.3 or len(self.monitor._inbox):
            self._executor.spin_once(timeout_sec=0.01)
            if self.monitor._inbox.received != before:
                before, since = self.monitor._inbox.received, time.monotonic()

    def _keep_what_is_said(self) -> None:
        """Keep every message of every status that goes to /diagnostics."""
        original = self.monitor._messages.diagnostics

        def kept(stamp_ns: int, statuses: Iterable[Status]) -> bytes:
            every = tuple(statuses)
            for status in every:
                self.messages.setdefault(status.name, set()).add(status.message)
            return original(stamp_ns, every)

        self.monitor._messages.diagnostics = kept  # type: ignore[method-assign]

    def reported(self) -> str:
        """All messages of input, topics and load."""
        return " | ".join(
            text for name in ("input", "topics", "load") for text in self.messages.get(name, ())
        )

    def unsaid(self) -> str:
        """What of the messages that came is neither followed nor counted as lost; empty if nothing is."""
        inbox, followed = self.monitor._inbox, self.monitor.monitor._twin.intake.received
        missing = inbox.received - inbox.shed - len(inbox) - followed
        return f"{missing} messages are in no count" if missing else ""

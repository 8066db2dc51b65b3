"""A stage of real DDS: monitors, legs that play to them, and somebody who listens.

Nothing waits for time to pass: a leg starts when its topics are matched, goes on when what it sent was
taken in, and a test ends when what it waits for is there.
"""

from __future__ import annotations

import itertools
import os
import threading
import time
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

os.environ["FASTRTPS_DEFAULT_PROFILES_FILE"] = str(Path(__file__).parent / "fast_discovery.xml")
os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"

# without it, the modules that need a stage are skipped
if find_spec("rclpy"):
    import rclpy
    from rclpy.context import Context
    from rclpy.logging import LoggingSeverity
    from rclpy.node import Node
    from rclpy.parameter import Parameter
    from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
    from rclpy.utilities import try_shutdown

    from leg_wear_monitor.gait.leg import SyntheticLeg
    from leg_wear_monitor.gait.sensors import readings
    from leg_wear_monitor.recordings.streams import streams_read
    from leg_wear_monitor.ros.gait_publisher import PublisherConfig, sensor_message
    from leg_wear_monitor.ros.inputs import Arrival, Inputs, message_class
    from leg_wear_monitor.ros.monitor_node import MonitorNode
    from leg_wear_monitor.ros.running import spin
    from leg_wear_monitor.twin import LOAD, TORQUE

START_NS = 1_700_000_000_000_000_000
PATIENCE_S = 300.0  # before a test that waits in vain is given up; compilation takes its time

# of two processes that test at a time, one takes the even domains, the other the odd ones
_process = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0")[2:])
_domains = (domain % 100 for domain in itertools.count(2 * (os.getpid() % 25) + _process % 2, 2))


def wait_for(there: Callable[[], bool], what: str) -> None:
    """Come back when something is there."""
    given_up = time.monotonic() + PATIENCE_S
    while not there():
        assert time.monotonic() < given_up, f"waited in vain for {what}"
        time.sleep(0.0005)


class Walk:
    """A walk of the synthetic leg: its configuration, its readings, and what was true of it."""

    def __init__(self, config: PublisherConfig) -> None:
        leg = SyntheticLeg(config)
        self.config = config
        self.readings = list(readings(leg, config))
        self.truth = leg.truth()


class Legs:
    """Publishers of a leg's topics, in a namespace."""

    def __init__(self, node: Node, namespace: str, reliable: bool, source: str, load: str) -> None:
        self._node = node
        reliability = ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT
        qos = QoSProfile(depth=200, reliability=reliability)
        self._publishers = {
            stream.kind: node.create_publisher(message_class(stream.type), f"{namespace}/{stream.topic}", qos)
            for stream in streams_read({TORQUE: source, LOAD: load})
        }

    def listeners(self) -> int:
        """How many listen to the topic that fewest listen to."""
        return min(one.get_subscription_count() for one in self._publishers.values())

    def play(
        self,
        walk: Walk,
        monitor: Monitor | None = None,
        begin_s: float = 0.0,
        end_s: float = 1e9,
        block_s: float = 0.015,
        before: Callable[[float], None] = lambda _: None,
        start_ns: int = START_NS,
    ) -> None:
        """Publish a part of a walk, no faster than it is taken in; ``before`` gets the time of each block."""
        if monitor:
            wait_for(lambda: self.listeners() > 0, "the monitor's subscriptions")
        part = [one for one in walk.readings if begin_s <= one.arrival_s < end_s]
        # topics overtake each other in what is sent at once: that must be less than the reorder window
        for _, together in itertools.groupby(part, lambda one: int(one.arrival_s / block_s)):
            block = list(together)
            before(block[0].arrival_s)
            taken = monitor.received if monitor else 0
            for reading in block:
                self._publishers[reading.kind].publish(sensor_message(reading, start_ns, walk.config))
            if monitor:
                sent = taken + len(block)
                wait_for(lambda sent=sent: monitor.received >= sent, "a message on its way")
        if monitor:
            wait_for(lambda: monitor.waiting == 0, "the monitor to take what it got")

    def leave(self) -> None:
        """Take the publishers down."""
        for publisher in self._publishers.values():
            self._node.destroy_publisher(publisher)


class Monitor:
    """The monitor's node, served by a thread."""

    def __init__(self, domain: int, namespace: str, parameters: dict[str, Any]) -> None:
        self._context = Context()
        rclpy.init(args=[], context=self._context, domain_id=domain)
        overrides = [Parameter(name, value=value) for name, value in parameters.items()]
        self.node = MonitorNode(context=self._context, namespace=namespace, parameter_overrides=overrides)
        self._running = threading.Event()
        self._running.set()
        self._thread = threading.Thread(target=spin, args=(self.node, self._running.is_set))
        self._thread.start()

    @property
    def received(self) -> int:
        return self.node._inbox.received

    @property
    def waiting(self) -> int:
        return len(self.node._inbox)

    def stop(self) -> None:
        """End as after a signal."""
        if self._thread.is_alive():
            self._running.clear()
            self._thread.join()
            self.node.close()
            self.node.destroy_node()
            try_shutdown(context=self._context)


class Stage:
    """A domain of its own, with monitors, legs and listeners."""

    def __init__(self, domain: int) -> None:
        self.domain = domain
        self._context = Context()
        rclpy.init(args=[], context=self._context, domain_id=self.domain)
        # the level is that of the whole process: a test before may have said `--log-level fatal`
        rclpy.logging.set_logger_level("", LoggingSeverity.INFO)
        self.node = Node("stage", context=self._context)
        self._monitors: list[Monitor] = []
        self._thread = threading.Thread(target=spin, args=(self.node,))
        self._thread.start()

    wait_for = staticmethod(wait_for)
    walk = Walk

    def monitor(self, namespace: str = "", **parameters: Any) -> Monitor:
        """A monitor with parameters, dots written as double underscores."""
        named = {name.replace("__", "."): value for name, value in parameters.items()}
        monitor = Monitor(self.domain, namespace, named)
        self._monitors.append(monitor)
        return monitor

    def legs(
        self, namespace: str = "", reliable: bool = False, source: str = "wrench", load: str = "none"
    ) -> Legs:
        return Legs(self.node, namespace, reliable, source, load)

    def listen(self, topic: str, kind: type, latched: bool = False, matched: bool = True) -> list[Any]:
        """Messages of a topic as they come, once somebody publishes it."""
        heard: list[Any] = []
        durability = DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE
        qos = QoSProfile(depth=5000, reliability=ReliabilityPolicy.BEST_EFFORT, durability=durability)
        if latched:
            qos.reliability = ReliabilityPolicy.RELIABLE
        subscription = self.node.create_subscription(kind, topic, heard.append, qos)
        if matched:
            wait_for(lambda: subscription.get_publisher_count() > 0, f"a publisher of {topic}")
        return heard

    def call(self, kind: type, name: str, request: Any) -> Any:
        """Answer of a service."""
        client = self.node.create_client(kind, name)
        wait_for(client.service_is_ready, name)
        future = client.call_async(request)
        wait_for(future.done, f"an answer of {name}")
        return future.result()

    def close(self) -> None:
        for monitor in self._monitors:
            monitor.stop()
        try_shutdown(context=self._context)
        self._thread.join()
        self.node.destroy_node()


@pytest.fixture(autouse=True)
def domain(monkeypatch: pytest.MonkeyPatch) -> int:
    """A domain for each test: no node meets one of its name that another test left, half made, say."""
    number = next(_domains)
    monkeypatch.setenv("ROS_DOMAIN_ID", str(number))
    return number


@pytest.fixture
def stage(domain: int) -> Iterator[Stage]:
    """A stage for one test."""
    stage = Stage(domain)
    yield stage
    stage.close()


@pytest.fixture(scope="session", autouse=True)
def take_soon() -> Iterator[None]:
    """A node in this process takes its messages each 5 ms: a walk is sent no faster than it is taken."""
    with pytest.MonkeyPatch.context() as patch:
        if find_spec("rclpy"):
            patch.setattr("leg_wear_monitor.ros.monitor_node._TAKE_S", 0.005)
        yield


@pytest.fixture
def arrive_at(monkeypatch: pytest.MonkeyPatch) -> Callable[[float], None]:
    """Sets the time at which messages come to a node, in seconds after `START_NS`."""
    now, taken = [START_NS], Inputs.taken
    clock = SimpleNamespace(time_ns=lambda: now[0], monotonic_ns=time.monotonic_ns)
    monkeypatch.setattr("leg_wear_monitor.ros.monitor_node.time", clock)

    def taken_now(self: Inputs, now_ns: int) -> list[Arrival]:
        return [one._replace(log_time_ns=now[0]) for one in taken(self, now_ns)]

    def set_clock(at_s: float) -> None:
        now[0] = START_NS + round(1.0e9 * at_s)

    monkeypatch.setattr(Inputs, "taken", taken_now)
    return set_clock


@pytest.fixture(scope="session")
def walk() -> Walk:
    """Six seconds at an even pace, wearing a hundred thousand times as fast as steel."""
    return Walk(PublisherConfig(duration_s=6.0, wear_acceleration=1.0e5))

"""Listeners to a running monitor, for the dashboard and the demo."""

import json
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.context import Context
from rclpy.exceptions import InvalidTopicNameException
from rclpy.executors import SingleThreadedExecutor
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.utilities import try_shutdown
from rclpy.validate_full_topic_name import validate_full_topic_name
from std_msgs.msg import String

from leg_wear_monitor.dashboard.live_leg import MOST, LiveLeg, received_status
from leg_wear_monitor.errors import ConfigError, printable
from leg_wear_monitor.recordings import outputs
from leg_wear_monitor.recordings.result import ReplayStatus
from leg_wear_monitor.recordings.streams import LATCHED, Output, Qos, topic_of
from leg_wear_monitor.ros.running import WAKE_S, spin, stamp_ns_of

# Listens to the outputs of a running monitor, for the dashboard.


_HEARD = (outputs.STATE, outputs.DIAGNOSTICS)


def full_name(node: str) -> str:
    """Full name of a node, with its leading slash.

    Raises
    ------
    ConfigError
        If it is not the name of a node.
    """
    name = f"/{node.strip('/')}"
    try:
        validate_full_topic_name(name)
    except (InvalidTopicNameException, ValueError) as error:
        reason = " ".join(str(error).split())
        raise ConfigError("--node", "", f"{node!r} is not the name of a node: {printable(reason)}") from error
    return name


def topics_of(node: str) -> list[str]:
    """Topics to subscribe to."""
    return [topic_of(output, node) for output in _HEARD]


@contextmanager
def listening(node: str, leg: LiveLeg) -> Iterator[None]:
    """Pass the messages of a monitor to a leg, in a thread, until the end of the context.

    Parameters
    ----------
    node : str
        Name returned by `full_name`.
    leg : LiveLeg
    """
    context = Context()
    context.init(args=[])
    try:
        listener = _Listener(context, node, leg)
        wanted = threading.Event()
        wanted.set()
        # With the default executor, a failure in a callback is an exception. Messages are few.
        spinning = listener, wanted.is_set, SingleThreadedExecutor
        thread = threading.Thread(target=spin, args=spinning, name="listener", daemon=True)
        thread.start()
        try:
            yield
        finally:
            wanted.clear()
            thread.join()
            listener.destroy_node()
    finally:
        try_shutdown(context=context)


class _Listener(Node):
    """Subscribes only; it publishes nothing and offers no service."""

    def __init__(self, context: Context, monitor: str, leg: LiveLeg) -> None:
        super().__init__(
            "leg_wear_dashboard", context=context, enable_rosout=False, start_parameter_services=False
        )
        self._monitor, self._leg = monitor, leg
        self._subscribe(outputs.STATE, String, lambda m: leg.take_state(m.data))
        self._subscribe(
            outputs.DIAGNOSTICS,
            DiagnosticArray,
            lambda m: leg.take_diagnostics(stamp_ns_of(m.header.stamp), _statuses(m)),
        )

    def _subscribe(self, output: Output, kind: type, take: Callable[[Any], None]) -> Any:
        return self.create_subscription(kind, topic_of(output, self._monitor), take, _profile(output.qos))


def _profile(qos: Qos) -> QoSProfile:
    """Quality of service offered by the publishers of an output, even if it is not the usual one."""
    is_latched = qos == LATCHED
    return QoSProfile(
        depth=qos.depth,
        reliability=ReliabilityPolicy.RELIABLE if is_latched else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if is_latched else DurabilityPolicy.VOLATILE,
    )


def _statuses(message: DiagnosticArray) -> Iterable[ReplayStatus]:
    first: Sequence[Any] = message.status[:MOST]
    for status in first:
        values = {pair.key: pair.value for pair in status.values[:MOST]}
        yield received_status(status.name, ord(status.level), status.message, values)


# Listener of the demo: prints the state of the leg after each gait cycle.


class DemoListener:
    """Subscribes to the state of the leg that a monitor in a namespace publishes.

    Parameters
    ----------
    namespace : str
    domain : int
        ROS domain.
    report : callable
        Called with the JSON object of each state.
    """

    def __init__(self, namespace: str, domain: int, report: Callable[[dict[str, Any]], None]) -> None:
        self._report = report
        self._context = Context()
        self._context.init(args=[], domain_id=domain)
        self._node = Node("witness", context=self._context, namespace=namespace)
        self._executor = EventsExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._node.create_subscription(
            String, topic_of(outputs.STATE, "leg_wear_monitor"), self._take_state, _profile(outputs.STATE.qos)
        )

    def attend(self, going_on: Callable[[], bool]) -> None:
        """Process messages while `going_on` returns true."""
        while going_on():
            self._executor.spin_once(timeout_sec=WAKE_S)

    def leave(self) -> None:
        """Shut down the executor."""
        self._executor.shutdown()
        self._node.destroy_node()
        try_shutdown(context=self._context)

    def _take_state(self, message: String) -> None:
        self._report(json.loads(message.data))

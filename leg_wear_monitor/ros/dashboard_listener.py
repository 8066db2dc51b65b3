"""Listens to a running monitor for the dashboard: its outputs, and its parameters once."""

import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import ParameterValue
from rcl_interfaces.srv import GetParameters
from rclpy.context import Context
from rclpy.exceptions import InvalidTopicNameException
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.task import Future
from rclpy.utilities import try_shutdown
from rclpy.validate_full_topic_name import validate_full_topic_name
from sensor_msgs.msg import JointState

from leg_wear_monitor.dashboard.leg_view import LegSetup, leg_setup
from leg_wear_monitor.dashboard.live_leg import LiveLeg
from leg_wear_monitor.dashboard.received import MOST, received_status
from leg_wear_monitor.errors import ConfigError, LegWearError, printable
from leg_wear_monitor.mechanism.loader import is_file_name, load_mechanism, shipped_mechanisms
from leg_wear_monitor.messages import outputs
from leg_wear_monitor.messages.output import Output, topic_of
from leg_wear_monitor.messages.qos import LATCHED, Qos
from leg_wear_monitor.monitor.config.fitting import fitted
from leg_wear_monitor.monitor.config.parameters import PARAMETERS, config_from
from leg_wear_monitor.playback.result.parts import ReplayStatus
from leg_wear_monitor.ros.running import spin, stamp_ns_of

_ASK_AGAIN_S = 2.0
_HEARD = (outputs.VERDICT, outputs.DIAGNOSTICS, outputs.ALARMS, outputs.FORECAST, outputs.CLEARANCES)


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
    """Topics that are listened to."""
    return [topic_of(output, node) for output in _HEARD]


@contextmanager
def listening(node: str, leg: LiveLeg, setup: LegSetup | None = None) -> Iterator[None]:
    """Tell a leg what a monitor publishes, in a thread, until the end of the context.

    Parameters
    ----------
    node : str
        As `full_name` returned it.
    leg : LiveLeg
    setup : LegSetup, optional
        The leg's parameters; without them, the monitor is asked.
    """
    context = Context()
    context.init(args=[])
    try:
        listener = _Listener(context, node, leg)
        if setup is None:
            listener.ask()
        else:
            leg.take_setup(setup)
        wanted = threading.Event()
        wanted.set()
        # with the default executor, what fails in a callback is an exception, and messages are few
        spinning = listener, wanted.is_set, lambda node: SingleThreadedExecutor(context=node.context)
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
    """Subscribes, and publishes and offers nothing."""

    def __init__(self, context: Context, monitor: str, leg: LiveLeg) -> None:
        super().__init__(
            "leg_wear_dashboard", context=context, enable_rosout=False, start_parameter_services=False
        )
        self._monitor, self._leg = monitor, leg
        self._hear(outputs.VERDICT, DiagnosticArray, lambda m: leg.take_verdict(_statuses(m)))
        self._hear(outputs.ALARMS, DiagnosticArray, lambda m: leg.take_alarms(_statuses(m)))
        self._hear(outputs.FORECAST, DiagnosticArray, lambda m: leg.take_forecast(_statuses(m)))
        self._hear(outputs.CLEARANCES, JointState, lambda m: leg.take_cycle(_columns(m)))
        self._hear(
            outputs.DIAGNOSTICS,
            DiagnosticArray,
            lambda m: leg.take_diagnostics(stamp_ns_of(m.header.stamp), _statuses(m)),
        )

    def _hear(self, output: Output, kind: type, take: Callable[[Any], None]) -> None:
        self.create_subscription(kind, topic_of(output, self._monitor), take, _profile(output.qos))

    def ask(self) -> None:
        """Ask for the parameters until there is an answer."""
        self._client = self.create_client(GetParameters, f"{self._monitor}/get_parameters")
        self._asked: Future | None = None
        self._timer = self.create_timer(_ASK_AGAIN_S, self._ask_now)
        self._names = list(PARAMETERS)
        self._ask_now()

    def _ask_now(self) -> None:
        if self._client.service_is_ready() and (self._asked is None or self._asked.done()):
            self._asked = self._client.call_async(GetParameters.Request(names=self._names))
            self._asked.add_done_callback(self._answered)

    def _answered(self, future: Future) -> None:
        values = future.result().values if future.result() else []
        if len(values) != len(self._names):  # that is another node of this name, or one of another version
            self._leg.take_setup(None, "The monitor's parameters cannot be read; give them by --config FILE.")
            return
        given = {name: _plain(value) for name, value in zip(self._names, values, strict=True)}
        try:
            self._leg.take_setup(_setup(given, self._monitor))
        except LegWearError as error:
            self._leg.take_setup(None, f"The leg is not known: {error}")
        self.destroy_timer(self._timer)


def _plain(message: ParameterValue) -> Any:
    """A value as in a parameter file; ROS passes an empty list as unset."""
    value = parameter_value_to_python(message)
    if value is None:
        return []
    return value if isinstance(value, bool | int | float | str) else list(value)


def _setup(given: dict[str, Any], monitor: str) -> LegSetup:
    """The leg of a monitor's parameters; its mechanism is one of the package: no message names a file."""
    config = config_from(given, monitor)
    if is_file_name(config.mechanism) or config.mechanism not in shipped_mechanisms():
        raise LegWearError(
            f"the monitor has a mechanism of its own, {printable(config.mechanism)}; "
            "give the parameter file of the monitor by --config FILE"
        )
    return leg_setup(config, fitted(load_mechanism(config.mechanism), config, monitor))


def _profile(qos: Qos) -> QoSProfile:
    """What publishers of an output offer, also with another quality of service than the usual one."""
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


def _columns(message: JointState) -> dict[str, dict[str, float]]:
    names = [name.removesuffix("_clearance") for name in message.name]
    return {
        "clearance_m": dict(zip(names, message.position, strict=False)),
        "peak_force_n": dict(zip(names, message.effort, strict=False)),
    }

"""Listener of the demo: reports what the monitor publishes, and acknowledges its alarms."""

from collections.abc import Callable

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.context import Context
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.task import Future
from rclpy.utilities import try_shutdown
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from leg_wear_monitor.ros.running import WAKE_S, executor_for, stamp_ns_of

_MONITOR = "leg_wear_monitor"


class DemoListener:
    """Subscribes to the monitor in a namespace.

    Parameters
    ----------
    namespace : str
    domain : int
        ROS domain.
    report : callable
        Called with a stamp [ns] and a line of text.

    Attributes
    ----------
    clearances_m : dict
        Last received clearance of each joint [m].
    stamp_ns : int
        Stamp of these clearances [ns].
    raised, acknowledged : list of str
        Alarms that were raised, and those that were cleared by an acknowledgement.
    """

    def __init__(self, namespace: str, domain: int, report: Callable[[int, str], None]) -> None:
        self._report = report
        self._context = Context()
        self._context.init(args=[], domain_id=domain)
        self._node = Node("witness", context=self._context, namespace=namespace)
        self._executor = executor_for(self._node)
        self._executor.add_node(self._node)
        self.clearances_m: dict[str, float] = {}
        self.stamp_ns = 0
        self.raised: list[str] = []
        self.acknowledged: list[str] = []
        self._asked: Future | None = None
        self._service = self._node.create_client(Trigger, f"{_MONITOR}/acknowledge_alarms")
        self._node.create_subscription(JointState, f"{_MONITOR}/clearance_states", self._hear_cycle, 10)
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._node.create_subscription(DiagnosticArray, f"{_MONITOR}/alarms", self._hear_alarms, latched)

    def attend(self, going_on: Callable[[], bool]) -> None:
        """Process messages while `going_on` returns true."""
        while going_on():
            self._executor.spin_once(timeout_sec=WAKE_S)

    def leave(self) -> None:
        """Shut down the executor."""
        self._executor.shutdown()
        self._node.destroy_node()
        try_shutdown(context=self._context)

    def _hear_cycle(self, message: JointState) -> None:
        self.stamp_ns = stamp_ns_of(message.header.stamp)
        names = [name.removesuffix("_clearance") for name in message.name]
        self.clearances_m = dict(zip(names, message.position, strict=True))
        clearances = "  ".join(f"{name} {1e6 * c:.3f}" for name, c in self.clearances_m.items())
        self._report(
            self.stamp_ns, f"clearance [um]  {clearances}   hardest impact {max(message.effort):.0f} N"
        )

    def _hear_alarms(self, message: DiagnosticArray) -> None:
        alarms = {status.name.split(": ", 1)[-1]: status for status in message.status}
        up = {name: status for name, status in alarms.items() if status.level != DiagnosticStatus.OK}
        for name, status in up.items():
            if name not in self.raised:
                self.raised.append(name)
                self._report(stamp_ns_of(message.header.stamp), f"ALARM {name}: {_alarm_text(status)}")
        if up and all(status.message.startswith("latched") for status in up.values()) and not self._asked:
            self._asked = self._service.call_async(Trigger.Request())
            self._asked.add_done_callback(lambda future: self._hear_answer(future, list(up)))

    def _hear_answer(self, future: Future, names: list[str]) -> None:
        self._asked = None
        self.acknowledged += names
        self._report(self.stamp_ns, f"alarms acknowledged: {future.result().message}")


def _alarm_text(status: DiagnosticStatus) -> str:
    values = {value.key: value.value for value in status.values}
    unit = next((key.removeprefix("value_") for key in values if key.startswith("value_")), "")
    suffix = f"_{unit}" if unit else ""
    return f"{float(values[f'value{suffix}']):.5g} {unit.upper()}, limit {values[f'limit{suffix}']}"

"""Output topics of the monitor: serialized messages are published and recorded."""

from collections.abc import Iterable

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import WrenchStamped
from numpy.typing import NDArray
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from visualization_msgs.msg import MarkerArray

from leg_wear_monitor.messages.output import Output
from leg_wear_monitor.messages.qos import Qos
from leg_wear_monitor.ros.outputs.black_box import BlackBox
from leg_wear_monitor.ros.running import until_down

VOLATILE = "volatile"

_KINDS = {
    "sensor_msgs/msg/JointState": JointState,
    "geometry_msgs/msg/WrenchStamped": WrenchStamped,
    "diagnostic_msgs/msg/DiagnosticArray": DiagnosticArray,
    "std_msgs/msg/Float64": Float64,
    "visualization_msgs/msg/MarkerArray": MarkerArray,
}


def qos_profile(qos: Qos) -> QoSProfile:
    """Convert to a quality-of-service profile of rclpy."""
    return QoSProfile(
        depth=qos.depth,
        reliability=ReliabilityPolicy[qos.reliability.upper()],
        durability=DurabilityPolicy[qos.durability.upper()],
    )


class Outlets:
    """Publishers of a node's outputs.

    Parameters
    ----------
    node : rclpy.node.Node
    outputs : iterable of Output
    black_box : BlackBox
    """

    def __init__(self, node: Node, outputs: Iterable[Output], black_box: BlackBox) -> None:
        self._context, self._black_box = node.context, black_box
        self._topics: dict[Output, str] = {}
        self._publishers: dict[Output, Publisher] = {}
        for output in outputs:
            # names without a leading slash are in the node's namespace; names may be remapped
            self._publishers[output] = publisher = node.create_publisher(
                _KINDS[output.type],
                output.name,
                qos_profile(output.qos),
                qos_overriding_options=QoSOverridingOptions.with_default_policies(),
            )
            self._topics[output] = publisher.topic_name
            black_box.add_topic(publisher.topic_name, output.type, output.qos)

    def wanted(self, output: Output) -> bool:
        """Whether a message is needed: for a subscriber, for a late one (latched), or for the recording."""
        if self._black_box.on or output.qos.durability != VOLATILE:
            return True
        with until_down(self._context):
            return self._publishers[output].get_subscription_count() > 0
        return False

    def send(self, output: Output, now_ns: int, raw: bytes) -> None:
        """Record and publish a message; only record it after the context has shut down."""
        self._black_box.write(self._topics[output], now_ns, raw)
        with until_down(self._context):
            self._publishers[output].publish(raw)

    def send_many(self, output: Output, now_ns: int, rows: NDArray[np.uint8]) -> None:
        """Record and publish messages of equal length, (n, bytes)."""
        self._black_box.write_many(self._topics[output], now_ns, rows)
        publish = self._publishers[output].publish
        with until_down(self._context):
            for row in rows:
                publish(row.tobytes())

"""A leg on ros2_control, by rclpy alone: the topics of its broadcasters, for a machine without ros2_control.

The nodes publish what these publish, as their sources of ROS 2 Jazzy have it:

- joint_state_broadcaster 4.42: `joint_states` (NaN for what a joint does not measure, names in the order of
  the URDF's map) and `dynamic_joint_states` (all interfaces, those of sensors too),
- force_torque_sensor_broadcaster 4.42: `~/wrench`,
- a gripper's driver: a second publisher of `joint_states`, with other joints and another rate.

    python stand_ins.py --seconds 60
"""

import argparse
import math
import sys
import time
from collections.abc import Mapping, Sequence

import numpy as np
import rclpy
from geometry_msgs.msg import WrenchStamped
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import QoSPresetProfiles
from rclpy.utilities import remove_ros_args, try_shutdown
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

from leg_wear_monitor.gait.config import GaitConfig, LoadConfig
from leg_wear_monitor.gait.leg import SyntheticLeg
from leg_wear_monitor.mechanism.arrays import body_names
from leg_wear_monitor.mechanism.loader import load_mechanism
from leg_wear_monitor.mechanism.position import build_linkage, ideal_motion
from leg_wear_monitor.ros.gait_publisher import time_message
from leg_wear_monitor.ros.inputs import message_class

UPDATE_HZ = 200.0
GRIPPER_HZ = 50.0

# joint or sensor: its state interfaces, as in leg.urdf
INTERFACES = {
    "leg_crank": ("position", "velocity", "motor_current", "motor_temperature"),
    "hip_yaw": ("position",),
    "foot_sensor": ("force.x", "force.y", "force.z", "torque.x", "torque.y", "torque.z"),
}
URDF_JOINTS = ("leg_crank", "hip_yaw")

TORQUE_CONSTANT_NM_PER_A, GEAR_RATIO = 0.105, 9.0
CURRENT_NOISE_A, FORCE_NOISE_N = 0.05, 1.0
ENCODER_STEP_RAD = math.tau / 16384


class Hardware:
    """The synthetic leg as state interfaces of ros2_control.

    Parameters
    ----------
    config : GaitConfig, optional
        Default: a leg that pushes on the ground with up to 300 N.
    """

    def __init__(self, config: GaitConfig | None = None) -> None:
        config = config or GaitConfig(load=LoadConfig(ground_n=300.0))
        self._leg = SyntheticLeg(config)
        self._rng = np.random.default_rng(config.seed)
        self._at_s, self._impulse_nms = 0.0, 0.0
        mechanism = load_mechanism(config.mechanism)
        self._crank_rad = np.linspace(0.0, math.tau, 721)
        foot = body_names(mechanism).index(mechanism.toe[0])
        linkage = build_linkage(mechanism)
        motion = ideal_motion(linkage, self._crank_rad, 1.0)
        self._foot_rad = np.unwrap(motion.q[:, foot, 2])

    def read(self, at_s: float) -> dict[str, dict[str, float]]:
        """Values by component and interface, at a time since the start [s] that grows from call to call."""
        now = self._leg.advance(at_s)
        torque_nm = (now.torque_impulse - self._impulse_nms) / (at_s - self._at_s)
        self._at_s, self._impulse_nms = at_s, now.torque_impulse
        noise = self._rng.standard_normal(3)
        along, up = self._leg.foot_force_n(now.crank.angle) + FORCE_NOISE_N * noise[:2]
        foot = float(np.interp(now.crank.angle % math.tau, self._crank_rad, self._foot_rad))
        values = {
            "position": round(now.crank.angle / ENCODER_STEP_RAD) * ENCODER_STEP_RAD,
            "velocity": now.crank.speed,
            "motor_current": torque_nm / (TORQUE_CONSTANT_NM_PER_A * GEAR_RATIO) + CURRENT_NOISE_A * noise[2],
            "motor_temperature": 60.0 - 35.0 * math.exp(-at_s / 600.0),
            # the sensor turns with the foot
            "force.x": math.cos(foot) * along + math.sin(foot) * up,
            "force.y": math.cos(foot) * up - math.sin(foot) * along,
        }
        return {
            component: {name: values.get(name, 0.0) for name in names}
            for component, names in INTERFACES.items()
        }


class JointStateBroadcaster(Node):
    """joint_state_broadcaster with its parameters' defaults.

    Parameters
    ----------
    **options
        Of the node.
    """

    def __init__(self, **options: object) -> None:
        super().__init__("joint_state_broadcaster", **options)
        qos = QoSPresetProfiles.SYSTEM_DEFAULT.value
        self._joint_states = self.create_publisher(JointState, "joint_states", qos)
        dynamic = message_class("control_msgs/msg/DynamicJointState")
        self._dynamic_joint_states = self.create_publisher(dynamic, "dynamic_joint_states", qos)

    def update(self, stamp_ns: int, states: Mapping[str, Mapping[str, float]]) -> None:
        """Publish both messages, of one stamp."""
        movement = ("position", "velocity", "effort")
        # joints of the URDF that have one of the three interfaces, in the order of a std::map
        names = sorted(name for name in URDF_JOINTS if set(movement) & set(states[name]))
        message = JointState(header=Header(stamp=time_message(stamp_ns), frame_id="base_link"), name=names)
        for field in movement:
            setattr(message, field, [float(states[name].get(field, math.nan)) for name in names])
        self._joint_states.publish(message)
        interface_value = message_class("control_msgs/msg/InterfaceValue")
        self._dynamic_joint_states.publish(
            message_class("control_msgs/msg/DynamicJointState")(
                header=message.header,
                joint_names=list(states),
                interface_values=[
                    interface_value(interface_names=list(one), values=[*map(float, one.values())])
                    for one in states.values()
                ],
            )
        )


class ForceTorqueSensorBroadcaster(Node):
    """force_torque_sensor_broadcaster with `sensor_name: foot_sensor` and `frame_id: foot`."""

    def __init__(self, **options: object) -> None:
        super().__init__("foot_sensor_broadcaster", **options)
        self._wrench = self.create_publisher(
            WrenchStamped, "~/wrench", QoSPresetProfiles.SYSTEM_DEFAULT.value
        )

    def update(self, stamp_ns: int, states: Mapping[str, Mapping[str, float]]) -> None:
        """Publish the sensor's wrench."""
        message = WrenchStamped(header=Header(stamp=time_message(stamp_ns), frame_id="foot"))
        for name, value in states["foot_sensor"].items():
            part, _, axis = name.partition(".")
            setattr(getattr(message.wrench, part), axis, float(value))
        self._wrench.publish(message)


class GripperDriver(Node):
    """A driver that publishes its own joint, without speeds and efforts."""

    def __init__(self, **options: object) -> None:
        super().__init__("gripper_driver", **options)
        self._joint_states = self.create_publisher(JointState, "joint_states", 10)

    def update(self, stamp_ns: int) -> None:
        """Publish the gripper's joint."""
        stamp = time_message(stamp_ns)
        self._joint_states.publish(
            JointState(header=Header(stamp=stamp), name=["gripper_finger"], position=[0.02])
        )


class Robot:
    """All nodes of the robot, updated together as by a controller manager.

    Attributes
    ----------
    nodes : list of rclpy.node.Node
    """

    def __init__(self, config: GaitConfig | None = None, **options: object) -> None:
        self._hardware = Hardware(config)
        self._joints, self._foot = JointStateBroadcaster(**options), ForceTorqueSensorBroadcaster(**options)
        self._gripper = GripperDriver(**options)
        self.nodes: list[Node] = [self._joints, self._foot, self._gripper]

    def update(self, number: int, start_ns: int) -> int:
        """Publish what comes with an update, counted from 1; return the number of messages."""
        at_s = number / UPDATE_HZ
        stamp_ns = start_ns + round(1.0e9 * at_s)
        states = self._hardware.read(at_s)
        self._joints.update(stamp_ns, states)
        self._foot.update(stamp_ns, states)
        if number % round(UPDATE_HZ / GRIPPER_HZ):
            return 3
        self._gripper.update(stamp_ns)
        return 4

    def walk(self, seconds: float) -> None:
        """Publish in step with the clock."""
        start_ns, began = self._joints.get_clock().now().nanoseconds, time.monotonic()
        for number in range(1, 1 + round(seconds * UPDATE_HZ)):
            time.sleep(max(0.0, began + number / UPDATE_HZ - time.monotonic()))
            self.update(number, start_ns)


def main(argv: Sequence[str]) -> int:
    """Start the nodes and walk."""
    parser = argparse.ArgumentParser(description="The topics of a leg on ros2_control, without ros2_control.")
    parser.add_argument("--seconds", type=float, default=60.0, help="duration of the walk [s] (60)")
    given = parser.parse_args(remove_ros_args([sys.argv[0], *argv])[1:])
    rclpy.init(args=argv)
    try:
        Robot().walk(given.seconds)
    except (KeyboardInterrupt, ExternalShutdownException):
        return 0
    finally:
        try_shutdown()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

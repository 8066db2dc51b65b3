"""The robot of stand_ins.py and the monitor, each a process of ROS 2; prints the verdict at the end."""

import argparse
import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.qos import DurabilityPolicy, QoSProfile
from stand_ins import Robot

HERE = Path(__file__).parent
MONITOR = "leg_wear_monitor"


def main(argv: Sequence[str]) -> int:
    """Start the monitor, walk once it listens, and print its verdict."""
    parser = argparse.ArgumentParser(description="A leg on ros2_control (stand-ins) and its monitor.")
    parser.add_argument("--seconds", type=float, default=30.0, help="duration of the walk [s] (30)")
    parser.add_argument("--record", type=Path, help="MCAP file of all inputs and outputs of the monitor")
    given = parser.parse_args(argv)
    command = [sys.executable, "-m", MONITOR, "monitor", "--ros-args", "--params-file", HERE / "monitor.yaml"]
    command += ["-r", "foot_load:=/foot_sensor_broadcaster/wrench"]
    if given.record:
        command += ["-p", f"record.path:={given.record}"]
    told: list[DiagnosticArray] = []
    rclpy.init()
    robot = Robot()
    node = robot.nodes[0]
    qos = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    node.create_subscription(DiagnosticArray, f"/{MONITOR}/verdict", told.append, qos)
    with subprocess.Popen(command) as monitor:
        try:
            while not node.count_subscribers("dynamic_joint_states") and monitor.poll() is None:
                rclpy.spin_once(node, timeout_sec=0.1)
            if monitor.poll() is None:
                robot.walk(given.seconds)
                for _ in range(5):  # half a second: later, the monitor reports that the robot is silent
                    rclpy.spin_once(node, timeout_sec=0.1)
        finally:
            monitor.send_signal(signal.SIGINT)
    rclpy.try_shutdown()
    if told:
        print(f"verdict: {told[-1].status[0].message}")
    return int(monitor.returncode or not told)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

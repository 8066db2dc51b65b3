"""The robot of stand_ins.py and the monitor, each a process of ROS 2; prints the verdict at the end."""

import argparse
import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.utilities import try_shutdown
from stand_ins import Robot

from leg_wear_monitor.gait.config import GaitConfig, KnockConfig, LoadConfig

HERE = Path(__file__).parent
MONITOR = "leg_wear_monitor"


def main(argv: Sequence[str]) -> int:
    """Start the monitor, walk once it listens, and print its verdict."""
    parser = argparse.ArgumentParser(description="A leg on ros2_control (stand-ins) and its monitor.")
    parser.add_argument("--seconds", type=float, default=30.0, help="duration of the walk [s] (30)")
    parser.add_argument(
        "--ground-n", type=float, default=300.0, help="largest force of the ground [N] (300); 0: in the air"
    )
    parser.add_argument(
        "--knee-mm", type=float, default=0.3, help="radial clearance of the knee, G [mm] (0.3, as modelled)"
    )
    parser.add_argument("--record", type=Path, help="MCAP file of all inputs and outputs of the monitor")
    given = parser.parse_args(argv)
    command = [sys.executable, "-m", MONITOR, "monitor", "--ros-args", "--params-file", HERE / "monitor.yaml"]
    command += ["-r", "foot_load:=/foot_sensor_broadcaster/wrench"]
    if given.record:
        command += ["-p", f"record.path:={given.record}"]
    verdicts: list[str] = []

    def hear(message: DiagnosticArray) -> None:
        verdicts.extend(one.message for one in message.status if one.name == f"{MONITOR}: verdict")

    rclpy.init()
    knee = KnockConfig(joint="G", at_s=0.0, clearance_m=1.0e-3 * given.knee_mm)
    robot = Robot(GaitConfig(load=LoadConfig(ground_n=given.ground_n), knock=knee))
    node = robot.nodes[0]
    # each second, in which what to wait for is of now; ~/verdict has changes of the verdict only
    node.create_subscription(DiagnosticArray, "/diagnostics", hear, 1)
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
    try_shutdown()
    if verdicts:
        print(f"verdict: {verdicts[-1]}")
    return int(monitor.returncode or not verdicts)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

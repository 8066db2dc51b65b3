"""Executors of rclpy with raw and with typed subscriptions: fraction of a core, and what is lost.

python benchmarks/executors.py [--rate-hz 1000] [--seconds 5]

A publisher in a process of its own sends two topics, JointState of seven joints and WrenchStamped.
"""

import argparse
import os
import subprocess
import sys
import time

import rclpy
from geometry_msgs.msg import WrenchStamped
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message
from rclpy.utilities import try_shutdown
from sensor_msgs.msg import JointState

EXECUTORS = {"single": SingleThreadedExecutor, "multi": MultiThreadedExecutor, "events": EventsExecutor}
BEST_EFFORT = QoSProfile(depth=200, reliability=ReliabilityPolicy.BEST_EFFORT)


def publish(rate_hz: float, seconds: float) -> None:
    """Wait for a subscriber, then send at an even rate."""
    rclpy.init()
    node = rclpy.create_node("source")
    joints = JointState(
        name=[f"j{i}" for i in range(7)], position=[0.5] * 7, velocity=[0.5] * 7, effort=[0.5] * 7
    )
    publishers = [
        (node.create_publisher(JointState, "joint_states", BEST_EFFORT), serialize_message(joints)),
        (
            node.create_publisher(WrenchStamped, "drive_torque", BEST_EFFORT),
            serialize_message(WrenchStamped()),
        ),
    ]
    while not all(publisher.get_subscription_count() for publisher, _ in publishers):
        time.sleep(0.01)
    began = time.monotonic()
    for i in range(int(rate_hz * seconds)):
        time.sleep(max(0.0, began + i / rate_hz - time.monotonic()))
        for publisher, data in publishers:
            publisher.publish(data)
    time.sleep(0.2)
    try_shutdown()


def subscribe(name: str, raw: bool, rate_hz: float, seconds: float) -> None:
    """Receive it all, and print what that took."""
    rclpy.init()
    node = rclpy.create_node("sink")
    got = [0]

    def take(_message: object) -> None:
        got[0] += 1

    for kind, topic in ((JointState, "joint_states"), (WrenchStamped, "drive_torque")):
        node.create_subscription(kind, topic, take, BEST_EFFORT, raw=raw)
    executor = EXECUTORS[name]()
    executor.add_node(node)
    source = subprocess.Popen([sys.executable, __file__, "publish", str(rate_hz), str(seconds)])
    while not got[0]:
        executor.spin_once(timeout_sec=0.2)
    busy, began = time.process_time(), time.monotonic()
    while source.poll() is None:
        executor.spin_once(timeout_sec=0.2)
    fraction = (time.process_time() - busy) / (time.monotonic() - began)
    sent = 2 * int(rate_hz * seconds)
    print(f"{name:7} {'raw' if raw else 'typed':6} {fraction:6.1%} of a core, lost {1 - got[0] / sent:7.3%}")
    executor.shutdown()
    node.destroy_node()
    try_shutdown()


def main() -> None:
    """Each executor in a process of its own."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rate-hz", type=float, default=1000.0)
    parser.add_argument("--seconds", type=float, default=5.0)
    args = parser.parse_args()
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    for number, (name, raw) in enumerate((name, raw) for name in EXECUTORS for raw in (False, True)):
        rest = ["subscribe", name, str(int(raw)), str(args.rate_hz), str(args.seconds)]
        environment = {**os.environ, "ROS_DOMAIN_ID": str(50 + number)}
        subprocess.run([sys.executable, __file__, *rest], env=environment, check=True)


if __name__ == "__main__":
    if sys.argv[1:2] == ["publish"]:
        publish(float(sys.argv[2]), float(sys.argv[3]))
    elif sys.argv[1:2] == ["subscribe"]:
        subscribe(sys.argv[2], sys.argv[3] == "1", float(sys.argv[4]), float(sys.argv[5]))
    else:
        main()

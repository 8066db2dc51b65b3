"""The live node under load: lost messages, resource use, and the delay of a report.

python benchmarks/live.py [--legs 1] [--rate-hz 1000] [--rpm 60] [--seconds 20] [--without-diagnosis]
                          [--foot-load-hz 0] [--ground-n 0] [--record DIRECTORY]
                          [--topics predicted_torque,impact_forces] [--set publish_markers:=true ...]

With --foot-load-hz, a sensor of the foot load sends as well, and its load acts in the node. At 60 rpm the
diagnosis uses the reference of the package: the node loads it after five gait cycles, and reviews it after
50. At a different speed the node simulates a reference while it monitors. With --record, each node records
the messages that it receives and publishes, and keeps a ledger. The recording is then replayed, and messages
and both ledgers' references are compared.

Each leg is a monitor in its own process and namespace. One more process sends the joint states and the torque
of all legs, a recorded walk again and again. This process listens to --topics, to the clearances and to the
diagnostics. --set gives each node a parameter, to see the cost of an option.
"""

import argparse
import os
import sqlite3
import struct
import subprocess
import sys
import threading
import time
from collections import defaultdict
from contextlib import closing
from functools import partial
from pathlib import Path

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import WrenchStamped
from mcap.reader import make_reader
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message
from rclpy.utilities import try_shutdown
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from visualization_msgs.msg import MarkerArray

from leg_wear_monitor.gait.config import (
    EncoderConfig,
    FootLoadSensorConfig,
    LoadConfig,
    PaceConfig,
    TorqueSensorConfig,
)
from leg_wear_monitor.gait.leg import SyntheticLeg
from leg_wear_monitor.gait.sensors import readings
from leg_wear_monitor.ros.gait_publisher import PublisherConfig, sensor_message
from leg_wear_monitor.ros.running import spin
from leg_wear_monitor.twin import CRANK, LOAD, TORQUE
from leg_wear_monitor.twin.sample import REORDER_WINDOW_S, TrackerSettings

LOOP_CYCLES = 8  # that are sent again and again, with an angle that wraps
STAMP = slice(4, 12)  # of a header in CDR
SHOWN = ("received", "shed_messages")
TYPES = {
    "clearance_states": JointState,
    "predicted_torque": WrenchStamped,
    "impact_forces": JointState,
    "markers": MarkerArray,
    "motion": String,
    "state": String,
    "alarms": DiagnosticArray,
    "verdict": DiagnosticArray,
    "forecast": DiagnosticArray,
}
RECORDED = ("record", "mcap"), ("ledger", "ledger")
TABLES = "torque_reference", "torque_commissioning", "body", "verdict"
BEST_EFFORT = QoSProfile(depth=200, reliability=ReliabilityPolicy.BEST_EFFORT)


def recorded(rate_hz: float, rpm: float, load_hz: float, ground_n: float) -> list[tuple[float, int, bytes]]:
    """When [s], which topic, which bytes: a walk."""
    config = PublisherConfig(
        duration_s=60.0 * LOOP_CYCLES / rpm,
        pace=PaceConfig(speeds_rpm=(rpm,)),
        further_joints=tuple(f"joint_{i}" for i in range(6)),
        encoder=EncoderConfig(rate_hz=rate_hz, wrapped=True),
        torque_sensor=TorqueSensorConfig(rate_hz=rate_hz),
        load=LoadConfig(ground_n=ground_n),
        foot_load_sensor=FootLoadSensorConfig(source="wrench" if load_hz else "none", rate_hz=load_hz or 1.0),
    )
    walk = readings(SyntheticLeg(config), config)
    return [(one.taken_s, one.kind, serialize_message(sensor_message(one, 0, config))) for one in walk]


def publish(legs: int, rate_hz: float, rpm: float, seconds: float, load_hz: float, ground_n: float) -> None:
    """Send the walk to all legs in step with the clock, once all listen; print how many messages each."""
    walk, loop_s = recorded(rate_hz, rpm, load_hz, ground_n), 60.0 * LOOP_CYCLES / rpm
    rclpy.init()
    node = Node("walkers")
    topics = [
        {
            kind: node.create_publisher(message, f"leg{leg}/{name}", BEST_EFFORT)
            for kind, message, name in (
                (CRANK, JointState, "joint_states"),
                (TORQUE, WrenchStamped, "drive_torque"),
                (LOAD, WrenchStamped, "foot_load"),
            )
            if kind != LOAD or load_hz
        }
        for leg in range(legs)
    ]
    while not all(one.get_subscription_count() for topic in topics for one in topic.values()):
        time.sleep(0.05)
    began_ns, began, sent = time.time_ns(), time.monotonic(), 0
    for turn in range(int(np.ceil(seconds / loop_s))):
        for taken_s, kind, raw in walk:
            at = turn * loop_s + taken_s
            if at > seconds:
                break
            if (wait := began + at - time.monotonic()) > 0.0:
                time.sleep(wait)
            stamp = struct.pack("<iI", *divmod(began_ns + round(at * 1e9), 1_000_000_000))
            for topic in topics:
                topic[kind].publish(raw[: STAMP.start] + stamp + raw[STAMP.stop :])
            sent += 1
    print(sent, flush=True)
    time.sleep(2.5)
    try_shutdown()


def ignore(raw: bytes) -> None:
    """Callback of a subscriber that only costs the node the sending."""


class Listener(Node):
    """Delays of predicted torques and of gait cycles behind their stamps, and the reports of the nodes."""

    def __init__(self, legs: int, topics: list[str]) -> None:
        super().__init__("listener")
        self.delays_s: list[list[float]] = [[] for _ in range(legs)]
        self.stamps_s: list[list[float]] = [[] for _ in range(legs)]
        self.cycle_delays_s: list[list[float]] = [[] for _ in range(legs)]
        self.diagnoses = [""] * legs
        self.counts: list[dict[str, float]] = [{} for _ in range(legs)]
        self.hardware = {f"leg{leg}": leg for leg in range(legs)}
        deep = QoSProfile(depth=2000, reliability=ReliabilityPolicy.BEST_EFFORT)
        for leg in range(legs):
            kept = {
                "clearance_states": (self.cycle_delays_s[leg], []),
                "predicted_torque": (self.delays_s[leg], self.stamps_s[leg]),
            }
            for name in ("clearance_states", *topics):
                heard = partial(self.hear, *kept[name]) if name in kept else ignore
                topic = f"leg{leg}/leg_wear_monitor/{name}"
                self.create_subscription(TYPES[name], topic, heard, deep, raw=True)
        self.create_subscription(DiagnosticArray, "/diagnostics", self.hear_diagnostics, 50)

    @staticmethod
    def hear(delays: list[float], stamps: list[float], raw: bytes) -> None:
        seconds, rest = struct.unpack("<iI", raw[STAMP])
        stamps.append(seconds % 100_000 + 1e-9 * rest)
        delays.append((time.time_ns() - seconds * 1_000_000_000 - rest) * 1e-9)

    def hear_diagnostics(self, message: DiagnosticArray) -> None:
        leg = self.hardware.get(message.status[0].hardware_id)
        if leg is None:
            return  # from a different node in the same domain
        counts = self.counts[leg]
        for status in message.status:
            if status.name.endswith(": diagnosis"):
                self.diagnoses[leg] = status.message
            if status.name.endswith((": load", ": topics", ": input")):
                counts.update((one.key, float(one.value)) for one in status.values if one.key in SHOWN)


def beyond_lag_s(stamps: np.ndarray, delays: np.ndarray) -> np.ndarray:
    """Delays [s] beyond the tracker's lag and window, of the newest sample that each spline node completes.

    Samples wait for the node after them. Among the samples within two node intervals, the sample with the
    shortest wait waits for no node.
    """
    tracker = TrackerSettings()
    bins = np.floor((stamps - stamps.min()) / (2.0 * tracker.knot_interval_s)).astype(int)
    least = np.full(bins.max() + 1, np.inf)
    np.minimum.at(least, bins, delays)
    return least[1:-1][np.isfinite(least[1:-1])] - tracker.lag_s - REORDER_WINDOW_S


def used(pid: int) -> tuple[float, float]:
    """Processor time [s] and resident memory [MB] of a process."""
    ticks = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[11:13]
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return sum(map(int, ticks)) / os.sysconf("SC_CLK_TCK"), pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def monitors(args: argparse.Namespace) -> list["subprocess.Popen[bytes]"]:
    """A monitor a leg."""
    joints = ",".join(f"'{joint}'" for joint in args.joints.split(","))
    command = [sys.executable, "-m", "leg_wear_monitor", "monitor", "--ros-args", "--log-level", "warn"]
    parameters = [
        f"clearance_joints:=[{joints}]",
        f"cadence.commanded_rpm:={args.rpm}",
        f"diagnosis.enabled:={str(not args.without_diagnosis).lower()}",
    ]
    parameters += args.set
    if args.foot_load_hz:
        parameters += ["foot_load.source:=wrench", "load.model:=measured"]
    nodes = []
    for leg in range(args.legs):
        own = [*parameters, f"hardware_id:=leg{leg}"]
        if args.record:
            own += [f"{what}.path:={args.record / f'leg{leg}.{end}'}" for what, end in RECORDED]
        given = [part for parameter in own for part in ("-p", parameter)]
        nodes.append(subprocess.Popen([*command, *given, "-r", f"__ns:=/leg{leg}"]))
    return nodes


def measure(
    nodes: list["subprocess.Popen[bytes]"], source: "subprocess.Popen[str]"
) -> list[list[tuple[float, ...]]]:
    """Clock [s], processor time and memory of each node, every five seconds from the first message on."""
    seen: list[list[tuple[float, ...]]] = [[] for _ in nodes]
    while source.poll() is None:
        for node, rows in zip(nodes, seen, strict=True):
            rows.append((time.monotonic(), *used(node.pid)))
        try:
            source.wait(5.0)
        except subprocess.TimeoutExpired:
            continue
    return seen


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--legs", type=int, default=1)
    parser.add_argument("--rate-hz", type=float, default=1000.0)
    parser.add_argument("--rpm", type=float, default=60.0)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--foot-load-hz", type=float, default=0.0)
    parser.add_argument("--ground-n", type=float, default=0.0)
    parser.add_argument("--without-diagnosis", action="store_true")
    parser.add_argument("--joints", default="A,B,G,I,J")
    parser.add_argument("--record", type=Path)
    parser.add_argument("--topics", default="predicted_torque", help=f"any of {', '.join(TYPES)}, or nothing")
    parser.add_argument("--set", action="append", default=[], metavar="NAME:=VALUE")
    args = parser.parse_args()
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    os.environ["ROS_DOMAIN_ID"] = str(os.getpid() % 100)
    rclpy.init(args=[])  # which would take --set for its own
    listener = Listener(args.legs, [name for name in args.topics.split(",") if name])
    hearing = threading.Thread(target=spin, args=(listener,))
    hearing.start()
    nodes = monitors(args)
    rest = [str(value) for value in (args.legs, args.rate_hz, args.rpm, args.seconds)]
    rest += [str(args.foot_load_hz), str(args.ground_n)]
    source = subprocess.Popen([sys.executable, __file__, "publish", *rest], stdout=subprocess.PIPE, text=True)
    try:
        while not all(listener.cycle_delays_s):
            time.sleep(0.1)
        seen = measure(nodes, source)
        sent = int(source.stdout.read())
        for leg, rows in enumerate(seen):
            report(leg, sent, rows, listener)
    finally:
        for process in nodes:
            process.terminate()
            process.wait()
        source.terminate()
        source.wait()
        try_shutdown()
        hearing.join()
    for leg in range(args.legs if args.record else 0):
        replay(leg, args)


def replay(leg: int, args: argparse.Namespace) -> None:
    """Replay a node's recording, and compare the published and stored data of both."""
    own, out = args.record / f"leg{leg}.mcap", args.record / f"replay{leg}"
    config = args.record / "leg.yaml"
    config.write_text(
        "/**:\n  ros__parameters:\n"
        f"    clearance_joints: [{args.joints}]\n"
        f"    cadence: {{commanded_rpm: {args.rpm}}}\n"
        f"    diagnosis: {{enabled: {str(not args.without_diagnosis).lower()}}}\n"
        f"    hardware_id: leg{leg}\n"
        + ("    foot_load: {source: wrench}\n    load: {model: measured}\n" if args.foot_load_hz else "")
    )
    again = out.with_suffix(".ledger")
    command = [sys.executable, "-m", "leg_wear_monitor", "replay", str(own), "--config", str(config)]
    subprocess.run(
        [*command, "--out", str(out), "--ledger", str(again)], check=True, stdout=subprocess.DEVNULL
    )
    live, replayed = messages(own), messages(out / "reports.mcap")
    for topic in sorted(replayed):
        same = "the same" if live[topic] == replayed[topic] else "NOT the same"
        print(f"  {topic}: {len(live[topic])} live, {len(replayed[topic])} replayed, {same}")
    for table in TABLES:
        stored = [rows(path, table) for path in (own.with_suffix(".ledger"), again)]
        same = "the same" if stored[0] == stored[1] else "NOT the same"
        print(f"  ledger, {table}: {len(stored[0])} live, {len(stored[1])} replayed, {same}")


def messages(path: Path) -> dict[str, list[bytes]]:
    """Messages by the last word of their topic, in their order."""
    found = defaultdict(list)
    with path.open("rb") as stream:
        for _, channel, message in make_reader(stream).iter_messages(log_time_order=False):
            found[channel.topic.rsplit("/", 1)[-1]].append(message.data)
    return found


def rows(path: Path, table: str) -> list[tuple[object, ...]]:
    """Rows of a table of a ledger."""
    with closing(sqlite3.connect(path)) as ledger:
        return ledger.execute(f"SELECT * FROM {table}").fetchall()


def report(leg: int, sent: int, rows: list[tuple[float, ...]], listener: Listener) -> None:
    counts, delays = listener.counts[leg], np.array(listener.delays_s[leg])
    clock, busy, memory = np.array(rows).T
    fraction = (busy[-2] - busy[0]) / (clock[-2] - clock[0])
    print(
        f"leg {leg}: sent {sent}, received {counts['received']:.0f}, shed {counts['shed_messages']:.0f}; "
        f"{fraction:.1%} of a core; memory {memory[0]:.0f} to {memory[-1]:.0f} MB, "
        f"median {np.median(memory):.0f}, at most {memory.max():.0f}"
    )
    parts = np.diff(busy) / np.diff(clock)
    for at in range(0, len(parts), 12) if len(parts) > 24 else ():
        minute = slice(at, at + 12)
        fraction, most = parts[minute].mean(), memory[minute].max()
        median = np.median(memory[minute])
        print(f"  minute {at // 12 + 1}: {fraction:.1%} of a core; {median:.0f} MB, at most {most:.0f}")
    if len(delays):
        median, p99, worst = 1e3 * np.percentile(delays, [50, 99, 100])
        print(f"  stamp to report: median {median:.0f} ms, p99 {p99:.0f}, worst {worst:.0f} of {len(delays)}")
        beyond = 1e3 * np.percentile(beyond_lag_s(np.array(listener.stamps_s[leg]), delays), [50, 99])
        print(
            f"  beyond the tracker's lag, window and nodes: median {beyond[0]:.1f} ms, p99 {beyond[1]:.1f} ms"
        )
    cycles = 1e3 * np.array(listener.cycle_delays_s[leg])
    median, p99 = np.percentile(cycles, [50, 99])
    late = ", ".join(f"{cycles[i]:.0f} ms ({i + 1})" for i in np.argsort(cycles)[:-6:-1])
    print(f"  gait cycles: median {median:.0f} ms, p99 {p99:.0f} ms of {len(cycles)}; worst (which): {late}")
    print(f"  diagnosis: {listener.diagnoses[leg]}")


if __name__ == "__main__":
    if sys.argv[1:2] == ["publish"]:
        publish(int(sys.argv[2]), *map(float, sys.argv[3:8]))
    else:
        main()

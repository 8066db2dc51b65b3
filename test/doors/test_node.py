"""Started nodes of two legs: topics, services, parameters, silence, SIGTERM; and live = replay."""

import itertools
import json
import os
import signal
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import attrs
import numpy as np
import pytest

import leg_wear_monitor as lw

pytest.importorskip("rclpy")
pytest.importorskip("mcap")

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import WrenchStamped
from raw_messages import messages_of
from rcl_interfaces.srv import GetParameters, ListParameters, SetParameters, SetParametersAtomically
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from ruamel.yaml import YAML
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger

SECOND, START_NS, RATE_HZ = 10**9, 1_700_000_000 * 10**9, 200
SECONDS, PATIENCE_S = 7, 60.0
CYCLES = {"left": 4, "right": 2}  # whole ones that are reported before the tracker's lag, at least
LEFT, RIGHT = "/left/leg_wear_monitor", "/right/leg_wear_monitor"
AHEAD_S = 0.6  # of what is sent before what is reported: the tracker's lag, and some
TYPES = {
    "alarms": DiagnosticArray, "clearance_states": JointState, "forecast": DiagnosticArray,
    "impact_forces": JointState, "predicted_torque": WrenchStamped, "state": String,
    "verdict": DiagnosticArray,
}  # fmt: skip
LATCHED = ("alarms", "verdict", "state")
NO_DATA = "no current data"  # start of a message of a node that receives nothing
SERVICES = {
    "acknowledge_alarms": Trigger, "save_state": Trigger, "reset_wear/G": Trigger, "undo_reset/G": Trigger,
    "measure": SetParametersAtomically,
}  # fmt: skip
PARAMETERS = {"diagnosis.enabled": "false", "wear_acceleration": "1.0e5"}
PARAMETERS |= {"table.rate_hz": "100.0"}  # a parameter file may have it for replay; the node takes no notice

MEASURED = {"joint": "G", "clearance_m": 9.0e-4, "sigma_m": 5.0e-6}
NOT_MEASURED = {
    "unknown joint": (
        MEASURED | {"joint": "Q"},
        "'Q' is not a clearance joint. Expected one of A, B, G, I, J",
    ),
    "in mm": (MEASURED | {"clearance_m": 0.9}, "did you mean 0.9 mm?"),
    "unknown": (MEASURED | {"sigma": 1.0}, "sigma: unknown parameter. Expected joint, clearance_m, sigma_m"),
    "missing": ({"joint": "G", "clearance_m": 9.0e-4}, "sigma_m: is missing. Expected a double"),
    "of a different type": (
        MEASURED | {"clearance_m": 1},
        "clearance_m: is of type int. Expected a double",
    ),
    "twice": (MEASURED, "joint: is given twice"),
}


class Person:
    """Somebody who sends what sensors would send, and who hears and calls a node."""

    def __init__(self, domain: int) -> None:
        self._context = Context()
        rclpy.init(args=[], context=self._context, domain_id=domain)
        self.node = Node("person", context=self._context)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self.heard: dict[str, list[Any]] = defaultdict(list)

    def wait(self, there: Callable[[], bool], what: str) -> None:
        given_up = time.monotonic() + PATIENCE_S
        while not there():
            assert time.monotonic() < given_up, f"waited in vain for {what}"
            self._executor.spin_once(timeout_sec=0.02)

    def listen(self, topic: str, kind: type, latched: bool = False) -> None:
        qos = QoSProfile(depth=5000, reliability=ReliabilityPolicy.RELIABLE)
        if latched:
            qos.durability = DurabilityPolicy.TRANSIENT_LOCAL
        else:
            qos.reliability = ReliabilityPolicy.BEST_EFFORT
        self.node.create_subscription(kind, topic, self.heard[topic].append, qos)

    def call(self, kind: type, name: str, **fields: Any) -> Any:
        client = self.node.create_client(kind, name)
        self.wait(client.service_is_ready, name)
        future = client.call_async(kind.Request(**fields))
        self.wait(future.done, f"an answer of {name}")
        return future.result()

    def walk(self, side: str, seconds: float, rpm: float, torque_nm: Callable[[Any], Any]) -> None:
        """Send a steady gait, no faster than the node reports it."""
        cranks, torques = (
            self.node.create_publisher(kind, f"/{side}/{topic}", QoSProfile(depth=1000))
            for kind, topic in ((JointState, "joint_states"), (WrenchStamped, "drive_torque"))
        )
        for publisher in (cranks, torques):
            self.wait(lambda publisher=publisher: publisher.get_subscription_count() > 0, "the node")
        reported = self.heard[f"/{side}/leg_wear_monitor/impact_forces"]

        def reported_s() -> float:
            stamp = reported[-1].header.stamp if reported else None
            return stamp.sec - START_NS // SECOND + 1.0e-9 * stamp.nanosec if stamp else 0.0

        for n in range(round(seconds * RATE_HZ)):
            angle = 2.0 * np.pi * rpm / 60.0 * n / RATE_HZ
            crank, torque = JointState(name=["crank"], position=[angle]), WrenchStamped()
            torque.wrench.torque.z = float(torque_nm(angle))
            for message in (crank, torque):
                stamp = message.header.stamp
                stamp.sec, stamp.nanosec = divmod(START_NS + n * (SECOND // RATE_HZ), SECOND)
            cranks.publish(crank)
            torques.publish(torque)
            late = time.monotonic() + 0.05  # where a report is lost, it goes on at a slow pace
            self.wait(
                lambda n=n, late=late: reported_s() >= n / RATE_HZ - AHEAD_S or time.monotonic() > late,
                "reports",
            )
        states = self.heard[f"/{side}/leg_wear_monitor/clearance_states"]
        self.wait(lambda: len(states) >= CYCLES[side], "gait cycles")
        for publisher in (cranks, torques):
            self.node.destroy_publisher(publisher)

    def close(self) -> None:
        self.node.destroy_node()
        self._context.try_shutdown()


def started(home: Path, side: str, domain: int, **parameters: str) -> "subprocess.Popen[bytes]":
    words = [f"{name}:={value}" for name, value in {**PARAMETERS, **parameters}.items()]
    line = [sys.executable, "-m", "leg_wear_monitor", "monitor", "--ros-args", "-r", f"__ns:=/{side}"]
    line += [word for value in words for word in ("-p", value)]
    environment = {**os.environ, "ROS_DOMAIN_ID": str(domain)}
    with (home / f"{side}.log").open("wb") as log:
        return subprocess.Popen(line, stdout=log, stderr=subprocess.STDOUT, cwd=home, env=environment)


@attrs.define(eq=False)
class Scene:
    """What two nodes said and answered, and how they ended."""

    home: Path
    heard: dict[str, list[Any]]
    answers: dict[str, Any] = attrs.Factory(dict)
    codes: list[int] = attrs.Factory(list)
    topics: dict[str, list[str]] = attrs.Factory(dict)


def to_set(**values: Any) -> list[Any]:
    named = {name.replace("__", "."): value for name, value in values.items()}
    return [Parameter(name, value=value).to_parameter_msg() for name, value in named.items()]


@pytest.fixture(scope="module")
def scene(leg, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Scene]:
    """A leg at 60 rpm and a leg at 50 rpm; the first one is asked, measured, reset, silent and stopped."""
    home = tmp_path_factory.mktemp("nodes")
    worker = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0")[2:])
    domain = 100 + 2 * (os.getpid() % 50) + worker % 2
    ideal = lw.simulate(leg, clearances=[], cycles=1, trace=360).trace
    order = np.argsort(ideal.crank_angle_rad)
    cycle = (ideal.crank_angle_rad[order], ideal.drive_torque_nm[order])
    nodes = [
        started(home, "left", domain, **{"ledger.path": "left.ledger", "record.path": "left.mcap"}),
        started(home, "right", domain, **{"cadence.commanded_rpm": "50.0"}),
    ]
    person = Person(domain)
    found = Scene(home, person.heard)
    try:
        person.listen("/diagnostics", DiagnosticArray)
        for node, (topic, kind) in itertools.product((LEFT, RIGHT), TYPES.items()):
            person.listen(f"{node}/{topic}", kind, topic in LATCHED)
        for side, rpm in (("left", 60.0), ("right", 50.0)):
            torque = lambda angle: np.interp(angle % (2.0 * np.pi), *cycle, period=2.0 * np.pi)  # noqa: E731
            person.walk(side, SECONDS, rpm, torque)
        found.topics = dict(person.node.get_topic_names_and_types())
        # the operator's actions and the parameters
        names = person.call(ListParameters, f"{LEFT}/list_parameters").result.names
        found.answers["names"] = set(names)
        found.answers["value"] = (
            person.call(GetParameters, f"{LEFT}/get_parameters", names=["cadence.commanded_rpm"])
            .values[0]
            .double_value
        )
        for key, values in {
            "set": {"limits__impact_force_n": 20.0},
            "negative": {"limits__impact_force_n": -1.0},
            "text": {"limits__impact_force_n": "much"},
            "unknown": {"limits__impact_force": 1.0},
            "fixed": {"mechanism": "jansen_leg"},
        }.items():
            (answer,) = person.call(
                SetParameters, f"{LEFT}/set_parameters", parameters=to_set(**values)
            ).results
            found.answers[key] = answer
        for key, (values, _) in ({"measured": (MEASURED | {"accept": True}, "")} | NOT_MEASURED).items():
            request = to_set(**values) + (to_set(joint="G") if key == "twice" else [])
            found.answers[key] = person.call(
                SetParametersAtomically, f"{LEFT}/measure", parameters=request
            ).result
        verdicts = person.heard[f"{LEFT}/verdict"]
        person.wait(lambda: "CLEARANCE_G" in repr(verdicts[-1]), "the verdict on the measured clearance")
        for name in ("reset_wear/G", "undo_reset/G", "acknowledge_alarms", "save_state"):
            found.answers[name] = person.call(Trigger, f"{LEFT}/{name}")
        person.call(Trigger, f"{LEFT}/reset_wear/G")
        person.wait(lambda: "CLEARANCE_G" not in repr(verdicts[-1]), "the verdict on the new part")
        # silence, and the end
        diagnostics = person.heard["/diagnostics"]
        person.wait(
            lambda: any(
                one.name.startswith("left") and one.level == b"\x02" and one.message.startswith(NO_DATA)
                for array in diagnostics[-5:]
                for one in array.status
            ),
            "the report of the silence",
        )
        for node in nodes:
            node.send_signal(signal.SIGTERM)
        found.codes = [node.wait(60) for node in nodes]
        yield found
    finally:
        for node in nodes:
            node.kill()
            node.wait()
        person.close()


def test_topics_have_their_types_in_each_namespace(scene: Scene) -> None:
    for node, (topic, kind) in itertools.product((LEFT, RIGHT), TYPES.items()):
        (name,) = scene.topics[f"{node}/{topic}"]
        package, _, of_kind = name.partition("/msg/")
        assert (package, of_kind) == (kind.__module__.partition(".")[0], kind.__name__)


def test_each_gait_cycle_is_reported(scene: Scene) -> None:
    for side, cycles in CYCLES.items():
        node = f"/{side}/leg_wear_monitor"
        states = scene.heard[f"{node}/clearance_states"]
        assert cycles <= len(states) <= cycles + 2
        for state in states:
            assert list(state.name) == [f"{joint}_clearance" for joint in "ABGIJ"]
            assert all(2.9e-4 < clearance < 6.0e-4 for clearance in state.position)
            assert all(force > 0.0 for force in state.effort)
        assert [list(a.position) < list(b.position) for a, b in itertools.pairwise(states)]
        document = json.loads(scene.heard[f"{node}/state"][0].data)
        assert document["clearances"].keys() == set("ABGIJ") and "verdict" in document


def test_two_legs_do_not_hear_each_other(scene: Scene) -> None:
    values: dict[str, list[float]] = defaultdict(list)
    for array in scene.heard["/diagnostics"]:
        for status in array.status:
            if status.name.endswith("leg_wear_monitor: gait"):
                (rpm,) = (float(pair.value) for pair in status.values if pair.key.startswith("cadence"))
                values[status.hardware_id].append(rpm)
    rates = sorted(np.nanmedian([rpm for rpm in each if rpm > 0.0]) for each in values.values())
    assert rates == pytest.approx([50.0, 60.0], abs=1.0)


def test_each_status_is_in_one_group_of_the_aggregator(scene: Scene) -> None:
    """As diagnostic_aggregator reads config/diagnostics.yaml."""
    text = (lw.share_directory() / "config" / "diagnostics.yaml").read_text()
    analysers = YAML(typ="safe", pure=True).load(text)["analyzers"]["ros__parameters"]
    parts = [one["contains"] for name, one in analysers.items() if name != "path"]
    names = {status.name for array in scene.heard["/diagnostics"] for status in array.status}
    names |= {"leg_wear_monitor: crank zero", "leg_wear_monitor: foot_load"}  # only with their parameters
    assert {f"{side}/leg_wear_monitor: joint A" for side in CYCLES} <= names
    for name in names:
        assert sum(any(part in name for part in group) for group in parts) == 1, name


def test_parameters_are_listed_and_set_and_wrong_ones_are_refused_in_one_line(scene: Scene) -> None:
    answers = scene.answers
    assert {"limits.impact_force_n", "cadence.commanded_rpm", "mechanism"} <= answers["names"]
    assert not any(name.startswith("table.") for name in answers["names"])
    assert answers["value"] == 60.0
    assert answers["set"].successful
    for key in ("negative", "text", "unknown", "fixed"):
        assert not answers[key].successful and answers[key].reason and "\n" not in answers[key].reason, key


def test_an_operator_measures_replaces_and_acknowledges(scene: Scene) -> None:
    answers, monitor = scene.answers, scene.home / "left.ledger"
    assert answers["measured"].successful
    for key, (_, words) in NOT_MEASURED.items():
        assert not answers[key].successful and words in answers[key].reason, key
    for name in ("reset_wear/G", "undo_reset/G", "acknowledge_alarms", "save_state"):
        assert answers[name].success, answers[name].message
    config = attrs.evolve(lw.load_config(), wear_acceleration=1.0e5)
    config = attrs.evolve(config, ledger=attrs.evolve(config.ledger, path=str(monitor)), hardware_id="left")
    leg = lw.load_mechanism("bionic_leg")
    kept = lw.WearMonitor(leg, config, lw.open_ledger(leg, config))
    worn = dict(zip(kept.clearance_joints, kept.wear_depth_m.max(axis=(1, 2)), strict=True))
    kept.abandon()
    assert worn["G"] == 0.0 and worn["A"] > 0.0


def test_silence_is_an_error_and_never_stale(scene: Scene) -> None:
    levels = {status.level for array in scene.heard["/diagnostics"] for status in array.status}
    assert b"\x03" not in levels
    silent = [
        status
        for array in scene.heard["/diagnostics"]
        for status in array.status
        if status.message.startswith(NO_DATA)
    ]
    # from the start it is a warning at first
    assert {status.level for status in silent if status.name.startswith("left")} >= {b"\x02"}


def test_sigterm_ends_both_nodes_in_order(scene: Scene) -> None:
    assert scene.codes == [0, 0]
    for side in ("left", "right"):
        log = (scene.home / f"{side}.log").read_text()
        assert "The monitor advises." in log and "Traceback" not in log


def test_a_replay_of_the_recording_gives_the_live_reports_byte_for_byte(
    scene: Scene, parameters, tmp_path: Path
) -> None:
    own = parameters(diagnosis__enabled=False, wear_acceleration=1.0e5)
    lw.replay(scene.home / "left.mcap", own, out=tmp_path)
    live, replayed = messages_of(scene.home / "left.mcap"), messages_of(tmp_path / "reports.mcap")
    for topic in ("clearance_states", "impact_forces", "predicted_torque"):
        assert replayed[f"{LEFT}/{topic}"] == live[f"{LEFT}/{topic}"], topic
    assert len(replayed[f"{LEFT}/clearance_states"]) >= CYCLES["left"]

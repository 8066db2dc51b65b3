"""What the node tells of silence, of alarms and of its own faults: by itself, and over real DDS."""

import math
import threading
import time
from pathlib import Path

import pytest

pytest.importorskip("rclpy")

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import WrenchStamped
from ledger_contents import rows_of
from made_node import made_node
from rclpy.node import Node
from rclpy.qos import QoSProfile, qos_profile_sensor_data
from rclpy.serialization import serialize_message
from readings_as_samples import samples
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from visualization_msgs.msg import MarkerArray

from leg_wear_monitor.gait.sensors import Reading
from leg_wear_monitor.messages.cdr import Decoder
from leg_wear_monitor.messages.streams import JOINT_STATE, WRENCH_STAMPED
from leg_wear_monitor.monitor.alarms import Alarm
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.reports import AlarmList, Status
from leg_wear_monitor.monitor.verdict.rules import findings
from leg_wear_monitor.monitor.verdict.situation import Situation
from leg_wear_monitor.monitor.verdict.verdict import verdict_of
from leg_wear_monitor.ros import inputs
from leg_wear_monitor.ros.health import (
    QUANTITIES,
    SOURCES,
    ClockMonitor,
    Load,
    NodeAlarms,
    Silence,
    both_clocks,
)
from leg_wear_monitor.ros.inputs import Arrival, CrankNames, Inbox, Inputs, Publishers, publishers_of
from leg_wear_monitor.ros.supervision import AlarmLog, StatusLog
from leg_wear_monitor.state import Level
from leg_wear_monitor.twin import CRANK as KIND
from leg_wear_monitor.twin import KINDS
from leg_wear_monitor.twin.sample import NO_FAULT

ME = "/leg_wear_monitor"
SECOND = 10**9
NOON_NS = 1_700_000_000 * SECOND


class Lines:
    """A logger that keeps what it gets."""

    def __init__(self) -> None:
        self.lines: list[tuple[Level, str]] = []

    def info(self, text: str) -> None:
        self.lines.append((Level.OK, text))

    def error(self, text: str) -> None:
        self.lines.append((Level.ERROR, text))


# --- silence ---

CRANK, TORQUE = (kind.name for kind in list(KINDS.values())[:2])
STATUSES = (
    Status("gait", Level.OK, "in step", {"cadence_rpm": 60.0, "cycles": 5.0}),
    Status("input", Level.OK, "in order", {"crank_rate_hz": 200.0, "torque_rate_hz": 200.0}),
    Status("torque", Level.OK, "measured as predicted", {"mismatch": 0.03}),
    Status("joint A", Level.WARN, "clearance grows", {"clearance_m": 3.0e-4}),
    Status("ledger", Level.OK, "kept", {}),
)


def silence() -> Silence:
    return Silence((CRANK, TORQUE), 5 * SECOND, NOON_NS)


def used(crank: int, torque: int) -> dict[str, int]:
    return {CRANK: crank, TORQUE: torque}


def test_after_a_silence_every_status_says_since_when_it_has_no_data() -> None:
    one = silence()
    one.note(used(10, 10), 6 * SECOND, NOON_NS + SECOND)
    assert one.marked(STATUSES, 7 * SECOND) == STATUSES
    marked = one.marked(STATUSES, 9 * SECOND)
    assert [status.name for status in marked] == [status.name for status in STATUSES]
    for status in marked:
        assert status.level is Level.ERROR
        assert status.message.startswith("no current data since 2023-11-14T22:13:21.000Z")
        assert status.values["no_data_s"] == 3.0
        assert "in step" not in status.message
        assert "in order" not in status.message
        assert "as predicted" not in status.message
    by_name = {status.name: status for status in marked}
    assert math.isnan(by_name["gait"].values["cadence_rpm"])
    assert by_name["gait"].values["cycles"] == 5.0
    assert by_name["input"].values["crank_rate_hz"] == 0.0
    assert by_name["ledger"].message.endswith("; kept")


def test_messages_that_cannot_be_used_are_silence_until_the_next_sample_and_their_cause_stays() -> None:
    one = silence()
    one.note(used(10, 10), 6 * SECOND, NOON_NS)
    one.note(used(10, 10), 8 * SECOND, NOON_NS)
    faulty = Status("input", Level.WARN, "9 of 9 samples have a zero stamp: set header.stamp", {})
    (status,) = one.marked([faulty], 9 * SECOND)
    assert status.message.endswith("; 9 of 9 samples have a zero stamp: set header.stamp")
    assert status.message.startswith("no current data since")
    one.note(used(11, 11), 9 * SECOND, NOON_NS)
    assert one.marked(STATUSES, 9 * SECOND) == STATUSES


@pytest.mark.parametrize(("after_s", "level"), [(0, Level.WARN), (9, Level.WARN), (10, Level.ERROR)])
def test_no_data_from_the_start_is_an_error_after_ten_seconds(after_s: int, level: Level) -> None:
    marked = silence().marked(STATUSES, (5 + after_s) * SECOND)
    assert {status.level for status in marked} == {level}
    assert all("since the start at 2023-11-14T22:13:20.000Z" in status.message for status in marked)


def test_a_silent_torque_concerns_the_torque() -> None:
    one = silence()
    one.note(used(10, 10), 6 * SECOND, NOON_NS)
    one.note(used(20, 10), 9 * SECOND, NOON_NS + 3 * SECOND)
    by_name = {status.name: status for status in one.marked(STATUSES, 9 * SECOND)}
    assert by_name["torque"].message == "no current data since 2023-11-14T22:13:20.000Z"
    assert by_name["gait"].message == "in step"


# --- alarms and log ---


def listed(*alarms: Alarm) -> AlarmList:
    return AlarmList(NOON_NS, alarms)


def clearance(present: Level, level: Level) -> Alarm:
    return Alarm(
        kind="clearance", subject="G", unit="m", present=present, level=level, value=6.12e-4, limit=6e-4
    )


def test_each_rise_and_fall_of_an_alarm_is_logged_once_with_value_limit_and_time() -> None:
    lines = Lines()
    log = AlarmLog(lines)
    quiet, loud = clearance(Level.OK, Level.OK), clearance(Level.ERROR, Level.ERROR)
    latched = clearance(Level.OK, Level.ERROR)
    for alarm in (quiet, quiet, loud, loud, latched, latched):
        log.note(listed(alarm))
    value = "0.000612 m, limit 0.0006 m, at 2023-11-14T22:13:20.000Z"
    assert lines.lines == [
        (Level.ERROR, f"alarm clearance G rises from OK to ERROR: {value}"),
        (Level.OK, f"alarm clearance G falls from ERROR to OK: {value}, shown until it is acknowledged"),
    ]


def test_a_fault_of_the_node_is_logged_once_and_its_end_too() -> None:
    lines = Lines()
    log = StatusLog(lines)
    full = Status("recording", Level.ERROR, "stopped: no space left", {})
    fine = Status("recording", Level.OK, "on", {})
    for status in (fine, full, full, fine):
        log.note([status, Status("gait", Level.WARN, "an alarm tells of it", {})])
    assert lines.lines == [(Level.ERROR, "recording: stopped: no space left"), (Level.OK, "recording: on")]


def test_alarms_of_the_node_are_listed_while_they_are_raised_and_acknowledged_like_others() -> None:
    node, monitors = NodeAlarms((CRANK, TORQUE)), listed(Alarm(kind="input_sources"))
    assert node.beside(monitors) is monitors
    assert node.evaluate({"input_silence crank": 2.5, "input_sources": 2.0}, NOON_NS)
    assert not node.evaluate({"input_silence crank": 3.5, "input_sources": 2.0}, NOON_NS)
    shown = {alarm.name: alarm for alarm in node.beside(monitors).alarms}
    assert set(shown) == {"input_sources", "input_silence crank"}
    assert (shown["input_silence crank"].level, shown["input_silence crank"].value) == (Level.ERROR, 3.5)
    assert (shown["input_sources"].level, shown["input_sources"].value) == (Level.ERROR, 2.0)
    node.evaluate({"input_silence crank": 0.0, "input_sources": 2.0}, NOON_NS)
    assert [alarm.name for alarm in node.raised] == ["input_sources"]  # data are back, and silence is over
    cleared, kept = node.acknowledge()
    assert [alarm.name for alarm in cleared] == []
    assert [alarm.name for alarm in kept] == ["input_sources"]


def test_an_alarm_of_an_input_concerns_no_joint() -> None:
    """``stamps_ahead crank`` was one of a joint named crank."""
    node = NodeAlarms(tuple(kind.name for kind in KINDS.values()))
    node.evaluate(dict.fromkeys(QUANTITIES.keys() - {f"{SOURCES} {CRANK}"}, 9.0), NOON_NS)
    assert len(node.raised) == 3 * len(KINDS)
    for alarm in node.raised:
        verdict = verdict_of(findings(Situation(alarms=(alarm,), quantities=QUANTITIES)))
        assert (verdict.joints, "joint" in verdict.why) == ((), False), alarm.name


def test_samples_that_came_before_the_clock_was_set_back_are_not_ahead_of_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As from a bag that is played in a loop with its clock."""
    sample = samples([Reading(0.0, 0.0, KIND, NO_FAULT, 0.1, 6.0, math.nan)], NOON_NS)
    with made_node(clearance_joints=["G"]) as node:
        supervision, lead_s = node._supervision, []
        for now_ns in (NOON_NS, NOON_NS - 10 * SECOND, NOON_NS - 9 * SECOND):
            monkeypatch.setattr(supervision, "_now_ns", lambda now_ns=now_ns: now_ns)
            supervision._note_stamps(sample)
            lead_s.append(supervision._ahead_s[CRANK])
    assert lead_s == [0.0, 0.0, 9.0]


def test_a_clock_that_stands_or_is_set_back_is_reported() -> None:
    watch = ClockMonitor()
    assert watch.status(0, SECOND, True).message == "use_sim_time is set and nobody publishes /clock"
    assert watch.status(7, 2 * SECOND, True).level is Level.OK
    stands = watch.status(7, 4 * SECOND, True)
    assert (stands.level, stands.message) == (Level.ERROR, "stands still: /clock has stopped")
    assert watch.status(9 * SECOND, 5 * SECOND, True).level is Level.OK
    assert watch.status(3 * SECOND, 6 * SECOND, True).level is Level.WARN
    assert watch.status(4 * SECOND, 7 * SECOND, True).level is Level.OK


def test_two_statuses_of_the_clock_are_one() -> None:
    counted = Status("clock", Level.OK, "continues", {"epochs_begun": 0.0})
    fine, stands = Status("clock", Level.OK, "goes on", {}), Status("clock", Level.ERROR, "stands still", {})
    assert both_clocks(counted, fine).message == "continues"
    found = both_clocks(counted, stands)
    assert (found.level, found.message, found.values) == (
        Level.ERROR,
        "stands still",
        {"epochs_begun": 0.0},
    )


def noted(names: CrankNames, *messages: list[str]) -> str:
    box = Inbox(Decoder(MonitorConfig()), 100)
    for joints in messages:
        message = JointState(name=joints, position=[0.0] * len(joints))
        message.header.stamp.sec = 5
        box.add(JOINT_STATE, serialize_message(message), 1)
    arrivals = box.take(100)
    names.note(arrivals, box.decoded(arrivals), 5 * SECOND)
    return names.report()


def test_a_crank_that_no_message_names_is_reported_with_the_names_that_are_there() -> None:
    names = CrankNames("crank")
    message = noted(names, ["knee", "hip"])
    assert message == "no joint is named 'crank'; there are hip, knee; set crank_joint to its name"
    assert noted(names) == message
    assert noted(names, ["knee"], ["hip", "crank"]) == ""
    assert noted(names, ["left", "right"], ["knee", "hip"], ["left", "right"]) == (
        "no joint is named 'crank'; there are hip, knee, left, right; set crank_joint to its name"
    )
    assert names.others(since_ns=5 * SECOND) == 3
    assert names.others(since_ns=6 * SECOND) == 0


def test_names_that_would_harm_a_terminal_or_fill_it_are_tamed() -> None:
    message = noted(CrankNames("crank"), [f"joint{i:03d}" for i in range(300)] + ["a\x1b[2J", "b" * 200])
    assert "\x1b" not in message
    assert "and 290 more" in message
    assert len(message) < 400


# --- over real DDS ---


def line(messages: list[DiagnosticArray], name: str):
    return (
        next((one for one in messages[-1].status if one.name.endswith(f": {name}")), None)
        if messages
        else None
    )


def words(messages: list[DiagnosticArray], name: str) -> str:
    found = line(messages, name)
    return "" if found is None else found.message


def is_grey(drawn: MarkerArray) -> bool:
    return all(one.color.r == one.color.g == one.color.b for one in drawn.markers)


def is_healthy(verdicts: list[DiagnosticArray]) -> bool:
    """Whether nothing is left to acknowledge: a few cycles show no clearances yet."""
    return bool(verdicts) and verdicts[-1].status[0].message.startswith(
        ("healthy", "watch: the drive torque")
    )


def test_silence_reaches_statuses_alarms_markers_and_log_and_ends_by_itself(
    stage, walk, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    # a node that was late, as on a busy machine, takes a gap for its own
    monkeypatch.setattr(Load, "late_ns", lambda _self, _now_ns: 0)
    ledger = tmp_path / "wear.ledger"
    monitor = stage.monitor(diagnostics__period_s=0.1, publish_markers=True, ledger__path=str(ledger))
    verdicts = stage.listen(f"{ME}/verdict", DiagnosticArray, latched=True)
    diagnostics = stage.listen("/diagnostics", DiagnosticArray)
    alarms = stage.listen(f"{ME}/alarms", DiagnosticArray, latched=True)
    markers = stage.listen(f"{ME}/markers", MarkerArray)
    stage.legs().play(walk, monitor, end_s=2.5)
    stage.wait_for(lambda: "no current data" in words(diagnostics, "gait"), "the silence")
    for status in diagnostics[-1].status:
        assert status.level == b"\2", status.name
        assert "no current data since" in status.message
    stage.wait_for(lambda: line(alarms, "input_silence crank") is not None, "the alarm of silence")
    stage.wait_for(lambda: markers and is_grey(markers[-1]), "a grey leg")
    # not by /rosout: a line is kept for ten seconds there, and a listener may be discovered later than that
    log: list[str] = []

    def is_logged() -> bool:
        log.append(capfd.readouterr().err)
        return "has been silent since" in "".join(log)

    stage.wait_for(is_logged, "the status in the log")
    assert "".join(log).count("alarm input_silence crank rises") == 1
    assert not is_healthy(verdicts)
    # the leg has walked on meanwhile, so its own alarm of a gap rises, too, and ends
    stage.legs().play(walk, monitor, begin_s=4.5)
    stage.legs().play(walk, monitor, end_s=4.0, start_ns=NOON_NS + 6 * SECOND)
    stage.wait_for(lambda: line(alarms, "input_silence crank") is None, "the end of the silence")
    stage.wait_for(lambda: is_healthy(verdicts), "a verdict without alarms")
    monitor.stop()
    changes = history(ledger)
    for name in ("input_silence crank", "input_silence torque", "input_gaps"):
        assert [level for alarm, level in changes if alarm == name] == [2, 0], name


def test_what_is_missing_because_the_node_was_late_is_no_fault_of_the_sender(
    stage, walk, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The middleware keeps the newest messages only; a node that was late had an alarm of their rate."""
    monkeypatch.setattr(inputs, "DEPTH", 20)
    monitor, legs = stage.monitor(diagnostics__period_s=0.1), stage.legs()
    alarms = stage.listen(f"{ME}/alarms", DiagnosticArray)
    diagnostics = stage.listen("/diagnostics", DiagnosticArray)
    legs.play(walk, monitor, end_s=2.5)
    busy, free, update = threading.Event(), threading.Event(), monitor.node._monitor.update

    def once(samples):
        monitor.node._monitor.update = update
        busy.set()
        free.wait()
        return update(samples)

    monitor.node._monitor.update = once
    legs.play(walk, begin_s=2.5, end_s=2.6)
    stage.wait_for(busy.is_set, "the node to be busy")
    began = time.monotonic()
    legs.play(walk, begin_s=2.6, end_s=4.5)
    stage.wait_for(lambda: time.monotonic() - began > 1.5, "the node to be late")
    free.set()
    legs.play(walk, monitor, begin_s=4.5)
    stage.wait_for(
        lambda: any("overloaded" in words([one], "load") for one in diagnostics), "the load of the node"
    )
    raised = {one.name.split(": ")[1] for message in alarms for one in message.status if one.level != b"\0"}
    assert not {"input_rate crank", "input_rate torque", "input_gaps"} & raised
    assert monitor.node.monitor.lost.unmonitored_s > 1.5  # the samples are missing, and that is counted


def history(ledger: Path) -> list[tuple[str, int]]:
    """Changed alarms of a ledger with the level that was shown, in their order."""
    rows = rows_of(ledger, "SELECT kind, subject, level FROM alarm_history ORDER BY id")
    return [(f"{kind} {subject}".rstrip(), level) for kind, subject, level in rows]


def test_other_joints_on_the_topic_of_the_crank_are_no_fault(stage, walk) -> None:
    """A gripper publishes, too: half as many messages as the leg."""
    other = Node("gripper", context=stage.node.context)
    publisher = other.create_publisher(JointState, "joint_states", 10)
    monitor = stage.monitor(diagnostics__period_s=0.1, alarms__on_delay_cycles=1)
    diagnostics = stage.listen("/diagnostics", DiagnosticArray)
    verdicts = stage.listen(f"{ME}/verdict", DiagnosticArray, latched=True)
    legs = stage.legs()
    stage.wait_for(lambda: publisher.get_subscription_count() > 0, "the monitor's subscription")

    def grip(at_s: float) -> None:
        message = JointState(name=["left", "right"], position=[0.0, 0.1])
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(NOON_NS + int(at_s * SECOND), SECOND)
        publisher.publish(message)

    legs.play(walk, monitor, before=grip)
    lost = monitor.node.monitor.lost
    assert lost.faulty["missing_joint"] > 100
    stage.wait_for(lambda: is_healthy(verdicts), "the verdict of a healthy leg")
    assert not any("not monitored: the fraction" in one.status[0].message for one in verdicts)
    assert words(diagnostics, "input") == "in order"
    assert "expected one" not in words(diagnostics, "topics")
    assert not [one for one in monitor.node.monitor.alarms.alarms if one.level]
    other.destroy_node()


def test_stamps_of_a_time_to_come_and_a_torque_about_another_axis_are_reported(stage, walk) -> None:
    monitor = stage.monitor(diagnostics__period_s=0.1, drive_torque__axis="x")
    diagnostics = stage.listen("/diagnostics", DiagnosticArray)
    alarms = stage.listen(f"{ME}/alarms", DiagnosticArray, latched=True)
    verdicts = stage.listen(f"{ME}/verdict", DiagnosticArray, latched=True)
    texts: list[str] = []

    def listen(_: float) -> None:
        texts.append(words(diagnostics, "clock"))

    # a mismatch is known after some gait cycles
    stage.legs().play(walk, monitor, before=listen, start_ns=time.time_ns() + 100 * SECOND)
    assert any("are ahead of the node's clock: set the clocks" in text for text in texts)
    axis = (
        "the torque about x does not change, the one about z does; if that is the drive's, set drive_torque"
    )
    assert axis in words(diagnostics, "topics")
    stage.wait_for(lambda: axis in verdicts[-1].status[0].message, "the cause in the verdict")
    assert "To do: correct drive_torque.axis" in verdicts[-1].status[0].message
    raised = [
        one for message in alarms for one in message.status if one.name.endswith(": stamps_ahead crank")
    ]
    assert float(next(one.value for one in raised[0].values if one.key == "value_s")) > 90.0
    stage.wait_for(lambda: line(alarms, "stamps_ahead crank") is None, "the end of the alarm")


def test_the_names_that_are_there_are_reported_where_the_crank_is_not(stage, walk) -> None:
    monitor = stage.monitor(diagnostics__period_s=0.1, crank_joint="kurbel")
    diagnostics = stage.listen("/diagnostics", DiagnosticArray)
    stage.legs().play(walk, monitor, end_s=0.5)

    def is_named() -> bool:
        one = line(diagnostics, "topics")
        return one is not None and "no joint is named 'kurbel'; there are crank, hip, knee" in one.message

    stage.wait_for(is_named, "the names")
    assert "crank_joint" in words(diagnostics, "topics")
    assert line(diagnostics, "topics").level == b"\2"
    stage.wait_for(lambda: "do not name the crank 'kurbel'" in words(diagnostics, "input"), "the cause")


def test_a_topic_of_another_type_is_named_with_node_and_types(stage, walk) -> None:
    stage.node.create_publisher(Float64, "drive_torque", 10)
    stage.monitor(diagnostics__period_s=0.1)
    diagnostics = stage.listen("/diagnostics", DiagnosticArray)
    expected = (
        "/drive_torque: /stage publishes std_msgs/msg/Float64, expected geometry_msgs/msg/WrenchStamped; "
        "no message arrives from it"
    )
    stage.wait_for(lambda: expected in words(diagnostics, "topics"), "both types")
    assert line(diagnostics, "topics").level == b"\2"


def test_a_lower_quality_of_service_is_named_until_it_is_corrected(stage) -> None:
    """Seen before: the fault stayed until the node was started again."""
    lower = stage.node.create_publisher(JointState, "joint_states", qos_profile_sensor_data)
    topic, kind = "joint_states", "sensor_msgs/msg/JointState"

    def seen() -> Publishers:
        return publishers_of(stage.node, f"/{topic}", kind, QoSProfile(depth=10))

    stage.wait_for(lambda: seen().refused, "the publisher")
    ((name, why),) = seen().refused
    assert (name, seen().fitting) == ("/stage", ())
    assert "Best effort publisher and reliable subscription" in why and "qos_overrides" in why
    stage.node.destroy_publisher(lower)
    stage.node.create_publisher(JointState, topic, 10)
    stage.wait_for(lambda: seen() == Publishers(("/stage",)), "the corrected publisher")


def test_two_publishers_of_one_crank_are_named_even_if_they_agree(stage, walk) -> None:
    other = Node("simulator", context=stage.node.context)
    other.create_publisher(JointState, "joint_states", 10)
    other.create_publisher(WrenchStamped, "drive_torque", 10)
    monitor = stage.monitor(diagnostics__period_s=0.1)
    diagnostics = stage.listen("/diagnostics", DiagnosticArray)
    alarms = stage.listen(f"{ME}/alarms", DiagnosticArray, latched=True)
    stage.legs().play(walk, monitor, end_s=0.5)
    expected = "/joint_states: 2 publishers: /simulator, /stage; expected one"
    stage.wait_for(lambda: expected in words(diagnostics, "topics"), "both publishers")
    stage.wait_for(lambda: line(alarms, "input_sources torque") is not None, "the alarm of two torques")
    stage.wait_for(lambda: "input_sources torque" in words(diagnostics, "alarms"), "it in the status")
    # a node that has just come may yet turn out to publish other joints than the crank
    stage.wait_for(lambda: line(alarms, "input_sources").level == b"\2", "the alarm of two cranks")
    other.destroy_node()


def test_inputs_are_taken_at_once_in_the_order_and_with_the_times_of_their_arrival(stage) -> None:
    """However long they wait, and from whichever topic: no executor calls anything for them."""
    node = Node("taker", context=stage.node.context)
    inputs = Inputs(node, MonitorConfig())
    crank = stage.node.create_publisher(JointState, "joint_states", 100)
    torque = stage.node.create_publisher(WrenchStamped, "drive_torque", 100)
    for publisher in (crank, torque):
        stage.wait_for(lambda publisher=publisher: publisher.get_subscription_count() > 0, "the taker")
    taken: list[Arrival] = []
    before_ns = time.time_ns()
    for _ in range(5):
        for publisher, message in ((crank, JointState(name=["crank"])), (torque, WrenchStamped())):
            publisher.publish(message)  # within a process, it has arrived when this returns
    after_ns = time.time_ns()
    stage.wait_for(lambda: len(taken.extend(inputs.taken(0)) or taken) == 10, "all messages")
    assert [one.code for one in taken] == [JOINT_STATE, WRENCH_STAMPED] * 5
    times = [one.log_time_ns for one in taken]
    assert times == sorted(times) and before_ns < times[0] < times[-1] < after_ns
    assert inputs.taken(0) == []
    node.destroy_node()

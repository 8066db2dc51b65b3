"""What the monitor's topics carry: read back by rosbags, it is what was reported."""

import json
import math
from itertools import pairwise

import attrs
import numpy as np
import pytest
from made_up_summary import made_up_state

from leg_wear_monitor.messages.outputs import (
    ALARMS,
    CLEARANCES,
    DIAGNOSTICS,
    FORECAST,
    IMPACTS,
    MEASURED_TORQUE,
    OUTPUTS,
    STATE,
    TORQUE,
    Messages,
    plain,
)
from leg_wear_monitor.messages.streams import ForecastTimes, topic_of
from leg_wear_monitor.monitor.alarms import Alarm
from leg_wear_monitor.monitor.angle_regression import ClearanceEstimate, ClearanceObservation
from leg_wear_monitor.monitor.config.inputs import DriveTorque
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.forecast.forecast import Answer, JointForecast, LegForecast, Quantiles
from leg_wear_monitor.monitor.reports import (
    AlarmList,
    CycleReport,
    JointReport,
    Lost,
    Reports,
    SampleReports,
    Status,
    VerdictReport,
)
from leg_wear_monitor.monitor.verdict.situation import KnownClearance
from leg_wear_monitor.monitor.verdict.verdict import Finding
from leg_wear_monitor.playback.replay import node_beside
from leg_wear_monitor.state import Level, State
from leg_wear_monitor.twin import CRANK
from leg_wear_monitor.twin import TORQUE as TORQUE_SAMPLE

pytestmark = pytest.mark.plain

CLEARANCE_JOINTS = ("A", "G")
HEALTHY = Finding(code="NONE", state=State.HEALTHY, why="why", do="do")
PLOTTED = MonitorConfig(publish_scalars=True)


def report(kind, **known):
    """A report with zeros in place of what a test does not look at."""
    return kind(**{field.name: 0 for field in attrs.fields(kind)} | known)


@pytest.fixture(scope="module")
def reports():
    nan = math.nan
    samples = SampleReports(
        stamp_ns=np.array([10, 20, 30, 40], np.int64),
        kind=np.array([CRANK, TORQUE_SAMPLE, CRANK, CRANK]),
        crank_angle_rad=np.array([nan, 0.1, 0.2, 0.3]),
        predicted_torque_nm=np.array([nan, 1.5, 2.5, 3.5]),
        contact_force_n=np.array([[nan, nan], [1.0, 2.0], [3.0, 4.0], [5.0, 6.0]]),
        measured_torque_nm=np.array([nan, 1.25, nan, 3.25]),
        eccentricity_m=np.full((4, 2, 2), 1e-4),
    )
    joint = report(
        JointReport, joint="A", clearance_m=3e-4, growth_mps=1e-15, peak_force_n=50.0, forecast=None,
        seen=None, shown=None,
    )  # fmt: skip
    joints = joint, attrs.evolve(joint, joint="G", growth_mps=None)
    cycle = report(CycleReport, stamp_ns=35, joints=joints, forecast=None)
    alarm = Alarm(
        kind="clearance", subject="A", unit="m", level=Level.ERROR, present=Level.OK, value=6e-4, limit=5e-4,
        raised_ns=1_700_000_000_123_456_789,
    )  # fmt: skip
    lost = report(Lost, faulty={})
    state = VerdictReport(37, (HEALTHY,), made_up_state())
    return Reports(samples, (cycle,), (AlarmList(36, (alarm,)),), lost, states=(state,))


@pytest.fixture(scope="module")
def sent(store, reports):
    """Messages by the name of their topic, as rosbags reads them."""
    messages = {}
    for outgoing in Messages(MonitorConfig(), CLEARANCE_JOINTS).of(reports):
        assert len(outgoing.stamp_ns) == len(outgoing.messages)
        for stamp, row in zip(outgoing.stamp_ns.tolist(), outgoing.messages, strict=True):
            message = store.deserialize_cdr(row.tobytes(), outgoing.output.type)
            if outgoing.output != STATE:  # a text has no header
                assert message.header.stamp.sec * 10**9 + message.header.stamp.nanosec == stamp
            messages.setdefault(outgoing.output.name, []).append(message)
    return messages


def test_the_state_is_json_with_the_verdict_of_its_findings(sent):
    (message,) = sent[STATE.name]
    found, expected = json.loads(message.data), made_up_state().to_dict()
    assert (found["verdict"]["state"], found["clearances"]["A"]["status"]) == ("healthy", "healthy")
    for one in (found, expected):
        del one["verdict"]
        for joint in one["clearances"].values():
            del joint["status"]
    assert found == expected


def test_forces_are_of_the_crank_samples_that_were_followed(sent):
    forces = sent[IMPACTS.name]
    assert [list(message.name) for message in forces] == [["A_impact", "G_impact"]] * 2
    assert [message.effort.tolist() for message in forces] == [[3.0, 4.0], [5.0, 6.0]]
    assert all(message.header.frame_id == "pelvis" for message in forces)


def test_torque_is_of_all_samples_that_were_followed(sent):
    assert [message.wrench.torque.z for message in sent[TORQUE.name]] == [1.5, 2.5, 3.5]
    assert [message.wrench.torque.x for message in sent[TORQUE.name]] == [0.0] * 3


def test_torque_is_about_the_axis_of_the_parameters(store, reports):
    config = MonitorConfig(drive_torque=DriveTorque(axis="x"), publish_impact_forces=False)
    (outgoing,) = Messages(config, CLEARANCE_JOINTS).of_samples(reports.samples)
    message = store.deserialize_cdr(outgoing.messages[0].tobytes(), outgoing.output.type)
    assert (message.wrench.torque.x, message.wrench.torque.z) == (1.5, 0.0)


def test_a_measured_torque_is_of_all_samples_that_bring_one(store, reports):
    (measured,) = (
        outgoing
        for outgoing in Messages(PLOTTED, CLEARANCE_JOINTS).of_samples(reports.samples)
        if outgoing.output == MEASURED_TORQUE
    )
    messages = [store.deserialize_cdr(row.tobytes(), MEASURED_TORQUE.type) for row in measured.messages]
    assert measured.stamp_ns.tolist() == [message.header.stamp.nanosec for message in messages] == [20, 40]
    assert [message.wrench.torque.z for message in messages] == [1.25, 3.25]


def test_each_known_value_of_a_joint_is_a_number_of_its_own(store, reports):
    of = Quantiles(1.0, 2.0, 3.0)
    known = JointForecast(answer=Answer.KNOWN, cycles=of, hours=of, days=of, clearance_m=of, measurements=0)
    unknown = attrs.evolve(known, answer=Answer.NO_GROWTH, hours=None)
    by_encoders = ClearanceEstimate(observation=ClearanceObservation.SEEN, clearance_m=4.1e-4, sigma_m=2.0e-5)
    one, other = reports.cycles[0].joints
    joints = (
        attrs.evolve(one, forecast=known, seen=by_encoders, shown=KnownClearance("torque", 4.2e-4, 1.0e-5)),
        attrs.evolve(other, forecast=unknown, peak_force_n=math.nan),
    )
    cycle = attrs.evolve(reports.cycles[0], joints=joints)
    messages = Messages(PLOTTED, CLEARANCE_JOINTS)
    sent = {
        outgoing.output.name: store.deserialize_cdr(outgoing.messages[0].tobytes(), outgoing.output.type).data
        for outgoing in messages.of(attrs.evolve(reports, cycles=(cycle,)))
        if outgoing.output.type == "std_msgs/msg/Float64"
    }
    assert sent == {
        "~/joints/A/clearance_m": 3e-4,
        "~/joints/A/seen_m": 4.2e-4,  # that of the smaller standard deviation
        "~/joints/A/remaining_p50_h": 2.0,
        "~/joints/A/peak_force_n": 50.0,
        "~/joints/G/clearance_m": 3e-4,  # of what is not known, nothing
    }
    names = {output.name for output in messages.outputs}
    assert set(sent) < names and "~/joints/G/remaining_p50_h" in names


def test_nothing_is_plotted_unless_it_is_asked_for(reports):
    messages = Messages(MonitorConfig(), CLEARANCE_JOINTS)
    assert {outgoing.output for outgoing in messages.of(reports)} < set(OUTPUTS) == set(messages.outputs)


def test_clearances_are_those_of_the_gait_cycle(sent):
    (message,) = sent[CLEARANCES.name]
    assert list(message.name) == ["A_clearance", "G_clearance"]
    assert message.position.tolist() == [3e-4, 3e-4]
    assert message.velocity[0] == 1e-15 and math.isnan(message.velocity[1])
    assert message.effort.tolist() == [50.0, 50.0]


def test_an_alarm_keeps_its_name_and_gives_plain_numbers(sent):
    ((status,),) = (message.status for message in sent[ALARMS.name])
    assert status.name == "leg_wear_monitor: clearance A"
    assert (status.level, status.message, status.hardware_id) == (2, "latched", "leg")
    values = {pair.key: pair.value for pair in status.values}
    assert values["value_m"] == "0.0006"
    assert values["limit_m"] == "0.0005"
    assert float(values["raised_s"]) == pytest.approx(1_700_000_000.123456, abs=1e-5)


def test_a_forecast_says_what_is_known(store, reports):
    of = Quantiles(1.0, 2.0, 3.0)
    forecast = JointForecast(
        answer=Answer.KNOWN, cycles=of, hours=of, days=of, clearance_m=of, measurements=2
    )
    cycle = reports.cycles[0]
    third = attrs.evolve(cycle.joints[1], joint="J", forecast=forecast)
    raw = Messages(MonitorConfig(), CLEARANCE_JOINTS).forecast(
        attrs.evolve(cycle, joints=(*cycle.joints, third))
    )
    *unknown, leg = store.deserialize_cdr(raw, FORECAST.type).status
    values = {pair.key: pair.value for status in unknown for pair in status.values}
    assert [status.message for status in unknown] == 2 * ["not enough growth or data"]
    assert values == {"fault_code": "NONE"}
    assert leg.message == Answer.KNOWN.value
    values = {pair.key: pair.value for pair in leg.values}
    assert [values[f"{fraction}_hours"] for fraction in ("p10", "p50", "p90")] == ["1", "2", "3"]
    assert (values["clearance_p90_m"], values["measurements"]) == ("3", "2")


def test_the_leg_s_forecast_is_a_status_after_those_of_the_joints(store, reports):
    of = Quantiles(1.0, 2.0, 3.0)
    leg = LegForecast(
        answer=Answer.KNOWN,
        cycles=of,
        hours=of,
        days=of,
        first_probability={"A": 0.75, "G": 0.25},
        simulated_lives=9,
    )
    raw = Messages(MonitorConfig(), CLEARANCE_JOINTS).forecast(attrs.evolve(reports.cycles[0], forecast=leg))
    *joints, of_leg = store.deserialize_cdr(raw, FORECAST.type).status
    assert [status.name.split(": ")[1] for status in joints] == ["forecast A", "forecast G"]
    assert (of_leg.name, of_leg.message) == ("leg_wear_monitor: forecast leg", Answer.KNOWN.value)
    values = {pair.key: pair.value for pair in of_leg.values}
    assert [values[f"{fraction}_cycles"] for fraction in ("p10", "p50", "p90")] == ["1", "2", "3"]
    assert (values["A_first_probability"], values["simulated_lives"]) == ("0.75", "9")


def test_diagnostics_are_the_monitors_status(store):
    statuses = (Status("input", Level.WARN, "see: input_gaps", {"crank_rate_hz": 199.5}, "INPUT_GAPS"),)
    raw = Messages(MonitorConfig(hardware_id="left"), CLEARANCE_JOINTS, node="monitor").diagnostics(
        7, statuses
    )
    (status,) = store.deserialize_cdr(raw, DIAGNOSTICS.type).status
    assert (status.name, status.level, status.hardware_id) == ("monitor: input", 1, "left")
    values = [(pair.key, pair.value) for pair in status.values]
    assert values == [("fault_code", "INPUT_GAPS"), ("crank_rate_hz", "199.5")]


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0003, "0.0003"), (0.1 + 0.2, "0.3"), (1e6, "1000000"), (math.nan, "nan"), (math.inf, "inf")],
)
def test_numbers_are_plain(value, text):
    assert plain(value) == text


def test_topics_are_of_the_node(store):
    assert topic_of(ALARMS, "/robot/leg_wear_monitor") == "/robot/leg_wear_monitor/alarms"
    assert topic_of(DIAGNOSTICS, "/robot/leg_wear_monitor") == "/diagnostics"


@pytest.mark.parametrize("cuts", [[], [3], [1, 2, 3, 4, 5, 6, 7]])
def test_forecasts_are_due_by_stamps_however_reports_are_cut(reports, cuts):
    """Seconds of gait cycles and of changes in order of arrival; some changes come before their time."""
    second, due = 10**9, []
    arrivals = [("cycle", 1), ("change", 2.1), ("cycle", 2), ("cycle", 3), ("cycle", 4), ("change", 5),
                ("cycle", 5), ("cycle", 70)]  # fmt: skip
    times = ForecastTimes()
    for begin, end in pairwise([0, *cuts, len(arrivals)]):
        part = arrivals[begin:end]
        cycles = [
            attrs.evolve(reports.cycles[0], stamp_ns=round(at * second))
            for what, at in part
            if what == "cycle"
        ]
        alarms = [AlarmList(round(at * second), ()) for what, at in part if what == "change"]
        now = attrs.evolve(reports, cycles=tuple(cycles), alarms=tuple(alarms))
        due += [cycle.stamp_ns / second for cycle in times.due(now)]
    assert due == [1, 3, 5, 70]


@pytest.mark.parametrize(
    ("topic", "node"),
    [("/joint_states", "/leg_wear_monitor"), ("/robot/left/joint_states", "/robot/left/leg_wear_monitor")],
)
def test_a_replay_stands_in_for_the_node_beside_the_topic_of_the_crank(store, topic, node):
    assert node_beside(topic) == node
    config = MonitorConfig().on_node(node)
    raw = Messages(config, CLEARANCE_JOINTS, node).diagnostics(7, [Status("input", Level.OK, "", {})])
    (status,) = store.deserialize_cdr(raw, DIAGNOSTICS.type).status
    assert status.name == f"{node[1:]}: input"
    assert status.hardware_id == (node[1:].rpartition("/")[0] or "leg")

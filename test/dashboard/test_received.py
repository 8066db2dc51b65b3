"""What the monitor says is understood as it was said, through the very bytes of its messages."""

import math
import string

import pytest
from hypothesis import given
from hypothesis import strategies as st

from leg_wear_monitor.dashboard.received import MOST, alarm_of, own_statuses, received_status, verdict_of
from leg_wear_monitor.messages.outputs import Messages
from leg_wear_monitor.monitor import alarm_specs
from leg_wear_monitor.monitor.alarms import Alarm, Level
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.reports import AlarmList, VerdictReport
from leg_wear_monitor.monitor.verdict.verdict import Finding, unit_of, with_unit
from leg_wear_monitor.state import Evidence, Figure, State

pytestmark = pytest.mark.plain

NODE = "/left/leg_wear_monitor"
UNITS = ("", "m", "N", "N m", "m/h", "h", "s", "rpm", "Hz", "rad")
SENTENCE = st.text(string.ascii_letters + string.digits + " ,()%-", min_size=1).map(str.strip).filter(bool)
JOINTS = st.lists(st.sampled_from("ABGIJ"), unique=True, max_size=3).map(tuple)
VALUE = st.floats(-1e6, 1e6).map(lambda value: float(f"{value:.9g}"))


@st.composite
def evidences(draw):
    names = draw(st.lists(st.sampled_from(("clearance G", "growth A", "impact force B")), unique=True))
    return tuple(
        Evidence(name, draw(VALUE), draw(st.none() | VALUE), draw(st.sampled_from(UNITS))) for name in names
    )


@st.composite
def findings(draw):
    return Finding(
        code="CLEARANCE",
        state=draw(st.sampled_from(State)),
        joints=draw(JOINTS),
        why=draw(SENTENCE),
        do=draw(SENTENCE),
        since_ns=draw(st.integers(0, 10**9)) * 1000,
        evidence=draw(evidences()),
        not_valid=tuple(figure for figure in Figure if draw(st.booleans())),
    )


@pytest.fixture(scope="session")
def heard(store):
    """Statuses of a message, read by another library than ours."""

    def read(raw):
        message = store.deserialize_cdr(raw, "diagnostic_msgs/msg/DiagnosticArray")
        statuses = [
            received_status(one.name, one.level, one.message, {pair.key: pair.value for pair in one.values})
            for one in message.status
        ]
        return own_statuses(NODE, statuses)

    return read


@pytest.fixture(scope="session")
def messages():
    return Messages(MonitorConfig(), ("A", "B", "G", "I", "J"), NODE)


@given(finding=findings())
def test_a_verdict_is_understood_as_it_was_said(messages, heard, finding):
    said = VerdictReport(5, (finding,))
    assert verdict_of(heard(messages.verdict(said))["verdict"]) == said.verdict


@given(
    kind=st.sampled_from(("clearance", "growth", "torque_mismatch", "remaining_life")),
    unit=st.sampled_from(UNITS),
    level=st.sampled_from(Level),
    numbers=st.tuples(VALUE, VALUE, VALUE),
)
def test_an_alarm_is_understood_as_it_was_said(messages, heard, kind, unit, level, numbers):
    value, limit, worst = numbers
    said = Alarm(kind=kind, subject="G", unit=unit, level=level, present=level, value=value, limit=limit,
                 worst=worst, raised_ns=3_000_000_000)  # fmt: skip
    (status,) = heard(messages.alarms(AlarmList(1, (said,)))).values()
    found = alarm_of(status)
    assert (found.name, found.level, found.unit, found.raised_ns) == (said.name, level, unit, 3_000_000_000)
    assert (found.value, found.limit, found.worst) == (value, limit, worst)


def test_every_unit_of_an_alarm_is_understood():
    found = [getattr(one, "unit", None) for one in vars(alarm_specs).values()]
    units = {unit for unit in found if isinstance(unit, str)}
    assert len(units) > 4
    for unit in units | set(UNITS):
        assert unit_of(with_unit("value", unit), "value") == unit


def test_what_is_not_of_a_monitor_is_no_verdict():
    found = verdict_of(received_status("left/leg_wear_monitor: verdict", 7, "hello", {"severity": "nan"}))
    assert (found.state, found.why, found.do) == (State.NOT_MONITORED, "hello", "")
    found = verdict_of(received_status("x", 2, "hello", {"severity": "1e300", "since_s": "inf"}))
    assert found.state is State.STOP
    assert found.since_ns == 0


def test_a_message_is_bounded_and_on_one_line():
    values = {f"key {k}": "1" for k in range(10 * MOST)}
    found = received_status("n" * 10_000, 2, "a\nb\x1b[2J\u202e" * 5_000, {"bad": "x", **values})
    assert len(found.values) == MOST
    assert found.values["bad"] is None
    assert len(found.name) < 3_000 and len(found.message) < 30_000
    assert found.message.isprintable()
    many = [received_status(f"left/leg_wear_monitor: {k}", 0, "", {}) for k in range(10 * MOST)]
    assert len(own_statuses(NODE, many)) == MOST
    assert math.isnan(float("nan")) and own_statuses("/right/leg_wear_monitor", many) == {}

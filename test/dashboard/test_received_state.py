"""The state of a leg is understood as its monitor said it, through the very bytes of its messages."""

import json
import string

import attrs
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_up_summary import made_up_state

from leg_wear_monitor import ConfigError
from leg_wear_monitor.dashboard.live_leg import MOST, LiveLeg, own_statuses, received_state, received_status
from leg_wear_monitor.messages.outputs import STATE, Messages
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.reports import VerdictReport
from leg_wear_monitor.monitor.verdict.verdict import Finding
from leg_wear_monitor.state import Evidence, Figure, LegAlarm, LegAlarms, Level, State

pytestmark = pytest.mark.plain

NODE = "/left/leg_wear_monitor"
UNITS = ("", "m", "N", "N m", "m/h", "h", "s", "rpm", "Hz", "rad")
SENTENCE = st.text(string.ascii_letters + string.digits + " ,()%-±", min_size=1).map(str.strip).filter(bool)
JOINTS = st.lists(st.sampled_from("ABGIJ"), unique=True, max_size=3).map(tuple)
VALUE = st.floats(-1e6, 1e6)
EVIDENCE = st.builds(
    Evidence,
    st.sampled_from(("clearance G", "growth A", "impact force B")),
    VALUE,
    st.none() | VALUE,
    st.sampled_from(UNITS),
)
FINDING = st.builds(
    Finding,
    code=st.just("CLEARANCE"),
    state=st.sampled_from(State),
    joints=JOINTS,
    why=SENTENCE,
    do=SENTENCE,
    since_ns=st.integers(0, 2**62),
    evidence=st.lists(EVIDENCE, max_size=3).map(tuple),
    not_valid=st.lists(st.sampled_from(Figure), unique=True).map(tuple),
)
ALARM = st.builds(
    LegAlarm,
    name=st.just("growth G"),
    level=st.sampled_from(Level),
    state=SENTENCE,
    value=st.none() | VALUE,
    limit=VALUE,
    unit=st.sampled_from(UNITS),
    worst=VALUE,
    raised_ns=st.integers(0, 2**62),
)


@given(found=st.lists(FINDING, min_size=1, max_size=3).map(tuple), alarms=st.lists(ALARM, max_size=2))
def test_a_state_is_understood_as_it_was_said(store, found, alarms):
    leg = attrs.evolve(made_up_state(), alarms=LegAlarms(now=tuple(alarms)))
    said = VerdictReport(5, found, leg)
    raw = Messages(MonitorConfig(), ("A", "B"), NODE).state(said)
    assert received_state(store.deserialize_cdr(raw, STATE.type).data, "state") == said.state


def changed(**values):
    return json.dumps(made_up_state().to_dict() | values)


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("hello", "is not JSON"),
        ("[" * 100_000, "is not JSON"),
        ("[]", "is not a mapping of keys"),
        ("{}", "schema_version: None is not 3"),
        (changed(schema_version=4), "schema_version: 4 is not 3"),
        (changed(verdict="stop"), "verdict: 'stop' is not a mapping"),
        (changed(clearances={"A": {}}), "clearances.A"),
        (changed(weight=1.0), "weight: unknown key"),
        (changed(stamp_ns=10**400), "stamp_ns"),
        (changed(advice="x" * 10**6), "characters, expected"),
    ],
)
def test_what_is_no_state_is_refused_in_one_line(text, fault):
    with pytest.raises(ConfigError) as caught:
        received_state(text, "state")
    assert str(caught.value).startswith("state: ") and fault in str(caught.value)
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 400


def test_a_page_says_that_a_state_cannot_be_read(setup):
    leg = LiveLeg(NODE, [], lambda: 0.0)
    leg.take_setup(setup)
    leg.take_state(changed(schema_version=4))
    regions = leg.content().regions
    assert "schema_version: 4 is not 3" in regions["joints"]
    assert "NOT MONITORED" in regions["verdict"]
    leg.take_state(changed())
    assert "INSPECT" in leg.content().regions["verdict"]


def test_a_message_is_bounded_and_on_one_line():
    values = {f"key {k}": "1" for k in range(10 * MOST)}
    found = received_status("n" * 10_000, 2, "a\nb\x1b[2J\u202e" * 5_000, {"bad": "x", **values})
    assert len(found.values) == MOST
    assert found.values["bad"] is None
    assert len(found.name) < 3_000 and len(found.message) < 30_000
    assert found.message.isprintable()
    many = [received_status(f"left/leg_wear_monitor: {k}", 0, "", {}) for k in range(10 * MOST)]
    assert len(own_statuses(NODE, many)) == MOST
    assert own_statuses("/right/leg_wear_monitor", many) == {}
    verdict = made_up_state().verdict.to_dict() | {"why": "a\nb\x1b[2J\u202e" * 5_000, "joints": ["A"] * 1000}
    state = received_state(changed(verdict=verdict), "state")
    assert state.verdict.why.isprintable() and len(state.verdict.joints) == MOST

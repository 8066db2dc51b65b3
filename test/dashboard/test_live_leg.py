"""The page of a leg that is heard: its verdict, what is old, what is not known, and no markup of others."""

from html.parser import HTMLParser

import attrs
import pytest
from heard_leg import NODE, raised, state_of, status, walk
from html_reader import read, words
from hypothesis import example, given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from leg_wear_monitor.dashboard.live_leg import MOST_ROWS, OLD_AFTER_S, LiveLeg, Row, Trends
from leg_wear_monitor.state import Evidence, State

pytestmark = pytest.mark.plain


def test_the_page_says_verdict_joints_and_lives(leg):
    content = leg.content()
    assert "HEALTHY" in words(content.regions["verdict"])
    assert "Torque mismatch 0.04 (limit 0.1)".lower() in words(content.regions["verdict"]).lower()
    joints = words(content.regions["joints"])
    assert "knee" in joints and "200 h; 100 to 300 h" in joints and "limit 0.6 mm" in joints
    assert "No alarm is raised." in words(content.regions["alarms"])
    assert "Cadence: ✓ yes" in words(content.regions["belief"])
    assert content.words.title == f"✓ healthy – {NODE}"
    for markup in content.regions.values():
        assert markup in content.html
    read(content.html)


def test_a_joint_that_opens_changes_verdict_alarms_and_joints(leg):
    before = leg.content()
    stop = {"state": State.STOP, "joints": ("G",), "fault_code": "CLEARANCE_G", "do": "stop it"}
    state = state_of(11, **stop)
    wide = attrs.evolve(state.clearances["G"], believed_m=7e-4, counted_m=7e-4, status=State.STOP)
    state = attrs.evolve(state, clearances={**state.clearances, "G": wide}, alarms=raised("clearance G"))
    leg.take_state(state.to_json())
    after = leg.content()
    assert leg.content().page == before.page
    assert "STOP" in after.regions["verdict"] and "Stop it".lower() in after.regions["verdict"].lower()
    assert "ERROR clearance G (knee)" in words(after.regions["alarms"])
    assert "STOP" in after.regions["joints"]
    assert "0.7 mm, limit 0.6 mm" in after.regions["joints"]
    assert 'class="over"' in after.regions["joints"]
    assert after.words.state == f"{NODE}: stop joint G (knee)"


def test_it_says_which_topics_it_waits_for_and_then_that_nothing_comes(clock, setup):
    leg = LiveLeg(NODE, [f"{NODE}/verdict", "/diagnostics"], clock)
    waits = leg.freshness()
    assert waits.age_s is None
    assert f"{NODE}/verdict, /diagnostics" in waits.silence
    assert "NOT MONITORED" in leg.content().regions["verdict"]
    leg.take_setup(setup)
    walk(leg)
    assert leg.freshness().age_s == 0.0
    clock.now_s += 12.0
    assert leg.freshness().age_s == 12.0 > OLD_AFTER_S
    assert "nothing is heard of the monitor" in leg.freshness().silence


def test_a_monitor_that_reports_seldom_is_not_old_between_two_reports(leg, setup, clock):
    assert leg.freshness().old_after_s == OLD_AFTER_S
    page = leg.content().page
    leg.take_setup(attrs.evolve(setup, report_s=20.0))
    assert leg.freshness().old_after_s == 60.0
    assert leg.content().page == page


def test_a_monitor_that_hears_no_leg_is_no_fresh_data(leg):
    leg.take_diagnostics(11 * 10**9, [
        status("verdict", "no current data since 1; healthy: all is well. To do: nothing", level=2,
               severity=0, no_data_s=7.5, fault_code="INPUT_SILENCE"),
    ])  # fmt: skip
    found = leg.freshness()
    assert found.age_s == 7.5
    assert "receives nothing from the leg" in found.silence
    assert "INPUT_SILENCE" not in leg.content().regions["verdict"]  # what the verdict was is in ~/verdict


def test_other_nodes_are_left_out(leg):
    before = leg.content()
    assert not leg.renew()
    other = status("verdict", "stop: x. To do: y", node="/right/leg_wear_monitor", severity=4)
    leg.take_diagnostics(11 * 10**9, [other])
    assert not leg.renew()
    assert leg.content().regions["verdict"] == before.regions["verdict"]


def test_without_parameters_the_verdict_is_shown_and_the_leg_is_not(clock):
    leg = LiveLeg(NODE, [], clock)
    leg.take_setup(None, "the mechanism is of another machine")
    walk(leg)
    regions = leg.content().regions
    assert "HEALTHY" in regions["verdict"]
    assert "the mechanism is of another machine" in words(regions["joints"])


class Skeleton(HTMLParser):
    """Elements with the names of their attributes, and scripts' addresses."""

    def __init__(self, html):
        super().__init__()
        self.found = []
        self.feed(html)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.found.append((tag, tuple(name for name, _ in attrs)))


MARKUP = (
    "<script>alert(1)</script>", "</script><script>x()//", "<img src=x onerror=alert(1)>", "\"onload='x()'",
    "{{ 7*7 }}", "]]><!--", "&lt;b&gt;", "</title><svg onload=x()>", "javascript:x()",
    "' autofocus onfocus=x() '",
)  # fmt: skip
NAME = st.lists(st.sampled_from(MARKUP) | st.text(max_size=8), min_size=1, max_size=3).map("".join)


def shown(setup, clock, name, node=NODE):
    leg = LiveLeg(node, [name], clock)
    leg.take_setup(setup)
    for second in (1, 2, 3):
        walk(leg, second)
    evidence = (Evidence(name, 1.0, 2.0, name),)
    verdict = {"state": State.STOP, "why": name, "do": name, "fault_code": name, "evidence": evidence}
    state = attrs.evolve(state_of(4, **verdict), alarms=raised("clearance G", state=name))
    joint = attrs.evolve(state.clearances["G"], believed_by=name, seen_m=4e-4, seen_by=(name,))
    state = attrs.evolve(
        state, clearances={**state.clearances, "G": joint, name: joint}, life_answers={"A": name}, life={}
    )
    leg.take_state(state.to_json())
    leg.take_peaks({name: 1.0, "G": 2.0})
    return leg.content()


@pytest.fixture(scope="module")
def usual(setup):
    """What is shown with a plain text."""
    return shown(setup, lambda: 0.0, "plain")


@given(name=NAME)
@example(name="".join(MARKUP))
@hypothesis_settings(max_examples=8)
def test_no_markup_of_a_message_gets_through(setup, usual, name):
    """With any text in a message, the page has the elements and attributes that it has with a plain one."""
    found = shown(setup, lambda: 0.0, name)
    assert Skeleton(found.html).found == Skeleton(usual.html).found
    assert found.policy == usual.policy


def test_trends_are_bounded_and_keep_their_range():
    trends = Trends()
    for k in range(5 * MOST_ROWS):
        peak = 1e4 if k == 7 else 1.0
        trends.add(Row(k, {"cadence_rpm": 60.0}, {"peak_force_n": {"A": peak}}))
    history = trends.history(("A", "B"))
    assert MOST_ROWS <= len(history.stamp_ns) <= 2 * MOST_ROWS
    assert (history.stamp_ns[0], history.stamp_ns[-1]) == (3, 5 * MOST_ROWS - 1)
    assert history.peak_force_n["A"].max() == 1e4
    assert not (history.peak_force_n["B"] == history.peak_force_n["B"]).any()
    trends.add(Row(3, {}, {}))  # the clock went back
    assert list(trends.history(("A",)).stamp_ns) == [3]

"""The page of a fleet: counts, who needs a person first, what is named, and nothing that is doubted."""

import json
import re
from itertools import pairwise

import attrs
import pytest
from html_reader import read
from made_up_fleet import DAY_NS, NOW_NS, made_up_fleet, made_up_leg, random_fleet

from leg_wear_monitor.fleet.overview import BadRecording, LegChange, LegOverview, first_of
from leg_wear_monitor.report.fleet_page import counts, deadline, first_legs, fleet_page
from leg_wear_monitor.report.fleet_standing import Day, Standing
from leg_wear_monitor.report.page import page_html
from leg_wear_monitor.state import Figure, JointClearance, State

pytestmark = pytest.mark.plain

DAY = Day(now_ns=NOW_NS, fresh_days=7.0)
MOST_BYTES = 1_000_000
NASTY = "</script><script>alert(1)</script><!--&\"'"


def html_of(*legs, pages=()):
    return page_html(fleet_page(made_up_fleet(legs), DAY, pages))


def words_of(page):
    hidden = {"script", "style", "noscript"}
    return " ".join(data.strip() for places, data in page.places if not hidden & {tag for tag, _ in places})


def data_of(html):
    (text,) = re.findall(r'<script type="application/json">(.*?)</script>', html, re.DOTALL)
    return json.loads(text)


def test_the_counts_sum_up():
    fleet = random_fleet(300)
    found = counts(fleet.legs, DAY)
    assert sum(found.values()) == 300
    assert found.pop(Standing.DEMONSTRATION) == 0
    assert all(number > 0 for number in found.values())  # otherwise this shows nothing
    text = words_of(read(page_html(fleet_page(fleet, DAY))))
    numbers = re.search(r"(\d+) must stop, (\d+) to look at, (\d+) unmonitored, (\d+) well\.", text)
    stop, look, blind, well = map(int, numbers.groups())
    assert stop == found[Standing.STOP] == fleet.counts["stop"]
    assert look == fleet.counts["inspect"] + fleet.counts["watch"]
    assert well == found[Standing.HEALTHY] == fleet.counts["healthy"] - found[Standing.OUTDATED]
    assert stop + look + blind + well == 300
    rows = data_of(page_html(fleet_page(fleet, DAY)))["legs"]
    assert [sum(row["standing"] == each.value for row in rows) for each in found] == list(found.values())


def test_a_demonstration_is_named_and_compared_with_no_leg():
    """Its wear is accelerated: nothing of it ranks, and nothing of the other legs changes by it."""
    legs = random_fleet(30).legs
    used = dict.fromkeys(legs[0].used_fraction, 40.0)
    change = LegChange(recordings=1, state="healthy", used_fraction=dict.fromkeys(used, 39.0))
    fast = made_up_leg("fast", State.STOP, used, p10_h=1e-6, change=change, wear_acceleration=5000.0)
    assert first_of([*legs, fast]) == first_of(legs)
    assert first_legs([*legs, fast], DAY) == first_legs(legs, DAY)
    with_it, without = (data_of(html_of(*each)) for each in ([*legs, fast], legs))
    row = with_it["legs"].pop()
    assert with_it == without
    assert (row["standing"], row["rank"], row["life"], row["rise"]) == (
        "demonstration",
        len(legs),
        None,
        None,
    )
    assert set(row["used"]) == {"not valid"}
    assert "all wear is multiplied by 5000: a demonstration, not ranked" in row["why"]
    assert "1 demonstrations." in words_of(read(html_of(*legs, fast)))


def test_the_first_ten_are_the_most_urgent_ones():
    legs = random_fleet(300).legs
    first = first_legs(legs, DAY)
    assert len(first) == 10
    ranks = [DAY.standing(leg).severity for leg in first]
    assert ranks == sorted(ranks, reverse=True)
    others = [leg for leg in legs if leg not in first]
    assert min(ranks) >= max(DAY.standing(leg).severity for leg in others)
    for one, next_one in pairwise(first):
        if DAY.standing(one) is DAY.standing(next_one) and one.life["leg"] and next_one.life["leg"]:
            assert one.life["leg"].p10_h <= next_one.life["leg"].p10_h


def test_each_of_the_first_has_joint_why_what_to_do_and_by_when():
    leg = made_up_leg("left-07", State.STOP, {"A": 0.3, "G": 1.2}, lot="2026-03")
    text = words_of(read(html_of(leg)))
    for words in ("left-07", "STOP", "joint G", leg.verdict.why, leg.verdict.do, "now, before it walks again",
                  "lot 2026-03", "CLEARANCE_G, see docs/howto/verdict/joint_at_limit.md"):  # fmt: skip
        assert words in text
    assert "No leg needs a person now." in words_of(read(html_of(made_up_leg())))


@pytest.mark.parametrize("age_days", [8.0, -2.0, 20000.0])
def test_a_leg_without_a_fresh_recording_is_not_well(age_days):
    leg = made_up_leg(age_days=age_days)
    assert DAY.standing(leg) is Standing.OUTDATED
    html = html_of(leg)
    assert " 0 well" in words_of(read(html)) and "banner careful" in html
    assert data_of(html)["legs"][0]["tone"] == "careful"
    assert DAY.standing(made_up_leg(age_days=6.9)) is Standing.HEALTHY


def test_a_leg_that_could_not_be_updated_is_not_well_and_named():
    leg = made_up_leg(fault="ledger is damaged")
    assert DAY.standing(leg) is Standing.OUTDATED
    text = words_of(read(html_of(leg)))
    assert "Legs that were not updated" in text and text.count("ledger is damaged") >= 2


def test_an_old_recording_hides_no_stop():
    leg = made_up_leg(state=State.STOP, age_days=100.0)
    assert DAY.standing(leg) is Standing.STOP
    assert "its last recording is 100 days old" in words_of(read(html_of(leg)))


def test_a_leg_without_a_recording_is_on_the_page():
    leg = LegOverview(id="new-1")
    html = html_of(leg)
    assert "1 unmonitored" in words_of(read(html)) and "no recording of it was counted" in html
    (row,) = data_of(html)["legs"]
    assert (row["standing"], row["age"], row["life"]) == ("no recording", None, None)


def test_damaged_recordings_are_named():
    leg = made_up_leg()
    bad = (
        BadRecording(file="a/cut.mcap", outcome="counted", why="the file ends early"),
        BadRecording(file="a/other.mcap", outcome="no_gait", why="no gait cycle fits this leg"),
        BadRecording(file="a/noise.mcap", outcome="unreadable", why="is not an MCAP file"),
    )
    health = attrs.evolve(leg.recordings, partial=1, no_gait=1, unreadable=1, bad=bad)
    html = html_of(attrs.evolve(leg, recordings=health))
    text = words_of(read(html))
    for one in bad:
        assert one.file in text and one.why in text
    assert data_of(html)["legs"][0]["bad"] == 3
    many = attrs.evolve(health, unreadable=500)
    assert "499 more are in legs/*/log." in words_of(read(html_of(attrs.evolve(leg, recordings=many))))


def test_no_clearance_that_the_verdict_does_not_believe():
    leg = made_up_leg(state=State.INSPECT, used={"A": 0.4, "G": 0.9})
    doubted = attrs.evolve(leg, verdict=attrs.evolve(leg.verdict, not_valid=tuple(Figure)))
    assert data_of(html_of(leg))["legs"][0]["used"] == [[40.0, 1], [90.0, 3]]
    assert data_of(html_of(doubted))["legs"][0]["used"] == ["not valid", "not valid"]
    assert data_of(html_of(doubted))["legs"][0]["rise"] is None
    seen = JointClearance(counted_m=3e-4, seen_m=5.7e-4, new_m=3e-4, limit_m=6e-4)
    measured = attrs.evolve(doubted, clearances={**leg.clearances, "G": seen})
    assert data_of(html_of(measured))["legs"][0]["used"] == ["not valid", [90.0, 3]]


def test_legs_with_other_joints_share_a_table():
    data = data_of(html_of(made_up_leg("a", used={"A": 0.1}), made_up_leg("b", used={"K": 1.0})))
    assert data["joints"] == ["A", "K"]
    assert [row["used"] for row in data["legs"]] == [[[10.0, 0], None], [None, [100.0, 4]]]


def test_by_when_follows_from_the_p10_and_the_hours_a_day():
    leg = made_up_leg(state=State.WATCH, p10_h=40.0, age_days=0.0)  # 80 h in 20 days
    text = deadline(leg, Standing.WATCH, DAY)
    assert text.startswith("within the p10 of its life: 40 h of walking; by 2026-11-28 at the 4 h a day")
    late = made_up_leg(state=State.WATCH, p10_h=4.0, age_days=6.0)
    assert "; overdue: by 2026-11-13 " in deadline(late, Standing.WATCH, DAY)
    short = attrs.evolve(leg.recordings, begin_ns=leg.recordings.end_ns - DAY_NS // 2)
    assert "a day" not in deadline(attrs.evolve(leg, recordings=short), Standing.WATCH, DAY)
    unknown = attrs.evolve(leg, life={"leg": None})
    assert deadline(unknown, Standing.INSPECT, DAY) == "at its next stop"
    assert deadline(leg, Standing.INSPECT, DAY).startswith(
        "at its next stop; p10 of its life: 40 h of walking"
    )
    assert deadline(unknown, Standing.WATCH, DAY) == "at its next service"


def test_what_changed():
    worse = made_up_leg(
        "w", State.STOP, change=LegChange(recordings=2, state="watch", used_fraction={"A": 0.05})
    )
    better = made_up_leg("b", change=LegChange(recordings=1, state="inspect"))
    text = words_of(read(html_of(worse, better)))
    assert "Recordings counted since: 3." in text
    assert "Legs with a worse verdict: 1; with a better one: 1." in text
    assert "+5" in text
    rows = {row["id"]: row for row in data_of(html_of(worse, better))["legs"]}
    assert (rows["w"]["was"], rows["w"]["rise"], rows["b"]["was"]) == ("watch", [5.0, "A"], "inspect")


def test_names_and_texts_are_data():
    leg = made_up_leg(NASTY, State.STOP, lot=NASTY, fault=NASTY)
    bad = (BadRecording(file=NASTY, outcome=NASTY, why=NASTY),)
    leg = attrs.evolve(
        leg,
        verdict=attrs.evolve(leg.verdict, why=NASTY, do=NASTY, fault_code=NASTY, joints=(NASTY,)),
        used_fraction={NASTY: 1.0},
        recordings=attrs.evolve(leg.recordings, bad=bad),
    )
    html = html_of(leg, pages={NASTY})
    clean = html_of(made_up_leg(state=State.STOP))
    assert html.count("<script") == clean.count("<script")
    assert "<script>alert" not in html and "<!--" not in html
    page = read(html)
    assert NASTY in words_of(page)
    (row,) = data_of(html)["legs"]
    assert (row["id"], row["lot"], row["code"]) == (NASTY, NASTY, NASTY)
    assert all(re.fullmatch(r"legs/[\w%.~-]+/report\.html", link["href"]) for link in page.of("a"))


def test_a_leg_links_to_its_page_if_there_is_one():
    legs = [made_up_leg("with", State.STOP), made_up_leg("without", State.STOP)]
    html = html_of(*legs, pages={"with"})
    assert [link["href"] for link in read(html).of("a")] == ["legs/with/report.html"]
    assert [row["page"] for row in data_of(html)["legs"]] == ["legs/with/report.html", ""]


def test_it_needs_no_network_and_stays_small():
    html = page_html(fleet_page(random_fleet(1000), DAY))
    assert len(html.encode()) < MOST_BYTES
    assert "default-src 'none'" in html and "http" not in re.sub(r"http-equiv|http://www.w3.org", "", html)
    assert html == page_html(fleet_page(random_fleet(1000), DAY))

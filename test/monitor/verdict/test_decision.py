"""Each verdict says how sure it is, how soon to act, what an error costs and what settles it."""

import re
from datetime import date
from pathlib import Path

import attrs
import pytest

from leg_wear_monitor.monitor.verdict.decision import (
    FIGURES_FILE,
    OF_CODE,
    decision_of,
    figures_of,
    measured_figures,
)
from leg_wear_monitor.monitor.verdict.rules import RULES
from leg_wear_monitor.state import (
    Figure,
    FootLoad,
    JointClearance,
    LegState,
    LifeHours,
    State,
    Verdict,
)

ROOT = Path(__file__).parents[3]

pytestmark = pytest.mark.plain


def leg(code="CLEARANCE_SEEN", state=State.STOP, joints=("G",), not_valid=(), by="torque", **changes):
    clearance = JointClearance(
        believed_m=2e-3, believed_by=by, counted_m=3e-4, new_m=3e-4, limit_m=6e-4, status=state
    )
    life = LifeHours(p10_h=40.0, p50_h=100.0, p90_h=300.0)
    verdict = Verdict(
        state=state,
        joints=joints,
        why="why",
        since_ns=0,
        do="do",
        evidence=(),
        not_valid=not_valid,
        fault_code="_".join((code, *joints)),
    )
    known = LegState(verdict=verdict, clearances={"G": clearance}, life={"G": life, "leg": life})
    return attrs.evolve(known, **changes)


def decided(*args, **changes):
    return decision_of(leg(*args, **changes), lambda joint: f"{joint} (knee)")


def test_every_figure_has_a_source_and_a_date_and_is_possible() -> None:
    for name, figure in measured_figures().items():
        path, _, _ = figure.source.partition("#")
        assert (ROOT / path).is_file(), name
        assert date(2026, 1, 1) < date.fromisoformat(figure.date), name
        assert figure.of is None or 0 <= figure.right <= figure.of, name
    named = {name for names in OF_CODE.values() for name in names}
    known = {name.removesuffix("_on_ground") for name in measured_figures()}
    assert named | {"encoder_name"} == known


def test_no_figure_stands_elsewhere_in_the_package() -> None:
    """A percentage or a count of cases in the words of a verdict is one of the file."""
    source = (ROOT / "leg_wear_monitor/monitor/verdict/decision.py").read_text(encoding="utf-8")
    texts = re.findall(r'"[^"]*"', re.sub(r'"""(.|\n)*?"""', "", source))
    assert [text for text in texts if re.search(r"\d+ of \d|\d %", text) and "10 %" not in text] == []
    assert FIGURES_FILE.startswith("config/")


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.code)
@pytest.mark.parametrize("has_life", [True, False])
def test_every_rule_is_a_decision(rule, has_life) -> None:
    joints = ("G",) if "{joint}" in rule.why else ()
    changes = {} if has_life else {"life": {}}
    decision = decided(rule.code, rule.state, joints, rule.not_valid, **changes)
    for text in (decision.certainty, decision.urgency, decision.if_wrong, decision.check):
        assert text and "{" not in text
    assert bool(decision.again) == (rule.state is State.HEALTHY)
    assert 4 <= len(decision.notes) <= 5


def test_a_stop_is_before_the_next_use_and_as_sure_as_it_was_measured() -> None:
    decision = decided()
    assert decision.urgency.startswith("before the next use")
    assert "45 of 45 such stops are right on simulated legs" in decision.certainty
    assert "joint G (knee)" in decision.check and "limit 0.6 mm" in decision.check
    assert "12 such" not in decision.certainty and "11 of 12" in decided(by="encoders").certainty


def test_a_change_is_as_sure_as_on_the_ground_where_the_leg_carries_a_load() -> None:
    changed = "CLEARANCE_CHANGED", State.INSPECT, ("G",), tuple(Figure)
    assert "99 of 100 such findings are right on simulated legs" in decided(*changed).certainty
    loaded = decided(*changed, load=FootLoad(source="estimated", peak_n=300.0))
    assert "56 of 57 such findings" in loaded.certainty and "on the ground" in loaded.certainty


def test_what_a_person_measured_is_as_sure_as_the_measurement() -> None:
    state = leg("CLEARANCE", by="measured")
    assert figures_of(state) == ()
    assert "measured" in decision_of(state, str).certainty


def test_what_was_not_measured_says_so() -> None:
    assert "was not measured" in decided("TORQUE_SIGN", State.INSPECT, ()).certainty


def test_wear_is_urgent_by_the_forecast_and_a_sudden_opening_is_not() -> None:
    assert decided("REMAINING_LIFE", State.INSPECT).urgency.startswith("within about 40.0 h of walking")
    for code in ("CLEARANCE_CORRECTED", "CLEARANCE_CHANGED", "IMPACT_FORCE"):
        sudden = decided(code, State.INSPECT).urgency
        assert sudden.startswith("before the next use") and "40.0" not in sudden
    doubted = decided("REMAINING_LIFE", State.INSPECT, not_valid=(Figure.FORECAST,)).urgency
    assert doubted.startswith("before the next use") and "40.0" not in doubted
    of_the_leg_only = {"leg": LifeHours(p10_h=40.0, p50_h=100.0, p90_h=300.0)}
    assert "40.0" not in decided("REMAINING_LIFE", State.INSPECT, life=of_the_leg_only).urgency


def test_a_healthy_leg_is_looked_at_again_after_half_of_its_p10_and_a_month_at_the_latest() -> None:
    assert "20.0 h" in decided("NONE", State.HEALTHY, ()).again
    long = {"leg": LifeHours(p10_h=1.0e5, p50_h=2.0e5, p90_h=3.0e5)}
    assert "240 h" in decided("NONE", State.HEALTHY, (), life=long).again
    assert "not known" in decided("NONE", State.HEALTHY, (), life={}).again

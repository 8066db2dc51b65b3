"""Charts and tables of a replay: what encoders show, a joint over time, and no value that is not believed."""

import attrs
import numpy as np
import pytest
from made_up_summary import made_up_summary

from leg_wear_monitor.monitor.angle_regression import ClearanceObservation
from leg_wear_monitor.playback.result import EncoderEvidence
from leg_wear_monitor.report.replay.charts import (
    alarm_chart,
    clearance_section,
    clearance_sentences,
    encoder_sections,
    joint_trends,
)
from leg_wear_monitor.state import Figure

pytestmark = pytest.mark.plain


def summary_with(*figures, **seen):
    """A summary whose verdict does not believe some figures, its joints A and B as encoders show them."""
    summary = made_up_summary()
    joints = {name: attrs.evolve(joint, encoders=seen.get(name)) for name, joint in summary.joints.items()}
    verdict = attrs.evolve(summary.verdict, not_valid=figures)
    history = attrs.evolve(summary.history, seen_m={}, seen_sigma_m={})  # no estimates over time
    return attrs.evolve(summary, joints=joints, verdict=verdict, history=history)


def shown(observation, departure_m=None, is_other=False):
    return EncoderEvidence(
        observation=observation, sigma_m=2e-5, departure_m=departure_m, believed=True, is_other=is_other
    )


def test_without_encoders_there_is_nothing_to_say():
    assert encoder_sections(summary_with()) == []
    assert clearance_sentences(summary_with()) == []


def test_a_worn_joint_is_named_and_what_is_not_seen_is_said():
    summary = summary_with(
        B=shown(ClearanceObservation.SEEN, 5e-5, True), A=shown(ClearanceObservation.NOT_OBSERVABLE)
    )
    assert clearance_sentences(summary) == ["Encoders show that B (knee) is 50 µm wider than counted."]
    (section,) = encoder_sections(summary)
    (table,) = section.parts
    assert table.rows == [
        ("A", "0.4000", "-", "0.0200", ClearanceObservation.NOT_OBSERVABLE.value),
        ("B (knee)", "0.4000", "0.4500", "0.0200", "other than counted"),
    ]


def test_a_counted_clearance_that_is_not_believed_is_no_number():
    summary = summary_with(Figure.CLEARANCES, B=shown(ClearanceObservation.SEEN, 5e-5))
    ((table,),) = (section.parts for section in encoder_sections(summary))
    assert [row[1] for row in table.rows] == ["not valid"]
    (text,) = clearance_section(summary).parts
    assert (text.text, text.is_not_valid) == (
        "Counted clearances: not valid: leg differs from its model.",
        True,
    )


def test_growth_alone_may_not_be_valid():
    chart, table = clearance_section(summary_with(Figure.GROWTH)).parts
    assert [row[3:] for row in table.rows] == [("not valid", "not valid")] * 2
    assert chart.columns[1].name == "opened by A"


def over_time(*figures):
    """The summary with an estimate of A in each of its rows."""
    summary = summary_with(*figures)
    n = len(summary.history.stamp_ns)
    estimate = {"seen_m": {"A": np.full(n, 4.0e-4)}, "seen_sigma_m": {"A": np.full(n, 5.0e-5)}}
    return attrs.evolve(summary, history=attrs.evolve(summary.history, **estimate))


def series_of(part):
    return {series.name: series.values for panel in part.panels for series in panel.series}


def test_the_band_is_two_standard_deviations_of_the_estimate():
    chart = joint_trends(over_time(), "A")[0]
    found = series_of(chart)
    assert found["estimate, high"] == pytest.approx(0.5) and found["estimate, low"] == pytest.approx(0.3)
    assert chart.panels[0].bands == [(0, 1)]
    assert {"estimate", "counted", "limit", "peak force"} <= set(found)


def test_what_the_verdict_does_not_believe_is_said_and_not_drawn():
    chart, *doubts = joint_trends(over_time(*Figure), "A")
    assert not {"counted", "peak force", "mean force"} & set(series_of(chart))
    assert [doubt.text.partition(":")[0] for doubt in doubts] == ["Counted clearance", "Contact forces"]


def test_a_joint_of_which_nothing_is_known_has_no_chart():
    assert joint_trends(over_time(), "Z") == []


def test_each_joint_has_its_own_limit_where_they_differ():
    """Seen before: the least of all limits was drawn for each of them."""
    summary = made_up_summary()
    clearances = {
        name: attrs.evolve(one, limit_m=limit_m)
        for (name, one), limit_m in zip(summary.clearances.items(), (5e-4, 6e-4), strict=True)
    }
    seen_m = dict.fromkeys(clearances, np.full(len(summary.history.stamp_ns), 4e-4))
    history = attrs.evolve(summary.history, seen_m=seen_m)

    def limits(of):
        state = attrs.evolve(summary, history=history, **of)
        (chart,) = (one for one in clearance_section(state).parts if getattr(one, "name", "") == "estimates")
        return {one.name: one.values[0] for one in chart.panels[0].series if one.name.startswith("limit")}

    assert limits({"clearances": clearances}) == {"limit A": 0.5, "limit B": 0.6}
    alike = {name: attrs.evolve(one, limit_m=6e-4) for name, one in clearances.items()}
    assert limits({"clearances": alike}) == {"limit": 0.6}


def test_changes_of_alarms_that_are_not_drawn_are_reported():
    summary = made_up_summary()
    (first, *_) = summary.alarms.changes
    changes = [attrs.evolve(first, stamp_ns=summary.recording.begin_ns + i) for i in range(1005)]
    chart = alarm_chart(summary, changes)
    assert "5 later ones are not drawn" in chart.caption
    assert len(chart.panels[0].series[0].values) == 1001  # up to the first that is left out
    assert "not drawn" not in alarm_chart(summary, changes[:1000]).caption

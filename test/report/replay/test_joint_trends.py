"""A joint over time: estimate with its interval, and no counted value that the verdict does not believe."""

import attrs
import numpy as np
import pytest
from made_up_summary import made_up_summary

from leg_wear_monitor.report.replay.charts import joint_trends
from leg_wear_monitor.state import Figure

pytestmark = pytest.mark.plain


def seen(*not_valid):
    summary = made_up_summary()
    n = len(summary.history.stamp_ns)
    history = attrs.evolve(
        summary.history,
        seen_m={"A": np.full(n, 4.0e-4)},
        seen_sigma_m={"A": np.full(n, 5.0e-5)},
    )
    verdict = attrs.evolve(summary.verdict, not_valid=not_valid)
    return attrs.evolve(summary, history=history, verdict=verdict)


def series_of(part):
    return {series.name: series.values for panel in part.panels for series in panel.series}


def test_the_band_is_two_standard_deviations_of_the_estimate():
    chart = joint_trends(seen(), "A")[0]
    found = series_of(chart)
    assert found["estimate, high"] == pytest.approx(0.5) and found["estimate, low"] == pytest.approx(0.3)
    assert chart.panels[0].bands == [(0, 1)]
    assert {"estimate", "counted", "limit", "peak force"} <= set(found)


def test_what_the_verdict_does_not_believe_is_said_and_not_drawn():
    chart, *doubts = joint_trends(seen(*Figure), "A")
    assert not {"counted", "peak force", "mean force"} & set(series_of(chart))
    assert [doubt.text.partition(":")[0] for doubt in doubts] == ["Counted clearance", "Contact forces"]


def test_a_joint_of_which_nothing_is_known_has_no_chart():
    assert joint_trends(seen(), "Z") == []

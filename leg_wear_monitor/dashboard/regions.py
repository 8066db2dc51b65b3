"""Regions of the page: markup of what is known of a leg, each replaced by itself when it changes."""

from collections.abc import Mapping, Sequence
from pathlib import PurePosixPath

import attrs
import numpy as np

from leg_wear_monitor.dashboard.leg_view import over_time
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.alarms.alarm import Level
from leg_wear_monitor.monitor.verdict.verdict import Evidence, Figure
from leg_wear_monitor.monitor.verdict.words import amount
from leg_wear_monitor.playback.result.replay_summary import ReplaySummary
from leg_wear_monitor.report.chart import Chart
from leg_wear_monitor.report.page import Banner, render
from leg_wear_monitor.report.parts import Part, Table, Text
from leg_wear_monitor.report.replay.alarm_words import alarm_line
from leg_wear_monitor.report.replay.banner import verdict_banner
from leg_wear_monitor.report.replay.belief import belief
from leg_wear_monitor.report.replay.charts import (
    estimates_chart,
    force_chart,
    has_estimates,
    health_chart,
    openings_chart,
)
from leg_wear_monitor.report.replay.joint_rows import joint_rows
from leg_wear_monitor.report.replay.joint_view import joint_views
from leg_wear_monitor.report.replay.leg_drawing import leg_drawing
from leg_wear_monitor.report.replay.words import not_valid

VERDICT, JOINTS, ALARMS, BELIEF, TRENDS, STATUS = "verdict", "joints", "alarms", "belief", "trends", "status"

TITLES = {
    JOINTS: "Joints",
    ALARMS: "Alarms",
    BELIEF: "Are these values valid?",
    TRENDS: "Trends",
    STATUS: "Status of the monitor",
}
"""By region, in the order of the page; the verdict is above all."""

_MOST_EVIDENCE = 6


def verdict_region(view: ReplaySummary) -> str:
    """State, reason, action, evidence and what is not valid; its guide is one of the server's pages."""
    banner = verdict_banner(view, f"/guides/{PurePosixPath(view.verdict.guide).name}")
    return banner_markup(with_evidence(banner, view.verdict.evidence))


def banner_markup(banner: Banner) -> str:
    """A banner as it stands in the head of a page."""
    return render("dashboard/banner.html", banner=banner)


def with_evidence(banner: Banner, evidence: Sequence[Evidence]) -> Banner:
    """A banner with the values that the verdict rests on, the first ones, below what to do."""
    known = [each for each in evidence if each.value is not None]
    if not known:
        return banner
    words = "; ".join(map(evidence_words, known[:_MOST_EVIDENCE]))
    more = len(known) - _MOST_EVIDENCE
    words += f"; {more} more" if more > 0 else ""
    first, *others = banner.notes
    return attrs.evolve(banner, notes=[first, ("Evidence", words), *others])


def evidence_words(evidence: Evidence) -> str:
    """A value and its limit, such as ``clearance G 0.62 mm (limit 0.6 mm)``."""
    name = evidence.name.replace("_", " ").removesuffix(f" {evidence.unit}")
    value = "unknown" if evidence.value is None else amount(evidence.value, evidence.unit)
    limit = "" if evidence.limit is None else f" (limit {amount(evidence.limit, evidence.unit)})"
    return f"{name} {value}{limit}"


def joints_region(view: ReplaySummary, instead: str = "") -> str:
    """The leg with its joints; a sentence instead of them, where they are not known."""
    if instead:
        return _parts([Text(instead, is_not_valid=True)])
    views = joint_views(view)
    drawing, rows = leg_drawing(view, views), joint_rows(view, views)
    return render("replay/joints_and_leg.html", drawing=drawing.markup, rows=rows.markup)


def alarms_region(view: ReplaySummary) -> str:
    """Every alarm that is raised."""
    raised = [alarm_line(view, alarm) for alarm in view.alarms.now if alarm.level is not Level.OK]
    return render("replay/alarms.html", alarms=raised, advice=view.advice, otherwise="No alarm is raised.")


def belief_region(view: ReplaySummary) -> str:
    """Whether input, torque, cadence and model can be believed."""
    return belief(view).markup


def status_region(view: ReplaySummary) -> str:
    """All statuses in words."""
    rows = [(status.name, status.level.name, status.message) for status in view.status]
    return _parts([Table(caption="Statuses", head=("", "level", "message"), rows=rows, is_text=True)])


def trends_region(view: ReplaySummary, caption: str) -> str:
    """Charts of what is known over time; of what the verdict does not believe, why not."""
    timed = over_time(view)
    if len(timed.history.stamp_ns) < 2:
        return _parts([Text("There is nothing to draw yet.")])
    parts: list[Part] = [Text(caption)]
    if np.isfinite(timed.history.cadence_rpm).any():
        parts.append(health_chart(timed))
    if has_estimates(timed):
        parts.append(estimates_chart(timed))
    if _is_known(timed.history.clearance_m):
        parts += _unless_doubted(timed, Figure.CLEARANCES, "Counted clearances", openings_chart(timed))
    if _is_known(timed.history.peak_force_n):
        parts += _unless_doubted(timed, Figure.IMPACT_FORCES, "Impact forces", force_chart(timed))
    return _parts(parts)


def _is_known(columns: Mapping[str, Floats]) -> bool:
    return any(np.isfinite(values).any() for values in columns.values())


def _unless_doubted(view: ReplaySummary, figure: Figure, name: str, chart: Chart) -> list[Part]:
    doubt = not_valid(view.verdict, figure)
    return [Text(f"{name}: {doubt}", is_not_valid=True)] if doubt else [chart]


def _parts(parts: Sequence[Part]) -> str:
    return render("dashboard/parts.html", parts=parts)

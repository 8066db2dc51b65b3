"""The page of a replay, from its summary: a first screen that answers, and the rest folded below it."""

from leg_wear_monitor.monitor.alarms.words import time_words
from leg_wear_monitor.playback.result.recording import ReplayGait
from leg_wear_monitor.playback.result.replay_summary import ReplaySummary
from leg_wear_monitor.report.page import Page, Section, render, template_text
from leg_wear_monitor.report.parts import Fragment, Part, Sentences
from leg_wear_monitor.report.replay.alarm_section import change_section, raised_section
from leg_wear_monitor.report.replay.banner import verdict_banner
from leg_wear_monitor.report.replay.belief import belief
from leg_wear_monitor.report.replay.clearance_section import (
    clearance_section,
    clearance_sentences,
    encoder_sections,
)
from leg_wear_monitor.report.replay.force_section import force_section
from leg_wear_monitor.report.replay.forecast_section import forecast_section
from leg_wear_monitor.report.replay.health_section import health_section, recording_section
from leg_wear_monitor.report.replay.joint_rows import joint_rows
from leg_wear_monitor.report.replay.joint_view import joint_views
from leg_wear_monitor.report.replay.leg_drawing import leg_drawing
from leg_wear_monitor.report.replay.wear_section import wear_section
from leg_wear_monitor.report.replay.words import duration
from leg_wear_monitor.share import share_directory


def replay_page(summary: ReplaySummary) -> Page:
    """The page of a replay."""
    recording, monitor = summary.recording, summary.monitor
    sections = [_joints(summary), Section("Are these values valid?", [belief(summary)])]
    sections.append(raised_section(summary))
    if summary.gait.believable_cycles:
        sections += [clearance_section(summary), *encoder_sections(summary), forecast_section(summary)]
        sections += [force_section(summary), wear_section(summary)]
    sections += [change_section(summary), health_section(summary), recording_section(recording)]
    return Page(
        title=f"Joint wear of {monitor.hardware_id}",
        summary=f"{monitor.mechanism}: {duration(recording.duration_s)} from "
        f"{time_words(recording.begin_ns)}, {summary.cycles} gait cycles",
        sections=sections,
        versions=summary.made_with,
        banner=verdict_banner(summary, (share_directory() / summary.verdict.guide).as_uri()),
        styles=[template_text("uplot/uPlot.min.css"), template_text("replay/replay.css")],
        libraries=[template_text("uplot/uPlot.iife.min.js"), template_text("replay/charts.js")],
        has_dark=True,
    )


def _joints(summary: ReplaySummary) -> Section:
    """The leg's picture beside a row a joint, and what follows for the leg."""
    views = joint_views(summary)
    drawing, rows = leg_drawing(summary, views), joint_rows(summary, views)
    parts: list[Part] = [
        Fragment(render("replay/joints_and_leg.html", drawing=drawing.markup, rows=rows.markup))
    ]
    sentences = [*_gait_sentences(summary.gait), *clearance_sentences(summary)]
    if sentences:
        parts.append(Sentences(sentences))
    return Section("Joints", parts)


def _gait_sentences(gait: ReplayGait) -> list[str]:
    """Why there are no forces, if there are none."""
    if gait.is_counted:
        return ["All of it is in the ledger already, so no gait cycle was processed again."]
    if gait.believable_cycles:
        return []
    missing = [f"Missing: {gait.missing}."] if gait.missing else []
    return ["No gait cycle fits this leg, so forces and wear are not reported.", *missing]

"""The page of a replay, from its summary."""

import attrs
import numpy as np

from leg_wear_monitor.monitor.alarms.alarm import Level
from leg_wear_monitor.monitor.alarms.words import raised_words, time_words
from leg_wear_monitor.playback.result.recording import ReplayGait, ReplayRecording
from leg_wear_monitor.playback.result.replay_summary import ReplaySummary
from leg_wear_monitor.report.figures.figure import png
from leg_wear_monitor.report.figures.worn_bushings import worn_bushings
from leg_wear_monitor.report.page import Page, Part, Picture, Section, Sentences, Table, Text
from leg_wear_monitor.report.replay.charts import alarm_chart, clearance_chart, force_chart, health_chart
from leg_wear_monitor.report.replay.clearance_section import clearance_sections, clearance_sentences
from leg_wear_monitor.report.replay.forecast_section import counted_mm, forecast_section, leg_sentence
from leg_wear_monitor.report.replay.verdict_banner import verdict_banner
from leg_wear_monitor.wear.surfaces import Surfaces

_MOST_ROWS = 50


def replay_page(summary: ReplaySummary) -> Page:
    """The page of a replay."""
    recording, monitor = summary.recording, summary.monitor
    what = (
        f"{monitor.mechanism}, clearance joints {', '.join(monitor.clearance_joints)}: "
        f"{_time(recording.duration_s)} from "
        f"{time_words(recording.begin_ns)}, {summary.cycles} gait cycles. {summary.advice}"
    )
    sections = [Section("Results", [Sentences(_sentences(summary))]), _recording(recording)]
    if summary.gait.believable_cycles:
        sections += [_clearance(summary), *clearance_sections(summary.joints), forecast_section(summary)]
        sections += [_forces(summary), _wear(summary)]
    sections += [_alarms(summary), _health(summary)]
    title = f"Joint wear of {monitor.hardware_id}"
    return Page(
        title=title,
        summary=what,
        sections=sections,
        versions=summary.made_with,
        banner=verdict_banner(summary.verdict),
    )


def _sentences(summary: ReplaySummary) -> list[str]:
    """What to know first."""
    sentences = []
    if summary.recording.is_partial:
        sentences.append("The recording is damaged or incomplete: the results are from its readable part.")
    sentences += _gait_sentences(summary.gait)
    raised = [alarm for alarm in summary.alarms.now if alarm.level is not Level.OK]
    for alarm in raised:
        words = raised_words(alarm.state, alarm.worst, alarm.limit, alarm.unit, alarm.raised_ns)
        sentences.append(f"{alarm.name}: {alarm.level.name}, {words}.")
    if not raised:
        sentences.append("No alarm is raised at the end.")
    growing = {
        name: joint.growth_m_per_cycle
        for name, joint in summary.joints.items()
        if joint.growth_m_per_cycle is not None
    }
    if growing:
        fastest = max(growing, key=lambda name: growing[name])
        sentences.append(f"{fastest} wears fastest: {1.0e12 * growing[fastest]:.3g} pm a gait cycle.")
    sentences += leg_sentence(summary)
    sentences += clearance_sentences(summary.joints)
    factor = summary.monitor.wear_acceleration
    if factor != 1.0:
        sentences.append(f"All wear is multiplied by {factor:g}: a demonstration, not a measurement.")
    if summary.lost.unmonitored_s:
        sentences.append(f"{_time(summary.lost.unmonitored_s)} could not be followed and is not counted.")
    return sentences


def _gait_sentences(gait: ReplayGait) -> list[str]:
    """Why there are no forces, if there are none."""
    if gait.is_counted:
        return ["All of it is in the ledger already, so no gait cycle was processed again."]
    if gait.believable_cycles:
        return []
    missing = [f"Missing: {gait.missing}."] if gait.missing else []
    return ["No gait cycle fits this leg, so forces and wear are not reported.", *missing]


def _recording(recording: ReplayRecording) -> Section:
    rows = [
        ("files", ", ".join(recording.files)),
        ("topics", ", ".join(f"{name}: {topic}" for name, topic in recording.topics.items())),
        ("stamps", f"{recording.time} time"),
        ("crank samples", f"{recording.crank_samples}"),
        ("torque samples", f"{recording.torque_samples}"),
        ("begin", time_words(recording.begin_ns)),
        ("end", time_words(recording.end_ns)),
    ]
    parts: list[Part] = [Table(caption="Topics, time and samples", head=("", ""), rows=rows)]
    findings = [f"{each.file}: {each.text}" for each in recording.findings]
    if findings:
        more = len(findings) - _MOST_ROWS
        parts.append(Sentences(findings[:_MOST_ROWS] + ([f"and {more} more"] if more > 0 else [])))
    else:
        parts.append(Text("It was read completely, and all of its checksums are valid."))
    return Section("The recording", parts)


def _clearance(summary: ReplaySummary) -> Section:
    picture = Picture(
        image=png(clearance_chart(summary)),
        alt="Opening of each joint's mean radial clearance over time",
        caption="Mean radial clearance of each joint, minus its value after the first gait cycle.",
        wide=True,
    )
    head = ("joint", "counted clearance [mm]", "opened [nm]", "growth [pm/cycle]", "± [pm/cycle]")
    rows = []
    for name, joint in summary.joints.items():
        clearance = joint.clearance_m
        rows.append(
            (
                name,
                counted_mm(joint),
                _figure(1.0e9, clearance.last - clearance.first),
                _figure(1.0e12, joint.growth_m_per_cycle),
                _figure(1.0e12, joint.growth_error_m_per_cycle),
            )
        )
    table = Table(
        caption="Clearances at the end",
        head=head,
        rows=rows,
        note="Counted: the clearance when new plus the wear counted by the model since, in its "
        "significant digits. ± is the standard error of the growth; single gait cycles of a chaotic "
        "motion scatter.",
    )
    return Section("Clearance over time", [picture, table])


def _forces(summary: ReplaySummary) -> Section:
    picture = Picture(
        image=png(force_chart(summary)),
        alt="Peak and mean contact force of each joint over time",
        caption="Contact force in each gait cycle: peak (blue) and mean (black). Dashed: the limit, where it "
        "is near. Peaks are of a heavy tail; their scatter does not mean that the joint changes.",
        wide=True,
    )
    rows = [
        (
            name,
            _figure(1.0, joint.peak_force_n),
            _figure(1.0, joint.mean_force_n),
            str(joint.impacts),
        )
        for name, joint in summary.joints.items()
    ]
    table = Table(caption="Contact forces", head=("joint", "peak [N]", "mean [N]", "impacts"), rows=rows)
    return Section("Impact forces", [picture, table])


def _wear(summary: ReplaySummary) -> Section:
    wear = summary.wear_depth_m
    depth = np.array([[joint.bushing, joint.journal] for joint in wear.values()], float)
    radii = tuple(summary.monitor.bushing_radius_m[name] for name in wear)
    cycles = float(summary.history.cycle[-1])
    picture = Picture(
        image=png(worn_bushings(Surfaces(depth, 1), tuple(wear), radii, cycles)),
        alt="Wear depth around bushing and journal of each joint",
        caption="Wear around each bushing and journal, from the start of the ledger, or of the replay if "
        "none was continued. The depth is magnified by the factor above; angles in each body's own "
        "frame.",
        wide=True,
    )
    return Section("Wear around each bushing", [picture])


def _alarms(summary: ReplaySummary) -> Section:
    changes = summary.alarms.changes
    if not changes:
        return Section("Alarms", [Text("No alarm was raised.")])
    begin = summary.recording.begin_ns
    rows = [
        (
            f"{(change.stamp_ns - begin) / 1.0e9:.2f}",
            change.alarm.name,
            change.alarm.level.name,
            change.alarm.state,
            _figure(1.0, change.alarm.value),
            f"{_figure(1.0, change.alarm.limit)} {change.alarm.unit}".strip(),
        )
        for change in changes[:_MOST_ROWS]
    ]
    more = len(changes) - _MOST_ROWS
    table = Table(
        caption="Changes of alarms",
        head=("time [s]", "alarm", "level", "state", "value", "limit"),
        rows=rows,
        note=f"{more} more are in summary.json." if more > 0 else "",
    )
    picture = Picture(image=png(alarm_chart(summary)), alt="Levels of alarms over time", wide=True)
    return Section("Alarms", [picture, table])


def _health(summary: ReplaySummary) -> Section:
    lost = {**attrs.asdict(summary.lost), **summary.lost.faulty}
    rows = [
        (name.replace("_", " "), _figure(1.0, value))
        for name, value in lost.items()
        if not isinstance(value, dict)
    ]
    parts: list[Part] = []
    if summary.cycles:
        chart = Picture(
            image=png(health_chart(summary)),
            alt="Cadence, drive torque and torque mismatch over time",
            caption="Cadence with the commanded one dashed; measured and predicted drive torque; the "
            "fraction that load, friction and lag do not explain, with its limit.",
            wide=True,
        )
        parts.append(chart)
    parts.append(Table(caption="Unused samples and lost time", head=("", "number"), rows=rows))
    status = [(each.name, each.level.name, each.message) for each in summary.status]
    parts.append(Table(caption="State at the end", head=("", "level", "message"), rows=status))
    return Section("Input health", parts)


def _figure(factor: float, value: float | None) -> str:
    return "-" if value is None else f"{factor * value:.4g}"


def _time(seconds: float) -> str:
    if seconds < 120.0:
        return f"{seconds:.3g} s"
    return f"{seconds / 60.0:.3g} min" if seconds < 7200.0 else f"{seconds / 3600.0:.3g} h"

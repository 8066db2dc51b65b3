"""The input over time, samples that were not used, the state at the end, and the recording."""

import attrs

from leg_wear_monitor.monitor.alarms.words import time_words
from leg_wear_monitor.playback.result.recording import ReplayRecording
from leg_wear_monitor.playback.result.replay_summary import ReplaySummary
from leg_wear_monitor.report.page import Section
from leg_wear_monitor.report.parts import Part, Sentences, Table, Text
from leg_wear_monitor.report.replay.alarm_section import MOST_ROWS
from leg_wear_monitor.report.replay.charts import health_chart
from leg_wear_monitor.report.replay.words import duration, value


def health_section(summary: ReplaySummary) -> Section:
    """Chart and tables."""
    lost = {**attrs.asdict(summary.lost), **summary.lost.faulty}
    rows = [
        (name.replace("_", " "), value(1.0, number))
        for name, number in lost.items()
        if not isinstance(number, dict)
    ]
    parts: list[Part] = [health_chart(summary)] if summary.cycles else []
    if summary.sampling:
        sampled = [
            (name.replace("_", " "), value(1.0, number))
            for name, number in attrs.asdict(summary.sampling).items()
        ]
        parts.append(Table(caption="Sampled replay", head=("", "number"), rows=sampled))
    if any(load.about_n for load in summary.walked):
        walked = [
            (f"{load.mean_n:.0f} ± {load.sigma_n:.0f}", f"{load.cycles}", duration(load.moving_s))
            for load in summary.walked
        ]
        head = ("largest vertical force of a gait cycle [N]", "gait cycles", "time")
        parts.append(Table(caption="Walking under foot loads", head=head, rows=walked))
    parts.append(Table(caption="Unused samples and lost time", head=("", "number"), rows=rows))
    status = [(each.name, each.level.name, each.message) for each in summary.status]
    parts.append(Table(caption="State at the end", head=("", "level", "message"), rows=status, is_text=True))
    return Section("Input health", parts, is_folded=True)


def recording_section(recording: ReplayRecording) -> Section:
    """Files, topics, times, and what was wrong with them."""
    rows = [
        ("files", ", ".join(recording.files)),
        ("topics", ", ".join(f"{name}: {topic}" for name, topic in recording.topics.items())),
        ("stamps", f"{recording.time} time"),
        ("crank samples", f"{recording.crank_samples}"),
        ("torque samples", f"{recording.torque_samples}"),
        ("begin", time_words(recording.begin_ns)),
        ("end", time_words(recording.end_ns)),
    ]
    parts: list[Part] = [Table(caption="Topics, time and samples", head=("", ""), rows=rows, is_text=True)]
    findings = [f"{each.file}: {each.text}" for each in recording.findings]
    if findings:
        more = len(findings) - MOST_ROWS
        parts.append(Sentences(findings[:MOST_ROWS] + ([f"and {more} more"] if more > 0 else [])))
    else:
        parts.append(Text("It was read completely, and all of its checksums are valid."))
    return Section("The recording", parts, is_folded=True)

"""The page of a replay, from its summary: the answer on the first screen, and the rest folded below."""

import attrs

from leg_wear_monitor.files import or_nan, share_directory
from leg_wear_monitor.monitor.alarm_specs import KINDS, QUANTITIES
from leg_wear_monitor.monitor.alarms import amount, duration, joint_of, raised_values, time_words
from leg_wear_monitor.monitor.verdict.situation import COUNTED
from leg_wear_monitor.monitor.verdict.verdict import figures_of, guide_to, how_sure
from leg_wear_monitor.recordings.result import (
    ReplayGait,
    ReplayRecording,
    ReplaySummary,
)
from leg_wear_monitor.report.guide import enclosed
from leg_wear_monitor.report.page import (
    LEVEL_LOOKS,
    NOT_VALID,
    Fragment,
    Page,
    Part,
    Section,
    Sentences,
    Table,
    Text,
    is_of_recording,
    not_valid,
    reason,
    render,
    since_words,
    value,
    verdict_banner,
)
from leg_wear_monitor.report.replay.charts import (
    forecast_section,
    health_chart,
    joint_section,
    wear_section,
)
from leg_wear_monitor.report.replay.joints import joints_and_leg
from leg_wear_monitor.state import AlarmChange, Figure, JointClearance, LegAlarm, Level

# Alarms: those that are raised at the end, and all changes over time.


MOST_ROWS = 50


def raised_alarms(summary: ReplaySummary, otherwise: str) -> str:
    """Markup of every raised alarm, or a sentence that no alarm is raised."""
    raised = [_raised(summary, alarm) for alarm in summary.alarms.now if alarm.level is not Level.OK]
    return render("replay/alarms.html", alarms=raised, advice=summary.advice, otherwise=otherwise)


def _raised(summary: ReplaySummary, alarm: LegAlarm) -> dict[str, str]:
    """A raised alarm as a sentence, without its value if the verdict marks it as not valid."""
    symbol, look = LEVEL_LOOKS[alarm.level]
    joint = joint_of(alarm.name)
    name = f"{alarm.name.removesuffix(joint)}{summary.leg.joint_words(joint)}" if joint else alarm.name
    by = _source(summary.clearances.get(joint), alarm.worst) if alarm.name == f"clearance {joint}" else None
    values = raised_values(alarm.state, alarm.worst, alarm.limit, alarm.unit, by)
    doubt = _alarm_doubt(summary, alarm)
    return {
        "symbol": symbol,
        "look": look,
        "title": f"{alarm.level.name} {name}",
        "quantity": QUANTITIES.get(alarm.name, QUANTITIES.get(alarm.name.partition(" ")[0], "")),
        "words": alarm.state if doubt else values,
        "doubt": doubt,
        "since": f"since {since_words(summary, alarm.raised_ns)}",
    }


def _source(known: JointClearance | None, clearance_m: float | None) -> str | None:
    """Source of an alarm's clearance; the verdict may rest on a different source by now."""
    if known is None or clearance_m is None:
        return None
    sources = [
        (known.best_estimate_m, known.best_estimate_source),
        *((known.estimated_m, by) for by in known.estimated_by),
    ]
    return next((by for value_m, by in sources if value_m == clearance_m), None)


def _alarm_doubt(summary: ReplaySummary, alarm: LegAlarm) -> str:
    """Why the value of an alarm is invalid: an estimate, or the reason of a verdict; else empty."""
    if alarm.name in (each.name for each in summary.verdict.evidence[:1]):
        return ""
    kind, _, subject = alarm.name.partition(" ")
    figure, clearance = KINDS[kind].figure if kind in KINDS else None, summary.clearances.get(subject)
    if figure is Figure.CLEARANCES and clearance and clearance.best_estimate_source not in (None, COUNTED):
        return ""
    return not_valid(summary.verdict, figure) if figure else ""


def change_section(summary: ReplaySummary) -> Section:
    """Table of the changes."""
    title, changes = "Changes of alarms", summary.alarms.changes
    if not changes:
        return Section(title, [Text("No alarm was raised in the recording.")], is_folded=True)
    more = len(changes) - MOST_ROWS
    table = Table(
        caption=title,
        head=("time [s]", "alarm", "level", "state", "value", "limit"),
        rows=[_row(summary, change) for change in changes[:MOST_ROWS]],
        note=f"{more} more are in summary.json." if more > 0 else "",
    )
    return Section(title, [table], is_folded=True)


def _row(summary: ReplaySummary, change: AlarmChange) -> tuple[str, ...]:
    alarm = change.alarm
    is_valid = not _alarm_doubt(summary, alarm)
    return (
        f"{(change.stamp_ns - summary.recording.begin_ns) / 1.0e9:.2f}",
        alarm.name,
        alarm.level.name,
        alarm.state,
        amount(or_nan(alarm.value), alarm.unit) if is_valid else NOT_VALID,
        amount(or_nan(alarm.limit), alarm.unit),
    )


# The input over time, samples that were not used, the state at the end, and the recording.


def health_section(summary: ReplaySummary) -> Section:
    """Chart and tables."""
    parts: list[Part] = [health_chart(summary)] if summary.cycles else []
    lost = {**attrs.asdict(summary.lost), **summary.lost.faulty}
    del lost["faulty"]
    parts.append(_numbers("Unused samples and lost time", lost))
    status = [(each.name, each.level.name, each.message) for each in summary.status]
    parts.append(Table(caption="State at the end", head=("", "level", "message"), rows=status, is_text=True))
    return Section("Input health", parts, is_folded=True)


def _numbers(caption: str, numbers: dict[str, float]) -> Table:
    rows = [(name.replace("_", " "), value(1.0, number)) for name, number in numbers.items()]
    return Table(caption=caption, head=("", "number"), rows=rows)


def recording_section(recording: ReplayRecording) -> Section:
    """Files, topics and times, and their faults."""
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
        parts.append(Text("The recording was read completely."))
    return Section("The recording", parts, is_folded=True)


# Basis of the verdict: its guide, and how often such a verdict is right.


_MEASURE = "docs/howto/measure_clearance.md"


def guide_sections(summary: ReplaySummary) -> list[Section]:
    """Step-by-step instructions, folded: the guide of the verdict, and how to measure a clearance.

    The page contains them, because it may be read where the package is not installed.
    """
    guides = [enclosed(share_directory() / name) for name in (guide_to(summary.verdict), _MEASURE)]
    return [
        Section(f"Guide: {title}", [Fragment(f'<div class="guide">{markup}</div>')], is_folded=True)
        for title, markup in guides
    ]


def certainty_section(summary: ReplaySummary) -> Section:
    """The data used to measure the verdict's certainty."""
    rows = [(each.counted, each.words, each.where, each.date, each.source) for each in figures_of(summary)]
    table = Table(
        caption="How often such verdicts were right in tests with a known truth",
        head=("cases", "", "measured on", "date", "page of the package"),
        rows=rows,
        note="Nothing was measured on a real leg.",
        is_text=True,
    )
    unknown = Text(how_sure(summary))
    return Section("How sure is the verdict?", [table if rows else unknown], is_folded=True)


# Validity of the page's values: input, torque, cadence, foot load and model, each in a card.


_ANSWERS = {Level.OK: "yes", Level.WARN: "in part", Level.ERROR: "no"}
_OF_STATUS = {"input": "Input", "torque": "Torque", "gait": "Cadence", "foot_load": "Foot load"}


def belief(summary: ReplaySummary) -> str:
    """Markup of the cards: the statuses of these names, and what the verdict says of the model."""
    found = [
        (_OF_STATUS[status.name], status.level, [status.message])
        for status in summary.status
        if status.name in _OF_STATUS
    ]
    cards = [
        {
            "name": name,
            "look": LEVEL_LOOKS[level],
            "answer": _ANSWERS[level],
            "sentences": [f"{part[:1].upper()}{part[1:]}." for part in why],
        }
        for name, level, why in [*found, _model(summary)]
    ]
    return render("replay/belief.html", cards=cards)


def _model(summary: ReplaySummary) -> tuple[str, Level, list[str]]:
    """The model's card: its name, whether its values are valid, and why."""
    invalid, gait, factor = summary.verdict.not_valid, summary.gait, summary.monitor.wear_acceleration
    if not gait.believable_cycles and not gait.is_counted:
        return "Model", Level.ERROR, [f"no gait cycle fits this leg: {gait.missing}"]
    doubts = []
    if invalid:
        doubts = [reason(summary.verdict), "not valid: " + ", ".join(each.words for each in invalid)]
    if gait.doubtful_cycles:
        doubts.append(f"{gait.doubtful_cycles} gait cycles do not fit this leg")
    if factor != 1.0:
        doubts.append(f"all wear is multiplied by {factor:g}: a demonstration, not a measurement")
    level = Level.ERROR if Figure.CLEARANCES in invalid else Level.WARN if doubts else Level.OK
    return "Model", level, doubts or ["the gait cycles fit this leg"]


def _notes(summary: ReplaySummary) -> list[Part]:
    """Notes that the verdict is later than the recording, and that this is damaged; nothing if neither is."""
    notes = []
    if not is_of_recording(summary):
        notes.append(
            "The verdict uses ledger entries or measurements that are newer than this recording; input, "
            "torque, cadence, growth and forces are from the recording."
        )
    if summary.recording.is_partial:
        notes.append("The recording is damaged or incomplete: only its readable part is used.")
    return [Text(note) for note in notes]


def replay_page(summary: ReplaySummary) -> Page:
    """The page of a replay."""
    recording, monitor = summary.recording, summary.monitor
    valid = [*_notes(summary), Fragment(belief(summary))]
    sections = [_joints(summary), Section("Are these values valid?", valid)]
    raised = raised_alarms(summary, otherwise="No alarm is raised at the end.")
    sections += [Section("Alarms", [Fragment(raised)])]
    shown = len(sections)
    if summary.gait.believable_cycles:
        sections += [joint_section(summary), forecast_section(summary), wear_section(summary)]
    sections += [change_section(summary), health_section(summary), recording_section(recording)]
    guides, sure = guide_sections(summary), certainty_section(summary)
    return Page(
        title=f"Joint wear of {monitor.hardware_id}",
        summary=f"{monitor.mechanism}: {duration(recording.duration_s)} from "
        f"{time_words(recording.begin_ns)}, {summary.cycles} gait cycles",
        sections=[*sections[:shown], *guides, sure, *sections[shown:]],
        versions=summary.made_with,
        banner=verdict_banner(summary, f"#{guides[0].anchor}", f"#{sure.anchor}"),
        styles=("uplot/uPlot.min.css", "replay/replay.css", "guide.css"),
        libraries=("uplot/uPlot.iife.min.js", "replay/charts.js"),
        has_dark=True,
    )


def _joints(summary: ReplaySummary) -> Section:
    """The leg's picture next to one row per joint, and the consequences for the leg."""
    parts: list[Part] = [Fragment(joints_and_leg(summary))]
    sentences = _gait_sentences(summary.gait)
    if sentences:
        parts.append(Sentences(sentences))
    return Section("Joints", parts)


def _gait_sentences(gait: ReplayGait) -> list[str]:
    """Reason why there are no forces, if there are none."""
    if gait.is_counted:
        return ["The ledger already contains this recording, so no gait cycle was processed again."]
    if gait.believable_cycles:
        return []
    missing = [f"Missing: {gait.missing}."] if gait.missing else []
    return ["No gait cycle fits this leg, so the page has no forces and no wear.", *missing]

"""The page of a replay, from its summary: a first screen that answers, and the rest folded below it."""

from collections.abc import Sequence
from typing import Any

import attrs

from leg_wear_monitor.monitor.alarms import time_words
from leg_wear_monitor.playback.result import (
    Place,
    ReplayGait,
    ReplayLeg,
    ReplayRecording,
    ReplayStatus,
    ReplaySummary,
)
from leg_wear_monitor.report.page import (
    NOT_VALID,
    Fragment,
    Page,
    Part,
    Section,
    Sentences,
    Table,
    Text,
    alarm_doubt,
    alarm_line,
    duration,
    reason,
    render,
    template_text,
    value,
    verdict_banner,
)
from leg_wear_monitor.report.replay.charts import (
    alarm_chart,
    clearance_section,
    clearance_sentences,
    encoder_sections,
    force_section,
    health_chart,
)
from leg_wear_monitor.report.replay.decision_sections import certainty_section, guide_sections
from leg_wear_monitor.report.replay.forecast_section import forecast_section, wear_section
from leg_wear_monitor.report.replay.joint_rows import JointView, joint_rows, joint_views
from leg_wear_monitor.state import AlarmChange, Figure, Level

# Alarms: those that are raised at the end, and all changes over time.


MOST_ROWS = 50
_MOST_DRAWN = 1000  # changes in the chart


def raised_section(summary: ReplaySummary) -> Section:
    """Every alarm that is raised at the end; never folded."""
    raised = [alarm_line(summary, alarm) for alarm in summary.alarms.now if alarm.level is not Level.OK]
    return Section("Alarms", [Fragment(render("replay/alarms.html", alarms=raised, advice=summary.advice))])


def change_section(summary: ReplaySummary) -> Section:
    """Chart and table of the changes."""
    title, changes = "Changes of alarms", summary.alarms.changes
    if not changes:
        return Section(title, [Text("No alarm was raised.")], is_folded=True)
    more = len(changes) - MOST_ROWS
    table = Table(
        caption=title,
        head=("time [s]", "alarm", "level", "state", "value", "limit"),
        rows=[_row(summary, change) for change in changes[:MOST_ROWS]],
        note=f"{more} more are in summary.json." if more > 0 else "",
    )
    return Section(title, [alarm_chart(summary, changes[:_MOST_DRAWN]), table], is_folded=True)


def _row(summary: ReplaySummary, change: AlarmChange) -> tuple[str, ...]:
    alarm = change.alarm
    is_valid = not alarm_doubt(summary, alarm)
    return (
        f"{(change.stamp_ns - summary.recording.begin_ns) / 1.0e9:.2f}",
        alarm.name,
        alarm.level.name,
        alarm.state,
        value(1.0, alarm.value) if is_valid else NOT_VALID,
        f"{value(1.0, alarm.limit)} {alarm.unit}".strip(),
    )


# The input over time, samples that were not used, the state at the end, and the recording.


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


# Whether the page's figures can be believed: input, torque, cadence and model, each in a card.


_LOOKS = {"yes": ("✓", "fine"), "in part": ("▲", "careful"), "no": ("■", "bad")}
_OF_LEVEL = {Level.OK: "yes", Level.WARN: "in part", Level.ERROR: "no"}
_MOST_SENTENCES = 3


@attrs.frozen
class Card:
    """One question: its name, the answer ``yes``, ``in part`` or ``no``, and why."""

    name: str
    answer: str
    sentences: tuple[str, ...]

    @property
    def symbol(self) -> str:
        """Says what the colour says."""
        return _LOOKS[self.answer][0]

    @property
    def look(self) -> str:
        """Class of its colour."""
        return _LOOKS[self.answer][1]


def belief(summary: ReplaySummary) -> Fragment:
    """The cards."""
    cards = [_input(summary), _torque(summary), _cadence(summary), *_foot_load(summary), _model(summary)]
    return Fragment(render("replay/belief.html", cards=cards))


def _status(summary: ReplaySummary, name: str) -> ReplayStatus | None:
    return next((status for status in summary.status if status.name == name), None)


def _worst(*answers: str) -> str:
    return max(answers, key=list(_LOOKS).index)


def _input(summary: ReplaySummary) -> Card:
    status, answers, sentences = _status(summary, "input"), ["yes"], []
    if status:
        answers.append(_OF_LEVEL[status.level])
        told = [part for part in status.message.split("; ") if not part.startswith("see: ")]
        sentences += told[:_MOST_SENTENCES]
        if len(told) > _MOST_SENTENCES:
            sentences.append(f"{len(told) - _MOST_SENTENCES} more below")
    if summary.recording.is_partial:
        answers.append("in part")
        sentences.append("the recording is damaged or incomplete: only its readable part is used")
    if summary.lost.unmonitored_s > 1.0:
        answers.append("in part")
        sentences.append(f"{duration(summary.lost.unmonitored_s)} were not monitored")
    return Card("Input", _worst(*answers), _sentences(sentences))


def _torque(summary: ReplaySummary) -> Card:
    status = _status(summary, "torque")
    if status is None:
        return Card("Torque", "no", ("Unknown.",))
    is_compared = status.values.get("mismatch") is not None
    answer = _OF_LEVEL[status.level] if is_compared else "no"
    return Card("Torque", answer, _sentences(status.message.split("; ")))


def _cadence(summary: ReplaySummary) -> Card:
    status, commanded = _status(summary, "gait"), summary.monitor.commanded_rpm
    cadence = status.values.get("cadence_rpm") if status else None
    if status is None or cadence is None:
        return Card("Cadence", "no", ("Unknown.",))
    is_other = summary.verdict.fault_code == "CADENCE"
    answer = _worst(_OF_LEVEL[status.level], "in part" if is_other else "yes")
    if not summary.gait.believable_cycles:
        answer = "no"
    return Card("Cadence", answer, (f"{cadence:.3g} rpm, commanded {commanded:.3g} rpm.",))


def _foot_load(summary: ReplaySummary) -> list[Card]:
    """What the foot carries; nothing where no load is known."""
    load = summary.load
    if load.peak_n is None:
        return []
    source = "measured" if load.source == "measured" else "estimated from the drive torque"
    sigma = f" ± {load.peak_sigma_n:.0f}" if load.peak_sigma_n is not None else ""
    return [Card("Foot load", "yes", _sentences([f"{source}: {load.peak_n:.0f}{sigma} N at its peak"]))]


def _model(summary: ReplaySummary) -> Card:
    invalid = summary.verdict.not_valid
    if not summary.gait.believable_cycles and not summary.gait.is_counted:
        return Card("Model", "no", _sentences([f"no gait cycle fits this leg: {summary.gait.missing}"]))
    sentences, answer = [], "yes"
    if invalid:
        answer = "no" if Figure.CLEARANCES in invalid else "in part"
        sentences = [reason(summary.verdict), "not valid: " + ", ".join(each.words for each in invalid)]
    elif explained := _explained(summary):
        sentences = [explained]
    else:
        answer, sentences = "in part", ["no measurement is compared with it"]
    if summary.gait.doubtful_cycles:
        answer = _worst(answer, "in part")
        sentences.append(f"{summary.gait.doubtful_cycles} gait cycles do not fit this leg")
    if summary.monitor.wear_acceleration != 1.0:
        answer = _worst(answer, "in part")
        factor = summary.monitor.wear_acceleration
        sentences.append(f"all wear is multiplied by {factor:g}: a demonstration, not a measurement")
    return Card("Model", answer, _sentences(sentences))


def _explained(summary: ReplaySummary) -> str:
    """What of the drive torque the model explains; empty if that is not known."""
    torque = _status(summary, "torque")
    mismatch = torque.values.get("mismatch") if torque else None
    if mismatch is None:
        return ""
    limit = 100.0 * summary.monitor.limits.torque_mismatch
    return f"{100.0 * mismatch:.2g} % of the drive torque is not explained (limit {limit:.3g} %)"


def _sentences(parts: Sequence[str]) -> tuple[str, ...]:
    return tuple(f"{part[:1].upper()}{part[1:]}." for part in parts if part)


# The leg as an inline drawing, its clearance joints marked by how much of their limit is used.


_WIDTH, _LABELS = 400.0, 176.0  # of the drawing, and of the column of labels at its right
_MARGIN = 20.0
_TALLEST = 400.0
_LABEL_HEIGHT = 40.0
_APART = 11.0  # joints at one place are drawn side by side
_NEAR_M = 1.0e-3


@attrs.frozen(kw_only=True)
class _Mark:
    """A clearance joint: its place, that of its label, and its words."""

    view: JointView
    x: float
    y: float
    label_x: float
    label_y: float
    words: str


class _Plane:
    """From the leg's plane [m], y up, to the drawing's, y down."""

    def __init__(self, leg: ReplayLeg) -> None:
        places = [place for shape in leg.bodies_m.values() for place in shape]
        places += [joint.place_m for joint in leg.joints.values()]
        xs, ys = ([place[k] for place in places] for k in (0, 1))
        wide, tall = max(xs) - min(xs), max(ys) - min(ys)
        room = _WIDTH - _LABELS - 2.0 * _MARGIN
        self._scale = min(room / max(wide, 1.0e-6), (_TALLEST - 2.0 * _MARGIN) / max(tall, 1.0e-6))
        self._left, self._top = min(xs), max(ys)
        self.height = max(self._scale * tall + 2.0 * _MARGIN, 160.0)

    def at(self, place: Place) -> Place:
        x, y = place
        return (
            round(_MARGIN + self._scale * (x - self._left), 1),
            round(_MARGIN + self._scale * (self._top - y), 1),
        )


def leg_drawing(summary: ReplaySummary, views: Sequence[JointView]) -> Fragment:
    """The drawing; a note instead for a summary without the leg's shape."""
    leg = summary.leg
    if not leg.bodies_m or not leg.joints:
        return Fragment(render("replay/leg.html", drawing=None))
    plane, shown = _Plane(leg), {view.joint for view in views}
    marks = _marks(plane, leg, [view for view in views if view.joint in leg.joints])
    height = max([plane.height, *(mark.label_y + _LABEL_HEIGHT / 2.0 for mark in marks)])
    drawing: dict[str, Any] = {
        "width": _WIDTH,
        "height": height,
        "bodies": [[plane.at(place) for place in shape] for shape in _largest_first(leg)],
        "supports": sorted({plane.at(joint.place_m) for joint in leg.joints.values() if joint.is_on_ground}),
        "ideal": [plane.at(joint.place_m) for name, joint in leg.joints.items() if name not in shown],
        "marks": marks,
        "title": f"The leg {summary.monitor.mechanism}: " + "; ".join(_spoken(mark) for mark in marks),
    }
    return Fragment(render("replay/leg.html", drawing=drawing))


def _largest_first(leg: ReplayLeg) -> list[tuple[Place, ...]]:
    def size(shape: tuple[Place, ...]) -> float:
        return sum(max(place[k] for place in shape) - min(place[k] for place in shape) for k in (0, 1))

    return sorted(leg.bodies_m.values(), key=lambda shape: -size(shape))


def _marks(plane: _Plane, leg: ReplayLeg, views: Sequence[JointView]) -> list[_Mark]:
    """Marks with their labels in a column, from the highest joint to the lowest, and not over each other."""
    placed = [(view, _beside(plane, leg, view, views)) for view in views]
    placed.sort(key=lambda each: each[1][1])
    marks, below = [], 0.0
    room = plane.height - _LABEL_HEIGHT * len(placed)
    for k, (view, (x, y)) in enumerate(placed):
        latest = max(0.0, room) + _LABEL_HEIGHT * (k + 0.5)
        label_y = max(below + _LABEL_HEIGHT / 2.0, min(y, latest))
        below = label_y + _LABEL_HEIGHT / 2.0
        label_x = _WIDTH - _LABELS + 14.0
        marks.append(_Mark(view=view, x=x, y=y, label_x=label_x, label_y=label_y, words=_words(view)))
    return marks


def _beside(plane: _Plane, leg: ReplayLeg, view: JointView, views: Sequence[JointView]) -> Place:
    """A joint's place; joints that share one stand side by side."""
    here = leg.joints[view.joint].place_m
    there = [other.joint for other in views if _is_near(leg.joints[other.joint].place_m, here)]
    x, y = plane.at(here)
    return x + _APART * (2.0 * there.index(view.joint) - len(there) + 1.0), y


def _is_near(one: Place, other: Place) -> bool:
    return max(abs(one[0] - other[0]), abs(one[1] - other[1])) < _NEAR_M


def _words(view: JointView) -> str:
    if view.clearance is None or view.shown_m is None:
        return "not valid" if view.doubt.startswith("not valid") else "not known"
    if view.used is None:
        return "not monitored"
    if view.used >= 1.0:
        return f"{1.0e3 * view.shown_m:.3g} mm, limit {1.0e3 * view.clearance.limit_m:.3g} mm"
    if view.look == "over":  # the verdict says so, and is newer than the joint's last report
        return "at its limit, see the verdict"
    return f"{100.0 * view.used:.0f} % used"


def _spoken(mark: _Mark) -> str:
    label = f" ({mark.view.label})" if mark.view.label else ""
    return f"joint {mark.view.joint}{label} {mark.words}"


def replay_page(summary: ReplaySummary) -> Page:
    """The page of a replay."""
    recording, monitor = summary.recording, summary.monitor
    sections = [_joints(summary), Section("Are these values valid?", [belief(summary)])]
    sections.append(raised_section(summary))
    if summary.gait.believable_cycles:
        sections += [clearance_section(summary), *encoder_sections(summary), forecast_section(summary)]
        sections += [force_section(summary), wear_section(summary)]
    sections += [change_section(summary), health_section(summary), recording_section(recording)]
    guides, sure = guide_sections(summary), certainty_section(summary)
    return Page(
        title=f"Joint wear of {monitor.hardware_id}",
        summary=f"{monitor.mechanism}: {duration(recording.duration_s)} from "
        f"{time_words(recording.begin_ns)}, {summary.cycles} gait cycles",
        sections=[*sections[:3], *guides, sure, *sections[3:]],
        versions=summary.made_with,
        banner=verdict_banner(summary, f"#{guides[0].anchor}", f"#{sure.anchor}"),
        styles=[
            template_text("uplot/uPlot.min.css"),
            template_text("replay/replay.css"),
            template_text("guide.css"),
        ],
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

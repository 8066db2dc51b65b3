"""Whether the page's figures can be believed: input, torque, cadence and model, each in a card."""

from collections.abc import Sequence

import attrs

from leg_wear_monitor.monitor.alarms.alarm import Level
from leg_wear_monitor.monitor.verdict.verdict import Figure
from leg_wear_monitor.playback.result.parts import ReplayStatus
from leg_wear_monitor.playback.result.replay_summary import ReplaySummary
from leg_wear_monitor.report.page import render
from leg_wear_monitor.report.parts import Fragment
from leg_wear_monitor.report.replay.words import duration, reason

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
    cards = [_input(summary), _torque(summary), _cadence(summary), _model(summary)]
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

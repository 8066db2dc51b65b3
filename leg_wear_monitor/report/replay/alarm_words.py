"""Alarms in words, without values that the verdict does not believe."""

import attrs

from leg_wear_monitor.monitor.alarms.alarm import Level
from leg_wear_monitor.monitor.alarms.words import raised_words
from leg_wear_monitor.monitor.verdict.alarm_rules import OF_A_JOINT
from leg_wear_monitor.monitor.verdict.belief import COUNTED
from leg_wear_monitor.monitor.verdict.verdict import Figure
from leg_wear_monitor.playback.result.parts import ReplayAlarm
from leg_wear_monitor.playback.result.replay_summary import ReplaySummary
from leg_wear_monitor.report.replay.words import not_valid, since_words

LOOKS = {Level.OK: ("✓", "fine"), Level.WARN: ("▲", "careful"), Level.ERROR: ("■", "bad")}

_FIGURES = {
    "impact_force": Figure.IMPACT_FORCES,
    "clearance": Figure.CLEARANCES,
    "growth": Figure.GROWTH,
    "remaining_life": Figure.FORECAST,
}


@attrs.frozen(kw_only=True)
class AlarmLine:
    """A raised alarm.

    Attributes
    ----------
    symbol, look, level, name : str
        Symbol and class of its level, the level, and the name with the joint's label.
    short : str
        Level and kind, for the row of its joint.
    words : str
        State, worst value and limit.
    doubt : str
        Why its value does not hold; empty if it does.
    since : str
    """

    symbol: str
    look: str
    level: str
    name: str
    short: str
    words: str
    doubt: str
    since: str


def alarm_line(summary: ReplaySummary, alarm: ReplayAlarm) -> AlarmLine:
    """A raised alarm in words."""
    symbol, look = LOOKS[alarm.level]
    kind, _, subject = alarm.name.partition(" ")
    name = f"{kind} {summary.leg.joint_words(subject)}" if kind in OF_A_JOINT else alarm.name
    doubt = alarm_doubt(summary, alarm)
    words = raised_words(alarm.state, alarm.worst, alarm.limit, alarm.unit, alarm.raised_ns)
    return AlarmLine(
        symbol=symbol,
        look=look,
        level=alarm.level.name,
        name=name,
        short=f"{alarm.level.name} {kind}",
        words=alarm.state if doubt else words.rpartition(", since ")[0],
        doubt=doubt,
        since=f"since {since_words(summary, alarm.raised_ns)}",
    )


def alarm_doubt(summary: ReplaySummary, alarm: ReplayAlarm) -> str:
    """Why the value of an alarm does not hold; empty if it does: that of an estimate does."""
    kind, _, subject = alarm.name.partition(" ")
    figure, clearance = _FIGURES.get(kind), summary.clearances.get(subject)
    if figure is Figure.CLEARANCES and clearance and clearance.believed_by not in (None, COUNTED):
        return ""
    return not_valid(summary.verdict, figure) if figure else ""

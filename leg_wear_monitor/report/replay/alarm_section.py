"""Alarms: those that are raised at the end, and all changes over time."""

from leg_wear_monitor.monitor.alarms.alarm import Level
from leg_wear_monitor.playback.result.parts import AlarmChange
from leg_wear_monitor.playback.result.replay_summary import ReplaySummary
from leg_wear_monitor.report.page import Section, render
from leg_wear_monitor.report.parts import Fragment, Table, Text
from leg_wear_monitor.report.replay.alarm_words import alarm_doubt, alarm_line
from leg_wear_monitor.report.replay.charts import alarm_chart
from leg_wear_monitor.report.replay.words import NOT_VALID, value

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

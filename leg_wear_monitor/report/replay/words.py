"""Words that the parts of the page share: what is not valid and why, joints, times, values."""

from leg_wear_monitor.monitor.alarms.words import time_words
from leg_wear_monitor.monitor.verdict.verdict import Figure, State, Verdict
from leg_wear_monitor.playback.result.replay_summary import ReplaySummary

NOT_VALID = "not valid"


def not_valid(verdict: Verdict, *figures: Figure) -> str:
    """Why one of some figures does not hold, without a number; empty if all hold."""
    if not set(figures) & set(verdict.not_valid):
        return ""
    return f"{NOT_VALID}: {reason(verdict)}"


def reason(verdict: Verdict) -> str:
    """Why the values of a verdict's list are not valid, in general words."""
    if Figure.CLEARANCES in verdict.not_valid:
        return "leg differs from its model"
    return "leg not monitored" if verdict.state is State.NOT_MONITORED else "see the verdict"


def joints_words(summary: ReplaySummary) -> str:
    """The joints of the verdict with their labels, such as ``joint G (knee)``; empty without any."""
    joints = ", ".join(map(summary.leg.joint_words, summary.verdict.joints))
    return f"joint {joints}" if joints else ""


def since_words(summary: ReplaySummary, stamp_ns: int) -> str:
    """A stamp, and when in the recording that was."""
    begin, end = summary.recording.begin_ns, summary.recording.end_ns
    if not begin <= stamp_ns <= end:
        return time_words(stamp_ns)
    return f"{time_words(stamp_ns)}, {duration((stamp_ns - begin) / 1.0e9)} after the recording's begin"


def duration(seconds: float) -> str:
    """A time in a unit that suits it."""
    if seconds < 120.0:
        return f"{seconds:.3g} s"
    return f"{seconds / 60.0:.3g} min" if seconds < 7200.0 else f"{seconds / 3600.0:.3g} h"


def value(factor: float, number: float | None) -> str:
    """A number times a factor in four digits; a dash if it is not known."""
    return "-" if number is None else f"{float(f'{factor * number:.4g}'):g}"

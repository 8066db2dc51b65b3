"""The verdict as the banner of a page."""

from leg_wear_monitor.monitor.verdict.verdict import State
from leg_wear_monitor.playback.result.replay_summary import ReplaySummary
from leg_wear_monitor.report.page import Banner
from leg_wear_monitor.report.replay.words import joints_words, reason, since_words

LOOKS = {
    State.HEALTHY: ("✓", "fine"),
    State.WATCH: ("◆", "careful"),
    State.NOT_MONITORED: ("?", "careful"),
    State.INSPECT: ("▲", "bad"),
    State.STOP: ("■", "bad"),
}


def verdict_banner(summary: ReplaySummary, guide: str) -> Banner:
    """State as symbol and word, joints, reason, action, code, begin, and the values that are not valid.

    Parameters
    ----------
    summary : ReplaySummary
    guide : str
        Address of the verdict's guide.
    """
    verdict = summary.verdict
    symbol, severity = LOOKS[verdict.state]
    notes = [("Do", verdict.do), ("Code", verdict.fault_code)]
    if verdict.since_ns:
        notes.append(("Since", since_words(summary, verdict.since_ns)))
    if verdict.not_valid:
        figures = ", ".join(figure.words for figure in verdict.not_valid)
        notes.append(("Not valid", f"{figures}: {reason(verdict)}"))
    return Banner(
        symbol=symbol,
        word=verdict.state.words.upper(),
        subject=joints_words(summary),
        text=verdict.why,
        notes=notes,
        severity=severity,
        guide=guide,
    )

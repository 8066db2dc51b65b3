"""The verdict as the banner of a page."""

from leg_wear_monitor.monitor.verdict.verdict import State, Verdict
from leg_wear_monitor.report.page import Banner

_LOOKS = {
    State.HEALTHY: ("✓", "fine"),
    State.WATCH: ("◇", "careful"),
    State.NOT_MONITORED: ("?", "careful"),
    State.INSPECT: ("▲", "bad"),
    State.STOP: ("■", "bad"),
}


def verdict_banner(verdict: Verdict) -> Banner:
    """State as symbol and word, joints, reason, action, and the figures that do not hold."""
    symbol, severity = _LOOKS[verdict.state]
    joints = f" joint {', '.join(verdict.joints)}" if verdict.joints else ""
    invalid = ", ".join(figure.words for figure in verdict.not_valid)
    return Banner(
        symbol=symbol,
        word=f"{verdict.state.words.upper()}{joints}",
        text=f"{verdict.why}. To do: {verdict.do}" + (f". Not valid: {invalid}" if invalid else ""),
        severity=severity,
    )

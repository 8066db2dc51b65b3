"""The page of a fleet: one row per leg, the worst leg first."""

from collections.abc import Container
from typing import Any
from urllib.parse import quote

from leg_wear_monitor.fleet.overview import UNKNOWN, FleetOverview, LegOverview
from leg_wear_monitor.monitor.alarms import time_words
from leg_wear_monitor.monitor.verdict.verdict import guide_to
from leg_wear_monitor.report.page import STATE_LOOKS, Banner, Fragment, Page, Section, render
from leg_wear_monitor.state import State

FRESH_DAYS = 7.0
DAY_NS = 86_400 * 10**9

_NEAR = 0.8  # fraction of the clearance limit above which its bar has the warning colour


def fleet_page(
    overview: FleetOverview, now_ns: int, fresh_days: float = FRESH_DAYS, pages: Container[str] = ()
) -> Page:
    """The page of a fleet.

    Parameters
    ----------
    overview : FleetOverview
    now_ns : int
        Time at which the ages of recordings are judged [ns since 1970].
    fresh_days : float
        Age of the last recording up to which a leg counts as monitored [days].
    pages : container of str
        Ids of the legs that have their own page.
    """
    rows = [_row(leg, _doubt(leg, now_ns, fresh_days), leg.id in pages) for leg in overview.legs]
    rows.sort(key=lambda row: -row["state"].severity)  # a stable sort keeps the order of legs in one state
    last_ns = max((leg.last_ns for leg in overview.legs), default=0)
    summary = f"{len(rows)} legs, last recording {time_words(last_ns)}" if last_ns else "No recording"
    return Page(
        title="Joint wear of the fleet",
        summary=summary,
        sections=[Section("Legs", [Fragment(markup=render("fleet.html", rows=rows))])],
        banner=_banner(overview, rows, fresh_days),
        styles=("replay/replay.css", "fleet.css"),
        has_dark=True,
    )


def _doubt(leg: LegOverview, now_ns: int, fresh_days: float) -> str:
    """Reason why the verdict of a leg is outdated; empty if it is current."""
    if leg.state is None:
        return "the ledger has no recording of this leg"
    age_days = (now_ns - leg.last_ns) / DAY_NS
    if age_days < -1.0:  # clocks of two machines may differ by a time zone
        return "its last recording is dated in the future"
    return f"its last recording is older than {fresh_days:g} days" if age_days > fresh_days else ""


def _row(leg: LegOverview, doubt: str, has_page: bool) -> dict[str, Any]:
    """A leg as the template needs it. A leg with an old recording is not monitored."""
    verdict = leg.state.verdict if leg.state else None
    state = verdict.state if verdict else State.NOT_MONITORED
    word = state.words if verdict else "no recording"
    if verdict and doubt and state.severity < State.NOT_MONITORED.severity:
        state, word = State.NOT_MONITORED, f"outdated, was {state.words}"
    symbol, tone = STATE_LOOKS[state]
    is_calm = state is State.HEALTHY
    used = leg.used_fraction
    joints = leg.state.clearances if leg.state else {}
    return {
        "id": leg.id,
        "page": f"legs/{quote(leg.id, safe='')}/report.html" if has_page else "",
        "state": state,
        "word": word,
        "symbol": symbol,
        "tone": tone,
        "joints": ", ".join(verdict.joints) if verdict else "",
        "why": verdict.why if verdict else "",
        "do": verdict.do if verdict and not is_calm else "",
        "how_soon": leg.how_soon,
        "guide": f"{verdict.fault_code}, {guide_to(verdict)}" if verdict and not is_calm else "",
        "doubts": [*filter(None, [doubt]), *leg.faults],
        "used": [(joint, _bar(used[joint]) if joint in used else None) for joint in joints],
        "life": [_hours(each) for each in (leg.life.p50_h, leg.life.p10_h, leg.life.p90_h)]
        if leg.life
        else [],
        "last": time_words(leg.last_ns) if leg.last_ns else "",
        "counted": f"{leg.counted} of {leg.recordings}",
    }


def _bar(used: float) -> dict[str, Any]:
    """Width, words and colour of the bar of a clearance."""
    tone = "bad" if used >= 1.0 else "careful" if used >= _NEAR else "fine"
    return {
        "width": round(100.0 * min(max(used, 0.0), 1.0), 1),
        "words": f"{100.0 * used:.0f} %",
        "tone": tone,
    }


def _hours(hours: float) -> str:
    return f"{hours:.0f}" if hours >= 100.0 else f"{hours:.3g}"


def _banner(overview: FleetOverview, rows: list[dict[str, Any]], fresh_days: float) -> Banner:
    worst: State = max(
        (row["state"] for row in rows), key=lambda state: state.severity, default=State.HEALTHY
    )
    number = sum(row["state"] is worst for row in rows)
    symbol, tone = STATE_LOOKS[worst]
    counts = [(word.replace("_", " "), count) for word, count in reversed(overview.counts.items()) if count]
    words = ", ".join(f"{count} {'without recording' if word == UNKNOWN else word}" for word, count in counts)
    outdated = f"a verdict milder than *inspect* whose recording is older than {fresh_days:g} days"
    return Banner(
        symbol=symbol,
        word=f"{number} of {len(rows)} {worst.words}".upper(),
        text=f"Verdicts: {words}." if words else "No leg.",
        notes=[("Outdated", outdated.replace("*", "")), ("Limits", overview.advice)],
        severity=tone,
    )

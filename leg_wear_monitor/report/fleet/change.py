"""What changed since the update before."""

from collections.abc import Sequence

from leg_wear_monitor.fleet.overview.parts import LegOverview
from leg_wear_monitor.monitor.verdict.verdict import State
from leg_wear_monitor.report.fleet.used import valid_used
from leg_wear_monitor.report.page import Section
from leg_wear_monitor.report.parts import Part, Sentences, Table

_ROWS = 10


def was(leg: LegOverview) -> str:
    """State of the verdict before, if it was another one; empty otherwise."""
    return State(leg.change.state).words if leg.change.state and leg.change.state != leg.state else ""


def growth(leg: LegOverview) -> tuple[float, str] | None:
    """Largest growth of the used part of a clearance [percentage points], and its joint; None if unknown."""
    valid = valid_used(leg)
    grown = [
        (100.0 * rise, joint)
        for joint, rise in leg.change.used_fraction.items()
        if valid.get(joint) is not None
    ]
    return max(grown, default=None)


def change_section(legs: Sequence[LegOverview]) -> Section:
    """Legs whose verdict changed, and the joints that wore most, since the update before."""
    changed = [leg for leg in legs if was(leg) and not leg.is_accelerated]
    worse = [leg for leg in changed if _step(leg) > 0]
    grown = sorted(
        ((*rise, leg.id) for leg in legs if (rise := growth(leg)) and rise[0] > 0.0),
        key=lambda each: (-each[0], each[2]),
    )
    added = sum(leg.change.recordings for leg in legs)
    sentences = [
        f"Recordings counted since: {added}.",
        f"Legs with a worse verdict: {len(worse)}; with a better one: {len(changed) - len(worse)}.",
    ]
    parts: list[Part] = [Sentences(sentences)]
    if changed:
        parts.append(_verdicts(sorted(changed, key=lambda leg: (-_step(leg), leg.id))))
    if grown:
        parts.append(_growth(grown))
    return Section("What changed since the update before", parts)


def _step(leg: LegOverview) -> int:
    return State(leg.state).severity - State(leg.change.state).severity


def _verdicts(changed: Sequence[LegOverview]) -> Table:
    rows = [
        (leg.id, was(leg), State(leg.state).words, leg.verdict.why if leg.verdict else "") for leg in changed
    ]
    return Table(
        caption="Legs with another verdict",
        head=("leg", "before", "now", "why"),
        rows=rows[:_ROWS],
        note=_more(len(rows), "change"),
        is_text=True,
    )


def _growth(grown: Sequence[tuple[float, str, str]]) -> Table:
    rows = [(leg, joint, f"{points:+.2g}") for points, joint, leg in grown]
    return Table(
        caption="Largest growth of a clearance",
        head=("leg", "joint", "growth [% of the clearance from new to limit]"),
        rows=rows[:_ROWS],
        note=_more(len(rows), "change"),
    )


def _more(number: int, column: str) -> str:
    rest = number - _ROWS
    return f"{rest} more: sort the table of the legs by {column}." if rest > 0 else ""

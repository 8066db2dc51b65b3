"""Standing of a leg on the page, how much of its clearances is used up, what changed."""

from collections.abc import Iterable, Sequence
from enum import Enum

import attrs

from leg_wear_monitor.fleet.overview import LegOverview, urgency
from leg_wear_monitor.monitor.alarms import time_words
from leg_wear_monitor.report.page import STATE_LOOKS, Part, Section, Sentences, Table
from leg_wear_monitor.state import Figure, State

# Standing of a leg on the page: its verdict, unless that is too old to be relied on.


DAY_NS = 86_400 * 10**9
_AHEAD_NS = DAY_NS  # clocks of two machines, and time zones that somebody forgot


class Standing(Enum):
    """Standing of a leg, from the mildest to the most severe."""

    DEMONSTRATION = "demonstration"
    HEALTHY = "healthy"
    WATCH = "watch"
    UNKNOWN = "no recording"
    OUTDATED = "outdated"
    NOT_MONITORED = "not monitored"
    INSPECT = "inspect"
    STOP = "stop"

    @property
    def severity(self) -> int:
        """Rank in the order above, from 0."""
        return list(Standing).index(self)

    @property
    def look(self) -> tuple[str, str]:
        """Symbol beside the word, and class of its colour."""
        state = State.__members__.get(self.name, State.NOT_MONITORED)
        return STATE_LOOKS[state]


@attrs.frozen(kw_only=True)
class Day:
    """When the page is made, and how old a recording may be.

    Attributes
    ----------
    now_ns : int
        Time [ns since 1970].
    fresh_days : float
        Age of the last recording up to which a leg counts as monitored [days].
    """

    now_ns: int
    fresh_days: float

    def age_days(self, leg: LegOverview) -> float | None:
        """Age of the end of a leg's last counted recording [days]; None without one."""
        if not leg.recordings.counted:
            return None
        return (self.now_ns - leg.recordings.end_ns) / DAY_NS

    def doubt(self, leg: LegOverview) -> str:
        """Why the verdict of a leg cannot be relied on today; empty if it can."""
        if leg.is_accelerated:
            return f"all wear is multiplied by {leg.wear_acceleration:g}: a demonstration, not ranked"
        if leg.fault:
            return f"the last update could not count all of its recordings: {leg.fault}"
        age = self.age_days(leg)
        if age is None:
            return "no recording of it was counted"
        end = time_words(leg.recordings.end_ns)
        if age * DAY_NS < -_AHEAD_NS:
            return f"its last recording is dated in the future: {end}"
        if age > self.fresh_days:
            return f"its last recording is {age:.0f} days old: {end}"
        return ""

    def standing(self, leg: LegOverview) -> Standing:
        """Standing of a leg; a healthy leg without a fresh recording is outdated."""
        if leg.is_accelerated:
            return Standing.DEMONSTRATION
        if leg.verdict is None:
            return Standing.UNKNOWN
        if leg.verdict.state is State.HEALTHY and self.doubt(leg):
            return Standing.OUTDATED
        return Standing[leg.verdict.state.name]


def by_urgency(legs: Iterable[LegOverview], day: Day) -> list[LegOverview]:
    """Legs by who needs a person first: by standing, then by remaining life, then by clearance."""
    return sorted(legs, key=lambda leg: (-day.standing(leg).severity, *urgency(leg)[1:]))


# How much of each clearance is used up, where the verdict believes it.


BANDS = (0.25, 0.5, 0.8, 1.0)
"""Ends of the bands of the heat map: fractions of the clearance from new to limit."""


def valid_used(leg: LegOverview) -> dict[str, float | None]:
    """Fraction of each joint's clearance that is used up; None where it is not valid, or wear is accelerated.

    While the counted clearances are not valid, only those of the verdict's joints are, as measurements show
    them: those of the others are estimated from the counted leg.
    """
    verdict = leg.verdict
    if leg.is_accelerated:
        return dict.fromkeys(leg.used_fraction)
    if verdict is None or Figure.CLEARANCES not in verdict.not_valid:
        return dict(leg.used_fraction)
    return {
        joint: used if joint in verdict.joints and leg.clearances[joint].seen_m is not None else None
        for joint, used in leg.used_fraction.items()
    }


def joints_of(legs: Iterable[LegOverview]) -> list[str]:
    """Names of the joints of all legs, in alphabetical order."""
    return sorted({joint for leg in legs for joint in leg.used_fraction})


def band(used: float) -> int:
    """Index of the band of a fraction, from 0; the last one begins at the limit."""
    return sum(used >= end for end in BANDS)


# What changed since the update before.


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
    worse = sum(_step(leg) > 0 for leg in changed)
    grown = [(rise, leg.id) for leg in legs if (rise := growth(leg)) and rise[0] > 0.0]
    added = sum(leg.change.recordings for leg in legs)
    sentences = [
        f"Recordings counted since: {added}.",
        f"Legs with a worse verdict: {worse}; with a better one: {len(changed) - worse}.",
    ]
    parts: list[Part] = [Sentences(sentences)]
    if changed:
        ranked = sorted(changed, key=lambda leg: (-_step(leg), leg.id))
        verdicts = [
            (leg.id, was(leg), State(leg.state).words, leg.verdict.why if leg.verdict else "")
            for leg in ranked
        ]
        parts.append(_table("Legs with another verdict", ("leg", "before", "now", "why"), verdicts))
    if grown:
        head = ("leg", "joint", "growth [% of the clearance from new to limit]")
        ranked_rises = sorted(grown, key=lambda each: (-each[0][0], each[1]))
        rises = [(leg, joint, f"{points:+.2g}") for (points, joint), leg in ranked_rises]
        parts.append(_table("Largest growth of a clearance", head, rises))
    return Section("What changed since the update before", parts)


def _step(leg: LegOverview) -> int:
    return State(leg.state).severity - State(leg.change.state).severity


def _table(caption: str, head: Sequence[str], rows: Sequence[Sequence[str]]) -> Table:
    """The first rows; of texts, if it has a reason."""
    rest = len(rows) - _ROWS
    note = f"{rest} more: sort the table of the legs by change." if rest > 0 else ""
    return Table(caption=caption, head=head, rows=rows[:_ROWS], note=note, is_text="why" in head)

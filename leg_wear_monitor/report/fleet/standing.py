"""Standing of a leg on the page: its verdict, unless that is too old to be relied on."""

from collections.abc import Iterable
from enum import Enum

import attrs

from leg_wear_monitor.fleet.overview.make import urgency
from leg_wear_monitor.fleet.overview.parts import LegOverview
from leg_wear_monitor.monitor.alarms.words import time_words
from leg_wear_monitor.monitor.verdict.verdict import State

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
    def symbol(self) -> str:
        """Symbol beside the word."""
        return {"HEALTHY": "✓", "WATCH": "◆", "INSPECT": "▲", "STOP": "■"}.get(self.name, "?")

    @property
    def tone(self) -> str:
        """Class of its colour."""
        if self is Standing.HEALTHY:
            return "fine"
        return "bad" if self in (Standing.INSPECT, Standing.STOP) else "careful"


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

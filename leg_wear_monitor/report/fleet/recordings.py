"""Health of the recordings of a fleet."""

from collections.abc import Sequence

from leg_wear_monitor.fleet.overview.parts import LegOverview, RecordingHealth
from leg_wear_monitor.report.fleet.standing import Day
from leg_wear_monitor.report.page import Section
from leg_wear_monitor.report.parts import Part, Sentences, Table

_MOST_BAD = 200
_KINDS = (
    ("counted", "counted"),
    ("partial", "of these with lost parts"),
    ("already_counted", "already counted from others"),
    ("no_gait", "without a gait cycle that fits the leg"),
    ("unreadable", "unreadable"),
)
_OUTCOMES = {
    "counted": "counted in part",
    "already_counted": "already counted, with lost parts",
    "no_gait": "no gait cycle fits the leg",
    "unreadable": "unreadable",
}


def recordings_section(legs: Sequence[LegOverview], day: Day) -> Section:
    """Sums over all recordings, their age, and each one that is not sound by its name."""
    parts: list[Part] = [Sentences(_sentences(legs, day)), _sums([leg.recordings for leg in legs])]
    faults = [(leg.id, leg.fault) for leg in legs if leg.fault]
    if faults:
        parts.append(
            Table(caption="Legs that were not updated", head=("leg", "why"), rows=faults, is_text=True)
        )
    bad = [
        (leg.id, one.file, _OUTCOMES.get(one.outcome, one.outcome), one.why)
        for leg in legs
        for one in leg.recordings.bad
    ]
    if bad:
        hidden = sum(_bad_count(leg.recordings) for leg in legs) - len(bad[:_MOST_BAD])
        parts.append(
            Table(
                caption="Recordings that are not sound",
                head=("leg", "recording", "what became of it", "why"),
                rows=bad[:_MOST_BAD],
                note=f"{hidden} more are in legs/*/log." if hidden > 0 else "",
                is_text=True,
            )
        )
    return Section("Recordings", parts)


def _sentences(legs: Sequence[LegOverview], day: Day) -> list[str]:
    ages = [day.age_days(leg) for leg in legs]
    old = sum(age is not None and age > day.fresh_days for age in ages)
    ahead = sum(age is not None and age < -1.0 for age in ages)
    none = ages.count(None)
    told = [
        f"Legs with a recording of the last {day.fresh_days:g} days: {len(legs) - old - ahead - none}; "
        f"with an older one: {old}; with none: {none}."
    ]
    if ahead:
        told.append(f"Legs whose last recording is dated in the future: {ahead}.")
    return told


def _sums(healths: Sequence[RecordingHealth]) -> Table:
    rows = [(words, str(sum(getattr(health, name) for health in healths))) for name, words in _KINDS]
    rows.append(("time in them [h]", f"{sum(health.counted_h for health in healths):.4g}"))
    lost_h = sum(health.unmonitored_s for health in healths) / 3600.0
    rows.append(("of this not followed [h]", f"{lost_h:.3g}"))
    rows.append(("gait cycles in them", str(sum(health.cycles for health in healths))))
    return Table(caption="Recordings of all legs", head=("", "number"), rows=rows)


def _bad_count(health: RecordingHealth) -> int:
    return health.partial + health.no_gait + health.unreadable

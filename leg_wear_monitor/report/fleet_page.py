"""The page of a fleet, from its overview: the verdict, the legs that need a person first, all legs."""

import statistics
from collections import Counter
from collections.abc import Container, Mapping, Sequence
from itertools import pairwise
from typing import Any
from urllib.parse import quote

from leg_wear_monitor.fleet.overview import FleetOverview, LegOverview, RecordingHealth
from leg_wear_monitor.monitor.alarms import time_words
from leg_wear_monitor.monitor.verdict.verdict import guide_to
from leg_wear_monitor.report.fleet_standing import (
    BANDS,
    DAY_NS,
    Day,
    Standing,
    band,
    by_urgency,
    change_section,
    growth,
    joints_of,
    valid_used,
    was,
)
from leg_wear_monitor.report.page import (
    Banner,
    Fragment,
    Page,
    Part,
    Section,
    Sentences,
    Table,
    Text,
    render,
    template_text,
)
from leg_wear_monitor.state import as_plain

# Rows of the page's table, as plain data for its script.


def table_data(
    legs: Sequence[LegOverview], joints: Sequence[str], day: Day, pages: Container[str]
) -> dict[str, Any]:
    """All that the script of the table needs.

    Parameters
    ----------
    legs : sequence of LegOverview
    joints : sequence of str
        Columns of the heat map.
    day : Day
    pages : container of str
        Ids of the legs that have a page of their own.
    """
    rank = {leg.id: number for number, leg in enumerate(by_urgency(legs, day))}
    lives = [leg.life["leg"] for leg in legs if leg.life.get("leg") and not leg.is_accelerated]
    return {
        "joints": list(joints),
        "life_h": [
            min((life.p10_h for life in lives if life and life.p10_h > 0.0), default=1.0),
            max((life.p90_h for life in lives if life), default=10.0),
        ],
        "legs": [_row(leg, joints, day, rank[leg.id], leg.id in pages) for leg in legs],
    }


def page_address(name: str) -> str:
    """Address of a leg's own page, relative to the page of the fleet."""
    return f"legs/{quote(name, safe='')}/report.html"


def _row(leg: LegOverview, joints: Sequence[str], day: Day, rank: int, has_page: bool) -> dict[str, Any]:
    standing, used, age = day.standing(leg), valid_used(leg), day.age_days(leg)
    health, rise, doubt = leg.recordings, growth(leg), day.doubt(leg)
    life = None if leg.is_accelerated else leg.life.get("leg")
    why = as_plain("; ".join(filter(None, [leg.verdict.why if leg.verdict else "", doubt])))
    return {
        "id": leg.id,
        "page": page_address(leg.id) if has_page else "",
        "lot": leg.lot,
        "standing": standing.value,
        "rank": rank,
        "symbol": standing.look[0],
        "tone": standing.look[1],
        "used": [_cell(used, joint) for joint in joints],
        "life": [life.p10_h, life.p50_h, life.p90_h] if life else None,
        "was": was(leg),
        "rise": list(rise) if rise else None,
        "age": None if age is None else round(age, 2),
        "is_old": bool(doubt),
        "counted": health.counted,
        "bad": _bad_count(health),
        "why": why,
        "code": leg.verdict.fault_code if leg.verdict else "",
    }


def _cell(used: dict[str, float | None], joint: str) -> list[float] | str | None:
    """Percent and band of a joint; None if the leg has no such joint, a word if it is not valid."""
    if joint not in used:
        return None
    fraction = used[joint]
    return "not valid" if fraction is None else [round(100.0 * fraction, 1), band(fraction)]


# By when a person should look after a leg.


_UNWATCHED = (Standing.NOT_MONITORED, Standing.OUTDATED, Standing.UNKNOWN)
_LEAST_DAYS = 1.0  # of recordings; from less, hours of walking a day are not known
_MOST_DAYS = 3650.0


def deadline(leg: LegOverview, standing: Standing, day: Day) -> str:
    """By when a person should look after a leg, in words: by its standing and by the p10 of its life."""
    if standing is Standing.STOP:
        return "now, before it walks again"
    if standing in _UNWATCHED:
        return "as soon as possible: nobody monitors it meanwhile"
    life = leg.life.get("leg")
    p10 = "" if life is None else f"{hours(life.p10_h)} h of walking{_date(leg, life.p10_h, day)}"
    if standing is Standing.INSPECT:  # what is to be inspected may make the forecast wrong
        return f"at its next stop{p10 and f'; p10 of its life: {p10}'}"
    return f"within the p10 of its life: {p10}" if p10 else "at its next service"


def hours(value_h: float) -> str:
    """Hours in three digits."""
    return f"{value_h:.0f}" if value_h >= 100.0 else f"{value_h:.3g}"


def _date(leg: LegOverview, p10_h: float, day: Day) -> str:
    """The date, if the leg walks as much a day as its recordings show; empty if that is not known."""
    span_days = (leg.recordings.end_ns - leg.recordings.begin_ns) / DAY_NS
    if span_days < _LEAST_DAYS or leg.recordings.counted_h <= 0.0:
        return ""
    a_day_h = min(leg.recordings.counted_h / span_days, 24.0)
    days = p10_h / a_day_h
    if days > _MOST_DAYS:
        return ""
    at_ns = leg.recordings.end_ns + int(days * DAY_NS)
    late = "overdue: " if at_ns < day.now_ns else ""
    return f"; {late}by {time_words(at_ns).split()[0]} at the {a_day_h:.2g} h a day that its recordings show"


# Clearance that is used up, joint by joint over the fleet.


_HEAD = (
    f"below {100 * BANDS[0]:.0f} %",
    *(f"{100 * low:.0f} to {100 * high:.0f} %" for low, high in pairwise(BANDS)),
    "at the limit",
)


def joints_section(legs: Sequence[LegOverview], joints: Sequence[str]) -> Section:
    """Number of legs in each band, for each joint."""
    if not joints:
        return Section("Joints", [Text("No clearance of any leg is known.")])
    used = [valid_used(leg) for leg in legs]
    rows = []
    for joint in joints:
        own = [each[joint] for each in used if joint in each]
        known = [each for each in own if each is not None]
        bands = Counter(map(band, known))
        ends = [f"{100.0 * end(known):.0f} %" if known else "-" for end in (statistics.median, max)]
        counts = [bands[number] for number in range(len(BANDS) + 1)]
        rows.append((joint, *map(str, [*counts, len(own) - len(known)]), *ends))
    caption = "Legs by the part of a joint's clearance, from new to limit, that is used up"
    head = ("joint", *_HEAD, "not valid", "median", "most")
    return Section("Joints", [Table(caption=caption, head=head, rows=rows)])


# Health of the recordings of a fleet.


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
    parts: list[Part] = [Sentences(_ages(legs, day)), _sums([leg.recordings for leg in legs])]
    faults = [(leg.id, leg.fault) for leg in legs if leg.fault]
    if faults:
        caption = "Legs that were not updated"
        parts.append(Table(caption=caption, head=("leg", "why"), rows=faults, is_text=True))
    bad = [
        (leg.id, one.file, _OUTCOMES.get(one.outcome, one.outcome), one.why)
        for leg in legs
        for one in leg.recordings.bad
    ]
    if bad:
        hidden = sum(_bad_count(leg.recordings) for leg in legs) - len(bad[:_MOST_BAD])
        note = f"{hidden} more are in legs/*/log." if hidden > 0 else ""
        caption, head = "Recordings that are not sound", ("leg", "recording", "what became of it", "why")
        parts.append(Table(caption=caption, head=head, rows=bad[:_MOST_BAD], note=note, is_text=True))
    return Section("Recordings", parts)


def _ages(legs: Sequence[LegOverview], day: Day) -> list[str]:
    ages = [day.age_days(leg) for leg in legs]
    old = sum(age is not None and age > day.fresh_days for age in ages)
    ahead = sum(age is not None and age < -1.0 for age in ages)
    none = ages.count(None)
    sentences = [
        f"Legs with a recording of the last {day.fresh_days:g} days: {len(legs) - old - ahead - none}; "
        f"with an older one: {old}; with none: {none}."
    ]
    if ahead:
        sentences.append(f"Legs whose last recording is dated in the future: {ahead}.")
    return sentences


def _sums(healths: Sequence[RecordingHealth]) -> Table:
    def total(name: str) -> Any:
        return sum(getattr(health, name) for health in healths)

    rows = [
        *((words, f"{total(name)}") for name, words in _KINDS),
        ("time in them [h]", f"{total('counted_h'):.4g}"),
        ("of this not followed [h]", f"{total('unmonitored_s') / 3600.0:.3g}"),
        ("gait cycles in them", f"{total('cycles')}"),
    ]
    return Table(caption="Recordings of all legs", head=("", "number"), rows=rows)


def _bad_count(health: RecordingHealth) -> int:
    return health.partial + health.no_gait + health.unreadable


# The page of a fleet, from its overview: the verdict, the legs that need a person first, all legs.


_FIRST = 10
_DEMONSTRATIONS = "demonstrations"
_GROUPS = {
    "must stop": (Standing.STOP,),
    "to look at": (Standing.INSPECT, Standing.WATCH),
    "unmonitored": _UNWATCHED,
    "well": (Standing.HEALTHY,),
    _DEMONSTRATIONS: (Standing.DEMONSTRATION,),
}
_CALM = (Standing.HEALTHY, Standing.DEMONSTRATION)


def fleet_page(
    overview: FleetOverview,
    day: Day,
    pages: Container[str] = (),
    versions: Mapping[str, str] | None = None,
) -> Page:
    """The page of a fleet.

    Parameters
    ----------
    overview : FleetOverview
    day : Day
        When it is made.
    pages : container of str
        Ids of the legs that have a page of their own.
    versions : mapping of str to str, optional
        Versions of the software, by name.
    """
    legs, joints = overview.legs, joints_of(overview.legs)
    data = table_data(legs, joints, day, pages)
    table = render("fleet/table.html", data=data, lots=sorted({leg.lot for leg in legs if leg.lot}),
                   standings=[each.value for each in reversed(Standing)])  # fmt: skip
    sections = [
        Section("Who needs a person first", [_first(legs, day, pages)]),
        Section("Legs", [Fragment(markup=table, script=template_text("fleet/table.js"))]),
        joints_section(legs, joints),
        change_section(legs),
        recordings_section(legs, day),
    ]
    return Page(
        title="Joint wear of the fleet",
        summary=f"{len(legs)} legs, as of {time_words(day.now_ns)}",
        sections=sections,
        versions=versions or {},
        banner=_banner(overview, day),
        styles=("replay/replay.css", "fleet/fleet.css"),
        libraries=("fleet/map.js",),
        has_dark=True,
    )


def counts(legs: Sequence[LegOverview], day: Day) -> dict[Standing, int]:
    """Number of legs by standing, all standings."""
    found = Counter(map(day.standing, legs))
    return {standing: found[standing] for standing in Standing}


def first_legs(legs: Sequence[LegOverview], day: Day) -> list[LegOverview]:
    """The up to ten legs that need a person first."""
    return by_urgency((leg for leg in legs if day.standing(leg) not in _CALM), day)[:_FIRST]


def _banner(overview: FleetOverview, day: Day) -> Banner:
    found = counts(overview.legs, day)
    worst = max((each for each in Standing if found[each]), key=lambda each: each.severity)
    numbers = {words: sum(found[each] for each in group) for words, group in _GROUPS.items()}
    words = next(words for words, group in _GROUPS.items() if worst in group)
    parts = [f"{number} {each}" for each, number in numbers.items() if number or each != _DEMONSTRATIONS]
    outdated = f"healthy, but without a recording of the last {day.fresh_days:g} days, or not updated"
    return Banner(
        symbol=worst.look[0],
        word=f"{numbers[words]} of {len(overview.legs)} {words}".upper(),
        text=f"{', '.join(parts)}.",
        notes=[
            ("In detail", ", ".join(f"{found[each]} {each.value}" for each in reversed(Standing))),
            ("Outdated", outdated),
            ("Limits", overview.advice),
        ],
        severity=worst.look[1],
    )


def _first(legs: Sequence[LegOverview], day: Day, pages: Container[str]) -> Part:
    cards = [_card(leg, day, leg.id in pages) for leg in first_legs(legs, day)]
    if not cards:
        return Text("No leg needs a person now.")
    asking = sum(day.standing(leg) not in _CALM for leg in legs)
    return Fragment(render("fleet/first.html", cards=cards, more=asking - len(cards)))


def _card(leg: LegOverview, day: Day, has_page: bool) -> dict[str, Any]:
    verdict, standing, doubt = leg.verdict, day.standing(leg), day.doubt(leg)
    card = {"leg": leg, "standing": standing, "by": deadline(leg, standing, day)}
    card["page"] = page_address(leg.id) if has_page else ""
    if verdict is None or standing is Standing.OUTDATED:
        do = "record its gait, then run `leg-wear-monitor fleet update`"
        return card | {"joints": "", "why": doubt, "do": do, "code": ""}
    why = f"{verdict.why}; {doubt}" if doubt else verdict.why
    code = f"{verdict.fault_code}, see {guide_to(verdict)}"
    return card | {"joints": ", ".join(verdict.joints), "why": why, "do": verdict.do, "code": code}

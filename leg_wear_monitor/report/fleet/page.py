"""The page of a fleet, from its overview: the verdict, the legs that need a person first, all legs."""

from collections import Counter
from collections.abc import Container, Mapping, Sequence

from leg_wear_monitor.fleet.overview.parts import FleetOverview, LegOverview
from leg_wear_monitor.monitor.alarms.words import time_words
from leg_wear_monitor.report.fleet.change import change_section
from leg_wear_monitor.report.fleet.deadline import deadline
from leg_wear_monitor.report.fleet.joints import joints_section
from leg_wear_monitor.report.fleet.recordings import recordings_section
from leg_wear_monitor.report.fleet.row import page_address, table_data
from leg_wear_monitor.report.fleet.standing import Day, Standing, by_urgency
from leg_wear_monitor.report.fleet.used import joints_of
from leg_wear_monitor.report.page import Banner, Page, Section, render, template_text
from leg_wear_monitor.report.parts import Fragment, Live, Part, Text

_FIRST = 10
_UNWATCHED = (Standing.NOT_MONITORED, Standing.OUTDATED, Standing.UNKNOWN)
_GROUPS = (
    ("must stop", (Standing.STOP,)),
    ("to look at", (Standing.INSPECT, Standing.WATCH)),
    ("unmonitored", _UNWATCHED),
    ("well", (Standing.HEALTHY,)),
    ("demonstrations", (Standing.DEMONSTRATION,)),
)
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
        Section("Legs", [Live(markup=table, script=template_text("fleet/table.js"))]),
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
        styles=[template_text("replay/replay.css"), template_text("fleet/fleet.css")],
        libraries=[template_text("fleet/map.js")],
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
    words, group = next((words, group) for words, group in _GROUPS if worst in group)
    number = sum(found[each] for each in group)
    return Banner(
        symbol=worst.symbol,
        word=f"{number} of {len(overview.legs)} {words}".upper(),
        text=", ".join(
            f"{number} {words}"
            for words, group in _GROUPS
            if (number := sum(found[each] for each in group)) or Standing.DEMONSTRATION not in group
        )
        + ".",
        notes=[
            ("In detail", ", ".join(f"{found[each]} {each.value}" for each in reversed(Standing))),
            (
                "Outdated",
                f"healthy, but without a recording of the last {day.fresh_days:g} days, or not updated",
            ),
            ("Limits", overview.advice),
        ],
        severity=worst.tone,
    )


def _first(legs: Sequence[LegOverview], day: Day, pages: Container[str]) -> Part:
    cards = [_card(leg, day, leg.id in pages) for leg in first_legs(legs, day)]
    if not cards:
        return Text("No leg needs a person now.")
    asking = sum(day.standing(leg) not in _CALM for leg in legs)
    return Fragment(render("fleet/first.html", cards=cards, more=asking - len(cards)))


def _card(leg: LegOverview, day: Day, has_page: bool) -> dict[str, str]:
    verdict, standing, doubt = leg.verdict, day.standing(leg), day.doubt(leg)
    if verdict is None or standing is Standing.OUTDATED:
        why, joints, do = doubt, "", "record its gait, then run leg-wear-monitor fleet update"
        code = ""
    else:
        why, joints, do = verdict.why, ", ".join(verdict.joints), verdict.do
        code = f"{verdict.fault_code}, see {verdict.guide}"
        why += f"; {doubt}" if doubt else ""
    return {
        "name": leg.id,
        "page": page_address(leg.id) if has_page else "",
        "lot": leg.lot,
        "symbol": standing.symbol,
        "word": standing.value.upper(),
        "tone": standing.tone,
        "joints": joints,
        "why": why,
        "do": do,
        "by": deadline(leg, standing, day),
        "code": code,
    }

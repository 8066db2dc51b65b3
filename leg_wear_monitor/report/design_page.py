"""HTML page of a design: the joints as they are, pairs that last, and which joint to make better first."""

from collections.abc import Sequence

from leg_wear_monitor.life.design import BushingChoices, Candidate, Design
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.report.figure import (
    BLUE,
    GREEN,
    INK,
    PALE,
    SMALL,
    VERMILION,
    finish,
    new_figure,
    plain,
    svg,
)
from leg_wear_monitor.report.page import Page, Picture, Section, Sentences, Table, value

_SHOWN = 12  # candidates of a joint on the page; all of them are in the table design.csv

_SUPPOSED = (
    "Forces and sliding are those of the leg with its present bushings: stiffness and friction of another "
    "pair change them a little. Check a choice with the verb life, which simulates it.",
    "A life by wear is Archard's law with the pair's wear coefficient; its interval, 10 to 90 %, is the "
    "spread of such coefficients and the scatter of the motion. The worn volume is spread over the "
    "circumference, so the pin's diameter changes pressures, not this life.",
    "A life by a maker's formula has all factors 1 and no interval.",
    "Beyond a maker's limit no life holds. p is the 99th percentile of the pressure, v and p v are means; "
    "impacts are compared with the limit at rest.",
    "Not considered: strength and bending of the pin, temperature, dirt, and what a shop has in stock.",
)


def design_page(mechanism: Mechanism, result: Design, choices: BushingChoices) -> Page:
    """Page of a design.

    Parameters
    ----------
    mechanism : Mechanism
        For the labels of its joints.
    result : Design
    choices : BushingChoices
        What was tried.
    """
    asked, first = (f"{words[:1].upper()}{words[1:]}." for words in (result.asked, result.first))
    return Page(
        title=f"Bushings for {result.mechanism}",
        summary=asked,
        sections=[
            Section("The leg as it is", [Sentences([first]), _own(result)]),
            *(_joint(mechanism, result, joint) for joint in result.loads.joints),
            Section("What changes a life", [_sensitivities(result)]),
            Section("What this supposes", [Sentences(_SUPPOSED)]),
        ],
        configuration=_tried(choices),
    )


def _own(result: Design) -> Table:
    rows = [
        (one.joint, one.words, one.life_words, "yes" if one.sure_h >= result.hours else "no")
        for one in result.order
    ]
    head = ("joint", "bushing", "life", f"lasts {result.hours:g} h")
    return Table(
        caption="Present bushings: those beyond a limit, then the first to end first.",
        head=head,
        rows=rows,
        is_text=True,
    )


def _joint(mechanism: Mechanism, result: Design, joint: str) -> Section:
    """Pairs in the present size as a chart, and the smallest bushings that last as a table."""
    lasting = result.of(joint)
    pairs = [one for one in result.pairs if one.joint == joint]
    known = [one for one in pairs if one.wear_h or one.rating_h]
    unknown = len(pairs) - len(known)
    caption = (
        f"Pairs in the present size of joint {joint}; {unknown} more give no wear coefficient and no formula."
    )
    picture = Picture(
        image=_chart(result.hours, known),
        alt=f"Hours of joint {joint} by pair, with intervals, beside the {result.hours:g} h asked for",
        caption=caption,
        wide=True,
    )
    smallest: dict[str, Candidate] = {}
    for one in lasting:
        smallest.setdefault(one.material, one)
    rows = []
    for one in list(smallest.values())[:_SHOWN]:
        sizes = value(1e3, one.diameter_m), value(1e3, one.width_m), value(1e6, one.clearance_m)
        rows.append((one.material, *sizes, one.life_words))
    head = ("pair", "pin [mm]", "width [mm]", "clearance [µm]", "life")
    note = f"{len(lasting)} of those tried last; the smallest of each pair is shown, {_SHOWN} pairs at most."
    table = Table(
        caption=f"Smallest bushings that last in joint {joint}.",
        head=head,
        rows=rows,
        note=note,
        is_text=True,
    )
    return Section(f"Joint {mechanism.joint_words(joint)}", [picture, table])


def _chart(hours: float, known: Sequence[Candidate]) -> bytes:
    """Lives of pairs as points with intervals; hollow where a limit is exceeded."""
    figure = new_figure(8.5, 1.2 + 0.21 * max(4, len(known)))
    axes = figure.add_subplot()
    ordered = sorted(known, key=lambda one: one.wear_h[1] if one.wear_h else one.rating_h or 0.0)
    for row, one in enumerate(ordered):
        is_valid = one.limited_by in ("wear", "rating life")
        colour = VERMILION if not is_valid else BLUE if one.wear_h else GREEN
        face = colour if is_valid else "none"
        if one.wear_h:
            axes.plot(one.wear_h[::2], (row, row), color=colour, linewidth=2.2, alpha=0.6)
        middle = one.wear_h[1] if one.wear_h else one.rating_h or 0.0
        axes.plot(
            [middle], [row], "o" if one.wear_h else "D", color=colour, markerfacecolor=face, markersize=5
        )
        if not is_valid:
            axes.annotate(f" {one.limited_by}", (middle, row), fontsize=SMALL, color=VERMILION, va="bottom")
    axes.axvline(hours, color=INK, linewidth=1.0, linestyle="--")
    axes.annotate(f" {hours:g} h", (hours, len(ordered) - 0.4), fontsize=SMALL, color=INK)
    finish(axes, x="hours of walking: by wear (dots, 10 to 90 %), by the maker's formula (diamonds)")
    axes.set_xscale("log")
    axes.set_yticks(range(len(ordered)), [plain(one.material) for one in ordered])
    axes.set_ylim(-0.7, len(ordered) + 0.3)
    axes.grid(color=PALE, axis="y", linewidth=0.3)
    return svg(figure)


def _sensitivities(result: Design) -> Table:
    in_the_air = "" if any(part.load_n for part in result.duty) else "in the air"
    rows = [
        (one.joint, in_the_air or f"{one.load:+.0f} %",
         *(f"{each:+.0f} %" for each in (one.cadence, one.clearance, one.width)))
        for one in result.sensitivities
    ]  # fmt: skip
    head = ("joint", "10 % more load", "10 % more cadence", "half the clearance when new", "10 % wider")
    return Table(caption="Change of the life by wear with the present bushing.", head=head, rows=rows)


def _tried(choices: BushingChoices) -> str:
    """What was tried, as text."""

    def listed(values: Sequence[float], factor: float) -> str:
        return ", ".join(value(factor, one) for one in values)

    return "\n".join(
        (
            f"materials: {', '.join(choices.materials)}",
            f"diameters_mm: {listed(choices.diameters_m, 1e3)}",
            f"widths_mm: {listed(choices.widths_m, 1e3)}",
            f"clearances_um: {listed(choices.clearances_m, 1e6)}",
        )
    )

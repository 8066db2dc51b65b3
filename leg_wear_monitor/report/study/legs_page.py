"""HTML page of the study of other lengths and masses: claims against fractions of legs."""

import textwrap
from collections.abc import Sequence

from leg_wear_monitor.report.figures.figure import (
    BLUE,
    GREEN,
    INK,
    PAPER,
    SMALL,
    VERMILION,
    new_figure,
    png,
    tidy,
)
from leg_wear_monitor.report.page import Section
from leg_wear_monitor.report.parts import Gallery, Picture, Table
from leg_wear_monitor.report.study.sections import Sections, asked, conclude
from leg_wear_monitor.report.study.text import Labelled, percent
from leg_wear_monitor.studies.claims.evaluation import (
    CONFIDENCE,
    FAILS,
    HOLDS,
    UNDECIDED,
    ClaimResult,
    LegClaims,
)
from leg_wear_monitor.studies.results import StudyResults
from leg_wear_monitor.studies.tasks.drawn_leg import DEAD_POINT, OPEN, STEP, TRANSMISSION

_ALWAYS, _NEVER = 0.9, 0.1  # a fraction whose interval is beyond these hardly depends on the leg
_REASONS = {
    OPEN: "no assembly near that of the file",
    DEAD_POINT: "dead point",
    TRANSMISSION: "transmission near a dead point",
    STEP: "step of another size",
}
_LOOKS = ((HOLDS, BLUE, "o"), (FAILS, VERMILION, "s"), (UNDECIDED, GREEN, "^"))
_WIDE = 52  # characters in a line of a picture's title


def legs(results: StudyResults, _labelled: Labelled) -> Sections:
    """Sections of the page."""
    found = results.claims()
    sections = [asked(results), conclude(_sentences(found)), Section("Claims", [claim_table(found)])]
    gallery = influence_gallery(found)
    if gallery.pictures:
        sections.append(Section("What decides", [gallery]))
    return sections


def _sentences(found: LegClaims) -> list[str]:
    rejected = [f"{_REASONS[reason]} {count}" for reason, count in found.rejected.items()]
    drawn = found.legs + sum(found.rejected.values())
    sentences = [f"Of {drawn} drawn legs {found.legs} walk" + _tail(rejected) + "."]
    known = [result for result in found.claims if result.fraction is not None]
    groups = (
        ("Hold in more than 90 % of legs", [one for one in known if one.interval[0] > _ALWAYS]),
        ("Hold in less than 10 % of legs", [one for one in known if one.interval[1] < _NEVER]),
    )
    for head, group in groups:
        if group:
            sentences.append(f"{head}: {'; '.join(one.claim.text for one in group)}.")
    between = [one for one in known if one.interval[0] <= _ALWAYS and one.interval[1] >= _NEVER]
    if between:
        texts = [f"{one.claim.text} ({_fraction(one)})" for one in between]
        sentences.append(f"Depend on lengths and masses, or are not sure: {'; '.join(texts)}.")
    open_ones = sum(result.count(UNDECIDED) for result in found.claims)
    if found.legs:
        part = percent(open_ones / (found.legs * len(found.claims)))
        sentences.append(f"Within the scatter over runs, and so undecided: {part} of all claims in all legs.")
    return sentences


def _tail(rejected: Sequence[str]) -> str:
    return f"; rejected: {', '.join(rejected)}" if rejected else ""


def claim_table(found: LegClaims) -> Table:
    """Table of the claims against the fractions of legs, and what decides."""
    rows = [
        [
            result.claim.place,
            result.claim.text,
            *(str(result.count(state)) for state in (HOLDS, FAILS, UNDECIDED)),
            _fraction(result),
            result.file_state or "–",
            ", ".join(f"{one.factor} ({one.rank_correlation:+.2f})" for one in result.influences) or "–",
        ]
        for result in found.claims
    ]
    return Table(
        caption="The paper's claims in legs of other lengths and masses",
        head=[
            "clearance in",
            "claim",
            "holds",
            "fails",
            "undecided",
            "fraction of the decided [%]",
            "leg of the file",
            "decided by (rank correlation)",
        ],
        rows=rows,
        note=f"Undecided: within the scatter over runs (Student's t, {percent(CONFIDENCE)}). Fraction: with "
        f"Wilson's interval of {percent(CONFIDENCE)}. Decided by: factors whose rank correlation with the "
        "measure of the claim is significant after Holm's correction for all claims and factors; positive "
        "where a longer or heavier body favours the claim.",
        is_text=True,
    )


def _fraction(result: ClaimResult) -> str:
    if result.fraction is None:
        return "–"
    low, high = result.interval
    return f"{100.0 * result.fraction:.0f} ({100.0 * low:.0f} to {100.0 * high:.0f})"


def influence_gallery(found: LegClaims) -> Gallery:
    """For every claim that a factor decides, its measure in all legs over the strongest factor."""
    pictures = []
    for result in (one for one in found.claims if one.influences):
        first = result.influences[0]
        factor, values = found.factors[first.factor], [effect.value for effect in result.effects]
        figure = new_figure(4.6, 3.1)
        axes = figure.subplots()
        for state, colour, mark in _LOOKS:
            chosen = [i for i, each in enumerate(result.states) if each == state]
            axes.plot(
                factor[chosen], [values[i] for i in chosen], mark, color=colour, markersize=4.5,
                markeredgewidth=0.0, label=f"{state} ({len(chosen)})",
            )  # fmt: skip
        axes.axhline(0.0, color=INK, linewidth=0.8)
        if result.file_leg is not None:
            axes.plot(1.0, result.file_leg.value, "*", color=INK, markersize=13.0, markeredgecolor=PAPER)
        axes.margins(y=0.2)  # room for the legend
        tidy(axes)
        axes.set_xlabel(f"factor on the {first.factor}", fontsize=SMALL)
        axes.set_ylabel("measure of the claim", fontsize=SMALL)
        axes.set_title(textwrap.fill(result.claim.text, _WIDE), fontsize=SMALL, color=INK, fontweight="bold")
        axes.legend(fontsize=SMALL, frameon=False, ncols=3, handletextpad=0.1)
        alt = f"{result.claim.text}: over the {first.factor}, rank correlation {first.rank_correlation:+.2f}"
        pictures.append(Picture(image=png(figure), alt=alt))
    caption = (
        "A point for each leg; star: the leg of the file. The measure is the logarithm of the ratio that the "
        "claim says is above 1, or the difference of the fractions (of variance that repeats, of a turn); "
        "above 0 the claim holds."
    )
    return Gallery(pictures=pictures, caption=caption)

"""HTML pages and conclusions of three studies: wear over a life, legs of other sizes, and lubrication."""

import textwrap
from collections.abc import Sequence

import numpy as np

from leg_wear_monitor.report.figure import BLUE, GREEN, INK, PAPER, SMALL, VERMILION, new_figure, png, tidy
from leg_wear_monitor.report.page import Gallery, Picture, Section, Table
from leg_wear_monitor.report.study import findings
from leg_wear_monitor.report.study.sections import Sections, asked, conclude, cycle, wear, wear_gallery
from leg_wear_monitor.report.study.text import (
    MARKS,
    PICO,
    Labelled,
    joined,
    joint_table,
    number,
    percent,
    wear_table,
    with_spread,
    zone_text,
)
from leg_wear_monitor.studies.leg_tasks import DEAD_POINT, OPEN, STEP, TRANSMISSION
from leg_wear_monitor.studies.plan import (
    Arrays,
    clearance_joints_of,
    depth_per_cycle,
    joint_force,
    of_clearance_joints,
    spread,
)
from leg_wear_monitor.studies.results import (
    CONFIDENCE,
    FAILS,
    HOLDS,
    UNDECIDED,
    ClaimResult,
    LegClaims,
    StudyResults,
)
from leg_wear_monitor.wear import BUSHING, wear_zone

# The page of the wear study: wear of new joints, and its development over a life.


# Indices of the two stored states of a life: of the wear rates, new and at the end; of the depths, halfway
# and at the end.
_NEW, _END = 0, 1
_MILLION = 1.0e-6  # factor from cycles to millions of cycles


def life(results: StudyResults, labelled: Labelled) -> Sections:
    """Sections of the wear study's page."""
    lives = [(point.label, arrays) for point, arrays in results.of("life")]
    sentences = [*findings.wear(labelled), *findings.zones(labelled)]
    for label, arrays in lives:
        sentences += _life_sentences(label, arrays, several=len(lives) > 1)
    sections = [asked(results), conclude(sentences), wear(results, labelled)]
    if lives:
        sections += [_clearances(lives), _worn_surfaces(results, lives)]
    sections.append(cycle(results, results.of("response")))
    tables = [wear_table(labelled, "clearance joints"), joint_table(labelled, "clearance joints")]
    return [*sections, Section("Tables", tables + ([life_table(lives, "clearance joints")] if lives else []))]


def _life_sentences(label: str, arrays: Arrays, several: bool) -> list[str]:
    """Sentence on a life: its length, the opened joints, the change of the wear rate, the toe's error."""
    cycles, mean = arrays["cycles"][:, -1], arrays["clearance_mean_m"]
    opened = 1.0e3 * (mean[:, -1] - mean[:, 0]).mean(axis=0)
    first = clearance_joints_of(arrays)[int(opened.argmax())]
    parts = [
        f"{joint} {number(each)} mm" for joint, each in zip(clearance_joints_of(arrays), opened, strict=True)
    ]
    rates = [
        f"{joint} × {number(_rate(arrays, k, _END) / _rate(arrays, k, _NEW))}"
        for k, joint in enumerate(clearance_joints_of(arrays))
    ]
    sets = f"With clearance in {label}, " if several else ""
    toe = arrays["toe_position_m"]
    return [
        f"{sets}{first} opens first, after {with_spread(spread(cycles), _MILLION)} million cycles; opened "
        f"by then, on the mean: {', '.join(parts)}. Wear of a cycle at the end against new: "
        f"{', '.join(rates)}; largest toe error {number(1.0e3 * toe[:, 0].mean())} mm when new, "
        f"{number(1.0e3 * toe[:, -1].mean())} mm at the end."
    ]


def _rate(arrays: Arrays, k: int, when: int) -> float:
    """Mean wear depth of a joint's bushing per cycle [m]."""
    return float(arrays["rate_m_per_cycle"][:, when, k, BUSHING].mean())


def _clearances(lives: Labelled) -> Section:
    """Section with the mean and the largest clearance of every joint over the cycles."""
    pictures = []
    for label, arrays in lives:
        figure = new_figure(4.6, 3.0)
        axes = figure.subplots()
        for k, ((colour, mark), joint) in enumerate(zip(MARKS, clearance_joints_of(arrays), strict=False)):
            for run in range(len(arrays["cycles"])):
                cycles = _MILLION * arrays["cycles"][run]
                mean, largest = (1.0e3 * arrays[f"clearance_{kind}_m"][run, :, k] for kind in ("mean", "max"))
                axes.plot(cycles, mean, color=colour, linewidth=1.2, marker=mark, markevery=(run, 8),
                          markersize=4.0, label=joint if run == 0 else None)  # fmt: skip
                axes.plot(cycles, largest, color=colour, linewidth=0.8, linestyle=(0, (4, 2)))
        tidy(axes)
        axes.set_xlim(left=0.0)
        axes.set_xlabel("gait cycles [millions]", fontsize=SMALL)
        axes.set_ylabel("radial clearance [mm]", fontsize=SMALL)
        axes.set_title(label, fontsize=SMALL + 1.0, color=INK, fontweight="bold")
        axes.legend(fontsize=SMALL, frameon=False, ncols=5, handletextpad=0.3)
        pictures.append(
            Picture(image=png(figure), alt=f"Clearances of {label} over the life: {_first_and_last(arrays)}")
        )
    caption = (
        "Clearances as wear feeds back. Full: mean around the joint; dashed: where it is largest, both "
        "surfaces added up in their own frames. A line for each run."
    )
    return Section("Over a life", [Gallery(pictures=pictures, caption=caption)])


def _first_and_last(arrays: Arrays) -> str:
    """Mean clearance of each joint at the first and at the last point of the life."""
    mean = 1.0e3 * arrays["clearance_mean_m"].mean(axis=0)
    parts = [
        f"{joint} {mean[0, k]:.3f} to {mean[-1, k]:.3f} mm"
        for k, joint in enumerate(clearance_joints_of(arrays))
    ]
    return ", ".join(parts)


def _worn_surfaces(results: StudyResults, lives: Labelled) -> Section:
    worn = [
        (label, joint, np.asarray(arrays["depth_m"][:, _END, k], dtype=float))
        for label, arrays in lives
        for k, joint in enumerate(clearance_joints_of(arrays))
    ]
    return Section(
        "Worn surfaces", [wear_gallery(results.mechanism, worn, "Surfaces at the end of the life")]
    )


def life_table(lives: Labelled, head: str) -> Table:
    """Table of lives, a row for each clearance joint; ``head`` begins the title of the first column."""
    rows: list[Sequence[str]] = []
    for label, arrays in lives:
        for k, joint in enumerate(clearance_joints_of(arrays)):
            depth = arrays["depth_m"][:, _END, k, BUSHING].astype(float)
            rate = arrays["rate_m_per_cycle"][:, :, k, BUSHING].astype(float)
            rows.append([
                f"{label}: {joint}" if label != joint else joint,
                with_spread(spread(arrays["cycles"][:, -1]), _MILLION),
                with_spread(spread(arrays["clearance_mean_m"][:, -1, k]), 1.0e3),
                with_spread(spread(depth.max(axis=1)), 1.0e6),
                zone_text(wear_zone(depth.mean(axis=0))),
                with_spread(spread(rate[:, _NEW].mean(axis=1)), PICO),
                with_spread(spread(rate[:, _END].mean(axis=1)), PICO),
            ])  # fmt: skip
    return Table(
        caption="A life with wear fed back",
        head=(
            f"{head}, joint",
            "cycles [millions]",
            "mean clearance at the end [mm]",
            "greatest depth of the bushing [µm]",
            "zone with 90 % of the bushing's wear",
            "mean depth a cycle when new [pm]",
            "at the end [pm]",
        ),
        rows=rows,
        note="Mean and standard deviation over runs; the life ends where the joint that wears fastest has "
        "opened as far as the configuration says.",
    )


# The page of the study of other lengths and masses: in what fraction of drawn legs each claim holds.


# a claim whose fraction of legs is surely above the first or below the second hardly depends on the leg
_IN_MOST, _IN_FEW = 0.9, 0.1
_REASONS = {
    OPEN: "no assembly near that of the file",
    DEAD_POINT: "dead point",
    TRANSMISSION: "transmission near a dead point",
    STEP: "step of another size",
}
_STATE_MARKS = ((HOLDS, BLUE, "o"), (FAILS, VERMILION, "s"), (UNDECIDED, GREEN, "^"))
_TITLE_WIDTH = 52  # characters in a line of a picture's title


def legs(results: StudyResults, _labelled: Labelled) -> Sections:
    """Sections of this study's page."""
    found = results.claims()
    sections = [asked(results), conclude(_sentences(found)), Section("Claims", [claim_table(found)])]
    gallery = influence_gallery(found)
    if gallery.pictures:
        sections.append(Section("What decides", [gallery]))
    return sections


def _sentences(found: LegClaims) -> list[str]:
    """Conclusions: how many legs walk, and which claims hold in most of them, in few, or in some."""
    rejected = [f"{_REASONS[reason]} {count}" for reason, count in found.rejected.items()]
    drawn = found.legs + sum(found.rejected.values())
    sentences = [f"Of {drawn} drawn legs {found.legs} walk" + _rejected_text(rejected) + "."]
    known = [result for result in found.claims if result.fraction is not None]
    groups = (
        ("Hold in more than 90 % of legs", [one for one in known if one.interval[0] > _IN_MOST]),
        ("Hold in less than 10 % of legs", [one for one in known if one.interval[1] < _IN_FEW]),
    )
    for head, group in groups:
        if group:
            sentences.append(f"{head}: {'; '.join(one.claim.text for one in group)}.")
    between = [one for one in known if one.interval[0] <= _IN_MOST and one.interval[1] >= _IN_FEW]
    if between:
        texts = [f"{one.claim.text} ({_fraction_text(one)})" for one in between]
        sentences.append(f"Depend on lengths and masses, or are not sure: {'; '.join(texts)}.")
    open_ones = sum(result.count(UNDECIDED) for result in found.claims)
    if found.legs:
        part = percent(open_ones / (found.legs * len(found.claims)))
        sentences.append(f"Within the scatter over runs, and so undecided: {part} of all claims in all legs.")
    return sentences


def _rejected_text(rejected: Sequence[str]) -> str:
    """Rejected legs by reason, as the end of a sentence."""
    return f"; rejected: {', '.join(rejected)}" if rejected else ""


def claim_table(found: LegClaims) -> Table:
    """Table of the claims against the fractions of legs, and what decides."""
    rows = [
        [
            result.claim.place,
            result.claim.text,
            *(str(result.count(state)) for state in (HOLDS, FAILS, UNDECIDED)),
            _fraction_text(result),
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


def _fraction_text(result: ClaimResult) -> str:
    """Fraction of the decided legs in which a claim holds, with its interval [%]."""
    if result.fraction is None:
        return "–"
    low, high = result.interval
    return f"{100.0 * result.fraction:.0f} ({100.0 * low:.0f} to {100.0 * high:.0f})"


def influence_gallery(found: LegClaims) -> Gallery:
    """Pictures of claims that some factor influences: the measure of the claim over the strongest factor."""
    pictures = []
    for result in (one for one in found.claims if one.influences):
        first = result.influences[0]
        factor, values = found.factors[first.factor], [effect.value for effect in result.effects]
        figure = new_figure(4.6, 3.1)
        axes = figure.subplots()
        for state, colour, mark in _STATE_MARKS:
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
        axes.set_title(
            textwrap.fill(result.claim.text, _TITLE_WIDTH), fontsize=SMALL, color=INK, fontweight="bold"
        )
        axes.legend(fontsize=SMALL, frameon=False, ncols=3, handletextpad=0.1)
        alt = f"{result.claim.text}: over the {first.factor}, rank correlation {first.rank_correlation:+.2f}"
        pictures.append(Picture(image=png(figure), alt=alt))
    caption = (
        "A point for each leg; star: the leg of the file. The measure is the logarithm of the ratio that the "
        "claim says is above 1, or the difference of the fractions (of variance that repeats, of a turn); "
        "above 0 the claim holds."
    )
    return Gallery(pictures=pictures, caption=caption)


# The conclusions of the study of oil and grease, from its data.


_OPENS_M = 1.0e-4  # depth of a bushing up to which lives are compared


def lubrication(labelled: Labelled) -> list[str]:
    """Order of the joints by wear, life of the first, forces and contact, dry and with each viscosity."""
    (_, dry), *greased = labelled
    sentences = [f"{_capital(label)}: {_joints_by_wear(arrays)}" for label, arrays in labelled]
    for joint in clearance_joints_of(dry):
        loads = [
            f"{label} {with_spread(joint_force(arrays, 'p99_force_n', joint))}" for label, arrays in labelled
        ]
        sentences.append(
            f"Joint {joint}: force of contact and film, 99 % of the time below [N]: {'; '.join(loads)}."
        )
    for label, arrays in greased:
        sentences.append(f"With {label} {_against_dry(arrays, dry)}.")
    return sentences


def _capital(label: str) -> str:
    return label[:1].upper() + label[1:]


def _joints_by_wear(arrays: Arrays) -> str:
    """The joints by wear of the bushing, the largest first, and the life of the first one."""
    depths = {joint: depth_per_cycle(arrays, joint) for joint in clearance_joints_of(arrays)}
    worn = sorted((joint for joint in depths if depths[joint].mean > 0.0), key=lambda j: -depths[j].mean)
    if not worn:
        return "the films carry everything, and no joint wears."
    texts = [f"{joint} {with_spread(depths[joint], 1.0e12)}" for joint in worn]
    first = depths[worn[0]]
    cycles = _OPENS_M / first.mean
    scatter = cycles * first.deviation / first.mean
    rest = [joint for joint in depths if joint not in worn]
    idle = f"; {joined(rest)} {'does' if len(rest) == 1 else 'do'} not wear" if rest else ""
    return (
        f"greatest depth of the bushings [pm a cycle]: {', '.join(texts)}{idle}. At this rate {worn[0]} is "
        f"{1.0e3 * _OPENS_M:g} mm deep after {number(_MILLION * cycles)} ± {number(_MILLION * scatter)} "
        "million cycles."
    )


def _against_dry(arrays: Arrays, dry: Arrays) -> str:
    """Wear relative to that of the dry joints, and the fraction of time in contact."""
    wear_texts, contact_texts = [], []
    for joint in clearance_joints_of(dry):
        before, after = (
            of_clearance_joints(each, "archard_integral_j_per_cycle", joint).mean for each in (dry, arrays)
        )
        wear_texts.append(f"{joint} {percent(after / before)}" if before > 0.0 else f"{joint} –")
        contact_texts.append(
            f"{joint} {percent(of_clearance_joints(arrays, 'contact_fraction', joint).mean)}"
        )
    return (
        f"the wear, ∫ F |v| dt of the contact's share, is of the dry one: {', '.join(wear_texts)}; surfaces "
        f"touch for: {', '.join(contact_texts)} of the time"
    )

"""HTML page of a study, from the results in its directory: one template, and what is each study's own."""

import io
import textwrap
from collections.abc import Callable, Sequence
from typing import NamedTuple

import attrs
import numpy as np
from ruamel.yaml import YAML

from leg_wear_monitor.mechanism.materials import lacks_wear
from leg_wear_monitor.mechanism.position import build_linkage, one_cycle
from leg_wear_monitor.mechanism.reach import Reach
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.report.figure import (
    BLUE,
    GREEN,
    INK,
    PAPER,
    VERMILION,
    finish,
    new_figure,
    png,
)
from leg_wear_monitor.report.leg_picture import leg_picture
from leg_wear_monitor.report.leg_slider import leg_data, leg_slider, run_data
from leg_wear_monitor.report.page import (
    Fragment,
    Gallery,
    Page,
    Picture,
    Section,
    Sentences,
    Table,
    Text,
)
from leg_wear_monitor.report.study import findings
from leg_wear_monitor.report.study.chaos import (
    chaos_sections,
    chaos_sentences,
    estimates_of,
    exponent_sentences,
)
from leg_wear_monitor.report.study.figures import (
    Spreads,
    compare_gallery,
    curve_galleries,
    exponent_panel,
    life_gallery,
    panel_of_joints,
    panels_of,
    trend_gallery,
    wear_gallery,
)
from leg_wear_monitor.report.study.text import (
    END,
    MILLIONTH,
    claim_table,
    error_table,
    exponent_table,
    force_table,
    joined,
    life_table,
    wear_table,
)
from leg_wear_monitor.studies.kinds import STUDIES
from leg_wear_monitor.studies.plan import ARCHARD, DEPTH, Found, Sweep, clearance_joints_of, spread
from leg_wear_monitor.studies.results import FAILS, HOLDS, UNDECIDED, LegClaims, StudyResults

CLEARANCE_FRACTION = 0.3  # drawn clearance, as a fraction of the bushing's radius
_MOST_SHOWN = 6  # points whose curves and surfaces are drawn; of more, the first, the middle and the last
_ALT = "The leg at the chosen crank angle, with the contact forces in its clearance joints"


def study_page(results: StudyResults) -> Page:
    """The page of a study.

    Parameters
    ----------
    results : StudyResults
        Results; points may be missing.

    Returns
    -------
    Page
        Without any result, only the missing points are listed.
    """
    study = STUDIES[results.study]
    sections = _sections(results) if results.of("response") or results.of("leg") else []
    buffer = io.StringIO()
    YAML().dump(attrs.asdict(results.settings), buffer)
    return Page(
        title=f"{study.title}: {results.mechanism.name}",
        summary=study.question,
        sections=[*_notice(results), *sections],
        configuration=buffer.getvalue(),
        versions={**results.versions, "seed": str(results.settings.ensemble.seed)},
    )


def _notice(results: StudyResults) -> list[Section]:
    """Section on missing points: those that failed and those not computed yet; empty if none."""
    lines = [f"{label}: {fault}" for label, fault in results.faults]
    if results.missing:
        lines.append(f"Not computed yet: {joined(results.missing)}.")
    return [Section("Missing points", [Sentences(lines)])] if lines else []


class _Own(NamedTuple):
    """What the page of a study has of its own.

    Attributes
    ----------
    sentences : list of str
        Conclusions.
    sections : list of Section
        Pictures below them.
    head : str
        Title of the first column of the tables.
    tables : list of Table
        Further ones.
    """

    sentences: list[str]
    sections: list[Section]
    head: str = "clearance joints"
    tables: Sequence[Table] = ()


_OwnOf = Callable[[StudyResults, Found], _Own]


def _sections(results: StudyResults) -> list[Section]:
    """The template: question, conclusions, own pictures, a cycle, curves, wear and tables of the points."""
    found, sweep = results.of("response"), STUDIES[results.study].sweep
    own = (
        _swept(sweep, found)
        if sweep
        else _PAGES.get(results.study, _by(findings.disturbance))(results, found)
    )
    sections = [_asked(results), Section("Conclusions", [Sentences(own.sentences)]), *own.sections]
    if not found:
        return sections
    shown = found if len(found) <= _MOST_SHOWN else [found[0], found[len(found) // 2], found[-1]]
    what = "Wear of a million cycles of new joints, as a million times the mean wear of a cycle"
    worn = wear_gallery(results.mechanism, shown, what, lambda arrays: 1.0e6 * arrays[DEPTH])
    tables = [table(found, own.head) for table in (error_table, force_table, wear_table)]
    return [
        *sections,
        Section("One gait cycle", [_slider(results.mechanism, shown)]),
        Section("Curves of a cycle", curve_galleries(shown)),
        Section("Wear", [worn]),
        Section("Tables", [*tables, *own.tables]),
    ]


def _asked(results: StudyResults) -> Section:
    """Section that describes the ensemble and shows the leg."""
    ensemble = results.settings.ensemble
    text = (
        f"Each number is an ensemble of {ensemble.runs} runs that start at different crank angles with "
        f"their journals in different places; {ensemble.cycles} gait cycles of each are counted, after "
        f"{ensemble.skip_cycles} that are not. Motion with clearance is chaotic: a single run is an "
        "example."
    )
    joints = list(dict.fromkeys(name for point in results.points for name in point.clearance_joints))
    lacking = [joint for joint in joints if lacks_wear(results.mechanism.clearances[joint])]
    if lacking:
        text += f" Wear of {joined(lacking)} is not counted: the pair gives no wear coefficient."
    names = ", ".join(results.mechanism.joints)
    leg = Picture(
        image=png(leg_picture(results.mechanism, joints)),
        alt=f"The leg to scale, joints {names}, clearance in {joined(joints)}, path of its toe",
        caption=f"The leg to scale. Clearance joints of this study: {joined(joints)}.",
        wide=True,
    )
    return Section("Question", [Text(text), leg])


def _swept(sweep: Sweep, found: Found) -> _Own:
    values = [sweep.value(point) for point, _ in found]
    sentences = [
        *findings.disturbance(found),
        *findings.growth(values, found, sweep.quantity),
        *findings.regular_where(found),
    ]
    gallery = trend_gallery(panels_of(found), values, sweep.axis)
    return _Own(sentences, [Section(f"Over the {sweep.quantity}", [gallery])], sweep.quantity)


def _compared(found: Found, sentences: list[str], head: str = "clearance joints") -> _Own:
    gallery = compare_gallery(panels_of(found), [point.label for point, _ in found])
    return _Own(sentences, [Section("Side by side", [gallery])], head)


def _by(*of: Callable[[Found], list[str]], head: str = "clearance joints") -> _OwnOf:
    """Of a study whose points are shown side by side: the sentences of its questions."""

    def own(_results: StudyResults, found: Found) -> _Own:
        return (
            _compared(found, [text for each in of for text in each(found)], head) if found else _Own([], [])
        )

    return own


def _multi(_results: StudyResults, found: Found) -> _Own:
    *alone, whole = found
    sentences = [
        *findings.several_at_once(alone, whole[1]),
        *findings.disturbance(found),
        *findings.impacts([whole]),
        *findings.regularity([whole]),
        *findings.zones([whole]),
    ]
    return _compared(found, sentences)


def _load(results: StudyResults, found: Found) -> _Own:
    lives, exponents = results.of("life"), results.of("exponent")
    cycles = {point.label: spread(arrays["cycles"][:, -1]) for point, arrays in lives}
    estimates = estimates_of(exponents)
    by_label = {point.label: one for (point, _), one in zip(exponents, estimates, strict=True)}
    life = [cycles.get(point.label) for point, _ in found]
    panels = [
        *panels_of(found),
        panel_of_joints(found, "mean_force_n", "mean force [N]"),
        panel_of_joints(found, ARCHARD, "∫ F |v| dt [J a cycle]"),
        Spreads("life of the joint that opens first [million cycles]", {"": life}, MILLIONTH),
        exponent_panel([by_label.get(point.label) for point, _ in found]),
    ]
    values = [float(point.settings["ground_n"]) for point, _ in found]
    gallery = trend_gallery(panels, values, "vertical force, peak [N]")
    gallery = attrs.evolve(gallery, caption=f"{gallery.caption} Exponents: bars of two standard errors.")
    sentences = [
        *findings.load(found),
        *findings.lives(lives),
        *exponent_sentences(exponents),
        *findings.regular_where(found),
    ]
    tables = [exponent_table(exponents, estimates, "load")] if exponents else []
    tables += [life_table(lives, "load")] if lives else []
    return _Own(sentences, [Section("Over the load", [gallery])], "load", tables)


def _wear(results: StudyResults, found: Found) -> _Own:
    lives = results.of("life")
    sentences = [*findings.wear(found), *findings.zones(found), *findings.lives(lives)]
    if not lives:
        return _Own(sentences, [])
    what = "Surfaces at the end of the life"
    worn = wear_gallery(results.mechanism, lives, what, lambda arrays: arrays["depth_m"][:, END])
    sections = [Section("Over a life", [life_gallery(lives)]), Section("Worn surfaces", [worn])]
    return _Own(sentences, sections, tables=[life_table(lives, "clearance joints")])


def _chaos(results: StudyResults, found: Found) -> _Own:
    sentences = chaos_sentences(results) + findings.regularity(found)
    exponents = results.of("exponent")
    table = [exponent_table(exponents, estimates_of(exponents), "clearance joints")] if exponents else []
    return _Own(sentences, chaos_sections(results), tables=table)


def _legs(results: StudyResults, _found: Found) -> _Own:
    claims = results.claims()
    gallery = influence_gallery(claims)
    decides = [Section("What decides", [gallery])] if gallery.pictures else []
    return _Own(findings.claims(claims), [Section("Claims", [claim_table(claims)]), *decides])


_PAGES: dict[str, _OwnOf] = {
    "location": _by(findings.disturbance, findings.places),
    "multi": _multi,
    "laws": _by(findings.laws, head="law"),
    "load": _load,
    "wear": _wear,
    "chaos": _chaos,
    "legs": _legs,
}


def influence_gallery(claims: LegClaims) -> Gallery:
    """Pictures of claims that some factor influences: the measure of the claim over the strongest factor."""
    pictures = []
    for result in (one for one in claims.claims if one.influences):
        first = result.influences[0]
        factor, values = claims.factors[first.factor], np.array([one.value for one in result.effects])
        figure = new_figure(4.6, 3.1)
        axes = figure.subplots()
        for state, colour, mark in ((HOLDS, BLUE, "o"), (FAILS, VERMILION, "s"), (UNDECIDED, GREEN, "^")):
            chosen = np.array(result.states) == state
            axes.plot(
                factor[chosen], values[chosen], mark, color=colour, markersize=4.5, markeredgewidth=0.0,
                label=f"{state} ({chosen.sum()})",
            )  # fmt: skip
        axes.axhline(0.0, color=INK, linewidth=0.8)
        if result.file_leg is not None:
            axes.plot(1.0, result.file_leg.value, "*", color=INK, markersize=13.0, markeredgecolor=PAPER)
        axes.margins(y=0.2)  # room for the legend
        title = textwrap.fill(result.claim.text, 52)
        finish(axes, title, f"factor on the {first.factor}", "measure of the claim", columns=3)
        alt = f"{result.claim.text}: over the {first.factor}, rank correlation {first.rank_correlation:+.2f}"
        pictures.append(Picture(image=png(figure), alt=alt))
    caption = (
        "A point for each leg; star: the leg of the file. The measure is the logarithm of the ratio that the "
        "claim says is above 1, or the difference of the fractions (of variance that repeats, of a turn); "
        "above 0 the claim holds."
    )
    return Gallery(pictures=pictures, caption=caption)


def _slider(mechanism: Mechanism, found: Found) -> Fragment:
    """Interactive picture of the leg over a gait cycle: one cycle of an example run of each point."""
    linkage, speed_rpm = build_linkage(mechanism), found[0][0].speed_rpm
    frames = len(found[0][1]["example_eccentricity_m"])
    motion = one_cycle(linkage, frames, speed_rpm * np.pi / 30.0)  # ideal: only its direction matters
    reach, runs = Reach(linkage, 1, motion.crank_angle, motion.q, turns=True), []
    for point, arrays in found:
        places, forces_n = (
            arrays["example_eccentricity_m"] / point.clearance_m,
            arrays["example_contact_force_n"],
        )
        run = run_data(point.label, clearance_joints_of(arrays), forces_n, places)
        runs.append(run | {"clearance_mm": round(1.0e3 * point.clearance_m, 4)})
    longest_n = max(run["largest_n"] for run in runs)
    data = leg_data(reach) | {"digits": 0, "skip": 2, "runs": runs, "longest_n": longest_n}
    radius = mechanism.clearances[clearance_joints_of(found[0][1])[0]].bushing_radius
    factors = [CLEARANCE_FRACTION * radius / point.clearance_m for point, _ in found]
    low, high = min(factors), max(factors)
    factor = f"{low:.3g}" if high - low < 1.0e-6 * high else f"{low:.3g} to {high:.3g}"
    caption = (
        "One gait cycle of one run, an example. The leg is to scale, its bodies in ideal positions: "
        "clearance moves them by millimetres. Arrows: force of the bushing on the pin; their length grows "
        f"with the root of the force, up to {longest_n:.0f} N. Circles: each pin in its bushing, the "
        f"clearance magnified {factor} times, with the path of the pin's centre over the cycle."
    )
    return leg_slider(data, _ALT, caption)

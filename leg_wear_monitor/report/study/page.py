"""HTML page of a study, from the results in its directory."""

import io
from collections.abc import Callable

import attrs
from ruamel.yaml import YAML

from leg_wear_monitor.report.page import Page, Section, Sentences
from leg_wear_monitor.report.study import findings
from leg_wear_monitor.report.study.chaos_page import chaos, estimates_of, exponent_table, foretold
from leg_wear_monitor.report.study.sections import (
    Sections,
    asked,
    conclude,
    curves,
    cycle,
    ends_and_middle,
    tables,
    wear,
)
from leg_wear_monitor.report.study.text import (
    PICO,
    Labelled,
    Panel,
    compare_gallery,
    joined,
    number,
    trend_gallery,
    with_spread,
    zone_text,
)
from leg_wear_monitor.report.study.wear_page import legs, life, life_table, lubrication
from leg_wear_monitor.studies.execution import STUDIES
from leg_wear_monitor.studies.life_tasks import Estimate
from leg_wear_monitor.studies.plan import (
    Arrays,
    Spread,
    Sweep,
    clearance_joints_of,
    depth_per_cycle,
    joint_force,
    of_clearance_joints,
    spread,
    worst_zone,
)
from leg_wear_monitor.studies.results import StudyResults

# HTML page of the study of the ground's load.


_HEAD = "load"
_MILLION = 1.0e-6


def load(results: StudyResults, labelled: Labelled) -> Sections:
    """Sections of the load study's page."""
    lives = [(point.label, arrays) for point, arrays in results.of("life")]
    exponents = [(point.label, arrays) for point, arrays in results.of("exponent")]
    estimates = estimates_of(exponents)
    sentences = [*_order(labelled), *_change(labelled), *_zones(labelled)]
    sentences += [_of_a_life(label, arrays) for label, arrays in lives]
    sentences += [foretold(label, one) for (label, _), one in zip(exponents, estimates, strict=True)]
    chosen = ends_and_middle(results.of("response"))
    shown = [(point.label, arrays) for point, arrays in chosen]
    more = [*_joint_panels(labelled), _life_panel(labelled, lives)]
    more.append(_exponent_panel(labelled, dict(zip(dict(exponents), estimates, strict=True))))
    values = [float(point.settings["ground_n"]) for point, _ in results.of("response")]
    gallery = trend_gallery(values, "vertical force, peak [N]", [arrays for _, arrays in labelled], more)
    gallery = attrs.evolve(gallery, caption=f"{gallery.caption} Exponents: bars of two standard errors.")
    table = tables(labelled, _HEAD)
    further = [exponent_table(exponents, estimates, _HEAD)] if exponents else []
    further += [life_table(lives, _HEAD)] if lives else []
    return [
        asked(results),
        conclude(sentences + findings.regular_where(labelled)),
        Section("Over the load", [gallery]),
        cycle(results, chosen),
        curves(shown),
        wear(results, shown),
        Section(table.title, [*table.parts, *further]),
    ]


def _order(labelled: Labelled) -> list[str]:
    """The joints by worn depth under each load."""
    texts = []
    for label, arrays in labelled:
        depth = {joint: depth_per_cycle(arrays, joint) for joint in clearance_joints_of(arrays)}
        ranked = sorted(depth, key=lambda joint: -depth[joint].mean)
        texts.append(f"{label}: {' > '.join(ranked)}")
    return [f"Joints by the greatest wear depth of a cycle, at {'; '.join(texts)}."]


def _change(labelled: Labelled) -> list[str]:
    """Force and wear of each joint under the largest load, against the least one."""
    (first, before), (last, after) = labelled[0], labelled[-1]
    sentences = []
    for joint in clearance_joints_of(before):
        force = [joint_force(each, "mean_force_n", joint) for each in (before, after)]
        depth = [depth_per_cycle(each, joint) for each in (before, after)]
        volume = [
            of_clearance_joints(each, "archard_integral_j_per_cycle", joint) for each in (before, after)
        ]
        grown = [number(two.mean / one.mean) for one, two in (force, volume, depth)]
        sentences.append(
            f"Joint {joint}, from {first} to {last}: mean force {with_spread(force[0])} to "
            f"{with_spread(force[1])} N (× {grown[0]}), worn volume × {grown[1]}, greatest depth "
            f"{with_spread(depth[0], PICO)} to {with_spread(depth[1], PICO)} pm a cycle (× {grown[2]})."
        )
    return sentences


def _zones(labelled: Labelled) -> list[str]:
    """Where half of each joint's wear is, under each load."""
    return [
        f"Joint {joint}, zone that holds half of the bushing's wear: "
        + "; ".join(f"{label} {zone_text(worst_zone(arrays, joint, 0.5))}" for label, arrays in labelled)
        + "."
        for joint in clearance_joints_of(labelled[0][1])
    ]


def _of_a_life(label: str, arrays: Arrays) -> str:
    """Which joint opens first, when, and how far the others are by then."""
    mean, names = arrays["clearance_mean_m"], clearance_joints_of(arrays)
    opened = 1.0e3 * (mean[:, -1] - mean[:, 0]).mean(axis=0)
    first = int(opened.argmax())
    others = [f"{name} {number(opened[k])}" for k, name in enumerate(names) if k != first]
    rest = f"; by then the others by {joined(others)} mm" if others else ""
    cycles = with_spread(spread(arrays["cycles"][:, -1]), _MILLION)
    return f"{label}: {names[first]} opens by {number(opened[first])} mm in {cycles} million cycles{rest}."


def _joint_panels(labelled: Labelled) -> list[Panel]:
    names = clearance_joints_of(labelled[0][1])
    force: dict[str, list[Spread | None]] = {
        name: [joint_force(arrays, "mean_force_n", name) for _, arrays in labelled] for name in names
    }
    volume: dict[str, list[Spread | None]] = {
        name: [of_clearance_joints(arrays, "archard_integral_j_per_cycle", name) for _, arrays in labelled]
        for name in names
    }
    return [Panel("mean force [N]", force, 1.0), Panel("∫ F |v| dt [J a cycle]", volume, 1.0)]


def _life_panel(labelled: Labelled, lives: Labelled) -> Panel:
    cycles = {label: spread(arrays["cycles"][:, -1]) for label, arrays in lives}
    line = [cycles.get(label) for label, _ in labelled]
    return Panel("life of the joint that opens first [million cycles]", {"": line}, _MILLION)


def _exponent_panel(labelled: Labelled, estimates: dict[str, Estimate]) -> Panel:
    """Bars of two standard errors."""
    line: list[Spread | None] = []
    for label, _ in labelled:
        one = estimates.get(label)
        around = (one.value - 2.0 * one.error, one.value + 2.0 * one.error) if one else None
        line.append(Spread(one.value, one.error, *around) if one and around else None)
    return Panel("largest Lyapunov exponent [1/cycle]", {"": line}, 1.0)


def study_page(results: StudyResults) -> Page:
    """The page of a study.

    Raises
    ------
    KeyError
        If this version does not know the study.
    """
    labelled = [(point.label, arrays) for point, arrays in results.of("response")]
    study = STUDIES[results.study]
    sections = _sections(study.sweep, results, labelled) if labelled or results.of("leg") else []
    buffer = io.StringIO()
    YAML().dump(attrs.asdict(results.settings), buffer)
    return Page(
        title=f"{study.title}: {results.mechanism.name}",
        summary=study.question,
        sections=[*_notice(results), *sections],
        configuration=buffer.getvalue(),
        versions={**results.versions, "seed": str(results.settings.ensemble.seed)},
    )


def _notice(results: StudyResults) -> Sections:
    """Section on missing points: those that failed and those not computed yet; empty if none."""
    lines = [f"{label}: {fault}" for label, fault in results.faults]
    if results.missing:
        lines.append(f"Not computed yet: {joined(results.missing)}.")
    return [Section("Missing points", [Sentences(lines)])] if lines else []


def _sections(sweep: Sweep | None, results: StudyResults, labelled: Labelled) -> Sections:
    return _PAGES[results.study](results, labelled) if sweep is None else _swept(sweep, results, labelled)


def _swept(sweep: Sweep, results: StudyResults, labelled: Labelled) -> Sections:
    values = [sweep.value(point) for point, _ in results.of("response")]
    chosen = ends_and_middle(results.of("response"))
    shown = [(point.label, arrays) for point, arrays in chosen]
    sentences = [
        *findings.disturbance(labelled),
        *findings.growth(values, labelled, sweep.quantity),
        *findings.regular_where(labelled),
    ]
    arrays = [each for _, each in labelled]
    return [
        asked(results),
        conclude(sentences),
        Section(f"Over the {sweep.quantity}", [trend_gallery(values, sweep.axis, arrays)]),
        cycle(results, chosen),
        curves(shown),
        wear(results, shown),
        tables(labelled, sweep.quantity),
    ]


def _compared(results: StudyResults, labelled: Labelled, sentences: list[str], head: str) -> Sections:
    chosen = results.of("response")
    shown = labelled if len(labelled) <= 6 else ends_and_middle(list(labelled))
    return [
        asked(results),
        conclude(sentences),
        Section("Side by side", [compare_gallery(labelled)]),
        cycle(results, chosen if len(chosen) <= 6 else ends_and_middle(chosen)),
        curves(shown),
        wear(results, shown),
        tables(labelled, head),
    ]


def _location(results: StudyResults, labelled: Labelled) -> Sections:
    return _compared(
        results, labelled, findings.disturbance(labelled) + findings.places(labelled), "clearance joints"
    )


def _multi(results: StudyResults, labelled: Labelled) -> Sections:
    *parts, (_, whole) = labelled
    sentences = [
        *findings.worst_joint(whole),
        *findings.superposition(parts, whole),
        *findings.disturbance(labelled),
        *findings.impacts(labelled[-1:]),
        *findings.regularity(labelled[-1:]),
        *findings.zones(labelled[-1:]),
    ]
    return _compared(results, labelled, sentences, "clearance joints")


def _laws(results: StudyResults, labelled: Labelled) -> Sections:
    return _compared(results, labelled, findings.laws(labelled), "law")


def _lubrication(results: StudyResults, labelled: Labelled) -> Sections:
    return _compared(results, labelled, lubrication(labelled) + findings.disturbance(labelled), "lubricant")


_PAGES: dict[str, Callable[[StudyResults, Labelled], Sections]] = {
    "location": _location,
    "multi": _multi,
    "laws": _laws,
    "lubrication": _lubrication,
    "load": load,
    "wear": life,
    "chaos": chaos,
    "legs": legs,
}

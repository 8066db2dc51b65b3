"""HTML page of a study, from the results in its directory."""

import io
from collections.abc import Callable

import attrs
from ruamel.yaml import YAML

from leg_wear_monitor.report.page import Page, Section
from leg_wear_monitor.report.parts import Sentences
from leg_wear_monitor.report.study import findings
from leg_wear_monitor.report.study.chaos_page import chaos
from leg_wear_monitor.report.study.legs_page import legs
from leg_wear_monitor.report.study.load_page import load
from leg_wear_monitor.report.study.lubrication_page import lubrication
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
from leg_wear_monitor.report.study.text import Labelled, joined
from leg_wear_monitor.report.study.trends import compare_gallery, trend_gallery
from leg_wear_monitor.report.study.wear_page import life
from leg_wear_monitor.studies.plan.settings import STUDIES
from leg_wear_monitor.studies.plan.study import Sweep
from leg_wear_monitor.studies.results import StudyResults


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

"""The page of a study, from what lies in its directory."""

import io
from collections.abc import Callable
from typing import Any

from ruamel.yaml import YAML

from leg_wear_monitor.report.page import Page, Section, Sentences
from leg_wear_monitor.report.study import findings
from leg_wear_monitor.report.study.chaos_page import chaos
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
from leg_wear_monitor.studies.storage.store import StudyResults

_TITLES = {
    "size": "Clearance size",
    "speed": "Crank speed",
    "location": "Where the clearance is",
    "wear": "Where the joints wear",
    "multi": "Several clearances at once",
    "chaos": "How far the motion can be foretold",
    "laws": "Contact and friction laws",
}
_ASKED = {
    "size": "What does the size of a clearance do to the leg's motion, its impacts, its drive and its wear?",
    "speed": "What does the crank's speed do to a leg with clearance?",
    "location": "What does the same clearance do in the hip, at the knee and in the foot?",
    "wear": "Where on bushing and journal does each joint wear, and what becomes of it over a life?",
    "multi": "Do clearances in all these joints do what each does alone, added up, and which joint is worst?",
    "chaos": "How disordered is the motion with clearance, and how soon is a small error a large one?",
    "laws": "How much do results depend on the laws of normal force and friction?",
}


def study_page(results: StudyResults) -> Page:
    """The page of a study.

    Raises
    ------
    KeyError
        For a study that this version has no page of.
    """
    labelled = [(point.label, arrays) for point, arrays in results.of("response")]
    sections = _PAGES[results.study](results, labelled) if labelled else []
    buffer = io.StringIO()
    YAML().dump(_plain(results.settings), buffer)
    return Page(
        title=f"{_TITLES[results.study]}: {results.mechanism.name}",
        summary=_ASKED[results.study],
        sections=[*_notice(results), *sections],
        configuration=buffer.getvalue(),
        versions={**results.versions, "seed": str(results.settings["ensemble"]["seed"])},
    )


def _plain(value: Any) -> Any:
    """Settings as YAML writes them."""
    if isinstance(value, dict):
        return {key: _plain(entry) for key, entry in value.items()}
    return [_plain(entry) for entry in value] if isinstance(value, list | tuple) else value


def _notice(results: StudyResults) -> Sections:
    """What is not there: points that failed or are still to come."""
    lines = [f"{label}: {fault}" for label, fault in results.faults]
    if results.missing:
        lines.append(f"Not computed yet: {joined(results.missing)}.")
    return [Section("What is missing", [Sentences(lines)])] if lines else []


def _sweep(results: StudyResults, labelled: Labelled, axis: str, what: str, values: list[float]) -> Sections:
    chosen = ends_and_middle(results.of("response"))
    shown = [(point.label, arrays) for point, arrays in chosen]
    sentences = [
        *findings.disturbance(labelled),
        *findings.growth(values, labelled, what),
        *findings.regular_where(labelled),
    ]
    arrays = [each for _, each in labelled]
    return [
        asked(results),
        conclude(sentences),
        Section(f"Over the {what}", [trend_gallery(values, axis, arrays)]),
        cycle(results, chosen),
        curves(shown),
        wear(results, shown),
        tables(labelled, what),
    ]


def _size(results: StudyResults, labelled: Labelled) -> Sections:
    values = [1.0e3 * point.settings["clearance_m"] for point, _ in results.of("response")]
    return _sweep(results, labelled, "radial clearance [mm]", "clearance", values)


def _speed(results: StudyResults, labelled: Labelled) -> Sections:
    values = [point.settings["speed_rpm"] for point, _ in results.of("response")]
    return _sweep(results, labelled, "crank speed [rpm]", "speed", values)


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
        results, labelled, findings.disturbance(labelled) + findings.places(labelled), "clearance_joints"
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
    return _compared(results, labelled, sentences, "clearance_joints")


def _laws(results: StudyResults, labelled: Labelled) -> Sections:
    return _compared(results, labelled, findings.laws(labelled), "law")


_PAGES: dict[str, Callable[[StudyResults, Labelled], Sections]] = {
    "size": _size,
    "speed": _speed,
    "location": _location,
    "multi": _multi,
    "laws": _laws,
    "wear": life,
    "chaos": chaos,
}

"""The page of a study, from what lies in its directory."""

import io
from collections.abc import Callable
from typing import Any

from ruamel.yaml import YAML

from leg_wear_monitor.report import findings
from leg_wear_monitor.report.curves import curve_galleries
from leg_wear_monitor.report.figure import png
from leg_wear_monitor.report.leg_picture import leg_picture
from leg_wear_monitor.report.leg_slider import leg_slider
from leg_wear_monitor.report.page import Findings, Page, Picture, Section, Text
from leg_wear_monitor.report.study_text import Labelled, error_table, joined, joint_table, wear_table
from leg_wear_monitor.report.trends import compare_gallery, trend_gallery
from leg_wear_monitor.report.wear_pictures import wear_gallery
from leg_wear_monitor.studies.point import Point
from leg_wear_monitor.studies.store import StudyResults
from leg_wear_monitor.studies.summary import loose_of

Sections = list[Section]

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
    return [Section("What is missing", [Findings(lines)])] if lines else []


def _asked(results: StudyResults) -> Section:
    """The ensemble in words, and the leg."""
    ensemble = results.settings["ensemble"]
    text = (
        f"Each number is an ensemble of {ensemble['runs']} runs that start at different crank angles with "
        f"their journals in different places; {ensemble['cycles']} gait cycles of each are counted, after "
        f"{ensemble['skip_cycles']} that are not. Motion with clearance is chaotic: a single run is an "
        "example."
    )
    loose = list(dict.fromkeys(name for point in results.points for name in point.settings["loose"]))
    names = ", ".join(results.mechanism.joints)
    leg = Picture(
        image=png(leg_picture(results.mechanism, loose)),
        alt=f"The leg to scale with its joints {names}; {joined(loose)} are loose; and the path of its toe",
        caption=f"The leg to scale. Loose in this study: {joined(loose)}.",
        wide=True,
    )
    return Section("What was asked", [Text(text), leg])


def _conclude(sentences: list[str]) -> Section:
    return Section("What to conclude", [Findings(sentences)])


def _cycle(results: StudyResults, chosen: list[tuple[Point, Any]]) -> Section:
    """The leg to be moved by hand."""
    runs = [(point.label, arrays) for point, arrays in chosen]
    clearances = [_clearance(results, point) for point, _ in chosen]
    return Section(
        "One gait cycle",
        [leg_slider(results.mechanism, runs, clearances, chosen[0][0].settings["speed_rpm"])],
    )


def _clearance(results: StudyResults, point: Point) -> float:
    return float(point.settings["clearance_m"])


def _curves(labelled: Labelled) -> Section:
    return Section("Curves of a cycle", curve_galleries(labelled))


def _tables(labelled: Labelled, head: str) -> Section:
    tables = [error_table(labelled, head), joint_table(labelled, head), wear_table(labelled, head)]
    return Section("Tables", tables)


def _wear(results: StudyResults, labelled: Labelled) -> Section:
    worn = [
        (label, joint, 1.0e6 * arrays["wear_depth_m_per_cycle"][:, k])
        for label, arrays in labelled
        for k, joint in enumerate(loose_of(arrays))
    ]
    what = "Wear of a million cycles of new joints, as a million times the mean wear of a cycle"
    return Section("Wear", [wear_gallery(results.mechanism, worn, what)])


def _ends_and_middle(pairs: list[Any]) -> list[Any]:
    return pairs if len(pairs) <= 3 else [pairs[0], pairs[len(pairs) // 2], pairs[-1]]


def _sweep(results: StudyResults, labelled: Labelled, axis: str, what: str, values: list[float]) -> Sections:
    chosen = _ends_and_middle(results.of("response"))
    shown = [(point.label, arrays) for point, arrays in chosen]
    sentences = findings.disturbance(labelled) + findings.growth(values, labelled, what)
    arrays = [each for _, each in labelled]
    return [
        _asked(results),
        _conclude(sentences),
        Section(f"Over the {what}", [trend_gallery(values, axis, arrays)]),
        _cycle(results, chosen),
        _curves(shown),
        _wear(results, shown),
        _tables(labelled, what),
    ]


def _size(results: StudyResults, labelled: Labelled) -> Sections:
    values = [1.0e3 * point.settings["clearance_m"] for point, _ in results.of("response")]
    return _sweep(results, labelled, "radial clearance [mm]", "clearance", values)


def _speed(results: StudyResults, labelled: Labelled) -> Sections:
    values = [point.settings["speed_rpm"] for point, _ in results.of("response")]
    return _sweep(results, labelled, "crank speed [rpm]", "speed", values)


def _compared(results: StudyResults, labelled: Labelled, sentences: list[str], head: str) -> Sections:
    chosen = results.of("response")
    shown = labelled if len(labelled) <= 6 else _ends_and_middle(list(labelled))
    return [
        _asked(results),
        _conclude(sentences),
        Section("Side by side", [compare_gallery(labelled)]),
        _cycle(results, chosen if len(chosen) <= 6 else _ends_and_middle(chosen)),
        _curves(shown),
        _wear(results, shown),
        _tables(labelled, head),
    ]


def _location(results: StudyResults, labelled: Labelled) -> Sections:
    return _compared(results, labelled, findings.disturbance(labelled) + findings.places(labelled), "loose")


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
    return _compared(results, labelled, sentences, "loose")


def _laws(results: StudyResults, labelled: Labelled) -> Sections:
    return _compared(results, labelled, findings.laws(labelled), "law")


_PAGES: dict[str, Callable[[StudyResults, Labelled], Sections]] = {
    "size": _size,
    "speed": _speed,
    "location": _location,
    "multi": _multi,
    "laws": _laws,
}

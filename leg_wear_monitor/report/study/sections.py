"""Sections that are common to the pages of several studies."""

from typing import Any

from leg_wear_monitor.report.figures.figure import png
from leg_wear_monitor.report.figures.leg_picture import leg_picture
from leg_wear_monitor.report.page import Section
from leg_wear_monitor.report.parts import Picture, Sentences, Text
from leg_wear_monitor.report.study.curves import curve_galleries
from leg_wear_monitor.report.study.leg_slider import leg_slider
from leg_wear_monitor.report.study.text import Labelled, error_table, joined, joint_table, wear_table
from leg_wear_monitor.report.study.wear_pictures import wear_gallery
from leg_wear_monitor.studies.point import Point
from leg_wear_monitor.studies.results import StudyResults
from leg_wear_monitor.studies.summary import clearance_joints_of

Sections = list[Section]


def asked(results: StudyResults) -> Section:
    """Section that describes the ensemble and shows the leg."""
    ensemble = results.settings.ensemble
    text = (
        f"Each number is an ensemble of {ensemble.runs} runs that start at different crank angles with "
        f"their journals in different places; {ensemble.cycles} gait cycles of each are counted, after "
        f"{ensemble.skip_cycles} that are not. Motion with clearance is chaotic: a single run is an "
        "example."
    )
    clearance_joints = list(
        dict.fromkeys(name for point in results.points for name in point.clearance_joints)
    )
    names = ", ".join(results.mechanism.joints)
    leg = Picture(
        image=png(leg_picture(results.mechanism, clearance_joints)),
        alt=f"The leg to scale, joints {names}, clearance in {joined(clearance_joints)}, path of its toe",
        caption=f"The leg to scale. Clearance joints of this study: {joined(clearance_joints)}.",
        wide=True,
    )
    return Section("Question", [Text(text), leg])


def conclude(sentences: list[str]) -> Section:
    """Section of conclusions."""
    return Section("Conclusions", [Sentences(sentences)])


def cycle(results: StudyResults, chosen: list[tuple[Point, Any]]) -> Section:
    """Section with the interactive leg, for the chosen points."""
    runs = [(point.label, arrays) for point, arrays in chosen]
    clearances = [point.clearance_m for point, _ in chosen]
    return Section(
        "One gait cycle",
        [leg_slider(results.mechanism, runs, clearances, chosen[0][0].speed_rpm)],
    )


def curves(labelled: Labelled) -> Section:
    """Section with the curves over a gait cycle of every point."""
    return Section("Curves of a cycle", curve_galleries(labelled))


def tables(labelled: Labelled, head: str) -> Section:
    """Section with tables of errors, forces and wear of every point; ``head`` titles the first column."""
    tables = [error_table(labelled, head), joint_table(labelled, head), wear_table(labelled, head)]
    return Section("Tables", tables)


def wear(results: StudyResults, labelled: Labelled) -> Section:
    """Section with the wear per cycle of every clearance joint of every point."""
    worn = [
        (label, joint, 1.0e6 * arrays["wear_depth_m_per_cycle"][:, k])
        for label, arrays in labelled
        for k, joint in enumerate(clearance_joints_of(arrays))
    ]
    what = "Wear of a million cycles of new joints, as a million times the mean wear of a cycle"
    return Section("Wear", [wear_gallery(results.mechanism, worn, what)])


def ends_and_middle(pairs: list[Any]) -> list[Any]:
    """The first, middle and last entry of more than three, else all."""
    return pairs if len(pairs) <= 3 else [pairs[0], pairs[len(pairs) // 2], pairs[-1]]

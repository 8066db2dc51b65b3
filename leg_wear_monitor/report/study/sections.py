"""Sections that are common to the pages of several studies."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import build_linkage, one_cycle
from leg_wear_monitor.mechanism.reach import Reach
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.report.figure import (
    BLUE,
    INK,
    PALE,
    SMALL,
    VERMILION,
    draw_section,
    length_unit,
    new_figure,
    png,
    tidy,
)
from leg_wear_monitor.report.leg_picture import leg_data, leg_picture
from leg_wear_monitor.report.page import (
    Gallery,
    Live,
    Picture,
    Section,
    Sentences,
    Text,
    render,
    template_text,
)
from leg_wear_monitor.report.study.text import (
    Labelled,
    curve_galleries,
    error_table,
    joined,
    joint_table,
    wear_table,
    zone_text,
)
from leg_wear_monitor.studies.plan import Arrays, Point, clearance_joints_of
from leg_wear_monitor.studies.results import StudyResults
from leg_wear_monitor.wear import BUSHING, JOURNAL, wear_zone

# Interactive picture of the leg over a gait cycle: contact forces, and each journal in its bushing.


_ALT = "The leg at the chosen crank angle, with the contact forces in its clearance joints"
CLEARANCE_FRACTION = 0.3  # drawn clearance, as a fraction of the bushing's radius


def leg_slider(mechanism: Mechanism, runs: Labelled, clearances_m: Sequence[float], speed_rpm: float) -> Live:
    """Interactive picture of the leg with one cycle of an example run of each point.

    Parameters
    ----------
    mechanism : Mechanism
    runs : sequence of (label, arrays)
        Results of `leg_wear_monitor.studies.leg_tasks.run_ensemble`.
    clearances_m : sequence of float
        Radial clearance of each run [m].
    speed_rpm : float
        Crank speed [rpm]; the drawn positions are ideal and depend on its sign only.

    Returns
    -------
    Live
    """
    linkage = build_linkage(mechanism)
    frames = len(runs[0][1]["example_eccentricity_m"])
    motion = one_cycle(linkage, frames, speed_rpm * np.pi / 30.0)
    reach = Reach(linkage, 1, motion.crank_angle, motion.q, turns=True)
    data = leg_data(reach) | {"digits": 0, "skip": 2}
    data["runs"] = [
        _run_data(label, arrays, clearance)
        for (label, arrays), clearance in zip(runs, clearances_m, strict=True)
    ]
    data["longest_n"] = max(float(np.abs(run["largest_n"])) for run in data["runs"])
    radius = _bushing_radius(mechanism, data["runs"])
    factors = [CLEARANCE_FRACTION * radius / clearance for clearance in clearances_m]
    return Live(
        markup=render("leg_slider.html", data=data, names=[run["label"] for run in data["runs"]], alt=_ALT),
        script=template_text("leg_slider.js"),
        caption=_caption(factors, data["longest_n"]),
    )


def _caption(factors: Sequence[float], longest_n: float) -> str:
    low, high = min(factors), max(factors)
    factor = f"{low:.3g}" if high - low < 1.0e-6 * high else f"{low:.3g} to {high:.3g}"
    return (
        "One gait cycle of one run, an example. The leg is to scale, its bodies in ideal positions: "
        "clearance moves them by millimetres. Arrows: force of the bushing on the pin; their length grows "
        f"with the root of the force, up to {longest_n:.0f} N. Circles: each pin in its bushing, the "
        f"clearance magnified {factor} times, with the path of the pin's centre over the cycle."
    )


def _run_data(label: str, arrays: Arrays, clearance_m: float) -> dict[str, Any]:
    """Eccentricities [clearances] and contact forces [N] of an example cycle, with y downwards."""
    e, force = arrays["example_eccentricity_m"] / clearance_m, arrays["example_contact_force_n"]
    flip = np.array([1.0, -1.0])
    pins = {
        name: {
            "e": (e[:, k] * flip).round(3).tolist(),
            "f": (force[:, k] * flip).round(1).tolist(),
        }
        for k, name in enumerate(clearance_joints_of(arrays))
    }
    largest = float(np.linalg.norm(force, axis=-1).max())
    return {"label": label, "clearance_mm": round(1.0e3 * clearance_m, 4), "pins": pins, "largest_n": largest}


def _bushing_radius(mechanism: Mechanism, runs: Sequence[dict[str, Any]]) -> float:
    """Bushing radius [m] of the first clearance joint, to which the stated magnification refers."""
    return mechanism.clearances[next(iter(runs[0]["pins"]))].bushing_radius


# Figures of worn profiles: an exaggerated section, depth over the angle, and the worst zone enlarged.


_AROUND = 20.0  # angle shown on both sides of the worst zone [deg]


def wear_gallery(mechanism: Mechanism, worn: Sequence[tuple[str, str, Floats]], what: str) -> Gallery:
    """A picture for each worn joint.

    Parameters
    ----------
    mechanism : Mechanism
    worn : sequence of (label, joint, depth)
        ``depth`` (r, 2, N) [m]: wear depth of bushing and journal in each of r runs, over N sectors.
    what : str
        Description of the depths for the caption, such as "Wear of a million cycles".
    """
    pictures = [_picture(mechanism, *each) for each in worn]
    caption = (
        f"{what}. Left: bushing (blue) and journal (vermilion) as a section, the depth magnified by the "
        "factor above. Right: the worst zone enlarged. Below: unrolled. Lines: means over "
        "runs; shaded: from the least to the greatest of the runs. The black arc, and the grey ground, "
        "contain 90 % of the bushing's wear. Angles in each body's own frame."
    )
    return Gallery(pictures=pictures, caption=caption)


def _picture(mechanism: Mechanism, label: str, joint: str, depth: Floats) -> Picture:
    mean, zone = depth.mean(axis=0), wear_zone(depth.mean(axis=0)[BUSHING])
    factor, unit = length_unit(float(depth.max()))
    figure = new_figure(4.8, 4.6)
    grid = figure.add_gridspec(2, 2, height_ratios=(1.25, 1.0))
    section = figure.add_subplot(grid[0, 0], projection="polar")
    times = draw_section(section, mean, zone, mechanism.clearances[joint].bushing_radius)
    title = f"{label}: {joint}" if label != joint else joint
    section.set_title(f"depth × {times}" if times else "no wear", fontsize=SMALL + 1.0, color=INK)
    worst, whole = figure.add_subplot(grid[0, 1]), figure.add_subplot(grid[1, :])
    for axes in (worst, whole):
        _unroll(axes, factor * depth, zone)
        axes.set_ylabel(f"depth [{unit}]", fontsize=SMALL)
    whole.set(xlim=(0.0, 360.0), xticks=(0.0, 90.0, 180.0, 270.0, 360.0))
    whole.set_xlabel("angle in its own body [°]", fontsize=SMALL)
    _enlarge(worst, depth[:, BUSHING].mean(axis=0))
    figure.suptitle(title, fontsize=SMALL + 2.0, fontweight="bold", color=INK)
    alt = (
        f"Wear of {title}: greatest depth of the bushing {factor * mean[BUSHING].max():.3g} {unit}, "
        f"90 % of it from {zone_text(zone)}"
    )
    return Picture(image=png(figure), alt=alt)


def _unroll(axes: Axes, depth: Floats, zone: tuple[float, float] | None) -> None:
    """Draw the depth (r, 2, N) over three turns of the angle, so that a zone across 0 is not cut."""
    n = depth.shape[2]
    angle = (np.arange(-n, 2 * n) + 0.5) * (360.0 / n)
    if zone is not None:
        for turn in (0.0, -360.0):
            axes.axvspan(zone[0] + turn, zone[1] + turn, color=PALE, alpha=0.6, linewidth=0.0)
    for surface, colour in ((BUSHING, BLUE), (JOURNAL, VERMILION)):
        lines = [np.tile(line, 3) for line in (*_ends(depth[:, surface]), depth[:, surface].mean(axis=0))]
        axes.fill_between(angle, lines[0], lines[1], color=colour, alpha=0.25, linewidth=0.0)
        axes.plot(angle, lines[2], color=colour, linewidth=1.0)
    tidy(axes)
    axes.set_ylim(0.0, 1.05 * float(depth.max()) or 1.0)


def _ends(runs: Floats) -> tuple[Floats, Floats]:
    return runs.min(axis=0), runs.max(axis=0)


def _enlarge(axes: Axes, depth: Floats) -> None:
    """Limit the axes to the narrowest zone that contains half of the wear, and a margin."""
    zone = wear_zone(depth, 0.5) or (0.0, 360.0)
    low, high = zone[0] - _AROUND, zone[1] + _AROUND
    axes.set_xlim(low, min(high, low + 360.0))
    ticks = np.linspace(math.ceil(low / 10.0) * 10.0, math.floor(high / 10.0) * 10.0, 4)
    axes.set_xticks(ticks, [f"{tick % 360.0:.0f}°" for tick in ticks])
    axes.set_title("worst zone", fontsize=SMALL + 1.0, color=INK)


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

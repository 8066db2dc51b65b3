"""Portraits, Poincaré maps, Lyapunov exponents and bifurcation diagrams of a study, in pictures and words."""

import math
from collections.abc import Sequence
from typing import cast

import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.report.figure import BLUE, INK, SMALL, finish, new_figure, png
from leg_wear_monitor.report.page import Gallery, Picture, Section
from leg_wear_monitor.report.study.figures import MARKS, compare_gallery, exponent_panel
from leg_wear_monitor.report.study.text import FORGET, joined, number
from leg_wear_monitor.studies.kinds import PORTRAIT_CYCLES, Chaos
from leg_wear_monitor.studies.life_tasks import exponent, period_of
from leg_wear_monitor.studies.plan import Arrays, Estimate, Found, Point, clearance_joints_of
from leg_wear_monitor.studies.results import StudyResults

_DENSE = 110.0  # resolution of figures with many points [dots per inch]
_LONGEST, _SAME = 16, 1.0e-3  # longest period searched [cycles]; tolerance for equal points [clearances]
_SURE = 3.0  # an exponent this many standard errors away from 0 counts as non-zero


def estimates_of(exponents: Found) -> list[Estimate]:
    """Lyapunov exponents per cycle."""
    return [exponent(arrays["stretch_per_cycle"], 1.0, FORGET) for _, arrays in exponents]


def exponent_sentences(exponents: Found) -> list[str]:
    """Sentences on Lyapunov exponents: value, sign, and the growth of a small error."""
    sentences = []
    for (point, _), one in zip(exponents, estimates_of(exponents), strict=True):
        value = f"{one.value:.2f} ± {one.error:.2f} a cycle (mean and standard error)"
        evaluated = "not distinct from 0."
        if one.score > _SURE:
            cycles = number(math.log(1000.0) / one.value)
            evaluated = (
                f"above 0 beyond doubt: chaotic. A small error grows a thousandfold in {cycles} cycles."
            )
        elif one.score < -_SURE:
            evaluated = "below 0: small errors die out."
        sentences.append(f"{point.label}: the largest Lyapunov exponent is {value}, {evaluated}")
    return sentences


def exponent_gallery(exponents: Found) -> Gallery:
    """Convergence of the exponent over the cycles (left), and the exponents with error bars (right)."""
    figure = new_figure(4.6, 2.9)
    axes = figure.subplots()
    for (colour, _), (point, arrays) in zip(MARKS, exponents, strict=False):
        logs = arrays["stretch_per_cycle"]
        cycles = np.arange(1, logs.shape[1] + 1)
        lines = axes.plot(cycles, (np.cumsum(logs, axis=1) / cycles).T, color=colour, linewidth=0.7)
        lines[0].set_label(point.label)
    finish(axes, x="cycles averaged over", y="exponent [1/cycle]", columns=2)
    settling = Picture(image=png(figure), alt="Running mean of the exponent of every pair of neighbours")
    labels = [point.label for point, _ in exponents]
    compared = compare_gallery([exponent_panel(estimates_of(exponents))], labels)
    caption = (
        "Largest Lyapunov exponent. Left: mean over the cycles so far, a line for each pair of neighbours. "
        "Right: mean over pairs, bars of two standard errors."
    )
    return Gallery(pictures=[settling, *compared.pictures], caption=caption)


def chaos_sections(results: StudyResults) -> list[Section]:
    """Pictures of the chaos study."""
    exponents, parts = results.of("exponent"), []
    if exponents:
        parts.append(Section("Lyapunov exponents", [exponent_gallery(exponents)]))
    for point, arrays in _maps(results):
        cycles, angle = len(arrays["section_rate_mps"]), point.settings["crank_angle_deg"]
        maps = (
            f"Poincaré maps: the same at crank angle {angle:g}° of {cycles} cycles, one point a cycle. A "
            "periodic motion is a single point, or as many as its period has cycles."
        )
        portraits = (
            f"Phase portraits of {PORTRAIT_CYCLES} cycles of one run, an example: the journal's place in its "
            "bushing against its rate, in x and y. Places are in clearances; beyond 1 and -1 the journal "
            "presses into the bushing."
        )
        parts.append(Section("Poincaré maps", [_planes(point, arrays, "section", ".", maps)]))
        parts.append(Section("Phase portraits", [_planes(point, arrays, "portrait", "-", portraits)]))
    galleries = [_bifurcation(*diagram) for diagram in _diagrams(results)]
    return [*parts, Section("Bifurcation diagrams", galleries)] if galleries else parts


def chaos_sentences(results: StudyResults) -> list[str]:
    """Exponents, scatter and periods of Poincaré maps, and how they change over a parameter."""
    return [
        *exponent_sentences(results.of("exponent")),
        *(_disorder(point, arrays) for point, arrays in _maps(results)),
        *(_over(*diagram) for diagram in _diagrams(results)),
    ]


def _maps(results: StudyResults) -> Found:
    """Poincaré sections with phase portraits; the others are of the bifurcation diagrams."""
    return [pair for pair in results.of("section") if pair[0].settings["portrait_cycles"]]


def _places(point: Point, arrays: Arrays, of: str = "section") -> Floats:
    """Eccentricities (n, k, 2) in clearances."""
    return np.asarray(arrays[f"{of}_eccentricity_m"] / point.clearance_m)


def _planes(point: Point, arrays: Arrays, of: str, style: str, caption: str) -> Gallery:
    """A picture for each joint, its place against its rate, x and y side by side."""
    e, v = _places(point, arrays, of), 1.0e3 * arrays[f"{of}_rate_mps"]
    pictures = []
    for k, joint in enumerate(clearance_joints_of(arrays)):
        figure = new_figure(4.8, 2.5)
        for i, axes in enumerate(figure.subplots(1, 2)):
            axes.plot(
                e[:, k, i], v[:, k, i], style, color=BLUE, markersize=2.0, linewidth=0.35,
                markeredgewidth=0.0,
            )  # fmt: skip
            finish(axes, x=f"{'xy'[i]} / clearance", y="" if i else "rate [mm/s]")
        figure.suptitle(joint, fontsize=SMALL + 2.0, fontweight="bold", color=INK)
        low, high, most = e[:, k].min(), e[:, k].max(), np.abs(v[:, k]).max()
        what = "Poincaré map" if of == "section" else "phase portrait"
        alt = (
            f"{what} of joint {joint}: x and y from {low:.2f} to {high:.2f} clearances, "
            f"rates within {most:.0f} mm/s"
        )
        pictures.append(Picture(image=png(figure, _DENSE), alt=alt))
    return Gallery(pictures=pictures, caption=caption)


def _diagrams(results: StudyResults) -> list[tuple[str, list[float], Found]]:
    """Axis label, parameter values and points of every bifurcation diagram with at least two points."""
    study = cast("Chaos", results.settings)
    others = [pair for pair in results.of("section") if not pair[0].settings["portrait_cycles"]]
    diagrams: list[tuple[str, list[float], Found]] = []
    for axis, factor, values, over, fixed in (
        ("radial clearance [mm]", 1.0e3, study.bifurcation.clearances_m, "clearance_m", "speed_rpm"),
        ("crank speed [rpm]", 1.0, study.bifurcation.speeds_rpm, "speed_rpm", "clearance_m"),
    ):
        at = {
            getattr(point, over): (point, arrays)
            for point, arrays in others
            if getattr(point, fixed) == getattr(study, fixed)
        }
        chosen = [value for value in values if value in at]
        if len(chosen) > 1:
            diagrams.append((axis, [factor * value for value in chosen], [at[value] for value in chosen]))
    return diagrams


def _bifurcation(axis: str, values: Sequence[float], found: Found) -> Gallery:
    """Eccentricities of Poincaré maps over a parameter, a picture for each joint."""
    pictures = []
    for k, joint in enumerate(clearance_joints_of(found[0][1])):
        figure = new_figure(4.8, 3.2)
        panels = list(figure.subplots(2, 1, sharex=True))
        for i, axes in enumerate(panels):
            for value, (point, arrays) in zip(values, found, strict=True):
                places = _places(point, arrays)[:, k, i]
                at = np.full(len(places), value)
                axes.plot(at, places, "o", color=BLUE, markersize=1.8, markeredgewidth=0.0, alpha=0.6)
            finish(axes, "" if i else joint, x=axis if i else "", y=f"{'xy'[i]} / clearance")
        pictures.append(Picture(image=png(figure, _DENSE), alt=f"Sections of joint {joint} over the {axis}"))
    caption = (
        f"Bifurcation diagram over the {axis}: the journal's place in its bushing once a cycle, in "
        f"clearances, {len(found[0][1]['section_rate_mps'])} cycles at each value."
    )
    return Gallery(pictures=pictures, caption=caption)


def _scatter(point: Point, arrays: Arrays) -> list[float]:
    """RMS distance (k,) of a Poincaré map's points from their mean, by clearance joint [clearances]."""
    e = _places(point, arrays)
    return [float(value) for value in np.sqrt(np.square(e - e.mean(axis=0)).sum(axis=2).mean(axis=0))]


def _periods(point: Point, arrays: Arrays) -> list[int | None]:
    e = _places(point, arrays)
    return [period_of(e[:, k], _LONGEST, _SAME) for k in range(e.shape[1])]


def _disorder(point: Point, arrays: Arrays) -> str:
    """Sentence on the scatter and the periods of a Poincaré map."""
    joints = clearance_joints_of(arrays)
    ranked = sorted(zip(joints, _scatter(point, arrays), strict=True), key=lambda one: one[1])
    periods = zip(joints, _periods(point, arrays), strict=True)
    known = [f"{joint} every {period} cycles" for joint, period in periods if period]
    repeated = f"periodic are {joined(known)}" if known else "no joint is periodic"
    return (
        f"Poincaré map over {len(arrays['section_rate_mps'])} cycles: {repeated} (periods to {_LONGEST} "
        f"cycles, {_SAME:g} of a clearance). Scatter of the journals' places, RMS in clearances, from "
        f"smallest to largest: {', '.join(f'{joint} {number(value)}' for joint, value in ranked)}."
    )


def _over(axis: str, values: Sequence[float], found: Found) -> str:
    """Sentence on a bifurcation diagram: where the motion is periodic, least and most scattered."""
    worst = [max(_scatter(point, arrays)) for point, arrays in found]
    repeating = [f"{value:g}" for value, pair in zip(values, found, strict=True) if all(_periods(*pair))]
    low, high = int(np.argmin(worst)), int(np.argmax(worst))
    at = f"at {joined(repeating)} all joints are periodic" if repeating else ""
    return (
        f"Over the {axis}: {at or 'at no value are all joints periodic'}; the largest scatter of a joint is "
        f"smallest, {number(worst[low])} clearances, at {values[low]:g} and largest, {number(worst[high])}, "
        f"at {values[high]:g}."
    )

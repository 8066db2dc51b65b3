"""HTML page of the chaos study."""

import math
from collections.abc import Sequence
from typing import cast

import numpy as np
from matplotlib.axes import Axes

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.report.figure import BLUE, INK, SMALL, new_figure, png, tidy
from leg_wear_monitor.report.page import Gallery, Picture, Section, Table
from leg_wear_monitor.report.study import findings
from leg_wear_monitor.report.study.sections import Sections, asked, conclude, curves, cycle
from leg_wear_monitor.report.study.text import MARKS, Labelled, joined, number
from leg_wear_monitor.studies.kinds import PORTRAIT_CYCLES, Chaos
from leg_wear_monitor.studies.life_tasks import Estimate, exponent, period_of
from leg_wear_monitor.studies.plan import Arrays, Point, clearance_joints_of
from leg_wear_monitor.studies.results import StudyResults

# Figures of phase portraits, Poincaré maps, Lyapunov exponents and bifurcation diagrams.


_DENSE = 110.0  # resolution of figures with many points [dots per inch]


def portrait_gallery(section: Arrays, clearance_m: float, cycles: int) -> Gallery:
    """Phase portraits: eccentricity and its rate of each clearance joint's journal over some cycles."""
    e, v = section["portrait_eccentricity_m"] / clearance_m, section["portrait_rate_mps"]
    caption = (
        f"Phase portraits of {cycles} cycles of one run, an example: the journal's place in its bushing "
        "against its "
        "rate, in x and y. Places are in clearances; beyond 1 and -1 the journal presses into the bushing."
    )
    return _planes(clearance_joints_of(section), e, v, caption, "phase portrait", "-")


def section_gallery(section: Arrays, clearance_m: float, crank_angle_deg: float) -> Gallery:
    """Poincaré maps: one point per cycle for each clearance joint."""
    e, v = section["section_eccentricity_m"] / clearance_m, section["section_rate_mps"]
    caption = (
        f"Poincaré maps: the same at crank angle {crank_angle_deg:g}° of {len(e)} cycles, one point a "
        "cycle. A periodic "
        "motion is a single point, or as many as its period has cycles."
    )
    return _planes(clearance_joints_of(section), e, v, caption, "Poincaré map", ".")


def _planes(joints: Sequence[str], e: Floats, v: Floats, caption: str, what: str, style: str) -> Gallery:
    """A picture for each joint, x and y side by side; e (n, k, 2) [clearances], v (n, k, 2) [m/s]."""
    pictures = []
    for k, joint in enumerate(joints):
        figure = new_figure(4.8, 2.5)
        panels = list(figure.subplots(1, 2))
        for i, axes in enumerate(panels):
            axes.plot(
                e[:, k, i], 1.0e3 * v[:, k, i], style, color=BLUE, markersize=2.0, linewidth=0.35,
                markeredgewidth=0.0,
            )  # fmt: skip
            tidy(axes)
            axes.set_xlabel(f"{'xy'[i]} / clearance", fontsize=SMALL)
        panels[0].set_ylabel("rate [mm/s]", fontsize=SMALL)
        figure.suptitle(joint, fontsize=SMALL + 2.0, fontweight="bold", color=INK)
        within = f"{_range(e[:, k])} clearances, rates within {_most(v[:, k])} mm/s"
        alt = f"{what} of joint {joint}: x and y from {within}"
        pictures.append(Picture(image=png(figure, _DENSE), alt=alt))
    return Gallery(pictures=pictures, caption=caption)


def _range(values: Floats) -> str:
    return f"{values.min():.2f} to {values.max():.2f}"


def _most(values: Floats) -> str:
    return f"{1.0e3 * np.abs(values).max():.0f}"


def exponent_gallery(labelled: Labelled, estimates: Sequence[Estimate]) -> Gallery:
    """Convergence of the exponent over the cycles (left), and the exponents with error bars (right)."""
    figure = new_figure(4.6, 2.9)
    axes = figure.subplots()
    for (colour, _), (label, arrays) in zip(MARKS, labelled, strict=False):
        logs = arrays["stretch_per_cycle"]
        running = np.cumsum(logs, axis=1) / np.arange(1, logs.shape[1] + 1)
        for run, line in enumerate(running):
            axes.plot(
                np.arange(1, len(line) + 1),
                line,
                color=colour,
                linewidth=0.7,
                label=label if run == 0 else None,
            )
    axes.set_xlabel("cycles averaged over", fontsize=SMALL)
    axes.set_ylabel("exponent [1/cycle]", fontsize=SMALL)
    axes.legend(fontsize=SMALL, frameon=False, ncols=2)
    tidy(axes)
    settling = Picture(image=png(figure), alt="Running mean of the exponent of every pair of neighbours")
    figure = new_figure(4.6, 0.8 + 0.42 * len(labelled))
    axes = figure.subplots()
    rows = np.arange(len(labelled))
    axes.errorbar(
        [one.value for one in estimates], rows, xerr=[2.0 * one.error for one in estimates], color=BLUE,
        marker="o", linestyle="none", capsize=3.0,
    )  # fmt: skip
    axes.axvline(0.0, color=INK, linewidth=0.8)
    axes.set_yticks(rows, [label for label, _ in labelled])
    axes.set_ylim(len(labelled) - 0.5, -0.5)
    axes.set_xlabel("largest Lyapunov exponent [1/cycle]", fontsize=SMALL)
    tidy(axes)
    parts = [f"{label} {one.value:.2f}" for (label, _), one in zip(labelled, estimates, strict=True)]
    side = Picture(image=png(figure), alt=f"Largest Lyapunov exponents: {', '.join(parts)} a cycle")
    caption = (
        "Largest Lyapunov exponent. Left: mean over the cycles so far, a line for each pair of neighbours. "
        "Right: "
        "mean over pairs, bars of two standard errors."
    )
    return Gallery(pictures=[settling, side], caption=caption)


def bifurcation_gallery(
    values: Sequence[float], sections: Sequence[Arrays], clearances_m: Sequence[float], axis: str
) -> Gallery:
    """Bifurcation diagrams: eccentricities of Poincaré maps over a parameter, a picture for each joint."""
    pictures = []
    for k, joint in enumerate(clearance_joints_of(sections[0])):
        figure = new_figure(4.8, 3.2)
        panels = list(figure.subplots(2, 1, sharex=True))
        for i, axes in enumerate(panels):
            for value, section, clearance in zip(values, sections, clearances_m, strict=True):
                points = section["section_eccentricity_m"][:, k, i] / clearance
                _dots(axes, np.full(len(points), value), points)
            tidy(axes)
            axes.set_ylabel(f"{'xy'[i]} / clearance", fontsize=SMALL)
        panels[-1].set_xlabel(axis, fontsize=SMALL)
        panels[0].set_title(joint, fontsize=SMALL + 2.0, color=INK, fontweight="bold")
        pictures.append(Picture(image=png(figure, _DENSE), alt=f"Sections of joint {joint} over the {axis}"))
    caption = (
        f"Bifurcation diagram over the {axis}: the journal's place in its bushing once a cycle, in "
        "clearances, "
        f"{len(sections[0]['section_rate_mps'])} cycles at each value."
    )
    return Gallery(pictures=pictures, caption=caption)


def _dots(axes: Axes, x: Floats, y: Floats) -> None:
    axes.plot(x, y, "o", color=BLUE, markersize=1.8, markeredgewidth=0.0, alpha=0.6)


_FORGET = 3  # cycles left out, in which the separation turns into the fastest growing direction
_LONGEST, _SAME = 16, 1.0e-3  # longest period searched [cycles]; tolerance for equal points [clearances]
_SURE = 3.0  # an exponent this many standard errors away from 0 counts as non-zero

_Pair = tuple[Point, Arrays]


def chaos(results: StudyResults, labelled: Labelled) -> Sections:
    """Sections of the chaos study's page."""
    sections = results.of("section")
    whole = [pair for pair in sections if pair[0].settings["portrait_cycles"]]
    exponents = [(point.label, arrays) for point, arrays in results.of("exponent")]
    estimates = estimates_of(exponents)
    diagrams = _diagrams(results, [pair for pair in sections if pair not in whole])
    sentences = [foretold(label, one) for (label, _), one in zip(exponents, estimates, strict=True)]
    sentences += [text for pair in whole for text in _disorder(pair)] + findings.regularity(labelled)
    sentences += [_over(name, values, pairs) for name, values, pairs in diagrams]
    parts: Sections = [asked(results), conclude(sentences)]
    if exponents:
        table = exponent_table(exponents, estimates, "clearance joints")
        parts.append(Section("Lyapunov exponents", [exponent_gallery(exponents, estimates), table]))
    for point, arrays in whole:
        clearance = point.clearance_m
        angle = point.settings["crank_angle_deg"]
        parts.append(Section("Poincaré maps", [section_gallery(arrays, clearance, angle)]))
        parts.append(Section("Phase portraits", [portrait_gallery(arrays, clearance, PORTRAIT_CYCLES)]))
    galleries = [
        bifurcation_gallery(values, *_apart(pairs), axis)
        for axis, values, pairs in diagrams
    ]  # fmt: skip
    if galleries:
        parts.append(Section("Bifurcation diagrams", galleries))
    return [*parts, cycle(results, results.of("response")), curves(labelled)]


def estimates_of(exponents: Labelled) -> list[Estimate]:
    """Lyapunov exponents per cycle."""
    return [exponent(arrays["stretch_per_cycle"], 1.0, _FORGET) for _, arrays in exponents]


def _apart(pairs: Sequence[_Pair]) -> tuple[list[Arrays], list[float]]:
    return [arrays for _, arrays in pairs], [point.clearance_m for point, _ in pairs]


def _diagrams(results: StudyResults, pairs: Sequence[_Pair]) -> list[tuple[str, list[float], list[_Pair]]]:
    """Axis label, parameter values and points of every bifurcation diagram with at least two points."""
    study = cast("Chaos", results.settings)
    at_speed = {
        point.clearance_m: (point, arrays) for point, arrays in pairs if point.speed_rpm == study.speed_rpm
    }
    at_clearance = {
        point.speed_rpm: (point, arrays) for point, arrays in pairs if point.clearance_m == study.clearance_m
    }
    diagrams = []
    for axis, values, found, factor in (
        ("radial clearance [mm]", study.bifurcation.clearances_m, at_speed, 1.0e3),
        ("crank speed [rpm]", study.bifurcation.speeds_rpm, at_clearance, 1.0),
    ):
        chosen = [value for value in values if value in found]
        if len(chosen) > 1:
            diagrams.append((axis, [factor * value for value in chosen], [found[value] for value in chosen]))
    return diagrams


def foretold(label: str, estimate: Estimate) -> str:
    """Sentence on a Lyapunov exponent: its value, its sign, and the growth of a small error."""
    value = f"{estimate.value:.2f} ± {estimate.error:.2f} a cycle (mean and standard error)"
    if estimate.value > _SURE * estimate.error:
        thousand = math.log(1000.0) / estimate.value
        return (
            f"{label}: the largest Lyapunov exponent is {value}, above 0 beyond doubt: chaotic. A small "
            "error grows a "
            f"thousandfold in {number(thousand)} cycles."
        )
    evaluated = (
        "below 0: small errors die out" if estimate.value < -_SURE * estimate.error else "not distinct from 0"
    )
    return f"{label}: the largest Lyapunov exponent is {value}, {evaluated}."


def scatter(point: Point, arrays: Arrays) -> list[float]:
    """RMS distance (k,) of a Poincaré map's points from their mean, by clearance joint [clearances]."""
    e = arrays["section_eccentricity_m"] / point.clearance_m
    return [float(value) for value in np.sqrt(np.square(e - e.mean(axis=0)).sum(axis=2).mean(axis=0))]


def _periods(point: Point, arrays: Arrays) -> list[int | None]:
    e = arrays["section_eccentricity_m"] / point.clearance_m
    return [period_of(e[:, k], _LONGEST, _SAME) for k in range(e.shape[1])]


def _disorder(pair: _Pair) -> list[str]:
    """Sentence on the scatter and the periods of a Poincaré map."""
    point, arrays = pair
    joints, spread = clearance_joints_of(arrays), scatter(point, arrays)
    ranked = sorted(zip(joints, spread, strict=True), key=lambda one: one[1])
    periods = dict(zip(joints, _periods(point, arrays), strict=True))
    known = [f"{joint} every {period} cycles" for joint, period in periods.items() if period]
    repeated = f"periodic are {joined(known)}" if known else "no joint is periodic"
    return [
        f"Poincaré map over {len(arrays['section_rate_mps'])} cycles: {repeated} (periods to {_LONGEST} "
        "cycles, "
        f"{_SAME:g} of a clearance). Scatter of the journals' places, RMS in clearances, from smallest to "
        "largest: "
        f"{', '.join(f'{joint} {number(value)}' for joint, value in ranked)}."
    ]


def _over(axis: str, values: Sequence[float], pairs: Sequence[_Pair]) -> str:
    """Sentence on a bifurcation diagram: where the motion is periodic, least and most scattered."""
    worst = [max(scatter(point, arrays)) for point, arrays in pairs]
    repeating = [f"{value:g}" for value, pair in zip(values, pairs, strict=True) if all(_periods(*pair))]
    low, high = int(np.argmin(worst)), int(np.argmax(worst))
    calm = (
        f"at {joined(repeating)} all joints are periodic"
        if repeating
        else "at no value are all joints periodic"
    )
    return (
        f"Over the {axis}: {calm}; the largest scatter of a joint is smallest, {number(worst[low])} "
        "clearances, at "
        f"{values[low]:g} and largest, {number(worst[high])}, at {values[high]:g}."
    )


def exponent_table(labelled: Labelled, estimates: Sequence[Estimate], head: str) -> Table:
    """Table of Lyapunov exponents; ``head`` titles the first column."""
    rows = []
    for (label, arrays), one in zip(labelled, estimates, strict=True):
        period = float(arrays["period_s"])
        time = number(math.log(10.0) / one.value) if one.value > 0.0 else "–"
        runs, cycles = arrays["stretch_per_cycle"].shape
        each = [f"{one.value / by:.2f} ± {one.error / by:.2f}" for by in (1.0, period)]
        rows.append([label, *each, time, f"{runs} × {cycles - _FORGET}"])
    return Table(
        caption="Largest Lyapunov exponent",
        head=(head, "[1/cycle]", "[1/s]", "cycles for a tenfold error", "pairs × cycles"),
        rows=rows,
        note="Mean and standard error over pairs of neighbours (Benettin and others 1980).",
    )

"""HTML page of the chaos study."""

import math
from collections.abc import Sequence
from typing import cast

import numpy as np

from leg_wear_monitor.report.page import Section
from leg_wear_monitor.report.parts import Table
from leg_wear_monitor.report.study import findings
from leg_wear_monitor.report.study.chaos_pictures import (
    bifurcation_gallery,
    exponent_gallery,
    portrait_gallery,
    section_gallery,
)
from leg_wear_monitor.report.study.sections import Sections, asked, conclude, curves, cycle
from leg_wear_monitor.report.study.text import Labelled, joined, number
from leg_wear_monitor.studies.plan.kinds.chaos import PORTRAIT_CYCLES, Chaos
from leg_wear_monitor.studies.point import Arrays, Point
from leg_wear_monitor.studies.results import StudyResults
from leg_wear_monitor.studies.summary import clearance_joints_of
from leg_wear_monitor.studies.tasks.lyapunov import Estimate, exponent
from leg_wear_monitor.studies.tasks.section import period_of

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

"""Figures of phase portraits, Poincaré maps, Lyapunov exponents and bifurcation diagrams."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.report.figures.figure import BLUE, INK, SMALL, new_figure, png, tidy
from leg_wear_monitor.report.parts import Gallery, Picture
from leg_wear_monitor.report.study.text import Labelled
from leg_wear_monitor.report.study.trends import MARKS
from leg_wear_monitor.studies.point import Arrays
from leg_wear_monitor.studies.summary import clearance_joints_of
from leg_wear_monitor.studies.tasks.lyapunov import Estimate

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

"""Figures of errors, forces and wear over the varied parameter (trend) or over named points (comparison)."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes

from leg_wear_monitor.report.figures.figure import (
    BLUE,
    GREEN,
    INK,
    ORANGE,
    PURPLE,
    SMALL,
    VERMILION,
    new_figure,
    png,
    tidy,
)
from leg_wear_monitor.report.parts import Gallery, Picture
from leg_wear_monitor.report.study.text import PICO, QUANTITIES, Labelled
from leg_wear_monitor.studies.point import Arrays
from leg_wear_monitor.studies.summary import (
    Spread,
    clearance_joints_of,
    depth_per_cycle,
    joint_force,
    largest_error,
    peak_force,
)

MARKS = ((BLUE, "o"), (VERMILION, "s"), (GREEN, "^"), (ORANGE, "D"), (PURPLE, "v"), (INK, "P"))
_CAPTION = (
    "Points: means; bars: from the 10th to the 90th percentile of all runs' cycles, or of runs for the 99 % "
    "and wear."
)


class Panel(NamedTuple):
    """Data of one picture: for each name, a spread at each point; None where the point has no value."""

    title: str
    lines: dict[str, list[Spread | None]]
    factor: float


def panels_of(arrays: Sequence[Arrays]) -> list[Panel]:
    """Data of all pictures of a study, from the arrays of its points."""
    joints = list(dict.fromkeys(name for each in arrays for name in clearance_joints_of(each)))

    def by_joint(figure: Callable[[Arrays, str], Spread]) -> dict[str, list[Spread | None]]:
        return {
            name: [figure(each, name) if name in clearance_joints_of(each) else None for each in arrays]
            for name in joints
        }

    panels = [
        Panel(
            f"{each.title}, largest error [{each.unit}]",
            {"": [largest_error(one, each.name) for one in arrays]},
            each.factor,
        )
        for each in QUANTITIES
        if f"ideal_{each.name}" in arrays[0]
    ]
    return [
        *panels,
        Panel("largest contact force in a cycle [N]", by_joint(peak_force), 1.0),
        Panel(
            "contact force, 99 % of the time below [N]",
            by_joint(lambda one, name: joint_force(one, "p99_force_n", name)),
            1.0,
        ),
        Panel("greatest wear depth [pm a cycle]", by_joint(depth_per_cycle), PICO),
    ]


def trend_gallery(
    values: Sequence[float], axis: str, arrays: Sequence[Arrays], more: Sequence[Panel] = ()
) -> Gallery:
    """Pictures over a numeric parameter, such as the clearance; ``more`` are further ones."""
    pictures = []
    for panel in [*panels_of(arrays), *more]:
        figure = new_figure(4.6, 2.9)
        axes = figure.subplots()
        for (colour, mark), (name, spreads) in zip(MARKS, panel.lines.items(), strict=False):
            known = [(x, one) for x, one in zip(values, spreads, strict=True) if one is not None]
            mean, bars = _bars([one for _, one in known], panel.factor)
            axes.errorbar(
                [x for x, _ in known], mean, yerr=bars, color=colour, marker=mark, markersize=5.0,
                linewidth=1.0, elinewidth=1.0, capsize=3.0, label=name or None,
            )  # fmt: skip
        axes.set_ylim(bottom=0.0)
        axes.set_xlabel(axis, fontsize=SMALL)
        _finish(axes, panel)
        pictures.append(Picture(image=png(figure), alt=f"{panel.title} over {axis}: {_as_text(panel)}"))
    return Gallery(pictures=pictures, caption=_CAPTION)


def compare_gallery(labelled: Labelled) -> Gallery:
    """Pictures with a row for each point."""
    labels, pictures = [label for label, _ in labelled], []
    for panel in panels_of([arrays for _, arrays in labelled]):
        lines = list(panel.lines.items())
        figure = new_figure(4.6, 0.75 + len(labels) * max(0.24, 0.1 * len(lines)))
        axes = figure.subplots()
        for i, ((colour, mark), (name, spreads)) in enumerate(zip(MARKS, lines, strict=False)):
            rows = np.arange(len(labels)) + (i - 0.5 * (len(lines) - 1)) * 0.7 / max(len(lines), 1)
            known = [(row, one) for row, one in zip(rows, spreads, strict=True) if one is not None]
            mean, bars = _bars([one for _, one in known], panel.factor)
            axes.errorbar(
                mean, [row for row, _ in known], xerr=bars, color=colour, marker=mark, markersize=5.0,
                linestyle="none", elinewidth=1.2, capsize=3.0, label=name or None,
            )  # fmt: skip
        axes.set_yticks(np.arange(len(labels)), labels)
        axes.set_ylim(len(labels) - 0.5, -0.5)
        axes.set_xlim(left=0.0)
        _finish(axes, panel)
        pictures.append(Picture(image=png(figure), alt=f"{panel.title}: {_as_text(panel, labels)}"))
    return Gallery(pictures=pictures, caption=_CAPTION)


def _bars(spreads: Sequence[Spread], factor: float) -> tuple[list[float], list[list[float]]]:
    """Means, and the lengths of the bars below and above them."""
    below = [factor * max(0.0, one.mean - one.low) for one in spreads]
    above = [factor * max(0.0, one.high - one.mean) for one in spreads]
    return [factor * one.mean for one in spreads], [below, above]


def _finish(axes: Axes, panel: Panel) -> None:
    tidy(axes)
    axes.set_title(panel.title, fontsize=SMALL + 1.0, color=INK, fontweight="bold")
    if len(panel.lines) > 1:
        axes.legend(fontsize=SMALL, frameon=False, ncols=min(5, len(panel.lines)), handletextpad=0.2)


def _as_text(panel: Panel, labels: Sequence[str] = ()) -> str:
    """Alternative text of the picture: the means of all points."""
    texts = []
    for name, spreads in panel.lines.items():
        means = [f"{panel.factor * one.mean:.3g}" if one else "none" for one in spreads]
        if labels:
            means = [f"{label} {mean}" for label, mean in zip(labels, means, strict=True)]
        texts.append(f"{name} {', '.join(means)}".strip())
    return "; ".join(texts)

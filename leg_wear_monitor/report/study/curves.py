"""Figures of curves over a gait cycle: the ideal leg, the ensemble's 90 % band, and one run as an example."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.report.figures.figure import BLUE, INK, SKY, SMALL, new_figure, png, tidy
from leg_wear_monitor.report.parts import Gallery, Picture
from leg_wear_monitor.report.study.text import QUANTITIES, Labelled, Quantity
from leg_wear_monitor.studies.point import Arrays
from leg_wear_monitor.studies.summary import clearance_joints_of

PANEL_IN = 4.6
_AXES_IN, _REST_IN = 1.35, 0.75
_LEAST_N = 0.1  # lower end of the logarithmic axis [N]: the force of a journal in free flight is 0
_KEY = (
    "Shaded: where the middle 90 % of all runs' cycles lie. Blue: one cycle of one run, an example. "
    "Dashed: the ideal leg."
)


def curve_galleries(labelled: Labelled) -> list[Gallery]:
    """A gallery for each quantity, with a picture for each point of the study."""
    galleries = []
    for quantity in QUANTITIES:
        if f"ideal_{quantity.name}" in labelled[0][1]:
            galleries.append(_toe_gallery(labelled, quantity))
    return [*galleries, _force_gallery(labelled)]


def _toe_gallery(labelled: Labelled, quantity: Quantity) -> Gallery:
    """Curves of one quantity; positions as deviations, which are too small to see beside the toe's path."""
    apart = quantity.name == "toe_position_m"
    what = f"{quantity.title}, deviation from the ideal" if apart else quantity.title
    parts = [_components(arrays, quantity, apart) for _, arrays in labelled]
    limits = _limits(parts, 0.0 if apart else 0.02)
    pictures = [
        Picture(
            image=_draw(part, limits, label, quantity.unit),
            alt=f"{what} over the crank angle, {label}: the ideal, the ensemble's band, one run",
        )
        for (label, _), part in zip(labelled, parts, strict=True)
    ]
    caption = f"{what[0].upper()}{what[1:]} [{quantity.unit}] over one gait cycle. {_KEY}"
    if not apart:
        caption += " Spikes beyond the panel are cut off; the tables have the largest errors."
    return Gallery(pictures=pictures, caption=caption)


_Line = tuple[Floats, Floats, Floats]  # ideal (s,), band (3, s), example (s,)


def _components(arrays: Arrays, quantity: Quantity, apart: bool) -> dict[str, _Line]:
    """Curves by component, x and y, or one curve without a name for a scalar; in the quantity's unit.

    If ``apart``, they are deviations from the ideal curve.
    """
    ideal, factor = arrays[f"ideal_{quantity.name}"], quantity.factor
    band, example = (arrays[f"{kind}_{quantity.name}"] for kind in ("band", "example"))
    if ideal.ndim == 1:
        return {"": (factor * ideal, factor * band, factor * example)}
    lines = {}
    for i, name in enumerate("xy"):
        under = np.zeros(len(ideal)) if apart else ideal[:, i]
        lines[name] = (
            factor * under, factor * (under + band[..., i]), factor * (under + example[:, i]),
        )  # fmt: skip
    return lines


def _limits(parts: Sequence[dict[str, _Line]], cut: float) -> tuple[float, float]:
    """Vertical range for all panels; the fraction ``cut`` of the examples' samples may lie outside."""
    lines = [line for part in parts for line in part.values()]
    insides = [np.quantile(example, (cut / 2.0, 1.0 - cut / 2.0)) for _, _, example in lines]
    every = [*insides, *(ideal for ideal, _, _ in lines), *(band.ravel() for _, band, _ in lines if not cut)]
    low, high = min(float(part.min()) for part in every), max(float(part.max()) for part in every)
    margin = 0.05 * (high - low) or 1.0
    return low - margin, high + margin


def _draw(part: dict[str, _Line], limits: tuple[float, float], label: str, unit: str) -> bytes:
    figure = new_figure(PANEL_IN, _AXES_IN * len(part) + _REST_IN)
    panels = list(np.atleast_1d(figure.subplots(len(part), 1, sharex=True)))
    for axes, (name, (ideal, band, example)) in zip(panels, part.items(), strict=True):
        _draw_line(axes, ideal, band, example)
        axes.set_ylim(limits)
        axes.set_ylabel(f"{name} [{unit}]".strip(), fontsize=SMALL)
    _finish(panels, label)
    return png(figure)


def _draw_line(axes: Axes, ideal: Floats, band: Floats, example: Floats) -> None:
    angle = np.arange(len(example)) * (360.0 / len(example))
    axes.fill_between(angle, band[0], band[-1], color=SKY, alpha=0.45, linewidth=0.0)
    axes.plot(angle, ideal, color=INK, linewidth=1.2, linestyle=(0, (4, 2)))
    axes.plot(angle, example, color=BLUE, linewidth=0.7)


def _finish(panels: Sequence[Axes], label: str) -> None:
    for axes in panels:
        tidy(axes)
        axes.set(xlim=(0.0, 360.0), xticks=(0.0, 90.0, 180.0, 270.0, 360.0))
    panels[0].set_title(label, fontsize=SMALL + 1.0, color=INK, fontweight="bold")
    panels[-1].set_xlabel("crank angle [°]", fontsize=SMALL)


def _force_gallery(labelled: Labelled) -> Gallery:
    pictures = [
        Picture(image=_draw_forces(label, arrays), alt=f"Contact forces over the crank angle, {label}")
        for label, arrays in labelled
    ]
    caption = (
        f"Contact forces [N] over one gait cycle, logarithmic; at {_LEAST_N} N the journal is free. {_KEY}"
    )
    return Gallery(pictures=pictures, caption=caption)


def _draw_forces(label: str, arrays: Arrays) -> bytes:
    clearance_joints, joints = clearance_joints_of(arrays), [str(name) for name in arrays["joints"]]
    example = np.linalg.norm(arrays["example_contact_force_n"], axis=-1)
    figure = new_figure(PANEL_IN, 1.05 * len(clearance_joints) + _REST_IN)
    panels = list(np.atleast_1d(figure.subplots(len(clearance_joints), 1, sharex=True)))
    for k, (axes, name) in enumerate(zip(panels, clearance_joints, strict=True)):
        ideal = arrays["ideal_joint_force_n"][:, joints.index(name)]
        lines = ideal, arrays["band_contact_force_n"][..., k], example[:, k]
        _draw_line(axes, *(np.maximum(line, _LEAST_N) for line in lines))
        axes.set_yscale("log")
        axes.set_ylabel(name, fontsize=SMALL + 1.0, rotation=0.0, ha="right", va="center", fontweight="bold")
    _finish(panels, label)
    return png(figure)

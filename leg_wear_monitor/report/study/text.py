"""Text of a study's numbers, and its tables."""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.report.figure import (
    BLUE,
    GREEN,
    INK,
    ORANGE,
    PURPLE,
    SKY,
    SMALL,
    VERMILION,
    new_figure,
    png,
    tidy,
)
from leg_wear_monitor.report.page import Gallery, Picture, Table
from leg_wear_monitor.studies.plan import (
    Arrays,
    Spread,
    clearance_joints_of,
    depth_per_cycle,
    fraction_of_range,
    joint_force,
    largest_error,
    of_clearance_joints,
    peak_force,
    worst_zone,
)

Labelled = Sequence[tuple[str, Arrays]]


class Quantity(NamedTuple):
    """A quantity compared with the ideal leg: name in the data, title for readers, unit, factor from SI."""

    name: str
    title: str
    unit: str
    factor: float


QUANTITIES = (
    Quantity("toe_position_m", "toe displacement", "mm", 1.0e3),
    Quantity("toe_velocity_mps", "toe velocity", "m/s", 1.0),
    Quantity("toe_acceleration_mps2", "toe acceleration", "m/s²", 1.0),
    Quantity("drive_torque_nm", "drive torque", "N m", 1.0),
)
PICO = 1.0e12


def number(value: float) -> str:
    """A number with three significant digits; with an exponent below 0.001 and from a million on."""
    if not math.isfinite(value):
        return "–"
    if value == 0.0:
        return "0"
    if not 1.0e-3 <= abs(value) < 1.0e6:
        return f"{value:.2e}"
    return f"{value:.{max(0, 2 - math.floor(math.log10(abs(value))))}f}"


def with_spread(value: Spread, factor: float = 1.0) -> str:
    """Mean and standard deviation, with two digits of the deviation and at most four of the mean."""
    mean, deviation = factor * value.mean, factor * value.deviation
    if not deviation > 0.0 or mean == 0.0:
        return number(mean)
    most = max(0, 3 - math.floor(math.log10(abs(mean))))
    digits = max(0, min(most, 1 - math.floor(math.log10(deviation))))
    least = 10.0**-digits
    around = f"{deviation:.{digits}f}" if deviation >= 0.5 * least else f"<{least:.{digits}f}"
    return f"{mean:.{digits}f} ± {around}"


def percent(fraction: float) -> str:
    """A fraction as text in percent."""
    text = number(100.0 * fraction)
    return f"{text.rstrip('0').rstrip('.') if text.endswith('.0') else text} %"


def zone_text(zone: tuple[float, float] | None) -> str:
    """A zone of angles (from, to) [deg] and its width as text."""
    if zone is None:
        return "–"
    return f"{zone[0] % 360.0:.0f}° to {zone[1] % 360.0:.0f}° ({zone[1] - zone[0]:.0f}° wide)"


def joined(names: Sequence[str]) -> str:
    """Names joined by commas, the last by "and"."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def error_table(labelled: Labelled, head: str) -> Table:
    """Table of the largest errors of toe and drive torque in a cycle, a row for each point."""
    known = [quantity for quantity in QUANTITIES if _has(labelled, quantity)]
    rows = [
        [label]
        + [with_spread(largest_error(arrays, each.name), each.factor) for each in known]
        + [percent(fraction_of_range(arrays, each.name)) for each in known]
        for label, arrays in labelled
    ]
    return Table(
        caption="Largest error against the ideal leg in one cycle",
        head=[
            head,
            *(f"{each.title} [{each.unit}]" for each in known),
            *(f"{each.title}, of its range" for each in known),
        ],
        rows=rows,
        note="Mean and standard deviation over the cycles of all runs. The range is that of the ideal curve, "
        "the larger one of x and y.",
    )


def _has(labelled: Labelled, quantity: Quantity) -> bool:
    return all(f"ideal_{quantity.name}" in arrays for _, arrays in labelled)


def joint_table(labelled: Labelled, head: str) -> Table:
    """Table of forces, impacts and contact time, a row for each clearance joint of every point."""
    rows = [
        [
            f"{label}: {joint}" if len(clearance_joints_of(arrays)) > 1 else label,
            with_spread(peak_force(arrays, joint)),
            with_spread(joint_force(arrays, "p99_force_n", joint)),
            with_spread(joint_force(arrays, "mean_force_n", joint)),
            with_spread(of_clearance_joints(arrays, "impacts", joint)),
            with_spread(of_clearance_joints(arrays, "impact_speed_mps", joint), 1.0e3),
            with_spread(of_clearance_joints(arrays, "contact_fraction", joint), 100.0),
        ]
        for label, arrays in labelled
        for joint in clearance_joints_of(arrays)
    ]
    return Table(
        caption="Contact forces and impacts of the clearance joints",
        head=[
            f"{head}, joint",
            "largest force in a cycle [N]",
            "99 % of the time below [N]",
            "mean force [N]",
            "impacts a cycle",
            "mean approach [mm/s]",
            "in contact [%]",
        ],
        rows=rows,
        note="Largest forces and impacts: mean and standard deviation over the cycles of all runs; "
        "the others: over runs. A single largest force is a sample of a heavy tail; compare the 99 %.",
    )


def wear_table(labelled: Labelled, head: str) -> Table:
    """Table of wear, a row for each clearance joint of every point."""
    rows = [
        [
            f"{label}: {joint}" if len(clearance_joints_of(arrays)) > 1 else label,
            with_spread(depth_per_cycle(arrays, joint), PICO),
            with_spread(of_clearance_joints(arrays, "archard_integral_j_per_cycle", joint)),
            zone_text(worst_zone(arrays, joint, 0.5)),
            zone_text(worst_zone(arrays, joint)),
        ]
        for label, arrays in labelled
        for joint in clearance_joints_of(arrays)
    ]
    return Table(
        caption="Wear of the bushings",
        head=[
            f"{head}, joint",
            "greatest depth [pm a cycle]",
            "∫ F |v| dt [J a cycle]",
            "zone with half of the wear",
            "zone with 90 % of it",
        ],
        rows=rows,
        note="1 pm a cycle is 1 µm in a million cycles. Mean and standard deviation over runs; "
        "angles in the frame of the body that carries the bushing. Depths scale with the wear coefficient.",
    )


# Figures of curves over a gait cycle: the ideal leg, the ensemble's 90 % band, and one run as an example.


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
    _finish_panels(panels, label)
    return png(figure)


def _draw_line(axes: Axes, ideal: Floats, band: Floats, example: Floats) -> None:
    angle = np.arange(len(example)) * (360.0 / len(example))
    axes.fill_between(angle, band[0], band[-1], color=SKY, alpha=0.45, linewidth=0.0)
    axes.plot(angle, ideal, color=INK, linewidth=1.2, linestyle=(0, (4, 2)))
    axes.plot(angle, example, color=BLUE, linewidth=0.7)


def _finish_panels(panels: Sequence[Axes], label: str) -> None:
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
    _finish_panels(panels, label)
    return png(figure)


# Figures of errors, forces and wear over the varied parameter (trend) or over named points (comparison).


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

"""Figures that several studies share: curves of a cycle, statistics of the points, wear, lives."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.report.figure import (
    BLUE,
    GREEN,
    INK,
    LEAST_N,
    ORANGE,
    PURPLE,
    SKY,
    SMALL,
    VERMILION,
    draw_clearances,
    draw_depth,
    draw_section,
    finish,
    length_unit,
    new_figure,
    png,
)
from leg_wear_monitor.report.page import Gallery, Picture
from leg_wear_monitor.report.study.text import (
    MILLIONTH,
    PICO,
    Quantity,
    named,
    quantities,
    zone_text,
)
from leg_wear_monitor.studies.plan import (
    DEPTH,
    Arrays,
    Estimate,
    Found,
    Spread,
    clearance_joints_of,
    largest_error,
    of_joint,
)
from leg_wear_monitor.wear import BUSHING, wear_zone

MARKS = ((BLUE, "o"), (VERMILION, "s"), (GREEN, "^"), (ORANGE, "D"), (PURPLE, "v"), (INK, "P"))
_WIDE = 4.6  # of a picture [inch]
_TURN = {"xlim": (0.0, 360.0), "xticks": (0.0, 90.0, 180.0, 270.0, 360.0)}

# Curves over a gait cycle: the ideal leg, the ensemble's 90 % band, and one run as an example.


_KEY = (
    "Shaded: where the middle 90 % of all runs' cycles lie. Blue: one cycle of one run, an example. "
    "Dashed: the ideal leg."
)

_Line = tuple[Floats, Floats, Floats]  # ideal (s,), band (3, s), example (s,)


def curve_galleries(found: Found) -> list[Gallery]:
    """A gallery for each quantity, with a picture for each point of the study."""
    return [*(_toe_gallery(found, quantity) for quantity in quantities(found)), _force_gallery(found)]


def _toe_gallery(found: Found, quantity: Quantity) -> Gallery:
    """Curves of one quantity; positions as deviations, which are too small to see beside the toe's path."""
    apart = quantity.name == "toe_position_m"
    what = f"{quantity.title}, deviation from the ideal" if apart else quantity.title
    parts = [_components(arrays, quantity, apart) for _, arrays in found]
    limits = _limits(parts, 0.0 if apart else 0.02)
    pictures = []
    for (point, _), part in zip(found, parts, strict=True):
        titles = [f"{name} [{quantity.unit}]".strip() for name in part]
        image = _cycle_panels(point.label, dict(zip(titles, part.values(), strict=True)), 1.35, limits)
        alt = f"{what} over the crank angle, {point.label}: the ideal, the ensemble's band, one run"
        pictures.append(Picture(image=image, alt=alt))
    caption = f"{what[0].upper()}{what[1:]} [{quantity.unit}] over one gait cycle. {_KEY}"
    if not apart:
        caption += " Spikes beyond the panel are cut off; the tables have the largest errors."
    return Gallery(pictures=pictures, caption=caption)


def _components(arrays: Arrays, quantity: Quantity, apart: bool) -> dict[str, _Line]:
    """Curves by component, x and y, or one curve without a name for a scalar; in the quantity's unit.

    If ``apart``, they are deviations from the ideal curve.
    """
    ideal, factor = arrays[f"ideal_{quantity.name}"], quantity.factor
    band, example = (arrays[f"{kind}_{quantity.name}"] for kind in ("band", "example"))
    if ideal.ndim == 1:
        return {"": (factor * ideal, factor * band, factor * example)}
    under = np.zeros_like(ideal) if apart else ideal  # of a vector, band and example are deviations
    curves = [factor * each for each in (under, under + band, under + example)]
    return {name: (curves[0][..., i], curves[1][..., i], curves[2][..., i]) for i, name in enumerate("xy")}


def _limits(parts: Sequence[dict[str, _Line]], cut: float) -> tuple[float, float]:
    """Vertical range for all panels; the fraction ``cut`` of the examples' samples may lie outside."""
    lines = [line for part in parts for line in part.values()]
    insides = [np.quantile(example, (cut / 2.0, 1.0 - cut / 2.0)) for _, _, example in lines]
    every = [*insides, *(ideal for ideal, _, _ in lines), *(band.ravel() for _, band, _ in lines if not cut)]
    low, high = min(float(part.min()) for part in every), max(float(part.max()) for part in every)
    margin = 0.05 * (high - low) or 1.0
    return low - margin, high + margin


def _force_gallery(found: Found) -> Gallery:
    """Forces of the clearance joints, on logarithmic axes."""
    pictures = []
    for point, arrays in found:
        joints, lines = [str(name) for name in arrays["joints"]], {}
        example = np.linalg.norm(arrays["example_contact_force_n"], axis=-1)
        for k, name in enumerate(clearance_joints_of(arrays)):
            ideal = arrays["ideal_joint_force_n"][:, joints.index(name)]
            lines[name] = ideal, arrays["band_contact_force_n"][..., k], example[:, k]
        image = _cycle_panels(point.label, lines, 1.05)
        pictures.append(Picture(image=image, alt=f"Contact forces over the crank angle, {point.label}"))
    caption = (
        f"Contact forces [N] over one gait cycle, logarithmic; at {LEAST_N} N the journal is free. {_KEY}"
    )
    return Gallery(pictures=pictures, caption=caption)


def _cycle_panels(
    title: str, lines: Mapping[str, _Line], height: float, limits: tuple[float, float] | None = None
) -> bytes:
    """PNG of panels above each other, by their labels, over the crank angle; without limits logarithmic."""
    figure = new_figure(_WIDE, height * len(lines) + 0.75)
    panels = list(np.atleast_1d(figure.subplots(len(lines), 1, sharex=True)))
    for axes, (label, line) in zip(panels, lines.items(), strict=True):
        ideal, band, example = line if limits else (np.maximum(each, LEAST_N) for each in line)
        angle = np.arange(len(example)) * (360.0 / len(example))
        axes.fill_between(angle, band[0], band[-1], color=SKY, alpha=0.45, linewidth=0.0)
        axes.plot(angle, ideal, color=INK, linewidth=1.2, linestyle=(0, (4, 2)))
        axes.plot(angle, example, color=BLUE, linewidth=0.7)
        finish(axes, y=label)
        axes.set(**_TURN)
        if limits is None:
            axes.set_yscale("log")
            axes.yaxis.label.set(rotation=0.0, ha="right", va="center", weight="bold")
        else:
            axes.set_ylim(limits)
    finish(panels[0], title, y=panels[0].get_ylabel())
    panels[-1].set_xlabel("crank angle [°]", fontsize=SMALL)
    return png(figure)


# Errors, forces and wear over the varied parameter (trend) or over named points (comparison).


_CAPTION = (
    "Points: means; bars: from the 10th to the 90th percentile of all runs' cycles, or of runs for the 99 % "
    "and wear."
)


class Spreads(NamedTuple):
    """Data of one picture: for each name, a spread at each point; None where the point has no value."""

    title: str
    lines: dict[str, list[Spread | None]]
    factor: float = 1.0


def panel_of_joints(found: Found, name: str, title: str, factor: float = 1.0) -> Spreads:
    """A statistic of each clearance joint at each point."""
    joints = dict.fromkeys(name for _, arrays in found for name in clearance_joints_of(arrays))
    lines = {
        joint: [
            of_joint(arrays, name, joint) if joint in clearance_joints_of(arrays) else None
            for _, arrays in found
        ]
        for joint in joints
    }
    return Spreads(title, lines, factor)


def exponent_panel(estimates: Sequence[Estimate | None]) -> Spreads:
    """Bars of two standard errors."""
    line = [
        None
        if one is None
        else Spread(one.value, one.error, one.value - 2.0 * one.error, one.value + 2.0 * one.error)
        for one in estimates
    ]
    return Spreads("largest Lyapunov exponent [1/cycle]", {"": line})


def panels_of(found: Found) -> list[Spreads]:
    """Data of the pictures of every study."""
    errors = [
        Spreads(
            f"{each.title}, largest error [{each.unit}]",
            {"": [largest_error(arrays, each.name) for _, arrays in found]},
            each.factor,
        )
        for each in quantities(found)
    ]
    return [
        *errors,
        panel_of_joints(found, "peak_force_n", "largest contact force in a cycle [N]"),
        panel_of_joints(found, "p99_force_n", "contact force, 99 % of the time below [N]"),
        panel_of_joints(found, DEPTH, "greatest wear depth [pm a cycle]", PICO),
    ]


def trend_gallery(panels: Sequence[Spreads], values: Sequence[float], axis: str) -> Gallery:
    """Pictures over a numeric parameter, such as the clearance."""
    pictures = []
    for panel in panels:
        figure = new_figure(_WIDE, 2.9)
        axes = figure.subplots()
        for known, mean, bars, look in _lines(panel):
            axes.errorbar(np.array(values)[known], mean, yerr=bars, linewidth=1.0, elinewidth=1.0, **look)
        axes.set_ylim(bottom=0.0)
        finish(axes, panel.title, x=axis, columns=5)
        pictures.append(Picture(image=png(figure), alt=f"{panel.title} over {axis}: {_as_text(panel)}"))
    return Gallery(pictures=pictures, caption=_CAPTION)


def compare_gallery(panels: Sequence[Spreads], labels: Sequence[str]) -> Gallery:
    """Pictures with a row for each point."""
    pictures = []
    for panel in panels:
        count = len(panel.lines)
        figure = new_figure(_WIDE, 0.75 + len(labels) * max(0.24, 0.1 * count))
        axes = figure.subplots()
        for i, (known, mean, bars, look) in enumerate(_lines(panel)):
            rows = np.array(known) + (i - 0.5 * (count - 1)) * 0.7 / count
            axes.errorbar(mean, rows, xerr=bars, linestyle="none", elinewidth=1.2, **look)
        axes.set_yticks(np.arange(len(labels)), labels)
        axes.set_ylim(len(labels) - 0.5, -0.5)
        axes.set_xlim(left=min(0.0, axes.get_xlim()[0]) if axes.dataLim.x0 < 0.0 else 0.0)
        finish(axes, panel.title, columns=5)
        pictures.append(Picture(image=png(figure), alt=f"{panel.title}: {_as_text(panel, labels)}"))
    return Gallery(pictures=pictures, caption=_CAPTION)


def _lines(panel: Spreads) -> Iterator[tuple[list[int], list[float], list[list[float]], dict[str, Any]]]:
    """Points that are known, their means, lengths of the bars below and above these, and looks of a line."""
    for (colour, mark), (name, spreads) in zip(MARKS, panel.lines.items(), strict=False):
        known = {i: one for i, one in enumerate(spreads) if one}
        below = [panel.factor * max(0.0, one.mean - one.low) for one in known.values()]
        above = [panel.factor * max(0.0, one.high - one.mean) for one in known.values()]
        look = {"color": colour, "marker": mark, "label": name or None, "markersize": 5.0, "capsize": 3.0}
        yield list(known), [panel.factor * one.mean for one in known.values()], [below, above], look


def _as_text(panel: Spreads, labels: Sequence[str] = ()) -> str:
    """Alternative text of the picture: the means of all points."""
    texts = []
    for name, spreads in panel.lines.items():
        means = [f"{panel.factor * one.mean:.3g}" if one else "none" for one in spreads]
        if labels:
            means = [f"{label} {mean}" for label, mean in zip(labels, means, strict=True)]
        texts.append(f"{name} {', '.join(means)}".strip())
    return "; ".join(texts)


# Worn profiles: an exaggerated section, depth over the angle, and the worst zone enlarged; and lives.


_AROUND = 20.0  # angle shown on both sides of the worst zone [deg]


def wear_gallery(
    mechanism: Mechanism, found: Found, what: str, depths: Callable[[Arrays], Floats]
) -> Gallery:
    """A picture for each worn joint.

    Parameters
    ----------
    mechanism : Mechanism
    found : sequence of (point, arrays)
    what : str
        Description of the depths for the caption, such as "Wear of a million cycles".
    depths : callable
        Depths (r, k, 2, N) [m] of bushings and journals of k joints in each of r runs, over N sectors.
    """
    pictures = [
        _worn(mechanism, named(point.label, joint), joint, np.asarray(depths(arrays)[:, k], dtype=float))
        for point, arrays in found
        for k, joint in enumerate(clearance_joints_of(arrays))
    ]
    caption = (
        f"{what}. Left: bushing (blue) and journal (vermilion) as a section, the depth magnified by the "
        "factor above. Right: the worst zone enlarged. Below: unrolled. Lines: means over "
        "runs; shaded: from the least to the greatest of the runs. The black arc, and the grey ground, "
        "contain 90 % of the bushing's wear. Angles in each body's own frame."
    )
    return Gallery(pictures=pictures, caption=caption)


def _worn(mechanism: Mechanism, title: str, joint: str, depth: Floats) -> Picture:
    """A joint's worn surfaces, from the depth (r, 2, N) [m] in each of r runs."""
    mean, zone = depth.mean(axis=0), wear_zone(depth.mean(axis=0)[BUSHING])
    factor, unit = length_unit(float(depth.max()))
    figure = new_figure(4.8, 4.6)
    grid = figure.add_gridspec(2, 2, height_ratios=(1.25, 1.0))
    section = figure.add_subplot(grid[0, 0], projection="polar")
    exaggerated = draw_section(section, mean, zone, mechanism.clearances[joint].bushing_radius)
    section.set_title(exaggerated, fontsize=SMALL + 1.0, color=INK)
    worst, whole = figure.add_subplot(grid[0, 1]), figure.add_subplot(grid[1, :])
    for axes in (worst, whole):
        draw_depth(axes, factor * depth, zone)
        axes.set_ylabel(f"depth [{unit}]", fontsize=SMALL)
    whole.set(**_TURN)
    whole.set_xlabel("angle in its own body [°]", fontsize=SMALL)
    _enlarge(worst, mean[BUSHING])
    figure.suptitle(title, fontsize=SMALL + 2.0, fontweight="bold", color=INK)
    alt = (
        f"Wear of {title}: greatest depth of the bushing {factor * mean[BUSHING].max():.3g} {unit}, "
        f"90 % of it from {zone_text(zone)}"
    )
    return Picture(image=png(figure), alt=alt)


def _enlarge(axes: Axes, depth: Floats) -> None:
    """Limit the axes to the narrowest zone that contains half of the wear, and a margin."""
    zone = wear_zone(depth, 0.5) or (0.0, 360.0)
    low, high = zone[0] - _AROUND, zone[1] + _AROUND
    axes.set_xlim(low, min(high, low + 360.0))
    ticks = np.linspace(math.ceil(low / 10.0) * 10.0, math.floor(high / 10.0) * 10.0, 4)
    axes.set_xticks(ticks, [f"{tick % 360.0:.0f}°" for tick in ticks])
    axes.set_title("worst zone", fontsize=SMALL + 1.0, color=INK)


def life_gallery(lives: Found) -> Gallery:
    """Mean and largest clearance of every joint over the cycles."""
    pictures = []
    for point, arrays in lives:
        figure, joints = new_figure(_WIDE, 3.0), clearance_joints_of(arrays)
        axes = figure.subplots()
        mean, largest = 1.0e3 * arrays["clearance_mean_m"], 1.0e3 * arrays["clearance_max_m"]
        for run, cycles in enumerate(MILLIONTH * arrays["cycles"]):
            names = [None] * len(joints) if run else joints
            draw_clearances(axes, cycles, mean[run], largest[run], names)
        axes.set_xlim(left=0.0)
        finish(axes, point.label, x="gait cycles [millions]", y="radial clearance [mm]", columns=5)
        ends = zip(joints, mean[:, 0].mean(axis=0), mean[:, -1].mean(axis=0), strict=True)
        words = ", ".join(f"{joint} {new:.3f} to {last:.3f} mm" for joint, new, last in ends)
        alt = f"Clearances of {point.label} over the life: {words}"
        pictures.append(Picture(image=png(figure), alt=alt))
    caption = (
        "Clearances as wear feeds back. Full: mean around the joint; dashed: where it is largest, both "
        "surfaces added up in their own frames. A line for each run."
    )
    return Gallery(pictures=pictures, caption=caption)

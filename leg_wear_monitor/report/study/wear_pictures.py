"""Figures of worn profiles: an exaggerated section, depth over the angle, and the worst zone enlarged."""

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.report.figures.figure import BLUE, INK, PALE, SMALL, VERMILION, new_figure, png, tidy
from leg_wear_monitor.report.figures.units import length_unit
from leg_wear_monitor.report.figures.worn_bushings import draw_section
from leg_wear_monitor.report.parts import Gallery, Picture
from leg_wear_monitor.report.study.text import zone_text
from leg_wear_monitor.wear.surfaces import BUSHING, JOURNAL, wear_zone

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

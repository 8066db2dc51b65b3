"""Figure of the worn profiles of bushings and journals, joint by joint."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.report.figures.figure import BLUE, INK, PALE, SMALL, USUAL, VERMILION, new_figure, tidy
from leg_wear_monitor.report.figures.units import length_unit
from leg_wear_monitor.wear.surfaces import BUSHING, JOURNAL, Surfaces, wear_zone

_COLUMN_IN = 2.3
_BUSHING, _JOURNAL, _RIM = 1.0, 0.86, 1.75  # drawn radii, as multiples of the bushing's radius
_DEEPEST = 0.5  # drawn depth of the greatest wear depth, as a multiple of the bushing's radius
_SUPERSCRIPT = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")


def worn_bushings(
    surfaces: Surfaces, names: tuple[str, ...], radius_m: tuple[float, ...], cycles: float
) -> Figure:
    """Figure of each joint's worn surfaces: a section with exaggerated depth, and the depth over the angle.

    Parameters
    ----------
    surfaces : Surfaces
    names : tuple of str
        The joints, in the order of the surfaces.
    radius_m : tuple of float
        Radii of their bushings [m]; the exaggeration factor refers to them.
    cycles : float
        Number of gait cycles of the run, for the title.

    Returns
    -------
    Figure
    """
    figure = new_figure(max(2, len(names)) * _COLUMN_IN, 4.9)
    grid = figure.add_gridspec(3, len(names), height_ratios=(3.0, 2.0, 0.3))
    scale, unit = length_unit(float(surfaces.depth.max()))
    for k, name in enumerate(names):
        depth, zone = surfaces.depth[k], wear_zone(surfaces.depth[k, BUSHING])
        section = figure.add_subplot(grid[0, k], projection="polar")
        factor = draw_section(section, depth, zone, radius_m[k])
        section.set_title(
            f"{name}\n" + (f"depth × {factor}" if factor else "no wear"), fontsize=USUAL, color=INK
        )
        unrolled = figure.add_subplot(grid[1, k])
        _draw_unrolled(unrolled, depth * scale, zone)
        if k == 0:
            unrolled.set_ylabel(f"depth [{unit}]", fontsize=SMALL)
    _draw_key(figure.add_subplot(grid[2, :]))
    title = f"Wear after {cycles:.4g} gait cycles"
    figure.suptitle(title, fontsize=USUAL, fontweight="bold", color=INK)
    return figure


def _draw_key(axes: Axes) -> None:
    axes.set_axis_off()
    entries = {
        "bushing": Line2D([], [], color=BLUE, linewidth=2.0),
        "journal": Line2D([], [], color=VERMILION, linewidth=2.0),
        "90 % of the bushing's wear": Line2D([], [], color=INK, linewidth=4.0, solid_capstyle="butt"),
    }
    axes.legend(list(entries.values()), list(entries), ncols=3, fontsize=SMALL, frameon=False, loc="center")


def draw_section(axes: Axes, depth: Floats, zone: tuple[float, float] | None, radius: float) -> str:
    """Draw a section of bushing and journal with exaggerated wear depth (2, N) [m].

    ``zone`` [deg] is marked by an arc at the rim; ``radius`` is that of the bushing [m]. Returns the
    exaggeration factor as text, empty without wear.
    """
    n, greatest = depth.shape[1], float(depth.max())
    angle = (np.arange(n + 1) + 0.5) * (TURN / n)
    drawn = np.concatenate([depth, depth[:, :1]], axis=1) * (_DEEPEST / greatest if greatest > 0.0 else 0.0)
    axes.fill_between(angle, _BUSHING + drawn[BUSHING], _RIM, color=BLUE, alpha=0.3, linewidth=0.0)
    axes.plot(angle, _BUSHING + drawn[BUSHING], color=BLUE, linewidth=1.4)
    axes.fill_between(angle, 0.0, _JOURNAL - drawn[JOURNAL], color=VERMILION, alpha=0.3, linewidth=0.0)
    axes.plot(angle, _JOURNAL - drawn[JOURNAL], color=VERMILION, linewidth=1.4)
    if zone is not None:
        arc = np.deg2rad(np.linspace(*zone, 181))
        axes.plot(
            arc, np.full(arc.shape, _RIM), color=INK, linewidth=4.0, solid_capstyle="butt", clip_on=False
        )
    axes.set_ylim(0.0, _RIM)
    axes.set_yticks([])
    axes.set_xticks(np.deg2rad([0.0, 90.0, 180.0, 270.0]))
    axes.tick_params(labelsize=SMALL, labelcolor=INK, pad=1.0)
    axes.grid(False)
    axes.spines["polar"].set_visible(False)
    return _factor(_DEEPEST * radius / greatest) if greatest > 0.0 else ""


def _factor(value: float) -> str:
    exponent = math.floor(math.log10(value))
    power = str(exponent).translate(_SUPERSCRIPT)
    return f"{value:.0f}" if exponent < 3 else f"{value / 10.0**exponent:.1f}·10{power}"


def _draw_unrolled(axes: Axes, depth: Floats, zone: tuple[float, float] | None) -> None:
    n = depth.shape[1]
    angle = (np.arange(n) + 0.5) * (360.0 / n)
    if zone is not None:
        for turn in (0.0, -360.0):
            left, right = max(0.0, zone[0] + turn), min(360.0, zone[1] + turn)
            if right > left:
                axes.axvspan(left, right, color=PALE, alpha=0.6, linewidth=0.0)
    axes.fill_between(angle, depth[BUSHING], color=BLUE, alpha=0.25, linewidth=0.0)
    axes.plot(angle, depth[BUSHING], color=BLUE, linewidth=1.2)
    axes.plot(angle, depth[JOURNAL], color=VERMILION, linewidth=1.2)
    tidy(axes)
    axes.set(xlim=(0.0, 360.0), xticks=(0.0, 90.0, 180.0, 270.0, 360.0))
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel("angle in its own body [°]", fontsize=SMALL)

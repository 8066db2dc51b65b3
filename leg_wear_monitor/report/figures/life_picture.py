"""Figure of a leg's wear life: clearances, peak forces and worn profiles over gait cycles."""

import numpy as np
from matplotlib.axes import Axes

from leg_wear_monitor.life.result import Life
from leg_wear_monitor.report.figures.figure import BODY_COLOURS, INK, SMALL, new_figure, png, tidy

_PROFILES = 5


def life_picture(life: Life) -> bytes:
    """PNG: mean (solid) and largest (dashed) clearance, peak force, and bushing profiles at five times."""
    joints = len(life.clearance_joints)
    figure = new_figure(max(7.0, 2.2 * joints), 6.0)
    grid = figure.add_gridspec(2, 2 * joints, height_ratios=(1.2, 1.0))
    clearance, peak = figure.add_subplot(grid[0, :joints]), figure.add_subplot(grid[0, joints:])
    draw_clearances(clearance, life)
    for k in range(joints):
        peak.plot(life.cycles, 1e-3 * life.peak_force_n[:, k], color=_colour(k))
        _profiles(figure.add_subplot(grid[1, 2 * k : 2 * k + 2]), life, k, _colour(k))
    clearance.legend(fontsize=SMALL, frameon=False)
    for axes, name in ((clearance, "radial clearance [µm]"), (peak, "peak contact force [kN]")):
        axes.set_ylabel(name, fontsize=SMALL, color=INK)
        axes.set_xlabel("gait cycles", fontsize=SMALL, color=INK)
        tidy(axes)
    return png(figure)


def draw_clearances(axes: Axes, life: Life) -> None:
    """Mean (and dashed, largest) clearance [µm] of each joint over the gait cycles."""
    for k, joint in enumerate(life.clearance_joints):
        axes.plot(life.cycles, 1e6 * life.clearance_m[:, k], color=_colour(k), label=joint)
        axes.plot(life.cycles, 1e6 * life.clearance_max_m[:, k], color=_colour(k), ls="--", lw=0.7)


def _colour(k: int) -> str:
    return BODY_COLOURS[k % len(BODY_COLOURS)]


def _profiles(axes: Axes, life: Life, k: int, colour: str) -> None:
    """Draw the wear depth of the bushing of clearance joint k over the angle, darker with age."""
    sectors = life.depth.shape[-1]
    angle = (np.arange(sectors) + 0.5) * (360.0 / sectors)
    times = np.linspace(0.0, life.cycles[-1], _PROFILES + 1)[1:]
    for shade, time in enumerate(times, 1):
        at = int(np.abs(life.cycles - time).argmin())
        axes.plot(angle, 1e6 * life.depth[at, k, 0], color=colour, alpha=shade / _PROFILES, lw=0.9)
    axes.set(xlim=(0.0, 360.0), xticks=(0.0, 180.0, 360.0))
    axes.set_title(f"{life.clearance_joints[k]}: bushing [µm] by angle [°]", fontsize=SMALL, color=INK)
    tidy(axes)

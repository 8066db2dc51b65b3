"""Bushings for a leg that is being designed: how long each joint lasts with commercial pairs and sizes.

One life gives the sliding work of every joint over its clearance. A bushing of a different size has the same
forces and turns by the same angles, so its sliding work is proportional to its radius, and its mean clearance
grows by the worn volume over its surface:

    dc/dt = (k_bushing + k_journal) w(c) / (2 pi b)

w is the integral of F_N |v_t| over the time, per radius and second, and b the width. The diameter is not in
it: it changes the pressure, and so whether the makers' limits hold. Forces are supposed not to depend on the
stiffness and friction of a pair. A life (`leg_wear_monitor.simulate_life`) of the chosen bushings checks it.
"""

import math
from collections.abc import Callable, Sequence
from itertools import product

import attrs
import numpy as np

from leg_wear_monitor.dynamics.simulation import simulate
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.life.life import LifeRun, simulate_life
from leg_wear_monitor.life.result import Duty, Life
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.materials import (
    USUAL_SPREAD,
    Bushing,
    BushingLoad,
    load_material,
    materials,
    spread_of,
)
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.mechanism.spec import Clearance, Mechanism

DIAMETERS_M = 0.008, 0.010, 0.012, 0.016, 0.020
WIDTHS_M = 0.008, 0.010, 0.012, 0.015, 0.020
CLEARANCES_M = 25.0e-6, 50.0e-6, 100.0e-6

_P90 = 1.2815515655446004  # standard deviations from the median to the 90th percentile
_NOMINAL = 1.0e-15  # 1/Pa: coefficient of the simulated life; it scales only the time, which is not used
# fraction of the fastest joint's sliding: bounds the factor of a joint that hardly slides
_LEAST_GROWTH = 1.0e-3
_CYCLES = 12  # gait cycles of the forces that are compared with the makers' limits
_STEPS = 64  # points of a life's integral over the clearance


@attrs.frozen(kw_only=True)
class BushingLife:
    """A bushing and its pin in a joint, and how long they last under the duty.

    Attributes
    ----------
    joint, material : str
    diameter_m, width_m, clearance_m : float
        Diameter of the pin, width, and radial clearance when new.
    is_present : bool
        True if this is the joint's present bushing.
    lasts : bool
        True if nine of ten such bushings last the hours wanted.
    limited_by : str
        ``p``, ``v``, ``p v`` or ``impact`` if a limit of the maker is exceeded, so that no life holds; else
        ``wear``, or ``nothing`` without wear.
    wear_h : tuple of three floats, or None
        Hours until the clearance reaches its limit, as 10th, 50th and 90th percentile; None if the joint
        does not wear.
    load : BushingLoad
        Pressure and sliding speed with the pair's limits.
    peak_pressure_pa : float
        Compared with the limit of the pair at rest.
    """

    joint: str
    material: str
    diameter_m: float
    width_m: float
    clearance_m: float
    is_present: bool
    lasts: bool
    limited_by: str
    wear_h: tuple[float, float, float] | None
    load: BushingLoad
    peak_pressure_pa: float


def design(
    mechanism: Mechanism,
    duty: Duty,
    *,
    hours: float = 1000.0,
    limit_m: float = 6.0e-4,
    pairs: Sequence[str] | None = None,
    diameters_m: Sequence[float] = DIAMETERS_M,
    widths_m: Sequence[float] = WIDTHS_M,
    clearances_m: Sequence[float] = CLEARANCES_M,
    progress: Callable[[float], None] | None = None,
) -> list[BushingLife]:
    """Lives of a leg's clearance joints under a duty, with their present bushings and with others.

    Parameters
    ----------
    mechanism : Mechanism
    duty : Duty
    hours : float
        Hours of walking that each joint should last.
    limit_m : float
        Mean clearance at which a joint's life ends [m].
    pairs : sequence of str, optional
        Material pairs to try; if not given, all that come with the package and have a wear coefficient.
    diameters_m, widths_m, clearances_m : sequences of float
        Diameters of the pin, widths, and radial clearances when new to try [m].
    progress : callable, optional
        Called with the completed fraction.

    Returns
    -------
    list of BushingLife
        Joint by joint: the present bushing, then the bushings that last, smallest first, then the rest.

    Raises
    ------
    ConfigError, AssemblyError, SimulationError
    """
    tried = {name: load_material(name) for name in (materials() if pairs is None else pairs)}
    wears = {name: pair.wear_coefficients for name, pair in tried.items()}
    if pairs is not None and None in wears.values():
        name = next(name for name, wear in wears.items() if wear is None)
        raise ConfigError("materials", "", f"{name} gives no wear coefficient of both bodies")
    present = {joint: mechanism.clearances[joint] for joint in mechanism.clearance_joints}
    fresh = [*clearances_m, *(own.radial_clearance for own in present.values())]
    radii = [*(0.5 * each for each in diameters_m), *(own.bushing_radius for own in present.values())]
    if not max(fresh) < limit_m < min(radii):
        raise ConfigError(
            "limit-m",
            "",
            f"{limit_m:g} m is not between {max(fresh):g} m, the largest clearance when new, and "
            f"{min(radii):g} m, the smallest radius of a bushing",
        )
    life = _even_life(mechanism, duty, min(fresh), limit_m, progress)
    forces = _forces(mechanism, duty, min(fresh))
    table: list[BushingLife] = []
    for k, own in enumerate(present.values()):
        others = [
            attrs.evolve(
                own,
                material=tried[name].name,
                wear_coefficient=wear,
                bushing_radius=0.5 * diameter,
                width=width,
                radial_clearance=clearance,
            )
            for name, wear in wears.items()
            if wear is not None
            for diameter, width, clearance in product(diameters_m, widths_m, clearances_m)
        ]
        rows = [_row(mechanism, life, k, forces[k], each, hours, limit_m) for each in others]
        rows.sort(key=_smallest_that_lasts)
        now = _row(mechanism, life, k, forces[k], own, hours, limit_m)
        table += [attrs.evolve(now, is_present=True), *rows]
    return table


def _smallest_that_lasts(row: BushingLife) -> tuple[bool, float, float]:
    """Order of the rows of a joint: first the bushings that last, then by size, then by life."""
    longest = row.wear_h[1] if row.wear_h else 0.0
    return not row.lasts, row.diameter_m * row.width_m, -longest


def _even_life(
    mechanism: Mechanism,
    duty: Duty,
    clearance_m: float,
    limit_m: float,
    progress: Callable[[float], None] | None,
) -> Life:
    """A life from a common clearance; all joints reach the limit at about the same time.

    It shows the sliding work of every joint over its whole clearance.
    """
    clearances = {
        joint: attrs.evolve(settings, material="", wear_coefficient=(_NOMINAL, _NOMINAL))
        for joint, settings in mechanism.clearances.items()
    }
    leg = attrs.evolve(mechanism, clearances=clearances)
    growth = LifeRun(leg, duty=duty, clearance_m=clearance_m).points[0].rate.clearance
    factor = growth.max() / np.maximum(growth, _LEAST_GROWTH * growth.max())
    run = LifeRun(leg, duty=duty, clearance_m=clearance_m, wear_factor=factor)
    return simulate_life(run, limit_m=limit_m, horizon_cycles=math.inf, progress=progress)


def _forces(mechanism: Mechanism, duty: Duty, clearance_m: float) -> Floats:
    """Mean force over the duty, and 99th percentile under its hardest load, of each joint (k, 2) [N]."""
    results = [simulate(leg, clearance_m=clearance_m, cycles=_CYCLES) for leg in duty.mechanisms(mechanism)]
    of_joints = [[one.joints[joint] for one in results] for joint in mechanism.clearance_joints]
    mean = [duty.shares @ [one.mean_force_n for one in parts] for parts in of_joints]
    return np.stack([mean, [max(one.p99_force_n for one in parts) for parts in of_joints]], axis=1)


def _row(
    mechanism: Mechanism,
    life: Life,
    k: int,
    forces_n: Floats,
    bushing: Clearance,
    hours: float,
    limit_m: float,
) -> BushingLife:
    """The table's row of a bushing in joint k, which carries a mean force and a 99th percentile [N]."""
    joint = life.clearance_joints[k]
    rubbing_w = life.rubbing_j_per_cycle[:, k] / life.period_s
    rubbing_w *= bushing.bushing_radius / mechanism.clearances[joint].bushing_radius
    is_swinging = mechanism.drive.body not in mechanism.sides(joint)
    of_pair = Bushing.of(bushing, is_swinging=is_swinging)
    load = of_pair.load(float(forces_n[0]), float(forces_n[1]), float(rubbing_w[0]))
    peak_pa = float(life.peak_force_n[0, k]) / of_pair.area_m2
    wear_h = _wear_hours(bushing, life.clearance_m[:, k], rubbing_w, limit_m)
    # The scatter of the motion is a few percent; the scatter of wear coefficients is a factor of two.
    away = math.exp(_P90 * (spread_of(bushing, USUAL_SPREAD) or USUAL_SPREAD))
    limited_by = _limited_by(bushing, load, peak_pa, wear_h)
    surely_h = {"wear": wear_h / away, "nothing": math.inf}
    return BushingLife(
        joint=joint,
        material=bushing.material,
        diameter_m=2.0 * bushing.bushing_radius,
        width_m=bushing.width,
        clearance_m=bushing.radial_clearance,
        is_present=False,
        lasts=surely_h.get(limited_by, 0.0) >= hours,
        limited_by=limited_by,
        wear_h=(wear_h / away, wear_h, wear_h * away) if math.isfinite(wear_h) else None,
        load=load,
        peak_pressure_pa=peak_pa,
    )


def _wear_hours(bushing: Clearance, clearance_m: Floats, rubbing_w: Floats, limit_m: float) -> float:
    """Hours until a bushing's mean clearance reaches its limit; infinite if it does not wear."""
    grows_by = sum(bushing.wear_coefficient) / (TURN * bushing.bushing_radius * bushing.width)
    if grows_by == 0.0:
        return math.inf
    at, step = np.linspace(bushing.radial_clearance, limit_m, _STEPS, retstep=True)
    slowness = 1.0 / (grows_by * np.interp(at, clearance_m, rubbing_w))
    return float(step * (slowness.sum() - 0.5 * (slowness[0] + slowness[-1]))) / 3600.0


def _limited_by(bushing: Clearance, load: BushingLoad, peak_pa: float, wear_h: float) -> str:
    """The reason for which the life of a bushing ends, or is not valid."""
    fractions = load.fractions
    if max(fractions.values(), default=0.0) > 1.0:
        return max(fractions, key=lambda name: fractions[name])
    limits = load_material(bushing.material).limits if bushing.material else None
    if limits and limits.static_pressure and peak_pa > limits.static_pressure.si:
        return "impact"
    return "wear" if math.isfinite(wear_h) else "nothing"

"""Load of the bushings of a leg that wears, for the limits and formulas of their makers."""

import math
from typing import Any

from leg_wear_monitor.contact.conformity import contact_doubt, half_angle_of
from leg_wear_monitor.life.result import Life
from leg_wear_monitor.mechanism.clearance import Clearance
from leg_wear_monitor.mechanism.materials.load import bushing_of
from leg_wear_monitor.mechanism.materials.loader import load_material
from leg_wear_monitor.mechanism.materials.of_joints import lacks_wear, regime_of
from leg_wear_monitor.mechanism.materials.rating_life import rating_life_hours
from leg_wear_monitor.mechanism.spec import Mechanism


def pressure_speed(mechanism: Mechanism, life: Life) -> dict[str, float]:
    """Mean pressure times sliding speed [Pa m/s] of each joint when new, whether it wears or not.

    It is W / (2 R w) over the period, with W the integral of F_N |v_t| dt over a gait cycle.

    Parameters
    ----------
    mechanism : Mechanism
    life : Life
    """
    found = {}
    for k, joint in enumerate(life.clearance_joints):
        settings = mechanism.clearances[joint]
        area_m2 = 2.0 * settings.bushing_radius * settings.width
        found[joint] = float(life.rubbing_j_per_cycle[0, k]) / (area_m2 * life.period_s)
    return found


def contact_doubts(mechanism: Mechanism, life: Life) -> dict[str, str]:
    """Joints whose normal law does not hold at their largest peak force when new, and why."""
    found = {}
    for k, joint in enumerate(life.clearance_joints):
        settings, force_n = mechanism.clearances[joint], float(life.peak_force_n[0, k])
        psi = half_angle_of(settings, force_n)
        doubt = contact_doubt(psi, force_n, settings.bushing_radius, settings.normal_law == "winkler")
        if doubt:
            found[joint] = doubt
    return found


def rating_hours(settings: Clearance, load: float) -> float | None:
    """Life by the formula of the pair's maker [h], all factors 1; NaN beyond its range, None without one."""
    constants = load_material(settings.material).rating_life if settings.material else None
    return None if constants is None else rating_life_hours(load, constants)


def validity(mechanism: Mechanism, life: Life) -> dict[str, Any]:
    """What each joint's life holds for, as ``life --json`` has it; parameters as of `pressure_speed`."""
    loads, contacts = pressure_speed(mechanism, life), contact_doubts(mechanism, life)
    found = {}
    for joint in life.clearance_joints:
        settings, load = mechanism.clearances[joint], loads[joint]
        hours = rating_hours(settings, load)
        found[joint] = {
            "holds_for": regime_of(settings),
            "is_counted": not lacks_wear(settings),
            "mean_pressure_speed_pa_mps": load,
            "outside_limits": bushing_of(mechanism, joint).loaded(0.0, 0.0, 0.0, load).outside_limits,
            "rating_life_h": None if hours is None or math.isnan(hours) else hours,
            "outside_contact_law": contacts.get(joint),
        }
    return found

"""Load of the bushings of a leg that wears, for the limits and formulas of their makers."""

import math
from typing import Any

from leg_wear_monitor.contact.conformity import contact_doubt, half_angle_of
from leg_wear_monitor.life.result import Life
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.materials.load import Bushing
from leg_wear_monitor.mechanism.materials.of_joints import regime_of
from leg_wear_monitor.mechanism.spec import Mechanism


def pressure_speed(mechanism: Mechanism, life: Life, factor: Floats, period_s: float) -> dict[str, float]:
    """Mean pressure times sliding speed [Pa m/s] of each joint when new, if it wears.

    The mean clearance grows by k W / (2 pi R w) in a cycle, with k the sum of both wear coefficients and W
    the integral of F_N |v_t| dt; the mean of p v is W / (2 R w) over the period.

    Parameters
    ----------
    mechanism : Mechanism
    life : Life
    factor : (k,) array
        Factors on the wear coefficients of this life.
    period_s : float
        Duration of a gait cycle [s].
    """
    found = {}
    for k, joint in enumerate(life.clearance_joints):
        wear = float(factor[k]) * sum(mechanism.clearances[joint].wear_coefficient)
        if wear > 0.0:
            found[joint] = math.pi * float(life.growth_m_per_cycle[0, k]) / (wear * period_s)
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


def validity(mechanism: Mechanism, life: Life, factor: Floats, period_s: float) -> dict[str, Any]:
    """What each joint's life holds for, as ``life --json`` has it; parameters as of `pressure_speed`."""
    loads, contacts = pressure_speed(mechanism, life, factor, period_s), contact_doubts(mechanism, life)
    found = {}
    for joint in life.clearance_joints:
        settings, load = mechanism.clearances[joint], loads.get(joint)
        found[joint] = {
            "holds_for": regime_of(settings),
            "mean_pressure_speed_pa_mps": load,
            "outside_limits": Bushing.of(settings).loaded(0.0, 0.0, 0.0, load or 0.0).outside_limits,
            "outside_contact_law": contacts.get(joint),
        }
    return found

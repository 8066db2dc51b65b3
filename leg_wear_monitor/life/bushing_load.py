"""Load of the bushings of a leg that wears, for the limits and formulas of their makers."""

import math

from leg_wear_monitor.life.result import Life
from leg_wear_monitor.mechanism.arrays import Floats
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

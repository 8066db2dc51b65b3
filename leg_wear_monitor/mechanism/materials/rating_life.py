"""A maker's rating life of a bushing, beside which a life by Archard's law can be held.

SKF, Plain bearings, Calculation example, and Federal-Mogul, GLYCODUR, Nominal service life:
G_h = c1 c2 c3 c4 c5 K_M / (p v)^n, with p in N/mm^2, v in m/s and the life in h. The factors are read from
the makers' diagrams: load, speed, temperature, roughness, kind of load.
"""

import math

from leg_wear_monitor.mechanism.materials.material import RatingLife


def rating_life_hours(pressure_speed: float, constants: RatingLife) -> float:
    """Basic rating life G_h [h], all factors 1; NaN above the p v for which the constants hold.

    Parameters
    ----------
    pressure_speed : float
        Specific load times mean sliding speed [Pa m/s]; the constants have a least value for it.
    constants : RatingLife
        Of a pair.
    """
    largest = constants.largest_pressure_speed
    if largest is not None and pressure_speed > largest.si:
        return math.nan
    inserted = 1.0e-6 * max(pressure_speed, constants.least_pressure_speed.si)
    divided_by: float = inserted**constants.exponent.si
    return constants.constant.si / divided_by

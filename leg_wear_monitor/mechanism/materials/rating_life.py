"""A maker's rating life of a bushing, beside which a life by Archard's law can be held.

SKF, Plain bearings, Calculation example, and Federal-Mogul, GLYCODUR, Nominal service life:
G_h = c1 c2 c3 c4 c5 K_M / (p v)^n, with p in N/mm^2, v in m/s and the life in h. The factors are read from
the makers' diagrams: load, speed, temperature, roughness, kind of load.
"""

import math

from leg_wear_monitor.mechanism.materials.material import RatingLife


def specific_load(force_n: float, dynamic_rating_n: float, load_factor_pa: float) -> float:
    """Specific load p = K F / C [Pa] of a bushing with the basic dynamic load rating C [N]."""
    return load_factor_pa * force_n / dynamic_rating_n


def mean_sliding_speed(bore_m: float, half_angle_rad: float, frequency_hz: float) -> float:
    """Mean sliding speed [m/s] of a pin that swings by half_angle_rad to both sides of its middle.

    A full swing slides by four times the half angle; SKF writes it as 5.82e-7 d beta f in mm, degrees, 1/min.
    """
    return 4.0 * half_angle_rad * 0.5 * bore_m * frequency_hz


def rating_life_hours(
    pressure_speed: float, constants: RatingLife, factors: tuple[float, ...] = (1.0, 1.0, 1.0, 1.0, 1.0)
) -> float:
    """Basic rating life G_h [h]; NaN above the p v for which the constants hold.

    Parameters
    ----------
    pressure_speed : float
        Specific load times mean sliding speed [Pa m/s]; the constants have a least value for it.
    constants : RatingLife
        Of a pair.
    factors : tuple of float
        c1 to c5.
    """
    largest = constants.largest_pressure_speed
    if largest is not None and pressure_speed > largest.si:
        return math.nan
    inserted = 1.0e-6 * max(pressure_speed, constants.least_pressure_speed.si)
    divided_by: float = inserted**constants.exponent.si
    return math.prod(factors) * constants.constant.si / divided_by

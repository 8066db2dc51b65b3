"""Coulomb friction with a ramp around zero slip speed (physics.md section 4)."""

import math

from leg_wear_monitor.kernel import kernel

NONE, AMBROSIO, THRELFALL = 0, 1, 2
FRICTION_CODES = {"none": NONE, "ambrosio": AMBROSIO, "threlfall": THRELFALL}


@kernel
def ambrosio_ramp(speed, v0, v1):
    """Fraction c_d [-] of Coulomb's friction: 0 up to v0, 1 from v1, linear between [m/s] (Ambrosio 2003)."""
    if speed <= v0:
        return 0.0
    return 1.0 if speed >= v1 else (speed - v0) / (v1 - v0)


@kernel
def threlfall_ramp(speed, v1):
    """Fraction [-] of Coulomb's friction, 1 - exp(-3 |v| / v1): 95 % at v1 [m/s] (Threlfall 1978)."""
    return 1.0 - math.exp(-3.0 * speed / v1)


@kernel
def friction_force(law, coefficient, v0, v1, f_n, slip):
    """Tangential force [N] on the journal, opposite to the slip speed [m/s]; f_n the normal force [N]."""
    speed = abs(slip)
    if law == AMBROSIO:
        fraction = ambrosio_ramp(speed, v0, v1)
    elif law == THRELFALL:
        fraction = threlfall_ramp(speed, v1)
    else:
        fraction = 0.0
    return -math.copysign(coefficient * fraction * f_n, slip)

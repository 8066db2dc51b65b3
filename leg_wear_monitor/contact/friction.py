"""Coulomb friction with a ramp around zero slip speed (physics.md section 4)."""

import math

from leg_wear_monitor.compiled.kernel import kernel
from leg_wear_monitor.compiled.vectors import LEAST_DIVISOR, largest, where

NONE, AMBROSIO, THRELFALL = 0, 1, 2
FRICTION_CODES = {"none": NONE, "ambrosio": AMBROSIO, "threlfall": THRELFALL}


@kernel
def ambrosio_ramp(speed, v0, v1):
    """Fraction c_d [-] of Coulomb's friction: 0 up to v0, 1 from v1, linear between [m/s] (Ambrosio 2003).

    For numbers or vectors.
    """
    return where(speed > v0, where(speed < v1, (speed - v0) / largest(v1 - v0, LEAST_DIVISOR), 1.0), 0.0)


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
    return against(slip, coefficient * fraction * f_n)


@kernel
def against(slip, force):
    """A force [N] opposite to the slip speed. For numbers or vectors."""
    return where(slip < 0.0, force, -force)

"""Coulomb friction with a ramp around zero slip speed (physics.md section 4).

To add a law, add its kernel here, an entry of `RAMPS`, and its name to `FRICTION_LAWS` of `mechanism`.
"""

import math

from leg_wear_monitor.compiled.kernel import kernel
from leg_wear_monitor.compiled.vectors import LEAST_DIVISOR, largest, where
from leg_wear_monitor.contact.by_number import by_number


@kernel
def no_ramp(speed, v0, v1):
    """No friction."""
    return 0.0


@kernel
def ambrosio_ramp(speed, v0, v1):
    """Fraction c_d [-] of Coulomb's friction: 0 up to v0, 1 from v1, linear between [m/s] (Ambrosio 2003).

    The arguments are numbers or vectors.
    """
    return where(speed > v0, where(speed < v1, (speed - v0) / largest(v1 - v0, LEAST_DIVISOR), 1.0), 0.0)


@kernel
def threlfall_ramp(speed, v0, v1):
    """Fraction [-] of Coulomb's friction, 1 - exp(-3 |v| / v1): 95 % at v1 [m/s] (Threlfall 1978)."""
    return 1.0 - math.exp(-3.0 * speed / v1)


RAMPS = {"none": no_ramp, "ambrosio": ambrosio_ramp, "threlfall": threlfall_ramp}
"""Kernel of each law: fraction of Coulomb's friction from slip speed and both speeds of the ramp [m/s]."""

FRICTION_CODES = {name: number for number, name in enumerate(RAMPS)}
NONE = FRICTION_CODES["none"]
VECTOR_LAWS = (NONE, FRICTION_CODES["ambrosio"])
"""Laws that vectors of joints compute; every other law is computed joint by joint."""

_fraction = by_number(RAMPS.values())


@kernel
def friction_force(law, coefficient, v0, v1, f_n, slip):
    """Tangential force [N] on the journal, opposite to the slip speed [m/s]; f_n the normal force [N]."""
    return against(slip, coefficient * _fraction(law, abs(slip), v0, v1) * f_n)


@kernel
def against(slip, force):
    """A force [N] opposite to the slip speed. The arguments are numbers or vectors."""
    return where(slip < 0.0, force, -force)

"""Hertz's force K delta^1.5, the elastic part of most laws (physics.md section 4)."""

import math

from leg_wear_monitor.contact.normal.form import Form
from leg_wear_monitor.contact.normal.hysteresis import with_hysteresis
from leg_wear_monitor.kernel import kernel

_EXPONENT = 1.5


@kernel
def contact_stiffness(modulus, bushing_radius, journal_radius):
    """Hertz stiffness K [N/m^1.5] of a journal in a bushing: modulus sqrt(R_b R_j / (R_b - R_j)); Pa, m.

    physics.md section 4.
    """
    return modulus * math.sqrt(bushing_radius * journal_radius / (bushing_radius - journal_radius))


@kernel
def _coefficient(given, modulus, width, bushing, journal):
    """Contact stiffness K [N/m^1.5]: the given one if above 0, else that of the radii [m]."""
    return given if given > 0.0 else contact_stiffness(modulus, bushing, journal)


@kernel
def elastic_force(stiffness, delta):
    """Elastic part of the force, K delta^1.5 [N]; 0 when apart."""
    return stiffness * delta * math.sqrt(delta) if delta > 0.0 else 0.0


@kernel
def _force(stiffness, clearance, loss, delta, delta_dot):
    """As `Form.force`."""
    return with_hysteresis(elastic_force(stiffness, delta), _EXPONENT, loss, delta, delta_dot)


@kernel
def _energy(stiffness, clearance, delta):
    """Energy stored in the contact, 2/5 K delta^2.5 [J]."""
    return 0.4 * elastic_force(stiffness, delta) * max(delta, 0.0)


@kernel
def _softening(given, delta, bushing, journal, slope_b, slope_j):
    """As `Form.softening`: -2/5 delta d ln K, with K that of the local radii."""
    if given > 0.0:
        return 0.0, 0.0
    softer = 0.2 * delta / ((bushing - journal) * bushing * journal)
    return softer * slope_b * journal * journal, softer * slope_j * bushing * bushing


HERTZ = Form(_coefficient, _force, _energy, _softening, takes_stiffness=True)

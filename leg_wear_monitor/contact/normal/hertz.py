"""Hertz's force K delta^1.5, the elastic part of most laws (physics.md section 4)."""

from leg_wear_monitor.contact.normal.form import Form
from leg_wear_monitor.contact.normal.hysteresis import with_hysteresis
from leg_wear_monitor.kernel import kernel
from leg_wear_monitor.vectors import LEAST_DIVISOR, largest, root, where

_EXPONENT = 1.5


@kernel
def contact_stiffness(modulus, bushing_radius, journal_radius):
    """Hertz stiffness K [N/m^1.5] of a journal in a bushing: modulus sqrt(R_b R_j / (R_b - R_j)); Pa, m.

    For numbers or vectors. physics.md section 4.
    """
    clearance = largest(bushing_radius - journal_radius, LEAST_DIVISOR)
    return modulus * root(bushing_radius * journal_radius / clearance)


@kernel
def hertz_coefficient(given, modulus, width, bushing, journal):
    """Contact stiffness K [N/m^1.5]: the given one if above 0, else that of the radii [m].

    For numbers or vectors.
    """
    return where(given > 0.0, given, contact_stiffness(modulus, bushing, journal))


@kernel
def elastic_force(stiffness, delta):
    """Elastic part of the force, K delta^1.5 [N]; 0 when apart. For numbers or vectors."""
    inside = largest(delta, 0.0)
    return stiffness * inside * root(inside)


@kernel
def hertz_force(stiffness, clearance, loss, delta, delta_dot):
    """As `Form.force`, for numbers or vectors."""
    return with_hysteresis(elastic_force(stiffness, delta), _EXPONENT, loss, delta, delta_dot)


@kernel
def _energy(stiffness, clearance, delta):
    """Energy stored in the contact, 2/5 K delta^2.5 [J]."""
    return 0.4 * elastic_force(stiffness, delta) * max(delta, 0.0)


@kernel
def hertz_softening(given, delta, bushing, journal, slope_b, slope_j):
    """As `Form.softening`, for numbers or vectors: -2/5 delta d ln K, with K that of the local radii."""
    softer = 0.2 * delta / largest((bushing - journal) * bushing * journal, LEAST_DIVISOR)
    softer = where(given > 0.0, 0.0, softer)
    return softer * slope_b * journal * journal, softer * slope_j * bushing * bushing


HERTZ = Form(hertz_coefficient, hertz_force, _energy, hertz_softening, takes_stiffness=True)

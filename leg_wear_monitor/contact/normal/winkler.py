"""A conformal contact: pin and bushing on Winkler's elastic foundation (physics.md section 4).

The pressure is proportional to the overlap of the two circles, kappa E* (e cos phi - c) / (R sin psi): the
depth of the foundation grows with the contact (Johnson, Contact Mechanics, 1985, section 4.3), and
kappa = 3 pi / 8 is his 1.18, at which a narrow contact has Hertz's line load at Hertz's width. The integral
over the arc cos psi = c / (c + delta), of axial width w, is

    F = kappa E* w c (2 psi / sin 2 psi - 1),   E* = 1 / (sigma_b + sigma_j),  sigma = (1 - nu^2) / E.

F is below the exact load of a pin in a plate of the same material (Persson 1964, in the form of Ciavarella
and Decuzzi 2001) by 0.2 % at a half angle of 10 degrees, 2 % at 30, 5 % at 45, 11 % at 60 and 28 % at 75:
valid up to 60 degrees, where delta = c. The penetration is that of the circles; in plane elasticity it would
depend logarithmically on the size of the bodies.
"""

import math

from leg_wear_monitor.contact.normal.form import Form
from leg_wear_monitor.contact.normal.hysteresis import with_hysteresis
from leg_wear_monitor.kernel import kernel

_KAPPA = 3.0 * math.pi / 8.0
_E_STAR = 0.75  # E* over the contact modulus 4 / (3 (sigma_b + sigma_j))

_NARROW = 0.02  # tan^2 psi up to which eight terms of the series are exact to rounding
# Gauss-Legendre rule with eight points on [0, 1]: offsets of the pairs of nodes from the middle, and weights
_ASIDE = (0.09171732124782489, 0.26276620495816450, 0.39833323870681336, 0.48014492824876809)
_WEIGHT = (0.18134189168918083, 0.15685332293894344, 0.11119051722668721, 0.05061426814518853)


@kernel
def arc_deficit(square):
    """(1 - atan(T) / T) / T^2 [-] for T^2 = tan^2 psi; its limit at 0 is 1/3."""
    if square > _NARROW:
        tangent = math.sqrt(square)
        return (1.0 - math.atan(tangent) / tangent) / square
    total = 0.0
    for k in range(7, -1, -1):
        total = 1.0 / (2 * k + 3) - square * total
    return total


@kernel
def load(x):
    """2 psi / sin 2 psi - 1 [-] as a function of x, the penetration over the clearance [-]."""
    square = x * (2.0 + x)
    return square * (1.0 - (1.0 + square) * arc_deficit(square))


@kernel
def load_slope(x):
    """Derivative of `load` by x."""
    square = x * (2.0 + x)
    return (1.0 + x) * (1.0 + (1.0 - square) * arc_deficit(square))


@kernel
def load_integral(x):
    """Integral of `load` from 0 to x: exact to rounding up to x = 1 (60 degrees), to 3e-11 at 2.9 (75)."""
    total = 0.0
    for i in range(4):
        total += _WEIGHT[i] * (load((0.5 - _ASIDE[i]) * x) + load((0.5 + _ASIDE[i]) * x))
    return x * total


@kernel
def _coefficient(given, modulus, width, bushing, journal):
    """Coefficient kappa E* w [N/m], independent of the radii."""
    return _KAPPA * _E_STAR * modulus * width


@kernel
def _force(coefficient, clearance, loss, delta, delta_dot):
    """As `Form.force`."""
    if delta <= 0.0:
        return 0.0, 0.0, 0.0, 0.0
    x = delta / clearance
    carried = load(x)
    exponent = x * load_slope(x) / carried
    return with_hysteresis(coefficient * clearance * carried, exponent, loss, delta, delta_dot)


@kernel
def _energy(coefficient, clearance, delta):
    """Energy stored in the contact [J]."""
    return coefficient * clearance * clearance * load_integral(max(delta, 0.0) / clearance)


@kernel
def _softening(given, delta, bushing, journal, slope_b, slope_j):
    """As `Form.softening`: both depths widen the clearance, which only the coefficient does not depend on."""
    x = delta / (bushing - journal)
    softer = x - 2.0 * load_integral(x) / load(x)
    return softer * slope_b, softer * slope_j


WINKLER = Form(_coefficient, _force, _energy, _softening, takes_stiffness=False)

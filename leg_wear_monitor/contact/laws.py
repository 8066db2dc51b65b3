"""Contact laws by name: Coulomb friction with a ramp, and the normal force (physics.md section 4).

To add a law, add its kernel here, an entry of `RAMPS` or `LAWS`, and its name to `FRICTION_LAWS` or
`NORMAL_LAWS` of `mechanism`.
"""

import math
from collections.abc import Callable, Iterable
from typing import Any, NamedTuple

from leg_wear_monitor.compiled.kernel import kernel
from leg_wear_monitor.compiled.vectors import LEAST_DIVISOR, largest, root, where

# A kernel that selects one of several kernels by a number in compiled code.


def by_number(kernels: Iterable[Callable[..., Any]]) -> Callable[..., Any]:
    """Kernel that takes the number of a kernel, from 0, then the arguments of this kernel.

    It is a chain of branches, built once: compiled code cannot cheaply call a function that is an argument.
    """
    *others, last = kernels
    chain = _only(last)
    for number, this in reversed(list(enumerate(others))):
        chain = _either(number, this, chain)
    return chain


def _only(this: Callable[..., Any]) -> Callable[..., Any]:
    """Kernel that calls ``this`` for any number."""

    @kernel
    def only(number, *arguments):
        return this(*arguments)

    return only


def _either(number: int, this: Callable[..., Any], others: Callable[..., Any]) -> Callable[..., Any]:
    """Kernel that calls ``this`` for one number, and ``others`` for any other."""

    @kernel
    def either(given, *arguments):
        if given == number:
            return this(*arguments)
        return others(given, *arguments)

    return either


# Coulomb friction with a ramp around zero slip speed.


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


# Interface of a normal contact law to the equations of motion (physics.md section 4).


class Form(NamedTuple):
    """Kernels of one form of the normal force; both formulations call them through `laws`.

    A law's ``coefficient`` and the local clearance c = R_b - R_j [m] follow from the local radii. Force and
    energy depend on these two and on the penetration delta [m], the force also on its rate [m/s].

    Attributes
    ----------
    coefficient : kernel (given, modulus, width, bushing, journal)
        The law's coefficient, in a unit that depends on the form. ``given`` [N/m^1.5] is the joint's
        ``stiffness`` or 0, ``modulus`` [Pa] the value of `contact_modulus`; width and local radii [m].
    force : kernel (coefficient, clearance, loss, delta, delta_dot)
        Normal force f_n [N], never negative, its derivatives by delta [N/m] and by delta_dot [N s/m], and its
        elastic part [N]; all 0 where delta <= 0. ``loss`` [s/m] is the hysteresis factor over the approach
        speed.
    energy : kernel (coefficient, clearance, delta)
        Stored energy [J], the integral of the elastic part over delta.
    softening : kernel (given, delta, bushing, journal, slope_b, slope_j)
        Decrease of the energy at constant delta by wear depths with slopes [m/rad] of bushing and journal,
        divided by the elastic part of the force; one value [m/rad] for each surface.
    takes_stiffness : bool
        True if a joint's ``stiffness`` [N/m^1.5] may replace the coefficient from modulus and radii.
    """

    coefficient: Callable[..., Any]
    force: Callable[..., Any]
    energy: Callable[..., Any]
    softening: Callable[..., Any]
    takes_stiffness: bool


# Hysteresis damping: F = F_elastic (1 + chi delta_dot / approach_speed) (physics.md section 4).
#
# The factors chi by the nominal coefficient of restitution, and the restitution that results for any
# F_elastic.


def no_loss(restitution: float) -> float:
    """No loss (Hertz 1882)."""
    return 0.0


def hunt_crossley(restitution: float) -> float:
    """Hunt and Crossley 1975; holds for restitution near 1."""
    return 1.5 * (1.0 - restitution)


def lankarani_nikravesh(restitution: float) -> float:
    """Lankarani and Nikravesh 1990; holds for restitution near 1."""
    return 0.75 * (1.0 - restitution**2)


def gonthier(restitution: float) -> float:
    """Gonthier et al. 2004, their first approximation; whole range."""
    return (1.0 - restitution**2) / restitution


def flores(restitution: float) -> float:
    """Flores et al. 2011; whole range."""
    return 1.6 * (1.0 - restitution) / restitution


def hu_guo(restitution: float) -> float:
    """Hu and Guo 2015; whole range."""
    return 1.5 * (1.0 - restitution) / restitution


@kernel
def with_hysteresis(elastic, exponent, loss, delta, delta_dot):
    """Normal force with damping in proportion to its elastic part [N]; never negative: no adhesion.

    The arguments are numbers or vectors. ``exponent`` [-] is the exponent of the elastic part at delta [m], d
    ln F / d ln delta; ``loss`` [s/m] is chi over the approach speed.

    Returns
    -------
    f_n, stiffness, damping, elastic
        Force [N], its derivatives by delta [N/m] and by delta_dot [N s/m], and its elastic part [N].
    """
    f_n = largest(elastic * (1.0 + loss * delta_dot), 0.0)
    stiffness = exponent * f_n / largest(delta, LEAST_DIVISOR)
    return f_n, stiffness, where(f_n > 0.0, elastic * loss, 0.0), elastic


def delivered_restitution(hysteresis: float) -> float:
    """Coefficient of restitution that results from a factor chi, for any elastic force, mass and speed.

    Parameters
    ----------
    hysteresis : float
        chi >= 0.

    Returns
    -------
    float
        The root e in [0, 1] of chi (1 + e) = ln((1 + chi) / (1 - chi e)), found by bisection.
    """
    if hysteresis == 0.0:
        return 1.0

    def surplus(e: float) -> float:
        return hysteresis * (1.0 + e) + math.log1p(-hysteresis * e) - math.log1p(hysteresis)

    # surplus is positive at the trivial side e -> 0 and falls through the root before the pole at 1 / chi
    low, high = 0.0, min(1.0, 1.0 / hysteresis) * (1.0 - 1.0e-15)
    for _ in range(200):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if surplus(middle) > 0.0 else (low, middle)
    return 0.5 * (low + high)


# Hertz's force K delta^1.5, the elastic part of most laws (physics.md section 4).


_EXPONENT = 1.5


@kernel
def contact_stiffness(modulus, bushing_radius, journal_radius):
    """Hertz stiffness K [N/m^1.5] of a journal in a bushing: modulus sqrt(R_b R_j / (R_b - R_j)); Pa, m.

    The arguments are numbers or vectors. physics.md section 4.
    """
    clearance = largest(bushing_radius - journal_radius, LEAST_DIVISOR)
    return modulus * root(bushing_radius * journal_radius / clearance)


@kernel
def hertz_coefficient(given, modulus, width, bushing, journal):
    """Contact stiffness K [N/m^1.5]: the given stiffness if above 0, else computed from the radii [m].

    The arguments are numbers or vectors.
    """
    return where(given > 0.0, given, contact_stiffness(modulus, bushing, journal))


@kernel
def elastic_force(stiffness, delta):
    """Elastic part of the force, K delta^1.5 [N]; 0 when apart. The arguments are numbers or vectors."""
    inside = largest(delta, 0.0)
    return stiffness * inside * root(inside)


@kernel
def hertz_force(stiffness, clearance, loss, delta, delta_dot):
    """Same as `Form.force`, for numbers or vectors."""
    return with_hysteresis(elastic_force(stiffness, delta), _EXPONENT, loss, delta, delta_dot)


@kernel
def _hertz_energy(stiffness, clearance, delta):
    """Energy stored in the contact, 2/5 K delta^2.5 [J]."""
    return 0.4 * elastic_force(stiffness, delta) * max(delta, 0.0)


@kernel
def hertz_softening(given, delta, bushing, journal, slope_b, slope_j):
    """Same as `Form.softening`, for numbers or vectors: -2/5 delta d ln K, with K of the local radii."""
    softer = 0.2 * delta / largest((bushing - journal) * bushing * journal, LEAST_DIVISOR)
    softer = where(given > 0.0, 0.0, softer)
    return softer * slope_b * journal * journal, softer * slope_j * bushing * bushing


HERTZ = Form(hertz_coefficient, hertz_force, _hertz_energy, hertz_softening, takes_stiffness=True)


# A conformal contact: pin and bushing on Winkler's elastic foundation (physics.md section 4).
#
# The pressure is proportional to the overlap of the two circles, kappa E* (e cos phi - c) / (R sin psi): the
# depth of the foundation grows with the contact (Johnson, Contact Mechanics, 1985, section 4.3), and
# kappa = 3 pi / 8 is his 1.18, at which a narrow contact has Hertz's line load at Hertz's width. The integral
# over the arc cos psi = c / (c + delta), of axial width w, is
#
#     F = kappa E* w c (2 psi / sin 2 psi - 1),   E* = 1 / (sigma_b + sigma_j),  sigma = (1 - nu^2) / E.
#
# F is below the exact load of a pin in a plate of the same material (Persson 1964, in the form of Ciavarella
# and Decuzzi 2001) by 0.2 % at a half angle of 10 degrees, 2 % at 30, 5 % at 45, 11 % at 60 and 28 % at 75:
# valid up to 60 degrees, where delta = c. The penetration is the overlap of the circles; in plane elasticity
# it would depend logarithmically on the size of the bodies.


_KAPPA = 3.0 * math.pi / 8.0
_E_STAR = 0.75  # E* over the contact modulus 4 / (3 (sigma_b + sigma_j))

_NARROW = 0.02  # tan^2 psi up to which eight series terms are exact to rounding
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
def _winkler_coefficient(given, modulus, width, bushing, journal):
    """Coefficient kappa E* w [N/m], independent of the radii."""
    return _KAPPA * _E_STAR * modulus * width


@kernel
def _winkler_force(coefficient, clearance, loss, delta, delta_dot):
    """Same as `Form.force`."""
    if delta <= 0.0:
        return 0.0, 0.0, 0.0, 0.0
    x = delta / clearance
    carried = load(x)
    exponent = x * load_slope(x) / carried
    return with_hysteresis(coefficient * clearance * carried, exponent, loss, delta, delta_dot)


@kernel
def _winkler_energy(coefficient, clearance, delta):
    """Energy stored in the contact [J]."""
    return coefficient * clearance * clearance * load_integral(max(delta, 0.0) / clearance)


@kernel
def _winkler_softening(given, delta, bushing, journal, slope_b, slope_j):
    """Same as `Form.softening`: both depths widen the clearance; the coefficient does not depend on it."""
    x = delta / (bushing - journal)
    softer = x - 2.0 * load_integral(x) / load(x)
    return softer * slope_b, softer * slope_j


WINKLER = Form(
    _winkler_coefficient, _winkler_force, _winkler_energy, _winkler_softening, takes_stiffness=False
)


# The normal contact laws by name, and kernels that select a joint's law (physics.md section 4).
#
# To add a law of a different form, add its `Form` above, an entry to `LAWS`, and its name to
# `NORMAL_LAWS` of `mechanism`, where mechanism files and the command line check it without importing numba.


class NormalLaw(NamedTuple):
    """A form of the force, and its hysteresis factor chi as a function of the coefficient of restitution."""

    form: Form
    hysteresis: Callable[[float], float]

    @property
    def number(self) -> int:
        """Number of the form in compiled code."""
        return _FORMS.index(self.form)


LAWS: dict[str, NormalLaw] = {
    "hertz": NormalLaw(HERTZ, no_loss),
    "hunt-crossley": NormalLaw(HERTZ, hunt_crossley),
    "lankarani-nikravesh": NormalLaw(HERTZ, lankarani_nikravesh),
    "gonthier": NormalLaw(HERTZ, gonthier),
    "flores": NormalLaw(HERTZ, flores),
    "hu-guo": NormalLaw(HERTZ, hu_guo),
    "winkler": NormalLaw(WINKLER, hu_guo),
}

_FORMS = tuple(dict.fromkeys(law.form for law in LAWS.values()))


law_coefficient = by_number(form.coefficient for form in _FORMS)
normal_force = by_number(form.force for form in _FORMS)
elastic_energy = by_number(form.energy for form in _FORMS)
softening = by_number(form.softening for form in _FORMS)

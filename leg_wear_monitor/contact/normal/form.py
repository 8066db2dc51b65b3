"""Interface of a normal contact law to the equations of motion (physics.md section 4)."""

from collections.abc import Callable
from typing import Any, NamedTuple


class Form(NamedTuple):
    """Kernels of one form of the normal force; both formulations call them through `laws`.

    A law's ``coefficient`` and the local clearance c = R_b - R_j [m] follow from the local radii. Force and
    energy depend on these two and on the penetration delta [m], the force also on its rate [m/s].

    Attributes
    ----------
    coefficient : kernel (given, modulus, width, bushing, journal)
        The law's coefficient, in a unit that depends on the form. ``given`` [N/m^1.5] is the joint's
        ``stiffness`` or 0, ``modulus`` [Pa] that of `contact_modulus`; width and local radii [m].
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
        Whether a joint's ``stiffness`` [N/m^1.5] may replace the coefficient from modulus and radii.
    """

    coefficient: Callable[..., Any]
    force: Callable[..., Any]
    energy: Callable[..., Any]
    softening: Callable[..., Any]
    takes_stiffness: bool

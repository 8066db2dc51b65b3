"""What a normal contact law has to give: the seam between laws and motion (physics.md section 4)."""

from collections.abc import Callable
from typing import Any, NamedTuple


class Form(NamedTuple):
    """Kernels of one form of the normal force; both formulations call them through `laws`.

    The local radii give a law its ``coefficient`` and the local clearance c = R_b - R_j [m]. Force and energy
    depend on these two and on the penetration delta [m], the force on its rate as well.

    Attributes
    ----------
    coefficient : kernel (given, modulus, width, bushing, journal)
        The law's coefficient, in a unit of its own. ``given`` [N/m^1.5] is the joint's ``stiffness`` or 0,
        ``modulus`` [Pa] that of `contact_modulus`; width and local radii [m].
    force : kernel (coefficient, clearance, loss, delta, delta_dot)
        Normal force f_n [N], never negative, its derivatives by delta [N/m] and by delta_dot [N s/m], and its
        elastic part [N]; all 0 where delta <= 0. ``loss`` [s/m] is the hysteresis factor over the approach
        speed.
    energy : kernel (coefficient, clearance, delta)
        Energy stored [J], the integral of the elastic part.
    softening : kernel (given, delta, bushing, journal, slope_b, slope_j)
        What depths of wear that change by a slope [m/rad] take from the energy at the same delta, for bushing
        and journal, over the elastic part [m/rad].
    takes_stiffness : bool
        Whether a joint's ``stiffness`` [N/m^1.5] may stand for what follows from modulus and radii.
    """

    coefficient: Callable[..., Any]
    force: Callable[..., Any]
    energy: Callable[..., Any]
    softening: Callable[..., Any]
    takes_stiffness: bool

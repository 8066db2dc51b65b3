"""Geometry of the contact of journal and bushing, modulus, width of the arc (physics.md sections 3 to 5)."""

import math
from collections.abc import Iterator

import numpy as np

from leg_wear_monitor.compiled.kernel import kernel
from leg_wear_monitor.compiled.vectors import LEAST_DIVISOR, largest, root, where
from leg_wear_monitor.configuration import Doubt
from leg_wear_monitor.contact.laws import LAWS
from leg_wear_monitor.mechanism.position import Linkage, one_cycle
from leg_wear_monitor.mechanism.spec import Clearance, TorqueDrive

# Bound of the gradient across the eccentricity due to the bend (`worn_contact`), compared with the wall's
# unit normal, which has length 1.
_SHARPEST = 1.0


@kernel
def journal_contact(ex, ey, clearance):
    """Penetration [m], negative when apart, and unit normal of a journal at eccentricity (ex, ey) [m].

    The arguments are numbers or vectors. physics.md section 3.
    """
    e = root(ex * ex + ey * ey)
    inverse, away = 1.0 / largest(e, LEAST_DIVISOR), e > 0.0
    return e - clearance, where(away, ex * inverse, 1.0), where(away, ey * inverse, 0.0)


@kernel
def worn_contact(ex, ey, clearance, slope, bend):
    """Penetration [m] and its gradient on worn surfaces; the clearance depends on the direction.

    ``slope`` [m/rad] and ``bend`` [m/rad^2] are the first and second derivative of the clearance by the
    direction. The penetration is |e| - c along the worn wall's normal. The normal force acts along the whole
    gradient of the penetration, so that it has a potential (physics.md section 3): the gradient is the wall's
    unit normal plus parts of the order of penetration / clearance, because the normal changes along the wall.
    The part by the bend is bounded: in notches too narrow for the journal it would be many times the normal,
    and there the force has no potential. For numbers or vectors.

    Returns
    -------
    delta, nx, ny, scale, by_slope
        Penetration [m], its gradient (nx, ny) by the eccentricity, and the factors of the clearance's change
        [-] and of its slope's change [rad] in the change of the penetration.
    """
    delta, rx, ry = journal_contact(ex, ey, clearance)
    inside = largest(delta, 0.0)
    inverse = 1.0 / largest(clearance + inside, LEAST_DIVISOR)  # in contact, 1 / |e|
    tilt = slope * inverse
    square = 1.0 / (1.0 + tilt * tilt)
    scale = root(square)
    by_slope = inside * square * scale * tilt * inverse
    by_slope = by_slope * (_SHARPEST / largest(abs(by_slope * bend * inverse), _SHARPEST))
    outwards, back = scale + by_slope * tilt, scale * tilt + by_slope * bend * inverse
    return delta * scale, outwards * rx + back * ry, outwards * ry - back * rx, scale, by_slope


def contact_modulus(youngs_b: float, poisson_b: float, youngs_j: float, poisson_j: float) -> float:
    """4 / (3 (sigma_b + sigma_j)) [Pa], sigma = (1 - nu^2) / E; Lankarani and Nikravesh 1990."""
    sigma = (1.0 - poisson_b * poisson_b) / youngs_b + (1.0 - poisson_j * poisson_j) / youngs_j
    return 4.0 / (3.0 * sigma)


# Conformity: whether a contact is narrow, as Hertz's force supposes (physics.md section 4).
#
# The half angle psi of the contact arc follows from the elastic foundation (`laws.WINKLER`), which becomes
# Hertz's line contact for a narrow arc: F = kappa E* w c (2 psi / sin 2 psi - 1). It grows with force and
# softness, and as the clearance falls: plastic bushings and tight bushings are conformal.


NARROW_RAD = math.radians(30.0)
"""Largest half angle of a narrow contact: the load of Hertz's line is 14 % low there."""
WIDEST_RAD = math.radians(60.0)
"""Largest half angle of Winkler's law: its force is 11 % low there."""

_KAPPA_E_STAR = 0.75 * 3.0 * math.pi / 8.0  # kappa E* over the contact modulus
_HALVINGS = 60  # bisections of a right angle, down to rounding errors
_POINTS = 180  # points of a gait cycle


def half_angle_under_load(force_n: float, modulus_pa: float, width_m: float, clearance_m: float) -> float:
    """Half angle psi [rad] of the contact arc under a force.

    Parameters
    ----------
    force_n : float
    modulus_pa : float
        Value of `contact_modulus`.
    width_m, clearance_m : float
        Axial contact width, and radial clearance.
    """
    # bisection: the load grows with psi
    load = force_n / (_KAPPA_E_STAR * modulus_pa * width_m * clearance_m)
    low, high = 0.0, 0.5 * math.pi
    for _ in range(_HALVINGS):
        psi = 0.5 * (low + high)
        if 2.0 * psi > (1.0 + load) * math.sin(2.0 * psi):
            high = psi
        else:
            low = psi
    return 0.5 * (low + high)


def contact_doubt(half_angle_rad: float, force_n: float, radius_m: float, is_winkler: bool) -> str | None:
    """Why a joint's normal law is not valid at a force, as one text; None if it is.

    Parameters
    ----------
    half_angle_rad, force_n : float
        Half angle of the contact arc under this force.
    radius_m : float
        Radius of the bushing.
    is_winkler : bool
        True if the law is Winkler's.
    """
    if half_angle_rad <= (WIDEST_RAD if is_winkler else NARROW_RAD):
        return None
    wide = 2.0e3 * radius_m * math.sin(half_angle_rad)
    arc = (
        f"contact half angle {math.degrees(half_angle_rad):.0f} deg at {float(f'{force_n:.3g}'):g} N "
        f"({wide:.3g} mm wide in a radius of {1.0e3 * radius_m:.4g} mm)"
    )
    if is_winkler:
        return f"{arc}. normal_law winkler is valid up to {math.degrees(WIDEST_RAD):.0f} deg"
    return (
        f"{arc}. The force K delta^1.5 of this law is for a narrow contact, up to about "
        f"{math.degrees(NARROW_RAD):.0f} deg; normal_law winkler is for a conformal one"
    )


def conformity_doubts(linkage: Linkage) -> Iterator[Doubt]:
    """Clearance joints with a law that is not valid at the ideal motion's 99th percentile of the force."""
    mechanism, drive = linkage.mechanism, linkage.mechanism.drive
    if not mechanism.clearance_joints or isinstance(drive, TorqueDrive):
        return
    force = np.linalg.norm(one_cycle(linkage, _POINTS, drive.speed).joint_force, axis=2)
    p99 = dict(zip(mechanism.joints, np.quantile(force, 0.99, axis=0).tolist(), strict=True))
    for joint in mechanism.clearance_joints:
        if fault := doubt_under_load(mechanism.clearances[joint], p99[joint]):
            yield Doubt(f"clearances ({joint}): normal_law", fault)


def doubt_under_load(settings: Clearance, force_n: float) -> str | None:
    """Why the normal law of a joint with these settings is not valid at a force; None if it is."""
    psi = half_angle_of(settings, force_n)
    return contact_doubt(psi, force_n, settings.bushing_radius, settings.normal_law == "winkler")


def half_angle_of(settings: Clearance, force_n: float) -> float:
    """Half angle [rad] of the contact arc of a joint with these settings under a force."""
    (e_b, e_j), (nu_b, nu_j) = settings.youngs_modulus, settings.poissons_ratio
    modulus = contact_modulus(e_b, nu_b, e_j, nu_j)
    return half_angle_under_load(force_n, modulus, settings.width, settings.radial_clearance)


def is_winkler_form(number: int) -> bool:
    """True if a form's number in compiled code is the number of Winkler's law."""
    return number == LAWS["winkler"].number

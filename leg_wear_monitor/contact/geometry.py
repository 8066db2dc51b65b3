"""Where a journal touches its bushing, and the modulus of that contact (physics.md sections 3 to 5)."""

import math

from leg_wear_monitor.kernel import kernel

_SHARPEST = 1.0  # largest part of the gradient across e that the bend makes, where the wall's normal is 1


@kernel
def journal_contact(ex, ey, clearance):
    """Penetration [m] and unit normal of a journal at eccentricity (ex, ey) [m]; negative when apart.

    physics.md section 3.
    """
    e = math.sqrt(ex * ex + ey * ey)
    if e == 0.0:
        return -clearance, 1.0, 0.0
    inverse = 1.0 / e
    return e - clearance, ex * inverse, ey * inverse


@kernel
def worn_contact(ex, ey, clearance, slope, bend):
    """Penetration [m] and its gradient where the clearance changes with direction.

    By a slope [m/rad], that changes by a ``bend`` [m/rad^2]. The penetration is |e| - c, measured along the
    worn wall's normal. So that the normal force has a potential, it acts along the penetration's whole
    gradient (physics.md section 3): the wall's unit normal, but for parts of the order of penetration /
    clearance, because the normal turns from place to place. The part that turns it aside is bounded: in
    notches narrower than a journal can enter it would be many times the normal, and there is no potential.

    Returns
    -------
    delta, nx, ny, scale, turned
        The clearance's own share in the gradient is ``scale`` times its change, and ``turned`` times that of
        its slope.
    """
    delta, rx, ry = journal_contact(ex, ey, clearance)
    inside = max(delta, 0.0)
    inverse = 1.0 / (clearance + inside)  # a journal that touches is at least that far out
    tilt = slope * inverse
    square = 1.0 / (1.0 + tilt * tilt)
    scale = math.sqrt(square)
    turned = inside * square * scale * tilt * inverse
    bent = abs(turned * bend * inverse)
    if bent > _SHARPEST:
        turned *= _SHARPEST / bent
    outwards, back = scale + turned * tilt, scale * tilt + turned * bend * inverse
    return delta * scale, outwards * rx + back * ry, outwards * ry - back * rx, scale, turned


@kernel
def contact_half_angle(eccentricity, bushing_radius, journal_radius):
    """Half angle of the arc [rad] in which two circles with centres this far apart overlap.

    The circles cross where cos psi = (R_b^2 + e^2 - R_j^2) / (2 R_b e); 0 when they do not.
    physics.md section 5.
    """
    if eccentricity <= bushing_radius - journal_radius:
        return 0.0
    cosine = (bushing_radius**2 + eccentricity**2 - journal_radius**2) / (2.0 * bushing_radius * eccentricity)
    return math.acos(max(-1.0, min(1.0, cosine)))


def contact_modulus(youngs_b: float, poisson_b: float, youngs_j: float, poisson_j: float) -> float:
    """4 / (3 (sigma_b + sigma_j)) [Pa] with sigma = (1 - nu^2) / E; Lankarani and Nikravesh 1990."""
    sigma = (1.0 - poisson_b * poisson_b) / youngs_b + (1.0 - poisson_j * poisson_j) / youngs_j
    return 4.0 / (3.0 * sigma)

"""Where a journal touches its bushing, and how stiff that contact is (physics.md sections 3 to 5)."""

import math

from leg_wear_monitor.kernel import kernel


@kernel
def journal_contact(ex, ey, clearance):
    """Penetration [m] and unit normal of a journal at eccentricity (ex, ey) [m]; negative when apart."""
    e = math.sqrt(ex * ex + ey * ey)
    if e == 0.0:
        return -clearance, 1.0, 0.0
    return e - clearance, ex / e, ey / e


@kernel
def worn_contact(ex, ey, clearance, slope):
    """Penetration [m] and unit normal where the clearance changes with direction by a slope [m/rad].

    The normal is that of the worn wall, the gradient of |e| - c, and the penetration is measured along it:
    so the normal force has a potential.
    """
    delta, rx, ry = journal_contact(ex, ey, clearance)
    tilt = slope / (clearance + max(delta, 0.0))  # a journal that touches is at least that far out
    scale = 1.0 / math.sqrt(1.0 + tilt * tilt)
    return delta * scale, (rx + tilt * ry) * scale, (ry - tilt * rx) * scale, scale


@kernel
def contact_half_angle(eccentricity, bushing_radius, journal_radius):
    """Half angle of the arc [rad] in which two circles with centres this far apart overlap.

    The circles cross where cos psi = (R_b^2 + e^2 - R_j^2) / (2 R_b e); 0 when they do not.
    """
    if eccentricity <= bushing_radius - journal_radius:
        return 0.0
    cosine = (bushing_radius**2 + eccentricity**2 - journal_radius**2) / (2.0 * bushing_radius * eccentricity)
    return math.acos(max(-1.0, min(1.0, cosine)))


def contact_modulus(youngs_b: float, poisson_b: float, youngs_j: float, poisson_j: float) -> float:
    """4 / (3 (sigma_b + sigma_j)) [Pa] with sigma = (1 - nu^2) / E; Lankarani and Nikravesh 1990."""
    sigma = (1.0 - poisson_b * poisson_b) / youngs_b + (1.0 - poisson_j * poisson_j) / youngs_j
    return 4.0 / (3.0 * sigma)


@kernel
def contact_stiffness(modulus, bushing_radius, journal_radius):
    """Hertz stiffness K [N/m^1.5] of a pin inside a bushing: modulus sqrt(R_b R_j / (R_b - R_j))."""
    return modulus * math.sqrt(bushing_radius * journal_radius / (bushing_radius - journal_radius))

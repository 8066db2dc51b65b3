"""Geometry of the contact of journal and bushing, and its elastic modulus (physics.md sections 3 to 5)."""

from leg_wear_monitor.compiled.kernel import kernel
from leg_wear_monitor.compiled.vectors import LEAST_DIVISOR, largest, root, where

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

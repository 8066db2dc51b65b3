"""Hysteresis damping: F = F_elastic (1 + chi delta_dot / approach_speed) (physics.md section 4).

The factors chi by the nominal coefficient of restitution, and the restitution that results for any F_elastic.
"""

import math

from leg_wear_monitor.kernel import kernel
from leg_wear_monitor.vectors import LEAST_DIVISOR, largest, where


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

    For numbers or vectors; ``exponent`` [-] is that of the elastic part at delta [m], d ln F / d ln delta;
    ``loss`` [s/m] is chi over the approach speed.

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

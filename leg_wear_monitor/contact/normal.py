"""Normal contact laws F = K delta^1.5 (1 + chi delta_dot / approach_speed) (physics.md section 4).

The laws differ in how the hysteresis factor chi follows from the coefficient of restitution asked for.
"""

import math
from collections.abc import Callable

from leg_wear_monitor.kernel import kernel


def hertz(restitution: float) -> float:
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


HYSTERESIS: dict[str, Callable[[float], float]] = {
    "hertz": hertz,
    "hunt-crossley": hunt_crossley,
    "lankarani-nikravesh": lankarani_nikravesh,
    "gonthier": gonthier,
    "flores": flores,
    "hu-guo": hu_guo,
}


@kernel
def elastic_force(stiffness, delta):
    """Hertz's part of the force, K delta^1.5 [N]; 0 when apart."""
    return stiffness * delta * math.sqrt(delta) if delta > 0.0 else 0.0


@kernel
def damped_force(elastic, loss, delta_dot):
    """Force [N] that pushes apart, never negative: elastic part [N], loss chi / approach speed [s/m]."""
    return max(0.0, elastic * (1.0 + loss * delta_dot))


@kernel
def normal_force(stiffness, hysteresis, delta, delta_dot, approach_speed):
    """Force [N] that pushes the surfaces apart, never negative.

    stiffness [N/m^1.5], hysteresis chi [-], delta [m], delta_dot and approach_speed [m/s].
    """
    return damped_force(elastic_force(stiffness, delta), hysteresis / approach_speed, delta_dot)


@kernel
def elastic_energy(stiffness, delta):
    """Energy stored in the contact, 2/5 K delta^2.5 [J]."""
    return 0.4 * elastic_force(stiffness, delta) * max(delta, 0.0)


def delivered_restitution(hysteresis: float) -> float:
    """What a law returns for its factor chi, whatever K, mass and speed.

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

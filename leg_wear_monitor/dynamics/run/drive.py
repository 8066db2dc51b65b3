"""The crank's motion as a polynomial in time, for a steady drive, a ripple or a tracked crank."""

from typing import NamedTuple

import numpy as np

from leg_wear_monitor.kernel import kernel
from leg_wear_monitor.mechanism.arrays import Floats

DEGREE = 5


class CrankMotion(NamedTuple):
    """Angle [rad], speed [rad/s] and acceleration [rad/s^2] of the crank."""

    angle: float
    speed: float
    acceleration: float


def steady_drive(angle: float, speed: float, since: float = 0.0) -> Floats:
    """Polynomial of a crank with constant speed.

    Parameters
    ----------
    angle, speed : float
        Crank angle [rad] and speed [rad/s] at time ``since`` [s].

    Returns
    -------
    (7,) array
        Reference time [s], then six coefficients [rad/s^i] by ascending power.
    """
    return np.array([since, angle, speed, 0.0, 0.0, 0.0, 0.0])


def quintic(since: float, start: CrankMotion, span: float, end: CrankMotion) -> Floats:
    """Drive polynomial (7,) through two states of the crank, ``span`` seconds apart.

    Consecutive polynomials join with continuous acceleration.
    """
    a0, v0, w0 = start.angle, start.speed, start.acceleration
    gap = end.angle - a0 - span * (v0 + 0.5 * span * w0)
    slope = (end.speed - v0 - span * w0) * span
    bend = (end.acceleration - w0) * span * span
    cubic = 10.0 * gap - 4.0 * slope + 0.5 * bend
    quartic = -15.0 * gap + 7.0 * slope - bend
    fifth = 6.0 * gap - 3.0 * slope + 0.5 * bend
    return np.array([since, a0, v0, 0.5 * w0, cubic / span**3, quartic / span**4, fifth / span**5])


@kernel
def drive_at(polynomial, t, out_drive):
    """Angle [rad], speed [rad/s] and acceleration [rad/s^2] (3,) of the crank at time t [s]."""
    tau = t - polynomial[0]
    angle, speed, acceleration = 0.0, 0.0, 0.0
    for i in range(DEGREE, -1, -1):
        acceleration = acceleration * tau + 2.0 * speed
        speed = speed * tau + angle
        angle = angle * tau + polynomial[1 + i]
    out_drive[0], out_drive[1], out_drive[2] = angle, speed, acceleration

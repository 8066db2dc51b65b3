"""The crank's motion as a polynomial in time, for a steady drive, a ripple or a tracked crank."""

import numpy as np

from leg_wear_monitor.kernel import kernel
from leg_wear_monitor.mechanism.arrays import Floats

DEGREE = 5


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

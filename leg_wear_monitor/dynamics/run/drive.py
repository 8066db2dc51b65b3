"""The crank's motion as a polynomial in time: what a steady drive, a ripple or a tracker hands over."""

import numpy as np

from leg_wear_monitor.kernel import kernel
from leg_wear_monitor.mechanism.arrays import Floats

DEGREE = 5


def steady_drive(angle: float, speed: float, since: float = 0.0) -> Floats:
    """Polynomial (7,) of a crank that turns at a constant speed: reference time, then six coefficients.

    Parameters
    ----------
    angle, speed : float
        At time ``since`` [rad, rad/s].
    """
    return np.array([since, angle, speed, 0.0, 0.0, 0.0, 0.0])


@kernel
def drive_at(polynomial, t, out_drive):
    """Angle [rad], speed [rad/s] and acceleration [rad/s^2] of the crank at time t."""
    tau = t - polynomial[0]
    angle, speed, acceleration = 0.0, 0.0, 0.0
    for i in range(DEGREE, -1, -1):
        acceleration = acceleration * tau + 2.0 * speed
        speed = speed * tau + angle
        angle = angle * tau + polynomial[1 + i]
    out_drive[0], out_drive[1], out_drive[2] = angle, speed, acceleration

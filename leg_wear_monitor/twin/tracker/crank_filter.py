"""Where the crank is, by samples before (Kalman) and after (modified Bryson-Frazier smoother).

The crank's angle, speed and acceleration change by a jerk that is white noise. With the sensor's noise spread
over the time between samples, the filter's bandwidth is (jerk / noise)^(1/6) rad/s at any rate. The smoother
is that of Bierman (1973, *Fixed interval smoothing with discrete measurements*): an adjoint vector runs back
over the samples after, and needs no inverse.
"""

import math

from leg_wear_monitor.kernel import kernel
from leg_wear_monitor.twin.tracker.state import (
    ANGLE_NOISE,
    BY_ANGLE,
    BY_VELOCITY,
    COMMANDED,
    GATE,
    JERK,
    LONGEST,
    STEP,
    VELOCITY_GATE,
    VELOCITY_NOISE,
    P,
    X,
)

_TURN = 2.0 * math.pi
_WIDEST_GATE = 2.5  # rad: further off, an angle might as well be the other way round
_SIGMAS = 5.0


@kernel
def begin_filter(real, angle, out_filtered):
    """First sample: its angle in [0, 2 pi), the commanded speed as a first guess."""
    speed = real[COMMANDED]
    for i in range(9):
        out_filtered[i] = 0.0
    out_filtered[0], out_filtered[1] = angle - _TURN * math.floor(angle / _TURN), speed
    out_filtered[3] = real[ANGLE_NOISE] / real[LONGEST]
    out_filtered[6], out_filtered[8] = speed**2, (speed / real[LONGEST]) ** 2


@kernel
def predict(real, h, filtered):
    """The filter's state and covariance a time h [s] later."""
    x, v, a = filtered[0], filtered[1], filtered[2]
    filtered[0], filtered[1] = x + h * (v + 0.5 * h * a), v + h * a
    p00, p01, p02, p11, p12, p22 = (
        filtered[3],
        filtered[4],
        filtered[5],
        filtered[6],
        filtered[7],
        filtered[8],
    )
    q, g = real[JERK] * h, 0.5 * h * h
    # rows of F P, F = [1 h g; 0 1 h; 0 0 1]
    a00, a01, a02 = p00 + h * p01 + g * p02, p01 + h * p11 + g * p12, p02 + h * p12 + g * p22
    a11, a12 = p11 + h * p12, p12 + h * p22
    filtered[3] = a00 + h * a01 + g * a02 + q * h**4 / 20.0
    filtered[4] = a01 + h * a02 + q * h**3 / 8.0
    filtered[5] = a02 + q * h**2 / 6.0
    filtered[6] = a11 + h * a12 + q * h**2 / 3.0
    filtered[7] = a12 + 0.5 * q * h
    filtered[8] = p22 + q


@kernel
def _correct(i, variance, innovation, filtered, row, at):
    """Take in a measurement of state i; what the smoother needs of it goes to ``row`` from ``at`` on."""
    b0 = filtered[3 + i]  # column i of P, i < 2
    b1 = filtered[4] if i == 0 else filtered[6]
    b2 = filtered[5] if i == 0 else filtered[7]
    s = (b0 if i == 0 else b1) + variance
    k0, k1, k2 = b0 / s, b1 / s, b2 / s
    filtered[0] += k0 * innovation
    filtered[1] += k1 * innovation
    filtered[2] += k2 * innovation
    filtered[3] -= k0 * b0
    filtered[4] -= k0 * b1
    filtered[5] -= k0 * b2
    filtered[6] -= k1 * b1
    filtered[7] -= k1 * b2
    filtered[8] -= k2 * b2
    row[at], row[at + 1], row[at + 2], row[at + 3], row[at + 4] = s, innovation, k0, k1, k2


@kernel
def update(real, h, step, angle, velocity, trusted, filtered, row):
    """Take in a crank sample; fills its row of the queue.

    It is h [s] after the filter's time and ``step`` [s] after the last sample used. Its velocity is used
    where it is ``trusted``.

    Returns
    -------
    used, verdict
        Whether the sample passed its gate (the filter is that of the prediction otherwise); 1 for a velocity
        that agrees with the angles, -1 for one that does not, 0 for none.
    """
    predict(real, h, filtered)
    row[STEP] = step
    for i in range(3):
        row[X + i] = filtered[i]
    for i in range(6):
        row[P + i] = filtered[3 + i]
    row[BY_ANGLE], row[BY_VELOCITY] = 0.0, 0.0
    innovation = angle - filtered[0]
    innovation -= _TURN * math.floor(innovation / _TURN + 0.5)
    if not abs(innovation) < min(_WIDEST_GATE, real[GATE] + _SIGMAS * math.sqrt(filtered[3])):
        return False, 0
    spread = min(max(step, 1.0e-6), real[LONGEST])
    _correct(0, real[ANGLE_NOISE] / spread, innovation, filtered, row, BY_ANGLE)
    if not math.isfinite(velocity):
        return True, 0
    innovation = velocity - filtered[1]
    if not abs(innovation) < real[VELOCITY_GATE] + _SIGMAS * math.sqrt(filtered[6]):
        return True, -1
    if trusted:
        _correct(1, real[VELOCITY_NOISE] / spread, innovation, filtered, row, BY_VELOCITY)
    return True, 1


@kernel
def _adjoin(i, row, at, l0, l1, l2):
    """The adjoint vector before a measurement of state i, from that after it."""
    s, innovation = row[at], row[at + 1]
    if s > 0.0:
        along = row[at + 2] * l0 + row[at + 3] * l1 + row[at + 4] * l2 + innovation / s
        if i == 0:
            l0 -= along
        else:
            l1 -= along
    return l0, l1, l2


@kernel
def smooth(queue_kind, queue, spline_node, tail, out_target):
    """Angle, speed and acceleration at index ``spline_node`` of the queue, by all samples up to ``tail``."""
    l0, l1, l2 = 0.0, 0.0, 0.0
    for j in range(tail - 1, spline_node - 1, -1):
        if queue_kind[j] != 0:
            continue
        row = queue[j]
        l0, l1, l2 = _adjoin(1, row, BY_VELOCITY, l0, l1, l2)
        l0, l1, l2 = _adjoin(0, row, BY_ANGLE, l0, l1, l2)
        if j > spline_node:
            h = row[STEP]
            l2 += h * (l1 + 0.5 * h * l0)
            l1 += h * l0
    row = queue[spline_node]
    out_target[0] = row[X] - (row[P] * l0 + row[P + 1] * l1 + row[P + 2] * l2)
    out_target[1] = row[X + 1] - (row[P + 1] * l0 + row[P + 3] * l1 + row[P + 4] * l2)
    out_target[2] = row[X + 2] - (row[P + 2] * l0 + row[P + 4] * l1 + row[P + 5] * l2)

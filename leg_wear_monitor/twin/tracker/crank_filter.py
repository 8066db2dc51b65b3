"""Kalman filter and modified Bryson-Frazier smoother of the crank's motion (physics.md section 9).

The crank's angle, speed and acceleration are driven by a jerk that is white noise. With the sensor's noise
spread over the time between samples, the filter's bandwidth is (jerk / noise)^(1/6) rad/s at any rate. The
smoother is that of Bierman (1973, *Fixed interval smoothing with discrete measurements*): an adjoint vector
is propagated back over the later samples, without a matrix inverse.
"""

import math

from leg_wear_monitor.kernel import kernel
from leg_wear_monitor.twin.kinds import CRANK

_TURN = 2.0 * math.pi
_WIDEST_GATE = 2.5  # rad: above it, an innovation's direction is ambiguous (near half a turn)
_SIGMAS = 5.0  # standard deviations of the prediction that are added to a gate


@kernel
def begin_filter(model, angle, out_estimate):
    """Initialise the estimate by a first angle [rad], reduced to [0, 2 pi), and the commanded speed."""
    e, speed = out_estimate, model.commanded_speed
    e.angle, e.speed, e.acceleration = angle - _TURN * math.floor(angle / _TURN), speed, 0.0
    e.p00, e.p01, e.p02 = model.angle_noise / model.longest_spread, 0.0, 0.0
    e.p11, e.p12, e.p22 = speed**2, 0.0, (speed / model.longest_spread) ** 2


@kernel
def predict(model, h, estimate):
    """Propagate the filter's state and covariance by a time h [s], in place."""
    e, x, v, a = estimate, estimate.angle, estimate.speed, estimate.acceleration
    e.angle, e.speed = x + h * (v + 0.5 * h * a), v + h * a
    p00, p01, p02, p11, p12, p22 = e.p00, e.p01, e.p02, e.p11, e.p12, e.p22
    q, g = model.jerk * h, 0.5 * h * h
    # rows of F P, F = [1 h g; 0 1 h; 0 0 1]
    a00, a01, a02 = p00 + h * p01 + g * p02, p01 + h * p11 + g * p12, p02 + h * p12 + g * p22
    a11, a12 = p11 + h * p12, p12 + h * p22
    e.p00 = a00 + h * a01 + g * a02 + q * h**4 / 20.0
    e.p01 = a01 + h * a02 + q * h**3 / 8.0
    e.p02 = a02 + q * h**2 / 6.0
    e.p11 = a11 + h * a12 + q * h**2 / 3.0
    e.p12 = a12 + 0.5 * q * h
    e.p22 = p22 + q


@kernel
def note_prediction(estimate, step, out_row):
    """Begin the queue's row of a crank sample ``step`` [s] after the last one: the predicted state."""
    e, row = estimate, out_row
    row.step, row.bridged = step, 0
    row.angle, row.speed, row.acceleration = e.angle, e.speed, e.acceleration
    row.p00, row.p01, row.p02, row.p11, row.p12, row.p22 = e.p00, e.p01, e.p02, e.p11, e.p12, e.p22
    row.innovation_variance[0], row.innovation_variance[1] = 0.0, 0.0


@kernel
def _correct(i, variance, innovation, estimate, row):
    """Correct by a measurement of state i (0 angle, 1 speed); store the smoother's data in the row."""
    e = estimate
    b0 = e.p00 if i == 0 else e.p01  # column i of P
    b1 = e.p01 if i == 0 else e.p11
    b2 = e.p02 if i == 0 else e.p12
    s = (b0 if i == 0 else b1) + variance
    k0, k1, k2 = b0 / s, b1 / s, b2 / s
    e.angle += k0 * innovation
    e.speed += k1 * innovation
    e.acceleration += k2 * innovation
    e.p00 -= k0 * b0
    e.p01 -= k0 * b1
    e.p02 -= k0 * b2
    e.p11 -= k1 * b1
    e.p12 -= k1 * b2
    e.p22 -= k2 * b2
    row.innovation_variance[i], row.innovation[i] = s, innovation
    row.gain[i, 0], row.gain[i, 1], row.gain[i, 2] = k0, k1, k2


@kernel
def update(model, h, step, angle, velocity, trusted, estimate, row):
    """Filter a crank sample (angle [rad], velocity [rad/s]) and fill its row of the queue.

    It is h [s] after the filter's time and ``step`` [s] after the last used sample. Its velocity is used if
    ``trusted``.

    Returns
    -------
    used, verdict
        Whether the sample passed its gate (otherwise the filter contains the prediction); 1 for a velocity
        that agrees with the angles, -1 for one that does not, 0 without velocity.
    """
    predict(model, h, estimate)
    note_prediction(estimate, step, row)
    innovation = angle - estimate.angle
    innovation -= _TURN * math.floor(innovation / _TURN + 0.5)
    if not abs(innovation) < min(_WIDEST_GATE, model.gate + _SIGMAS * math.sqrt(estimate.p00)):
        return False, 0
    spread = min(max(step, 1.0e-6), model.longest_spread)
    _correct(0, model.angle_noise / spread, innovation, estimate, row)
    if not math.isfinite(velocity):
        return True, 0
    innovation = velocity - estimate.speed
    if not abs(innovation) < model.velocity_gate + _SIGMAS * math.sqrt(estimate.p11):
        return True, -1
    if trusted:
        _correct(1, model.velocity_noise / spread, innovation, estimate, row)
    return True, 1


@kernel
def _adjoin(i, row, l0, l1, l2):
    """Adjoint vector (l0, l1, l2) before a measurement of state i, from that after it."""
    s, gain = row.innovation_variance[i], row.gain
    if s > 0.0:
        along = gain[i, 0] * l0 + gain[i, 1] * l1 + gain[i, 2] * l2 + row.innovation[i] / s
        if i == 0:
            l0 -= along
        else:
            l1 -= along
    return l0, l1, l2


@kernel
def smooth(queue, spline_node, tail, out_node):
    """Smoothed crank motion at index ``spline_node`` of the queue, from all samples before index ``tail``."""
    l0, l1, l2 = 0.0, 0.0, 0.0
    for j in range(tail - 1, spline_node - 1, -1):
        row = queue[j]
        if row.kind != CRANK:
            continue
        l0, l1, l2 = _adjoin(1, row, l0, l1, l2)
        l0, l1, l2 = _adjoin(0, row, l0, l1, l2)
        if j > spline_node:
            h = row.step
            l2 += h * (l1 + 0.5 * h * l0)
            l1 += h * l0
    row = queue[spline_node]
    out_node.angle = row.angle - (row.p00 * l0 + row.p01 * l1 + row.p02 * l2)
    out_node.speed = row.speed - (row.p01 * l0 + row.p11 * l1 + row.p12 * l2)
    out_node.acceleration = row.acceleration - (row.p02 * l0 + row.p12 * l1 + row.p22 * l2)

"""Measured against predicted drive torque, through one low-pass, and what may explain their difference."""

import math

from leg_wear_monitor.dynamics.clearance.model import ANGLE, SPEED, blend
from leg_wear_monitor.kernel import kernel
from leg_wear_monitor.twin.follower.compare_instants import take_instant
from leg_wear_monitor.twin.follower.low_pass import pass_low
from leg_wear_monitor.twin.follower.state import (
    FILTERING,
    LAST_PREDICTED,
    LAST_SIGNATURE,
    MEASURED,
    MEASURED_2,
    NUMBER,
    OF_FRICTION,
    OF_LOAD,
    PERIOD,
    PREDICTED,
    PREDICTED_2,
    RESIDUAL,
    RESIDUAL_2,
    TORQUE_IMPULSE,
    TORQUE_SQUARES,
    TORQUE_TIME,
    UNFILTERED,
    W_TIME,
)
from leg_wear_monitor.twin.follower.torque_estimate import FRICTION, LAG, LOAD

# the sensor's period is a running mean of the times between its samples, each with so much weight; a time of
# more periods than so many has lost samples in it, and counts as that many
_WEIGHT, _LONGEST_PERIOD = 0.05, 1.5


@kernel
def compare(sensor, signature, leg, stepper, measured):
    """Compare a measured torque [N m] with the mean of the predicted one since the torque sample before.

    ``sensor`` (3,) cut-off of the low-pass [rad/s], the size of the torque [N m], and 1 where the sensor
    samples instants; ``signature`` (N + 1,) drive torque by a unit foot load [N m/N]. Where some were lost,
    that mean is over more than the sensor saw, and the sample is left out.
    """
    cutoff, size, instants = sensor[0], sensor[1], sensor[2] != 0.0
    mark, value, by, low_pass = leg.mark, leg.value, leg.regressor, leg.low_pass
    i, w = blend(signature.shape[0] - 1, stepper.drive[ANGLE])
    lever = signature[i] + w * (signature[i + 1] - signature[i])
    mean, seen = value[TORQUE_IMPULSE], value[TORQUE_TIME]
    squares = value[TORQUE_SQUARES]
    value[TORQUE_IMPULSE], value[TORQUE_TIME], value[TORQUE_SQUARES] = 0.0, 0.0, 0.0
    before, value[LAST_SIGNATURE] = value[LAST_SIGNATURE], lever
    if mark[FILTERING] == 0 or not seen > 0.0:  # the first since the leg moves
        mark[FILTERING] = max(mark[FILTERING], 1)
        value[UNFILTERED], leg.waiting[W_TIME] = 0.0, 0.0
        return
    dt = value[UNFILTERED] + seen
    value[UNFILTERED] = dt
    longest = value[PERIOD] * _LONGEST_PERIOD
    value[PERIOD] += _WEIGHT * (min(seen, longest) - value[PERIOD]) if longest > 0.0 else seen
    if 0.0 < longest < seen:
        return
    value[UNFILTERED] = 0.0
    direction = 1.0 if stepper.drive[SPEED] > 0.0 else -1.0
    if instants:
        mean /= seen
        variance = max(squares / seen - mean * mean, 0.0)
        angle = stepper.drive[ANGLE]
        r = take_instant(cutoff, size, leg, measured, mean, variance, lever, direction, dt, angle)
        if math.isfinite(r):
            p = value[LAST_PREDICTED]
            _add_up(p + r, p, by, leg.sums, leg.gram, leg.along)
        return
    fresh, fraction = mark[FILTERING] == 1, 1.0 - math.exp(-cutoff * dt)
    mark[FILTERING] = 2
    m = pass_low(fraction, fresh, low_pass, MEASURED, measured)
    p = pass_low(fraction, fresh, low_pass, PREDICTED, mean / seen)
    by[LOAD] = pass_low(fraction, fresh, low_pass, OF_LOAD, 0.5 * (before + lever))
    by[FRICTION] = pass_low(fraction, fresh, low_pass, OF_FRICTION, direction)
    by[LAG] = 0.0 if fresh else (value[LAST_PREDICTED] - p) / dt
    value[LAST_PREDICTED] = p
    _add_up(m, p, by, leg.sums, leg.gram, leg.along)


@kernel
def _add_up(m, p, by, sums, gram, along):
    """Add measured and predicted torque, and what may explain their difference, to a cycle's sums."""
    r = m - p
    sums[NUMBER] += 1.0
    sums[RESIDUAL] += r
    sums[RESIDUAL_2] += r * r
    sums[MEASURED_2] += m * m
    sums[PREDICTED_2] += p * p
    for a in range(3):
        along[a] += by[a] * r
        for b in range(3):
            gram[a, b] += by[a] * by[b]

"""Torque comparison for a sensor that samples instants instead of averages (physics.md section 9).

With clearances the drive torque has peaks that are shorter than the time between two samples, so an instant
may or may not contain one: even for a healthy leg, low-pass filtered instants deviate from the mean by a
quarter of the torque. Therefore the weight of an instant decreases with the variance of the predicted torque
around it, its deviation is bounded by a few times the RMS torque, and only the part of the residual that
repeats over gait cycles is evaluated (`repeating`).
"""

import math

from leg_wear_monitor.kernel import kernel
from leg_wear_monitor.twin.follower.low_pass import pass_low
from leg_wear_monitor.twin.follower.phase import phase_of
from leg_wear_monitor.twin.follower.state import FRICTION, LAG, LOAD, LOAD_FRICTION, PHASES, REGRESSORS

# as fractions of the RMS torque: standard deviation that halves an instant's weight, bound of its deviation;
# these values clearly separate a healthy leg from one with strong impacts
_VARIES, _FURTHEST = 0.5, 4.0


@kernel
def take_instant(sensor, leg, measured, mean, variance, lever, direction, dt, angle):
    """Store an instant, and compare the previous one, whose predicted torque on both sides is now known.

    ``mean`` [N m] and ``variance`` [N^2 m^2] are those of the predicted torque since the previous instant,
    ``dt`` [s] before; ``lever`` [N m/N] is the drive torque per foot load, ``angle`` [rad] the crank angle.

    Returns
    -------
    float
        The residual after the low-pass filter [N m], NaN before the second instant. Its regressors are in
        ``leg.regressor``.
    """
    w = leg.waiting
    residual = math.nan
    if w.time > 0.0:
        residual = _compare_waiting(sensor, leg, max(variance, w.variance))
    rate = (mean - w.mean_predicted) / dt if w.time > 0.0 else 0.0
    w.measured, w.mean_predicted, w.variance, w.time, w.angle = measured, mean, variance, dt, angle
    w.regressor[LOAD], w.regressor[FRICTION], w.regressor[LAG] = lever, direction, -rate
    w.regressor[LOAD_FRICTION] = direction * abs(mean)
    return residual


@kernel
def _compare_waiting(sensor, leg, variance):
    """Compare the stored instant; returns its residual after the low-pass filter [N m]."""
    w, low_pass, by_phase = leg.waiting, leg.low_pass, leg.sums.by_phase
    fresh, fraction = low_pass.stage == 1, 1.0 - math.exp(-sensor.cutoff * w.time)
    low_pass.stage = 2
    weight = 1.0 / (1.0 + variance / (_VARIES * sensor.usual) ** 2)
    furthest = _FURTHEST * sensor.usual
    off = min(max(w.measured - w.mean_predicted, -furthest), furthest)
    leg.torque.last_predicted = pass_low(fraction, fresh, w.mean_predicted, low_pass.predicted)
    of_all = pass_low(fraction, fresh, weight, low_pass.weight)
    phase = phase_of(w.angle, PHASES)
    by_phase[0, phase] += of_all
    residual = pass_low(fraction, fresh, weight * off, low_pass.weighted_residual)
    by_phase[1, phase] += residual
    for i in range(REGRESSORS):
        weighted = pass_low(fraction, fresh, weight * w.regressor[i], low_pass.weighted_regressor[i])
        by_phase[2 + i, phase] += weighted
        leg.regressor[i] = weighted / of_all
    return residual / of_all

"""The comparison for a torque sensor that samples instants instead of averages.

With clearances the drive torque is full of spikes, each shorter than the time between two samples. An instant
may meet one or not: even a healthy leg's instants, through a low-pass, are a quarter of the torque off their
mean. So an instant counts the less, the more the predicted torque varies around it, it counts as at most a
few times the torque's size off, and what is judged is what repeats over gait cycles (`repeating`).
"""

import math

from leg_wear_monitor.kernel import kernel
from leg_wear_monitor.twin.follower.low_pass import pass_low
from leg_wear_monitor.twin.follower.state import FRICTION, LAG, LOAD, PHASES

_TURN = 2.0 * math.pi
# fractions of the torque's size: its variation around an instant that halves the instant's weight, and how
# far off an instant counts at most; with them a healthy leg and a knocking one are far apart
_VARIES, _FURTHEST = 0.5, 4.0


@kernel
def take_instant(sensor, leg, measured, mean, variance, lever, direction, dt, angle):
    """Take in an instant, and compare the one before, whose both sides are known now.

    ``mean`` and ``variance`` of the predicted torque since the instant before, ``dt`` [s]; ``lever`` is the
    load's signature.

    Returns
    -------
    float
        The residual after the low-pass [N m]; NaN where there is none yet. ``leg.regressor`` goes with it.
    """
    w = leg.waiting
    residual = math.nan
    if w.time > 0.0:
        residual = _compare_waiting(sensor, leg, max(variance, w.variance))
    rate = (mean - w.mean_predicted) / dt if w.time > 0.0 else 0.0
    w.measured, w.mean_predicted, w.variance, w.time, w.angle = measured, mean, variance, dt, angle
    w.regressor[LOAD], w.regressor[FRICTION], w.regressor[LAG] = lever, direction, -rate
    return residual


@kernel
def _compare_waiting(sensor, leg, variance):
    """Compare the instant that waits; its residual after the low-pass [N m]."""
    w, low_pass, by_phase = leg.waiting, leg.low_pass, leg.sums.by_phase
    fresh, fraction = low_pass.stage == 1, 1.0 - math.exp(-sensor.cutoff * w.time)
    low_pass.stage = 2
    weight = 1.0 / (1.0 + variance / (_VARIES * sensor.usual) ** 2)
    furthest = _FURTHEST * sensor.usual
    off = min(max(w.measured - w.mean_predicted, -furthest), furthest)
    leg.torque.last_predicted = pass_low(fraction, fresh, w.mean_predicted, low_pass.predicted)
    of_all = pass_low(fraction, fresh, weight, low_pass.weight)
    turns = w.angle / _TURN
    phase = min(int((turns - math.floor(turns)) * PHASES), PHASES - 1)
    by_phase[0, phase] += of_all
    residual = pass_low(fraction, fresh, weight * off, low_pass.weighted_residual)
    by_phase[1, phase] += residual
    for i in range(3):
        weighted = pass_low(fraction, fresh, weight * w.regressor[i], low_pass.weighted_regressor[i])
        by_phase[2 + i, phase] += weighted
        leg.regressor[i] = weighted / of_all
    return residual / of_all

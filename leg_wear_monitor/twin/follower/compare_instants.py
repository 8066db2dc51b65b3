"""The comparison for a torque sensor that samples instants instead of averages.

With clearances the drive torque is full of spikes, each shorter than the time between two samples. An instant
may meet one or not: even a healthy leg's instants, through a low-pass, are a quarter of the torque off their
mean. So an instant counts the less, the more the predicted torque varies around it, it counts as at most a
few times the torque's size off, and what is judged is what repeats over gait cycles (`repeating`).
"""

import math

from leg_wear_monitor.kernel import kernel
from leg_wear_monitor.twin.follower.low_pass import pass_low
from leg_wear_monitor.twin.follower.state import (
    FILTERING,
    LAST_PREDICTED,
    PHASES,
    PREDICTED,
    W_ANGLE,
    W_DIRECTION,
    W_LAG,
    W_MEAN,
    W_MEASURED,
    W_SIGNATURE,
    W_TIME,
    W_VARIANCE,
    WEIGHT,
    WEIGHTED_RESIDUAL,
)

_TURN = 2.0 * math.pi
# fractions of the torque's size: its variation around an instant that halves the instant's weight, and how
# far off an instant counts at most; with them a healthy leg and a knocking one are far apart
_VARIES, _FURTHEST = 0.5, 4.0


@kernel
def take_instant(cutoff, size, leg, measured, mean, variance, lever, direction, dt, angle):
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
    if w[W_TIME] > 0.0:
        residual = _compare_waiting(cutoff, size, leg, max(variance, w[W_VARIANCE]))
    rate = (mean - w[W_MEAN]) / dt if w[W_TIME] > 0.0 else 0.0
    w[W_MEASURED], w[W_MEAN], w[W_VARIANCE], w[W_SIGNATURE] = measured, mean, variance, lever
    w[W_DIRECTION], w[W_LAG], w[W_TIME], w[W_ANGLE] = direction, -rate, dt, angle
    return residual


@kernel
def _compare_waiting(cutoff, size, leg, variance):
    """Compare the instant that waits; its residual after the low-pass [N m]."""
    w, by, low_pass, value = leg.waiting, leg.regressor, leg.low_pass, leg.value
    fresh, fraction = leg.mark[FILTERING] == 1, 1.0 - math.exp(-cutoff * w[W_TIME])
    leg.mark[FILTERING] = 2
    weight = 1.0 / (1.0 + variance / (_VARIES * size) ** 2)
    furthest = _FURTHEST * size
    off = min(max(w[W_MEASURED] - w[W_MEAN], -furthest), furthest)
    value[LAST_PREDICTED] = pass_low(fraction, fresh, low_pass, PREDICTED, w[W_MEAN])
    of_all = pass_low(fraction, fresh, low_pass, WEIGHT, weight)
    turns = w[W_ANGLE] / _TURN
    phase = min(int((turns - math.floor(turns)) * PHASES), PHASES - 1)
    leg.by_phase[0, phase] += of_all
    residual = pass_low(fraction, fresh, low_pass, WEIGHTED_RESIDUAL, weight * off)
    leg.by_phase[1, phase] += residual
    for i, what in enumerate((W_SIGNATURE, W_DIRECTION, W_LAG)):
        weighted = pass_low(fraction, fresh, low_pass, WEIGHTED_RESIDUAL + 1 + i, weight * w[what])
        leg.by_phase[2 + i, phase] += weighted
        by[i] = weighted / of_all
    return residual / of_all

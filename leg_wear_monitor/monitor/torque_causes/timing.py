"""Crank offset and torque lag, which differ by how the turned angle changes with the speed of the crank."""

from collections.abc import Sequence

import numpy as np

from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.monitor.torque_causes.curves import curves_of, inner, slope, turned
from leg_wear_monitor.monitor.torque_causes.explanation import Timing
from leg_wear_monitor.monitor.torque_causes.fit import Fit
from leg_wear_monitor.twin.statistics import CycleStatistics

_LEAST_CYCLES = 6
_RESOLVED = 6.0  # standard deviations of the offset by which an offset and a lag of the same angle differ


def timing_of(cycles: Sequence[CycleStatistics], best: Fit) -> Timing | None:
    """Offset and lag from gait cycles at several speeds; None while the speeds are too similar.

    The angle of a cycle is offset - lag * speed.
    """
    speed, angle = [], []
    for one in cycles:
        curves = curves_of([one.torque_profile], {})
        if curves is None:
            continue
        base = best.factor * turned(curves.predicted + best.load_n * curves.lever, best.angle_rad)
        rest, along = curves.measured - base, slope(base)
        speed.append(one.direction * TURN / one.moving_s)
        angle.append(best.angle_rad + inner(rest, along) / inner(along, along))
    if len(speed) < _LEAST_CYCLES:
        return None
    x, y = np.array(speed), np.array(angle)
    spread = float(((x - x.mean()) ** 2).sum())
    if not spread > 0.0:
        return None
    rate = float((x - x.mean()) @ y) / spread
    rest = y - y.mean() - rate * (x - x.mean())
    variance = float(rest @ rest) / (len(x) - 2)
    lag_sigma = float(np.sqrt(variance / spread))
    offset_sigma = float(np.sqrt(variance / len(x) + variance / spread * x.mean() ** 2))
    if _RESOLVED * offset_sigma > abs(best.angle_rad):
        return None
    return Timing(float(y.mean() - rate * x.mean()), offset_sigma, -rate, lag_sigma)

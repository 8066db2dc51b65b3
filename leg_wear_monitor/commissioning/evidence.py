"""Evidence of a recording beside the fit: the delay of its torque, and its cadence."""

import math

import numpy as np

from leg_wear_monitor.estimate.joint_motion import Series, slow_speed
from leg_wear_monitor.estimate.torque_model import Fit
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.monitor.config.settings import MonitorConfig, drive_figures
from leg_wear_monitor.twin.sample import AVERAGE

# RMS of a lag that is not declared, from 0 to 30 ms: current loops, filters, buses. The proposal allows for
# none, because a lag becomes a part of the offset
_UNKNOWN_S = 0.0173
_DECLARED_S = 0.001  # error of a declared lag
_MARGIN = 1.5  # cadence tolerance over the observed departures
_ONE_CADENCE = 0.2  # relative distance from the usual cadence beyond which a cadence counts as different


def late_s(torque: Series, base: MonitorConfig) -> float:
    """Delay of a torque [s]: of its sampling, and of the declared lag and low-pass of its drive."""
    sampled_s = 0.5 * _interval_s(torque.time_s) if base.drive_torque.sampling == AVERAGE else 0.0
    return sampled_s + drive_figures(base.drive).lateness_s


def late_sigma_s(one: Fit, base: MonitorConfig) -> float:
    """Standard deviation [s] of this time: a recording shows neither the lag nor the sampling."""
    is_declared = math.isfinite(drive_figures(base.drive).lag_s)
    return math.hypot(_DECLARED_S if is_declared else _UNKNOWN_S, 0.5 * one.pair.interval_s)


def _interval_s(time_s: Floats) -> float:
    return float(np.median(np.diff(time_s))) if len(time_s) > 1 else 0.0


def cadence_rpm(one: Fit) -> tuple[float, float]:
    """Usual cadence, negative for clockwise, and its tolerance [rpm]: a tenth, or more if needed."""
    speed = slow_speed(one.pair) * one.ratio * 60.0 / TURN
    # the speed near which the leg walks most of the time
    centres = np.quantile(speed, np.linspace(0.05, 0.95, 19))
    near = [np.abs(speed - centre) < _ONE_CADENCE * abs(centre) for centre in centres]
    usual = float(np.median(speed[max(near, key=np.count_nonzero)]))
    departures = np.abs(speed - usual)
    own = departures[departures < _ONE_CADENCE * abs(usual)]
    most = _MARGIN * float(own.max()) if len(own) else 0.0
    return float(f"{usual:.3g}"), float(f"{max(0.1 * abs(usual), most):.2g}")

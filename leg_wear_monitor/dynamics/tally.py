"""What a run adds up: integrals, extremes, distributions and impacts of every joint and of the drive.

Memory does not grow with the run: a distribution is a histogram over time with bins of equal ratio, and
impacts are counted beyond the first thousand.
"""

import math
from typing import NamedTuple

import numpy as np

from leg_wear_monitor.kernel import kernel
from leg_wear_monitor.mechanism.arrays import Floats, Ints

# integrals of a joint: |F| [N s], F^2 [N^2 s], time in contact [s], friction work [J], loss in the normal
# direction [J], F_N |v_t| [J]
FORCE, FORCE_SQUARED, CONTACT, FRICTION, DISSIPATION, ARCHARD = 0, 1, 2, 3, 4, 5
JOINT_RATES = 6
# integrals of the drive: torque [N m s], torque^2 [N^2 m^2 s], work from outside [J]
TORQUE, TORQUE_SQUARED, POWER = 0, 1, 2
DRIVE_RATES = 3
# impacts: time it begins [s], approach speed [m/s], time it ends [s], peak normal force [N]
BEGIN, SPEED, END, PEAK = 0, 1, 2, 3
IMPACTS = 1000

_LEAST, _MOST, _BINS = 1.0e-6, 1.0e9, 4096  # of a distribution: bins 0.8 % wide


class Tally(NamedTuple):
    """Sums over counted time, for j joints and the drive.

    ``time`` (1,) counted [s]; ``integral`` (j, 6); ``drive_integral`` (3,); ``peak`` (j,) largest force;
    ``drive_range`` (2,) least and largest torque; ``force_time`` (j, bins) and ``torque_time`` (2, bins)
    seconds spent at each magnitude, the torque's by sign; ``impact`` (j, 1000, 4); ``impacts`` (j,) their
    number; ``response`` (4,) largest deviation of the toe's position, velocity and acceleration and of the
    drive torque from the ideal linkage.
    """

    time: Floats
    integral: Floats
    drive_integral: Floats
    peak: Floats
    drive_range: Floats
    force_time: Floats
    torque_time: Floats
    impact: Floats
    impacts: Ints
    response: Floats


def new_tally(joints: int) -> Tally:
    """An empty tally."""
    return Tally(
        time=np.zeros(1),
        integral=np.zeros((joints, JOINT_RATES)),
        drive_integral=np.zeros(DRIVE_RATES),
        peak=np.zeros(joints),
        drive_range=np.array([np.inf, -np.inf]),
        force_time=np.zeros((joints, _BINS)),
        torque_time=np.zeros((2, _BINS)),
        impact=np.zeros((joints, IMPACTS, 4)),
        impacts=np.zeros(joints, dtype=np.int64),
        response=np.zeros(4),
    )


@kernel
def bin_of(magnitude):
    """Bin of a magnitude; bins have equal ratio."""
    if not magnitude > _LEAST:
        return 0
    return min(_BINS - 1, int(math.log(magnitude / _LEAST) * (_BINS / math.log(_MOST / _LEAST))))


def percentile(seconds: Floats, share: float) -> float:
    """Magnitude below which a share of the time was spent, to the width of a bin (0.8 %).

    Parameters
    ----------
    seconds : (bins,) array
    share : float
        In [0, 1].
    """
    reached = np.cumsum(seconds)
    if not reached[-1] > 0.0:
        return 0.0
    i = int(np.searchsorted(reached, share * reached[-1]))
    if i == 0:
        return 0.0
    inside = (share * reached[-1] - reached[i - 1]) / seconds[i]
    return float(_LEAST * (_MOST / _LEAST) ** ((i + inside) / len(seconds)))


def signed_percentile(seconds: Floats, share: float) -> float:
    """As `percentile`, for a signed quantity: seconds (2, bins) at negative and at positive values."""
    below, total = seconds[0].sum(), seconds.sum()
    if not total > 0.0:
        return 0.0
    if share * total < below:
        return -percentile(seconds[0], 1.0 - share * total / below)
    return percentile(seconds[1], (share * total - below) / (total - below))


@kernel
def add_step(tally, h, weights, rates, drive_rates):
    """Add a step of length h [s] by the quadrature weights of its stages (s,).

    ``rates`` (s, j, 6) and ``drive_rates`` (s, 3) at the stages; the last stage is the step's end.
    """
    tally.time[0] += h
    for s in range(weights.shape[0]):
        w = h * weights[s]
        if w != 0.0:
            for j in range(rates.shape[1]):
                for r in range(JOINT_RATES):
                    tally.integral[j, r] += w * rates[s, j, r]
            for r in range(DRIVE_RATES):
                tally.drive_integral[r] += w * drive_rates[s, r]
    end = weights.shape[0] - 1
    for j in range(rates.shape[1]):
        force = rates[end, j, FORCE]
        tally.peak[j] = max(tally.peak[j], force)
        tally.force_time[j, bin_of(force)] += h
    torque = drive_rates[end, TORQUE]
    tally.drive_range[0] = min(tally.drive_range[0], torque)
    tally.drive_range[1] = max(tally.drive_range[1], torque)
    tally.torque_time[1 if torque > 0.0 else 0, bin_of(abs(torque))] += h


@kernel
def begin_impact(tally, joint, t, speed):
    """Note that contact began in a joint at time t [s] with an approach speed [m/s]."""
    i = tally.impacts[joint]
    tally.impacts[joint] += 1
    if i < IMPACTS:
        tally.impact[joint, i, BEGIN], tally.impact[joint, i, SPEED] = t, speed
        tally.impact[joint, i, END], tally.impact[joint, i, PEAK] = math.nan, 0.0


@kernel
def raise_peak(tally, joint, force):
    """The normal force of the contact that goes on in a joint has reached a value [N]."""
    i = tally.impacts[joint] - 1
    tally.peak[joint] = max(tally.peak[joint], force)
    if 0 <= i < IMPACTS and math.isnan(tally.impact[joint, i, END]):
        tally.impact[joint, i, PEAK] = max(tally.impact[joint, i, PEAK], force)


@kernel
def end_impact(tally, joint, t):
    """Note that the contact in a joint ended at time t [s]."""
    i = tally.impacts[joint] - 1
    if 0 <= i < IMPACTS and math.isnan(tally.impact[joint, i, END]):
        tally.impact[joint, i, END] = t


@kernel
def parabola_peak(t0, f0, t1, f1, t2, f2):
    """Value at the top of the parabola through three samples of which the middle one is largest."""
    a, b = t1 - t0, t2 - t1
    left, right = (f1 - f0) / a, (f2 - f1) / b
    curvature = (right - left) / (a + b)
    if not curvature < 0.0:
        return f1
    slope = (left * b + right * a) / (a + b)
    return f1 - 0.25 * slope * slope / curvature

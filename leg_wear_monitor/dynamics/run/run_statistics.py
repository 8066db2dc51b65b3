"""Run statistics: integrals, extremes, distributions and impacts of every joint and of the drive.

Memory does not grow with the length of the run: a distribution is a histogram of time, and impacts after the
first thousand are only counted.
"""

import math
from typing import NamedTuple

import numpy as np

from leg_wear_monitor.kernel import kernel
from leg_wear_monitor.mechanism.arrays import Floats, Ints
from leg_wear_monitor.vectors import bits_of

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
# largest deviations from the ideal linkage: toe [m, m/s, m/s^2], drive torque [N m]
POSITION, VELOCITY, ACCELERATION, TORQUE_ERROR = 0, 1, 2, 3

# bins of a histogram: 128 per octave, at most 0.8 % wide, from 2^-20 to 2^30
_FIRST_OCTAVE, _OCTAVES, _IN_OCTAVE = -20, 50, 128
_BINS = _OCTAVES * _IN_OCTAVE
# least ratio of two successive steps for a parabola through their ends; steps shrink to 0.2 at a time
_MOST_UNEQUAL = 0.1
# of the 52 binary digits of a number, 7 tell 128 bins; its exponent is stored plus 1023
_DIGITS_AFTER_BIN, _BITS_OF_FIRST = 52 - 7, (1023 + _FIRST_OCTAVE) * _IN_OCTAVE


class RunStatistics(NamedTuple):
    """Statistics over the counted time, for j joints and the drive.

    ``time`` (1,) [s]: counted time; ``integral`` (j, 6), ``drive_integral`` (3,): columns and units above;
    ``peak`` (j,) [N]: largest force; ``drive_range`` (2,) [N m]: least and largest torque;
    ``force_time`` (j, bins), ``torque_time`` (2, bins) [s]: time at each magnitude, of negative and positive
    torque; ``impact`` (j, 1000, 4): columns above; ``impacts`` (j,): number of impacts;
    ``response`` (4,) [m, m/s, m/s^2, N m]: largest deviations from the ideal linkage, of the toe and of the
    drive torque; ``worn_energy`` (1,) [J]: elastic contact energy lost with removed material;
    ``steps`` (2,): number of trial steps and of accepted steps.
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
    worn_energy: Floats
    steps: Ints


def new_run_statistics(joints: int) -> RunStatistics:
    """Empty run statistics."""
    return RunStatistics(
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
        worn_energy=np.zeros(1),
        steps=np.zeros(2, dtype=np.int64),
    )


@kernel
def bin_of(magnitude):
    """Index of a magnitude's bin: its binary exponent and the first binary digits after it."""
    if not magnitude > 2.0**_FIRST_OCTAVE:
        return 0
    return min((bits_of(magnitude) >> _DIGITS_AFTER_BIN) - _BITS_OF_FIRST, _BINS - 1)


def bin_edge(i: float) -> float:
    """Magnitude at the lower edge of bin i; for a fractional i, inside the bin."""
    octave, inside = divmod(i, _IN_OCTAVE)
    return float(2.0 ** (octave + _FIRST_OCTAVE) * (1.0 + inside / _IN_OCTAVE))


def percentile(seconds: Floats, fraction: float) -> float:
    """Percentile of a histogram: the magnitude below which a fraction of the time was spent.

    Parameters
    ----------
    seconds : (bins,) array
        Time in each bin [s].
    fraction : float
        In [0, 1].

    Returns
    -------
    float
        Exact to the width of a bin, at most 0.8 %; 0 for an empty histogram.
    """
    reached = np.cumsum(seconds)
    if not reached[-1] > 0.0:
        return 0.0
    i = int(np.searchsorted(reached, fraction * reached[-1]))
    if i == 0:
        return 0.0
    return bin_edge(i + (fraction * reached[-1] - reached[i - 1]) / seconds[i])


def signed_percentile(seconds: Floats, fraction: float) -> float:
    """As `percentile`, for a signed quantity: time (2, bins) [s] at negative and at positive values."""
    below, total = seconds[0].sum(), seconds.sum()
    if not total > 0.0:
        return 0.0
    if fraction * total < below:
        return -percentile(seconds[0], 1.0 - fraction * total / below)
    return percentile(seconds[1], (fraction * total - below) / (total - below))


@kernel
def add_step(statistics, h, weights, rates, drive_rates):
    """Add a step of length h [s] by the quadrature weights of its stages (s,).

    ``rates`` (s, j, 6) and ``drive_rates`` (s, 3) at the stages; the last stage is the step's end.
    """
    statistics.time[0] += h
    for s in range(weights.shape[0]):
        w = h * weights[s]
        if w != 0.0:
            for j in range(rates.shape[1]):
                for r in range(JOINT_RATES):
                    statistics.integral[j, r] += w * rates[s, j, r]
            for r in range(DRIVE_RATES):
                statistics.drive_integral[r] += w * drive_rates[s, r]
    end = weights.shape[0] - 1
    for j in range(rates.shape[1]):
        force = rates[end, j, FORCE]
        statistics.peak[j] = max(statistics.peak[j], force)
        statistics.force_time[j, bin_of(force)] += h
    torque = drive_rates[end, TORQUE]
    statistics.drive_range[0] = min(statistics.drive_range[0], torque)
    statistics.drive_range[1] = max(statistics.drive_range[1], torque)
    statistics.torque_time[1 if torque > 0.0 else 0, bin_of(abs(torque))] += h


@kernel
def begin_impact(impact, impacts, joint, t, speed):
    """Record that contact began in a joint at time t [s] with an approach speed [m/s]."""
    i = impacts[joint]
    impacts[joint] += 1
    if i < IMPACTS:
        impact[joint, i, BEGIN], impact[joint, i, SPEED] = t, speed
        impact[joint, i, END], impact[joint, i, PEAK] = math.nan, 0.0


@kernel
def raise_peak(peak, impact, impacts, joint, force):
    """Update the peak of a joint, and of its present contact, by a normal force [N]."""
    i = impacts[joint] - 1
    peak[joint] = max(peak[joint], force)
    if 0 <= i < IMPACTS and math.isnan(impact[joint, i, END]):
        impact[joint, i, PEAK] = max(impact[joint, i, PEAK], force)


@kernel
def end_impact(impact, impacts, joint, t):
    """Record that the contact in a joint ended at time t [s]."""
    i = impacts[joint] - 1
    if 0 <= i < IMPACTS and math.isnan(impact[joint, i, END]):
        impact[joint, i, END] = t


@kernel
def parabola_peak(t0, f0, t1, f1, t2, f2):
    """Maximum of the parabola through three samples (t [s], f [N]), the middle one of which is largest.

    Just the middle sample where one step is much shorter than the other: wear that is deposited and a change
    of tables are small jumps of the force, and over a very short step (one cut at a contact event) their
    slope would put the vertex at hundreds of kN.
    """
    a, b = t1 - t0, t2 - t1
    if min(a, b) < _MOST_UNEQUAL * max(a, b):
        return f1
    left, right = (f1 - f0) / a, (f2 - f1) / b
    curvature = (right - left) / (a + b)
    if not curvature < 0.0:
        return f1
    slope = (left * b + right * a) / (a + b)
    return f1 - 0.25 * slope * slope / curvature

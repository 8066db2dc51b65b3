"""Comparison of measured and predicted drive torque after one low-pass filter (physics.md section 9)."""

import math

from leg_wear_monitor.dynamics.clearance.model import ANGLE, SPEED, blend
from leg_wear_monitor.kernel import kernel
from leg_wear_monitor.twin.follower.compare_instants import take_instant
from leg_wear_monitor.twin.follower.low_pass import pass_low
from leg_wear_monitor.twin.follower.phase import in_turn, phase_of
from leg_wear_monitor.twin.follower.state import FRICTION, LAG, LOAD, LOAD_FRICTION, REGRESSORS

# weight of a time between samples in the running means of the sensor's period and of its scatter, and longest
# time in periods: in a longer time samples were lost, and it counts as this many periods in the mean. Where
# times scatter by themselves, this many times their scatter are allowed for: even times from 0 to 2 periods
# scatter by 0.375, as far as counted; with a quarter of the samples lost, the scatter is below 0.125
_WEIGHT, _LONGEST_PERIOD, _OF_SCATTER = 0.05, 1.5, 4.0


@kernel
def compare(sensor, signature, leg, stepper, measured):
    """Compare a measured torque [N m] with the mean of the predicted one since the previous torque sample.

    ``signature`` (N + 1,) is the drive torque per foot load [N m/N]. After lost torque samples, the predicted
    mean covers a longer time than the sensor's, and the sample is left out.
    """
    torque, by, low_pass = leg.torque, leg.regressor, leg.low_pass
    i, w = blend(signature.shape[0] - 1, stepper.drive[ANGLE])
    lever = signature[i] + w * (signature[i + 1] - signature[i])
    mean, duration = torque.sensed_impulse, torque.sensed_time
    squares = torque.sensed_squares
    torque.sensed_impulse, torque.sensed_time, torque.sensed_squares = 0.0, 0.0, 0.0
    before, torque.last_lever = torque.last_lever, lever
    if low_pass.stage == 0 or not duration > 0.0:  # the first sample since the leg moves
        low_pass.stage = max(low_pass.stage, 1)
        torque.unfiltered, leg.waiting.time = 0.0, 0.0
        return
    dt = torque.unfiltered + duration
    torque.unfiltered = dt
    longest = torque.period * max(_LONGEST_PERIOD, 1.0 + _OF_SCATTER * torque.period_scatter)
    if torque.period > 0.0:
        away = min(abs(duration / torque.period - 1.0), _LONGEST_PERIOD - 1.0)
        torque.period_scatter += _WEIGHT * (away - torque.period_scatter)
        torque.period += _WEIGHT * (min(duration, torque.period * _LONGEST_PERIOD) - torque.period)
    else:
        torque.period = duration
    if 0.0 < longest < duration:
        return
    torque.unfiltered = 0.0
    # an average weighs by the time that it stands for; a torque of an instant stands for itself
    weight = 1.0 if sensor.instants != 0 else duration / torque.period
    angle, toe = stepper.drive[ANGLE], 0.5 * (before + lever)
    add_to_profile(leg.sums.profile, angle, measured, mean / duration, toe, weight)
    direction = 1.0 if stepper.drive[SPEED] > 0.0 else -1.0
    if sensor.instants != 0:
        mean /= duration
        variance = max(squares / duration - mean * mean, 0.0)
        r = take_instant(sensor, leg, measured, mean, variance, lever, direction, dt, angle)
        if math.isfinite(r):
            p = torque.last_predicted
            _add_up(p + r, p, by, leg.sums, weight)
        return
    fresh, fraction = low_pass.stage == 1, 1.0 - math.exp(-sensor.cutoff * dt)
    low_pass.stage = 2
    m = pass_low(fraction, fresh, measured, low_pass.measured)
    p = pass_low(fraction, fresh, mean / duration, low_pass.predicted)
    by[LOAD] = pass_low(fraction, fresh, toe, low_pass.of_load)
    by[FRICTION] = pass_low(fraction, fresh, direction, low_pass.of_friction)
    rubbing = direction * abs(mean / duration)
    by[LOAD_FRICTION] = pass_low(fraction, fresh, rubbing, low_pass.of_load_friction)
    by[LAG] = 0.0 if fresh else (torque.last_predicted - p) / dt
    torque.last_predicted = p
    _add_up(m, p, by, leg.sums, weight)


@kernel
def add_to_profile(profile, angle, measured, predicted, lever, weight):
    """Add a measured and a predicted torque [N m] and the torque per load [N m/N] to the sums of a phase."""
    phase = phase_of(angle, profile.shape[1])
    profile[0, phase] += weight
    profile[1, phase] += weight * in_turn(angle)
    profile[2, phase] += weight * measured
    profile[3, phase] += weight * predicted
    profile[4, phase] += weight * lever


@kernel
def _add_up(m, p, by, sums, weight):
    """Add measured torque m, predicted torque p [N m] and regressors ``by`` (4,) to a cycle's sums."""
    r = m - p
    sums.number += 1.0
    sums.weight += weight
    sums.residual_squares += weight * r * r
    sums.measured_squares += weight * m * m
    sums.predicted_squares += weight * p * p
    for a in range(REGRESSORS):
        sums.along[a] += weight * by[a] * r
        for b in range(REGRESSORS):
            sums.gram[a, b] += weight * by[a] * by[b]

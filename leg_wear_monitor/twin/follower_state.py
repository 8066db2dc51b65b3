"""State of the follower: motion along the steps, phase bins, low-pass, torque comparison."""

import math
from typing import NamedTuple

import numpy as np

from leg_wear_monitor.compiled.kernel import Records, kernel, new_records
from leg_wear_monitor.mechanism.arrays import Floats

# State of the follower: motion along the steps, torque comparison.


PHASES = 32  # crank phases per turn, for the residual that repeats over gait cycles
FINE_PHASES = 128  # phases of the torque profile of a gait cycle

# number and indices of the regressors of a torque residual
REGRESSORS = 4
LOAD, FRICTION, LAG, LOAD_FRICTION = range(REGRESSORS)

LEG_MOTION = np.dtype(
    [
        ("base_ns", "i8"),  # stamp of the stepper's time 0
        ("runs", "i8"),  # 1 where the leg runs
        ("lost", "i8"),  # 1 after a failure, until the next start
        # the present piece of the crank's motion
        ("piece_begin_ns", "i8"),  # stamp
        ("piece_end_ns", "i8"),  # stamp
        ("turns_before", "i8"),  # whole crank turns to add to the leg's angle
        # the next passage of crank angle 0, which ends a gait cycle
        ("cut_ns", "i8"),  # stamp, 0 if not in this piece
        ("cut_turn", "i8"),  # whole crank turns there
        ("cut_rises", "i8"),  # 1 if forward
        # the last passage of crank angle 0
        ("anchored", "i8"),  # 1 if there was one
        ("anchor_turn", "i8"),  # whole crank turns there
        ("whole_cycles", "i8"),  # complete gait cycles since the leg was set in motion
        ("cycle_before_ns", "i8"),  # duration of the last of them
        # the gait cycle
        ("cycle_begin_ns", "i8"),  # stamp
        ("cycle_bridged_ns", "i8"),  # time bridged in it
        ("cycle_is_whole", "i8"),  # 1 if the cycle that has ended is complete
        # counts
        ("cycles", "i8"),  # complete gait cycles
        ("failures", "i8"),  # failures of the integration
        ("failed_at_ns", "i8"),  # stamp of the last failure
        ("failed_ns", "i8"),  # time lost by failures
        ("moving_ns", "i8"),  # time in motion
    ]
)

LEG_TORQUE = np.dtype(
    [
        # predicted drive torque since the last sample
        ("impulse", "f8"),  # integral [N m s]
        ("time", "f8"),  # time [s]
        ("mean_before", "f8"),  # mean before that sample [N m]
        # predicted drive torque since the last torque sample
        ("sensed_impulse", "f8"),  # integral [N m s]
        ("sensed_squares", "f8"),  # integral of the square [N^2 m^2 s]
        ("sensed_time", "f8"),  # time [s]
        # comparison
        ("last_lever", "f8"),  # drive torque per foot load at the last torque sample [N m/N]
        ("last_predicted", "f8"),  # predicted torque after the low-pass filter [N m]
        ("period", "f8"),  # period of the torque sensor [s]
        ("period_scatter", "f8"),  # mean departure of sample intervals from the period, as a fraction
        ("unfiltered", "f8"),  # time since the last filtered sample [s]
    ]
)

LOW_PASS = np.dtype(
    [
        ("stage", "i8"),  # 0 empty, 1 after the first sample, 2 after the first filtered one
        # the filter's two stages, for each signal
        ("measured", "f8", (2,)),  # [N m]
        ("predicted", "f8", (2,)),  # [N m]
        ("of_load", "f8", (2,)),  # torque per foot load [N m/N]
        ("of_friction", "f8", (2,)),  # torque per friction [-]
        ("of_load_friction", "f8", (2,)),  # torque per friction under load [N m]
        # for a sensor that samples instants
        ("weight", "f8", (2,)),  # weight of an instant
        ("weighted_residual", "f8", (2,)),  # weight times residual [N m]
        ("weighted_regressor", "f8", (REGRESSORS, 2)),  # weight times regressors
    ]
)

WAITING_INSTANT = np.dtype(
    [
        ("measured", "f8"),  # torque [N m]
        ("mean_predicted", "f8"),  # mean of the predicted torque since the previous instant [N m]
        ("variance", "f8"),  # variance of the predicted torque [N^2 m^2]
        ("regressor", "f8", (REGRESSORS,)),  # torque per load, friction, lag, load friction
        ("time", "f8"),  # since the previous instant [s], 0 if none is stored
        ("angle", "f8"),  # crank angle [rad]
    ]
)
"""An instant that is stored until the next one."""

TORQUE_SUMS = np.dtype(
    [
        ("number", "f8"),  # number of compared torques
        ("weight", "f8"),  # weight of the following sums, in samples
        ("residual_squares", "f8"),  # [N^2 m^2]
        ("measured_squares", "f8"),  # [N^2 m^2]
        ("predicted_squares", "f8"),  # [N^2 m^2]
        ("gram", "f8", (REGRESSORS, REGRESSORS)),  # products of the regressors with each other
        ("along", "f8", (REGRESSORS,)),  # products of the regressors with the residual
        # for a sensor that samples instants: rows of weight, then weight times residual and regressors
        ("by_phase", "f8", (2 + REGRESSORS, PHASES)),
        # before the low-pass filter: weight, crank angle, measured torque, predicted torque, torque per load
        ("profile", "f8", (5, FINE_PHASES)),
    ]
)
"""Sums over a gait cycle."""

LOAD_SUMS = np.dtype(
    [
        ("gap_ns", "i8"),  # time in gaps between samples
        ("samples", "i8"),
        ("least", "f8"),  # vertical force, 0 before the first sample [N]
        ("largest", "f8"),  # [N]
        ("profile", "f8", (3, FINE_PHASES)),  # number, force x and y [N]
    ]
)
"""Sums over the foot load samples of a gait cycle, along the axes of the mechanism."""

LAST_LOAD = np.dtype(
    [
        ("stamp_ns", "i8"),  # of the last sample of the foot load, 0 before the first
        ("force", "f8", (2,)),  # its force [N]
        ("is_frozen", "i8"),  # 1 while the samples are wrong: the mean of earlier gait cycles stays
    ]
)

LEG_STATE = np.dtype(
    [
        ("motion", LEG_MOTION),
        ("load", LOAD_SUMS),
        ("last_load", LAST_LOAD),
        ("torque", LEG_TORQUE),
        ("low_pass", LOW_PASS),
        ("waiting", WAITING_INSTANT),
        ("regressor", "f8", (REGRESSORS,)),  # torque per load, friction, lag and load friction
        ("sums", TORQUE_SUMS),
    ]
)

TORQUE_SENSOR = np.dtype(
    [
        ("cutoff", "f8"),  # cutoff of the low-pass filter [rad/s]
        ("usual", "f8"),  # RMS of the ideal torque [N m]
        ("instants", "i8"),  # 1 if it samples instants instead of averages
        # drive, as estimated up to the last gait cycle
        ("friction", "f8"),  # constant [N m]
        ("load_friction", "f8"),  # friction over the size of the torque
    ]
)

EVALUATED = np.dtype(
    [
        ("stamp_ns", "i8"),  # stamp of the sample
        ("kind", "i8"),  # kind of `twin.sample`
        ("angle", "f8"),  # crank angle [rad], NaN while the leg does not run
        # mean drive torque since the previous sample, with the drive's friction [N m]; NaN while at rest
        ("torque", "f8"),
        ("measured", "f8"),  # drive torque of the sample [N m], NaN without one
    ]
)
"""The leg at a sample."""


class FollowerState(NamedTuple):
    """State of the follower, in addition to the stepper's.

    ``records`` (1,): of `LEG_STATE`; ``polynomial`` (7,): present piece of the crank's motion; ``force`` (k,)
    [N]: contact forces at the end of the last step.
    """

    records: Records
    polynomial: Floats
    force: Floats


def leg_state(clearance_joints: int) -> FollowerState:
    """State before the first step."""
    return FollowerState(new_records(1, LEG_STATE), np.zeros(7), np.zeros(clearance_joints))


# Phase of the crank, in whose bins torques are summed over a gait cycle.


_TURN = 2.0 * math.pi


@kernel
def in_turn(angle):
    """Crank angle [rad] in [0, 2 pi)."""
    return angle - _TURN * math.floor(angle / _TURN)


@kernel
def phase_of(angle, phases):
    """Index below ``phases`` of a crank angle [rad]."""
    return min(int(in_turn(angle) / _TURN * phases), phases - 1)


# Low-pass filter of measured and predicted drive torque, two first-order stages (physics.md section 9).


@kernel
def pass_low(fraction, fresh, value, stages):
    """Output of the filter with ``stages`` (2,), ``fraction`` 1 - exp(-w dt); if fresh, it is the input."""
    for stage in range(2):
        if fresh:
            stages[stage] = value
        stages[stage] += fraction * (value - stages[stage])
        value = stages[stage]
    return value

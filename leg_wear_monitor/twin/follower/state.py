"""Where the leg is on its way along the tracker's steps, and what was compared with the measured torque."""

from typing import NamedTuple

import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.record import Records, new_records

PHASES = 32  # of the crank's turn, for what repeats from one gait cycle to the next

# what may explain a torque that is off: its index in vectors that least squares work on
LOAD, FRICTION, LAG = 0, 1, 2

LEG_MOTION = np.dtype(
    [
        ("base_ns", "i8"),  # stamp of the stepper's time 0
        ("runs", "i8"),  # 1 where the leg runs
        ("lost", "i8"),  # 1 where it has failed and was not started since
        # the present piece of the crank's motion
        ("piece_begin_ns", "i8"),  # stamp
        ("piece_end_ns", "i8"),  # stamp
        ("turns_before", "i8"),  # turns of the crank before the leg's angle
        # where the crank passes 0 next, which ends a gait cycle
        ("cut_ns", "i8"),  # stamp, 0 if not in this piece
        ("cut_turn", "i8"),  # turns of the crank there
        ("cut_rises", "i8"),  # 1 if forward
        # where it passed 0 last
        ("anchored", "i8"),  # 1 if it has
        ("anchor_turn", "i8"),  # turns of the crank there
        # the gait cycle
        ("cycle_begin_ns", "i8"),  # stamp
        ("cycle_bridged_ns", "i8"),  # time bridged in it
        ("cycle_is_whole", "i8"),  # 1 where the one that has ended is a whole one
        # counts
        ("cycles", "i8"),  # whole gait cycles
        ("failures", "i8"),  # how often the leg could not go on
        ("failed_at_ns", "i8"),  # when it failed last
        ("failed_ns", "i8"),  # time lost by failures
        ("moving_ns", "i8"),  # time in motion
    ]
)

LEG_TORQUE = np.dtype(
    [
        # of the drive torque since the last sample
        ("impulse", "f8"),  # integral [N m s]
        ("time", "f8"),  # time [s]
        ("mean_before", "f8"),  # mean before that sample [N m]
        # of the drive torque since the last torque sample
        ("sensed_impulse", "f8"),  # integral [N m s]
        ("sensed_squares", "f8"),  # integral of the square [N^2 m^2 s]
        ("sensed_time", "f8"),  # time [s]
        # of the comparison
        ("last_lever", "f8"),  # drive torque by a unit foot load at the last torque sample [N m/N]
        ("last_predicted", "f8"),  # predicted torque after the low-pass [N m]
        ("period", "f8"),  # of the torque sensor [s]
        ("unfiltered", "f8"),  # time since what was last filtered [s]
    ]
)

LOW_PASS = np.dtype(
    [
        ("stage", "i8"),  # 0 empty, 1 a sample has come, 2 filtered since
        # its two stages, for each torque
        ("measured", "f8", (2,)),  # [N m]
        ("predicted", "f8", (2,)),  # [N m]
        ("of_load", "f8", (2,)),  # of a unit foot load [N m/N]
        ("of_friction", "f8", (2,)),  # of unit friction
        # of a sensor that samples instants
        ("weight", "f8", (2,)),  # of an instant
        ("weighted_residual", "f8", (2,)),  # weight times residual [N m]
        ("weighted_regressor", "f8", (3, 2)),  # weight times what may explain it
    ]
)

WAITING_INSTANT = np.dtype(
    [
        ("measured", "f8"),  # torque [N m]
        ("mean_predicted", "f8"),  # of the predicted torque since the instant before [N m]
        ("variance", "f8"),  # of that torque [N^2 m^2]
        ("regressor", "f8", (3,)),  # what a unit load, unit friction and unit lag make [N m/N, -, N m/s]
        ("time", "f8"),  # since the instant before [s], 0 if none waits
        ("angle", "f8"),  # of the crank [rad]
    ]
)
"""An instant that waits for the next one."""

TORQUE_SUMS = np.dtype(
    [
        ("number", "f8"),  # of torques compared
        ("residual", "f8"),  # [N m]
        ("residual_squares", "f8"),  # [N^2 m^2]
        ("measured_squares", "f8"),  # [N^2 m^2]
        ("predicted_squares", "f8"),  # [N^2 m^2]
        ("gram", "f8", (3, 3)),  # products of the torques by load, friction and lag with each other
        ("along", "f8", (3,)),  # and with the residual
        # of a sensor that samples instants: rows of weight, and of residual, load, friction, lag times that
        ("by_phase", "f8", (5, PHASES)),
    ]
)
"""Sums over a gait cycle."""

LEG_STATE = np.dtype(
    [
        ("motion", LEG_MOTION),
        ("torque", LEG_TORQUE),
        ("low_pass", LOW_PASS),
        ("waiting", WAITING_INSTANT),
        ("regressor", "f8", (3,)),  # torques by a unit load, unit friction and unit lag [N m/N, -, N m/s]
        ("sums", TORQUE_SUMS),
    ]
)

TORQUE_SENSOR = np.dtype(
    [
        ("cutoff", "f8"),  # of the low-pass [rad/s]
        ("usual", "f8"),  # size of the torque [N m]
        ("instants", "i8"),  # 1 where it samples instants instead of averages
    ]
)

EVALUATED = np.dtype(
    [
        ("stamp_ns", "i8"),  # of the sample
        ("kind", "i8"),  # of `twin.sample`
        ("angle", "f8"),  # of the crank [rad], NaN where the leg does not run
        ("torque", "f8"),  # mean drive torque since the sample before [N m], NaN where the leg does not run
    ]
)
"""The leg at a sample."""


class LegState(NamedTuple):
    """All that changes in the leg along its way, beside the stepper.

    ``records`` (1,) of `LEG_STATE`; ``polynomial`` (7,) the piece; ``force`` (k,) contact forces [N] at the
    end of the last step.
    """

    records: Records
    polynomial: Floats
    force: Floats


def leg_state(clearance_joints: int) -> LegState:
    """State before the first step."""
    return LegState(new_records(1, LEG_STATE), np.zeros(7), np.zeros(clearance_joints))

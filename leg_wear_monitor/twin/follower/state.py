"""Where the leg is on its way along the tracker's steps, and what was compared with the measured torque."""

from typing import NamedTuple

import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats, Ints

# stamps and counts: stamp of the stepper's time 0; 1 where the leg runs, 1 where it must start afresh; the
# piece's begin and end; turns before the leg's angle; 1 where a cycle's begin was passed, and its turn; stamp
# at which the next is passed, 0 if not in this piece, its turn, and 1 if forward;
# when it began; time bridged in it; samples looked at in this call; how full the torque filters are;
# number of cycles and of failures; when it last failed; time lost by that; time in motion; 1 where the
# cycle that has ended is a whole one
(
    BASE, RUNNING, AFRESH, PIECE_BEGIN, PIECE_END, TURNS_BEFORE, ANCHORED, ANCHOR, CUT, CUT_TURN, CUT_RISES,
    CYCLE_BEGIN, CYCLE_BRIDGED, LOOKS, FILTERING, CYCLES, FAILURES, FAILED_AT, FAILED_NS, MOVING_NS, WHOLE,
) = range(21)  # fmt: skip
MARKS = 21

# values: drive torque's impulse and time since the last sample, and since the last torque; mean torque before
# the last sample; last load signature; predicted torque after the low-pass, as it was last; period of the
# torque sensor; time since what was last filtered; integral of the squared drive torque since the last torque
(
    IMPULSE, TIME, TORQUE_IMPULSE, TORQUE_TIME, MEAN_TORQUE, LAST_SIGNATURE, LAST_PREDICTED, PERIOD,
    UNFILTERED, TORQUE_SQUARES,
) = range(10)  # fmt: skip
VALUES = 10

# what goes through the low-pass: torque measured, predicted, of a unit foot load, and of unit friction; of a
# sensor that samples instants the weight, and times the weight the residual and what may explain it
(
    MEASURED, PREDICTED, OF_LOAD, OF_FRICTION, WEIGHT, WEIGHTED_RESIDUAL, WEIGHTED_LOAD, WEIGHTED_FRICTION,
    WEIGHTED_LAG,
) = range(9)  # fmt: skip
CHANNELS = 9

# an instant that waits for the next one: measured torque, mean and variance of the predicted one since the
# instant before, load signature, direction, minus the rate of the predicted torque, time, crank angle
(
    W_MEASURED, W_MEAN, W_VARIANCE, W_SIGNATURE, W_DIRECTION, W_LAG, W_TIME, W_ANGLE,
) = range(8)  # fmt: skip
WAITING_VALUES = 8

PHASES = 32  # of the crank's turn, for what repeats from one gait cycle to the next
BY_PHASE = 5  # rows: weight, and times the weight the residual and what load, friction and lag make

# sums over a cycle: number; of the residual and its square; squares of measured and predicted
NUMBER, RESIDUAL, RESIDUAL_2, MEASURED_2, PREDICTED_2 = range(5)
SUMS = 5


class LegState(NamedTuple):
    """``mark`` and ``value`` as above.

    ``polynomial`` (7,) the piece; ``low_pass`` (2, CHANNELS) its two stages; ``sums`` (SUMS,),
    and ``gram`` (3, 3) and ``along`` (3,) of the products of the torques by load, friction and lag,
    ``regressor`` (3,), with each other and with the residual; ``force`` (k,) contact forces [N] at the last
    look. ``waiting`` (WAITING_VALUES,) an instant as above, and ``by_phase`` (BY_PHASE, PHASES) the sums of a
    cycle; both are of sensors that sample instants alone.
    """

    mark: Ints
    value: Floats
    polynomial: Floats
    low_pass: Floats
    sums: Floats
    gram: Floats
    along: Floats
    regressor: Floats
    force: Floats
    waiting: Floats
    by_phase: Floats


class Looks(NamedTuple):
    """What was seen at m samples: stamp and kind (m, 2), angle and torque (m, 2), forces (m, k)."""

    stamp: Ints
    figure: Floats
    force: Floats


def leg_state(clearance_joints: int) -> LegState:
    """State before the first step."""
    return LegState(
        np.zeros(MARKS, dtype=np.int64), np.zeros(VALUES), np.zeros(7), np.zeros((2, CHANNELS)),
        np.zeros(SUMS), np.zeros((3, 3)), np.zeros(3), np.zeros(3), np.zeros(clearance_joints),
        np.zeros(WAITING_VALUES), np.zeros((BY_PHASE, PHASES)),
    )  # fmt: skip


def clear_sums(leg: LegState) -> None:
    """Start to compare torques afresh."""
    for part in (leg.sums, leg.gram, leg.along, leg.by_phase):
        part[...] = 0.0


def room_for_looks(m: int, clearance_joints: int) -> Looks:
    """Room for m samples."""
    return Looks(np.zeros((m, 2), dtype=np.int64), np.zeros((m, 2)), np.zeros((m, clearance_joints)))

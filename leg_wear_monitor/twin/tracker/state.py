"""The crank tracker's state: what waits, what has been filtered, what was counted."""

from typing import NamedTuple

import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats, Ints
from leg_wear_monitor.twin.sample import FAULTS, KINDS
from leg_wear_monitor.twin.settings import TrackerSettings

ARRIVALS, QUEUE = 2048, 4096  # samples that may wait for their order, and for the leg

# settings in ns
WINDOW, LAG, BRIDGE, MARK, JUMP, ACQUIRE, STOP_HOLD, SETTLE, SPLINE_NODE, RUN_UP = range(10)
# other settings: power of the jerk [rad^2/s^5], noise of angle [rad^2 s] and of velocity [rad^2/s], longest
# time a sample's noise is spread over [s], gates [rad, rad/s], least speed of a moving crank [rad/s], speeds
# between which a gait is in step [rad/s], commanded speed and largest speed believed [rad/s]
(
    JERK, ANGLE_NOISE, VELOCITY_NOISE, LONGEST, GATE, VELOCITY_GATE, STOP_SPEED, SLOWEST, FASTEST, COMMANDED,
    LARGEST_SPEED,
) = range(11)  # fmt: skip

# counts; those of faults come last
(
    RECEIVED, CRANKS, TORQUES, DUPLICATES, LATE, STRAY, OUTLIERS, VELOCITY_OUTLIERS, GAPS, LOST_TIMES, JUMPS,
    REVERSALS, BRIDGED_NS, STANDING_NS, UNMONITORED_NS, FAULTY,
) = range(16)  # fmt: skip
COUNTS = FAULTY + len(FAULTS)

# stamps and codes: youngest stamp taken in; stamp up to which samples are released, and the kinds released at
# it as bits; the sample that may begin a new time base, 0 if none, and its kind; number of arrivals; ends of
# the queue; last crank sample used, how many were refused since, and the time of the filter; first one
# of this acquisition; last knot;
# since when the leg is not followed; 1 where it is followed, 1 at rest; how long that rest is told; since
# when it is slow; tracking state, since when the speed is within tolerance or out of it, and which of both;
# direction; turns; how many velocities in a row agreed with the angles; shortest
# time between crank samples lately; youngest stamp of each kind
(
    NEWEST, RELEASED, RELEASED_KINDS, CANDIDATE, CANDIDATE_KIND, WAITING, HEAD, TAIL, LAST_CRANK, REFUSED,
    FILTER_TIME, ACQUIRING, LAST_SPLINE_NODE, OUT_SINCE, FOLLOWED, RESTS, RESTED, SLOW_SINCE, TRACKING, SINCE,
    WITHIN, DIRECTION, TURN_COUNT, CREDIT, PERIOD, NEWEST_OF,
) = range(26)  # fmt: skip
CLOCKS = NEWEST_OF + len(KINDS)

# columns of a queued sample: torque; for a crank sample the time since the one before [s], whether that was
# a bridged gap, prediction (3) and its covariance (6: 00 01 02 11 12 22), and for angle and velocity each:
# variance of the innovation (0 unused), innovation, gain (3)
TORQUE_VALUE, STEP, BRIDGED, X, P, BY_ANGLE, BY_VELOCITY = 0, 1, 2, 3, 6, 12, 17
COLUMNS = 22


class TrackerModel(NamedTuple):
    """What does not change: times [ns], and the rest in SI."""

    ns: Ints
    real: Floats


class TrackerState(NamedTuple):
    """All of the tracker; samples wait in ``arrival`` for their order, in ``queue`` for the leg.

    ``filtered`` (9,) the crank's angle, speed and acceleration after the last sample, and their covariance;
    ``target`` (3,) where the leg's crank is at the last knot; ``candidate`` (3,) values of the sample that
    may begin a new time base. An arrival's values are angle, velocity and torque.
    """

    counts: Ints
    clock: Ints
    filtered: Floats
    target: Floats
    candidate: Floats
    arrival_stamp: Ints
    arrival_kind: Ints
    arrival: Floats
    queue_stamp: Ints
    queue_kind: Ints
    queue: Floats


def tracker_model(settings: TrackerSettings) -> TrackerModel:
    """Settings as arrays; noise is that of 200 Hz at any rate, so that the bandwidth is one at any rate."""
    s, w, reference = settings, 2.0 * np.pi * settings.bandwidth_hz, 1.0 / 200.0
    noise = s.encoder_noise_rad**2 * reference
    times = [s.reorder_window_s, s.lag, s.bridge_limit_s, s.mark_gap_s, s.backward_jump_s, s.acquire_s]
    times += [s.stop_hold_s, s.settle_s, 0.2 / s.bandwidth_hz, 0.8 / s.bandwidth_hz]
    speed = abs(s.commanded_speed_radps)
    real = [noise * w**6, noise, s.velocity_noise_radps**2 * reference, 1.0 / w, s.gate_rad]
    real += [s.velocity_gate_radps, s.stop_speed_radps, speed * (1.0 - s.speed_tolerance)]
    real += [speed * (1.0 + s.speed_tolerance), s.commanded_speed_radps, s.largest_speed]
    return TrackerModel(np.array([round(1.0e9 * t) for t in times], dtype=np.int64), np.array(real))


def tracker_state() -> TrackerState:
    """State before the first sample."""
    clock = np.zeros(CLOCKS, dtype=np.int64)
    clock[TRACKING] = 1
    return TrackerState(
        counts=np.zeros(COUNTS, dtype=np.int64),
        clock=clock,
        filtered=np.zeros(9),
        target=np.zeros(3),
        candidate=np.zeros(3),
        arrival_stamp=np.zeros(ARRIVALS, dtype=np.int64),
        arrival_kind=np.zeros(ARRIVALS, dtype=np.int64),
        arrival=np.zeros((ARRIVALS, 3)),
        queue_stamp=np.zeros(QUEUE, dtype=np.int64),
        queue_kind=np.zeros(QUEUE, dtype=np.int64),
        queue=np.zeros((QUEUE, COLUMNS)),
    )

"""The crank tracker's state: what waits, what has been filtered, what was counted."""

from typing import NamedTuple

import numpy as np

from leg_wear_monitor.record import Record, Records, new_records, record_of
from leg_wear_monitor.twin.kinds import KINDS
from leg_wear_monitor.twin.sample import FAULTS, GAIT_SAMPLE
from leg_wear_monitor.twin.settings import TrackerSettings
from leg_wear_monitor.twin.steps import SPLINE_NODE

ARRIVALS, QUEUE = 2048, 4096  # samples that may wait for their order, and for the leg

_NODE_INTERVALS, _RUN_UPS = 0.2, 0.8  # of 1 / bandwidth

TRACKER_MODEL = np.dtype(
    [
        ("reorder_window_ns", "i8"),  # how much later than a younger sample one may come
        ("lag_ns", "i8"),  # time of samples after a spline node
        ("bridge_limit_ns", "i8"),  # longest gap that is bridged
        ("mark_gap_ns", "i8"),  # shortest gap that is counted
        ("backward_jump_ns", "i8"),  # by how much stamps may go back
        ("acquire_ns", "i8"),  # time of samples before the first spline node
        ("stop_hold_ns", "i8"),  # how long a crank is slow before it is at rest
        ("settle_ns", "i8"),  # how long a speed is within tolerance, or beyond, before that counts
        ("node_interval_ns", "i8"),  # least time between spline nodes
        ("run_up_ns", "i8"),  # time for a smooth start from rest
        ("jerk", "f8"),  # power density of the jerk [rad^2/s^5]
        ("angle_noise", "f8"),  # [rad^2 s]
        ("velocity_noise", "f8"),  # [rad^2/s]
        ("longest_spread", "f8"),  # longest time that a sample's noise is spread over [s]
        ("gate", "f8"),  # how far off an angle may be [rad]
        ("velocity_gate", "f8"),  # how far off a velocity may be [rad/s]
        ("stop_speed", "f8"),  # least speed of a moving crank [rad/s]
        ("slowest", "f8"),  # least speed of a gait in step [rad/s]
        ("fastest", "f8"),  # largest speed of a gait in step [rad/s]
        ("commanded_speed", "f8"),  # of the gait [rad/s]
        ("largest_speed", "f8"),  # largest speed believed [rad/s]
    ]
)
"""What does not change: the settings, times in ns and the rest in SI."""

TRACKER_COUNTS = np.dtype(
    [
        # samples
        ("received", "i8"),  # all
        ("used", "i8", (len(KINDS),)),  # with a value of each kind that was used
        ("duplicates", "i8"),  # that were there before
        ("late", "i8"),  # that came after their turn
        ("stray_stamps", "i8"),  # with a stamp that no other sample is near
        ("outliers", "i8"),  # with an angle too far off
        ("velocity_outliers", "i8"),  # with a velocity too far off
        # how often
        ("gaps_bridged", "i8"),  # a gap was bridged
        ("lost", "i8"),  # the crank was lost
        ("backward_jumps", "i8"),  # stamps began anew further back
        ("reversals", "i8"),  # the crank turned back
        # times
        ("bridged_ns", "i8"),  # in bridged gaps
        ("standing_ns", "i8"),  # at rest
        ("unmonitored_ns", "i8"),  # without the leg
        ("faults", "i8", (len(FAULTS),)),  # samples with each fault
    ]
)

TRACKER_CLOCK = np.dtype(
    [
        ("newest_ns", "i8"),  # youngest stamp taken in
        ("newest_of_ns", "i8", (len(KINDS),)),  # youngest stamp of each kind
        ("released_ns", "i8"),  # stamp up to which samples are released
        ("released_kinds", "i8"),  # kinds released at that stamp, a bit each
        ("waiting", "i8"),  # number of arrivals
        ("head", "i8"),  # begin of the queue
        ("tail", "i8"),  # end of the queue
        ("last_crank_ns", "i8"),  # last crank sample used, 0 if none
        ("refused", "i8"),  # crank samples refused since
        ("filter_ns", "i8"),  # time of the estimate
        ("acquiring_ns", "i8"),  # first crank sample of this acquisition
        ("last_node_ns", "i8"),  # last spline node
        ("out_since_ns", "i8"),  # since when the leg does not follow
        ("followed", "i8"),  # 1 where the leg follows
        ("at_rest", "i8"),  # 1 at rest
        ("rested_ns", "i8"),  # up to when that rest is reported
        ("slow_since_ns", "i8"),  # since when the crank is slow, 0 if it is not
        ("tracking", "i8"),  # IS_… of `crank_motion`
        ("tolerance_since_ns", "i8"),  # since when the speed is within tolerance, or beyond
        ("in_tolerance", "i8"),  # which of both: 1 within
        ("direction", "i8"),  # 1 or -1, 0 if not known
        ("turns", "i8"),  # whole turns of the crank, counted apart
        ("velocity_credit", "i8"),  # velocities in a row that agreed with the angles
        ("period_ns", "i8"),  # shortest time between crank samples lately
    ]
)

_ESTIMATE = [
    ("angle", "f8"),  # of the crank [rad]
    ("speed", "f8"),  # [rad/s]
    ("acceleration", "f8"),  # [rad/s^2]
    # covariances of the three
    ("p00", "f8"),  # of the angle [rad^2]
    ("p01", "f8"),  # of angle and speed [rad^2/s]
    ("p02", "f8"),  # of angle and acceleration [rad^2/s^2]
    ("p11", "f8"),  # of the speed [rad^2/s^2]
    ("p12", "f8"),  # of speed and acceleration [rad^2/s^3]
    ("p22", "f8"),  # of the acceleration [rad^2/s^4]
]
CRANK_ESTIMATE = np.dtype(_ESTIMATE)

QUEUED = np.dtype(
    [
        ("stamp_ns", "i8"),  # of its header
        ("kind", "i8"),  # of `twin.sample`
        ("torque", "f8"),  # of the drive [N m], NaN where absent
        # of a crank sample only; arrays of two are those of its angle and of its velocity
        ("step", "f8"),  # time since the crank sample before [s]
        ("bridged", "i8"),  # 1 where that was a bridged gap
        *_ESTIMATE,  # predicted from the samples before
        ("innovation_variance", "f8", (2,)),  # [rad^2, rad^2/s^2]; 0 where it was not used
        ("innovation", "f8", (2,)),  # measured less predicted [rad, rad/s]
        ("gain", "f8", (2, 3)),  # of angle, speed and acceleration, in their units by that of the innovation
    ]
)
"""A sample that waits for the leg, with what the smoother needs of it."""


TRACKER_STATE = np.dtype(
    [
        ("counts", TRACKER_COUNTS),
        ("clock", TRACKER_CLOCK),
        ("estimate", CRANK_ESTIMATE),  # after the last sample
        ("node", SPLINE_NODE),  # where the leg's crank is
        ("ahead", SPLINE_NODE),  # where it goes next, while that is worked out
        ("candidate", GAIT_SAMPLE),  # sample that may begin a new time base, stamp 0 if there is none
    ]
)
"""What does not wait."""


class TrackerState(NamedTuple):
    """All of the tracker, as its kernels see it.

    The fields of `TRACKER_STATE`; ``arrivals`` (ARRIVALS,) of `GAIT_SAMPLE`, that wait for their order;
    ``queue`` (QUEUE,) of `QUEUED`.
    """

    counts: Record
    clock: Record
    estimate: Record
    node: Record
    ahead: Record
    candidate: Record
    arrivals: Records
    queue: Records


def _nanoseconds(time_s: float) -> int:
    return round(1.0e9 * time_s)


def tracker_model(settings: TrackerSettings) -> Records:
    """The settings, one record; noise is that of 200 Hz, and so the bandwidth is one, at any rate."""
    s, w, reference = settings, 2.0 * np.pi * settings.bandwidth_hz, 1.0 / 200.0
    models, speed = new_records(1, TRACKER_MODEL), abs(settings.commanded_speed_radps)
    model = record_of(models)
    model.reorder_window_ns = _nanoseconds(s.reorder_window_s)
    model.lag_ns = _nanoseconds(s.lag)
    model.bridge_limit_ns = _nanoseconds(s.bridge_limit_s)
    model.mark_gap_ns = _nanoseconds(s.mark_gap_s)
    model.backward_jump_ns = _nanoseconds(s.backward_jump_s)
    model.acquire_ns = _nanoseconds(s.acquire_s)
    model.stop_hold_ns = _nanoseconds(s.stop_hold_s)
    model.settle_ns = _nanoseconds(s.settle_s)
    model.node_interval_ns = _nanoseconds(_NODE_INTERVALS / s.bandwidth_hz)
    model.run_up_ns = _nanoseconds(_RUN_UPS / s.bandwidth_hz)
    model.angle_noise = s.encoder_noise_rad**2 * reference
    model.jerk = model.angle_noise * w**6
    model.velocity_noise = s.velocity_noise_radps**2 * reference
    model.longest_spread = 1.0 / w
    model.gate = s.gate_rad
    model.velocity_gate = s.velocity_gate_radps
    model.stop_speed = s.stop_speed_radps
    model.slowest = speed * (1.0 - s.speed_tolerance)
    model.fastest = speed * (1.0 + s.speed_tolerance)
    model.commanded_speed = s.commanded_speed_radps
    model.largest_speed = s.largest_speed
    return models

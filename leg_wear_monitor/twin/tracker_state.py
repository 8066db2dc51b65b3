"""State of the tracker: the samples of the crank's angle that wait, and the motion so far."""

from typing import NamedTuple

import numpy as np

from leg_wear_monitor.compiled.kernel import Record, Records, new_records, record_of
from leg_wear_monitor.twin import KINDS
from leg_wear_monitor.twin.sample import (
    BANDWIDTH_HZ,
    BRIDGE_LIMIT_S,
    FAULTS,
    GAIT_SAMPLE,
    REORDER_WINDOW_S,
    TrackerSettings,
)
from leg_wear_monitor.twin.steps import SPLINE_NODE

# State of the crank tracker: settings, counts, clocks, filter, queues.


ARRIVALS, QUEUE = 2048, 4096  # capacities for samples that wait for their order, and for the leg


def _nanoseconds(time_s: float) -> int:
    return round(1.0e9 * time_s)


# Constants of the tracker. Noise refers to 200 Hz; only the ratio of both noises and, for the gate, the first
# one have an effect.
ANGLE_NOISE, VELOCITY_NOISE = (sigma**2 * (1.0 / 200.0) for sigma in (1.0e-3, 0.05))  # rad^2 s, rad^2/s
VELOCITY_GATE = 0.5  # rad/s, as `GATE_RAD` of the angle
MARK_GAP_NS = 50_000_000  # shortest gap that is counted
BACKWARD_JUMP_NS = 1_000_000_000  # a larger backward jump of stamps begins a new time base
ACQUIRE_NS = 100_000_000  # time for which samples must agree before the leg is set in motion
STOP_HOLD_NS = 300_000_000  # time of slow motion before the crank is at rest
SETTLE_NS = 500_000_000  # time of a speed within tolerance, or beyond, before the state changes
REORDER_WINDOW_NS, BRIDGE_LIMIT_NS = _nanoseconds(REORDER_WINDOW_S), _nanoseconds(BRIDGE_LIMIT_S)
RUN_UP_NS = _nanoseconds(0.8 / BANDWIDTH_HZ)  # time for a smooth start from rest
LONGEST_SPREAD = 1.0 / (2.0 * np.pi * BANDWIDTH_HZ)  # s: longest time that a sample's noise is spread over
JERK = ANGLE_NOISE * (2.0 * np.pi * BANDWIDTH_HZ) ** 6  # rad^2/s^5: power density of the jerk
# a crank is slow below this speed [rad/s], or below this fraction of the commanded speed
_STOP_SPEED, _STOP_FRACTION = 0.1, 0.2

TRACKER_MODEL = np.dtype(
    [
        ("lag_ns", "i8"),  # time of samples after a spline node
        ("node_interval_ns", "i8"),  # least time between spline nodes
        ("stop_speed", "f8"),  # least speed of a moving crank [rad/s]
        ("slowest", "f8"),  # least speed of a gait in step [rad/s]
        ("fastest", "f8"),  # largest speed of a gait in step [rad/s]
        ("commanded_speed", "f8"),  # crank speed of the gait [rad/s]
        ("largest_speed", "f8"),  # largest plausible speed [rad/s]
    ]
)
"""Constants: the settings, with times in ns and everything else in SI units."""

TRACKER_COUNTS = np.dtype(
    [
        # samples
        ("received", "i8"),  # all
        ("used", "i8", (len(KINDS),)),  # with a used value of each kind
        ("duplicates", "i8"),  # repeated
        ("late", "i8"),  # behind the released stamps
        ("stray_stamps", "i8"),  # with a stamp far from all others
        ("outliers", "i8"),  # with an angle beyond the gate
        ("velocity_outliers", "i8"),  # with a velocity beyond the gate
        ("load_outliers", "i8"),  # with a foot load that both neighbours contradict
        # events
        ("gaps_bridged", "i8"),  # bridged gaps
        ("lost", "i8"),  # losses of tracking
        ("backward_jumps", "i8"),  # backward jumps of stamps
        ("reversals", "i8"),  # reversals of the crank
        # times
        ("bridged_ns", "i8"),  # in bridged gaps
        ("standing_ns", "i8"),  # at rest
        ("unmonitored_ns", "i8"),  # without tracking
        ("faults", "i8", (len(FAULTS),)),  # samples with each fault
    ]
)

TRACKER_CLOCK = np.dtype(
    [
        ("newest_ns", "i8"),  # youngest received stamp
        ("newest_of_ns", "i8", (len(KINDS),)),  # youngest stamp of each kind
        ("released_ns", "i8"),  # stamp up to which samples are released
        ("released_kinds", "i8"),  # kinds released at that stamp, as bits
        ("waiting", "i8"),  # number of waiting arrivals
        ("head", "i8"),  # begin of the queue
        ("tail", "i8"),  # end of the queue
        ("last_crank_ns", "i8"),  # stamp of the last used crank sample, 0 if none
        ("refused", "i8"),  # outliers since then
        ("filter_ns", "i8"),  # stamp of the estimate
        ("acquiring_ns", "i8"),  # stamp of the first crank sample since the last loss
        ("last_node_ns", "i8"),  # stamp of the last spline node
        ("out_since_ns", "i8"),  # stamp of the begin of the present loss of tracking
        ("followed", "i8"),  # 1 while the leg is in motion or at rest
        ("at_rest", "i8"),  # 1 at rest
        ("rested_ns", "i8"),  # stamp up to which that rest is reported
        ("slow_since_ns", "i8"),  # stamp of the begin of slow motion, 0 if not slow
        ("tracking", "i8"),  # IS_… of `crank_motion`
        ("tolerance_since_ns", "i8"),  # stamp since which the speed is within tolerance, or beyond
        ("in_tolerance", "i8"),  # 1 within tolerance
        ("direction", "i8"),  # 1 or -1, 0 if unknown
        ("turns", "i8"),  # whole crank turns, counted separately
        ("velocity_credit", "i8"),  # successive velocities that agreed with the angles
        ("period_ns", "i8"),  # shortest recent time between crank samples
        ("foot_force", "f8"),  # largest one of the foot load that a neighbour has, too, in recent turns [N]
    ]
)

_ESTIMATE = [
    ("angle", "f8"),  # crank angle [rad]
    ("speed", "f8"),  # [rad/s]
    ("acceleration", "f8"),  # [rad/s^2]
    # covariances of the three
    ("p00", "f8"),  # angle [rad^2]
    ("p01", "f8"),  # angle and speed [rad^2/s]
    ("p02", "f8"),  # angle and acceleration [rad^2/s^2]
    ("p11", "f8"),  # speed [rad^2/s^2]
    ("p12", "f8"),  # speed and acceleration [rad^2/s^3]
    ("p22", "f8"),  # acceleration [rad^2/s^4]
]
CRANK_ESTIMATE = np.dtype(_ESTIMATE)

QUEUED = np.dtype(
    [
        ("stamp_ns", "i8"),  # stamp of its header
        ("kind", "i8"),  # kind of `twin.sample`
        ("torque", "f8"),  # drive torque [N m], NaN if absent
        ("foot_force", "f8", (2,)),  # foot load [N], only in its samples
        # crank samples only; pairs are angle and velocity
        ("step", "f8"),  # time since the previous crank sample [s]
        ("bridged", "i8"),  # 1 if that is a bridged gap
        *_ESTIMATE,  # predicted from the previous samples
        ("innovation_variance", "f8", (2,)),  # [rad^2, rad^2/s^2]; 0 for an unused value
        ("innovation", "f8", (2,)),  # measured minus predicted [rad, rad/s]
        ("gain", "f8", (2, 3)),  # angle, speed and acceleration per innovation
    ]
)
"""A sample that waits for the leg, with the smoother's data."""


TRACKER_STATE = np.dtype(
    [
        ("counts", TRACKER_COUNTS),
        ("clock", TRACKER_CLOCK),
        ("estimate", CRANK_ESTIMATE),  # after the last sample
        ("node", SPLINE_NODE),  # the last spline node, which the leg has reached
        ("ahead", SPLINE_NODE),  # the next one, during its computation
        ("candidate", GAIT_SAMPLE),  # sample that may begin a new time base, stamp 0 if there is none
    ]
)
"""State of the tracker without its queues."""


class TrackerState(NamedTuple):
    """Complete state of the tracker for its kernels.

    The fields of `TRACKER_STATE`; ``arrivals`` (ARRIVALS,): `GAIT_SAMPLE` that wait for their order;
    ``queue``
    (QUEUE,): `QUEUED` that wait for the leg.
    """

    counts: Record
    clock: Record
    estimate: Record
    node: Record
    ahead: Record
    candidate: Record
    arrivals: Records
    queue: Records


def tracker_model(settings: TrackerSettings) -> Records:
    """The settings as a record."""
    models, speed = new_records(1, TRACKER_MODEL), abs(settings.commanded_speed_radps)
    model = record_of(models)
    model.lag_ns = _nanoseconds(settings.lag_s)
    model.node_interval_ns = _nanoseconds(settings.knot_interval_s)
    model.stop_speed = min(_STOP_SPEED, _STOP_FRACTION * speed)
    model.slowest = speed * (1.0 - settings.speed_tolerance)
    model.fastest = speed * (1.0 + settings.speed_tolerance)
    model.commanded_speed = settings.commanded_speed_radps
    model.largest_speed = settings.largest_speed
    return models

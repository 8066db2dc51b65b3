"""Samples, the kinds and settings of inputs, and accepted inputs: the interface between sensors and twin."""

import math
from collections.abc import Callable, Iterable
from typing import Any

import attrs
import numpy as np
from numpy.typing import ArrayLike, NDArray

from leg_wear_monitor.compiled.kernel import Records, values_of
from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.twin import CRANK, KINDS, LOAD, TORQUE
from leg_wear_monitor.twin.statistics import Intake

# Samples: records of one measurement each, from live topics or from a recording.


Samples = NDArray[Any]
"""Records of `GAIT_SAMPLE`, shape (n,), in order of arrival."""

ENCODERS = 4  # largest number of encoders in addition to the crank's

GAIT_SAMPLE = np.dtype(
    [
        ("stamp_ns", "i8"),
        ("kind", "u1"),
        ("fault", "u1"),
        ("crank_angle_rad", "f8"),
        ("crank_velocity_radps", "f8"),
        ("torque_nm", "f8"),
        ("encoder_rad", "f8", (ENCODERS,)),
        ("foot_force_n", "f8", (2,)),
        ("temperature_c", "f8"),
    ]
)
"""One sample: stamp of the header, kind, fault, and values, NaN where absent.

The angle is the angle of the mechanism's crank, after sign, offset and gear ratio; it may be wrapped to a
turn or be continuous. A crank sample may also contain a torque (``effort``), and the angles of further
encoders in the order of ``encoders.names``, after their signs: NaN where absent, infinite where the value is
no angle. An invalid torque or encoder angle is not a fault of the sample. The force of the ground on the foot
is along the axes of the ground, the second one up, or with ``foot_load.frame: foot`` of the toe's body; a
contact switch gives (0, 1) or (0, 0). The temperature is the drive's, and comes with its torque.
"""

# Faults of a message, found by the conversion. Such a sample is counted and never used.
NO_FAULT, EMPTY, WRONG_LENGTH, MISSING_JOINT, NOT_FINITE, ZERO_STAMP, UNDECODABLE, WRONG_TYPE = range(8)
# A further fault, found by the tracker.
OUT_OF_RANGE = 8
_NAMES = (
    *("none", "empty", "wrong_length", "missing_joint", "not_finite"),
    *("zero_stamp", "undecodable", "wrong_type", "out_of_range"),
)
FAULTS = dict(enumerate(_NAMES))
"""Names of the faults, as used in keys of diagnostics."""


def gait_samples(
    stamp_ns: ArrayLike,
    kind: ArrayLike = CRANK,
    *,
    crank_angle_rad: ArrayLike = np.nan,
    crank_velocity_radps: ArrayLike = np.nan,
    torque_nm: ArrayLike = np.nan,
    encoder_rad: ArrayLike = np.nan,
    foot_force_n: ArrayLike = np.nan,
    temperature_c: ArrayLike = np.nan,
    fault: ArrayLike = NO_FAULT,
) -> Samples:
    """A block of samples for `WearMonitor.update`, from arrays in order of arrival.

    For a whole recording, `replay` takes arrays and data frames directly.

    Parameters
    ----------
    stamp_ns : (n,) array of int
        Times of measurement [ns].
    kind : (n,) array or int
        0 for a sample of the crank, which may contain a torque as well; 1 for a sample of the drive torque
        alone; 2 for a sample of the foot load.
    crank_angle_rad, crank_velocity_radps, torque_nm : (n,) array or float
        Angle and speed of the mechanism's crank [rad, rad/s], drive torque on the crank [N m]; NaN where
        absent.
    encoder_rad : (n, m) array or float
        Angles of m further encoders [rad], at most 4, in the order of ``encoders.names``.
    foot_force_n : (n, 2) array or float
        Force of the ground on the foot [N].
    temperature_c : (n,) array or float
        Temperature of the drive, with its torque [°C].
    fault : (n,) array or int
        0 for a valid sample; others are counted and not used.

    Returns
    -------
    (n,) structured array

    Raises
    ------
    LegWearError
        For an unknown kind or fault, or for stamps that are not integers.

    Examples
    --------
    >>> import leg_wear_monitor as lw
    >>> samples = lw.gait_samples([0, 5_000_000], crank_angle_rad=[0.1, 0.13], torque_nm=[2.5, 2.4])
    >>> samples["torque_nm"].tolist()
    [2.5, 2.4]
    """
    stamps = np.atleast_1d(np.asarray(stamp_ns))
    if stamps.dtype.kind not in "iu":
        raise LegWearError(f"stamp_ns: {stamps.dtype} is not an integer type. Expected nanoseconds as int64")
    block = np.empty(len(stamps), GAIT_SAMPLE)
    kinds = {code: each.name for code, each in KINDS.items()}
    for name, value, known in (("kind", kind, kinds), ("fault", fault, FAULTS)):
        codes = np.asarray(value)
        if not np.isin(codes, list(known)).all():
            raise LegWearError(f"{name}: {codes[~np.isin(codes, list(known))].flat[0]} is none of {known}")
        block[name] = codes
    block["stamp_ns"] = stamps
    block["crank_angle_rad"] = crank_angle_rad
    block["crank_velocity_radps"] = crank_velocity_radps
    block["torque_nm"] = torque_nm
    angles = np.asarray(encoder_rad, dtype=float)
    block["encoder_rad"] = np.nan
    block["encoder_rad"][:, : angles.shape[-1] if angles.ndim else None] = angles
    block["foot_force_n"] = foot_force_n
    block["temperature_c"] = temperature_c
    return block


def has_value_of(samples: Samples, kind: int) -> NDArray[np.bool_]:
    """Mask (n,) of the samples that contain a value of a kind, alone or with other values."""
    return np.asarray((samples["kind"] == kind) | np.isfinite(samples[KINDS[kind].value]))


# Settings of the twin; `monitor.config` declares and checks them as parameters.


SAMPLINGS = AVERAGE, INSTANT = "average", "instant"
LOAD_SOURCES = NO_LOAD, WRENCH, FLOAT64, CONTACT = "none", "wrench", "float64", "contact"
LOAD_FRAMES = GROUND_FRAME, FOOT_FRAME = "ground", "foot"
LOAD_MODELS = NONE, GROUND, MEASURED = "none", "ground", "measured"

GATE_RAD = 0.1  # an angle is an outlier if it deviates from its prediction by this much more than its scatter
LOADS_N = 0.0, 1000.0  # least and largest foot load by the drive torque: the ground pushes, and does not pull


BRIDGE_LIMIT_S = 0.5
"""Longest gap that the tracker bridges at the tracked speed: half a gait cycle at 60 rpm."""

BANDWIDTH_HZ = 8.0  # bandwidth of the tracked crank motion; faster changes are treated as noise
# Largest delay of a sample behind younger samples of its kind. If a whole kind is late, the tracker waits for
# it up to the bridged gap.
REORDER_WINDOW_S = 0.02


@attrs.frozen(kw_only=True)
class TrackerSettings:
    """Settings of the crank tracker.

    Attributes
    ----------
    commanded_speed_radps : float
        Crank speed of the commanded gait, 60 rpm by default: initial guess of the speed, reference for
        `speed_tolerance`.
    speed_tolerance : float
        Largest deviation of a speed in step, as a fraction of the commanded speed.
    lag_s : float
        Delay of the leg behind the newest sample, for smoothing by later samples.
    knot_interval_s : float
        Least time between two spline nodes of the leg's motion: a sample waits for the first node after it.
    """

    commanded_speed_radps: float = 2.0 * math.pi
    speed_tolerance: float = 0.2
    lag_s: float = 0.8 / BANDWIDTH_HZ
    knot_interval_s: float = 0.2 / BANDWIDTH_HZ

    @property
    def largest_speed(self) -> float:
        """The largest plausible crank speed [rad/s]; tracking is lost above, or above its square per s."""
        return 3.0 * abs(self.commanded_speed_radps)


@attrs.frozen(kw_only=True)
class TwinSettings:
    """Settings of the twin.

    Attributes
    ----------
    tracker : TrackerSettings
    wear_acceleration : float
        Factor on all wear coefficients, for demonstrations; 1 for the material's coefficients.
    estimate_load : bool
        True if the estimated foot load acts on the model; it is estimated in any case.
    load_source, load_frame : str
        Source of the foot load samples, or ``none``; axes of the samples.
    load_model : str
        ``measured``: the mean of the samples acts; otherwise a load that the torque shows, of the shape of a
        person's stance.
    torque_lag_s : float
        Declared lag of the torque.
    torque_sampling : str
        Meaning of a torque sample: ``average``, the mean since the previous sample; ``instant``, the value at
        the stamp.
    """

    tracker: TrackerSettings = attrs.field(factory=TrackerSettings)
    wear_acceleration: float = 1.0
    estimate_load: bool = True
    load_source: str = NO_LOAD
    load_frame: str = GROUND_FRAME
    load_model: str = NONE
    torque_lag_s: float = 0.0
    torque_sampling: str = AVERAGE

    @property
    def kinds(self) -> tuple[int, ...]:
        """Kinds of samples that are read."""
        return (CRANK, TORQUE) if self.load_source == NO_LOAD else (CRANK, TORQUE, LOAD)


# Counts of samples and times from the state of tracker and follower.


_SAME = (
    *("received", "duplicates", "late", "stray_stamps", "outliers", "velocity_outliers", "load_outliers"),
    *("gaps_bridged", "lost", "backward_jumps", "reversals"),
)  # counts of the tracker by the same names


def intake(tracker: Records, leg: Records, kinds: Iterable[int] = KINDS) -> Intake:
    """Counts of a tracker's `TRACKER_STATE` and a follower's `LEG_STATE`, of the kinds that are read."""
    count, clock = values_of(tracker["counts"]), values_of(tracker["clock"])
    motion = values_of(leg["motion"])
    out = clock["out_since_ns"] != 0 and not clock["followed"]
    return Intake(
        **{name: count[name] for name in _SAME},
        faulty={name: int(count["faults"][fault]) for fault, name in FAULTS.items() if fault != NO_FAULT},
        used={KINDS[code].name: int(count["used"][code]) for code in kinds},
        failures=motion["failures"],
        bridged_s=count["bridged_ns"] * 1.0e-9,
        moving_s=motion["moving_ns"] * 1.0e-9,
        standing_s=count["standing_ns"] * 1.0e-9,
        unmonitored_s=(count["unmonitored_ns"] + motion["failed_ns"]) * 1.0e-9,
        out_s=(clock["released_ns"] - clock["out_since_ns"]) * 1.0e-9 if out else 0.0,
        newest_stamp_ns=clock["newest_ns"],
        followed_stamp_ns=clock["last_node_ns"],
    )


# Samples that are kept until their gait cycle ends.


_MOST = 20_000  # samples of each kind: ten seconds at 2 kHz


class KeepsSamples:
    """Base of an observer that evaluates whole gait cycles.

    ``state.samples`` holds the stored samples, ``state.due`` the starts and ends of the cycles still to
    evaluate.
    """

    state: Any

    def add_samples(self, piece: Samples) -> None:
        """Add samples in the order of arrival."""
        self.state.samples = self.state.samples.extended(piece)

    def evaluate_due(self, evaluate: Callable[[int, int], object]) -> bool:
        """Evaluate the gait cycles that ended, and forget their samples; whether there were any."""
        state = self.state
        for begin_ns, end_ns in state.due:
            evaluate(begin_ns, end_ns)
        state.samples = state.samples.after(state.due[-1][1] if state.due else 0)
        ended, state.due = bool(state.due), ()
        return ended


def of_crank(piece: Samples) -> Samples:
    """Samples of the crank that have a possible angle."""
    is_possible = np.abs(piece["crank_angle_rad"]) <= KINDS[CRANK].largest
    crank: Samples = piece[(piece["kind"] == CRANK) & is_valid(piece) & is_possible]
    return crank


def is_valid(piece: Samples) -> NDArray[np.bool_]:
    """Mask (n,) of the samples without a fault, with a stamp."""
    return np.asarray((piece["fault"] == NO_FAULT) & (piece["stamp_ns"] > 0))


def newest(kept: Samples, since_ns: int) -> Samples:
    """Samples from a stamp on, of the last ten seconds at 2 kHz at most."""
    found: Samples = kept[kept["stamp_ns"] >= since_ns][-_MOST:]
    return found


def within(kept: Samples, begin_ns: int, end_ns: int) -> Samples:
    """Samples between two stamps, in order; only the first sample of equal stamps."""
    stamp_ns, first = np.unique(kept["stamp_ns"], return_index=True)
    found: Samples = kept[first[(stamp_ns >= begin_ns) & (stamp_ns < end_ns)]]
    return found

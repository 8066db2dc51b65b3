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
    """Mask (n,) of the samples of a kind with a single value, and of others that contain such a value."""
    return np.asarray((samples["kind"] == kind) | np.isfinite(samples[KINDS[kind].value]))


# Settings of the twin; `monitor.config` declares them as parameters with units and bounds.


FOREVER = 1.0e9

_FROM_ZERO = ("lag_s", "knot_interval_s", "reorder_window_s", "largest_speed_radps")

SAMPLINGS = AVERAGE, INSTANT = "average", "instant"
LOAD_SOURCES = NO_LOAD, WRENCH, FLOAT64, CONTACT = "none", "wrench", "float64", "contact"
LOAD_FRAMES = GROUND_FRAME, FOOT_FRAME = "ground", "foot"
LOAD_MODELS = NONE, GROUND, MEASURED = "none", "ground", "measured"
STANCE, CONSTANT = "stance", "constant"
LOAD_SHAPES = STANCE, GROUND, CONSTANT


BRIDGE_LIMIT_S = 0.5
"""Longest gap that the tracker bridges at the tracked speed: half a gait cycle at 60 rpm."""


@attrs.frozen(kw_only=True)
class TrackerSettings:
    """Settings of the crank tracker.

    Attributes
    ----------
    commanded_speed_radps : float
        Crank speed of the commanded gait, 60 rpm by default: initial guess of the speed, reference for
        `speed_tolerance`.
    bandwidth_hz : float
        Bandwidth of the tracked crank motion; faster changes are treated as noise.
    encoder_noise_rad, velocity_noise_radps : float
        Standard deviations at 200 Hz; only their ratio and, for the gate, the first one have an effect.
    gate_rad, velocity_gate_radps : float
        A sample is an outlier if its deviation from the prediction exceeds this plus five standard deviations
        of the prediction.
    reorder_window_s : float
        Largest delay of a sample behind younger samples of its kind. If a whole kind is late, the tracker
        waits for it up to `bridge_limit_s`.
    lag_s : float
        Delay of the leg behind the newest sample, for smoothing by later samples; 0 selects
        0.8 / bandwidth_hz.
    knot_interval_s : float
        Least time between two spline nodes of the leg's motion: a sample waits for the first node after it;
        0 selects 0.2 / bandwidth_hz.
    bridge_limit_s : float
        Longest gap that is bridged; in a longer one, tracking is lost.
    mark_gap_s : float
        Bridged gaps longer than this and than two periods of the samples are counted.
    backward_jump_s : float
        A backward jump of the stamps by more than this starts a new time base.
    acquire_s : float
        Time for which samples must agree before the leg is set in motion.
    largest_speed_radps : float
        Tracking is lost at a higher crank speed, or at an acceleration above its square; 0 selects three
        times the commanded speed.
    stop_speed_radps, stop_hold_s : float
        A crank slower than this, or than a fifth of the commanded speed, for this time has stopped.
    speed_tolerance : float
        Largest deviation of a speed in step, as a fraction of the commanded speed.
    settle_s : float
        Time for which the speed must be within (or beyond) the tolerance to be in (or out of) step.
    """

    commanded_speed_radps: float = 2.0 * math.pi
    bandwidth_hz: float = 8.0
    encoder_noise_rad: float = 1.0e-3
    velocity_noise_radps: float = 0.05
    gate_rad: float = 0.1
    velocity_gate_radps: float = 0.5
    reorder_window_s: float = 0.02
    lag_s: float = 0.0
    knot_interval_s: float = 0.0
    bridge_limit_s: float = BRIDGE_LIMIT_S
    mark_gap_s: float = 0.05
    backward_jump_s: float = 1.0
    acquire_s: float = 0.1
    largest_speed_radps: float = 0.0
    stop_speed_radps: float = 0.1
    stop_hold_s: float = 0.3
    speed_tolerance: float = 0.2
    settle_s: float = 0.5

    def __attrs_post_init__(self) -> None:
        for name, value in attrs.asdict(self).items():
            free = name in _FROM_ZERO or name == "commanded_speed_radps"
            if not (math.isfinite(value) and abs(value) < FOREVER and (free or value > 0.0)):
                raise LegWearError(f"{name}: {value} is not a finite number above 0")
            if name in _FROM_ZERO and value < 0.0:
                raise LegWearError(f"{name}: {value} is below 0")
        if self.commanded_speed_radps == 0.0:
            raise LegWearError("commanded_speed_radps: 0.0 does not turn the crank")
        if not 1.0 <= self.bandwidth_hz <= 100.0:
            raise LegWearError(f"bandwidth_hz: {self.bandwidth_hz} is not from 1 to 100 Hz")
        if not self.reorder_window_s < min(self.backward_jump_s, self.bridge_limit_s):
            raise LegWearError("reorder_window_s: expected below backward_jump_s and bridge_limit_s")

    @property
    def largest_speed(self) -> float:
        """The largest plausible crank speed [rad/s]."""
        return self.largest_speed_radps or 3.0 * abs(self.commanded_speed_radps)

    @property
    def stop_speed(self) -> float:
        """The speed in use below which a crank has stopped [rad/s]."""
        return min(self.stop_speed_radps, 0.2 * abs(self.commanded_speed_radps))

    @property
    def lag(self) -> float:
        """The lag in use [s]."""
        return self.lag_s or 0.8 / self.bandwidth_hz

    @property
    def node_interval(self) -> float:
        """The least time between spline nodes in use [s]."""
        return self.knot_interval_s or 0.2 / self.bandwidth_hz


@attrs.frozen(kw_only=True)
class TwinSettings:
    """Settings of the twin.

    Attributes
    ----------
    tracker : TrackerSettings
    clearance_joints : tuple of str, optional
        The clearance joints; default: all clearance joints of the mechanism (A, B, G, I, J of the bionic
        leg).
    wear_acceleration : float
        Factor on all wear coefficients, for demonstrations; 1 for the material's coefficients.
    torque_bandwidth_hz : float
        Bandwidth of the low-pass filter of measured and predicted torque before their comparison.
    estimate_load : bool
        Whether the estimated foot load acts on the model; it is estimated in any case.
    load_shape : str
        ``stance``: ground force in proportion to the toe's depth below its mean height; ``ground``: the
        template of a person's stance; ``constant``: a constant weight. With the `load_model` ``none``,
        ``stance`` turns to ``ground`` where that explains much more of the torque.
    load_limit_n : float
        Largest plausible foot load [N].
    load_source, load_frame : str
        Source of the foot load samples, or ``none``; axes of the samples.
    load_model : str
        Load that acts: ``measured``, the load of the samples at their times; else see `estimate_load`.
    torque_lag_s : float
        Declared lag of the torque.
    torque_sampling : str
        Meaning of a torque sample: ``average``, the mean since the previous sample; ``instant``, the value at
        the stamp.
    """

    tracker: TrackerSettings = attrs.field(factory=TrackerSettings)
    clearance_joints: tuple[str, ...] | None = None
    wear_acceleration: float = 1.0
    torque_bandwidth_hz: float = 10.0
    estimate_load: bool = True
    load_shape: str = STANCE
    load_limit_n: float = 1000.0
    load_source: str = NO_LOAD
    load_frame: str = GROUND_FRAME
    load_model: str = NONE
    torque_lag_s: float = 0.0
    torque_sampling: str = AVERAGE

    def __attrs_post_init__(self) -> None:
        for name in ("wear_acceleration", "torque_bandwidth_hz", "load_limit_n"):
            value = getattr(self, name)
            if not (math.isfinite(value) and (value > 0.0 or (name == "wear_acceleration" and value == 0.0))):
                raise LegWearError(f"{name}: {value} is not a finite number above 0")
        if self.torque_sampling not in SAMPLINGS:
            fault = f"{self.torque_sampling!r} is not one of {', '.join(SAMPLINGS)}"
            raise LegWearError(f"torque_sampling: {fault}")
        for name, known in (
            ("load_shape", LOAD_SHAPES),
            ("load_source", LOAD_SOURCES),
            ("load_frame", LOAD_FRAMES),
            ("load_model", LOAD_MODELS),
        ):
            if getattr(self, name) not in known:
                raise LegWearError(f"{name}: {getattr(self, name)!r} is not one of {', '.join(known)}")
        if self.load_model == MEASURED and self.load_source in (NO_LOAD, CONTACT):
            raise LegWearError(f"load_model: {MEASURED!r} needs forces, not load_source {self.load_source!r}")

    @property
    def kinds(self) -> tuple[int, ...]:
        """Kinds of samples that are read."""
        return (CRANK, TORQUE) if self.load_source == NO_LOAD else (CRANK, TORQUE, LOAD)

    @property
    def loads_n(self) -> tuple[float, float]:
        """Bounds of the foot load [N]: the ground pushes and does not pull."""
        return (-self.load_limit_n if self.load_shape == CONSTANT else 0.0), self.load_limit_n


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

"""Settings of the twin; `monitor.config` declares them as parameters with units and bounds."""

import math

import attrs

from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.twin.kinds import CRANK, LOAD, TORQUE

FOREVER = 1.0e9

_FROM_ZERO = ("lag_s", "node_interval_s", "reorder_window_s", "largest_speed_radps")

SAMPLINGS = AVERAGE, INSTANT = "average", "instant"
LOAD_SOURCES = NO_LOAD, WRENCH, FLOAT64, CONTACT = "none", "wrench", "float64", "contact"
LOAD_FRAMES = GROUND_FRAME, FOOT_FRAME = "ground", "foot"
LOAD_MODELS = NONE, GROUND, MEASURED = "none", "ground", "measured"
STANCE, CONSTANT = "stance", "constant"
LOAD_SHAPES = STANCE, GROUND, CONSTANT


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
    node_interval_s : float
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
        A crank slower than this for this time has stopped.
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
    node_interval_s: float = 0.0
    bridge_limit_s: float = 0.5
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
    def lag(self) -> float:
        """The lag in use [s]."""
        return self.lag_s or 0.8 / self.bandwidth_hz

    @property
    def node_interval(self) -> float:
        """The least time between spline nodes in use [s]."""
        return self.node_interval_s or 0.2 / self.bandwidth_hz


@attrs.frozen(kw_only=True)
class TwinSettings:
    """Settings of the twin.

    Attributes
    ----------
    tracker : TrackerSettings
    clearance_joints : tuple of str, optional
        The clearance joints; default: those of the mechanism (A, B, G, I, J of the bionic leg).
    wear_acceleration : float
        Factor on all wear coefficients, for demonstrations; 1 for the material's own.
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
        Samples of the foot load: ``none``, or what gives them; along which axes.
    load_model : str
        Load that acts: ``measured``, that of the samples at their times; else see `estimate_load`.
    torque_lag_s : float
        Lag of the torque as declared.
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

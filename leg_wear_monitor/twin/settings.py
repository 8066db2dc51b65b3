"""What can be set of the twin; the monitor declares them as parameters, with units and bounds."""

import math

import attrs

from leg_wear_monitor.errors import LegWearError

FOREVER = 1.0e9

_FROM_ZERO = ("lag_s", "reorder_window_s", "largest_speed_radps")

SAMPLINGS = AVERAGE, INSTANT = "average", "instant"
LOAD_SHAPES = STANCE, CONSTANT = "stance", "constant"


@attrs.frozen(kw_only=True)
class TrackerSettings:
    """How the crank's motion is taken from samples.

    Attributes
    ----------
    commanded_speed_radps : float
        Of the commanded gait, 60 rpm by default: first guess of the speed, and what *in step* means.
    bandwidth_hz : float
        Changes of the crank's motion up to about this frequency are followed, faster ones are noise.
    encoder_noise_rad, velocity_noise_radps : float
        Standard deviations at 200 Hz; what counts is their ratio, and the first for the gate.
    gate_rad, velocity_gate_radps : float
        A sample further from what was predicted is an outlier, beyond five standard deviations of the
        prediction.
    reorder_window_s : float
        How much later than younger samples of its kind a sample may arrive. A kind that comes later as a
        whole is waited for, up to `bridge_limit_s`.
    lag_s : float
        How far the leg follows behind the newest sample, so that samples on both sides say how the crank
        moved; 0 means what the bandwidth asks for (0.8 / bandwidth_hz).
    bridge_limit_s : float
        Gaps up to this are bridged, and counted if they are longer than `mark_gap_s` and two periods of the
        samples; the crank is lost in longer ones.
    mark_gap_s : float
    backward_jump_s : float
        Stamps that go back by more than this start a new time base.
    acquire_s : float
        How long samples must agree before the leg is set in motion.
    largest_speed_radps : float
        No leg's crank is faster; a crank that seems so, or to change as fast as that, is lost. 0 means three
        times the commanded speed.
    stop_speed_radps, stop_hold_s : float
        A crank slower than this for so long has stopped.
    speed_tolerance : float
        Share of the commanded speed by which a gait in step may be off.
    settle_s : float
        How long the speed must be within (or beyond) tolerance to be in step (or out of it).
    """

    commanded_speed_radps: float = 2.0 * math.pi
    bandwidth_hz: float = 8.0
    encoder_noise_rad: float = 1.0e-3
    velocity_noise_radps: float = 0.05
    gate_rad: float = 0.1
    velocity_gate_radps: float = 0.5
    reorder_window_s: float = 0.02
    lag_s: float = 0.0
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
        """The largest speed believed [rad/s]."""
        return self.largest_speed_radps or 3.0 * abs(self.commanded_speed_radps)

    @property
    def lag(self) -> float:
        """The lag in use [s]."""
        return self.lag_s or 0.8 / self.bandwidth_hz


@attrs.frozen(kw_only=True)
class TwinSettings:
    """How the leg is followed.

    Attributes
    ----------
    tracker : TrackerSettings
    clearance_joints : tuple of str, optional
        The clearance joints; the mechanism's own if not given (A, B, G, I, J of the bionic leg).
    wear_acceleration : float
        Factor on all wear coefficients, for demonstrations; 1 is the material's own.
    torque_bandwidth_hz : float
        Of the low-pass that measured and predicted torque both go through before they are compared.
    estimate_load : bool
        Whether the foot load that measured torque shows acts on the leg; it is estimated in any case.
    load_shape : str
        ``stance``: the ground's push, in proportion to the toe's depth below its mean height; ``constant``: a
        weight that it carries.
    load_limit_n : float
        Largest foot load believed [N].
    torque_sampling : str
        What a torque sample is: ``average``, the mean since the sample before; ``instant``, the value then.
    """

    tracker: TrackerSettings = attrs.field(factory=TrackerSettings)
    clearance_joints: tuple[str, ...] | None = None
    wear_acceleration: float = 1.0
    torque_bandwidth_hz: float = 10.0
    estimate_load: bool = True
    load_shape: str = STANCE
    load_limit_n: float = 1000.0
    torque_sampling: str = AVERAGE

    def __attrs_post_init__(self) -> None:
        for name in ("wear_acceleration", "torque_bandwidth_hz", "load_limit_n"):
            value = getattr(self, name)
            if not (math.isfinite(value) and (value > 0.0 or (name == "wear_acceleration" and value == 0.0))):
                raise LegWearError(f"{name}: {value} is not a finite number above 0")
        if self.torque_sampling not in SAMPLINGS:
            fault = f"{self.torque_sampling!r} is not one of {', '.join(SAMPLINGS)}"
            raise LegWearError(f"torque_sampling: {fault}")
        if self.load_shape not in LOAD_SHAPES:
            raise LegWearError(f"load_shape: {self.load_shape!r} is not one of {', '.join(LOAD_SHAPES)}")

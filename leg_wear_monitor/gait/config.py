"""Every parameter of the synthetic leg: default, unit, bounds and meaning, declared once."""

from functools import partial
from itertools import pairwise
from typing import Any

import attrs

from leg_wear_monitor.configuration import FieldError, choice, described, quantity
from leg_wear_monitor.mechanism.person import FORE_AFT

# Values of parameters: where a torque or a foot load is published, how a torque is sampled, and the shape of
# the ground's force.
WRENCH, EFFORT, FLOAT64 = TORQUE_SOURCES = ("wrench", "effort", "float64")
NO_LOAD, CONTACT = "none", "contact"
LOAD_SOURCES = (NO_LOAD, WRENCH, FLOAT64, CONTACT)
AVERAGE, INSTANT = SAMPLINGS = ("average", "instant")
TEMPLATE, TREADMILL = GROUND_SHAPES = ("template", "treadmill")


def _not_negative(unit: str, doc: str, default: Any = 0.0, at_most: float | None = None) -> Any:
    return quantity(unit, doc, at_least=0.0, at_most=at_most, default=default)


_fraction = partial(_not_negative, "", at_most=1.0)


def _rises_from_zero(times: tuple[float, ...]) -> str | None:
    if times and times[0] == 0.0 and all(a < b for a, b in pairwise(times)):
        return None
    return f"{list(times)} does not increase from 0 s"


@attrs.frozen(kw_only=True)
class PaceConfig:
    """Speeds of the crank over time, with a ripple."""

    times_s: tuple[float, ...] = quantity(
        "s", "times at which the speeds are set, the first at 0", default=(0.0,), check=_rises_from_zero
    )
    speeds_rpm: tuple[float, ...] = quantity(
        "rpm",
        "speeds, one per time; at 0 the leg stands, below 0 the crank turns clockwise",
        default=(60.0,),
    )
    ramp_s: float = quantity("s", "duration of a change of speed", above=0.0, default=0.5)
    ripple: float = _fraction("speed ripple, as a fraction of the speed", at_most=0.9)

    def __attrs_post_init__(self) -> None:
        if len(self.speeds_rpm) != len(self.times_s):
            fault = f"has {len(self.speeds_rpm)} speeds for {len(self.times_s)} times. Expected one each"
            raise FieldError("speeds_rpm", fault)
        if any(b - a < self.ramp_s for a, b in pairwise(self.times_s)):
            raise FieldError("ramp_s", f"{self.ramp_s!r} s is longer than the time between two speeds")


@attrs.frozen(kw_only=True)
class EncoderConfig:
    """The crank's encoder."""

    rate_hz: float = quantity("Hz", "messages per second", above=0.0, at_most=10000.0, default=200.0)
    noise_rad: float = _not_negative("rad", "noise of the angle, standard deviation", 1.0e-3)
    velocity_noise_radps: float = _not_negative("rad/s", "noise of the velocity, standard deviation", 0.05)
    counts_per_turn: float = _not_negative(
        "", "steps of the angle per turn; 0 for a continuous angle", 16384.0
    )
    offset_rad: float = quantity("rad", "reading at crank angle 0", default=0.0)
    wrapped: bool = described("wrap the angle to a turn; otherwise it is continuous", default=False)


@attrs.frozen(kw_only=True)
class TorqueSensorConfig:
    """The drive's torque sensor."""

    source: str = choice(
        TORQUE_SOURCES,
        "message with the torque: WrenchStamped, Float64, or the effort of the crank in joint_states",
        default="wrench",
    )
    rate_hz: float = quantity("Hz", "messages per second", above=0.0, at_most=10000.0, default=200.0)
    sampling: str = choice(
        SAMPLINGS,
        "average: a reading is the mean since the previous reading; instant: the torque at its stamp",
        default=AVERAGE,
    )
    noise_nm: float = _not_negative("N m", "noise, standard deviation", 0.05)
    resolution_nm: float = _not_negative("N m", "step of the reading, 0 for none", 0.01)


@attrs.frozen(kw_only=True)
class FootLoadSensorConfig:
    """A sensor of the ground's force on the foot."""

    source: str = choice(
        LOAD_SOURCES,
        "none, or the message: WrenchStamped, Float64 (the vertical force), or contact, a Bool",
        default=NO_LOAD,
    )
    rate_hz: float = quantity("Hz", "messages per second", above=0.0, at_most=10000.0, default=200.0)
    noise_n: float = _not_negative("N", "noise of each component, standard deviation", 1.0)
    silent_from_s: float = _not_negative("s", "time after which no message is sent; 0 for never")


@attrs.frozen(kw_only=True)
class TransportConfig:
    """Faults of the messages between a sensor and the monitor."""

    jitter_s: float = _not_negative("s", "jitter of the sampling time, standard deviation", 1.0e-4)
    drop_fraction: float = _fraction("fraction of messages that are lost")
    duplicate_fraction: float = _fraction("fraction of messages that arrive twice")
    late_fraction: float = _fraction("fraction of messages that arrive late, after newer ones")
    late_s: float = _not_negative("s", "delay of late messages", 0.02)
    fault_fraction: float = _fraction("fraction of messages that are malformed, with alternating faults")
    gaps_s: tuple[float, ...] = _not_negative("s", "start times of gaps without messages", ())
    gap_s: float = _not_negative("s", "length of a gap", 0.5)


@attrs.frozen(kw_only=True)
class LoadConfig:
    """Loads and friction without a message: the monitor has to estimate them from the torque."""

    friction_nm: float = _not_negative("N m", "friction of the drive, against its motion")
    person_kg: float = _not_negative(
        "kg", "mass of a person with one leg strapped to thigh, shank and foot", at_most=300.0
    )
    ground_n: float = _not_negative(
        "N", "largest vertical force of the ground on the toe in stance, mean over steps; 0 in the air"
    )
    fore_aft: float = _fraction(
        "largest fore-aft force of the ground, as a fraction of the largest vertical force", FORE_AFT
    )
    shape: str = choice(
        GROUND_SHAPES,
        "shape of the ground's force: the monitor's template of stance, or a measured stance on a treadmill",
        default=TEMPLATE,
    )
    amplitude_scatter: float = _fraction(
        "standard deviation of the ground's force from step to step, as a fraction of its mean",
        0.1,
        at_most=0.3,
    )
    timing_scatter: float = _fraction(
        "standard deviation of the stance's time from step to step, in gait cycles", 0.02, at_most=0.1
    )
    heel_strike_transient: float = _fraction(
        "peak of 20 ms that the heel strike adds to the vertical force, as a fraction of its largest value",
        at_most=3.0,
    )


@attrs.frozen(kw_only=True)
class KnockConfig:
    """A bushing that breaks: the joint's clearance changes at an instant."""

    joint: str = described("joint that breaks; if empty, none", default="")
    at_s: float = _not_negative("s", "time of the break", 5.0)
    clearance_m: float = quantity("m", "radial clearance after the break", above=0.0, default=1.0e-3)


@attrs.frozen(kw_only=True)
class GaitConfig:
    """The synthetic leg."""

    mechanism: str = described(
        "mechanism file, or the name of one that comes with the package", default="bionic_leg"
    )
    seed: int = quantity("", "seed of all noise; equal seeds give equal data", at_least=0, default=0)
    duration_s: float = _not_negative("s", "duration of the gait, 0 for no end")
    clearance_joints: tuple[str, ...] = described(
        "clearance joints; if empty, the joints in the mechanism file", default=()
    )
    clearances_m: tuple[float, ...] = quantity(
        "m",
        "radial clearances of the clearance joints; if empty, the joints in the mechanism file",
        above=0.0,
        default=(),
    )
    wear_acceleration: float = _not_negative("", "factor on all wear coefficients", 1.0)
    pace: PaceConfig = described("speed of the crank", factory=PaceConfig)
    encoder: EncoderConfig = described("the crank's encoder", factory=EncoderConfig)
    torque_sensor: TorqueSensorConfig = described(
        "the torque sensor of the drive", factory=TorqueSensorConfig
    )
    foot_load_sensor: FootLoadSensorConfig = described(
        "a sensor of the ground's force on the foot", factory=FootLoadSensorConfig
    )
    transport: TransportConfig = described("faults of the transport", factory=TransportConfig)
    load: LoadConfig = described("loads that the monitor has to estimate", factory=LoadConfig)
    knock: KnockConfig = described("a bushing that breaks", factory=KnockConfig)

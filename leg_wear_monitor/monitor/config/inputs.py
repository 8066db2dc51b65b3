"""Parameters of the inputs: crank, further encoders, drive torque, gait, tracker."""

import math
from functools import partial
from typing import Any

import attrs

from leg_wear_monitor.configuration import FieldError, choice, described, quantity
from leg_wear_monitor.twin import sample

LIVE = {"live": True}  # may change while the monitor runs
live_quantity = partial(quantity, metadata=LIVE)

# Largest delay of the measured torque, late or early, in addition to the declared lag and low-pass of the
# drive. A larger delay may be a wrong crank.offset_rad: 5 ms look like 31 mrad at 60 rpm.
MAX_LAG_S = 0.005

TORQUE_SOURCES = WRENCH, FLOAT64, EFFORT, INTERFACE = ("wrench", "float64", "effort", "interface")
KNOWN, AT_START = ZEROS = ("known", "at_start")


LEAST_RPM = 0.1  # ten minutes a gait cycle: nothing that walks is slower


def _is_slow(rpm: float) -> str:
    cycle, meant = 60.0 / abs(rpm), rpm * 30.0 / math.pi
    return f"{rpm:g} rpm is {cycle:.3g} s per gait cycle. Is it in rad/s? {rpm:g} rad/s is {meant:.4g} rpm"


def _turns(speed: float) -> str | None:
    if abs(speed) >= LEAST_RPM:
        return None
    return f"{speed!r} rpm does not turn the crank. Expected a speed of at least {LEAST_RPM:g} rpm either way"


def _one_way_or_other(number: float) -> str | None:
    return None if number in (-1, 1) else f"{number!r} is not one of 1, -1"


def _sign(doc: str) -> Any:
    return described(doc, default=1, check=_one_way_or_other)


@attrs.frozen(kw_only=True)
class Crank:
    """Conversion of a joint's position to the crank angle: sign * position / gear_ratio + offset."""

    sign: int = _sign("1 if the joint turns in the direction of the mechanism's crank angle, otherwise -1")
    offset_rad: float = quantity(
        "rad",
        "crank angle at joint position 0",
        within=(-100.0, 100.0),
        usual=(0.0, math.tau),
        doubt="{value:g} rad is more than a turn. Is it in degrees?",
        default=0.0,
    )
    gear_ratio: float = quantity(
        "",
        "turns of the joint per turn of the crank; unless it is 1, the position must be continuous, not "
        "wrapped",
        within=(1.0e-4, 1.0e4),
        default=1.0,
    )
    zero: str = choice(
        ZEROS,
        "known: crank.offset_rad is the offset; at_start: the encoder starts at zero, and the monitor finds "
        "the offset from the drive torque",
        default=KNOWN,
    )

    def __attrs_post_init__(self) -> None:
        if self.zero == AT_START and self.offset_rad != 0.0:
            fault = f"{self.offset_rad!r} rad is not used with crank.zero {AT_START!r}. Expected 0.0"
            raise FieldError("offset_rad", fault)


def filled(name: str) -> str | None:
    """The fault of an empty name; None if it is not empty."""
    return None if name else "'' is empty. Expected a name"


def _few_and_different(names: tuple[str, ...]) -> str | None:
    if len(names) > sample.ENCODERS:
        return f"{list(names)} are {len(names)} names. Expected at most {sample.ENCODERS}"
    return None if len(set(names)) == len(names) and all(names) else f"{list(names)} are not different names"


def _signs(signs: tuple[float, ...]) -> str | None:
    return None if all(sign in (-1.0, 1.0) for sign in signs) else f"{list(signs)} are not all 1.0 or -1.0"


@attrs.frozen(kw_only=True)
class Encoders:
    """Further encoders, in whose angles clearances show (forecast.md); by default there are none."""

    names: tuple[str, ...] = described(
        "names of further encoders in joint_states, in the messages with the crank; empty for none",
        default=(),
        check=_few_and_different,
    )
    joints: tuple[str, ...] = described(
        "revolute joint of each encoder; the angle is from the bushing's body to the journal's body, and the "
        "monitor estimates its offset",
        default=(),
        check=_few_and_different,
    )
    signs: tuple[float, ...] = quantity(
        "",
        "1.0 if an encoder turns in the direction of the mechanism's angles, otherwise -1.0; empty for all "
        "1.0",
        within=(-1.0, 1.0),
        default=(),
        check=_signs,
    )
    # gait cycles in which offset and scale of a new encoder are estimated
    commissioning_cycles: int = 100
    # gait cycles per clearance estimate; a sudden change becomes visible after half of them
    window_cycles: int = 60

    def __attrs_post_init__(self) -> None:
        for key, given in (("joints", self.joints), ("signs", self.signs)):
            if len(given) != len(self.names) and (given or key == "joints"):
                fault = f"has {len(given)} values for {len(self.names)} encoders. Expected one each"
                raise FieldError(key, fault)


@attrs.frozen(kw_only=True)
class DriveTorque:
    """Conversion of a torque message to the torque on the crank: sign * scale * gear_ratio * value."""

    source: str = choice(
        TORQUE_SOURCES,
        "source of the torque: WrenchStamped or Float64 on drive_torque, the crank's effort in joint_states, "
        "or an interface of the crank in dynamic_joint_states of ros2_control",
        default="wrench",
    )
    interface: str = described(
        "name of the crank's interface if drive_torque.source is interface, such as motor_current; the unit "
        "of drive_torque.scale is then N m per ampere",
        default="effort",
        check=filled,
    )
    sampling: str = choice(
        sample.SAMPLINGS,
        "average: a sample is the mean since the previous sample; instant: the torque at its stamp",
        default=sample.AVERAGE,
    )
    axis: str = choice(("x", "y", "z"), "component of the wrench about the drive's axis", default="z")
    sign: int = _sign("1 if a positive torque drives the crank in its positive direction, otherwise -1")
    scale: float = quantity(
        "",
        "factor on the torque for its unit and the efficiency of the gear",
        within=(1.0e-6, 1.0e6),
        default=1.0,
    )
    gear_ratio: float = quantity(
        "", "turns of the sensor's shaft per turn of the crank", within=(1.0e-4, 1.0e4), default=1.0
    )


@attrs.frozen(kw_only=True)
class FootLoad:
    """Conversion of a message on foot_load to the force of the ground on the toe: sign * scale * value."""

    source: str = choice(
        sample.LOAD_SOURCES,
        "message on foot_load: none, WrenchStamped, Float64 (vertical force), or contact, a Bool",
        default=sample.NO_LOAD,
    )
    frame: str = choice(
        sample.LOAD_FRAMES,
        "axes of the wrench: of the mechanism (ground), or of the body with the toe (foot)",
        default=sample.GROUND_FRAME,
    )
    sign: int = _sign("1 if a positive value pushes the foot up or along the axis, otherwise -1")
    scale: float = quantity(
        "", "factor on the force, for its unit: 1000.0 for kN", within=(1.0e-6, 1.0e6), default=1.0
    )

    def __attrs_post_init__(self) -> None:
        if self.frame == sample.FOOT_FRAME and self.source not in (sample.NO_LOAD, sample.WRENCH):
            fault = f"{self.frame!r} needs a force with a direction, foot_load.source {sample.WRENCH!r}"
            raise FieldError("frame", fault)


@attrs.frozen(kw_only=True)
class Load:
    """The load that the foot carries in the model."""

    model: str = choice(
        sample.LOAD_MODELS,
        "load at the foot: none; ground, estimated from the torque as a person's stance; measured, from "
        "foot_load",
        default=sample.NONE,
    )
    person_kg: float = quantity(
        "kg",
        "mass of a person with one leg strapped to thigh, shank and foot; 0 for none",
        within=(0.0, 300.0),
        default=0.0,
    )


@attrs.frozen(kw_only=True)
class Cadence:
    """The commanded gait."""

    commanded_rpm: float = quantity(
        "rpm",
        "commanded crank speed, negative for clockwise, at least 0.1 in size",
        within=(-1200.0, 1200.0),
        usual=(10.0, 1200.0),
        doubt=_is_slow,
        default=60.0,
        check=_turns,
    )
    tolerance_rpm: float = live_quantity(
        "rpm",
        "predictions are valid within this deviation from the commanded speed",
        above=0.0,
        at_most=1200.0,
        default=6.0,
    )

    def allows(self, rpm: float) -> bool:
        """True if predictions are valid at a cadence [rpm]."""
        return abs(rpm - self.commanded_rpm) <= self.tolerance_rpm

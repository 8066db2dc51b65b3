"""Type of a drive file: a motor with its gear and controller, as it is sold."""

from collections.abc import Iterator
from typing import Any

import attrs

from leg_wear_monitor.configuration.quantity import FieldError, choice, described
from leg_wear_monitor.mechanism.materials.sourced import SourcedValue, sourced
from leg_wear_monitor.shown import Shown

SHAFTS = OUTPUT, MOTOR = ("output", "motor")


@attrs.frozen(kw_only=True)
class Drive(Shown):
    """A motor with its gear and controller; what no source states is left out."""

    name: str = described("name, as the file's")
    title: str = described("maker, type and gear, in words")
    shaft: str = choice(
        SHAFTS,
        "shaft of the torques and speeds below: the drive's output, or the motor before its gear",
        default=OUTPUT,
    )
    gear_ratio: SourcedValue | None = sourced("number", "turns of the motor per turn of the output")
    lag: SourcedValue | None = sourced("time", "time by which the reported torque is late")
    bandwidth: SourcedValue | None = sourced(
        "frequency", "corner frequency of the first-order low-pass between torque and reported torque"
    )
    load_friction: SourcedValue | None = sourced(
        "number", "friction by load, as a fraction of the torque's size"
    )
    coulomb: SourcedValue | None = sourced("torque", "constant friction")
    viscous: SourcedValue | None = sourced("friction by speed", "friction by speed")
    stiffness: SourcedValue | None = sourced("stiffness", "stiffness between motor and output")
    torque_constant: SourcedValue | None = sourced("torque constant", "torque for a current")
    notes: str = described("what else a user must know", default="")

    def __attrs_post_init__(self) -> None:
        if self.shaft == MOTOR and self.gear_ratio is None:
            fault = "is missing, expected the turns of the motor per turn of the output for shaft: motor"
            raise FieldError("gear_ratio", fault)
        if self.load_friction is not None and not self.load_friction.si < 1.0:
            raise FieldError("load_friction", f"{self.load_friction.si!r} is not below 1")

    @property
    def motor_turns(self) -> float:
        """Turns of the figures' shaft per turn of the drive's output."""
        return self.gear_ratio.si if self.shaft == MOTOR and self.gear_ratio is not None else 1.0

    def values(self) -> Iterator[tuple[str, SourcedValue]]:
        """Every number with its key."""
        for field in attrs.fields(type(self)):
            value = getattr(self, field.name)
            if isinstance(value, SourcedValue):
                yield field.name, value

    def to_dict(self) -> dict[str, Any]:
        """The keys of the file, and the SI value of each number as ``si``; absent ones are null."""
        return {field.name: _document(getattr(self, field.name)) for field in attrs.fields(type(self))}


def _document(value: Any) -> Any:
    return attrs.asdict(value) | {"si": value.si} if isinstance(value, SourcedValue) else value

"""Figures with their sources, in units as makers print them; drives as they are sold."""

import math
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import attrs

from leg_wear_monitor.configuration import FieldError, choice, described
from leg_wear_monitor.configuration.strict import Library

# Units of the files of materials and drives, by measured quantity, and their factors to SI.
#
# Two traps are spelled out. A dimensionless K of Archard's law is worth nothing without the form of the law:
# books write V = K F s / H and V = K F s / (3 H), so the unit names the form, and K / H or K / (3 H) is the
# wear coefficient of this package. Makers give a wear rate in µm/km at a pressure, so the unit names 1 MPa.


@attrs.frozen
class Unit:
    """A unit of a file of a material or a drive.

    Attributes
    ----------
    dimension : str
        Measured quantity.
    factor : float
        SI value of one such unit; of a K, the factor before K / H.
    needs_hardness : bool
        True if the number is a K, to be divided by a hardness.
    """

    dimension: str
    factor: float
    needs_hardness: bool = False


_MM3, _INCH, _POUND = 1.0e-9, 0.0254, 4.4482216152605  # m^3, m, N
_PSI = _POUND / _INCH**2
_FOOT_PER_MINUTE = 12.0 * _INCH / 60.0

UNITS = {
    "Pa": Unit("pressure", 1.0),
    "MPa": Unit("pressure", 1.0e6),
    "GPa": Unit("pressure", 1.0e9),
    "N/mm^2": Unit("pressure", 1.0e6),
    "psi": Unit("pressure", _PSI),
    "kgf/mm^2": Unit("pressure", 9.80665e6),
    "m/s": Unit("speed", 1.0),
    "ft/min": Unit("speed", _FOOT_PER_MINUTE),
    "Pa m/s": Unit("pressure times speed", 1.0),
    "MPa m/s": Unit("pressure times speed", 1.0e6),
    "N/mm^2 m/s": Unit("pressure times speed", 1.0e6),
    "psi ft/min": Unit("pressure times speed", _PSI * _FOOT_PER_MINUTE),
    "1/Pa": Unit("wear coefficient", 1.0),
    "mm^3/(N m)": Unit("wear coefficient", _MM3),
    "um/km at 1 MPa": Unit("wear coefficient", 1.0e-6 / 1.0e3 / 1.0e6),
    # volume over force, speed in ft/min and time in h: 60 ft of sliding for each ft/min and hour
    "in^3 min/(lbf ft h)": Unit("wear coefficient", _INCH**3 / (_POUND * 12.0 * _INCH * 60.0)),
    "K of V = K F s / H": Unit("wear coefficient", 1.0, needs_hardness=True),
    "K of V = K F s / (3 H)": Unit("wear coefficient", 1.0 / 3.0, needs_hardness=True),
    "degC": Unit("temperature", 1.0),
    "um": Unit("roughness", 1.0e-6),
    "ln": Unit("logarithmic standard deviation", 1.0),
    "1": Unit("number", 1.0),
    "s": Unit("time", 1.0),
    "ms": Unit("time", 1.0e-3),
    "Hz": Unit("frequency", 1.0),
    "N m": Unit("torque", 1.0),
    "N mm": Unit("torque", 1.0e-3),
    "N m s/rad": Unit("friction by speed", 1.0),
    "N m/rad": Unit("stiffness", 1.0),
    "N m/A": Unit("torque constant", 1.0),
}


# Numbers with their source, as material files have them.


def _blank(text: str) -> str | None:
    return None if text.strip() else "is empty. Expected a text"


def _interval(interval: tuple[float, float]) -> str | None:
    return None if interval[0] <= interval[1] else f"{list(interval)} does not rise"


@attrs.frozen(kw_only=True)
class SourcedValue:
    """A number with its source; a range alone stands for its middle."""

    value: float | None = described("the number; without it, the middle of range", default=None)
    unit: str = described("its unit, from the table below")
    source: str = described("origin of the value: author, title, year, or page", check=_blank)
    conditions: str = described("test conditions, or conditions in which the value is valid", check=_blank)
    range: tuple[float, float] | None = described(
        "lowest and highest value that the source gives", default=None, check=_interval
    )

    def __attrs_post_init__(self) -> None:
        if self.unit not in UNITS:
            raise FieldError("unit", f"{self.unit!r} is not one of {', '.join(UNITS)}")
        if self.value is None and self.range is None:
            raise FieldError("value", "is missing, and so is range. Expected one of them")

    @property
    def central(self) -> float:
        """The value in its own unit; of a range, its geometric middle, or the mean where it reaches 0."""
        if self.value is not None:
            return self.value
        low, high = self.range or (math.nan, math.nan)
        return math.sqrt(low * high) if low > 0.0 else 0.5 * (low + high)

    @property
    def si(self) -> float:
        """The value in SI units; a temperature in degrees Celsius."""
        return self.central * UNITS[self.unit].factor

    @property
    def text(self) -> str:
        """The number as its source gives it, with its range and unit."""
        unit = "" if self.unit == "1" else f" {self.unit}"
        interval = "" if self.range is None else f"{self.range[0]:g} to {self.range[1]:g}"
        if self.value is None:
            return f"{interval}{unit}"
        return f"{self.value:g}{unit}" + (f" ({interval})" if interval else "")


@attrs.frozen(kw_only=True)
class WearCoefficient(SourcedValue):
    """A wear coefficient; a dimensionless K comes with the hardness that it belongs to."""

    hardness: SourcedValue | None = described(
        "hardness by which a dimensionless K is divided",
        default=None,
        check=lambda value: unit_fault("pressure", value),
    )
    spread: SourcedValue | None = described(
        "logarithmic standard deviation of the coefficient, from part to part and from test to test",
        default=None,
        check=lambda value: unit_fault("logarithmic standard deviation", value),
    )

    def __attrs_post_init__(self) -> None:
        super().__attrs_post_init__()
        needs = UNITS[self.unit].needs_hardness
        if needs and self.hardness is None:
            raise FieldError("hardness", f"is missing. Expected the hardness H of {self.unit}")
        if not needs and self.hardness is not None:
            raise FieldError("hardness", f"does not belong to a coefficient in {self.unit}")

    @property
    def si(self) -> float:
        """The wear coefficient k of V = k F s [1/Pa]."""
        coefficient = self.central * UNITS[self.unit].factor
        return coefficient if self.hardness is None else coefficient / self.hardness.si


def unit_fault(dimension: str, value: SourcedValue) -> str | None:
    """Fault of the unit or the sign of a value with this dimension; None if there is none."""
    if UNITS[value.unit].dimension != dimension:
        known = " or ".join(name for name, unit in UNITS.items() if unit.dimension == dimension)
        return f"unit {value.unit!r} is not one of {dimension}. Expected {known}"
    if dimension != "temperature" and not (value.central > 0.0 and min(value.range or (0.0,)) >= 0.0):
        return f"{value.central!r} {value.unit} is not above 0"
    return None


def sourced(dimension: str, doc: str) -> Any:
    """Attrs field for an optional `SourcedValue` that measures this."""
    return described(
        doc, default=None, check=partial(unit_fault, dimension), metadata={"dimension": dimension}
    )


# Type of a drive file: a commercial motor with its gear and controller.


SHAFTS = OUTPUT, MOTOR = ("output", "motor")


class SourcedFile:
    """Content of a file of values with their sources."""

    def values(self) -> Iterator[tuple[str, SourcedValue]]:
        """Every number with its dotted key."""
        yield from _values(self, "")

    def to_dict(self) -> dict[str, Any]:
        """The keys of the file, and the SI value of each number as ``si``; absent ones are null."""
        return dict(_document(self))


def _values(part: Any, path: str) -> Iterator[tuple[str, SourcedValue]]:
    for field in attrs.fields(type(part)):
        value, key = getattr(part, field.name), f"{path}{field.name}"
        if isinstance(value, SourcedValue):
            yield key, value
        if attrs.has(type(value)):
            yield from _values(value, f"{key}.")


def _document(part: Any) -> Any:
    if not attrs.has(type(part)):
        return list(part) if isinstance(part, tuple) else part
    record = {field.name: _document(getattr(part, field.name)) for field in attrs.fields(type(part))}
    return record | {"si": part.si} if isinstance(part, SourcedValue) else record


@attrs.frozen(kw_only=True)
class Drive(SourcedFile):
    """A motor with its gear and controller; values without a source are left out."""

    name: str = described("name, as the file's")
    title: str = described("maker, type and gear, in words")
    shaft: str = choice(
        SHAFTS,
        "shaft of the torques and speeds below: the drive's output, or the motor before its gear",
        default=OUTPUT,
    )
    gear_ratio: SourcedValue | None = sourced("number", "turns of the motor per turn of the output")
    lag: SourcedValue | None = sourced("time", "delay of the reported torque")
    bandwidth: SourcedValue | None = sourced(
        "frequency", "corner frequency of a first-order low-pass between torque and reported torque"
    )
    load_friction: SourcedValue | None = sourced(
        "number", "friction by load, as a fraction of the torque's size"
    )
    coulomb: SourcedValue | None = sourced("torque", "constant friction")
    viscous: SourcedValue | None = sourced("friction by speed", "friction by speed")
    stiffness: SourcedValue | None = sourced("stiffness", "stiffness between motor and output")
    torque_constant: SourcedValue | None = sourced("torque constant", "torque for a current")
    notes: str = described("further notes for users", default="")

    def __attrs_post_init__(self) -> None:
        if self.shaft == MOTOR and self.gear_ratio is None:
            fault = "is missing. Expected the turns of the motor per turn of the output for shaft: motor"
            raise FieldError("gear_ratio", fault)
        if self.load_friction is not None and not self.load_friction.si < 1.0:
            raise FieldError("load_friction", f"{self.load_friction.si!r} is not below 1")

    @property
    def motor_turns(self) -> float:
        """Turns of the shaft to which the values refer, per turn of the drive's output."""
        return self.gear_ratio.si if self.shaft == MOTOR and self.gear_ratio is not None else 1.0


# Reading of drive files.


LIBRARY = Library("drives", "drive", Drive)


def drives() -> dict[str, Path]:
    """Files of the drives that come with the package, by name.

    Examples
    --------
    >>> import leg_wear_monitor as lw
    >>> "erob80-50" in lw.drives()
    True
    """
    return LIBRARY.files()


def load_drive(name_or_path: str | Path) -> Drive:
    """Read a drive from YAML.

    Parameters
    ----------
    name_or_path : str or pathlib.Path
        Name of a drive that comes with the package, or a path: anything with a suffix or a directory.

    Returns
    -------
    Drive

    Raises
    ------
    ConfigError
        Names file, key, value and the expected value.

    Examples
    --------
    >>> import leg_wear_monitor as lw
    >>> lw.load_drive("erob80-50").load_friction.value
    0.036
    """
    drive: Drive = LIBRARY.load(name_or_path)
    return drive

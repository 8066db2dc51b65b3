"""Figures with their sources: drives, material pairs of bushing and journal, and the loads of bushings."""

import math
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import attrs

from leg_wear_monitor.configuration import FieldError, choice, described
from leg_wear_monitor.configuration.strict import Library
from leg_wear_monitor.mechanism.spec import Clearance, Mechanism

# Units of the files of materials and drives: the measured quantity, and the factor to SI.
#
# Makers give a wear rate in µm/km at a pressure, so the unit names 1 MPa. The K of Archard's law is
# dimensionless, and books define it by V = K F s / H or by V = K F s / (3 H). A file therefore has K / H or
# K / (3 H).


_MM3, _INCH, _POUND = 1.0e-9, 0.0254, 4.4482216152605  # m^3, m, N
_PSI = _POUND / _INCH**2
_FOOT_PER_MINUTE = 12.0 * _INCH / 60.0

UNITS = {
    "Pa": ("pressure", 1.0),
    "MPa": ("pressure", 1.0e6),
    "GPa": ("pressure", 1.0e9),
    "N/mm^2": ("pressure", 1.0e6),
    "psi": ("pressure", _PSI),
    "m/s": ("speed", 1.0),
    "ft/min": ("speed", _FOOT_PER_MINUTE),
    "Pa m/s": ("pressure times speed", 1.0),
    "MPa m/s": ("pressure times speed", 1.0e6),
    "N/mm^2 m/s": ("pressure times speed", 1.0e6),
    "psi ft/min": ("pressure times speed", _PSI * _FOOT_PER_MINUTE),
    "1/Pa": ("wear coefficient", 1.0),
    "mm^3/(N m)": ("wear coefficient", _MM3),
    "um/km at 1 MPa": ("wear coefficient", 1.0e-6 / 1.0e3 / 1.0e6),
    # volume over force, speed in ft/min and time in h: 60 ft of sliding for each ft/min and hour
    "in^3 min/(lbf ft h)": ("wear coefficient", _INCH**3 / (_POUND * 12.0 * _INCH * 60.0)),
    "degC": ("temperature", 1.0),
    "um": ("roughness", 1.0e-6),
    "ln": ("logarithmic standard deviation", 1.0),
    "1": ("number", 1.0),
    "s": ("time", 1.0),
    "ms": ("time", 1.0e-3),
    "Hz": ("frequency", 1.0),
    "N m": ("torque", 1.0),
    "N mm": ("torque", 1.0e-3),
    "N m s/rad": ("friction by speed", 1.0),
    "N m/rad": ("stiffness", 1.0),
    "N m/A": ("torque constant", 1.0),
}


# Numbers with their source, as material files have them.


def _blank(text: str) -> str | None:
    return None if text.strip() else "is empty. Expected a text"


def _interval(interval: tuple[float, float]) -> str | None:
    return None if interval[0] <= interval[1] else f"{list(interval)} does not rise"


@attrs.frozen(kw_only=True)
class SourcedValue:
    """A number with its source; a range alone means its middle."""

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
        return self.central * UNITS[self.unit][1]

    @property
    def text(self) -> str:
        """The number as its source gives it, with its range and unit."""
        unit = "" if self.unit == "1" else f" {self.unit}"
        interval = "" if self.range is None else f"{self.range[0]:g} to {self.range[1]:g}"
        if self.value is None:
            return f"{interval}{unit}"
        return f"{self.value:g}{unit}" + (f" ({interval})" if interval else "")


def unit_fault(dimension: str, value: SourcedValue) -> str | None:
    """Fault of the unit or the sign of a value with this dimension; None if there is none."""
    if UNITS[value.unit][0] != dimension:
        known = " or ".join(name for name, (measures, _) in UNITS.items() if measures == dimension)
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

    name: str = described("name, equal to the name of the file")
    title: str = described("maker, type and gear in words")
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


# Types of a material file: one pair of bushing and journal, with its lubricant.


@attrs.frozen(kw_only=True)
class Side:
    """One of the two bodies in contact."""

    material: str = described("material of the body")
    youngs_modulus: SourcedValue | None = sourced("pressure", "Young's modulus")
    poissons_ratio: SourcedValue | None = sourced("number", "Poisson's ratio")
    wear_coefficient: SourcedValue | None = sourced("wear coefficient", "wear coefficient of this body")
    wear_spread: SourcedValue | None = sourced(
        "logarithmic standard deviation",
        "logarithmic standard deviation of the coefficient, from part to part and from test to test",
    )
    roughness: SourcedValue | None = sourced("roughness", "surface roughness Ra that the source requires")
    is_counted: bool = described(
        "false if the source gives only the wear of the other body",
        default=True,
    )

    @property
    def wear_si(self) -> float | None:
        """Wear coefficient of the body [1/Pa]; 0 if its wear is not modelled, None if it is not known."""
        if self.wear_coefficient is not None:
            return self.wear_coefficient.si
        return None if self.is_counted else 0.0


@attrs.frozen(kw_only=True)
class Limits:
    """Limits of a pair, beyond which its coefficient does not hold."""

    static_pressure: SourcedValue | None = sourced("pressure", "largest pressure at rest")
    dynamic_pressure: SourcedValue | None = sourced("pressure", "largest pressure while sliding")
    sliding_speed: SourcedValue | None = sourced("speed", "largest sliding speed")
    oscillating_speed: SourcedValue | None = sourced(
        "speed", "largest sliding speed of a joint that swings; by default sliding_speed"
    )
    pressure_speed: SourcedValue | None = sourced("pressure times speed", "largest pressure times speed")
    lowest_temperature: SourcedValue | None = sourced("temperature", "lowest temperature")
    highest_temperature: SourcedValue | None = sourced("temperature", "highest temperature")


@attrs.frozen(kw_only=True)
class Material(SourcedFile):
    """A pair of bushing and journal with its lubricant."""

    name: str = described("name, equal to the name of the file")
    title: str = described("the pair in words")
    bushing: Side = described("the bushing, a mapping of the keys below")
    journal: Side = described("the journal, a mapping of the keys below")
    lubricant: str = described("lubricant: none, or the grease or oil")
    regime: str = described("wear regime for which the values are valid")
    friction: SourcedValue | None = sourced("number", "friction coefficient")
    limits: Limits = described("limits, a mapping of the keys below", factory=Limits)
    notes: str = described("further notes for users", default="")

    @property
    def wear_coefficients(self) -> tuple[float, float] | None:
        """Wear coefficients of bushing and journal [1/Pa]; None if a coefficient is unknown."""
        bushing, journal = self.bushing.wear_si, self.journal.wear_si
        return None if bushing is None or journal is None else (bushing, journal)


# Reading of material files.


_LIBRARY = Library("materials", "material", Material)


def materials() -> dict[str, Path]:
    """Files of the material pairs that come with the package, by name.

    Examples
    --------
    >>> import leg_wear_monitor as lw
    >>> "du-on-steel-dry" in lw.materials()
    True
    """
    return _LIBRARY.files()


def load_material(name_or_path: str | Path) -> Material:
    """Read a material pair from YAML.

    Parameters
    ----------
    name_or_path : str or pathlib.Path
        Name of a pair that comes with the package, or a path: anything with a suffix or a directory.

    Returns
    -------
    Material

    Raises
    ------
    ConfigError
        Names file, key, value and the expected value.

    Examples
    --------
    >>> import leg_wear_monitor as lw
    >>> lw.load_material("steel-on-steel-greased-mild").wear_coefficients  # 1/Pa
    (1e-15, 1e-15)
    """
    material: Material = _LIBRARY.load(name_or_path)
    return material


# Load of a bushing, p, v and p v, against the limits of its material pair.


def _si(unit: str, default: Any = attrs.NOTHING) -> Any:
    return attrs.field(default=default, metadata={"unit": unit})


@attrs.frozen(kw_only=True)
class BushingLoad:
    """Pressure and sliding speed in a joint over a gait cycle, and the limits of its material.

    The limits apply to the 99th percentile of the pressure, and to the means of speed and product: makers
    limit the speed and the product because they heat the bushing.

    Attributes
    ----------
    mean_pressure_pa : float
        Mean force over the projected area of the bushing, its diameter times its width.
    p99_pressure_pa : float
        Pressure that is not exceeded 99 % of the time.
    mean_sliding_speed_mps : float
        Sliding speed under load: its mean weighted by the force.
    mean_pressure_speed_pa_mps : float
        Mean of pressure times sliding speed.
    pressure_limit_pa : float or None
        Limit of the pressure. This and the next two are None if the material gives no limit.
    sliding_speed_limit_mps : float or None
        Limit of the sliding speed.
    pressure_speed_limit_pa_mps : float or None
        Limit of their product.
    outside_limits : str or None
        Values beyond the limits, where the wear coefficient is not valid; None within the limits.
    """

    mean_pressure_pa: float = _si("Pa")
    p99_pressure_pa: float = _si("Pa")
    mean_sliding_speed_mps: float = _si("m/s")
    mean_pressure_speed_pa_mps: float = _si("Pa m/s")
    pressure_limit_pa: float | None = _si("Pa", None)
    sliding_speed_limit_mps: float | None = _si("m/s", None)
    pressure_speed_limit_pa_mps: float | None = _si("Pa m/s", None)
    outside_limits: str | None = None

    @property
    def compared(self) -> dict[str, tuple[float, float, str]]:
        """Value, limit and unit of each of ``p``, ``v`` and ``p v`` that has a limit, beyond it or not."""
        limited = {
            "p": (self.p99_pressure_pa, self.pressure_limit_pa, "Pa"),
            "v": (self.mean_sliding_speed_mps, self.sliding_speed_limit_mps, "m/s"),
            "p v": (self.mean_pressure_speed_pa_mps, self.pressure_speed_limit_pa_mps, "Pa m/s"),
        }
        return {
            name: (value, most, unit) for name, (value, most, unit) in limited.items() if most is not None
        }

    @property
    def fractions(self) -> dict[str, float]:
        """Each value that has a limit as a fraction of it."""
        return {name: value / limit for name, (value, limit, _) in self.compared.items()}

    @property
    def fraction(self) -> float | None:
        """Largest value as a fraction of its limit; None without limits."""
        return max(self.fractions.values(), default=None)


@attrs.frozen(kw_only=True)
class Bushing:
    """Data of a bushing that determine its load, and its limits.

    Attributes
    ----------
    area_m2 : float
        Projected area: diameter times width.
    material : str
        Its pair; empty if none is named.
    pressure_pa, sliding_speed_mps, pressure_speed_pa_mps : float or None
        Limits of the pair; None where it gives none.
    """

    area_m2: float
    material: str = ""
    pressure_pa: float | None = None
    sliding_speed_mps: float | None = None
    pressure_speed_pa_mps: float | None = None

    @classmethod
    def of(cls, settings: Clearance, *, is_swinging: bool = True) -> "Bushing":
        """The bushing of a joint with these settings; of the crank's joints, which turn, not swinging."""
        area = 2.0 * settings.bushing_radius * settings.width
        if not settings.material:
            return cls(area_m2=area)
        limits = load_material(settings.material).limits
        pressure = limits.dynamic_pressure or limits.static_pressure
        speed = (limits.oscillating_speed if is_swinging else None) or limits.sliding_speed
        return cls(
            area_m2=area,
            material=settings.material,
            pressure_pa=pressure.si if pressure else None,
            sliding_speed_mps=speed.si if speed else None,
            pressure_speed_pa_mps=limits.pressure_speed.si if limits.pressure_speed else None,
        )

    def load(self, mean_force_n: float, p99_force_n: float, rubbing_w: float) -> BushingLoad:
        """Load by forces [N] and by the mean of the normal force times the sliding speed [W]."""
        return self.loaded(
            mean_force_n / self.area_m2,
            p99_force_n / self.area_m2,
            rubbing_w / mean_force_n if mean_force_n > 0.0 else 0.0,
            rubbing_w / self.area_m2,
        )

    def loaded(
        self, mean_pressure_pa: float, p99_pressure_pa: float, speed_mps: float, pressure_speed: float
    ) -> BushingLoad:
        """Load by pressures [Pa], sliding speed [m/s] and their product [Pa m/s]."""
        load = BushingLoad(
            mean_pressure_pa=mean_pressure_pa,
            p99_pressure_pa=p99_pressure_pa,
            mean_sliding_speed_mps=speed_mps,
            mean_pressure_speed_pa_mps=pressure_speed,
            pressure_limit_pa=self.pressure_pa,
            sliding_speed_limit_mps=self.sliding_speed_mps,
            pressure_speed_limit_pa_mps=self.pressure_speed_pa_mps,
        )
        beyond = ", ".join(
            f"{name} {value:.3g} {unit} above {limit:.3g}"
            for name, (value, limit, unit) in load.compared.items()
            if value > limit
        )
        if not beyond:
            return load
        return attrs.evolve(load, outside_limits=f"outside the limits of {self.material}: {beyond}")


def bushing_of(mechanism: Mechanism, joint: str) -> Bushing:
    """The bushing of a joint; bushings of the crank turn, all others swing."""
    is_swinging = mechanism.drive.body not in mechanism.sides(joint)
    return Bushing.of(mechanism.clearances[joint], is_swinging=is_swinging)


# Material pairs of the joints of a mechanism.


_BESIDE = "a value beside "  # a wear coefficient of the mechanism file, in place of the pair's


def settings_of(pair: Material) -> dict[str, Any]:
    """Settings of a clearance joint that a pair gives, as a mechanism file would have them.

    The coefficient of a different pair must not take the place of a missing one, which is None.
    """
    wear = pair.wear_coefficients
    given: dict[str, Any] = {"wear_coefficient": None if wear is None else list(wear)}
    for key in ("youngs_modulus", "poissons_ratio"):
        sides = getattr(pair.bushing, key), getattr(pair.journal, key)
        if None not in sides:
            given[key] = [side.si for side in sides]
    if pair.friction is not None:
        given["friction"] = {"coefficient": pair.friction.si}
    return given


def regimes(mechanism: Mechanism, joints: Sequence[str]) -> dict[str, list[str]]:
    """The joints by the validity of their wear: pair and regime, or a bare coefficient."""
    found: dict[str, list[str]] = {}
    for joint in joints:
        settings = mechanism.clearances[joint]
        wear = " and ".join(f"{k:.3g}" for k in dict.fromkeys(settings.wear_coefficient)) + " 1/Pa"
        found.setdefault(f"{regime_of(settings)}, wear coefficient {wear}", []).append(joint)
    return found


def regime_of(settings: Clearance) -> str:
    """Validity of a joint's wear coefficient: its pair and the pair's regime."""
    if not settings.material:
        return "no material is named, so the regime is not known"
    pair = load_material(settings.material)
    own = "" if settings.wear_coefficient == pair.wear_coefficients else _BESIDE
    return f"{own}{pair.name} ({pair.regime})"


USUAL_SPREAD = 0.7
"""Logarithmic standard deviation of a wear coefficient whose pair gives none.

A factor of two up or down: reported wear rates scatter by that much and more (Schmitz and others, Journal of
Tribology 126 (2004) 802). It is a judgement, not a measurement.
"""


def spread_of(settings: Clearance, usual: float) -> float | None:
    """Logarithmic standard deviation of a joint's wear coefficient by its pair.

    The clearance grows by the sum of both coefficients. Both bodies are in the same regime, so their
    deviations are taken as one: their spreads count by their part of the sum.

    Parameters
    ----------
    settings : Clearance
    usual : float
        Spread of a body for which the pair gives none, while it gives one for the other.

    Returns
    -------
    float or None
        None if the pair gives no spread, or if the joint has its own wear coefficient.
    """
    if not settings.material:
        return None
    pair = load_material(settings.material)
    spreads = pair.bushing.wear_spread, pair.journal.wear_spread
    if settings.wear_coefficient != pair.wear_coefficients or not any(spreads):
        return None
    known = [usual if spread is None else spread.si for spread in spreads]
    weighted = sum(k * spread for k, spread in zip(settings.wear_coefficient, known, strict=True))
    return weighted / sum(settings.wear_coefficient)

"""Sections of the parameters: drive, forecast, tables."""

import math
from collections.abc import Mapping
from datetime import UTC, datetime

import attrs

from leg_wear_monitor.configuration import FieldError, choice, described, quantity
from leg_wear_monitor.errors import ConfigError
from leg_wear_monitor.estimate.signature import DriveFigures
from leg_wear_monitor.mechanism.sourced import LIBRARY, Drive, load_drive

# What is declared of the drive: a file by name, and numbers that override it.


NOT_DECLARED = -1.0


def _figure(unit: str, doc: str, least: float, most: float) -> float:
    """Parameter for a figure within bounds, or `NOT_DECLARED`."""

    def fault(value: float) -> str | None:
        if value == NOT_DECLARED or least <= value <= most:
            return None
        bounds = f"{least:g} to {most:g} {unit}".rstrip()
        return f"{value!r} is not within its bounds, expected {bounds}, or {NOT_DECLARED} if not declared"

    text = f"{doc}; {NOT_DECLARED:g}: that of drive.type, or estimated"
    number: float = quantity(
        unit, text, at_least=NOT_DECLARED, at_most=most, default=NOT_DECLARED, check=fault
    )
    return number


@attrs.frozen(kw_only=True)
class DriveParameters:
    """What is known of the drive beforehand; all else is estimated. The numbers are at the crank."""

    type: str = described(
        "the drive: a name that `leg-wear-monitor drives` lists, or a file; empty: unknown", default=""
    )
    gear_ratio: float = quantity(
        "",
        "turns of the drive's output per turn of the crank, for the figures of drive.type",
        at_least=1.0e-4,
        at_most=1.0e4,
        default=1.0,
    )
    lag_s: float = _figure("s", "time by which the measured torque is late", 0.0, 1.0)
    bandwidth_hz: float = _figure(
        "Hz", "corner frequency of the low-pass between the crank's torque and the measured one", 0.01, 1.0e5
    )
    load_friction: float = _figure(
        "", "friction of the drive by load, as a fraction of the torque's size", 0.0, 0.9
    )
    coulomb_nm: float = _figure("N m", "constant friction of the drive, at the crank", 0.0, 1.0e6)
    viscous_nms: float = _figure("N m s/rad", "friction of the drive by speed, at the crank", 0.0, 1.0e6)
    stiffness_nm_per_rad: float = _figure(
        "N m/rad", "stiffness between the measured angle and the crank, at the crank", 1.0e-3, 1.0e12
    )
    temperature_interface: str = described(
        "name of the crank's interface in dynamic_joint_states that is the temperature of the drive [°C], as "
        "temperature; needs drive_torque.source interface; empty: none",
        default="",
    )


def drive_figures(parameters: DriveParameters, source: str = "parameters") -> DriveFigures:
    """Declared figures of a drive at the crank: those of its file, overridden by the numbers.

    Parameters
    ----------
    parameters : DriveParameters
    source : str
        Origin of the parameters, for messages.

    Raises
    ------
    ConfigError
        If there is no drive of this name, with the nearest name, or if its file has a fault.
    """
    figures = DriveFigures()
    if parameters.type:
        fault = LIBRARY.unknown(parameters.type)
        if fault:
            raise ConfigError(source, "drive.type", f"{parameters.type!r}: {fault}")
        figures = _of_file(load_drive(parameters.type), parameters.gear_ratio)
    given = {name: getattr(parameters, name) for name in attrs.asdict(figures)}
    return attrs.evolve(figures, **{name: value for name, value in given.items() if value != NOT_DECLARED})


def _of_file(drive: Drive, output_turns: float) -> DriveFigures:
    """Figures of a file, at a crank for one turn of which the drive's output makes some turns."""
    turns = output_turns * drive.motor_turns
    factors = {
        "lag_s": (drive.lag, 1.0),
        "bandwidth_hz": (drive.bandwidth, 1.0),
        "load_friction": (drive.load_friction, 1.0),
        "coulomb_nm": (drive.coulomb, turns),
        "viscous_nms": (drive.viscous, turns**2),
        "stiffness_nm_per_rad": (drive.stiffness, turns**2),
    }
    return DriveFigures(**{name: value.si * by for name, (value, by) in factors.items() if value is not None})


# Parameters of the forecast: uncertain quantities and their standard deviations.


_LEAST_SIGMA = 0.001  # below, the grid of the estimate would be finer than rounding


def _not_next_to_0(sigma: float) -> str | None:
    if sigma == 0.0 or sigma >= _LEAST_SIGMA:
        return None
    return f"{sigma!r} is neither 0 nor at least {_LEAST_SIGMA:g}"


@attrs.frozen(kw_only=True)
class Forecasting:
    """Uncertainties of the forecast as standard deviations; those of factors are of the natural logarithm."""

    wear_coefficient_sigma: float = quantity(
        "",
        "standard deviation of the logarithm of a joint's wear coefficient about the given one; 0: the "
        "spread of the joint's material pair, or 0.7 where that gives none",
        at_least=0.0,
        at_most=3.0,
        default=0.0,
        check=_not_next_to_0,
    )
    load_sigma: float = quantity(
        "",
        "standard deviation of the logarithm of future wear per cycle, because load and pace vary",
        at_least=0.0,
        at_most=3.0,
        default=0.1,
    )
    model_sigma: float = quantity(
        "",
        "standard deviation of the logarithm of the growth, which is assumed constant without simulated "
        "lives (docs/explanation/forecast.md)",
        at_least=0.0,
        at_most=3.0,
        default=0.4,
    )
    clearance_sigma_m: float = quantity(
        "m", "standard deviation of a new joint's clearance", at_least=1.0e-9, at_most=1.0e-3, default=5.0e-6
    )
    duty_hours_per_day: float = quantity("h", "walking per day", at_least=0.01, at_most=24.0, default=8.0)
    duty_sigma: float = quantity(
        "",
        "standard deviation of the logarithm of the walking per day",
        at_least=0.0,
        at_most=3.0,
        default=0.2,
    )
    window_cycles: int = quantity(
        "",
        "gait cycles over which the growth of the forecast is averaged",
        at_least=10,
        at_most=100000,
        default=2000,
    )
    life: str = described(
        "file that `leg-wear-monitor life --lives 16 --json` wrote for this leg: how growth changes as all "
        "clearances open; empty: the one that comes with the package for just this leg, if there is one",
        default="",
    )
    priors: str = described(
        "file of priors that a fleet has learned for this leg's wear coefficients; empty: "
        "the spread of wear_coefficient_sigma about the given ones",
        default="",
    )


# Parameters of tables (CSV, Parquet, data frames): which columns are read, and their units.


DATE = "date"
STAMPS: Mapping[str, int] = {"s": 9, "ms": 6, "us": 3, "ns": 0}
"""Power of ten by which a time becomes nanoseconds."""
ANGLES: Mapping[str, tuple[float, float]] = {
    "rad": (1.0, 1.0),
    "deg": (math.pi, 180.0),
    "rev": (2.0 * math.pi, 1.0),
}
SPEEDS: Mapping[str, tuple[float, float]] = {
    "rad/s": (1.0, 1.0),
    "deg/s": (math.pi, 180.0),
    "rev/s": (2.0 * math.pi, 1.0),
    "rpm": (2.0 * math.pi, 60.0),
}
COUNTS = "counts"
"""Unit of an encoder's raw position; `TableInput.counts_per_turn` says how many make a turn."""
TORQUES: Mapping[str, tuple[float, float]] = {"N m": (1.0, 1.0), "N mm": (1.0, 1000.0)}
# not N, which the YAML parser of ROS takes for false
FORCES: Mapping[str, tuple[float, float]] = {"newton": (1.0, 1.0), "kN": (1000.0, 1.0)}
"""Factor and divisor to SI of angles, speeds, torques and forces; a division by 1000 is rounded once."""


def _filled(name: str) -> str | None:
    return None if name else "'' is empty, expected the name of a column"


@attrs.frozen(kw_only=True)
class Columns:
    """Names of the columns."""

    stamp: str = described(
        "column of the time; not read if input.rate_hz is set", default="time", check=_filled
    )
    crank_angle: str = described(
        "column of the position of the crank's joint", default="crank_angle", check=_filled
    )
    crank_speed: str = described("column of the speed of the crank's joint; empty: none", default="")
    drive_torque: str = described("column of the drive torque; empty: none", default="drive_torque")
    foot_load: str = described(
        "column of the force on the foot, up or, of a wrench, along its y axis, or of the contact; not read "
        "with foot_load.source none; empty: none",
        default="foot_load",
    )
    foot_load_along: str = described(
        "column of a wrench's force along its x axis; empty: none, it is 0", default=""
    )


@attrs.frozen(kw_only=True)
class Units:
    """Units of the columns."""

    stamp: str = choice(
        (*STAMPS, DATE),
        "unit of the time, since 1970 or since input.start; date: dates and times such as "
        "2026-03-01 09:00:00.001, in UTC",
        default="s",
    )
    crank_angle: str = choice(
        (*ANGLES, COUNTS),
        "unit of the position, also of further encoders; counts: those of the encoder, "
        "input.counts_per_turn a turn",
        default="rad",
    )
    crank_speed: str = choice(tuple(SPEEDS), "unit of the speed", default="rad/s")
    drive_torque: str = choice(tuple(TORQUES), "unit of the torque", default="N m")
    foot_load: str = choice(tuple(FORCES), "unit of the force on the foot", default="newton")


def _date(text: str) -> str | None:
    if not text:
        return None
    try:
        datetime.fromisoformat(text)
    except ValueError:
        return f"{text!r} is no date and time, expected one such as '2026-03-01T09:00:00Z'"
    return None


@attrs.frozen(kw_only=True)
class TableInput:
    """Columns of tables; signs and scales are those of `crank`, `drive_torque` and `foot_load`."""

    columns: Columns = described("", factory=Columns)
    units: Units = described("", factory=Units)
    counts_per_turn: float = quantity(
        "",
        "counts of the encoders in a turn of their joint, for positions in counts, such as 4096 for 12 bits; "
        "0: positions are in another unit",
        at_least=0.0,
        at_most=1.0e12,
        default=0.0,
    )
    rate_hz: float = quantity(
        "Hz",
        "rows per second of a table without a column of the time; 0: there is input.columns.stamp",
        at_least=0.0,
        at_most=1.0e6,
        default=0.0,
    )
    start: str = described(
        "date and time at which the time is 0, such as 2026-03-01T09:00:00Z; empty: 1970",
        default="",
        check=_date,
    )

    def __attrs_post_init__(self) -> None:
        if self.units.crank_angle == COUNTS and not self.counts_per_turn:
            raise FieldError("counts_per_turn", "is missing, expected the counts of the encoder in a turn")

    @property
    def angle_scale(self) -> tuple[float, float]:
        """Factor and divisor that make a position one in radians."""
        unit = self.units.crank_angle
        return (2.0 * math.pi, self.counts_per_turn) if unit == COUNTS else ANGLES[unit]

    @property
    def start_ns(self) -> int:
        """Stamp of time 0 [ns]."""
        if not self.start:
            return 0
        begin = datetime.fromisoformat(self.start)
        begin = begin if begin.tzinfo else begin.replace(tzinfo=UTC)
        passed = begin - datetime(1970, 1, 1, tzinfo=UTC)
        return ((passed.days * 86400 + passed.seconds) * 1_000_000 + passed.microseconds) * 1000

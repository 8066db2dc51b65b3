"""Parameters of tables (CSV, Parquet, data frames): which columns are read, and their units.

No slow import is allowed here, because ``--help`` lists the units.
"""

import math
from collections.abc import Mapping
from datetime import UTC, datetime

import attrs

from leg_wear_monitor.configuration import FieldError, choice, described, quantity

DATE = "date"
STAMPS: Mapping[str, int] = {"s": 9, "ms": 6, "us": 3, "ns": 0}
"""Power of ten that converts a time to nanoseconds."""
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
TORQUES: Mapping[str, tuple[float, float]] = {
    "N m": (1.0, 1.0),
    "N mm": (1.0, 1000.0),
    "Nm": (1.0, 1.0),
    "Nmm": (1.0, 1000.0),
}
# not N, which the YAML parser of ROS takes for false
FORCES: Mapping[str, tuple[float, float]] = {"newton": (1.0, 1.0), "kN": (1000.0, 1.0)}
"""Factor and divisor to SI of angles, speeds, torques and forces; a division by 1000 is rounded once."""


def _filled(name: str) -> str | None:
    return None if name else "'' is empty. Expected the name of a column"


@attrs.frozen(kw_only=True)
class Columns:
    """Names of the columns."""

    stamp: str = described(
        "column of the time; not read if table.rate_hz is set", default="time", check=_filled
    )
    crank_angle: str = described(
        "column of the position of the crank's joint", default="crank_angle", check=_filled
    )
    crank_speed: str = described("column of the speed of the crank's joint; empty for none", default="")
    drive_torque: str = described("column of the drive torque; empty for none", default="drive_torque")
    foot_load: str = described(
        "column of the foot load: vertical force, y axis of a wrench, or contact; unused if foot_load.source "
        "is none; empty for none",
        default="foot_load",
    )
    foot_load_along: str = described(
        "column of a wrench's force along its x axis; if empty, this force is 0", default=""
    )


@attrs.frozen(kw_only=True)
class Units:
    """Units of the columns."""

    stamp: str = choice(
        (*STAMPS, DATE),
        "unit of the time, since 1970 or since table.start; date: dates and times such as "
        "2026-03-01 09:00:00.001, in UTC",
        default="s",
    )
    crank_angle: str = choice(
        (*ANGLES, COUNTS),
        "unit of the position, also of further encoders; counts: encoder counts, "
        "table.counts_per_turn per turn",
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
        return f"{text!r} is not a date and time. Expected for example '2026-03-01T09:00:00Z'"
    return None


@attrs.frozen(kw_only=True)
class TableInput:
    """Columns of tables; signs and scales are in `crank`, `drive_torque` and `foot_load`."""

    columns: Columns = described("", factory=Columns)
    units: Units = described("", factory=Units)
    counts_per_turn: float = quantity(
        "",
        "encoder counts per turn of the joint, such as 4096 for 12 bits; 0 if positions are not in counts",
        within=(0.0, 1.0e12),
        default=0.0,
    )
    rate_hz: float = quantity(
        "Hz",
        "rows per second of a table without a time column; 0 if there is one",
        within=(0.0, 1.0e6),
        default=0.0,
    )
    date_format: str = described(
        "format of the dates of table.units.stamp date, such as %d.%m.%Y %H:%M:%S.%f; in UTC, unless it has "
        "%z; empty: ISO 8601, such as 2026-03-01 09:00:00.001",
        default="",
    )
    start: str = described(
        "date and time of time 0, such as 2026-03-01T09:00:00Z; if empty, 1970",
        default="",
        check=_date,
    )

    def __attrs_post_init__(self) -> None:
        if self.units.crank_angle == COUNTS and not self.counts_per_turn:
            raise FieldError("counts_per_turn", "is missing. Expected the encoder counts per turn")

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

"""Which columns of a table are read, in which units, and which of them it has."""

from collections.abc import Sequence

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.bags.findings import RecordingError
from leg_wear_monitor.errors import printable
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.config.tables import FORCES, SPEEDS, TORQUES, Units
from leg_wear_monitor.twin.settings import CONTACT, NO_LOAD, WRENCH

STAMP, CRANK_ANGLE, CRANK_SPEED, DRIVE_TORQUE = "stamp", "crank_angle", "crank_speed", "drive_torque"
FOOT_LOAD, FOOT_LOAD_ALONG = "foot_load", "foot_load_along"
_MAY_BE_NONE = (CRANK_SPEED, DRIVE_TORQUE, FOOT_LOAD, FOOT_LOAD_ALONG)
_MOST_LISTED = 20


@attrs.frozen
class Column:
    """A column that is read.

    Attributes
    ----------
    key : str
        What it is: one of the above, or the name of a further encoder.
    name : str
        Its name in the table.
    parameter : str
        Parameter that gives the name.
    unit : str
    factor, divisor : float
        To SI.
    """

    key: str
    name: str
    parameter: str
    unit: str
    factor: float = 1.0
    divisor: float = 1.0

    def to_si(self, values: Floats) -> Floats:
        """Values in SI units; those that are in them already stay the same bit for bit."""
        return np.asarray(values * self.factor / self.divisor)


@attrs.frozen(eq=False)
class Rows:
    """Rows of a table, in SI units.

    Attributes
    ----------
    line : (n,) array of int
        Line or row in the table, from 1.
    stamp_ns : (n,) array of int
    values : dict
        Values (n,) by the column's key; NaN where nothing was measured.
    measured : dict
        Whether a value was measured (n,), by the column's key: an empty cell was not, a NaN was.
    stored : int
        Bytes that the rows occupy in the file.
    """

    line: NDArray[np.int64]
    stamp_ns: NDArray[np.int64]
    values: dict[str, Floats]
    measured: dict[str, NDArray[np.bool_]]
    stored: int = 0

    def part(self, which: NDArray[np.bool_]) -> "Rows":
        """Some of the rows."""
        values = {key: column[which] for key, column in self.values.items()}
        measured = {key: column[which] for key, column in self.measured.items()}
        return Rows(self.line[which], self.stamp_ns[which], values, measured, self.stored)


def columns_of(config: MonitorConfig) -> tuple[Column, ...]:
    """Columns to read, the time first if there is one."""
    names, units = config.input.columns, config.input.units
    scales = {
        STAMP: (1.0, 1.0),
        CRANK_ANGLE: config.input.angle_scale,
        CRANK_SPEED: SPEEDS[units.crank_speed],
        DRIVE_TORQUE: TORQUES[units.drive_torque],
    }
    force = (1.0, 1.0) if config.foot_load.source == CONTACT else FORCES[units.foot_load]
    if config.foot_load.source != NO_LOAD:
        scales[FOOT_LOAD] = force
    if config.foot_load.source == WRENCH:
        scales[FOOT_LOAD_ALONG] = force
    own = [
        Column(key, getattr(names, key), f"input.columns.{key}", _unit(key, units), *scale)
        for key, scale in scales.items()
        if getattr(names, key) and not (key == STAMP and config.input.rate_hz)
    ]
    further = [
        Column(name, name, "encoders.names", units.crank_angle, *config.input.angle_scale)
        for name in config.encoders.names
    ]
    return (*own, *further)


def _unit(key: str, units: Units) -> str:
    return str(getattr(units, FOOT_LOAD if key == FOOT_LOAD_ALONG else key))


def places(source: str, names: Sequence[str], columns: Sequence[Column]) -> list[int]:
    """Index of each column among the names of a table.

    Raises
    ------
    RecordingError
        If a column is missing, or there twice.
    """
    found = []
    for column in columns:
        if names.count(column.name) != 1:
            what = "is there more than once" if column.name in names else "does not exist"
            nothing = ', or "" if there is none' if column.key in _MAY_BE_NONE else ""
            fault = f"column {column.name!r} {what}, expected one of: {_listed(names)}{nothing}"
            raise RecordingError(source, column.parameter, fault)
        found.append(names.index(column.name))
    return found


def _listed(names: Sequence[str]) -> str:
    more = f" and {len(names) - _MOST_LISTED} more" if len(names) > _MOST_LISTED else ""
    return ", ".join(printable(name, 100) for name in names[:_MOST_LISTED]) + more

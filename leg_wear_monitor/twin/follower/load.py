"""A foot load that may change with every cycle: drive torque, effect on the tables (physics.md section 9).

All tables are linear in the load, so a change of the load is a linear combination over the columns that it
affects.
"""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.contact.arrays import ContactArrays
from leg_wear_monitor.dynamics.clearance.tables import POINTS, ClearanceTables, build_tables
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ground_reaction import PHASES, upwards, with_toe_force
from leg_wear_monitor.mechanism.ideal import one_cycle, point_motion
from leg_wear_monitor.mechanism.position import Linkage, build_linkage
from leg_wear_monitor.twin.follower.measured_load import force_of, load_rows, set_force
from leg_wear_monitor.twin.settings import STANCE

_TRIAL_N = 100.0


class FootLoad:
    """The leg's tables under a vertical load at the toe.

    Parameters
    ----------
    linkage : Linkage
    contacts : ContactArrays
    shape : str
        Shape of the load over the gait cycle, one of `settings.LOAD_SHAPES`.
    is_measured, is_of_foot : bool
        Whether a measured force acts; whether it is measured along the axes of the foot.

    Attributes
    ----------
    tables : ClearanceTables
        Tables for the present load, changed in place.
    signature : (N + 1,) array
        Drive torque per upward load [N m/N], zeros for a mechanism without a toe.
    rows : LoadRows
        The measured force.
    """

    def __init__(
        self,
        linkage: Linkage,
        contacts: ContactArrays,
        shape: str = STANCE,
        is_measured: bool = False,
        is_of_foot: bool = False,
    ) -> None:
        self.tables = build_tables(linkage, contacts)
        self.signature = np.zeros(POINTS + 1)
        self._contacts, self._shape, self._load = contacts, shape, 0.0
        self._parts: list[tuple[NDArray[Any], ...]] = []
        self._measured = is_measured, is_of_foot
        self.rows = load_rows(linkage, contacts, self.tables, *self._measured)
        self._add_load(linkage)

    def rebuild(self, linkage: Linkage) -> None:
        """Set the tables, in place, to those of a leg with other masses or lengths, under the same load."""
        load, self._load = self._load, 0.0
        for own, table in self._pairs(build_tables(linkage, self._contacts)):
            own[...] = table
        rows = load_rows(linkage, self._contacts, self.tables, *self._measured)
        self._add_load(linkage)
        self.set(load)
        set_force(rows, force_of(self.rows))
        self.rows = rows

    def _add_load(self, linkage: Linkage) -> None:
        """Learn what a load changes, if there is a toe; the tables are those without load."""
        mechanism = linkage.mechanism
        if mechanism.toe is not None:
            self.signature[:], fraction = load_signature(linkage, self._shape)
            force = _TRIAL_N * fraction[:, None] * upwards(mechanism)
            loaded = build_linkage(with_toe_force(mechanism, force, "the twin's foot load"))
            self._find_parts(build_tables(loaded, self._contacts))

    def _pairs(self, tables: ClearanceTables) -> Iterable[tuple[NDArray[Any], NDArray[Any]]]:
        """The own tables, each with the corresponding other one."""
        return zip(self.tables, tables, strict=True)

    def _find_parts(self, loaded: ClearanceTables) -> None:
        """Find the columns that the load affects, their values without load and derivatives per newton."""
        self._parts = []
        for table, other in self._pairs(loaded):
            flat = table.reshape(len(table), -1)  # a view
            slope = (other.reshape(flat.shape) - flat) / _TRIAL_N
            columns = np.flatnonzero(slope.any(axis=0))
            if columns.size:
                self._parts.append((flat, columns, flat[:, columns], slope[:, columns]))

    def set(self, load: float) -> None:
        """Set the tables to a load [N], positive upwards."""
        if load == self._load:
            return
        self._load = load
        for flat, columns, bare, slope in self._parts:
            flat[:, columns] = bare + load * slope


def load_signature(linkage: Linkage, shape: str = STANCE) -> tuple[Floats, Floats]:
    """Drive torque by a unit load up at the toe (POINTS + 1,) [N m/N], and the load's fraction (PHASES,).

    Zeros for a mechanism without a toe.
    """
    mechanism = linkage.mechanism
    if mechanism.toe is None:
        return np.zeros(POINTS + 1), np.zeros(PHASES)
    up = upwards(mechanism)
    position, velocity, _ = point_motion(one_cycle(linkage, POINTS, 1.0), linkage, *mechanism.toe)
    fraction = _load_fraction(position @ up, shape)
    phases = np.arange(POINTS) / POINTS * PHASES
    along = np.interp(phases, np.arange(PHASES + 1), np.append(fraction, fraction[0]))
    signature = -along * (velocity @ up)
    return np.append(signature, signature[0]), fraction


def torque_size(linkage: Linkage, speed: float) -> float:
    """RMS of the ideal linkage's drive torque [N m] over a turn, at a crank speed [rad/s]."""
    return float(np.sqrt(np.mean(one_cycle(linkage, POINTS, speed).drive_torque ** 2)))


def _load_fraction(height: Floats, shape: str) -> Floats:
    """Fraction (PHASES,) of the full load at equal crank steps, from the toe's height (POINTS,) [m]."""
    if shape != STANCE:
        return np.ones(PHASES)
    depth = np.maximum(0.0, height.mean() - height)[:: POINTS // PHASES]
    return np.asarray(depth / (depth.max() or 1.0))

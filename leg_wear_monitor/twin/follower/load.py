"""A foot load that may change with every cycle: drive torque, effect on the tables (physics.md section 9).

The tables are linear in the load.
"""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.contact.arrays import ContactArrays
from leg_wear_monitor.dynamics.clearance.tables import POINTS, ClearanceTables, build_tables
from leg_wear_monitor.dynamics.clearance.toe_force import loaded_tables, put_force
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ground_reaction import PHASES, nominal_stance, upwards
from leg_wear_monitor.mechanism.ideal import one_cycle, point_motion
from leg_wear_monitor.mechanism.position import Linkage
from leg_wear_monitor.twin.follower.measured_load import force_of, load_rows, set_force
from leg_wear_monitor.twin.settings import GROUND, STANCE

# by how much measured stances differ from the template: RMS over the peak, of the vertical force (0.055 to
# 0.119) and of the fore-aft one (0.034 to 0.062; docs/appendix/benchmarks.md)
_VERTICAL, _FORE_AFT = 0.09, 0.05


class FootLoad:
    """The leg's tables under a vertical load at the toe.

    Parameters
    ----------
    linkage : Linkage
    contacts : ContactArrays
    shape : str
        Shape of the load over the gait cycle, one of `settings.LOAD_SHAPES`; that of a known load goes first.
    is_measured, is_of_foot : bool
        Whether a measured force acts; whether it is measured along the axes of the foot.

    Attributes
    ----------
    tables : ClearanceTables
        Tables for the present load, changed in place.
    shape : str
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
        self._contacts, self.shape, self._load = contacts, shape, 0.0
        self._known = np.zeros((0, 2))
        self._measured = is_measured, is_of_foot
        self._learn(linkage)

    def rebuild(self, linkage: Linkage, known: Floats) -> None:
        """Set the tables, in place, to those of a leg with other masses or lengths, under the same load.

        Parameters
        ----------
        linkage : Linkage
            Without the load.
        known : (PHASES, 2) array
            A load of the shape that the load has [N]; (0, 2) for the shape of the settings.
        """
        self._known = known
        load, self._load, measured = self._load, 0.0, force_of(self.rows)
        new: ClearanceTables = build_tables(linkage, self._contacts)
        pairs: Iterable[tuple[NDArray[Any], NDArray[Any]]] = zip(self.tables, new, strict=True)
        for own, table in pairs:
            own[...] = table
        self._learn(linkage)
        self.set(load)
        set_force(self.rows, measured)

    def _learn(self, linkage: Linkage) -> None:
        """Learn what a load changes; the tables are those without one."""
        self._linkage = linkage
        self._shaped: dict[str, tuple[Floats, Floats]] = {}
        self._loaded = loaded_tables(linkage, self._contacts, self.tables)
        self.rows = load_rows(linkage, self._loaded, *self._measured)
        self.take_shape(self.shape)

    def take_shape(self, shape: str) -> None:
        """Let the load have another shape, unless that of a known load goes first; none acts then."""
        self.set(0.0)
        self.shape, known = shape, self._known
        if known.size:
            self._force = known / (known @ upwards(self._linkage.mechanism)).max()
            self.signature[:] = load_signature(self._linkage, self._force)
        else:
            self._force, self.signature[:] = self._of_shape(shape)

    def signature_of(self, shape: str) -> Floats:
        """Drive torque (N,) per upward load of a shape [N m/N]."""
        return self._of_shape(shape)[1][:-1]

    def _of_shape(self, shape: str) -> tuple[Floats, Floats]:
        """Force and signature of a shape; kept, since a leg with a mismatch asks in each gait cycle."""
        if shape not in self._shaped:
            force = load_shape(self._linkage, shape)
            self._shaped[shape] = force, load_signature(self._linkage, force)
        return self._shaped[shape]

    @property
    def peak_n(self) -> float:
        """Largest vertical part of the load over a gait cycle that acts now [N]."""
        rows = self.rows
        return float((rows.force @ rows.up).max()) if len(rows.force) else self._load

    def set(self, load: float) -> None:
        """Set the tables to a load [N], positive upwards."""
        if load != self._load:
            self._load = load
            put_force(self._loaded, load * at_points(self._force))


def load_shape(linkage: Linkage, shape: str = STANCE) -> Floats:
    """Force on the toe (PHASES, 2), over its largest vertical part; zeros for a mechanism without a toe."""
    mechanism = linkage.mechanism
    if mechanism.toe is None:
        return np.zeros((PHASES, 2))
    if shape == GROUND:
        return nominal_stance(linkage).force()
    up = upwards(mechanism)
    position, _, _ = point_motion(one_cycle(linkage, PHASES, 1.0), linkage, *mechanism.toe)
    return np.outer(_fraction(position @ up, shape), up)


def shape_torque(linkage: Linkage) -> float:
    """RMS of the drive torque per newton of the peak [N m/N] by which steps differ from the template."""
    toe = linkage.mechanism.toe
    if toe is None:
        return 0.0
    stance = nominal_stance(linkage)
    _, velocity, _ = point_motion(one_cycle(linkage, PHASES, 1.0), linkage, *toe)
    other = _VERTICAL * (velocity @ stance.up), _FORE_AFT * (velocity @ stance.back)
    stands = stance.fractions() <= 1.0
    return float(np.sqrt(np.mean(np.where(stands, np.hypot(*other), 0.0) ** 2)))


def load_signature(linkage: Linkage, force: Floats | None = None) -> Floats:
    """Drive torque (POINTS + 1,) [N m/N] by a force on the toe (PHASES, 2); by default a push in stance.

    Zeros for a mechanism without a toe.
    """
    toe = linkage.mechanism.toe
    if toe is None:
        return np.zeros(POINTS + 1)
    force = load_shape(linkage) if force is None else force
    _, velocity, _ = point_motion(one_cycle(linkage, POINTS, 1.0), linkage, *toe)
    signature = -(at_points(force) * velocity).sum(axis=1)
    return np.append(signature, signature[0])


def at_points(force: Floats) -> Floats:
    """A force (PHASES, 2) at the points of the leg's tables (POINTS, 2)."""
    phases = np.arange(POINTS) / POINTS * len(force)
    place = np.arange(len(force))
    return np.stack([np.interp(phases, place, one, period=len(force)) for one in force.T], axis=1)


def torque_size(linkage: Linkage, speed: float) -> float:
    """RMS of the ideal linkage's drive torque [N m] over a turn, at a crank speed [rad/s]."""
    return float(np.sqrt(np.mean(one_cycle(linkage, POINTS, speed).drive_torque ** 2)))


def _fraction(height: Floats, shape: str) -> Floats:
    """Fraction (n,) of the full load at equal crank steps, from the toe's height (n,) [m]."""
    if shape != STANCE:
        return np.ones(len(height))
    depth = np.maximum(0.0, height.mean() - height)
    return np.asarray(depth / (depth.max() or 1.0))

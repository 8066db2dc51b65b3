"""A vertical load at the foot that may change from cycle to cycle, and how it is seen in the drive torque.

By virtual work a force F up at the toe asks the drive for -F dy/dtheta. Over a whole turn that has no mean,
and a constant friction torque is nothing but mean: the two cannot be taken for each other, so both follow
from one torque by least squares. Friction in the drive makes no force in the joints; the load does, and all
tables are linear in it, so it is taken into them by a sum of two.
"""

from typing import Any

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.contact.arrays import ContactArrays
from leg_wear_monitor.dynamics.clearance_tables import POINTS, ClearanceTables, build_tables
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import one_cycle, point_motion
from leg_wear_monitor.mechanism.position import Linkage, build_linkage
from leg_wear_monitor.mechanism.spec import ConstantLoad, Mechanism
from leg_wear_monitor.twin.leg_state import (
    FRICTION_2,
    FRICTION_RESIDUAL,
    LOAD_2,
    LOAD_FRICTION,
    LOAD_RESIDUAL,
    NUMBER,
    RESIDUAL_2,
)

_TRIAL_N = 100.0
_LEAST_SAMPLES = 8
_SINGULAR = 1.0e-9


class FootLoad:
    """The leg's tables under a load at the toe.

    Parameters
    ----------
    linkage : Linkage
    contacts : ContactArrays

    Attributes
    ----------
    tables : ClearanceTables
        Those of the present load; changed in place.
    signature : (N + 1,) array
        Drive torque by a unit load up [N m/N], zeros for a mechanism without a toe.
    """

    def __init__(self, linkage: Linkage, contacts: ContactArrays) -> None:
        self.tables = build_tables(linkage, contacts)
        self.signature = np.zeros(POINTS + 1)
        self._parts: list[tuple[NDArray[Any], ...]] = []
        mechanism = linkage.mechanism
        if mechanism.toe is not None and contacts.joint.size:
            up = _up(mechanism)
            velocity = point_motion(one_cycle(linkage, POINTS, 1.0), linkage, *mechanism.toe)[1]
            self.signature[:-1] = -(velocity @ up)
            self.signature[-1] = self.signature[0]
            self._find_parts(build_tables(build_linkage(_loaded(mechanism, _TRIAL_N * up)), contacts))

    def _find_parts(self, loaded: ClearanceTables) -> None:
        """The columns that a load changes, their values without it, and by how much a newton changes them."""
        for table, other in zip(self.tables, loaded, strict=True):
            flat = table.reshape(len(table), -1)  # a view
            slope = (other.reshape(flat.shape) - flat) / _TRIAL_N
            columns = np.flatnonzero(slope.any(axis=0))
            if columns.size:
                self._parts.append((flat, columns, flat[:, columns], slope[:, columns]))

    def set(self, load: float) -> None:
        """Put a load [N], up positive, into the tables."""
        for flat, columns, bare, slope in self._parts:
            flat[:, columns] = bare + load * slope


def _up(mechanism: Mechanism) -> Floats:
    """Unit vector against gravity; y where there is none."""
    gravity = np.array(mechanism.gravity)
    size = float(np.hypot(*gravity))
    return -gravity / size if size > 0.0 else np.array([0.0, 1.0])


def _loaded(mechanism: Mechanism, force: Floats) -> Mechanism:
    """The mechanism with a further constant force at its toe."""
    if mechanism.toe is None:
        return mechanism
    body, point = mechanism.toe
    load = ConstantLoad(body=body, point=point, force=(float(force[0]), float(force[1])))
    return attrs.evolve(mechanism, loads={**mechanism.loads, "the twin's foot load": load})


@attrs.frozen
class Estimate:
    """What a cycle's residual says: load [N], friction [N m], condition number; RMS of what is left [N m]."""

    load: float
    friction: float
    condition: float
    left: float


def estimate_load(sums: Floats) -> Estimate | None:
    """Load and friction by least squares from the sums (SUMS,) of a cycle; None without enough samples.

    The condition number is that of the two torques scaled to one size: 1 where neither looks like the other.
    Without a load's signature (no toe) only friction is estimated.
    """
    if sums[NUMBER] < _LEAST_SAMPLES or not sums[FRICTION_2] > 0.0:
        return None
    load_2, friction_2, both = sums[LOAD_2], sums[FRICTION_2], sums[LOAD_FRICTION]
    by_load, by_friction = sums[LOAD_RESIDUAL], sums[FRICTION_RESIDUAL]
    likeness = abs(both) / np.sqrt(load_2 * friction_2) if load_2 > 0.0 else 0.0
    if load_2 > 0.0 and likeness < 1.0 - _SINGULAR:
        determinant = load_2 * friction_2 - both * both
        load = (friction_2 * by_load - both * by_friction) / determinant
        friction = (load_2 * by_friction - both * by_load) / determinant
    else:
        load, friction = 0.0, by_friction / friction_2
    left = sums[RESIDUAL_2] - load * by_load - friction * by_friction
    condition = np.sqrt((1.0 + likeness) / max(1.0 - likeness, _SINGULAR))
    rms = np.sqrt(max(left, 0.0) / sums[NUMBER])
    return Estimate(float(load), float(friction), float(condition), float(rms))

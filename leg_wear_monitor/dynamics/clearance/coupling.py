"""What is between the drive and the crank: nothing, or a coupling or a belt (physics.md section 7)."""

from typing import NamedTuple

import numpy as np

from leg_wear_monitor.dynamics.clearance.layout import motion_shapes, views
from leg_wear_monitor.dynamics.clearance.tables import ClearanceTables
from leg_wear_monitor.mechanism.arrays import Floats

STIFFNESS, DAMPING, PARTS = 0, 1, 2  # of a coupling's law

# rad: longest part of an interval in the oscillation on its coupling of a crank whose joints are open, and
# fewest parts. The mean torque of the default leg is then within 0.6 % of its RMS of full coordinates, on 200
# to 5000 N m/rad; with a half and a quarter of the parts it is off by 0.7 and 7 % on 1000 N m/rad
_LONGEST, _FEWEST = 0.25, 4


class Coupling(NamedTuple):
    """What is between the drive and the crank.

    ``law`` (3,): stiffness [N m/rad], 0 for a rigid drive, damping [N m s/rad], and number of parts of an
    interval; ``inertia`` (N + 1,) [kg m^2]: that of the crank with all clearance joints open, at the angles
    of the tables.
    """

    law: Floats
    inertia: Floats


def rigid_coupling() -> Coupling:
    """A drive that turns the crank as it turns itself."""
    return Coupling(np.zeros(3), np.zeros(1))


def coupling_of(
    tables: ClearanceTables,
    joints: int,
    is_damped: bool,
    interval: float,
    stiffness: float,
    damping_ratio: float,
) -> Coupling:
    """Coupling of a leg with the given tables and number of clearance joints.

    Parameters
    ----------
    tables : ClearanceTables
    joints : int
    is_damped : bool
        Whether a spring of the leg has a damper.
    interval : float
        Of the stepper [s].
    stiffness : float
        [N m/rad]
    damping_ratio : float
        Of the crank on the coupling, with the mean inertia of the ideal leg over a turn.
    """
    shapes, inertia, whole = motion_shapes(joints, is_damped), np.zeros(len(tables.motion)), 0.0
    for i, row in enumerate(tables.motion):
        parts = views(row, shapes)
        by_rate, ideal = parts["torque_a"], parts["torque"][1]
        inertia[i] = ideal - by_rate @ parts["inverse_mass"] @ by_rate
        whole += ideal if i else 0.0  # the last row is the first one
    damping = 2.0 * damping_ratio * np.sqrt(stiffness * whole / (len(inertia) - 1))
    turned = interval * np.sqrt(stiffness / inertia.min())
    return Coupling(np.array([stiffness, damping, max(_FEWEST, np.ceil(turned / _LONGEST))]), inertia)

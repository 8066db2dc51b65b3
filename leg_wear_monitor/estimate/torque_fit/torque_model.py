"""Drive torque of the ideal leg: T = S + w D + w^2 H + a J, each a table over the crank angle."""

import attrs
import numpy as np

from leg_wear_monitor.dynamics.clearance.tables import POINTS
from leg_wear_monitor.estimate.body_torques import torque_coefficients
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN, one_cycle
from leg_wear_monitor.mechanism.position import build_linkage
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.twin.follower.load import load_signature

PHASE_ERROR_RAD = 0.02
"""Standard deviation by which clearances of 0.3 mm in five joints shift the torque's phase."""


@attrs.frozen(eq=False)
class TorqueModel:
    """Tables over the crank angle, from 0 in equal steps.

    Attributes
    ----------
    tables : (4, points) array
        Static torque [N m], and by speed [N m s], squared speed [N m s^2], acceleration [kg m^2].
    load : (points,) array
        Torque by a foot load of one newton up [N m/N]; zeros for a mechanism without a toe.
    """

    tables: Floats
    load: Floats

    def torque(self, angle: Floats, speed: Floats, acceleration: Floats) -> tuple[Floats, Floats]:
        """Torque [N m] and its derivative by the angle [N m/rad], each (n,)."""
        values, slopes = _at(self.tables, angle)
        motion = np.stack([np.ones_like(speed), speed, speed * speed, acceleration])
        return np.asarray((values * motion).sum(axis=0)), np.asarray((slopes * motion).sum(axis=0))

    def load_torque(self, angle: Floats) -> Floats:
        """Torque by a foot load of one newton up (n,) [N m/N]."""
        return np.asarray(_at(self.load[None], angle)[0][0])

    def at_speed(self, speed: Floats) -> Floats:
        """Torque over a turn (n, points) [N m] at constant speeds (n,) [rad/s]."""
        motion = np.stack([np.ones_like(speed), speed, speed * speed], axis=1)
        return np.asarray(motion @ self.tables[:3])


def torque_model(mechanism: Mechanism) -> TorqueModel:
    """Tables of a mechanism.

    Raises
    ------
    AssemblyError
        If the linkage does not close, or the crank does not turn through.
    """
    linkage = build_linkage(mechanism)
    tables = torque_coefficients(linkage, one_cycle(linkage, POINTS, 1.0).q)[0]
    return TorqueModel(tables, load_signature(linkage)[0][:-1])


def _at(tables: Floats, angle: Floats) -> tuple[Floats, Floats]:
    """Values (m, n) of periodic tables (m, points) at angles (n,), and their slopes by the angle."""
    points = tables.shape[1]
    place = (angle / TURN) % 1.0 * points
    left = np.minimum(place.astype(np.int64), points - 1)
    values = tables[:, left]
    step = tables[:, (left + 1) % points] - values
    return values + (place - left) * step, step * (points / TURN)

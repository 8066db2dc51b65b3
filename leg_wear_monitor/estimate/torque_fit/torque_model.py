"""Drive torque of the ideal leg: T = S + w D + w^2 H + a J, each a table over the crank angle."""

import attrs
import numpy as np

from leg_wear_monitor.dynamics.clearance.tables import POINTS
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN, one_cycle
from leg_wear_monitor.mechanism.position import Linkage, build_linkage
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.twin.follower.load import load_signature

PHASE_ERROR_RAD = 0.02
"""Standard deviation by which clearances of 0.3 mm in five joints shift the torque's phase."""


@attrs.frozen(eq=False)
class TorqueModel:
    """Tables over the crank angle, from 0 in equal steps.

    Attributes
    ----------
    tables : (4, POINTS) array
        Static torque [N m], and by speed [N m s], squared speed [N m s^2], acceleration [kg m^2].
    load : (POINTS,) array
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
        """Torque over a turn (n, POINTS) [N m] at constant speeds (n,) [rad/s]."""
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
    return TorqueModel(_tables(linkage), load_signature(linkage)[0][:-1])


def body_torques(mechanism: Mechanism) -> dict[str, Floats]:
    """By how much the tables (4, POINTS) grow if a body's mass and inertia double, by body."""
    base = _tables(build_linkage(mechanism))
    changes = {}
    for name, body in mechanism.bodies.items():
        heavier = attrs.evolve(body, mass=2.0 * body.mass, inertia=2.0 * body.inertia)
        changed = attrs.evolve(mechanism, bodies=mechanism.bodies | {name: heavier})
        changes[name] = _tables(build_linkage(changed)) - base
    return changes


def _tables(linkage: Linkage) -> Floats:
    """Tables (4, POINTS): three speeds tell the parts of a polynomial of second degree."""
    still, forwards, backwards = (
        one_cycle(linkage, POINTS, speed).drive_torque for speed in (0.0, 1.0, -1.0)
    )
    pushed = one_cycle(linkage, POINTS, 0.0, 1.0).drive_torque
    by_speed, by_square = 0.5 * (forwards - backwards), 0.5 * (forwards + backwards) - still
    return np.stack([still, by_speed, by_square, pushed - still])


def _at(tables: Floats, angle: Floats) -> tuple[Floats, Floats]:
    """Values (m, n) of periodic tables (m, POINTS) at angles (n,), and their slopes by the angle."""
    place = (angle / TURN) % 1.0 * POINTS
    left = np.minimum(place.astype(np.int64), POINTS - 1)
    values = tables[:, left]
    step = tables[:, (left + 1) % POINTS] - values
    return values + (place - left) * step, step * (POINTS / TURN)

"""Drive torque with ideal joints at any motion of the crank: T = S + w D + w^2 H + a J.

S, D, H and J are tables over the crank angle, w is the crank's speed and a its acceleration. Also their
derivatives with respect to masses and lengths.
"""

import functools

import attrs
import numpy as np

from leg_wear_monitor.dynamics.clearance.tables import POINTS
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.constraints import applied_forces_at, closures_at
from leg_wear_monitor.mechanism.position import (
    TURN,
    Linkage,
    build_linkage,
    drive_column,
    gammas,
    jacobians,
    one_cycle,
)
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.twin.load import load_shape, load_signatures
from leg_wear_monitor.twin.reference import LegParameters

PHASE_ERROR_RAD = 0.02
"""Standard deviation by which clearances of 0.3 mm in five joints shift the torque's phase."""


def at_angles(tables: Floats, angle: Floats) -> tuple[Floats, Floats]:
    """Values (..., n) of periodic tables (..., points) at angles (n,), and their slopes by the angle."""
    points = tables.shape[-1]
    place = (angle / TURN) % 1.0 * points
    left = np.minimum(place.astype(np.int64), points - 1)
    values = tables[..., left]
    step = tables[..., (left + 1) % points] - values
    return values + (place - left) * step, step * (points / TURN)


@attrs.frozen(kw_only=True)
class ModelError:
    """Standard deviations of the effects of clearances that are not in a model.

    Attributes
    ----------
    phase_rad, lag_rad : float
        Standard deviation of the torque's phase, and of its change between speeds [rad].
    scale : float
        Standard deviation of a factor on the torque.
    friction : float
        Standard deviation of the constant friction, as a fraction of the torque's RMS.
    load_friction : float
    """

    phase_rad: float
    lag_rad: float
    scale: float
    friction: float
    load_friction: float


# six legs in full coordinates behind 18 drives, 30 to 85 rpm
_IDEAL = ModelError(phase_rad=PHASE_ERROR_RAD, lag_rad=0.01, scale=0.035, friction=0.012, load_friction=0.025)


@attrs.frozen(eq=False)
class TorqueModel:
    """Tables over the crank angle, from 0 in equal steps.

    Attributes
    ----------
    tables : (4, points) array
        Static torque [N m], and by speed [N m s], squared speed [N m s^2], acceleration [kg m^2].
    load : (points,) array
        Torque by a foot load of one newton up [N m/N]; zeros for a mechanism without a toe.
    error : ModelError
    """

    tables: Floats
    load: Floats
    error: ModelError = _IDEAL

    def torque(self, angle: Floats, speed: Floats, acceleration: Floats) -> tuple[Floats, Floats]:
        """Torque [N m] and its derivative by the angle [N m/rad], each (n,)."""
        values, slopes = at_angles(self.tables, angle)
        motion = np.stack([np.ones_like(speed), speed, speed * speed, acceleration])
        return np.asarray((values * motion).sum(axis=0)), np.asarray((slopes * motion).sum(axis=0))

    def load_torque(self, angle: Floats) -> Floats:
        """Torque by a foot load of one newton up (n,) [N m/N]."""
        return np.asarray(at_angles(self.load, angle)[0])


def torque_model(mechanism: Mechanism) -> TorqueModel:
    """Tables of a mechanism.

    Raises
    ------
    AssemblyError
        If the linkage does not close, or the crank does not turn through.
    """
    linkage = build_linkage(mechanism)
    tables = torque_coefficients(linkage, one_cycle(linkage, POINTS, 1.0).q)[0]
    (load,) = load_signatures(linkage, [load_shape(linkage)])
    return TorqueModel(tables, load)


# Coefficients of the torque, and their derivatives with respect to masses and lengths.


_POINTS = 240  # points per gait cycle: three in each of 80 phases
_LONGER = 0.002  # step of the difference by a body's length
_NEWTON_ROUNDS = 4  # rounds of Newton's method: from lengths that are 0.2 % off, the third is at rounding


@attrs.frozen(eq=False)
class BodyTorques:
    """Coefficients of the drive torque at equal steps of the crank angle from 0.

    The torque is their sum, weighted with 1, the crank's speed, its square, and its acceleration.

    Attributes
    ----------
    own : (4, points) array
        Coefficients of the whole leg.
    mass, length : (bodies, 4, points) arrays
        Derivatives with respect to factors on bodies, in the order of the mechanism's file; a mass with its
        inertia.
    """

    own: Floats
    mass: Floats
    length: Floats

    def at(self, speed: float) -> tuple[Floats, Floats]:
        """Derivatives (bodies, points) by masses and by lengths [N m], at a crank speed [rad/s]."""
        return at_speed(self.mass, speed), at_speed(self.length, speed)


def at_speed(coefficients: Floats, speed: float) -> Floats:
    """Torques (..., points) [N m] of coefficients (..., 4, points), at a constant crank speed [rad/s]."""
    return np.asarray(np.array([1.0, speed, speed**2, 0.0]) @ coefficients)


def body_torques(mechanism: Mechanism) -> BodyTorques:
    """Drive torque of a mechanism and its derivatives; computed once for each mechanism."""
    return _computed(_Same(mechanism, id(mechanism)))


@attrs.frozen
class _Same:
    """A mechanism as a cache key: equal for the same object."""

    mechanism: Mechanism = attrs.field(eq=False)
    number: int


@functools.lru_cache(maxsize=2)
def _computed(same: _Same) -> BodyTorques:
    mechanism = same.mechanism
    linkage, whole = build_linkage(mechanism), LegParameters.none(mechanism)
    q = one_cycle(linkage, _POINTS, 1.0).q
    own, mass = torque_coefficients(linkage, q)
    length = []
    for one in np.eye(len(whole.length)):
        longer = build_linkage(attrs.evolve(whole, length=whole.length + _LONGER * one).applied(mechanism))
        length.append((torque_coefficients(longer, _closed(longer, q))[0] - own) / _LONGER)
    return BodyTorques(own, mass, np.array(length))


def _closed(linkage: Linkage, near: Floats) -> Floats:
    """Coordinates q (points, n, 3) that close a linkage at equal steps of the crank angle, near others."""
    q, rows = near.copy(), linkage.rows
    m, n = len(rows.body), q.shape[1]
    phi, still = np.empty((len(q), m)), np.zeros((n, 3))
    cs, blocks, gamma = np.empty((n, 2)), np.zeros((m, 2, 3)), np.empty(m)
    for _ in range(_NEWTON_ROUNDS):
        for i, here in enumerate(q):
            drive = np.array([i * TURN / len(q), 0.0, 0.0])
            closures_at(linkage.arrays, rows, here, still, drive, cs, phi[i], blocks, gamma)
        q[:, 1:] -= np.linalg.solve(jacobians(linkage, q), phi[:, :, None]).reshape(len(q), -1, 3)
    return q


def torque_coefficients(linkage: Linkage, q: Floats) -> tuple[Floats, Floats]:
    """Coefficients (4, points) of the drive torque, and the part of each body's mass (bodies, 4, points).

    The power of the drive is the power of inertia minus the power of all applied forces; v and a are velocity
    and acceleration at unit speed.

    Parameters
    ----------
    linkage : Linkage
    q : (points, n, 3) array
        Coordinates that close the linkage.
    """
    arrays, jacobian = linkage.arrays, jacobians(linkage, q)
    v, a, work = np.zeros_like(q), np.zeros_like(q), np.empty((q.shape[1], 2))
    v[:, 1:] = np.linalg.solve(jacobian, drive_column(linkage)[None, :, None]).reshape(len(q), -1, 3)
    a[:, 1:] = np.linalg.solve(jacobian, gammas(linkage, q, v, 0.0)[:, :, None]).reshape(len(q), -1, 3)
    resting, moving = np.empty_like(q), np.empty_like(q)
    applied_forces_at(arrays, q, np.zeros_like(q), work, resting)
    applied_forces_at(arrays, q, v, work, moving)
    inertia, reduced = (arrays.mass * a * v).sum(axis=2).T, (arrays.mass * v * v).sum(axis=2).T
    weight = (arrays.mass[:, :2] * arrays.gravity * v[:, :, :2]).sum(axis=2).T
    power = np.stack([-resting * v, (resting - moving) * v]).sum(axis=(2, 3))
    mass = np.stack([-weight, np.zeros_like(weight), inertia, reduced], axis=1)
    return np.vstack([power, inertia.sum(axis=0), reduced.sum(axis=0)]), mass[1:]

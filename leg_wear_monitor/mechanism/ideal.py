"""Ideal motion: all joints without clearance, over crank angles (physics.md sections 1 and 2)."""

import math
from collections.abc import Iterable

import attrs
import numpy as np
from numpy.typing import ArrayLike

from leg_wear_monitor.mechanism.arrays import Floats, body_names, point_from_com
from leg_wear_monitor.mechanism.constraints import DRIVE
from leg_wear_monitor.mechanism.forces import applied_forces_at
from leg_wear_monitor.mechanism.position import Linkage, assemble, drive_column, evaluate, follow

TURN = 2.0 * math.pi


@attrs.frozen(eq=False)
class IdealMotion:
    """Motion of the ideal linkage at N crank angles.

    Attributes
    ----------
    crank_angle : (N,) array, rad
    q, v, a : (N, n, 3) arrays
        Centre of mass [m] and angle [rad] of every body, ground first, and their rates.
    joint_force : (N, j, 2) array, N
        Force on the journal's (or slider's) body in each joint.
    drive_torque : (N,) array, N m
    """

    crank_angle: Floats
    q: Floats
    v: Floats
    a: Floats
    joint_force: Floats
    drive_torque: Floats


def ideal_motion(
    linkage: Linkage, crank_angles: Iterable[float], speed: float, acceleration: float = 0.0
) -> IdealMotion:
    """Motion of the ideal linkage at the given crank angles.

    Parameters
    ----------
    linkage : Linkage
    crank_angles : iterable of float, rad
        Visited in this order; neighbours may be any distance apart.
    speed, acceleration : float
        Of the crank [rad/s, rad/s^2], the same at every angle.

    Raises
    ------
    AssemblyError
        If the linkage does not close at its start or meets a dead point on the way.
    """
    angles = np.array(list(crank_angles), dtype=float)
    q, at = assemble(linkage), linkage.mechanism.assembly.crank_angle
    states = []
    for angle in angles:
        q, at = follow(linkage, q, at, angle), angle
        states.append(_state(linkage, q, (angle, speed, acceleration)))
    columns = [np.array(column) for column in zip(*states, strict=True)]
    return IdealMotion(angles, *columns)


def one_cycle(linkage: Linkage, points: int, speed: float) -> IdealMotion:
    """Ideal motion at ``points`` equal steps of one turn of the crank, from crank angle 0."""
    return ideal_motion(linkage, np.arange(points) * (TURN / points), speed)


def check_cycle(linkage: Linkage) -> None:
    """Turn the crank once.

    Raises
    ------
    AssemblyError
        At a dead point, naming its crank angle.
    """
    start = linkage.mechanism.assembly.crank_angle
    follow(linkage, assemble(linkage), start, start + TURN)


def _state(
    linkage: Linkage, q: Floats, drive: tuple[float, float, float]
) -> tuple[Floats, Floats, Floats, Floats, float]:
    """Velocity, acceleration and reactions at one position."""
    v, a = np.zeros_like(q), np.zeros_like(q)
    jacobian = evaluate(linkage, q, v, drive).jacobian
    v[1:] = np.linalg.solve(jacobian, drive_column(linkage) * drive[1]).reshape(-1, 3)
    a[1:] = np.linalg.solve(jacobian, evaluate(linkage, q, v, drive).gamma).reshape(-1, 3)
    cs, force = np.empty((len(q), 2)), np.empty_like(q)
    applied_forces_at(linkage.arrays, q, v, cs, force)
    # M a + phi_q^T lambda = Q; the force that a row exerts is -phi_q^T lambda
    inertial: Floats = force - linkage.arrays.mass * a
    lam: Floats = np.asarray(np.linalg.solve(jacobian.T, inertial[1:].ravel()), dtype=np.float64)
    return q, v, a, reactions(linkage, q, lam), float(-lam[linkage.rows.drive_row])


def reactions(linkage: Linkage, q: Floats, lam: Floats) -> Floats:
    """Force on the journal's or slider's body in every joint (j, 2) [N] from the multipliers."""
    arrays, force = linkage.arrays, np.zeros((len(linkage.mechanism.joints), 2))
    for closure, row in zip(linkage.rows.closure, linkage.rows.row, strict=True):
        if closure == DRIVE:
            continue
        if arrays.joint_kind[closure] == 0:
            force[closure] = -lam[row : row + 2]
        else:
            angle = q[arrays.joint_body[closure, 0], 2]
            force[closure] = -lam[row] * turned(arrays.joint_normal[closure], angle)
    return force


def point_motion(
    motion: IdealMotion, linkage: Linkage, body: str, point: str
) -> tuple[Floats, Floats, Floats]:
    """Position, velocity and acceleration (N, 2) of a point of a body."""
    i = body_names(linkage.mechanism).index(body)
    q, v, a = motion.q[:, i], motion.v[:, i], motion.a[:, i]
    lever = turned(point_from_com(linkage.mechanism, body, point), q[:, 2])
    across = np.stack([-lever[:, 1], lever[:, 0]], axis=1)
    w, alpha = v[:, 2:], a[:, 2:]
    return q[:, :2] + lever, v[:, :2] + w * across, a[:, :2] + alpha * across - w * w * lever


def turned(vector: ArrayLike, angle: ArrayLike) -> Floats:
    """A vector (2,) turned by an angle [rad], or by N angles (N, 2)."""
    x, y = np.asarray(vector, dtype=float)
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * x - s * y, s * x + c * y], axis=-1)

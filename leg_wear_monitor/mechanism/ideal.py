"""Ideal motion: all joints without clearance, over crank angles (physics.md sections 1 and 2)."""

import functools
import math
from collections.abc import Iterable

import attrs
import numpy as np
from numpy.typing import ArrayLike

from leg_wear_monitor.mechanism.arrays import Floats, body_names, com_poses, point_from_com
from leg_wear_monitor.mechanism.constraints import DRIVE
from leg_wear_monitor.mechanism.continuation import follow, positions
from leg_wear_monitor.mechanism.forces import applied_forces_at
from leg_wear_monitor.mechanism.position import Linkage, assemble, drive_column, gammas, jacobians
from leg_wear_monitor.mechanism.spec import Mechanism

TURN = 2.0 * math.pi


@attrs.frozen(eq=False)
class IdealMotion:
    """Motion of the ideal linkage at N crank angles.

    Attributes
    ----------
    crank_angle : (N,) array, rad
    q, v, a : (N, n, 3) arrays
        Centre of mass [m] and angle [rad] of every body, ground first; their velocities and accelerations.
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
        Speed [rad/s] and acceleration [rad/s^2] of the crank, the same at every angle.

    Returns
    -------
    IdealMotion

    Raises
    ------
    AssemblyError
        If the linkage does not close at the assembly's angle, or has a dead point between the angles.
    """
    angles = np.array(list(crank_angles), dtype=float)
    return _motion(linkage, angles, positions(linkage, angles), speed, acceleration)


def one_cycle(linkage: Linkage, points: int, speed: float, acceleration: float = 0.0) -> IdealMotion:
    """Ideal motion at ``points`` equal steps of one crank turn from angle 0.

    The speed [rad/s] and the acceleration [rad/s^2] are the same at every step.
    """
    return _motion(linkage, _even_angles(points), _one_cycle_positions(linkage, points), speed, acceleration)


def check_cycle(linkage: Linkage) -> None:
    """Check that the crank can turn through a full cycle.

    Raises
    ------
    AssemblyError
        If there is a dead point; the message contains its crank angle.
    """
    start = linkage.mechanism.assembly.crank_angle
    follow(linkage, assemble(linkage), start, start + TURN)


@attrs.frozen
class _Geometry:
    """A linkage as a cache key: equal for linkages that differ in masses, springs and loads only."""

    linkage: Linkage = attrs.field(eq=False)
    key: bytes


def _one_cycle_positions(linkage: Linkage, points: int) -> Floats:
    """Coordinates q (points, n, 3) over one turn, cached by the linkage's geometry."""
    arrays = linkage.arrays
    shape = (
        arrays.joint_kind,
        arrays.joint_body,
        arrays.joint_point,
        arrays.joint_normal,
        arrays.joint_angle,
    )
    start = np.append(
        com_poses(linkage.mechanism), [linkage.mechanism.assembly.crank_angle, arrays.drive_body]
    )
    key = b"".join(array.tobytes() for array in (*shape, start))
    return _solved_positions(_Geometry(linkage, key), points).copy()


# a twin, studies and tests need the positions of one linkage several times, with other loads and speeds
@functools.lru_cache(maxsize=16)
def _solved_positions(geometry: _Geometry, points: int) -> Floats:
    return positions(geometry.linkage, _even_angles(points))


def _even_angles(points: int) -> Floats:
    return np.asarray(np.arange(points) * (TURN / points), dtype=np.float64)


def _motion(linkage: Linkage, angles: Floats, q: Floats, speed: float, acceleration: float) -> IdealMotion:
    """Velocities, accelerations and reactions at positions q (N, n, 3)."""
    v, a, jacobian = np.zeros_like(q), np.zeros_like(q), jacobians(linkage, q)
    column = drive_column(linkage) * speed
    v[:, 1:] = _solve(jacobian, np.broadcast_to(column, jacobian.shape[:2])).reshape(len(q), -1, 3)
    a[:, 1:] = _solve(jacobian, gammas(linkage, q, v, acceleration)).reshape(len(q), -1, 3)
    force = np.empty_like(q)
    applied_forces_at(linkage.arrays, q, v, np.empty((q.shape[1], 2)), force)
    # M a + phi_q^T lambda = Q; the force that a row exerts is -phi_q^T lambda
    inertial: Floats = force - linkage.arrays.mass * a
    lam = _solve(jacobian.transpose(0, 2, 1), inertial[:, 1:].reshape(len(q), -1))
    return IdealMotion(angles, q, v, a, reactions(linkage, q, lam), -lam[:, linkage.rows.drive_row])


def _solve(matrices: Floats, columns: Floats) -> Floats:
    """Solutions (N, m) of N linear systems, matrices (N, m, m) and right-hand sides (N, m)."""
    return np.asarray(np.linalg.solve(matrices, columns[..., None]), dtype=np.float64)[..., 0]


def reactions(linkage: Linkage, q: Floats, lam: Floats) -> Floats:
    """Force (N, j, 2) [N] on the journal's or slider's body in every joint, from the multipliers (N, m)."""
    arrays, force = linkage.arrays, np.zeros((len(q), len(linkage.mechanism.joints), 2))
    for closure, row in zip(linkage.rows.closure, linkage.rows.row, strict=True):
        if closure == DRIVE:
            continue
        if arrays.joint_kind[closure] == 0:
            force[:, closure] = -lam[:, row : row + 2]
        else:
            angle = q[:, arrays.joint_body[closure, 0], 2]
            force[:, closure] = -lam[:, row, None] * rotated(arrays.joint_normal[closure], angle)
    return force


def point_motion(
    motion: IdealMotion, linkage: Linkage, body: str, point: str
) -> tuple[Floats, Floats, Floats]:
    """Position [m], velocity [m/s] and acceleration [m/s^2] of a point of a body, (N, 2) each."""
    i = body_names(linkage.mechanism).index(body)
    q, v, a = motion.q[:, i], motion.v[:, i], motion.a[:, i]
    lever = rotated(point_from_com(linkage.mechanism, body, point), q[:, 2])
    across = np.stack([-lever[:, 1], lever[:, 0]], axis=1)
    w, alpha = v[:, 2:], a[:, 2:]
    return q[:, :2] + lever, v[:, :2] + w * across, a[:, :2] + alpha * across - w * w * lever


def point_path(mechanism: Mechanism, q: Floats, body: str, point: str) -> Floats:
    """Position (N, 2) [m] of a point of a body at coordinates q (N, n, 3)."""
    i = body_names(mechanism).index(body)
    return q[:, i, :2] + rotated(point_from_com(mechanism, body, point), q[:, i, 2])


def rotated(vector: ArrayLike, angle: ArrayLike) -> Floats:
    """A vector (2,) rotated by an angle [rad], or by N angles: (N, 2)."""
    x, y = np.asarray(vector, dtype=float)
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * x - s * y, s * x + c * y], axis=-1)

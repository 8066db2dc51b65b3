"""Position analysis of the linkage, its continuation over the crank angle, and the ideal motion."""

import functools
import math
from collections.abc import Iterable, Mapping
from typing import NamedTuple

import attrs
import numpy as np
from numpy.typing import ArrayLike

from leg_wear_monitor.errors import AssemblyError
from leg_wear_monitor.mechanism.arrays import (
    Floats,
    MechanismArrays,
    body_names,
    com_poses,
    compile_arrays,
    point_from_com,
)
from leg_wear_monitor.mechanism.constraints import (
    DRIVE,
    Rows,
    applied_forces_at,
    closures_at,
    jacobians_at,
    select_rows,
)
from leg_wear_monitor.mechanism.spec import GROUND, Mechanism, PrismaticJoint

# Position analysis: assembly at one crank angle (physics.md section 1).


_TOLERANCE = 1.0e-12  # residual of a closed joint [m, rad], near rounding for links of a metre
_FAR = 0.5  # rad or link lengths: an assembly further from the initial guess is a different one


class Linkage(NamedTuple):
    """A mechanism with its arrays for the kernels, all joints ideal.

    ``rows`` contains every closure and the drive, so that their Jacobian is square.
    """

    mechanism: Mechanism
    arrays: MechanismArrays
    rows: Rows


class Closures(NamedTuple):
    """Residual (m,), dense Jacobian (m, 3 bodies) of the moving bodies, and gamma (m,)."""

    phi: Floats
    jacobian: Floats
    gamma: Floats


def mobility(mechanism: Mechanism) -> int:
    """Degrees of freedom by Gruebler's formula, with the crank free to turn."""
    return 3 * len(mechanism.bodies) - 2 * len(mechanism.joints)


def build_linkage(mechanism: Mechanism) -> Linkage:
    """Linkage of a mechanism.

    Raises
    ------
    AssemblyError
        If the linkage does not have exactly one degree of freedom.
    """
    freedom = mobility(mechanism)
    if freedom != 1:
        bodies, joints = len(mechanism.bodies), len(mechanism.joints)
        raise AssemblyError(
            f"{mechanism.source}: joints: mobility is {freedom} "
            f"(3 x {bodies} bodies - 2 x {joints} joints). Expected 1"
        )
    arrays = compile_arrays(mechanism)
    return Linkage(mechanism, arrays, select_rows(arrays, range(len(mechanism.joints)), driven=True))


def evaluate(linkage: Linkage, q: Floats, v: Floats, drive: tuple[float, float, float]) -> Closures:
    """All closures at coordinates q and velocities v (n, 3), drive (angle, speed, acceleration) [rad, s]."""
    m = len(linkage.rows.body)
    cs, phi, blocks, gamma = np.empty((len(q), 2)), np.empty(m), np.zeros((m, 2, 3)), np.empty(m)
    closures_at(linkage.arrays, linkage.rows, q, v, np.array(drive), cs, phi, blocks, gamma)
    return Closures(phi, dense_jacobian(linkage.rows, blocks, len(q)), gamma)


def jacobians(linkage: Linkage, q: Floats) -> Floats:
    """Jacobians (p, m, 3 (n - 1)) of all closures and the drive at p positions q (p, n, 3)."""
    return dense_jacobian(linkage.rows, jacobian_blocks(linkage, q), q.shape[1])


def jacobian_blocks(linkage: Linkage, q: Floats) -> Floats:
    """Blocks (p, m, 2, 3) of the Jacobians of all closures and the drive at p positions q (p, n, 3)."""
    m, n = len(linkage.rows.body), q.shape[1]
    blocks = np.zeros((len(q), m, 2, 3))
    room = np.zeros((n, 3)), np.zeros(3), np.zeros((n, 2)), np.zeros(m), np.zeros(m)
    jacobians_at(linkage.arrays, linkage.rows, np.ascontiguousarray(q), *room, blocks)
    return blocks


def gammas(linkage: Linkage, q: Floats, v: Floats, acceleration: float) -> Floats:
    """Gamma (p, m) of all closures and the drive at p positions and velocities (p, n, 3)."""
    m, n = len(linkage.rows.body), q.shape[1]
    drive = np.array([0.0, 0.0, acceleration])
    cs, phi, blocks, gamma = np.empty((n, 2)), np.empty(m), np.zeros((m, 2, 3)), np.empty((len(q), m))
    for here, rate, out in zip(q, v, gamma, strict=True):
        closures_at(linkage.arrays, linkage.rows, here, rate, drive, cs, phi, blocks, out)
    return gamma


def dense_jacobian(rows: Rows, blocks: Floats, bodies: int) -> Floats:
    """Jacobian (..., m, 3 (n - 1)) of the moving bodies from its blocks (..., m, 2, 3)."""
    m = len(rows.body)
    full = np.zeros((*blocks.shape[:-3], m, bodies, 3))
    for slot in range(2):  # no closure joins a body to itself
        full[..., np.arange(m), rows.body[:, slot], :] = blocks[..., slot, :]
    return full[..., 1:, :].reshape(*blocks.shape[:-3], m, -1)


def assemble(linkage: Linkage) -> Floats:
    """Coordinates q (n, 3) of the assembly at its crank angle, near the file's initial guess.

    Raises
    ------
    AssemblyError
        If there is no assembly, naming the joint that does not close and its gap; or if the assembly is far
        from the initial guess.
    """
    where = f"{linkage.mechanism.source}: assembly"
    q = find_assembly(linkage)
    if q is None:
        joint, gap_m, _ = open_joint(linkage)
        raise AssemblyError(
            f"{where}: no assembly near the given start: joint {joint} stays open by {1e3 * gap_m:.3g} mm"
        )
    if fault := far_from_start(linkage, q):
        raise AssemblyError(f"{where}.{fault}")
    return q


def find_assembly(linkage: Linkage) -> Floats | None:
    """Coordinates q (n, 3) of an assembly at the file's crank angle, from its initial guess; None without."""
    start, angle = com_poses(linkage.mechanism), linkage.mechanism.assembly.crank_angle
    q = newton(linkage, start, angle)
    if q is None:
        q = newton(linkage, nearest(linkage, start, angle, np.ones(len(linkage.rows.body))), angle)
    return q


def far_from_start(linkage: Linkage, q: Floats) -> str:
    """Text on the body that an assembly has far from its initial guess; empty if it is near."""
    size = _size(linkage.mechanism)
    moved = np.abs(q - com_poses(linkage.mechanism)) / [size, size, 1.0]
    if moved.max() <= _FAR:
        return ""
    body = list(linkage.mechanism.bodies)[np.unravel_index(moved.argmax(), moved.shape)[0] - 1]
    return (
        f"{body}: no assembly near the given start: the nearest assembly moves this body "
        f"by {moved.max():.2g} (rad or link lengths). Expected at most {_FAR}"
    )


def drive_column(linkage: Linkage) -> Floats:
    """Right-hand side (m,) with 1 in the drive's row."""
    column = np.zeros(len(linkage.rows.body))
    column[linkage.rows.drive_row] = 1.0
    return column


def newton(linkage: Linkage, start: Floats, angle: float) -> Floats | None:
    """Coordinates (n, 3) by Newton's method from an initial guess; None if it does not converge."""
    q = start.copy()
    for _ in range(30):
        system = evaluate(linkage, q, np.zeros_like(q), (angle, 0.0, 0.0))
        if np.abs(system.phi).max() < _TOLERANCE:
            return q
        try:
            step = np.linalg.solve(system.jacobian, -system.phi)
        except np.linalg.LinAlgError:
            return None
        if not np.isfinite(step).all() or np.abs(step).max() > 1.0e3:
            return None
        q[1:] += step.reshape(-1, 3)
    return None


def nearest(linkage: Linkage, start: Floats, angle: float, weight: Floats) -> Floats:
    """Coordinates with the least weighted residual of the closures near a start, by Levenberg-Marquardt."""

    def weighted(q: Floats) -> tuple[Floats, Floats]:
        system = evaluate(linkage, q, np.zeros_like(q), (angle, 0.0, 0.0))
        return weight * system.phi, weight[:, None] * system.jacobian

    q, damping = start.copy(), 1.0e-3
    phi, jacobian = weighted(q)
    for _ in range(200):
        normal = jacobian.T @ jacobian
        trial = q.copy()
        try:
            step = np.linalg.solve(normal + damping * np.diag(np.diag(normal)), -jacobian.T @ phi)
        except np.linalg.LinAlgError:
            break  # lengths differ by more than floating-point numbers resolve
        trial[1:] += step.reshape(-1, 3)
        residual, slope = weighted(trial)
        if residual @ residual < phi @ phi:
            q, phi, jacobian, damping = trial, residual, slope, 0.2 * damping
        else:
            damping *= 4.0
        if damping > 1.0e9:
            break
    return q


def open_joint(linkage: Linkage) -> tuple[str, float, Floats]:
    """The joint with the smallest gap [m] when all other joints are closed, at the file's crank angle.

    The coordinates (n, 3) with all other joints closed come last.
    """
    start, angle = com_poses(linkage.mechanism), linkage.mechanism.assembly.crank_angle
    rows, names = linkage.rows, list(linkage.mechanism.joints)
    found: list[tuple[bool, float, str, Floats]] = []
    for closure, row in zip(rows.closure, rows.row, strict=True):
        if closure == DRIVE:
            continue
        q = nearest(linkage, start, angle, all_but(linkage, names[closure]))
        phi = evaluate(linkage, q, np.zeros_like(q), (angle, 0.0, 0.0)).phi
        gap = float(np.hypot(*phi[row : row + 2]))
        others_open = np.abs(np.delete(phi, [row, row + 1])).max() > 0.01 * gap
        found.append((bool(others_open), gap, names[closure], q))
    _, gap, joint, q = min(found, key=lambda one: one[:2])
    return joint, gap, q


def all_but(linkage: Linkage, joint: str) -> Floats:
    """Weights (m,) of the rows for `nearest`: closes all joints in preference to this joint."""
    weight = np.full(len(linkage.rows.body), 100.0)
    row = linkage.rows.row[list(linkage.rows.closure).index(list(linkage.mechanism.joints).index(joint))]
    weight[row : row + 2] = 1.0
    return weight


def _size(mechanism: Mechanism) -> float:
    """Longest distance between two points of one body [m]."""
    spans = [
        np.hypot(a[0] - b[0], a[1] - b[1])
        for body in mechanism.bodies.values()
        for a in body.points.values()
        for b in body.points.values()
    ]
    return float(max(spans, default=0.0)) or 1.0


# Continuation of a position along the crank angle, on one branch (physics.md section 1).


_LONGEST_STEP = np.deg2rad(2.0)  # crank step that keeps the continuation on its branch
_SHORTEST_STEP = np.deg2rad(1.0e-4)  # crank step below which a dead point is reported


def positions(linkage: Linkage, crank_angles: Floats) -> Floats:
    """Coordinates q (p, n, 3) at p crank angles [rad], visited in this order; see `follow`."""
    q, angle = assemble(linkage), linkage.mechanism.assembly.crank_angle
    found = np.empty((len(crank_angles), *q.shape))
    for i, target in enumerate(crank_angles):
        q, angle = follow(linkage, q, angle, target), target
        found[i] = q
    return found


def follow(linkage: Linkage, q: Floats, angle: float, target: float) -> Floats:
    """Coordinates (n, 3) at the crank angle ``target``, continued on one branch from q at ``angle`` [rad].

    Raises
    ------
    AssemblyError
        If there is a dead point between the angles, naming its crank angle.
    """
    angle, q = furthest(linkage, q, angle, target)
    if angle != target:
        raise AssemblyError(
            f"{linkage.mechanism.source}: drive.body: "
            f"dead point at crank angle {np.rad2deg(angle) % 360.0:.2f} deg: "
            "the crank cannot turn through a full cycle"
        )
    return q


def furthest(linkage: Linkage, q: Floats, angle: float, target: float) -> tuple[float, Floats]:
    """Last crank angle [rad] on the way from q at ``angle`` to ``target``, and coordinates (n, 3) there.

    They are continued on one branch: the target's, or those before a dead point.
    """
    longest = _LONGEST_STEP  # shorter after a failed step: near a dead point, the next would fail as well
    while angle != target:
        step = float(np.clip(target - angle, -longest, longest))
        while (near := _step(linkage, q, angle, step)) is None:
            step *= 0.5
            if abs(step) < _SHORTEST_STEP:
                return angle, q
            longest = abs(step)
        longest = min(2.0 * longest, _LONGEST_STEP)
        q, angle = near, target if step == target - angle else angle + step
    return angle, q


def _step(linkage: Linkage, q: Floats, angle: float, step: float) -> Floats | None:
    """One continuation step [rad] along the tangent; None if it fails or passes a singular position."""
    here = evaluate(linkage, q, np.zeros_like(q), (angle, 0.0, 0.0)).jacobian
    sign = np.linalg.slogdet(here)[0]
    if sign == 0.0:
        return None
    guess = q.copy()
    guess[1:] += (np.linalg.solve(here, drive_column(linkage)) * step).reshape(-1, 3)
    near = newton(linkage, guess, angle + step)
    if near is None or np.abs(near - guess).max() > abs(step):
        return None
    ahead = evaluate(linkage, near, np.zeros_like(q), (angle + step, 0.0, 0.0)).jacobian
    return near if np.linalg.slogdet(ahead)[0] == sign else None


# Ideal motion: all joints without clearance, over crank angles (physics.md sections 1 and 2).


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
    q = _solved_positions(_geometry_of(linkage), points).copy()
    return _motion(linkage, _even_angles(points), q, speed, acceleration)


def check_cycle(linkage: Linkage) -> None:
    """Check that the crank can turn through a full cycle.

    Raises
    ------
    AssemblyError
        If there is a dead point; the message contains its crank angle.
    """
    _turned(_geometry_of(linkage))


@attrs.frozen
class _Geometry:
    """A linkage as a cache key: equal for linkages that differ in masses, springs and loads only."""

    linkage: Linkage = attrs.field(eq=False)
    key: bytes


def _geometry_of(linkage: Linkage) -> _Geometry:
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
    return _Geometry(linkage, b"".join(array.tobytes() for array in (*shape, start)))


# A twin, studies and tests need the turn of one linkage several times, with other loads and speeds.


@functools.lru_cache(maxsize=16)
def _turned(geometry: _Geometry) -> None:
    """Turn the crank by a full cycle; a failure is not cached."""
    linkage = geometry.linkage
    start = linkage.mechanism.assembly.crank_angle
    follow(linkage, assemble(linkage), start, start + TURN)


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


# The ideal mechanism at crank angle 0 as places in its plane, for pictures.


def outline_of(mechanism: Mechanism) -> tuple[dict[str, Floats], dict[str, Floats]]:
    """Outline of a mechanism [m].

    Returns
    -------
    bodies : dict of str to (n, 2) array
        Corners of each moving body.
    joints : dict of str to (2,) array

    Raises
    ------
    AssemblyError
        If it does not close.
    """
    linkage = build_linkage(mechanism)
    motion = ideal_motion(linkage, [0.0], 1.0)

    def place(body: str, point: str) -> Floats:
        return np.asarray(point_motion(motion, linkage, body, point)[0][0], np.float64)

    bodies = {
        body: corners({point: place(body, point) for point in mechanism.points_of(body)})
        for body in mechanism.bodies
    }
    return bodies, {joint: place(mechanism.sides(joint)[1], joint) for joint in mechanism.joints}


def is_on_ground(mechanism: Mechanism, joint: str) -> bool:
    """True if a joint joins a body to the ground."""
    return GROUND in mechanism.sides(joint)


def carriers(mechanism: Mechanism, joint: str) -> tuple[str, str]:
    """The two bodies of a joint; the last carries the drawn point: the ground, or the journal."""
    bushing, journal = mechanism.sides(joint)
    is_fixed = bushing == GROUND and not isinstance(mechanism.joints[joint], PrismaticJoint)
    return (journal, bushing) if is_fixed else (bushing, journal)


def corners(points: Mapping[str, Floats]) -> Floats:
    """Corners (n, 2) of a body's shape: its distinct points [m], ordered by angle around their mean."""
    distinct = np.unique(np.array(list(points.values())).round(9), axis=0)
    around = distinct - distinct.mean(axis=0)
    return np.asarray(distinct[np.argsort(np.arctan2(around[:, 1], around[:, 0]))])

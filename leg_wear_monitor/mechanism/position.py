"""Position analysis: assembly at one crank angle (physics.md section 1)."""

from typing import NamedTuple

import numpy as np

from leg_wear_monitor.errors import AssemblyError
from leg_wear_monitor.mechanism.arrays import Floats, MechanismArrays, com_poses, compile_arrays
from leg_wear_monitor.mechanism.constraints import DRIVE, Rows, closures_at, jacobians_at, select_rows
from leg_wear_monitor.mechanism.spec import Mechanism

_TOLERANCE = 1.0e-12  # residual of a closed joint [m, rad], near rounding for links of a metre
_FAR = 0.5  # rad or link lengths: an assembly further from the initial guess is a different one


class Linkage(NamedTuple):
    """A mechanism with its arrays for the kernels, all joints ideal.

    ``rows`` contains every closure and the drive, so that their Jacobian is square.
    """

    mechanism: Mechanism
    arrays: MechanismArrays
    rows: Rows


class OpenJoint(NamedTuple):
    """A joint that does not close: its name, its gap [m], coordinates (n, 3) with all other joints closed."""

    joint: str
    gap_m: float
    q: Floats


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
        If the linkage has another number of degrees of freedom than one.
    """
    freedom = mobility(mechanism)
    if freedom != 1:
        bodies, joints = len(mechanism.bodies), len(mechanism.joints)
        raise AssemblyError(
            f"{mechanism.source}: joints: mobility is {freedom} "
            f"(3 x {bodies} bodies - 2 x {joints} joints), expected 1"
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
        If there is no assembly, naming the joint that does not close and its gap; or if the one found is far
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
        f"{body}: no assembly near the given start: the one found moves this body "
        f"by {moved.max():.2g} (rad or link lengths), expected at most {_FAR}"
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


def open_joint(linkage: Linkage) -> OpenJoint:
    """The joint with the smallest gap when all other joints are closed, at the file's crank angle."""
    start, angle = com_poses(linkage.mechanism), linkage.mechanism.assembly.crank_angle
    rows, names = linkage.rows, list(linkage.mechanism.joints)
    found: list[tuple[bool, OpenJoint]] = []
    for closure, row in zip(rows.closure, rows.row, strict=True):
        if closure == DRIVE:
            continue
        q = nearest(linkage, start, angle, all_but(linkage, names[closure]))
        phi = evaluate(linkage, q, np.zeros_like(q), (angle, 0.0, 0.0)).phi
        gap = float(np.hypot(*phi[row : row + 2]))
        others_open = np.abs(np.delete(phi, [row, row + 1])).max() > 0.01 * gap
        found.append((bool(others_open), OpenJoint(names[closure], gap, q)))
    return min(found, key=lambda one: (one[0], one[1].gap_m))[1]


def all_but(linkage: Linkage, joint: str) -> Floats:
    """Weights (m,) of the rows for `nearest`: all joints closed rather than this one."""
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

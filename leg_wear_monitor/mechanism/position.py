"""Position analysis: assembly, and continuation along the crank angle (physics.md section 1)."""

from typing import NamedTuple

import numpy as np

from leg_wear_monitor.errors import AssemblyError
from leg_wear_monitor.mechanism.arrays import Floats, MechanismArrays, com_poses, compile_arrays
from leg_wear_monitor.mechanism.constraints import DRIVE, Rows, closures_at, jacobians_at, select_rows
from leg_wear_monitor.mechanism.spec import Mechanism

_TOLERANCE = 1.0e-12  # residual of a closed joint [m, rad], near rounding for links of a metre
_LONGEST_STEP = np.deg2rad(2.0)  # crank step that keeps the continuation on its branch
_SHORTEST_STEP = np.deg2rad(1.0e-4)  # crank step below which a dead point is reported
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
    m, n = len(linkage.rows.body), q.shape[1]
    blocks = np.zeros((len(q), m, 2, 3))
    room = np.zeros((n, 3)), np.zeros(3), np.zeros((n, 2)), np.zeros(m), np.zeros(m)
    jacobians_at(linkage.arrays, linkage.rows, np.ascontiguousarray(q), *room, blocks)
    return dense_jacobian(linkage.rows, blocks, n)


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
    for slot in range(2):
        full[..., np.arange(m), rows.body[:, slot], :] += blocks[..., slot, :]
    return full[..., 1:, :].reshape(*blocks.shape[:-3], m, -1)


def assemble(linkage: Linkage) -> Floats:
    """Coordinates q (n, 3) of the assembly at its crank angle, near the file's initial guess.

    Raises
    ------
    AssemblyError
        If there is no assembly, naming the joint that does not close and its gap; or if the one found is far
        from the initial guess.
    """
    mechanism = linkage.mechanism
    start = com_poses(mechanism)
    angle = mechanism.assembly.crank_angle
    q = _newton(linkage, start, angle)
    if q is None:
        q = _newton(linkage, _nearest(linkage, start, angle, np.ones(len(linkage.rows.body))), angle)
    where = f"{mechanism.source}: assembly"
    if q is None:
        raise AssemblyError(f"{where}: no assembly near the given start: {_gap(linkage, start, angle)}")
    moved = np.abs(q - start) / [_size(mechanism), _size(mechanism), 1.0]
    if moved.max() > _FAR:
        body = list(mechanism.bodies)[np.unravel_index(moved.argmax(), moved.shape)[0] - 1]
        raise AssemblyError(
            f"{where}.{body}: no assembly near the given start: the one found moves this body "
            f"by {moved.max():.2g} (rad or link lengths), expected at most {_FAR}"
        )
    return q


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
    while angle != target:
        step = np.clip(target - angle, -_LONGEST_STEP, _LONGEST_STEP)
        while True:
            near = _step(linkage, q, angle, step)
            if near is not None:
                break
            step *= 0.5
            if abs(step) < _SHORTEST_STEP:
                raise AssemblyError(
                    f"{linkage.mechanism.source}: drive.body: "
                    f"dead point at crank angle {np.rad2deg(angle) % 360.0:.2f} deg: "
                    "the crank cannot turn through a full cycle"
                )
        q, angle = near, target if step == target - angle else angle + step
    return q


def _step(linkage: Linkage, q: Floats, angle: float, step: float) -> Floats | None:
    """One continuation step [rad] along the tangent; None if it fails or passes a singular position."""
    here = evaluate(linkage, q, np.zeros_like(q), (angle, 0.0, 0.0)).jacobian
    sign = np.linalg.slogdet(here)[0]
    if sign == 0.0:
        return None
    guess = q.copy()
    guess[1:] += (np.linalg.solve(here, drive_column(linkage)) * step).reshape(-1, 3)
    near = _newton(linkage, guess, angle + step)
    if near is None or np.abs(near - guess).max() > abs(step):
        return None
    ahead = evaluate(linkage, near, np.zeros_like(q), (angle + step, 0.0, 0.0)).jacobian
    return near if np.linalg.slogdet(ahead)[0] == sign else None


def drive_column(linkage: Linkage) -> Floats:
    """Right-hand side (m,) with 1 in the drive's row."""
    column = np.zeros(len(linkage.rows.body))
    column[linkage.rows.drive_row] = 1.0
    return column


def _newton(linkage: Linkage, start: Floats, angle: float) -> Floats | None:
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


def _nearest(linkage: Linkage, start: Floats, angle: float, weight: Floats) -> Floats:
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


def _gap(linkage: Linkage, start: Floats, angle: float) -> str:
    """Text on the joint with the smallest gap when all other joints are closed."""
    rows, names = linkage.rows, list(linkage.mechanism.joints)
    gaps: dict[str, tuple[bool, float]] = {}
    for closure, row in zip(rows.closure, rows.row, strict=True):
        if closure == DRIVE:
            continue
        weight = np.full(len(rows.body), 100.0)
        weight[row : row + 2] = 1.0
        q = _nearest(linkage, start, angle, weight)
        phi = evaluate(linkage, q, np.zeros_like(q), (angle, 0.0, 0.0)).phi
        gap = float(np.hypot(*phi[row : row + 2]))
        others_open = np.abs(np.delete(phi, [row, row + 1])).max() > 0.01 * gap
        gaps[names[closure]] = bool(others_open), gap
    joint = min(gaps, key=lambda name: gaps[name])
    return f"joint {joint} stays open by {1e3 * gaps[joint][1]:.3g} mm"


def _size(mechanism: Mechanism) -> float:
    """Longest distance between two points of one body [m]."""
    spans = [
        np.hypot(a[0] - b[0], a[1] - b[1])
        for body in mechanism.bodies.values()
        for a in body.points.values()
        for b in body.points.values()
    ]
    return float(max(spans, default=0.0)) or 1.0

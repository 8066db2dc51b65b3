"""Closures of joints and drive: residual, Jacobian and right-hand side (physics.md sections 1 and 2).

Each constraint row involves two bodies, so a row of the Jacobian is stored as two blocks of three, for the
bushing's (or guide's) and the journal's (or slider's) body. Formulas: Haug, Computer Aided Kinematics and
Dynamics of Mechanical Systems, chapter 3; Nikravesh, Planar Multibody Dynamics.
"""

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from leg_wear_monitor.compiled.kernel import entry, kernel
from leg_wear_monitor.mechanism.arrays import PRISMATIC, Ints, MechanismArrays

DRIVE = -1


class Rows(NamedTuple):
    """Rows of the enforced closures: two per joint and one for a driven crank.

    ``closure`` (c,): joint of each closure, or ``DRIVE``; ``row`` (c,): its first row; ``body`` (m, 2):
    bodies of each row; ``overlap`` (p, 5): pairs of rows that share a moving body, as row, earlier or equal
    row, the body's slot in each, and the body; ``first`` (m,): first column of each row within the envelope
    of Phi_q M^-1 Phi_q^T; ``drive_row``: row of the drive, -1 without one.
    """

    closure: Ints
    row: Ints
    body: Ints
    overlap: Ints
    first: Ints
    drive_row: int


def select_rows(arrays: MechanismArrays, joints: Iterable[int], driven: bool) -> Rows:
    """Rows of the given joints, and of the drive if ``driven``, in an order with a small envelope."""
    sides = {joint: tuple(arrays.joint_body[joint]) for joint in joints}
    if driven:
        sides[DRIVE] = (0, arrays.drive_body)
    order = _narrow(sides)
    starts: list[int] = []
    body: list[tuple[int, ...]] = []
    for closure in order:
        starts.append(len(body))
        body += [sides[closure]] * (1 if closure == DRIVE else 2)
    overlap = [
        (r, s, i, j, body[r][i])
        for r in range(len(body))
        for s in range(r + 1)
        for i in range(2)
        for j in range(2)
        if body[r][i] == body[s][j] != 0
    ]
    first = [min([s for r2, s, *_ in overlap if r2 == r], default=r) for r in range(len(body))]
    return Rows(
        closure=np.array(order, dtype=np.int64),
        row=np.array(starts, dtype=np.int64),
        body=np.array(body, dtype=np.int64).reshape(-1, 2),
        overlap=np.array(overlap, dtype=np.int64).reshape(-1, 5),
        first=np.array(first, dtype=np.int64),
        drive_row=starts[order.index(DRIVE)] if driven else -1,
    )


def _narrow(sides: dict[int, tuple[int, ...]]) -> list[int]:
    """Order of the closures with a small envelope (Cuthill-McKee): those that share a body are neighbours."""

    def neighbours(closure: int) -> set[int]:
        moving = set(sides[closure]) - {0}
        return {other for other, bodies in sides.items() if other != closure and moving & set(bodies)}

    order: list[int] = []
    left = sorted(sides, key=lambda closure: (len(neighbours(closure)), closure))
    while left:
        queue = [left[0]]
        while queue:
            closure = queue.pop(0)
            if closure in left:
                left.remove(closure)
                order.append(closure)
                queue += sorted(
                    neighbours(closure) & set(left), key=lambda other: (len(neighbours(other)), other)
                )
    return order


@kernel
def rotations(q, out_cs):
    """Cosine and sine of every body's angle; q (n, 3), out_cs (n, 2)."""
    for i in range(q.shape[0]):
        out_cs[i, 0] = np.cos(q[i, 2])
        out_cs[i, 1] = np.sin(q[i, 2])


@kernel
def arm(cs, body, point):
    """A point (2,) [m] of a body relative to its centre of mass, in the ground's frame; cs (n, 2)."""
    c, s = cs[body, 0], cs[body, 1]
    return c * point[0] - s * point[1], s * point[0] + c * point[1]


@kernel
def closures(arrays, rows, q, v, cs, drive, out_phi, out_jac, out_gamma):
    """Residual (m,), Jacobian blocks (m, 2, 3) and gamma (m,) of every row, at q and v (n, 3).

    ``drive`` (3,) is the angle [rad], speed [rad/s] and acceleration [rad/s^2] of the crank.
    """
    for k in range(rows.closure.shape[0]):
        joint, r = rows.closure[k], rows.row[k]
        if joint == DRIVE:
            out_phi[r] = q[arrays.drive_body, 2] - drive[0]
            out_jac[r, :, :] = 0.0
            out_jac[r, 1, 2] = 1.0
            out_gamma[r] = drive[2]
        elif arrays.joint_kind[joint] == PRISMATIC:
            _prismatic(arrays, joint, r, q, v, cs, out_phi, out_jac, out_gamma)
        else:
            _revolute(arrays, joint, r, q, v, cs, out_phi, out_jac, out_gamma)


@entry
def closures_at(arrays, rows, q, v, drive, cs, out_phi, out_jac, out_gamma):
    """`closures` for calls from Python; also fills cs (n, 2)."""
    rotations(q, cs)
    closures(arrays, rows, q, v, cs, drive, out_phi, out_jac, out_gamma)


@entry
def jacobians_at(arrays, rows, q, v, drive, cs, phi, gamma, out_jac):
    """Jacobian blocks (p, m, 2, 3) at positions q (p, n, 3); v, drive, cs, phi and gamma are work arrays."""
    for p in range(q.shape[0]):
        rotations(q[p], cs)
        closures(arrays, rows, q[p], v, cs, drive, phi, out_jac[p], gamma)


@kernel
def _revolute(arrays, joint, r, q, v, cs, out_phi, out_jac, out_gamma):
    """Revolute joint, the two points coincide: phi = P_journal - P_bushing; physics.md section 1."""
    b, j = arrays.joint_body[joint, 0], arrays.joint_body[joint, 1]
    sbx, sby = arm(cs, b, arrays.joint_point[joint, 0])
    sjx, sjy = arm(cs, j, arrays.joint_point[joint, 1])
    wb2, wj2 = v[b, 2] * v[b, 2], v[j, 2] * v[j, 2]
    out_phi[r] = q[j, 0] + sjx - q[b, 0] - sbx
    out_phi[r + 1] = q[j, 1] + sjy - q[b, 1] - sby
    out_jac[r, 0, 0], out_jac[r, 0, 1], out_jac[r, 0, 2] = -1.0, 0.0, sby
    out_jac[r, 1, 0], out_jac[r, 1, 1], out_jac[r, 1, 2] = 1.0, 0.0, -sjy
    out_jac[r + 1, 0, 0], out_jac[r + 1, 0, 1], out_jac[r + 1, 0, 2] = 0.0, -1.0, -sbx
    out_jac[r + 1, 1, 0], out_jac[r + 1, 1, 1], out_jac[r + 1, 1, 2] = 0.0, 1.0, sjx
    out_gamma[r] = wj2 * sjx - wb2 * sbx
    out_gamma[r + 1] = wj2 * sjy - wb2 * sby


@kernel
def _prismatic(arrays, joint, r, q, v, cs, out_phi, out_jac, out_gamma):
    """Prismatic joint: the slider's point stays on the guide's line, its angle to the guide is constant."""
    b, j = arrays.joint_body[joint, 0], arrays.joint_body[joint, 1]
    sbx, sby = arm(cs, b, arrays.joint_point[joint, 0])
    sjx, sjy = arm(cs, j, arrays.joint_point[joint, 1])
    nx, ny = arm(cs, b, arrays.joint_normal[joint])
    dx, dy = q[j, 0] + sjx - q[b, 0] - sbx, q[j, 1] + sjy - q[b, 1] - sby
    wb, wj = v[b, 2], v[j, 2]
    dvx = v[j, 0] - wj * sjy - v[b, 0] + wb * sby
    dvy = v[j, 1] + wj * sjx - v[b, 1] - wb * sbx
    out_phi[r] = nx * dx + ny * dy
    out_phi[r + 1] = q[j, 2] - q[b, 2] - arrays.joint_angle[joint]
    out_jac[r, 0, 0], out_jac[r, 0, 1] = -nx, -ny
    out_jac[r, 0, 2] = (nx * dy - ny * dx) - (ny * sbx - nx * sby)
    out_jac[r, 1, 0], out_jac[r, 1, 1], out_jac[r, 1, 2] = nx, ny, ny * sjx - nx * sjy
    out_jac[r + 1, 0, 0], out_jac[r + 1, 0, 1], out_jac[r + 1, 0, 2] = 0.0, 0.0, -1.0
    out_jac[r + 1, 1, 0], out_jac[r + 1, 1, 1], out_jac[r + 1, 1, 2] = 0.0, 0.0, 1.0
    centripetal = nx * (wj * wj * sjx - wb * wb * sbx) + ny * (wj * wj * sjy - wb * wb * sby)
    out_gamma[r] = wb * wb * (nx * dx + ny * dy) - 2.0 * wb * (nx * dvy - ny * dvx) + centripetal
    out_gamma[r + 1] = 0.0


# Generalised forces Q of gravity, springs, loads and drive, and energy (physics.md section 2).


@kernel
def add_force(body, sx, sy, fx, fy, out_force):
    """Add a force (fx, fy) [N] on a body at (sx, sy) [m] from its centre of mass to out_force (n, 3)."""
    out_force[body, 0] += fx
    out_force[body, 1] += fy
    out_force[body, 2] += sx * fy - sy * fx


@kernel
def applied_forces(arrays, q, v, cs, out_force):
    """Generalised forces (n, 3) [N, N, N m] of gravity, springs and loads, at q and v (n, 3)."""
    for i in range(q.shape[0]):
        out_force[i, 0] = arrays.mass[i, 0] * arrays.gravity[0]
        out_force[i, 1] = arrays.mass[i, 1] * arrays.gravity[1]
        out_force[i, 2] = 0.0
    for k in range(arrays.spring_body.shape[0]):
        _add_spring(arrays, k, q, v, cs, out_force)
    for k in range(arrays.load_body.shape[0]):
        body = arrays.load_body[k]
        fx, fy = load_force(arrays, k, q[arrays.drive_body, 2])
        sx, sy = arm(cs, body, arrays.load_point[k])
        add_force(body, sx, sy, fx, fy, out_force)


@kernel
def load_force(arrays, k, crank_angle):
    """Force (2,) [N] of load k at a crank angle [rad], linear between the entries of its table."""
    i, w = _place(arrays.load_phase[k], crank_angle)
    before, after = arrays.load_force[k, i - 1], arrays.load_force[k, i]
    return before[0] + w * (after[0] - before[0]), before[1] + w * (after[1] - before[1])


@kernel
def _place(table, crank_angle):
    """Index of a table's first phase not before a crank angle [rad], and the fraction of the way to it."""
    phase = crank_angle / (2.0 * math.pi)
    phase -= math.floor(phase)
    i = 1
    while i < table.shape[0] - 1 and table[i] < phase:
        i += 1
    width = table[i] - table[i - 1]
    return i, (phase - table[i - 1]) / width if width > 0.0 else 0.0


@kernel
def controller_torque(arrays, wanted, angle, speed):
    """Torque [N m] of a controller or a constant-torque drive: feed-forward and gains on the errors, limited.

    ``wanted`` contains the angle [rad] and speed [rad/s] to follow; ``angle`` and ``speed`` are the crank's.
    """
    i, w = _place(arrays.drive_phase, wanted[0])
    before, after = arrays.drive_feed[i - 1], arrays.drive_feed[i]
    by_angle, by_speed, most = arrays.drive_gains
    torque = before + w * (after - before) + by_angle * (wanted[0] - angle) + by_speed * (wanted[1] - speed)
    return min(max(torque, -most), most)


@kernel
def _spring_line(arrays, k, q, cs):
    """Bodies, lever arms [m] and the vector [m] from the first to the second point of spring k."""
    a, b = arrays.spring_body[k, 0], arrays.spring_body[k, 1]
    sax, say = arm(cs, a, arrays.spring_point[k, 0])
    sbx, sby = arm(cs, b, arrays.spring_point[k, 1])
    return a, b, sax, say, sbx, sby, q[b, 0] + sbx - q[a, 0] - sax, q[b, 1] + sby - q[a, 1] - say


@kernel
def _add_spring(arrays, k, q, v, cs, out_force):
    """Add the force of spring and damper k on both bodies to out_force (n, 3)."""
    a, b, sax, say, sbx, sby, dx, dy = _spring_line(arrays, k, q, cs)
    length = math.hypot(dx, dy)
    if length == 0.0:
        return
    dvx = v[b, 0] - v[b, 2] * sby - v[a, 0] + v[a, 2] * say
    dvy = v[b, 1] + v[b, 2] * sbx - v[a, 1] - v[a, 2] * sax
    stiffness, free_length, damping = arrays.spring_law[k]
    pull = stiffness * (length - free_length) + damping * (dvx * dx + dvy * dy) / length
    fx, fy = pull * dx / length, pull * dy / length
    add_force(a, sax, say, fx, fy, out_force)
    add_force(b, sbx, sby, -fx, -fy, out_force)


@kernel
def stored_energy(arrays, q, v, cs):
    """Kinetic energy plus the potential energy of gravity and springs [J]."""
    energy = 0.0
    for i in range(q.shape[0]):
        for d in range(3):
            energy += 0.5 * arrays.mass[i, d] * v[i, d] * v[i, d]
        energy -= arrays.mass[i, 0] * (arrays.gravity[0] * q[i, 0] + arrays.gravity[1] * q[i, 1])
    for k in range(arrays.spring_body.shape[0]):
        dx, dy = _spring_line(arrays, k, q, cs)[6:]
        stiffness, free_length, _ = arrays.spring_law[k]
        energy += 0.5 * stiffness * (math.hypot(dx, dy) - free_length) ** 2
    return energy


@kernel
def external_power(arrays, q, v, cs):
    """Power of loads and of spring dampers [W]."""
    power = 0.0
    for k in range(arrays.load_body.shape[0]):
        body = arrays.load_body[k]
        fx, fy = load_force(arrays, k, q[arrays.drive_body, 2])
        sx, sy = arm(cs, body, arrays.load_point[k])
        power += fx * (v[body, 0] - v[body, 2] * sy) + fy * (v[body, 1] + v[body, 2] * sx)
    for k in range(arrays.spring_body.shape[0]):
        a, b, sax, say, sbx, sby, dx, dy = _spring_line(arrays, k, q, cs)
        length = math.hypot(dx, dy)
        if length > 0.0:
            rate = (v[b, 0] - v[b, 2] * sby - v[a, 0] + v[a, 2] * say) * dx
            rate += (v[b, 1] + v[b, 2] * sbx - v[a, 1] - v[a, 2] * sax) * dy
            power -= arrays.spring_law[k, 2] * (rate / length) ** 2
    return power


@entry
def applied_forces_at(arrays, q, v, cs, out_force):
    """`applied_forces` (p, n, 3) at p positions and velocities (p, n, 3); cs (n, 2) is a work array."""
    for p in range(q.shape[0]):
        rotations(q[p], cs)
        applied_forces(arrays, q[p], v[p], cs, out_force[p])


@entry
def stored_energy_at(arrays, q, v, cs, out_energy):
    """`stored_energy` (p,) at p positions and velocities (p, n, 3); cs (n, 2) is a work array."""
    for p in range(q.shape[0]):
        rotations(q[p], cs)
        out_energy[p] = stored_energy(arrays, q[p], v[p], cs)

"""Equations of motion in full coordinates (physics.md section 2)."""

import math
from typing import NamedTuple

import numpy as np

from leg_wear_monitor.compiled.kernel import entry, kernel
from leg_wear_monitor.contact.arrays import ContactArrays
from leg_wear_monitor.dynamics.joint import (
    DELTA,
    DELTA_DOT,
    EX,
    EY,
    F_N,
    F_T,
    SAMPLE,
    VX,
    VY,
    contact_energy,
    joint_force,
)
from leg_wear_monitor.dynamics.run import (
    ARCHARD,
    CONTACT,
    DISSIPATION,
    FORCE,
    FORCE_SQUARED,
    FRICTION,
    POWER,
    TORQUE,
    TORQUE_ERROR,
    TORQUE_SQUARED,
    drive_at,
)
from leg_wear_monitor.mechanism.arrays import Floats, MechanismArrays, body_names, point_from_com
from leg_wear_monitor.mechanism.constraints import (
    DRIVE,
    Rows,
    add_force,
    applied_forces,
    arm,
    closures,
    controller_torque,
    external_power,
    rotations,
    select_rows,
    stored_energy,
)
from leg_wear_monitor.mechanism.position import TURN, Linkage, one_cycle, point_motion

# Symmetric positive definite systems with a known envelope.


@kernel
def factorise(first, matrix):
    """Cholesky factor L of a matrix (m, m), in place in its lower triangle.

    ``first`` (m,) is the first column of each row's envelope. The diagonal then contains 1 / L_ii.
    Returns False if the matrix is not positive definite.
    """
    for i in range(matrix.shape[0]):
        for j in range(first[i], i):
            total = matrix[i, j]
            for k in range(max(first[i], first[j]), j):
                total -= matrix[i, k] * matrix[j, k]
            matrix[i, j] = total * matrix[j, j]
        pivot = matrix[i, i]
        for k in range(first[i], i):
            pivot -= matrix[i, k] * matrix[i, k]
        if not pivot > 0.0:
            return False
        matrix[i, i] = 1.0 / math.sqrt(pivot)
    return True


@kernel
def substitute(first, factor, out_x):
    """Solve L L^T x = b (m,) in place, with the factor (m, m) of `factorise`."""
    m = factor.shape[0]
    for i in range(m):
        total = out_x[i]
        for k in range(first[i], i):
            total -= factor[i, k] * out_x[k]
        out_x[i] = total * factor[i, i]
    for i in range(m - 1, -1, -1):
        out_x[i] *= factor[i, i]
        for k in range(first[i], i):
            out_x[k] -= factor[i, k] * out_x[i]


# Equations of motion in full coordinates (physics.md section 2).
#
# Since M is diagonal, the multipliers follow from the small symmetric system (phi_q M^-1 phi_q^T) lambda =
# phi_q M^-1 Q - gamma', which is sparse because two closures are coupled only by a common body; gamma' =
# gamma - 2 alpha phi_dot - beta^2 phi is Baumgarte's stabilised right-hand side with alpha = beta.


BAUMGARTE = 200.0  # alpha = beta [1/s]: drift decays within 5 ms, far slower than any step resolves


class FullModel(NamedTuple):
    """Constants of a run.

    ``rows``: of the ideal joints and of a drive by speed; ``contacts``: the clearance joints; ``baumgarte``:
    alpha = beta [1/s].
    """

    arrays: MechanismArrays
    rows: Rows
    contacts: ContactArrays
    baumgarte: float


class FullScratch(NamedTuple):
    """Work arrays of one evaluation, so that a step does not allocate; n bodies, m rows, k clearance joints.

    ``cs`` (n, 2): cosines and sines; ``force`` (n, 3): generalised forces; ``phi``, ``gamma`` (m,) and
    ``jac`` (m, 2, 3): closures; ``schur`` (m, m): phi_q M^-1 phi_q^T and its factor; ``lam`` (m,):
    multipliers;
    ``drive`` (3,): crank motion; ``contact`` (SAMPLE, k): samples of the clearance joints.
    """

    cs: Floats
    force: Floats
    phi: Floats
    jac: Floats
    gamma: Floats
    schur: Floats
    lam: Floats
    drive: Floats
    contact: Floats


def full_model(arrays: MechanismArrays, contacts: ContactArrays, driven: bool) -> FullModel:
    """Model with the clearance joints of ``contacts`` and all other joints ideal."""
    ideal = [joint for joint in range(len(arrays.joint_kind)) if joint not in contacts.joint]
    return FullModel(arrays, select_rows(arrays, ideal, driven), contacts, BAUMGARTE)


def full_scratch(model: FullModel) -> FullScratch:
    """Work arrays for a model."""
    n, m, k = len(model.arrays.mass), len(model.rows.body), len(model.contacts.joint)
    return FullScratch(
        cs=np.zeros((n, 2)),
        force=np.zeros((n, 3)),
        phi=np.zeros(m),
        jac=np.zeros((m, 2, 3)),
        gamma=np.zeros(m),
        schur=np.zeros((m, m)),
        lam=np.zeros(m),
        drive=np.zeros(3),
        contact=np.zeros((SAMPLE, k)),
    )


@kernel
def eccentricity(model, k, q, v, cs):
    """Eccentricity of clearance joint k (physics.md section 3).

    Returns
    -------
    ex, ey, vx, vy, b, j, sbx, sby
        Eccentricity [m], its rate [m/s], bodies of bushing and journal, and the bushing's centre relative to
        the centre of mass of its body [m].
    """
    joint = model.contacts.joint[k]
    b, j = model.arrays.joint_body[joint, 0], model.arrays.joint_body[joint, 1]
    sbx, sby = arm(cs, b, model.arrays.joint_point[joint, 0])
    sjx, sjy = arm(cs, j, model.arrays.joint_point[joint, 1])
    ex, ey = q[j, 0] + sjx - q[b, 0] - sbx, q[j, 1] + sjy - q[b, 1] - sby
    vx = v[j, 0] - v[j, 2] * sjy - v[b, 0] + v[b, 2] * sby
    vy = v[j, 1] + v[j, 2] * sjx - v[b, 1] - v[b, 2] * sbx
    return ex, ey, vx, vy, b, j, sbx, sby


@kernel
def add_contacts(model, surfaces, approach, q, v, scratch, out_rate):
    """Add the contact forces of the clearance joints; set their samples and rates (j, JOINT_RATES)."""
    contacts = model.contacts
    for k in range(contacts.joint.shape[0]):
        ex, ey, vx, vy, b, j, sbx, sby = eccentricity(model, k, q, v, scratch.cs)
        f_n, f_t, delta, delta_dot, slip, nx, ny, elastic, moment = joint_force(
            contacts, surfaces, k, ex, ey, vx, vy, q[b, 2], q[j, 2], v[b, 2], v[j, 2], approach[k]
        )
        sample = scratch.contact
        sample[EX, k], sample[EY, k], sample[VX, k], sample[VY, k] = ex, ey, vx, vy
        sample[F_N, k], sample[F_T, k], sample[DELTA, k], sample[DELTA_DOT, k] = f_n, f_t, delta, delta_dot
        rate = out_rate[contacts.joint[k]]
        rate[:] = 0.0
        if f_n > 0.0:
            fx, fy = -f_n * nx - f_t * ny, -f_n * ny + f_t * nx
            px, py = sbx + contacts.bushing_radius[k] * nx, sby + contacts.bushing_radius[k] * ny
            add_force(b, px, py, -fx, -fy, scratch.force)
            add_force(j, q[b, 0] + px - q[j, 0], q[b, 1] + py - q[j, 1], fx, fy, scratch.force)
            scratch.force[b, 2] -= moment
            scratch.force[j, 2] += moment
            rate[FORCE_SQUARED] = f_n * f_n + f_t * f_t
            rate[FORCE] = np.sqrt(rate[FORCE_SQUARED])
            rate[CONTACT] = 1.0
            rate[FRICTION] = -f_t * slip
            rate[ARCHARD] = f_n * abs(slip)
        rate[DISSIPATION] = (f_n - elastic) * delta_dot


@kernel
def assemble_schur(rows, arrays, jac, out_schur):
    """Lower triangle of phi_q M^-1 phi_q^T (m, m), from the pairs of rows that share a body."""
    for i in range(out_schur.shape[0]):
        for j in range(rows.first[i], i + 1):
            out_schur[i, j] = 0.0
    for p in range(rows.overlap.shape[0]):
        r, s, i, j, body = rows.overlap[p]
        w = arrays.inverse_mass[body]
        out_schur[r, s] += (
            jac[r, i, 0] * w[0] * jac[s, j, 0]
            + jac[r, i, 1] * w[1] * jac[s, j, 1]
            + jac[r, i, 2] * w[2] * jac[s, j, 2]
        )


@kernel
def accelerate(model, surfaces, approach, polynomial, t, q, v, scratch, out_a, out_rate, out_drive_rate):
    """Accelerations (n, 3) and multipliers at time t [s], and the rates of the statistics' integrals.

    ``approach`` (k,) [m/s] contains the approach speed of each clearance joint in contact, 0 for open joints.
    Returns False if the closures are singular.
    """
    arrays, rows = model.arrays, model.rows
    rotations(q, scratch.cs)
    applied_forces(arrays, q, v, scratch.cs, scratch.force)
    add_contacts(model, surfaces, approach, q, v, scratch, out_rate)
    drive_at(polynomial, t, scratch.drive)
    torque = 0.0
    if rows.drive_row < 0:
        crank = arrays.drive_body
        torque = controller_torque(arrays, scratch.drive, q[crank, 2], v[crank, 2])
        scratch.force[crank, 2] += torque
    closures(arrays, rows, q, v, scratch.cs, scratch.drive, scratch.phi, scratch.jac, scratch.gamma)
    _right_hand_side(model, v, scratch)
    assemble_schur(rows, arrays, scratch.jac, scratch.schur)
    if not factorise(rows.first, scratch.schur):
        return False
    substitute(rows.first, scratch.schur, scratch.lam)
    _accelerations(model, scratch, out_a)
    _ideal_rates(model, q, v, torque, scratch, out_rate, out_drive_rate)
    return True


@kernel
def _right_hand_side(model, v, scratch):
    """Right-hand side phi_q M^-1 Q - gamma' (m,), stored in ``scratch.lam``."""
    alpha = model.baumgarte
    for r in range(scratch.lam.shape[0]):
        phi_dot = -scratch.drive[1] if r == model.rows.drive_row else 0.0
        total = 0.0
        for i in range(2):
            body = model.rows.body[r, i]
            for d in range(3):
                phi_dot += scratch.jac[r, i, d] * v[body, d]
                total += scratch.jac[r, i, d] * model.arrays.inverse_mass[body, d] * scratch.force[body, d]
        scratch.lam[r] = total - scratch.gamma[r] + 2.0 * alpha * phi_dot + alpha * alpha * scratch.phi[r]


@kernel
def _accelerations(model, scratch, out_a):
    """Accelerations M^-1 (Q - phi_q^T lambda), out_a (n, 3)."""
    inverse_mass = model.arrays.inverse_mass
    for i in range(out_a.shape[0]):
        for d in range(3):
            out_a[i, d] = inverse_mass[i, d] * scratch.force[i, d]
    for r in range(scratch.lam.shape[0]):
        for i in range(2):
            body = model.rows.body[r, i]
            for d in range(3):
                out_a[body, d] -= inverse_mass[body, d] * scratch.jac[r, i, d] * scratch.lam[r]


@kernel
def _ideal_rates(model, q, v, torque, scratch, out_rate, out_drive_rate):
    """Rates of the integrals of ideal joints and of the drive; the drive's power includes the loads' power.

    ``torque`` [N m] is the torque of a controller or constant-torque drive.
    """
    for c in range(model.rows.closure.shape[0]):
        joint, r = model.rows.closure[c], model.rows.row[c]
        if joint == DRIVE:
            torque = -scratch.lam[r]
            continue
        squared = scratch.lam[r] ** 2
        if model.arrays.joint_kind[joint] == 0:
            squared += scratch.lam[r + 1] ** 2
        out_rate[joint, FORCE] = np.sqrt(squared)
        out_rate[joint, FORCE_SQUARED] = squared
    out_drive_rate[TORQUE] = torque
    out_drive_rate[TORQUE_SQUARED] = torque * torque
    out_drive_rate[POWER] = external_power(model.arrays, q, v, scratch.cs)
    out_drive_rate[POWER] += torque * v[model.arrays.drive_body, 2]


@entry
def total_energy(model, surfaces, q, v, scratch):
    """Kinetic energy plus the potential energy of gravity, springs and contacts [J]."""
    rotations(q, scratch.cs)
    energy = stored_energy(model.arrays, q, v, scratch.cs)
    for k in range(model.contacts.joint.shape[0]):
        ex, ey, _, _, b, j, _, _ = eccentricity(model, k, q, v, scratch.cs)
        energy += contact_energy(model.contacts, surfaces, k, ex, ey, q[b, 2], q[j, 2])
    return energy


# Deviation of the toe and of the drive torque from the ideal linkage at the same crank angle.


POINTS = 1440  # table points per cycle: the error of cubic interpolation is 1e-9 of the curve's range


class Toe(NamedTuple):
    """The toe and its ideal motion.

    ``body``: index of its body, -1 without a toe; ``point`` (2,) [m]: from the centre of mass, in the body's
    frame; ``ideal`` (N, 7): position [m], velocity [m/s], acceleration [m/s^2] and drive torque [N m] at N
    equal steps of the crank.
    """

    body: int
    point: Floats
    ideal: Floats


NO_TOE = Toe(-1, np.zeros(2), np.zeros((1, 7)))


def ideal_toe(linkage: Linkage, speed: float) -> Toe:
    """The toe with its ideal motion at a crank speed [rad/s]; `NO_TOE` for a mechanism without a toe."""
    mechanism = linkage.mechanism
    if mechanism.toe is None:
        return NO_TOE
    body, point = mechanism.toe
    motion = one_cycle(linkage, POINTS, speed)
    ideal = np.column_stack([*point_motion(motion, linkage, body, point), motion.drive_torque])
    return Toe(body_names(mechanism).index(body), np.array(point_from_com(mechanism, body, point)), ideal)


@kernel
def interpolate(table, column, crank_angle):
    """Value of a column of a periodic table (N, m) at a crank angle [rad], cubic through four points."""
    n = table.shape[0]
    u = crank_angle / TURN * n
    floor = math.floor(u)
    i, w = int(floor) % n, u - floor
    a, b = table[(i - 1) % n, column], table[i, column]
    c, d = table[(i + 1) % n, column], table[(i + 2) % n, column]
    outer = -w * (w - 1.0) * (w - 2.0) / 6.0 * a + (w + 1.0) * w * (w - 1.0) / 6.0 * d
    return outer + (w + 1.0) * (w - 1.0) * (w - 2.0) / 2.0 * b - (w + 1.0) * w * (w - 2.0) / 2.0 * c


@kernel
def toe_motion(toe, cs, q, v, a):
    """Position [m], velocity [m/s] and acceleration [m/s^2] of the toe, x and y each; q, v, a (n, 3)."""
    i = toe.body
    sx, sy = arm(cs, i, toe.point)
    w, alpha = v[i, 2], a[i, 2]
    return (
        q[i, 0] + sx,
        q[i, 1] + sy,
        v[i, 0] - w * sy,
        v[i, 1] + w * sx,
        a[i, 0] - alpha * sy - w * w * sx,
        a[i, 1] + alpha * sx - w * w * sy,
    )


@kernel
def compare_toe(toe, crank_angle, cs, q, v, a, torque, out_response):
    """Update the largest deviations out_response (4,) of toe and drive torque; no effect without a toe."""
    if toe.body < 0:
        return
    motion = toe_motion(toe, cs, q, v, a)
    for i in range(3):
        dx = motion[2 * i] - interpolate(toe.ideal, 2 * i, crank_angle)
        dy = motion[2 * i + 1] - interpolate(toe.ideal, 2 * i + 1, crank_angle)
        out_response[i] = max(out_response[i], math.hypot(dx, dy))
    error = abs(torque - interpolate(toe.ideal, 6, crank_angle))
    out_response[TORQUE_ERROR] = max(out_response[TORQUE_ERROR], error)

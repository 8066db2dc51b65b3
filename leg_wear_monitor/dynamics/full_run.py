"""A leg in full coordinates: equations of motion, adaptive steps, contact events (physics.md section 2)."""

import math
from typing import NamedTuple

import numpy as np

from leg_wear_monitor.compiled.kernel import entry, kernel
from leg_wear_monitor.compiled.vectors import copy_array
from leg_wear_monitor.contact.arrays import ContactArrays
from leg_wear_monitor.dynamics.joint import (
    DELTA,
    DELTA_DOT,
    EX,
    EY,
    F_N,
    F_T,
    NEVER,
    SAMPLE,
    VX,
    VY,
    contact_energy,
    first_contact_event,
    joint_force,
    pushed_through,
    update_contacts,
    wear_joint,
)
from leg_wear_monitor.dynamics.run import (
    ARCHARD,
    CONTACT,
    DISSIPATION,
    DONE,
    DRIVE_RATES,
    FORCE,
    FORCE_SQUARED,
    FRICTION,
    JOINT_RATES,
    NODES,
    POWER,
    PUSHED_THROUGH,
    SINGULAR,
    STAGES,
    STEP_TOO_SMALL,
    TORQUE,
    TORQUE_ERROR,
    TORQUE_SQUARED,
    WEIGHTS,
    RunStatistics,
    Sample,
    Setup,
    add_step,
    drive_at,
    error_norm,
    new_run_statistics,
    next_step,
    stage_state,
    steady_drive,
    stop,
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
from leg_wear_monitor.mechanism.position import (
    TURN,
    Linkage,
    ideal_motion,
    one_cycle,
    point_motion,
    rotated,
)
from leg_wear_monitor.mechanism.spec import SpeedDrive, TorqueDrive
from leg_wear_monitor.wear import BUSHING

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


# Time integration in full coordinates: adaptive steps and contact events (physics.md section 2).
#
# The local error of every step is below a tolerance in every coordinate and velocity (Dormand-Prince 5(4)).
# If a contact would begin within a step, the step is shortened to end at the contact's start, to 1e-11 m.


LONGEST_STEP = 1.0e-3  # s: its product with Baumgarte's alpha is well inside the region of stability
_SHORTEST_STEP = 1.0e-14  # s


class FullState(NamedTuple):
    """Complete state of a run, the surfaces aside.

    ``y`` (6 n,): coordinates, then velocities, of n bodies [m, m, rad; per s]; ``clock`` (2,) [s]: time, and
    the next trial step; ``approach`` (k,) [m/s]: approach speed of each clearance joint in contact, 0 for
    open joints; ``recent`` (k, 4): its last two samples of time [s] and normal force [N].
    """

    y: Floats
    clock: Floats
    approach: Floats
    recent: Floats


class FullWork(NamedTuple):
    """Work arrays of a step, for n bodies, j joints and k clearance joints.

    ``slope`` (7, 6 n): slopes of the stages; ``trial`` (6 n,): trial state; ``rates`` (7, j, JOINT_RATES),
    ``drive_rates`` (7, DRIVE_RATES): rates of the statistics' integrals; ``start`` (SAMPLE, k): samples at
    its start; ``scale`` (6 n,): error tolerances; ``weight`` (N,): of the wear on an arc; ``scratch``.
    """

    slope: Floats
    trial: Floats
    rates: Floats
    drive_rates: Floats
    start: Floats
    scale: Floats
    weight: Floats
    scratch: FullScratch


def full_state(q: Floats, v: Floats, clearance_joints: int) -> FullState:
    """Initial state with open joints: coordinates q (n, 3) and velocities v (n, 3)."""
    y = np.concatenate([q.ravel(), v.ravel()])
    return FullState(y, np.array([0.0, 1.0e-6]), np.zeros(clearance_joints), np.zeros((clearance_joints, 4)))


def full_work(model: FullModel, tolerance_m: float, tolerance_mps: float, sectors: int) -> FullWork:
    """Work arrays; the tolerances apply to a step's local error, of coordinates and of velocities."""
    n, k = len(model.arrays.mass), len(model.contacts.joint)
    joints = len(model.arrays.joint_kind)
    return FullWork(
        slope=np.zeros((STAGES, 6 * n)),
        trial=np.zeros(6 * n),
        rates=np.zeros((STAGES, joints, JOINT_RATES)),
        drive_rates=np.zeros((STAGES, DRIVE_RATES)),
        start=np.zeros((SAMPLE, k)),
        scale=np.concatenate([np.full(3 * n, tolerance_m), np.full(3 * n, tolerance_mps)]),
        weight=np.zeros(sectors),
        scratch=full_scratch(model),
    )


@kernel
def _slope(model, surfaces, approach, polynomial, t, y, s, work):
    """Slope of stage s for state y (6 n,) at t [s]: velocities, then accelerations; False if singular."""
    half = y.shape[0] // 2
    for i in range(half):
        work.slope[s, i] = y[half + i]
    q, v = y[:half].reshape(-1, 3), y[half:].reshape(-1, 3)
    a = work.slope[s, half:].reshape(-1, 3)
    return accelerate(
        model, surfaces, approach, polynomial, t, q, v, work.scratch, a, work.rates[s], work.drive_rates[s]
    )


@kernel
def _try_step(model, surfaces, state, polynomial, h, work):
    """Trial step of length h [s]: its end in ``work.trial``; returns the local error over the tolerance."""
    t = state.clock[0]
    for s in range(1, STAGES):
        stage_state(s, h, state.y, work.slope, work.trial)
        if not _slope(model, surfaces, state.approach, polynomial, t + NODES[s] * h, work.trial, s, work):
            return math.inf
    return error_norm(h, work.slope, work.scale)


@kernel
def slope_here(model, surfaces, state, polynomial, work):
    """Evaluate the first stage of the next step at the present state; False if the closures are singular."""
    good = _slope(model, surfaces, state.approach, polynomial, state.clock[0], state.y, 0, work)
    copy_array(work.scratch.contact, work.start)
    return good


@kernel
def _accept(model, surfaces, state, h, toe, statistics, work):
    """Accept the trial step of length h [s]: statistics, wear, contact events.

    Returns whether a contact began or ended.
    """
    arrays, contacts, scratch = model.arrays, model.contacts, work.scratch
    half = state.y.shape[0] // 2
    q, v = work.trial[:half].reshape(-1, 3), work.trial[half:].reshape(-1, 3)
    last = STAGES - 1
    statistics.steps[1] += 1
    add_step(statistics, h, WEIGHTS, work.rates, work.drive_rates)
    a = work.slope[last, half:].reshape(-1, 3)
    torque = work.drive_rates[last, TORQUE]
    compare_toe(toe, q[arrays.drive_body, 2], scratch.cs, q, v, a, torque, statistics.response)
    for k in range(contacts.joint.shape[0]):
        if state.approach[k] > 0.0:
            joint = contacts.joint[k]
            integral = 0.0
            for s in range(STAGES):
                integral += h * WEIGHTS[s] * work.rates[s, joint, ARCHARD]
            b, j = arrays.joint_body[joint, 0], arrays.joint_body[joint, 1]
            ex, ey = scratch.contact[EX, k], scratch.contact[EY, k]
            here = (ex, ey, q[b, 2], q[j, 2])
            statistics.worn_energy[0] += wear_joint(
                contacts, surfaces, k, ex, ey, q[b, 2], q[j, 2], here, integral, work.weight
            )
    changed, _ = update_contacts(
        contacts.joint, contacts.speed_floor, state.clock[0], h, work.start, scratch.contact,
        state.approach, state.recent, statistics.peak, statistics.impact, statistics.impacts,
    )  # fmt: skip
    copy_array(work.trial, state.y)
    state.clock[0] += h
    copy_array(work.slope[last], work.slope[0])
    copy_array(work.rates[last], work.rates[0])
    copy_array(work.drive_rates[last], work.drive_rates[0])
    copy_array(scratch.contact, work.start)
    return changed


@entry
def advance_full(model, surfaces, state, polynomial, t_end, toe, statistics, work):
    """Advance the state to t_end [s] and add to the run statistics.

    Returns
    -------
    status, k
        DONE, or the reason for stopping and the clearance joint concerned (-1 if none). The state is then the
        last accepted one.
    """
    scratch = work.scratch
    if not slope_here(model, surfaces, state, polynomial, work):
        return SINGULAR, -1
    cut = NEVER  # fraction of the last trial step after which a contact began
    while state.clock[0] < t_end:
        h = state.clock[1]
        left = t_end - state.clock[0]
        if cut < 1.0:
            h *= cut
        ends = h >= left * (1.0 - 1.0e-12)
        if ends:
            h = left
        statistics.steps[0] += 1
        error = _try_step(model, surfaces, state, polynomial, h, work)
        if not error <= 1.0:
            state.clock[1] = next_step(h, error, 1.0)
            cut = NEVER
            if state.clock[1] < _SHORTEST_STEP:
                return STEP_TOO_SMALL, pushed_through(model.contacts.bushing_radius, scratch.contact)
            continue
        fraction = first_contact_event(state.approach, h, work.start, scratch.contact)
        if fraction < 1.0 and fraction * h > _SHORTEST_STEP:
            cut = fraction * h / state.clock[1]
            continue
        pushed = pushed_through(model.contacts.bushing_radius, scratch.contact)
        if pushed >= 0:
            return PUSHED_THROUGH, pushed
        if not ends and cut == NEVER:
            state.clock[1] = min(LONGEST_STEP, next_step(h, error, 5.0))
        cut = NEVER
        changed = _accept(model, surfaces, state, h, toe, statistics, work)
        if changed and not slope_here(model, surfaces, state, polynomial, work):
            return SINGULAR, -1
        if ends:
            state.clock[0] = t_end
    return DONE, -1


# The full-coordinate formulation as a `Run`.


# local error of a step in every coordinate [m, rad]; the energy residual is 1e-3 of the losses
TOLERANCE_M = 1.0e-10
TOLERANCE_RATE = 1.0e4  # 1/s: ratio of the velocities' tolerance to it, the reciprocal duration of a contact


class FullRun:
    """A leg in full coordinates that starts from its ideal motion, journals centred (physics.md section 2).

    Parameters
    ----------
    setup : Setup
    tolerance_m : float
        Local error allowed in a step [m or rad]; for velocities, `TOLERANCE_RATE` times it per second.

    Attributes
    ----------
    state : FullState
        Complete state, the surfaces aside.
    """

    def __init__(self, setup: Setup, tolerance_m: float = TOLERANCE_M) -> None:
        linkage = setup.linkage
        driven = isinstance(linkage.mechanism.drive, SpeedDrive)
        self._setup = setup
        self.model = full_model(linkage.arrays, setup.contacts, driven)
        self.state = _start(setup)
        self.toe: Toe = ideal_toe(linkage, setup.speed) if driven else NO_TOE
        self.polynomial = steady_drive(0.0, setup.speed)
        sectors = setup.surfaces.depth.shape[2]
        self._work = full_work(self.model, tolerance_m, tolerance_m * TOLERANCE_RATE, sectors)
        self.advance(0.0, new_run_statistics(0))  # evaluates the initial state for `sample`

    @property
    def time(self) -> float:
        """Time reached [s]."""
        return float(self.state.clock[0])

    @property
    def q(self) -> Floats:
        """Coordinates (n, 3): centre of mass [m] and angle [rad] of every body, ground first."""
        return self.state.y[: len(self.state.y) // 2].reshape(-1, 3)

    @property
    def v(self) -> Floats:
        """Velocities (n, 3)."""
        return self.state.y[len(self.state.y) // 2 :].reshape(-1, 3)

    @property
    def lam(self) -> Floats:
        """Multipliers (m,) of the ideal joints' rows and the drive's, in the order of ``model.rows``."""
        return self._work.scratch.lam

    @property
    def stored_energy(self) -> float:
        """Kinetic energy plus the potential energy of gravity, springs and contacts [J]."""
        energy = total_energy(self.model, self._setup.surfaces, self.q, self.v, self._work.scratch)
        return float(energy)

    def advance(self, t_end: float, statistics: RunStatistics) -> None:
        """Advance to a time [s] and add to run statistics.

        Raises
        ------
        SimulationError
            If the motion diverges; names the joint, the time and a remedy.
        """
        status, k = advance_full(
            self.model,
            self._setup.surfaces,
            self.state,
            self.polynomial,
            t_end,
            self.toe,
            statistics,
            self._work,
        )
        if status != DONE:
            raise stop(self._setup, status, k, self.time)

    def sample(self) -> Sample:
        """The present state of the leg."""
        work, toe = self._work, np.zeros((3, 2))
        if self.toe.body >= 0:
            x, y, angle = self.q[self.toe.body]
            turning, slope = self.v[self.toe.body], work.slope[0].reshape(2, -1, 3)[1, self.toe.body]
            lever = rotated(self.toe.point, angle)
            across = np.array([-lever[1], lever[0]])
            toe[0] = x + lever[0], y + lever[1]
            toe[1] = turning[:2] + turning[2] * across
            toe[2] = slope[:2] + slope[2] * across - turning[2] ** 2 * lever
        return Sample(
            float(self.q[self.model.arrays.drive_body, 2]),
            toe,
            float(work.drive_rates[0, TORQUE]),
            work.rates[0, :, FORCE].copy(),
            work.start.copy(),
            self.state.approach > 0.0,
            self._setup.surfaces.depth[:, BUSHING].max(axis=1),
        )


def _start(setup: Setup) -> FullState:
    """Initial state: the ideal motion at crank angle 0, or at the assembly's angle for a constant torque."""
    mechanism = setup.linkage.mechanism
    angle = mechanism.assembly.crank_angle if isinstance(mechanism.drive, TorqueDrive) else 0.0
    motion = ideal_motion(setup.linkage, [angle], setup.speed)
    return full_state(motion.q[0], motion.v[0], len(setup.clearance_joints))

"""Everything of the leg but its contacts, as tables over the crank angle (physics.md section 7).

With X = J^-1 at centred journals, J the Jacobian of all closures and the drive, the columns of X that
belong to the loose joints are S and the drive's is s:

    v = S e' + s w,    a = S e'' + s w' + 2 w S_t e' + w^2 s_t      (_t: derivative by the crank angle)

Projected on X, M a = Q + Q_contact + J^T f gives the motion of the eccentricities e (rows of S), the
drive torque (row of s) and the reactions of the ideal joints (all other rows). What is left out is of
the order of the eccentricity over the link lengths.
"""

from typing import NamedTuple

import numpy as np

from leg_wear_monitor.contact.arrays import ContactArrays
from leg_wear_monitor.mechanism.arrays import Floats, Ints, MechanismArrays, body_names, point_from_com
from leg_wear_monitor.mechanism.constraints import DRIVE, rotations
from leg_wear_monitor.mechanism.forces import applied_forces, stored_energy
from leg_wear_monitor.mechanism.ideal import IdealMotion, one_cycle
from leg_wear_monitor.mechanism.position import Linkage, evaluate

POINTS = 1024  # of a turn; tables are linear between them


class ClearanceTables(NamedTuple):
    """Tables at N equal steps of the crank, the first repeated at the end; k loose joints, d = 2 k.

    ``inverse_mass`` (N + 1, d, d) is (S^T M S)^-1, ``coriolis`` (N + 1, d, d) and ``viscous`` (N + 1 or 0,
    d, d + 1) give accelerations from w e' and from (e', w); ``damper`` (N + 1 or 0, d + 1, d + 1) the power
    that dampers take as a quadratic form of (e', w); ``free`` (N + 1, 3, d) is the acceleration of
    the eccentricities without contact by 1, w' and w^2; ``lever`` (N + 1, k, d) and ``lever_drive``
    (N + 1, k) the slip of each joint by e' and w beyond t . e'; ``lever_response`` (N + 1, k, d) the
    acceleration by its friction force; ``reaction`` (N + 1, r, 4 + 3 d + k) the drive torque and the
    reactions of the ideal joints by (1, w', w^2, w, e'', w e', e', F_t), ``reaction_joint`` (r,) the joint
    of each row, ``DRIVE`` first; ``angle`` (N + 1, k, 2) the angles of bushing's and journal's bodies;
    ``toe`` (N + 1, 2, 1 + 2 d) the toe by (1, e) and its derivative by the crank angle by e;
    ``energy`` (N + 1, d + 2, d + 2) the quadratic form of (e', w, 1) that is the kinetic energy, with the
    potential energy at centred journals in its corner, and ``push`` (N + 1, d) minus its gradient by e;
    ``load_power`` (N + 1, d + 1) the power of loads by (e', w).
    """

    inverse_mass: Floats
    coriolis: Floats
    viscous: Floats
    damper: Floats
    free: Floats
    lever: Floats
    lever_drive: Floats
    lever_response: Floats
    reaction: Floats
    reaction_joint: Ints
    angle: Floats
    toe: Floats
    energy: Floats
    push: Floats
    load_power: Floats


def build_tables(linkage: Linkage, contacts: ContactArrays, points: int = POINTS) -> ClearanceTables:
    """Tables of a linkage with the joints of ``contacts`` loose.

    Parameters
    ----------
    linkage : Linkage
    contacts : ContactArrays
    points : int
        Steps of the crank in a turn.

    Raises
    ------
    AssemblyError
        If the crank cannot turn.
    """
    motion = one_cycle(linkage, points, 1.0)
    x = _inverse_jacobians(linkage, motion)
    loose = _rows(linkage, contacts.joint)
    drive = linkage.rows.drive_row
    ideal = [row for row in range(x.shape[2]) if row not in loose and row != drive]
    mass = linkage.arrays.mass[1:].ravel()

    s = x[:, :, loose]
    s_t, s_drive, s_drive_t = _derivative(s), x[:, :, drive], motion.a[:, 1:].reshape(points, -1)
    inverse_mass = np.linalg.inv(_project(s, mass[:, None] * s))
    force, load, damping = _forces(linkage, motion)
    friction = _friction_levers(linkage.arrays, contacts)

    def respond(generalised: Floats) -> Floats:
        """Acceleration of the eccentricities by forces (N, 3 b, m) -> (N, d, m)."""
        return inverse_mass @ _project(s, generalised)

    column = {"motion": np.concatenate([s, s_drive[:, :, None]], axis=2)}
    drag = damping @ column["motion"] if damping.size else np.zeros((0, len(mass), len(loose) + 1))
    free = np.stack([force, -mass * s_drive, -mass * s_drive_t], axis=2)
    selected = x[:, :, [drive, *ideal]]
    by = [-force[:, :, None], (mass * s_drive)[:, :, None], (mass * s_drive_t)[:, :, None]]
    by += [drag[:, :, -1:], mass[:, None] * s, 2.0 * mass[:, None] * s_t, drag[:, :, :-1]] if drag.size else [
        np.zeros_like(by[0]), mass[:, None] * s, 2.0 * mass[:, None] * s_t, np.zeros_like(s)
    ]  # fmt: skip
    by.append(np.broadcast_to(-friction, (points, *friction.shape)))
    joint_of = {row: closure for closure, start in zip(linkage.rows.closure, linkage.rows.row, strict=True)
                for row in range(start, start + (1 if closure == DRIVE else 2))}  # fmt: skip
    tables = ClearanceTables(
        inverse_mass=inverse_mass,
        coriolis=-2.0 * respond(mass[:, None] * s_t),
        viscous=-inverse_mass @ _project(s, drag) if drag.size else np.zeros((0, len(loose), len(loose) + 1)),
        damper=_project(column["motion"], drag) if drag.size else np.zeros((0, len(loose) + 1, len(loose) + 1)),
        free=respond(free).transpose(0, 2, 1),
        lever=_project(s, np.broadcast_to(friction, (points, *friction.shape))).transpose(0, 2, 1),
        lever_drive=s_drive @ friction,
        lever_response=respond(np.broadcast_to(friction, (points, *friction.shape))).transpose(0, 2, 1),
        reaction=_project(selected, np.concatenate(by, axis=2)),
        reaction_joint=np.array([joint_of[row] for row in [drive, *ideal]], dtype=np.int64),
        angle=motion.q[:, linkage.arrays.joint_body[contacts.joint], 2],
        toe=_toe(linkage, motion, s, s_t),
        energy=_energy(linkage, motion, column["motion"], mass),
        push=_project(s, (force - load)[:, :, None])[:, :, 0],
        load_power=_project(column["motion"], load[:, :, None])[:, :, 0],
    )
    return _closed(tables, motion)


def _project(basis: Floats, forces: Floats) -> Floats:
    """Transpose of a basis (N, 3 b, m) times forces (N, 3 b, p)."""
    return np.ascontiguousarray(basis.transpose(0, 2, 1) @ forces)


def _inverse_jacobians(linkage: Linkage, motion: IdealMotion) -> Floats:
    jacobians = [
        evaluate(linkage, q, np.zeros_like(q), (angle, 0.0, 0.0)).jacobian
        for q, angle in zip(motion.q, motion.crank_angle, strict=True)
    ]
    return np.asarray(np.linalg.inv(np.array(jacobians)))


def _rows(linkage: Linkage, joints: Ints) -> list[int]:
    """Rows of the given joints in the Jacobian, x before y, in the given order."""
    start = dict(zip(linkage.rows.closure.tolist(), linkage.rows.row.tolist(), strict=True))
    return [start[int(joint)] + i for joint in joints for i in range(2)]


def _derivative(table: Floats) -> Floats:
    """Derivative by the crank angle of a smooth periodic table (N, ...), by its Fourier series."""
    order = np.fft.rfftfreq(len(table), 1.0 / len(table)).reshape(-1, *([1] * (table.ndim - 1)))
    return np.asarray(np.fft.irfft(1j * order * np.fft.rfft(table, axis=0), len(table), axis=0))


def _forces(linkage: Linkage, motion: IdealMotion) -> tuple[Floats, Floats, Floats]:
    """Applied forces (N, 3 b), the share of loads in them, and damping (N, 3 b, 3 b), empty without dampers."""
    arrays = linkage.arrays
    unloaded = arrays._replace(load_body=arrays.load_body[:0])
    shape = (len(motion.q), motion.q.shape[1] - 1, 3)
    force, bare = np.zeros((2, *shape))
    damped = bool((arrays.spring_law[:, 2] > 0.0).any())
    damping = np.zeros((len(motion.q), shape[1] * 3, shape[1] * 3) if damped else (0, 0, 0))
    for i, q in enumerate(motion.q):
        force[i] = _force_at(arrays, q, np.zeros_like(q))
        bare[i] = _force_at(unloaded, q, np.zeros_like(q)) if len(arrays.load_body) else force[i]
        for j in range(shape[1] * 3 if damped else 0):
            v = np.zeros(q.size)
            v[3 + j] = 1.0
            damping[i, :, j] = (force[i] - _force_at(arrays, q, v.reshape(q.shape))).ravel()
    flat = (len(motion.q), -1)
    return force.reshape(flat), (force - bare).reshape(flat), damping


def _force_at(arrays: MechanismArrays, q: Floats, v: Floats) -> Floats:
    cs, force = np.empty((len(q), 2)), np.empty_like(q)
    rotations(q, cs)
    applied_forces(arrays, q, v, cs, force)
    return force[1:]


def _friction_levers(arrays: MechanismArrays, contacts: ContactArrays) -> Floats:
    """Generalised forces (3 b, k) of a unit friction force in each joint, beyond its force on e."""
    levers = np.zeros((arrays.mass.size, len(contacts.joint)))
    for k, joint in enumerate(contacts.joint):
        b, j = arrays.joint_body[joint]
        levers[3 * b + 2, k] -= contacts.bushing_radius[k]
        levers[3 * j + 2, k] += contacts.bushing_radius[k] - contacts.clearance[k]
    return levers[3:]


def _toe(linkage: Linkage, motion: IdealMotion, s: Floats, s_t: Floats) -> Floats:
    n, d = len(motion.q), s.shape[2]
    toe = np.zeros((n, 2, 1 + 2 * d))
    if linkage.mechanism.toe is None:
        return toe
    body, point = linkage.mechanism.toe
    i = body_names(linkage.mechanism).index(body)
    px, py = point_from_com(linkage.mechanism, body, point)
    cos, sin = np.cos(motion.q[:, i, 2]), np.sin(motion.q[:, i, 2])
    lever = np.stack([cos * px - sin * py, sin * px + cos * py], axis=1)
    across = np.stack([-lever[:, 1], lever[:, 0]], axis=1)[:, :, None]
    row, turn = 3 * (i - 1), motion.v[:, i, 2, None, None]
    toe[:, :, 0] = motion.q[:, i, :2] + lever
    toe[:, :, 1 : 1 + d] = s[:, row : row + 2] + across * s[:, row + 2, None]
    toe[:, :, 1 + d :] = (
        s_t[:, row : row + 2] + across * s_t[:, row + 2, None] - turn * lever[:, :, None] * s[:, row + 2, None]
    )
    return toe


def _energy(linkage: Linkage, motion: IdealMotion, basis: Floats, mass: Floats) -> Floats:
    n, m = len(motion.q), basis.shape[2]
    energy = np.zeros((n, m + 1, m + 1))
    energy[:, :m, :m] = 0.5 * _project(basis, mass[:, None] * basis)
    for i, q in enumerate(motion.q):
        cs = np.empty((len(q), 2))
        rotations(q, cs)
        energy[i, m, m] = stored_energy(linkage.arrays, q, np.zeros_like(q), cs)
    return energy


def _closed(tables: ClearanceTables, motion: IdealMotion) -> ClearanceTables:
    """Repeat the first row at the end; angles go on to the next turn."""
    closed = {
        name: np.ascontiguousarray(np.concatenate([table, table[:1]]) if len(table) == len(motion.q) else table)
        for name, table in tables._asdict().items()
        if name != "reaction_joint"
    }
    step = closed["angle"][-2] - closed["angle"][-3]
    turn = 2.0 * np.pi * np.round((closed["angle"][-2] + step - closed["angle"][0]) / (2.0 * np.pi))
    closed["angle"][-1] += turn
    return tables._replace(**closed)

"""Everything of the leg but its contacts, as tables over the crank angle (physics.md section 7).

With X = J^-1 at centred journals, J the Jacobian of all closures and the drive, the columns of X that
belong to the loose joints are S and the drive's is s:

    v = S e' + s w,    a = S e'' + s w' + 2 w S_t e' + w^2 s_t      (_t: derivative by the crank angle)

Projected on X, M a = Q + Q_contact + J^T f gives the motion of the eccentricities e (rows of S), the
drive torque (row of s) and the reactions of the ideal joints (all other rows). What is left out is of
the order of the eccentricity over the link lengths.
"""

import math
from typing import NamedTuple

import numpy as np

from leg_wear_monitor.contact.arrays import ContactArrays
from leg_wear_monitor.mechanism.arrays import Floats, Ints, MechanismArrays, body_names, point_from_com
from leg_wear_monitor.mechanism.constraints import DRIVE
from leg_wear_monitor.mechanism.forces import applied_forces_at, stored_energy_at
from leg_wear_monitor.mechanism.ideal import TURN, IdealMotion, one_cycle, turned
from leg_wear_monitor.mechanism.position import Linkage, evaluate

POINTS = 1024  # of a turn; tables are linear between them


class ClearanceTables(NamedTuple):
    """Tables at N equal steps of the crank, the first repeated at the end; k loose joints, d = 2 k.

    ``motion`` (N + 1, w) the rows that `motion_shapes` names; ``reaction`` (N + 1, r, 4 + 3 d + k) the
    drive torque and the reactions of the ideal joints by (1, w', w^2, w, e'', w e', e', F_t), and
    ``reaction_joint`` (r,) the joint of each, ``DRIVE`` first; ``energy`` (N + 1, d + 2, d + 2) the
    quadratic form of (e', w, 1) that is the kinetic energy, with the potential energy at centred journals
    in its corner, and ``push`` (N + 1, d) minus its gradient by e.
    """

    motion: Floats
    reaction: Floats
    reaction_joint: Ints
    energy: Floats
    push: Floats


def motion_shapes(k: int, damped: bool) -> dict[str, tuple[int, ...]]:
    """Parts of a row of ``motion`` and their shapes, for k loose joints, d = 2 k.

    ``inverse_mass`` (S^T M S)^-1; ``coriolis`` accelerations by w e'; ``free`` accelerations without
    contact by 1, w' and w^2; ``lever`` and ``lever_drive`` the slip of each joint by e' and by w beyond
    t . e'; ``lever_response`` accelerations by its friction force; ``torque`` the first row of
    ``reaction``; ``angle`` of the bushing's and the journal's bodies; ``toe`` its position, by 1 and e,
    and the derivative of its dependence on e; ``load_power`` the power of loads by (e', w); with dampers,
    ``viscous`` accelerations and ``damper`` the power taken as a quadratic form, both by (e', w).
    """
    d = 2 * k
    return {
        "inverse_mass": (d, d),
        "coriolis": (d, d),
        "free": (3, d),
        "lever": (k, d),
        "lever_drive": (k,),
        "lever_response": (k, d),
        "torque": (4 + 3 * d + k,),
        "angle": (k, 2),
        "toe": (2, 1 + 2 * d),
        "load_power": (d + 1,),
        "viscous": (d, d + 1) if damped else (0, 0),
        "damper": (d + 1, d + 1) if damped else (0, 0),
    }


def views(flat: Floats, shapes: dict[str, tuple[int, ...]]) -> dict[str, Floats]:
    """Named views of consecutive parts of a flat array."""
    parts, start = {}, 0
    for name, shape in shapes.items():
        size = math.prod(shape)
        parts[name] = flat[start : start + size].reshape(shape)
        start += size
    return parts


def is_damped(arrays: MechanismArrays) -> bool:
    """Whether a spring has a damper."""
    return bool((arrays.spring_law[:, 2] > 0.0).any())


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
    basis = _Basis(linkage, contacts, motion)
    force, load = _applied(linkage, motion)
    reaction, joints = _reactions(linkage, basis, force)
    inverse_mass = np.linalg.inv(basis.project(basis.s, basis.mass[:, None] * basis.s))

    def respond(generalised: Floats) -> Floats:
        """Accelerations (N, d, m) of the eccentricities by forces (N, 3 b, m)."""
        return np.asarray(inverse_mass @ basis.project(basis.s, generalised))

    free = np.stack([force, -basis.mass * basis.drive, -basis.mass * basis.drive_t], axis=2)
    parts = {
        "inverse_mass": inverse_mass,
        "coriolis": -2.0 * respond(basis.mass[:, None] * basis.s_t),
        "free": respond(free).transpose(0, 2, 1),
        "lever": basis.project(basis.s, basis.friction).transpose(0, 2, 1),
        "lever_drive": basis.project(basis.friction, basis.drive[:, :, None]),
        "lever_response": respond(basis.friction).transpose(0, 2, 1),
        "torque": reaction[:, 0],
        "angle": motion.q[:, linkage.arrays.joint_body[contacts.joint], 2],
        "toe": _toe(linkage, motion, basis),
        "load_power": basis.project(basis.all, load[:, :, None]),
        "viscous": -respond(basis.drag) if basis.drag.any() else np.zeros((points, 0)),
        "damper": basis.project(basis.all, basis.drag) if basis.drag.any() else np.zeros((points, 0)),
    }
    rows = np.concatenate([parts[name].reshape(points, -1) for name in parts], axis=1)
    closing = rows[:1].copy()
    row = views(closing[0], motion_shapes(len(contacts.joint), bool(basis.drag.any())))
    row["angle"][:] += TURN * np.round(motion.v[:, linkage.arrays.joint_body[contacts.joint], 2].mean(axis=0))
    return ClearanceTables(
        motion=np.concatenate([rows, closing]),
        reaction=np.concatenate([reaction, reaction[:1]]),
        reaction_joint=joints,
        energy=_closed(_energy(linkage, motion, basis)),
        push=_closed(basis.project(basis.s, (force - load)[:, :, None])[:, :, 0]),
    )


class _Basis:
    """S, s, their derivatives, friction's and dampers' generalised forces at every crank angle."""

    def __init__(self, linkage: Linkage, contacts: ContactArrays, motion: IdealMotion) -> None:
        jacobians = [
            evaluate(linkage, q, np.zeros_like(q), (angle, 0.0, 0.0)).jacobian
            for q, angle in zip(motion.q, motion.crank_angle, strict=True)
        ]
        self.x = np.linalg.inv(np.array(jacobians))
        self.mass = linkage.arrays.mass[1:].ravel()
        self.rows = _rows(linkage, contacts.joint)
        self.s = self.x[:, :, self.rows]
        self.s_t = _derivative(self.s)
        self.drive = self.x[:, :, linkage.rows.drive_row]
        self.drive_t = motion.a[:, 1:].reshape(len(self.x), -1)
        self.all = np.concatenate([self.s, self.drive[:, :, None]], axis=2)
        levers = _friction_levers(linkage.arrays, contacts)
        self.friction = np.broadcast_to(levers, (len(self.x), *levers.shape))
        self.drag = _damping(linkage, motion) @ self.all

    @staticmethod
    def project(basis: Floats, forces: Floats) -> Floats:
        """Transpose of a basis (N, 3 b, m) times forces (N, 3 b, p)."""
        return np.ascontiguousarray(basis.transpose(0, 2, 1) @ forces)


def _rows(linkage: Linkage, joints: Ints) -> list[int]:
    """Rows of the given joints in the Jacobian, x before y, in the given order."""
    start = dict(zip(linkage.rows.closure.tolist(), linkage.rows.row.tolist(), strict=True))
    return [start[int(joint)] + i for joint in joints for i in range(2)]


def _derivative(table: Floats) -> Floats:
    """Derivative by the crank angle of a smooth periodic table (N, ...), by its Fourier series."""
    order = np.fft.rfftfreq(len(table), 1.0 / len(table)).reshape(-1, *([1] * (table.ndim - 1)))
    return np.asarray(np.fft.irfft(1j * order * np.fft.rfft(table, axis=0), len(table), axis=0))


def _closed(table: Floats) -> Floats:
    return np.concatenate([table, table[:1]])


def _reactions(linkage: Linkage, basis: _Basis, force: Floats) -> tuple[Floats, Ints]:
    """Table ``reaction`` without its closing row, and the joint of each of its rows."""
    rows, joints = [linkage.rows.drive_row], [DRIVE]
    for closure, start in zip(linkage.rows.closure.tolist(), linkage.rows.row.tolist(), strict=True):
        if closure != DRIVE and start not in basis.rows:
            rows += [start, start + 1]
            joints += [closure, closure]
    mass = basis.mass[:, None]
    by = [-force[:, :, None], mass * basis.drive[:, :, None], mass * basis.drive_t[:, :, None]]
    by += [basis.drag[:, :, -1:], mass * basis.s, 2.0 * mass * basis.s_t, basis.drag[:, :, :-1], -basis.friction]
    reaction = basis.project(basis.x[:, :, rows], np.concatenate(by, axis=2))
    return reaction, np.array(joints, dtype=np.int64)


def _applied(linkage: Linkage, motion: IdealMotion) -> tuple[Floats, Floats]:
    """Applied forces at rest (N, 3 b), and the share of loads in them."""
    arrays = linkage.arrays
    unloaded = arrays._replace(load_body=arrays.load_body[:0])
    force = np.array([_force_at(arrays, q, np.zeros_like(q)) for q in motion.q])
    bare = force
    if len(arrays.load_body):
        bare = np.array([_force_at(unloaded, q, np.zeros_like(q)) for q in motion.q])
    return force, force - bare


def _damping(linkage: Linkage, motion: IdealMotion) -> Floats:
    """Damping matrix (N, 3 b, 3 b) of the springs' dampers."""
    n, size = len(motion.q), 3 * (motion.q.shape[1] - 1)
    damping = np.zeros((n, size, size))
    if is_damped(linkage.arrays):
        for i, q in enumerate(motion.q):
            at_rest = _force_at(linkage.arrays, q, np.zeros_like(q))
            for j in range(size):
                v = np.zeros(q.size)
                v[3 + j] = 1.0
                damping[i, :, j] = at_rest - _force_at(linkage.arrays, q, v.reshape(q.shape))
    return damping


def _force_at(arrays: MechanismArrays, q: Floats, v: Floats) -> Floats:
    """Applied forces (3 b,) on the moving bodies."""
    cs, force = np.empty((len(q), 2)), np.empty_like(q)
    applied_forces_at(arrays, q, v, cs, force)
    return force[1:].ravel()


def _friction_levers(arrays: MechanismArrays, contacts: ContactArrays) -> Floats:
    """Generalised forces (3 b, k) of a unit friction force in each joint, beyond its force on e."""
    levers = np.zeros((arrays.mass.size, len(contacts.joint)))
    for k, joint in enumerate(contacts.joint):
        b, j = arrays.joint_body[joint]
        levers[3 * b + 2, k] -= contacts.bushing_radius[k]
        levers[3 * j + 2, k] += contacts.bushing_radius[k] - contacts.clearance[k]
    return levers[3:]


def _toe(linkage: Linkage, motion: IdealMotion, basis: _Basis) -> Floats:
    n, d = len(motion.q), basis.s.shape[2]
    toe = np.zeros((n, 2, 1 + 2 * d))
    if linkage.mechanism.toe is None:
        return toe
    body, point = linkage.mechanism.toe
    i = body_names(linkage.mechanism).index(body)
    lever = turned(point_from_com(linkage.mechanism, body, point), motion.q[:, i, 2])
    across = np.stack([-lever[:, 1], lever[:, 0]], axis=1)[:, :, None]
    here, turn = slice(3 * (i - 1), 3 * i - 1), basis.s[:, 3 * i - 1, None]
    toe[:, :, 0] = motion.q[:, i, :2] + lever
    toe[:, :, 1 : 1 + d] = basis.s[:, here] + across * turn
    swing = motion.v[:, i, 2, None, None] * lever[:, :, None]
    toe[:, :, 1 + d :] = basis.s_t[:, here] + across * basis.s_t[:, 3 * i - 1, None] - swing * turn
    return toe


def _energy(linkage: Linkage, motion: IdealMotion, basis: _Basis) -> Floats:
    n, m = len(motion.q), basis.all.shape[2]
    energy = np.zeros((n, m + 1, m + 1))
    energy[:, :m, :m] = 0.5 * basis.project(basis.all, basis.mass[:, None] * basis.all)
    for i, q in enumerate(motion.q):
        energy[i, m, m] = stored_energy_at(linkage.arrays, q, np.zeros_like(q), np.empty((len(q), 2)))
    return energy

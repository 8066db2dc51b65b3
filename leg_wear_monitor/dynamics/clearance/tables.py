"""Tables over the crank angle for the motion of the leg without contacts (physics.md section 7).

With X = J^-1 at centred journals, J the Jacobian of all closures and the drive, the columns of X that belong
to the clearance joints are S, the drive's is s. The Lagrangian is a function of the eccentricities e and the
crank angle th, with its speed w. To the first order of e / L in terms with w, and to the second order in
terms with w^2 and gravity, it is

    1/2 e' A e' + w e' (B + B_e e) + 1/2 w^2 (c + c_e e + 1/2 e c_ee e) - V,

    A = S M S,  B = S M s,  c = s M s,  B_e = q_ee M s + S M S_t,  c_e = 2 s M S_t,
    c_ee = 2 S_t M S_t + 2 s M q_ee_t,      q_ee = -X (dJ along S) S  the curvature of the linkage,

with _t the derivative by the crank angle. The equations of motion and the drive torque follow from one
energy, so the energy balance is closed. In addition, A changes with e by Gamma e and its transpose, Gamma = S
M q_ee, and the term Gamma e' e' is added to A e''; the drive torque and the stored energy neglect both.
"""

import copy
import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from leg_wear_monitor.compiled.vectors import WIDTH, padded
from leg_wear_monitor.contact.arrays import ContactArrays
from leg_wear_monitor.mechanism.arrays import (
    Floats,
    Ints,
    MechanismArrays,
    Singles,
    body_names,
    point_from_com,
)
from leg_wear_monitor.mechanism.constraints import DRIVE, applied_forces_at, stored_energy_at
from leg_wear_monitor.mechanism.position import (
    TURN,
    IdealMotion,
    Linkage,
    dense_jacobian,
    jacobian_blocks,
    jacobians,
    one_cycle,
    rotated,
)

# The linkage near its ideal motion: effects of the eccentricities (physics.md section 7).


COARSER = 2  # ratio of the first-order (in e) tables' step to the other tables' step

_NUDGE = 1.0e-5  # m or rad: step of central differences of smooth functions of the coordinates


class Basis:
    """Quantities at N crank angles of the ideal motion; b moving bodies, d = 2 k eccentricities.

    Parameters
    ----------
    linkage : Linkage
    contacts : ContactArrays
    motion : IdealMotion
    loaded : sequence of Linkage
        The same linkage under other loads.

    Attributes
    ----------
    motion : IdealMotion
    x : (N, 3 b, 3 b) array
        Inverse Jacobian of all closures and the drive.
    rows : list of int
        Rows of the clearance joints.
    mass : (3 b,) array
    s, s_t : (N, 3 b, d) arrays
        S and its derivative by the crank angle.
    inverse_mass : (N, d, d) array
        Inverse of the Lagrangian's A.
    drive, drive_t : (N, 3 b) arrays
        s and its derivative.
    all : (N, 3 b, d + 1) array
        S and s side by side.
    b_e, c_ee : (N, d, d) arrays
        B_e and c_ee of the Lagrangian.
    gamma : (N / COARSER, d, d, d) array
        Gamma = S^T M q_ee, at every `COARSER`-th angle: force on e (i) that is bilinear in e' (j, k); A
        changes by Gamma e plus transpose.
    c_e : (N, d) array
    force, load : (N, 3 b) arrays
        Applied forces at rest, and the part of the loads in them.
    force_e, load_e : (N, d, d) arrays
        Derivatives by e of their generalised forces on e.
    drive_force_e, drive_load_e : (N, d) arrays
        Derivatives by e of the applied forces' and the loads' generalised force on the crank.
    potential : (N,) array
    friction : (N, 3 b, k) array
        Generalised force of a unit friction force in each joint, beyond its force on e.
    loaded : tuple of Basis
        Those under the other loads: only the applied forces differ.
    """

    loaded: "tuple[Basis, ...]" = ()

    def __init__(
        self,
        linkage: Linkage,
        contacts: ContactArrays,
        motion: IdealMotion,
        loaded: Sequence[Linkage] = (),
    ) -> None:
        self.motion, n = motion, len(motion.q)
        self.x: Floats = np.asarray(np.linalg.inv(jacobians(linkage, motion.q)), dtype=np.float64)
        self.mass = linkage.arrays.mass[1:].ravel()
        self.rows = _rows(linkage, contacts.joint)
        self.s = self.x[:, :, self.rows]
        self.s_t = derivative(self.s)
        inertia = project(self.s, self.mass[:, None] * self.s)
        self.inverse_mass: Floats = np.asarray(np.linalg.inv(inertia), dtype=np.float64)
        self.drive = self.x[:, :, linkage.rows.drive_row]
        self.drive_t = motion.a[:, 1:].reshape(n, -1)
        self.all = np.concatenate([self.s, self.drive[:, :, None]], axis=2)
        levers = _friction_levers(linkage.arrays, contacts)
        self.friction: Floats = np.broadcast_to(levers, (n, *levers.shape))
        curvature = self._curve(linkage, motion.q)  # larger than all other arrays, and not kept
        self._take_forces(linkage, curvature)
        self.loaded = tuple(self._under_load(one, curvature) for one in loaded)

    def _under_load(self, linkage: Linkage, curvature: Floats) -> "Basis":
        other = copy.copy(self)
        other._take_forces(linkage, curvature)
        return other

    def _nudged(self, q: Floats, j: int) -> tuple[Floats, Floats]:
        """Coordinates ahead of q (N, n, 3) along column j of S, and behind."""
        step = _NUDGE * self.s[:, :, j].reshape(len(q), -1, 3)
        ahead, behind = q.copy(), q.copy()
        ahead[:, 1:] += step
        behind[:, 1:] -= step
        return ahead, behind

    def _curve(self, linkage: Linkage, q: Floats) -> Floats:
        """Set the quantities of first order in e that depend on the masses alone; q_ee (N, 3 b, d, d)."""
        d = len(self.rows)
        mass, minus_x = self.mass[:, None], -self.x
        curvature = np.empty((*self.s.shape, d))
        for j in range(d):
            ahead, behind = (jacobian_blocks(linkage, near) for near in self._nudged(q, j))
            slope = dense_jacobian(linkage.rows, (ahead - behind) / (2.0 * _NUDGE), q.shape[1])
            curvature[..., j] = minus_x @ (slope @ self.s)
        momentum = self.mass * self.drive
        self.b_e = np.einsum("nr,nrij->nij", momentum, curvature) + project(self.s, mass * self.s_t)
        self.c_e = 2.0 * np.einsum("nr,nri->ni", momentum, self.s_t)
        momenta = (mass * self.s).transpose(0, 2, 1)[::COARSER]
        flat = momenta @ curvature.reshape(len(q), -1, d * d)[::COARSER]
        self.gamma = flat.reshape(-1, d, d, d)
        swing = np.empty_like(self.b_e)
        for j in range(d):  # one at a time: all series need four times the memory
            swing[..., j] = np.einsum("nr,nri->ni", momentum, derivative(curvature[..., j]))
        self.c_ee = 2.0 * (project(self.s_t, mass * self.s_t) + swing)
        return curvature

    def _take_forces(self, linkage: Linkage, curvature: Floats) -> None:
        """Set the applied forces, and their derivatives by e."""
        q = self.motion.q
        self.force, self.load, self.potential = _forces(linkage, q)
        force_s, load_s = np.zeros((2, *self.s.shape))
        if len(linkage.arrays.load_body) or len(linkage.arrays.spring_body):
            for j in range(len(self.rows)):
                after, before = (_forces(linkage, near) for near in self._nudged(q, j))
                force_s[:, :, j] = (after[0] - before[0]) / (2.0 * _NUDGE)
                load_s[:, :, j] = (after[1] - before[1]) / (2.0 * _NUDGE)
        self.force_e = np.einsum("nr,nrij->nij", self.force, curvature) + project(self.s, force_s)
        self.load_e = np.einsum("nr,nrij->nij", self.load, curvature) + project(self.s, load_s)
        self.drive_force_e = self._on_crank(self.force, force_s)
        self.drive_load_e = self._on_crank(self.load, load_s)

    def _on_crank(self, force: Floats, force_s: Floats) -> Floats:
        """Derivative (N, d) by e of the crank's generalised force, of forces (N, 3 b) and force_s."""
        along = np.einsum("nr,nri->ni", force, self.s_t)
        return np.asarray(along + np.einsum("nr,nri->ni", self.drive, force_s))


def project(basis: Floats, forces: Floats) -> Floats:
    """Transpose of a basis (N, 3 b, m) times forces (N, 3 b, p)."""
    return np.ascontiguousarray(basis.transpose(0, 2, 1) @ forces)


def derivative(table: Floats) -> Floats:
    """Derivative by the crank angle of a smooth periodic table (N, ...), by its Fourier series."""
    order = np.fft.rfftfreq(len(table), 1.0 / len(table)).reshape(-1, *([1] * (table.ndim - 1)))
    return np.asarray(np.fft.irfft(1j * order * np.fft.rfft(table, axis=0), len(table), axis=0))


def _rows(linkage: Linkage, joints: Ints) -> list[int]:
    """Rows of the given joints in the Jacobian, x before y, in the given order."""
    start = dict(zip(linkage.rows.closure.tolist(), linkage.rows.row.tolist(), strict=True))
    return [start[int(joint)] + i for joint in joints for i in range(2)]


def _forces(linkage: Linkage, q: Floats) -> tuple[Floats, Floats, Floats]:
    """Applied forces at rest (N, 3 b), the part of the loads in them, and the potential energy (N,) [J]."""
    arrays = linkage.arrays
    unloaded = arrays._replace(load_body=arrays.load_body[:0])
    rest, energy = np.zeros_like(q), np.empty(len(q))
    force = _forces_at(arrays, q, rest)
    bare = _forces_at(unloaded, q, rest) if len(arrays.load_body) else force
    stored_energy_at(arrays, q, rest, np.empty((q.shape[1], 2)), energy)
    return force, force - bare, energy


def _forces_at(arrays: MechanismArrays, q: Floats, v: Floats) -> Floats:
    """Applied forces (N, 3 b) on the moving bodies at N positions and velocities (N, n, 3)."""
    force = np.empty_like(q)
    applied_forces_at(arrays, q, v, np.empty((q.shape[1], 2)), force)
    return force[:, 1:].reshape(len(q), -1)


def _friction_levers(arrays: MechanismArrays, contacts: ContactArrays) -> Floats:
    """Generalised forces (3 b, k) of a unit friction force in each joint, beyond its force on e."""
    levers = np.zeros((arrays.mass.size, len(contacts.joint)))
    for k, joint in enumerate(contacts.joint):
        b, j = arrays.joint_body[joint]
        levers[3 * b + 2, k] -= contacts.bushing_radius[k]
        levers[3 * j + 2, k] += contacts.bushing_radius[k] - contacts.clearance[k]
    return levers[3:]


# Layout of the tables over the crank angle: named parts of flat rows (physics.md section 7).
#
# A row is interpolated in one loop; the named parts are views of it.


Shapes = dict[str, tuple[int, ...]]


def motion_shapes(k: int) -> Shapes:
    """Shapes of the parts of a row for k clearance joints, with d = 2 k eccentricities e and crank speed w.

    The parts that depend on e come first, as in `changing_shapes`: ``inverse_mass`` of e; ``free``: forces on
    e without contact, coefficients of 1, w' and w^2; ``lever_drive``: slip of each joint per w, which is also
    the coefficient of its friction force in the drive torque; ``load_power``: power of loads, coefficients of
    (e', w); ``torque_a``: drive torque, coefficient of e''; ``torque_v``: drive torque, coefficient of w e'.

    The other parts: ``coriolis``: accelerations of e, coefficient of w e'; ``lever``: slip of each joint
    beyond t . e', coefficient of e'; ``torque``: drive torque, coefficients of (1, w', w^2); ``torque_e``:
    coefficients of e (1, w', w^2); ``torque_vv``: quadratic form of e'; ``angle``: angles of the bushing's
    and the journal's body [rad], ``turn``: their derivatives by the crank angle; ``toe``: position,
    coefficients of 1 and e, and the derivative of the latter by the crank angle.

    In square parts the second index is the index of the result (in a form, of the first vector), so that
    loops run along rows.
    """
    d = 2 * k
    return {
        "inverse_mass": (d, d),
        "free": (3, d),
        "lever_drive": (k,),
        "load_power": (d + 1,),
        "torque_a": (d,),
        "torque_v": (d,),
        "coriolis": (d, d),
        "lever": (d, k),
        "torque": (3,),
        "torque_e": (3, d),
        "torque_vv": (d, d),
        "angle": (k, 2),
        "turn": (k, 2),
        "toe": (2, 1 + 2 * d),
    }


def changing_shapes(k: int) -> Shapes:
    """Shapes of the parts at the start of the row of `motion_shapes` that depend on e."""
    d = 2 * k
    return {
        "inverse_mass": (d, d),
        "free": (3, d),
        "lever_drive": (k,),
        "load_power": (d + 1,),
        "torque_a": (d,),
        "torque_v": (d,),
    }


def stored_shapes(k: int) -> Shapes:
    """Shapes of the parts of the stored energy: the Lagrangian's A, B, B_e, c, c_e, c_ee, and the potential.

    ``push`` and ``push_e`` are minus the first and second derivatives of the potential energy by e.
    """
    d = 2 * k
    square, line, one = (d, d), (d,), (1,)
    return {
        "a": square, "b": line, "b_e": square, "c": one, "c_e": line, "c_ee": square,
        "potential": one, "push": line, "push_e": square,
    }  # fmt: skip


def start_of(name: str, shapes: Shapes) -> int:
    """Start index of a named part in a flat array."""
    return sum(math.prod(shapes[before]) for before in list(shapes)[: list(shapes).index(name)])


def views(flat: Floats, shapes: Shapes) -> dict[str, Floats]:
    """Named views of consecutive parts of a flat array."""
    parts, start = {}, 0
    for name, shape in shapes.items():
        size = math.prod(shape)
        parts[name] = flat[start : start + size].reshape(shape)
        start += size
    return parts


POINTS = 1024  # table points per turn, with linear interpolation

# 1/rad^2: largest second derivative of the Coriolis terms over their RMS for an undivided interval
_BENT = 10.0


class ClearanceTables(NamedTuple):
    """Tables at N equal steps of the crank, the first repeated at the end; k clearance joints, d = 2 k.

    ``motion`` (N + 1, w): rows of `motion_shapes`, with zeros up to a whole number of vectors; ``reaction``
    (N + 1, 3 + 2 d + k, r): drive torque and reactions of the ideal joints, coefficients of (1, w', w^2,
    e'', w e', F_t), with room likewise; ``reaction_joint`` (r,): joint of each, ``DRIVE`` first;
    ``stored`` (N + 1, u): parts of the stored energy of `stored_shapes`;
    ``parts`` (N,): parts into which an interval of 1/2048 turn that starts there should be cut, as a float.

    ``by_e`` (M + 1, u / WIDTH, d, WIDTH): derivatives by e of the parts of `changing_shapes`, in blocks of
    vectors; ``bend`` (M + 1, d d / WIDTH, d, WIDTH): accelerations A^-1 Gamma, bilinear in e'. Both are
    small, and therefore stored in single precision at every `COARSER`-th point, which reduces the memory
    traffic of an interval.
    """

    motion: Floats
    reaction: Floats
    reaction_joint: Ints
    stored: Floats
    parts: Floats
    by_e: Singles
    bend: Singles


def build_basis(linkage: Linkage, contacts: ContactArrays, loaded: Sequence[Linkage] = ()) -> Basis:
    """Data for the tables of a linkage; they take most of the time.

    Parameters
    ----------
    linkage : Linkage
    contacts : ContactArrays
    loaded : sequence of Linkage
        The same linkage under other loads; their bases are made as well.

    Raises
    ------
    AssemblyError
        If the linkage does not close or has a dead point.
    """
    return Basis(linkage, contacts, one_cycle(linkage, POINTS, 1.0), loaded)


def build_tables(linkage: Linkage, contacts: ContactArrays, basis: Basis | None = None) -> ClearanceTables:
    """Tables of a linkage with the clearance joints of ``contacts``.

    Parameters
    ----------
    linkage : Linkage
    contacts : ContactArrays
    basis : Basis, optional
        Basis of this linkage and these joints, if there is one already.

    Returns
    -------
    ClearanceTables

    Raises
    ------
    AssemblyError
        If the linkage does not close or has a dead point.
    """
    basis = basis or build_basis(linkage, contacts)
    return ClearanceTables(
        motion=_motion(linkage, contacts, basis),
        reaction=_reaction(linkage, contacts, basis),
        reaction_joint=_ideal_rows(linkage, basis)[1],
        stored=_stored(linkage, contacts, basis),
        by_e=_by_e(linkage, contacts, basis),
        parts=_parts(_accelerations(basis)["coriolis"]),
        bend=_in_blocks(_bend(basis).reshape(len(basis.gamma) + 1, 2 * len(contacts.joint), -1)),
    )


def _motion(linkage: Linkage, contacts: ContactArrays, basis: Basis) -> Floats:
    """Table ``motion``."""
    motion, points = basis.motion, len(basis.motion.q)
    bodies = linkage.arrays.joint_body[contacts.joint]
    parts = {
        **_accelerations(basis),
        **_torque(basis),
        **_levers(basis),
        "angle": motion.q[:, bodies, 2],
        "turn": motion.v[:, bodies, 2],
        "toe": _toe(linkage, motion, basis),
        "load_power": project(basis.all, basis.load[:, :, None]),
    }
    shapes = motion_shapes(len(contacts.joint))
    width = sum(math.prod(shape) for shape in shapes.values())
    rows = np.zeros((points + 1, padded(width)))
    np.concatenate([parts[name].reshape(points, -1) for name in shapes], axis=1, out=rows[:-1, :width])
    rows[-1] = rows[0]
    turns = np.round(motion.v[:, bodies, 2].mean(axis=0))
    views(rows[-1], shapes)["angle"][:] += TURN * turns
    return rows


def _levers(basis: Basis) -> dict[str, Floats]:
    """Parts of `motion_shapes` that depend on the radii of the clearance joints."""
    return {
        "lever": project(basis.s, basis.friction),
        "lever_drive": project(basis.friction, basis.drive[:, :, None]),
    }


def _coarse(points: int) -> list[int]:
    """Every `COARSER`-th point of a turn, the first repeated at the end."""
    return [*range(0, points, COARSER), 0]


def _parts(table: Floats) -> Floats:
    """Parts of an interval at each point (N,), as a float, by the second derivative of a table (N, d, d)."""
    step = TURN / len(table)
    bend = np.roll(table, -1, axis=0) - 2.0 * table + np.roll(table, 1, axis=0)
    size = np.sqrt((table**2).mean(axis=0)).max()
    if size == 0.0:
        return np.ones(len(table))
    roughness = np.abs(bend).max(axis=(1, 2)) / (step**2 * size * _BENT)
    return np.asarray(np.sqrt(roughness))


def _accelerations(basis: Basis) -> dict[str, Floats]:
    """Parts of `motion_shapes` for the accelerations of the eccentricities."""
    mass = basis.mass[:, None]

    def respond(generalised: Floats) -> Floats:
        """Accelerations (N, d, m) of the eccentricities by generalised forces (N, 3 b, m) on the bodies."""
        return np.asarray(basis.inverse_mass @ project(basis.s, generalised))

    free = np.stack([basis.force, -basis.mass * basis.drive, -basis.mass * basis.drive_t], axis=2)
    return {
        "inverse_mass": basis.inverse_mass,
        "coriolis": -2.0 * respond(mass * basis.s_t).transpose(0, 2, 1),
        "free": project(basis.s, free).transpose(0, 2, 1),
    }


def _bend(basis: Basis) -> Floats:
    """Accelerations A^-1 Gamma (M + 1, d, d, d), bilinear in e'."""
    n, d = basis.gamma.shape[:2]
    turn = [*range(n), 0]
    bend = basis.inverse_mass[::COARSER][turn] @ basis.gamma[turn].reshape(n + 1, d, d * d)
    return np.asarray(bend.reshape(n + 1, d, d, d).transpose(0, 3, 2, 1))


def _by_e(_linkage: Linkage, _contacts: ContactArrays, basis: Basis) -> Singles:
    """Table ``by_e``."""
    d, coarse = len(basis.rows), _coarse(len(basis.s))
    free = np.stack([basis.force_e, -basis.b_e, 0.5 * basis.c_ee - derivative(basis.b_e)], axis=1)
    parts = {
        "free": free.transpose(0, 3, 1, 2),
        "lever_drive": project(basis.s_t, basis.friction),
        "load_power": np.concatenate(
            [basis.load_e.transpose(0, 2, 1), basis.drive_load_e[:, :, None]], axis=2
        ),
        "torque_a": basis.b_e.transpose(0, 2, 1),
        "torque_v": basis.c_ee.transpose(0, 2, 1),
    }
    parts = {name: part[coarse] for name, part in parts.items()}
    # the inverse of A + Gamma e + (Gamma e)^T is A^-1 - Q e - (Q e)^T with Q = A^-1 Gamma A^-1
    change = basis.inverse_mass[coarse][:, None] @ _bend(basis)
    parts["inverse_mass"] = -(change + change.transpose(0, 1, 3, 2))
    columns = [parts[name].reshape(len(coarse), d, -1) for name in changing_shapes(d // 2)]
    return _in_blocks(np.concatenate(columns, axis=2, dtype=np.float32))


def _in_blocks(table: Floats | Singles) -> Singles:
    """A table (M + 1, d, u) in the order that vectors are read, (M + 1, u / WIDTH, d, WIDTH)."""
    points, d, u = table.shape
    blocks = np.zeros((points, padded(u) // WIDTH, d, WIDTH), dtype=np.float32)
    for i, first in enumerate(range(0, u, WIDTH)):
        part = table[:, :, first : first + WIDTH]
        blocks[:, i, :, : part.shape[2]] = part
    return blocks


def _torque(basis: Basis) -> dict[str, Floats]:
    """Parts of `motion_shapes` for the drive torque."""
    mass = basis.mass[:, None]
    c, c_e = np.einsum("ni,i,ni->n", basis.drive, basis.mass, basis.drive), basis.c_e
    a_t = derivative(project(basis.s, mass * basis.s))
    rest = -np.einsum("ni,ni->n", basis.drive, basis.force)
    return {
        "torque": np.stack([rest, c, 0.5 * derivative(c)], axis=1),
        "torque_a": project(basis.s, mass * basis.drive[:, :, None])[:, :, 0],
        "torque_v": c_e,
        "torque_e": np.stack([-basis.drive_force_e, c_e, 0.5 * derivative(c_e)], axis=1),
        "torque_vv": (basis.b_e - 0.5 * a_t).transpose(0, 2, 1),
    }


def _stored(_linkage: Linkage, _contacts: ContactArrays, basis: Basis) -> Floats:
    """Table ``stored``."""
    parts = {
        "a": project(basis.s, basis.mass[:, None] * basis.s),
        "b": project(basis.s, (basis.mass * basis.drive)[:, :, None]),
        "b_e": basis.b_e,
        "c": np.einsum("ni,i,ni->n", basis.drive, basis.mass, basis.drive),
        "c_e": basis.c_e,
        "c_ee": basis.c_ee,
        "potential": basis.potential,
        "push": project(basis.s, (basis.force - basis.load)[:, :, None]),
        "push_e": basis.force_e - basis.load_e,
    }
    rows = np.concatenate([part.reshape(len(basis.s), -1) for part in parts.values()], axis=1)
    return np.concatenate([rows, rows[:1]])


def _ideal_rows(linkage: Linkage, basis: Basis) -> tuple[list[int], Ints]:
    """Rows of the Jacobian for the drive and the ideal joints (r,), and the joint of each."""
    rows, joints = [linkage.rows.drive_row], [DRIVE]
    for closure, start in zip(linkage.rows.closure.tolist(), linkage.rows.row.tolist(), strict=True):
        if closure != DRIVE and start not in basis.rows:
            rows += [start, start + 1]
            joints += [closure, closure]
    return rows, np.array(joints, dtype=np.int64)


def _reaction(linkage: Linkage, _contacts: ContactArrays, basis: Basis) -> Floats:
    """Table ``reaction``."""
    mass, (rows, _) = basis.mass[:, None], _ideal_rows(linkage, basis)
    by = [-basis.force[:, :, None], mass * basis.drive[:, :, None], mass * basis.drive_t[:, :, None]]
    by += [mass * basis.s, 2.0 * mass * basis.s_t]
    others = project(np.concatenate(by, axis=2), basis.x[:, :, rows])
    by_friction = project(-basis.friction, basis.x[:, :, rows])
    columns = np.concatenate([others, by_friction], axis=1)
    reaction = np.zeros((len(columns) + 1, columns.shape[1], padded(len(rows))))
    reaction[:-1, :, : len(rows)] = columns
    reaction[-1] = reaction[0]
    return reaction


def _toe(linkage: Linkage, motion: IdealMotion, basis: Basis) -> Floats:
    """Part ``toe`` (N, 2, 1 + 2 d); zeros for a mechanism without a toe."""
    n, d = len(motion.q), basis.s.shape[2]
    toe = np.zeros((n, 2, 1 + 2 * d))
    if linkage.mechanism.toe is None:
        return toe
    body, point = linkage.mechanism.toe
    i = body_names(linkage.mechanism).index(body)
    lever = rotated(point_from_com(linkage.mechanism, body, point), motion.q[:, i, 2])
    across = np.stack([-lever[:, 1], lever[:, 0]], axis=1)[:, :, None]
    here, turn = slice(3 * (i - 1), 3 * i - 1), basis.s[:, 3 * i - 1, None]
    toe[:, :, 0] = motion.q[:, i, :2] + lever
    toe[:, :, 1 : 1 + d] = basis.s[:, here] + across * turn
    swing = motion.v[:, i, 2, None, None] * lever[:, :, None]
    toe[:, :, 1 + d :] = basis.s_t[:, here] + across * basis.s_t[:, 3 * i - 1, None] - swing * turn
    return toe


_Table = Callable[[Linkage, ContactArrays, Basis], Floats | Singles]

# tables that a load changes
UNDER_LOAD: dict[str, _Table] = {"motion": _motion, "reaction": _reaction, "stored": _stored, "by_e": _by_e}

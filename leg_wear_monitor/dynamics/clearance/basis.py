"""The linkage near its ideal motion: effects of the eccentricities (physics.md section 7)."""

import copy
import math
from collections.abc import Sequence

import numpy as np

from leg_wear_monitor.contact.arrays import ContactArrays
from leg_wear_monitor.mechanism.arrays import Floats, Ints, MechanismArrays
from leg_wear_monitor.mechanism.constraints import applied_forces_at, stored_energy_at
from leg_wear_monitor.mechanism.position import (
    IdealMotion,
    Linkage,
    dense_jacobian,
    jacobian_blocks,
    jacobians,
)

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
    drag : (N, 3 b, d + 1) array
        Force of dampers against each column of ``all``.
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
        self._take_levers(linkage, contacts)
        self.drag = _drag(linkage.arrays, motion.q, self.all)
        curvature = self._curve(linkage, motion.q)  # larger than all else, and not kept
        self._take_forces(linkage, curvature)
        self.loaded = tuple(self._under_load(one, curvature) for one in loaded)

    def with_contacts(self, linkage: Linkage, contacts: ContactArrays) -> "Basis":
        """Basis of the same linkage and joints with other radii: only the levers of friction differ."""
        other = copy.copy(self)
        other._take_levers(linkage, contacts)
        return other

    def _under_load(self, linkage: Linkage, curvature: Floats) -> "Basis":
        other = copy.copy(self)
        other._take_forces(linkage, curvature)
        return other

    def _take_levers(self, linkage: Linkage, contacts: ContactArrays) -> None:
        levers = _friction_levers(linkage.arrays, contacts)
        self.friction: Floats = np.broadcast_to(levers, (len(self.motion.q), *levers.shape))

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


def is_damped(arrays: MechanismArrays) -> bool:
    """True if a spring has a damper."""
    return bool((arrays.spring_law[:, 2] > 0.0).any())


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


def _drag(arrays: MechanismArrays, q: Floats, columns: Floats) -> Floats:
    """Force (N, 3 b, m) of the springs' dampers, opposite to velocities (N, 3 b, m)."""
    drag = np.zeros_like(columns)
    if is_damped(arrays):
        at_rest = _forces_at(arrays, q, np.zeros_like(q))
        for j in range(columns.shape[2]):
            v = np.zeros_like(q)
            v[:, 1:] = columns[:, :, j].reshape(len(q), -1, 3)
            drag[:, :, j] = at_rest - _forces_at(arrays, q, v)
    return drag


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


def motion_shapes(k: int, damped: bool) -> Shapes:
    """Shapes of the parts of a row for k clearance joints, with d = 2 k eccentricities e and crank speed w.

    The parts that depend on e come first, as in `changing_shapes`: ``inverse_mass`` of e; ``free``: forces on
    e without contact, coefficients of 1, w' and w^2; ``lever_drive``: slip of each joint per w, which is also
    the coefficient of its friction force in the drive torque; ``load_power``: power of loads, coefficients of
    (e', w); ``torque_a``: drive torque, coefficient of e''; ``torque_v``: drive torque, coefficients of w e'
    and of e' (the latter does not depend on e).

    The other parts: ``coriolis``: accelerations of e, coefficient of w e'; ``lever``: slip of each joint
    beyond t . e', coefficient of e'; ``torque``: drive torque, coefficients of (1, w', w^2, w); ``torque_e``:
    coefficients of e (1, w', w^2); ``torque_vv``: quadratic form of e'; ``angle``: angles of the bushing's
    and the journal's body [rad], ``turn``: their derivatives by the crank angle; ``toe``: position,
    coefficients of 1 and e, and the derivative of the latter by the crank angle; with dampers, ``viscous``:
    accelerations, and ``damper``: dissipated power as a quadratic form, both in (e', w).

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
        "torque_v": (2, d),
        "coriolis": (d, d),
        "lever": (d, k),
        "torque": (4,),
        "torque_e": (3, d),
        "torque_vv": (d, d),
        "angle": (k, 2),
        "turn": (k, 2),
        "toe": (2, 1 + 2 * d),
        "viscous": (d, d + 1) if damped else (0, 0),
        "damper": (d + 1, d + 1) if damped else (0, 0),
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

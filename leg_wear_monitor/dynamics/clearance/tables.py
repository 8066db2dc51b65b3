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

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from leg_wear_monitor.compiled.vectors import WIDTH, padded
from leg_wear_monitor.contact.arrays import ContactArrays
from leg_wear_monitor.dynamics.clearance.basis import (
    COARSER,
    Basis,
    changing_shapes,
    derivative,
    motion_shapes,
    project,
    views,
)
from leg_wear_monitor.mechanism.arrays import Floats, Ints, Singles, body_names, point_from_com
from leg_wear_monitor.mechanism.constraints import DRIVE
from leg_wear_monitor.mechanism.position import TURN, IdealMotion, Linkage, one_cycle, rotated

POINTS = 1024  # table points per turn, with linear interpolation

# 1/rad^2: largest second derivative of the Coriolis terms over their RMS for an undivided interval
_BENT = 10.0


class ClearanceTables(NamedTuple):
    """Tables at N equal steps of the crank, the first repeated at the end; k clearance joints, d = 2 k.

    ``motion`` (N + 1, w): rows of `motion_shapes`, with zeros up to a whole number of vectors; ``reaction``
    (N + 1, 4 + 3 d + k, r): drive torque and reactions of the ideal joints, coefficients of (1, w', w^2, w,
    e'', w e', e', F_t), with room likewise; ``reaction_joint`` (r,): joint of each, ``DRIVE`` first;
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


def build_basis(
    linkage: Linkage, contacts: ContactArrays, points: int = POINTS, loaded: Sequence[Linkage] = ()
) -> Basis:
    """Data for the tables of a linkage, except the radii of its clearance joints: they take most of the time.

    Parameters
    ----------
    linkage : Linkage
    contacts : ContactArrays
    points : int
        Crank steps per turn.
    loaded : sequence of Linkage
        The same linkage under other loads; their bases are made as well.

    Raises
    ------
    AssemblyError
        If the linkage does not close or has a dead point.
    """
    return Basis(linkage, contacts, one_cycle(linkage, points, 1.0), loaded)


def build_tables(
    linkage: Linkage,
    contacts: ContactArrays,
    points: int = POINTS,
    basis: Basis | None = None,
) -> ClearanceTables:
    """Tables of a linkage with the clearance joints of ``contacts``.

    Parameters
    ----------
    linkage : Linkage
    contacts : ContactArrays
    points : int
        Crank steps per turn.
    basis : Basis, optional
        Basis of the same linkage and clearance joints, with any radii; ``points`` is then not used.

    Returns
    -------
    ClearanceTables

    Raises
    ------
    AssemblyError
        If the linkage does not close or has a dead point.
    """
    basis = basis.with_contacts(linkage, contacts) if basis else build_basis(linkage, contacts, points)
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
        "damper": project(basis.all, basis.drag),
    }
    if not basis.drag.any():
        parts["viscous"] = parts["damper"] = np.zeros((points, 0))
    shapes = motion_shapes(len(contacts.joint), bool(basis.drag.any()))
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
        "viscous": -respond(basis.drag),
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
    drag = project(basis.drive[:, :, None], basis.drag)[:, 0]
    rest = -np.einsum("ni,ni->n", basis.drive, basis.force)
    return {
        "torque": np.stack([rest, c, 0.5 * derivative(c), drag[:, -1]], axis=1),
        "torque_a": project(basis.s, mass * basis.drive[:, :, None])[:, :, 0],
        "torque_v": np.stack([c_e, drag[:, :-1]], axis=1),
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
    by += [basis.drag[:, :, -1:], mass * basis.s, 2.0 * mass * basis.s_t]
    by.append(basis.drag[:, :, :-1])
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

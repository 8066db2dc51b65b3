"""The linear system of a linearly implicit step (physics.md section 7)."""

import math
from typing import NamedTuple

import numpy as np

from leg_wear_monitor.compiled.kernel import kernel
from leg_wear_monitor.compiled.vectors import WIDTH, only, padded, part_at, put_vector, vector_at, where
from leg_wear_monitor.dynamics.clearance.contact import CAM, DAMPING, NX, NY, STIFFNESS, components
from leg_wear_monitor.dynamics.joint import F_N
from leg_wear_monitor.mechanism.arrays import Floats, Ints

# The linear system of a linearly implicit step, stiff only along the contact normals (physics.md section 7).
#
# The method is ROS2 of Verwer et al. (A second-order Rosenbrock method applied to photochemical dispersion
# problems, 1999): order 2 for any approximate Jacobian, L-stable for gamma = 1 - 1 / sqrt 2 with the exact
# one. The approximation keeps the stiff terms only, the normal forces' stiffness K and damping C: with B =
# M^-1 N, N the normals of the contacts, the system in d unknowns reduces to one with a single unknown for
# each contact,
#
#     (D^-1 + N^T B) p = N^T r_v + gamma h D^-1 K N^T r_e,    D = gamma h C + (gamma h)^2 K,
#
# and x_v = r_v - B p, x_e = r_e + gamma h x_v solve (I - gamma h A) x = r. The same steps that eliminate D^-1
# + N^T B turn B into T = B (D^-1 + N^T B)^-1. Each of the three solutions of a step is then a product with T.


GAMMA = 1.0 - math.sqrt(0.5)


class ContactSystem(NamedTuple):
    """The reduced system of m contacts in k clearance joints; rooms are multiples of `WIDTH`.

    ``active`` (k,): joints of the m contacts; ``normal`` (2, room): x, then y of the normals, 0 without
    contact; ``ratio`` (room,): gamma h K / D; ``cam`` (room,) [m/s]: part of the penetration's rate that does
    not depend on e'; ``compliance`` (room,): 1 / D; ``rows`` (k, 3 room), one for each contact: of
    D^-1 + N^T B by joints (room) and of B^T (2 room), then of the unit matrix and of T^T; ``factor`` (k,): of
    the rows in an elimination; ``right`` (room,): right-hand side.
    """

    active: Ints
    normal: Floats
    ratio: Floats
    cam: Floats
    compliance: Floats
    rows: Floats
    factor: Floats
    right: Floats


def contact_system(k: int) -> ContactSystem:
    """Work arrays of the system for k clearance joints."""
    room = padded(k)
    return ContactSystem(
        active=np.zeros(k, dtype=np.int64),
        normal=np.zeros((2, room)),
        ratio=np.zeros(room),
        cam=np.zeros(room),
        compliance=np.zeros(room),
        rows=np.zeros((k, 3 * room)),
        factor=np.zeros(k),
        right=np.zeros(room),
    )


@kernel
def factorise_contacts(h, inverse_mass, speed, sample, out_system):
    """Eliminate the system of a step h [s] from a sample (SAMPLE_ROWS, room); returns how many touch."""
    m, g, active = 0, GAMMA * h, out_system.active
    for k in range(0, sample.shape[1], WIDTH):
        pushing = vector_at(sample, (F_N, k)) > 0.0
        stiffness = vector_at(sample, (STIFFNESS, k))
        damping = g * (vector_at(sample, (DAMPING, k)) + g * stiffness)
        compliance = 1.0 / where(pushing, damping, 1.0)
        put_vector(out_system.compliance, k, compliance)
        put_vector(out_system.ratio, k, g * stiffness * compliance)
        put_vector(out_system.cam, k, vector_at(sample, (CAM, k)) * speed)
        put_vector(out_system.normal, (0, k), where(pushing, vector_at(sample, (NX, k)), 0.0))
        put_vector(out_system.normal, (1, k), where(pushing, vector_at(sample, (NY, k)), 0.0))
    for k in range(active.shape[0]):
        if sample[F_N, k] > 0.0:
            active[m] = k
            m += 1
    for a in range(m):
        _couple(a, inverse_mass, sample, out_system)
    for c in range(m):
        _eliminate(c, m, inverse_mass.shape[0], out_system)
    return m


@kernel
def _couple(a, inverse_mass, sample, out_system):
    """Row of contact a in D^-1 + N^T B and in B^T."""
    k, rows, normal = out_system.active[a], out_system.rows, out_system.normal
    room, nx, ny = normal.shape[1], sample[NX, k], sample[NY, k]
    for i in range(0, inverse_mass.shape[0], WIDTH):
        pushed = nx * part_at(inverse_mass, (2 * k, i)) + ny * part_at(inverse_mass, (2 * k + 1, i))
        put_vector(rows, (a, room + i), pushed)
    for b in range(0, room, WIDTH):
        x, y = components(rows, a, room + 2 * b)
        along = vector_at(normal, (0, b)) * x + vector_at(normal, (1, b)) * y
        put_vector(rows, (a, b), along + only(out_system.compliance[k], k - b))


@kernel
def _eliminate(c, m, d, out_system):
    """Make the column of contact c one of the unit matrix: a step of Gauss and Jordan's, in all m rows."""
    rows, factor, joint = out_system.rows, out_system.factor, out_system.active[c]
    scale = 1.0 / rows[c, joint]
    for a in range(m):
        factor[a] = rows[a, joint]
    factor[c] = 0.0
    for i in range(0, rows.shape[1] // 3 + d, WIDTH):
        pivot = scale * vector_at(rows, (c, i))
        for a in range(m):
            put_vector(rows, (a, i), vector_at(rows, (a, i)) - factor[a] * pivot)
        put_vector(rows, (c, i), pivot)


@kernel
def solve_contacts(h, system, m, stage, x, r_e, r_v, out_e, out_v):
    """Solve (I - gamma h A) y = r: rows r_e and r_v of x contain r, rows out_e and out_v get y.

    ``stage`` is the coefficient of the explicit time derivative: 1 in the first stage, -1 in the second (1
    minus twice the first), 0 for the error.
    """
    g, right, normal, rows = GAMMA * h, system.right, system.normal, system.rows
    if m > 0:
        for k in range(0, right.shape[0], WIDTH):
            nx, ny = vector_at(normal, (0, k)), vector_at(normal, (1, k))
            vx, vy = components(x, r_v, 2 * k)
            ex, ey = components(x, r_e, 2 * k)
            along = nx * ex + ny * ey + stage * vector_at(system.cam, k)
            put_vector(right, k, nx * vx + ny * vy + vector_at(system.ratio, k) * along)
    for i in range(0, 2 * system.active.shape[0], WIDTH):
        total = vector_at(x, (r_v, i))
        for a in range(m):
            total -= right[system.active[a]] * vector_at(rows, (a, right.shape[0] + i))
        put_vector(x, (out_v, i), total)
        put_vector(x, (out_e, i), vector_at(x, (r_e, i)) + g * total)

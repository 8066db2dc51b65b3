"""The linear system of a linearly implicit step, stiff only along the contact normals (physics.md section 7).

The method is ROS2 of Verwer et al. (A second-order Rosenbrock method applied to photochemical dispersion
problems, 1999): order 2 for any approximate Jacobian, L-stable for gamma = 1 - 1 / sqrt 2 with the exact one.
The approximation keeps the stiff terms only, the normal forces' stiffness K and damping C: with B = M^-1 N, N
the normals of the contacts, the system in d unknowns reduces to one with a single unknown for each contact,

    (D^-1 + N^T B) p = N^T r_v + gamma h D^-1 K N^T r_e,    D = gamma h C + (gamma h)^2 K,

and x_v = r_v - B p, x_e = r_e + gamma h x_v solve (I - gamma h A) x = r.
"""

import math
from typing import NamedTuple

import numpy as np

from leg_wear_monitor.dynamics.clearance.contact import CAM, DAMPING, NX, NY, STIFFNESS
from leg_wear_monitor.dynamics.joint.contact_event import F_N
from leg_wear_monitor.kernel import kernel
from leg_wear_monitor.mechanism.arrays import Floats, Ints
from leg_wear_monitor.pairs import pair_at, put_pair

GAMMA = 1.0 - math.sqrt(0.5)


class ContactSystem(NamedTuple):
    """The factored system of m contacts in k clearance joints; the first m rows of each array are used.

    ``active`` (k,): the contacts' joints; ``normal`` (k, 2); ``response`` (k, d): B^T; ``factor`` (k, k): L,
    with 1 / D of L D L^T on its diagonal; ``ratio`` (k,): gamma h K / D; ``cam`` (k,) [m/s]: part of the
    penetration's rate that does not depend on e'; ``p`` (k,): unknowns. With films, of `film_system`:
    ``block``, ``stiff`` (d, 2), ``push`` (d,), ``matrix`` (d, d).
    """

    active: Ints
    normal: Floats
    response: Floats
    factor: Floats
    ratio: Floats
    cam: Floats
    p: Floats
    block: Floats
    stiff: Floats
    push: Floats
    matrix: Floats


def contact_system(k: int) -> ContactSystem:
    """Work arrays of the system for k clearance joints."""
    return ContactSystem(
        active=np.zeros(k, dtype=np.int64),
        normal=np.zeros((k, 2)),
        response=np.zeros((k, 2 * k)),
        factor=np.zeros((k, k)),
        ratio=np.zeros(k),
        cam=np.zeros(k),
        p=np.zeros(k),
        block=np.zeros((2 * k, 2)),
        stiff=np.zeros((2 * k, 2)),
        push=np.zeros(2 * k),
        matrix=np.zeros((2 * k, 2 * k)),
    )


@kernel
def factorise_contacts(h, inverse_mass, speed, sample, out_system):
    """Factorise the system of a step h [s] from a sample (k, COLUMNS); returns the number m of contacts."""
    m, g = 0, GAMMA * h
    response, factor = out_system.response, out_system.factor
    for k in range(sample.shape[0]):
        if sample[k, F_N] > 0.0:
            stiffness, nx, ny, row = sample[k, STIFFNESS], sample[k, NX], sample[k, NY], 2 * k
            compliance = 1.0 / (g * (sample[k, DAMPING] + g * stiffness))
            out_system.ratio[m] = g * stiffness * compliance
            out_system.active[m] = k
            out_system.cam[m] = sample[k, CAM] * speed
            out_system.normal[m, 0], out_system.normal[m, 1] = nx, ny
            for i in range(0, inverse_mass.shape[0], 2):
                pushed = nx * pair_at(inverse_mass, row, i) + ny * pair_at(inverse_mass, row + 1, i)
                put_pair(response, m, i, pushed)
            for a in range(m + 1):
                factor[m, a] = nx * response[a, row] + ny * response[a, row + 1]
            factor[m, m] += compliance
            m += 1
    for i in range(m):
        for j in range(i):
            rest = factor[i, j]
            for c in range(j):
                rest -= factor[i, c] * factor[j, c]
            factor[i, j] = rest
        pivot = factor[i, i]
        for c in range(i):
            scaled = factor[i, c] * factor[c, c]
            pivot -= scaled * factor[i, c]
            factor[i, c] = scaled
        factor[i, i] = 1.0 / pivot
    return m


@kernel
def solve_contacts(h, system, m, stage, x, r_e, r_v, out_e, out_v):
    """Solve (I - gamma h A) y = r: rows r_e and r_v of x (VECTORS, d) contain r, rows out_e and out_v get y.

    ``stage`` is the coefficient of the explicit time derivative: 1 in the first stage, -1 in the second (1
    minus twice the first), 0 for the error.
    """
    g, p, factor, response = GAMMA * h, system.p, system.factor, system.response
    for a in range(m):
        nx, ny, i = system.normal[a, 0], system.normal[a, 1], 2 * system.active[a]
        right = nx * x[r_v, i] + ny * x[r_v, i + 1]
        right += system.ratio[a] * (nx * x[r_e, i] + ny * x[r_e, i + 1] + stage * system.cam[a])
        for b in range(a):
            right -= factor[a, b] * p[b]
        p[a] = right
    for a in range(m - 1, -1, -1):
        right = p[a] * factor[a, a]
        for b in range(a + 1, m):
            right -= factor[b, a] * p[b]
        p[a] = right
    for i in range(0, x.shape[1], 2):
        total = pair_at(x, r_v, i)
        for a in range(m):
            total -= p[a] * pair_at(response, a, i)
        put_pair(x, out_v, i, total)
        put_pair(x, out_e, i, pair_at(x, r_e, i) + g * total)

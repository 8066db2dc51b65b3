"""The linear system of a linearly implicit step of a leg with films (physics.md section 7).

As `rosenbrock`, but in all eccentricities: a film is stiff in both directions, and its damping is not
symmetric. With the 2 x 2 damping C and stiffness K of contact and film in each joint, the rates solve

    (1 + M^-1 D) x_v = r_v - M^-1 gamma h K r_e,    D = gamma h C + (gamma h)^2 K.

M^-1 is positive definite, and so is the symmetric part of D or nearly: no pivots are sought.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import types

from leg_wear_monitor.compiled.kernel import ByAddress, entry, kernel
from leg_wear_monitor.compiled.vectors import WIDTH, only, padded, part_at, put_vector, vector_at, where
from leg_wear_monitor.contact.arrays import ContactArrays
from leg_wear_monitor.contact.film import film_damping, film_stiffness
from leg_wear_monitor.dynamics.clearance.contact import (
    ADD_FILMS,
    CAM,
    DAMPING,
    FILM_WIDTH,
    NX,
    NY,
    RADIUS,
    ROUGHNESS,
    SPEED_B,
    SPEED_J,
    STIFFNESS,
    VISCOSITY,
    FilmModel,
    components,
    film_settings,
)
from leg_wear_monitor.dynamics.joint import DELTA, EX, EY, F_N, VX, VY
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
# + N^T B turn B into T = B (D^-1 + N^T B)^-1, with which each of the three solutions of a step is a product.


GAMMA = 1.0 - math.sqrt(0.5)


class ContactSystem(NamedTuple):
    """The reduced system of m contacts in k clearance joints; rooms are multiples of `WIDTH`.

    ``active`` (k,): joints of the m contacts; ``normal`` (2, room): x, then y of the normals, 0 without
    contact; ``ratio`` (room,): gamma h K / D; ``cam`` (room,) [m/s]: part of the penetration's rate that does
    not depend on e'; ``compliance`` (room,): 1 / D; ``rows`` (k, 3 room), one for each contact: of
    D^-1 + N^T B by joints (room) and of B^T (2 room), then of the unit matrix and of T^T; ``factor`` (k,): of
    the rows in an elimination; ``right`` (room,): right-hand side. With films, of `film_system`: ``block``,
    ``stiff`` (d, 2), ``push`` (d,), ``matrix`` (d, d).
    """

    active: Ints
    normal: Floats
    ratio: Floats
    cam: Floats
    compliance: Floats
    rows: Floats
    factor: Floats
    right: Floats
    block: Floats
    stiff: Floats
    push: Floats
    matrix: Floats


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
        block=np.zeros((2 * k, 2)),
        stiff=np.zeros((2 * k, 2)),
        push=np.zeros(2 * k),
        matrix=np.zeros((2 * k, 2 * k)),
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
    for i in range(0, system.matrix.shape[0], WIDTH):
        total = vector_at(x, (r_v, i))
        for a in range(m):
            total -= right[system.active[a]] * vector_at(rows, (a, right.shape[0] + i))
        put_vector(x, (out_v, i), total)
        put_vector(x, (out_e, i), vector_at(x, (r_e, i)) + g * total)


@kernel
def _film_block(settings, k, g, slack, sample, out_block, out_stiffness):
    """Add the film of joint k to D and to g K, rows 2 k and 2 k + 1 of (2 k, 2).

    The damping is that of a gap which closes by ``slack`` [m/s] more, the tolerance of the rates. Where the
    gap begins to open the damping falls many times over, and steps with the smaller one would bounce off.
    """
    ex, ey, vx, vy = sample[EX, k], sample[EY, k], sample[VX, k], sample[VY, k]
    speed_b, speed_j = sample[SPEED_B, k], sample[SPEED_J, k]
    e = math.sqrt(ex * ex + ey * ey)
    clearance, radius, width = e - sample[DELTA, k], settings[k, RADIUS], settings[k, FILM_WIDTH]
    viscosity, roughness = settings[k, VISCOSITY], settings[k, ROUGHNESS]
    nx, ny, r = ex / e, ey / e, 2 * k
    xx, xy, yx, yy = film_damping(
        ex, ey, vx + slack * nx, vy + slack * ny, speed_b, speed_j,
        clearance, radius, width, viscosity, roughness,
    )  # fmt: skip
    kx, ky = film_stiffness(ex, ey, vx, vy, speed_b, speed_j, clearance, radius, width, viscosity, roughness)
    _add_block(r, g * kx * nx, g * kx * ny, g * ky * nx, g * ky * ny, out_stiffness)
    for i in range(r, r + 2):
        for c in range(2):
            out_block[i, c] += g * out_stiffness[i, c]
    _add_block(r, g * xx, g * xy, g * yx, g * yy, out_block)


@kernel
def _add_block(r, xx, xy, yx, yy, out_block):
    """Add to rows r and r + 1 of blocks (2 k, 2)."""
    out_block[r, 0] += xx
    out_block[r, 1] += xy
    out_block[r + 1, 0] += yx
    out_block[r + 1, 1] += yy


@entry
def factorise_films(
    h, settings, slack, inverse_mass, crank_speed, sample, out_block, out_stiffness, out_cam, out_matrix
):
    """Factorise the system of a step h [s] from a sample (SAMPLE_ROWS, room).

    Results: D and gamma h K as blocks (2 k, 2); force (2 k,) [N] of contacts by the rotation of worn walls;
    triangular factors (2 k, 2 k). Returns the number of unknowns.
    """
    g, d = GAMMA * h, inverse_mass.shape[0]
    for k in range(settings.shape[0]):
        r, nx, ny = 2 * k, sample[NX, k], sample[NY, k]
        for i in range(r, r + 2):
            out_cam[i] = 0.0
            for c in range(2):
                out_block[i, c], out_stiffness[i, c] = 0.0, 0.0
        if settings[k, VISCOSITY] > 0.0 and sample[EX, k] ** 2 + sample[EY, k] ** 2 > 0.0:
            _film_block(settings, k, g, slack, sample, out_block, out_stiffness)
        if sample[F_N, k] > 0.0:
            stiff = g * sample[STIFFNESS, k]
            hard = g * (sample[DAMPING, k] + stiff)
            _add_block(r, stiff * nx * nx, stiff * nx * ny, stiff * ny * nx, stiff * ny * ny, out_stiffness)
            _add_block(r, hard * nx * nx, hard * nx * ny, hard * ny * nx, hard * ny * ny, out_block)
            out_cam[r] = stiff * nx * sample[CAM, k] * crank_speed
            out_cam[r + 1] = stiff * ny * sample[CAM, k] * crank_speed
        for i in range(d):
            for c in range(2):
                out_matrix[i, r + c] = inverse_mass[r, i] * out_block[r, c]
                out_matrix[i, r + c] += inverse_mass[r + 1, i] * out_block[r + 1, c]
    for i in range(d):
        out_matrix[i, i] += 1.0
    for p in range(d):
        for i in range(p + 1, d):
            factor = out_matrix[i, p] / out_matrix[p, p]
            out_matrix[i, p] = factor
            for c in range(p + 1, d):
                out_matrix[i, c] -= factor * out_matrix[p, c]
    return d


@entry
def solve_films(h, stage, inverse_mass, stiffness, cam, matrix, x, r_e, r_v, out_e, out_v):
    """As `rosenbrock.solve_contacts`, with what `factorise_films` gave."""
    g, d = GAMMA * h, matrix.shape[0]
    for i in range(d):
        x[out_v, i] = x[r_v, i]
    for r in range(0, d, 2):
        for c in range(2):
            row = r + c
            force = stiffness[row, 0] * x[r_e, r] + stiffness[row, 1] * x[r_e, r + 1] + stage * cam[row]
            for i in range(d):
                x[out_v, i] -= inverse_mass[row, i] * force
    for i in range(d):
        for c in range(i):
            x[out_v, i] -= matrix[i, c] * x[out_v, c]
    for i in range(d - 1, -1, -1):
        for c in range(i + 1, d):
            x[out_v, i] -= matrix[i, c] * x[out_v, c]
        x[out_v, i] /= matrix[i, i]
    for i in range(d):
        x[out_e, i] = x[r_e, i] + g * x[out_v, i]
    return d


FACTORISE_FILMS = ByAddress(factorise_films, types.int64)
SOLVE_FILMS = ByAddress(solve_films, types.int64)
_factorise_films, _solve_films = FACTORISE_FILMS.call, SOLVE_FILMS.call


@kernel
def factorise_step(film, h, slack, now, sample, system):
    """Factorise the linear system of a step h [s]; returns the number of contacts if there are no films.

    ``slack`` [m/s]: tolerance of the rates.
    """
    if film.settings.shape[0] == 0:
        return factorise_contacts(h, now.inverse_mass, now.speed[0], sample, system)
    _factorise_films(
        film.factorise,
        (
            h, film.settings, slack, now.inverse_mass, now.speed[0], sample,
            system.block, system.stiff, system.push, system.matrix,
        ),
    )  # fmt: skip
    return 0


@kernel
def solve_step(film, h, now, system, m, stage, x, r_e, r_v, out_e, out_v):
    """Solve the linear system, as `solve_contacts`."""
    if film.settings.shape[0] == 0:
        solve_contacts(h, system, m, stage, x, r_e, r_v, out_e, out_v)
        return
    _solve_films(
        film.solve,
        (
            h, stage, now.inverse_mass, system.stiff, system.push, system.matrix,
            x, r_e, r_v, out_e, out_v,
        ),
    )  # fmt: skip


def film_model(contacts: ContactArrays, films: Floats) -> FilmModel:
    """Films of the joints, from viscosity and roughness (k, 2); compiles their kernels if there are any."""
    settings, line, square = film_settings(contacts, films), np.zeros(2), np.zeros((2, 2))
    if not len(settings):
        return FilmModel(settings, 0, 0, 0)
    return FilmModel(
        settings,
        ADD_FILMS.address(settings, square, line, square, square, 0.0, square, 0, 0, square),
        FACTORISE_FILMS.address(0.0, settings, 0.0, square, 0.0, square, square, square, line, square),
        SOLVE_FILMS.address(0.0, 0.0, square, square, line, square, square, 0, 0, 0, 0),
    )

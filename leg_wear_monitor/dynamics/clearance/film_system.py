"""The linear system of a linearly implicit step of a leg with films (physics.md section 7).

As `rosenbrock`, but in all eccentricities: a film is stiff in both directions, and its damping is not
symmetric. With the 2 x 2 damping C and stiffness K of contact and film in each joint, the rates solve

    (1 + M^-1 D) x_v = r_v - M^-1 gamma h K r_e,    D = gamma h C + (gamma h)^2 K.

M^-1 is positive definite, and so is the symmetric part of D or nearly: no pivots are sought.
"""

import math

import numpy as np
from numba import types

from leg_wear_monitor.contact.arrays import ContactArrays
from leg_wear_monitor.contact.film import film_damping, film_stiffness
from leg_wear_monitor.dynamics.clearance.contact import CAM, DAMPING, NX, NY, STIFFNESS
from leg_wear_monitor.dynamics.clearance.film import (
    ADD_FILMS,
    RADIUS,
    ROUGHNESS,
    SPEED_B,
    SPEED_J,
    VISCOSITY,
    WIDTH,
    FilmModel,
    film_settings,
)
from leg_wear_monitor.dynamics.clearance.rosenbrock import GAMMA, factorise_contacts, solve_contacts
from leg_wear_monitor.dynamics.joint.contact_event import DELTA, EX, EY, F_N, VX, VY
from leg_wear_monitor.kernel import ByAddress, entry, kernel
from leg_wear_monitor.mechanism.arrays import Floats


@kernel
def _film_block(settings, k, g, slack, sample, out_block, out_stiffness):
    """Add the film of joint k to D and to g K, rows 2 k and 2 k + 1 of (2 k, 2).

    The damping is that of a gap which closes by ``slack`` [m/s] more, the tolerance of the rates. Where the
    gap begins to open the damping falls many times over, and steps with the smaller one would bounce off.
    """
    ex, ey, vx, vy = sample[EX, k], sample[EY, k], sample[VX, k], sample[VY, k]
    speed_b, speed_j = sample[SPEED_B, k], sample[SPEED_J, k]
    e = math.sqrt(ex * ex + ey * ey)
    clearance, radius, width = e - sample[DELTA, k], settings[k, RADIUS], settings[k, WIDTH]
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

"""Films of oil or grease in clearance coordinates: forces and their effect on the leg (physics.md section 7).

A film's force is conjugate to the eccentricity, as the contact's is. Its moments turn the bodies of bushing
and journal, whose rates depend on all eccentricities and on the crank. The kernels of a step call the entry
by its address, which only a leg with films has: a dry leg neither compiles nor runs it.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import types

from leg_wear_monitor.contact.arrays import ContactArrays
from leg_wear_monitor.contact.film import film_force
from leg_wear_monitor.dynamics.joint.contact_event import DELTA, EX, EY, SAMPLE, VX, VY
from leg_wear_monitor.kernel import ByAddress, entry
from leg_wear_monitor.mechanism.arrays import Floats

# rows of a sample: force of the film on the journal [N], its moments on the bushing's and the journal's
# body [N m], speeds of these bodies [rad/s]
FILM_X, FILM_Y, MOMENT_B, MOMENT_J, SPEED_B, SPEED_J = range(SAMPLE, SAMPLE + 6)
FILM_SAMPLE = SAMPLE + 6

# settings of a film: radius of the bushing, width [m], viscosity [Pa s], 0 for a dry joint, roughness [m]
RADIUS, WIDTH, VISCOSITY, ROUGHNESS = range(4)


class FilmModel(NamedTuple):
    """Films of the clearance joints.

    ``settings`` (k, 4): columns above, no rows for a leg without films; ``force``, ``factorise`` and
    ``solve``: addresses of `add_films`, `film_system.factorise_films` and `film_system.solve_films`, 0
    without films.
    """

    settings: Floats
    force: int
    factorise: int
    solve: int


def film_settings(contacts: ContactArrays, films: Floats) -> Floats:
    """Settings of the films, from viscosity and roughness (k, 2); none if all joints are dry."""
    settings = np.column_stack([contacts.bushing_radius, contacts.width, films])
    return settings if (films[:, 0] > 0.0).any() else settings[:0]


@entry
def add_films(settings, spin, spin_turn, response, inverse_mass, crank_speed, x, at_v, out_a, out_sample):
    """Add the films' forces to the accelerations in row out_a of x (VECTORS, d) and to the samples.

    ``spin`` (2 k, d), ``spin_turn`` (2 k,), ``response`` (2 k, d): of the step tables; rates of the
    eccentricities [m/s] in row at_v. The film is that of the local clearance. Returns the number of joints.
    """
    d = inverse_mass.shape[0]
    for k in range(settings.shape[0]):
        if settings[k, VISCOSITY] > 0.0:
            b, j = 2 * k, 2 * k + 1
            speed_b, speed_j = spin_turn[b] * crank_speed, spin_turn[j] * crank_speed
            for i in range(d):
                speed_b += spin[b, i] * x[at_v, i]
                speed_j += spin[j, i] * x[at_v, i]
            ex, ey = out_sample[EX, k], out_sample[EY, k]
            clearance = math.sqrt(ex * ex + ey * ey) - out_sample[DELTA, k]
            fx, fy, moment_b, moment_j = film_force(
                ex, ey, out_sample[VX, k], out_sample[VY, k], speed_b, speed_j, clearance,
                settings[k, RADIUS], settings[k, WIDTH], settings[k, VISCOSITY], settings[k, ROUGHNESS],
            )  # fmt: skip
            for i in range(d):
                x[out_a, i] += inverse_mass[b, i] * fx + inverse_mass[j, i] * fy
                x[out_a, i] += response[b, i] * moment_b + response[j, i] * moment_j
            out_sample[FILM_X, k], out_sample[FILM_Y, k] = fx, fy
            out_sample[MOMENT_B, k], out_sample[MOMENT_J, k] = moment_b, moment_j
            out_sample[SPEED_B, k], out_sample[SPEED_J, k] = speed_b, speed_j
    return settings.shape[0]


ADD_FILMS = ByAddress(add_films, types.int64)

"""Contact forces and accelerations in clearance coordinates (physics.md sections 3, 4 and 7).

This is the innermost loop: the joints are the entries of vectors, and what depends on a joint's state is a
choice of two values, not a jump.
"""

import numpy as np

from leg_wear_monitor.contact.geometry import journal_contact
from leg_wear_monitor.dynamics.clearance.film import ADD_FILMS, FILM_SAMPLE
from leg_wear_monitor.dynamics.clearance.joint_laws import (
    FRESH_CLEARANCE,
    FRESH_COEFFICIENT,
    joint_forces,
)
from leg_wear_monitor.dynamics.clearance.worn_walls import touch_worn_walls
from leg_wear_monitor.dynamics.joint.contact_event import DELTA, DELTA_DOT, EX, EY, F_N, VX, VY
from leg_wear_monitor.dynamics.run.run_statistics import JOINT_RATES
from leg_wear_monitor.kernel import kernel
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.vectors import (
    WIDTH,
    evens,
    every,
    odds,
    part_at,
    put_vector,
    vector_at,
    zip_first,
    zip_last,
)

# further rows of a sample, after the film's: normal, friction force [N], slip speed [m/s], derivatives of
# the normal force by the penetration [N/m] and by its rate [N s/m], its elastic part [N], derivative of the
# penetration by the crank angle through the rotation of worn bodies [m/rad], the normal law's coefficient for
# the local radii (unit of the law), and the local clearance [m]
NX, NY, F_T, SLIP, STIFFNESS = range(FILM_SAMPLE, FILM_SAMPLE + 5)
DAMPING, ELASTIC, CAM, COEFFICIENT, CLEARANCE = range(FILM_SAMPLE + 5, FILM_SAMPLE + 10)
SAMPLE_ROWS = FILM_SAMPLE + 10

# integrals of a joint in a step beyond those of the run statistics: friction force [N s]; moment about the
# crank of the normal force on rotating worn walls [N m s]
RUB, LIFT = JOINT_RATES, JOINT_RATES + 1
ADDED = JOINT_RATES + 2

# rows of the step's vectors (d,): eccentricities, rates and accelerations at its start (0), between its
# stages (M) and at its end (1); accelerations without contact; slopes of the stages; right-hand sides;
# change of the rates in the last step; coefficients of the rates in the drive torque; forces of the contacts
E0, V0, A0, EM, VM, E1, V1, A1, DRIFT, K1E, K1V, K2E, K2V, RE, RV, DV, BY_V, PUSH = range(18)
VECTORS = 18

_add_films = ADD_FILMS.call


def fresh_sample(law: Floats) -> Floats:
    """A sample (SAMPLE_ROWS, room) with what does not change as long as the walls are not worn."""
    sample = np.zeros((SAMPLE_ROWS, law.shape[1]))
    sample[CLEARANCE], sample[COEFFICIENT] = law[FRESH_CLEARANCE], law[FRESH_COEFFICIENT]
    return sample


@kernel
def accelerate_clearances(model, surfaces, approach, now, turned, x, at_e, at_v, out_a, out_sample, whole):
    """Accelerations of the eccentricities [m/s^2] with all contact forces, and samples of the joints.

    ``approach`` (k,): approach speeds [m/s], 0 for open joints; ``now``: the step's tables; ``turned``: crank
    angle relative to that of the tables [rad]; x (VECTORS, room) with eccentricities [m] and rates [m/s] in
    rows at_e and at_v, the result in row out_a; out_sample (SAMPLE_ROWS, room), only what the accelerations
    need of it if not ``whole``.
    """
    for k in range(0, out_sample.shape[1], WIDTH):
        _push_joints(model, surfaces, approach, now, turned, k, x, at_e, at_v, out_sample, whole)
    _accelerate(now.inverse_mass, now.moment, x, out_a, out_sample)
    films = model.film.settings
    if films.shape[0] > 0:
        spin, turn, speed = now.spin, now.spin_turn, now.speed[0]
        _add_films(
            model.film.force,
            (films, spin, turn, now.spin_response, now.inverse_mass, speed, x, at_v, out_a, out_sample),
        )


@kernel
def _push_joints(model, surfaces, approach, now, turned, k, x, at_e, at_v, out_sample, whole):
    """Contact forces of eight joints from joint k on, into row PUSH of x and into the samples."""
    ex, ey = components(x, at_e, 2 * k)
    vx, vy = components(x, at_v, 2 * k)
    if surfaces.feeds_back:
        delta, nx, ny, cam, clearance, coefficient = touch_worn_walls(model, surfaces, now, turned, k, ex, ey)
        put_vector(out_sample, (CAM, k), cam)
        put_vector(out_sample, (CLEARANCE, k), clearance)
        put_vector(out_sample, (COEFFICIENT, k), coefficient)
    else:
        clearance, cam = vector_at(model.law, (FRESH_CLEARANCE, k)), every(0.0)
        coefficient = vector_at(model.law, (FRESH_COEFFICIENT, k))
        delta, nx, ny = journal_contact(ex, ey, clearance)
    speed = now.speed[0]
    slip = nx * vy - ny * vx + part_at(now.lever_drive, k) * speed
    for i in range(now.lever.shape[0]):
        slip += x[at_v, i] * part_at(now.lever, (i, k))
    rate, closing = nx * vx + ny * vy + cam * speed, part_at(approach, k)
    f_n, stiffness, damping, elastic, f_t = joint_forces(
        model, k, coefficient, clearance, closing, delta, rate, slip
    )
    fx, fy = -f_n * nx - f_t * ny, f_t * nx - f_n * ny
    put_vector(x, (PUSH, 2 * k), zip_first(fx, fy))
    put_vector(x, (PUSH, 2 * k + WIDTH), zip_last(fx, fy))
    put_vector(out_sample, (F_T, k), f_t)
    if not (whole or model.film.settings.shape[0] > 0):
        return
    put_vector(out_sample, (F_N, k), f_n)
    put_vector(out_sample, (STIFFNESS, k), stiffness)
    put_vector(out_sample, (DAMPING, k), damping)
    put_vector(out_sample, (ELASTIC, k), elastic)
    put_vector(out_sample, (EX, k), ex)
    put_vector(out_sample, (EY, k), ey)
    put_vector(out_sample, (VX, k), vx)
    put_vector(out_sample, (VY, k), vy)
    put_vector(out_sample, (DELTA, k), delta)
    put_vector(out_sample, (DELTA_DOT, k), rate)
    put_vector(out_sample, (NX, k), nx)
    put_vector(out_sample, (NY, k), ny)
    put_vector(out_sample, (SLIP, k), slip)


@kernel
def components(rows, row, i):
    """X and y of eight joints in a row of an array, from its entry i on."""
    first, second = vector_at(rows, (row, i)), vector_at(rows, (row, i + WIDTH))
    return evens(first, second), odds(first, second)


@kernel
def _accelerate(inverse_mass, moment, x, out_a, sample):
    """Accelerations in row out_a by the forces of the joints in row PUSH, and by their friction's moments."""
    d = inverse_mass.shape[0]
    for i in range(0, d, WIDTH):
        total = vector_at(x, (PUSH, i))
        for k in range(moment.shape[0]):
            total += sample[F_T, k] * part_at(moment, (k, i))
        put_vector(x, (PUSH, i), total)
    for i in range(0, d, WIDTH):
        total, other = vector_at(x, (DRIFT, i)), every(0.0)
        for j in range(0, d, 2):
            total += x[PUSH, j] * part_at(inverse_mass, (j, i))
            other += x[PUSH, j + 1] * part_at(inverse_mass, (j + 1, i))
        put_vector(x, (out_a, i), total + other)

"""Contact forces and accelerations in clearance coordinates (physics.md sections 3, 4 and 7).

This is the innermost loop: it indexes plain arrays, because views and calls for each joint would cost more
time than the contact laws.
"""

import math

import numpy as np

from leg_wear_monitor.contact.arrays import ContactArrays
from leg_wear_monitor.contact.friction import friction_force
from leg_wear_monitor.contact.geometry import journal_contact
from leg_wear_monitor.contact.normal.laws import normal_force
from leg_wear_monitor.dynamics.clearance.film import ADD_FILMS, FILM_SAMPLE
from leg_wear_monitor.dynamics.joint.contact_event import DELTA, DELTA_DOT, EX, EY, F_N, VX, VY
from leg_wear_monitor.dynamics.joint.joint_contact import coefficient_at, penetration
from leg_wear_monitor.dynamics.run.run_statistics import JOINT_RATES
from leg_wear_monitor.kernel import entry, kernel
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.pairs import pair_at, pair_sum, put_pair

# further columns of a sample, after the film's: normal, friction force [N], slip speed [m/s], derivatives of
# the normal force by the penetration [N/m] and by its rate [N s/m], its elastic part [N], derivative of the
# penetration by the crank angle through the rotation of worn bodies [m/rad], the normal law's coefficient for
# the local radii (unit of the law), and the local clearance [m]
NX, NY, F_T, SLIP, STIFFNESS = range(FILM_SAMPLE, FILM_SAMPLE + 5)
DAMPING, ELASTIC, CAM, COEFFICIENT, CLEARANCE = range(FILM_SAMPLE + 5, FILM_SAMPLE + 10)
COLUMNS = FILM_SAMPLE + 10

# integrals of a joint in a step beyond those of the run statistics: friction force [N s]; moment about the
# crank of the normal force on rotating worn walls [N m s]
RUB, LIFT = JOINT_RATES, JOINT_RATES + 1
ADDED = JOINT_RATES + 2

# a reference direction, near which angles are computed without an arc tangent: cosine, sine and angle [rad]
TO_X, TO_Y, TO_ANGLE = range(3)

# the laws of a joint: number of the normal law's form, its hysteresis factor and its coefficient on fresh
# surfaces; friction coefficient, ramp, and code of the friction law
NORMAL_FORM, HYSTERESIS_FACTOR, FRESH_COEFFICIENT = range(3)
FRICTION_COEFFICIENT, RAMP_0, RAMP_1, FRICTION_LAW = range(3, 7)

# rows of the step's vectors (d,): eccentricities, rates and accelerations at its start (0), between its
# stages (M) and at its end (1); accelerations without contact; slopes of the stages; right-hand sides;
# change of the rates in the last step; coefficients of the rates in the drive torque; contact forces
E0, V0, A0, EM, VM, E1, V1, A1, DRIFT, K1E, K1V, K2E, K2V, RE, RV, DV, BY_V, PUSH = range(18)
VECTORS = 18

_add_films = ADD_FILMS.call

_NEAR = 0.1  # largest sine of an angle for the arc sine's series, whose error is then 3e-11 rad


def contact_laws(contacts: ContactArrays) -> Floats:
    """Parameters of the contact laws of the clearance joints (k, 7), in the columns above."""
    fresh = np.empty(len(contacts.joint))
    _fresh_coefficients(contacts, fresh)
    normal = np.column_stack([contacts.normal_form, contacts.hysteresis, fresh])
    return np.column_stack([normal, contacts.friction, contacts.friction_law])


@entry
def _fresh_coefficients(contacts, out_coefficient):
    """Coefficients (k,) of the normal laws on fresh surfaces, each in the law's own unit."""
    for k in range(out_coefficient.shape[0]):
        radius = contacts.bushing_radius[k]
        out_coefficient[k] = coefficient_at(contacts, k, radius, radius - contacts.clearance[k])


@kernel
def take_directions(x, out_toward):
    """Reference directions (k, 3) of the eccentricities in row E0 of x."""
    for k in range(out_toward.shape[0]):
        ex, ey = x[E0, 2 * k], x[E0, 2 * k + 1]
        length = math.sqrt(ex * ex + ey * ey)
        out_toward[k, TO_X] = ex / length if length > 0.0 else 1.0
        out_toward[k, TO_Y] = ey / length if length > 0.0 else 0.0
        out_toward[k, TO_ANGLE] = math.atan2(ey, ex)


@kernel
def direction_of(ex, ey, k, toward):
    """Angle [rad] of an eccentricity (ex, ey) of joint k; from the reference direction if it is near."""
    to_x, to_y = toward[k, TO_X], toward[k, TO_Y]
    across, along = to_x * ey - to_y * ex, to_x * ex + to_y * ey
    if along > 0.0 and abs(across) < _NEAR * along:
        s = across / math.sqrt(ex * ex + ey * ey)
        square = s * s
        return toward[k, TO_ANGLE] + s * (
            1.0 + square * (1.0 / 6.0 + square * (3.0 / 40.0 + square * (15.0 / 336.0)))
        )
    return math.atan2(ey, ex)


@kernel
def accelerate_clearances(model, surfaces, approach, now, turned, x, at_e, at_v, out_a, out_sample):
    """Accelerations of the eccentricities [m/s^2] with all contact forces, and samples of the joints.

    ``approach`` (k,): approach speeds [m/s], 0 for open joints; ``now``: the step's tables; ``turned``: crank
    angle relative to that of the tables [rad]; x (VECTORS, d) with eccentricities [m] and rates [m/s] in rows
    at_e and at_v, the result in row out_a; out_sample (k, COLUMNS).
    """
    contacts, law, speed, inverse_mass = model.contacts, model.law, now.speed[0], now.inverse_mass
    for k in range(approach.shape[0]):
        ex, ey, vx, vy = x[at_e, 2 * k], x[at_e, 2 * k + 1], x[at_v, 2 * k], x[at_v, 2 * k + 1]
        cam, coefficient, clearance = 0.0, law[k, FRESH_COEFFICIENT], contacts.clearance[k]
        if surfaces.feeds_back:
            turn_b, turn_j = now.turn[k, 0], now.turn[k, 1]
            angle_b, angle_j = now.angle[k, 0] + turn_b * turned, now.angle[k, 1] + turn_j * turned
            direction = direction_of(ex, ey, k, now.toward)
            delta, nx, ny, bushing, journal, slope_b, slope_j = penetration(
                contacts, surfaces, k, ex, ey, direction, angle_b, angle_j
            )
            cam = slope_b * turn_b + slope_j * turn_j
            clearance = bushing - journal
            if delta > 0.0:
                coefficient = coefficient_at(contacts, k, bushing, journal)
        else:
            delta, nx, ny = journal_contact(ex, ey, clearance)
        delta_dot = nx * vx + ny * vy + cam * speed
        f_n, stiffness, damping, elastic, f_t, slip = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        fx, fy = 0.0, 0.0
        if delta > 0.0 and approach[k] > 0.0:
            loss = law[k, HYSTERESIS_FACTOR] / approach[k]
            f_n, stiffness, damping, elastic = normal_force(
                law[k, NORMAL_FORM], coefficient, clearance, loss, delta, delta_dot
            )
            if f_n > 0.0:
                slip = nx * vy - ny * vx + now.lever_drive[k] * speed + _row_product(now.lever, k, x, at_v)
                mu, code = law[k, FRICTION_COEFFICIENT], law[k, FRICTION_LAW]
                f_t = friction_force(code, mu, law[k, RAMP_0], law[k, RAMP_1], f_n, slip)
                fx, fy = -f_n * nx - f_t * ny, -f_n * ny + f_t * nx
        x[PUSH, 2 * k], x[PUSH, 2 * k + 1] = fx, fy
        out_sample[k, EX], out_sample[k, EY], out_sample[k, VX], out_sample[k, VY] = ex, ey, vx, vy
        out_sample[k, F_N], out_sample[k, DELTA], out_sample[k, DELTA_DOT] = f_n, delta, delta_dot
        out_sample[k, NX], out_sample[k, NY], out_sample[k, F_T], out_sample[k, SLIP] = nx, ny, f_t, slip
        out_sample[k, STIFFNESS], out_sample[k, DAMPING], out_sample[k, ELASTIC] = stiffness, damping, elastic
        out_sample[k, CAM], out_sample[k, COEFFICIENT], out_sample[k, CLEARANCE] = cam, coefficient, clearance
    _push(inverse_mass, now.lever_response, x, out_a, out_sample)
    films = model.film.settings
    if films.shape[0] > 0:
        spin, turn = now.spin, now.spin_turn
        _add_films(
            model.film.force,
            (films, spin, turn, now.spin_response, inverse_mass, speed, x, at_v, out_a, out_sample),
        )


@kernel
def _row_product(matrix, row, x, at):
    """Product of a row of a matrix (..., d) with row ``at`` of x (VECTORS, d)."""
    total = pair_at(matrix, row, 0) * pair_at(x, at, 0)
    for i in range(2, x.shape[1], 2):
        total += pair_at(matrix, row, i) * pair_at(x, at, i)
    return pair_sum(total)


@kernel
def _push(inverse_mass, response, x, out_a, sample):
    """Accelerations in row out_a by the forces of the joints in row PUSH, and by their friction's moments."""
    for i in range(0, x.shape[1], 2):
        total = pair_at(x, DRIFT, i)
        for k in range(sample.shape[0]):
            if sample[k, F_N] > 0.0:
                pushed = x[PUSH, 2 * k + 1] * pair_at(inverse_mass, 2 * k + 1, i)
                pushed += sample[k, F_T] * pair_at(response, k, i)
                total += x[PUSH, 2 * k] * pair_at(inverse_mass, 2 * k, i) + pushed
        put_pair(x, out_a, i, total)

"""Contact forces and accelerations in clearance coordinates (physics.md sections 3, 4 and 7).

This is the innermost loop: the joints are the entries of vectors, and what depends on a joint's state is a
choice of two values, not a jump.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import types

from leg_wear_monitor.compiled.kernel import ByAddress, entry, kernel
from leg_wear_monitor.compiled.vectors import (
    LEAST_DIVISOR,
    WIDTH,
    any_of,
    entry_of,
    evens,
    every,
    largest,
    odds,
    padded,
    part_at,
    put_vector,
    root,
    vector_at,
    where,
    with_entry,
    zip_first,
    zip_last,
)
from leg_wear_monitor.contact.arrays import ContactArrays
from leg_wear_monitor.contact.film import film_force
from leg_wear_monitor.contact.friction import NONE, THRELFALL, against, ambrosio_ramp, friction_force
from leg_wear_monitor.contact.geometry import journal_contact
from leg_wear_monitor.contact.normal import (
    LAWS,
    hertz_coefficient,
    hertz_force,
    hertz_softening,
    normal_force,
)
from leg_wear_monitor.dynamics.joint import (
    DELTA,
    DELTA_DOT,
    EX,
    EY,
    F_N,
    SAMPLE,
    VX,
    VY,
    coefficient_at,
    penetration,
    soften,
    touch_walls,
)
from leg_wear_monitor.dynamics.run import DISSIPATION, FORCE, FORCE_SQUARED, JOINT_RATES
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.wear import BUSHING, JOURNAL, profiles_at

# Laws of the clearance joints in vectors: normal and friction forces of eight joints at once.
#
# The usual laws are formulas for vectors, in which what depends on a joint's state is a choice of two values,
# not a jump. Laws of other forms are computed joint by joint.


# rows of the joints' laws: number of the normal law's form, its hysteresis factor and its coefficient on
# fresh surfaces, clearance [m]; friction coefficient, ramp, and code of the friction law
NORMAL_FORM, HYSTERESIS_FACTOR, FRESH_COEFFICIENT, FRESH_CLEARANCE = range(4)
FRICTION_COEFFICIENT, RAMP_0, RAMP_1, FRICTION_LAW = range(4, 8)
LAW_ROWS = 8

_HERTZ = LAWS["hertz"].number


def contact_laws(contacts: ContactArrays) -> Floats:
    """Parameters of the contact laws of the clearance joints (LAW_ROWS, room), in the rows above."""
    k = len(contacts.joint)
    laws, fresh = np.zeros((LAW_ROWS, padded(k))), np.empty(k)
    _fresh_coefficients(contacts, fresh)
    laws[:FRICTION_COEFFICIENT, :k] = contacts.normal_form, contacts.hysteresis, fresh, contacts.clearance
    laws[FRICTION_COEFFICIENT:FRICTION_LAW, :k] = contacts.friction.T
    laws[FRICTION_LAW, :k] = contacts.friction_law
    laws[FRICTION_COEFFICIENT, :k][contacts.friction_law == NONE] = 0.0
    return laws


def have_usual_laws(contacts: ContactArrays) -> bool:
    """Whether all joints have Hertz's form and a friction without an exponential: vectors of joints."""
    return bool((contacts.normal_form == _HERTZ).all() and (contacts.friction_law != THRELFALL).all())


@entry
def _fresh_coefficients(contacts, out_coefficient):
    """Coefficients (k,) of the normal laws on fresh surfaces, each in the law's own unit."""
    for k in range(out_coefficient.shape[0]):
        radius = contacts.bushing_radius[k]
        out_coefficient[k] = coefficient_at(contacts, k, radius, radius - contacts.clearance[k])


@kernel
def joint_forces(model, k, coefficient, clearance, approach, delta, rate, slip):
    """Forces of eight joints from joint k on; all arguments after k are vectors, the approach 0 if open.

    Returns
    -------
    f_n, stiffness, damping, elastic, f_t
        As in a sample; all 0 for a joint that is open or apart.
    """
    law = model.law
    touching = (delta > 0.0) & (approach > 0.0)
    loss = vector_at(law, (HYSTERESIS_FACTOR, k)) / where(touching, approach, 1.0)
    delta = where(touching, delta, 0.0)
    mu = vector_at(law, (FRICTION_COEFFICIENT, k))
    v0, v1 = vector_at(law, (RAMP_0, k)), vector_at(law, (RAMP_1, k))
    f_n, stiffness, damping, elastic = hertz_force(coefficient, clearance, loss, delta, rate)
    f_t = against(slip, mu * ambrosio_ramp(abs(slip), v0, v1) * f_n)
    if not model.usual:
        for i in range(WIDTH):
            if entry_of(delta, i) > 0.0:
                n, s, d, e = normal_force(
                    law[NORMAL_FORM, k + i], entry_of(coefficient, i), entry_of(clearance, i),
                    entry_of(loss, i), entry_of(delta, i), entry_of(rate, i),
                )  # fmt: skip
                t = friction_force(
                    law[FRICTION_LAW, k + i], law[FRICTION_COEFFICIENT, k + i], entry_of(v0, i),
                    entry_of(v1, i), n, entry_of(slip, i),
                )  # fmt: skip
                f_n, stiffness = with_entry(f_n, i, n), with_entry(stiffness, i, s)
                damping, elastic = with_entry(damping, i, d), with_entry(elastic, i, e)
                f_t = with_entry(f_t, i, t)
    return f_n, stiffness, damping, elastic, f_t


# Contact of eight joints on walls that wear has changed (physics.md sections 3 and 6).


# rows of a reference direction, near which angles are computed without an arc tangent: cosine, sine and
# angle [rad]
TO_X, TO_Y, TO_ANGLE = range(3)

_NEAR = 0.1  # largest sine of an angle for the arc sine's series, whose error is then 3e-11 rad


@kernel
def take_directions(e, out_toward):
    """Reference directions (3, k) of the eccentricities e (d,)."""
    for k in range(out_toward.shape[1]):
        ex, ey = e[2 * k], e[2 * k + 1]
        length = math.sqrt(ex * ex + ey * ey)
        out_toward[TO_X, k] = ex / length if length > 0.0 else 1.0
        out_toward[TO_Y, k] = ey / length if length > 0.0 else 0.0
        out_toward[TO_ANGLE, k] = math.atan2(ey, ex)


@kernel
def directions_of(ex, ey, k, toward):
    """Angles [rad] of the eccentricities of eight joints, from the reference directions where near."""
    to_x, to_y = part_at(toward, (TO_X, k)), part_at(toward, (TO_Y, k))
    across, along, length = to_x * ey - to_y * ex, to_x * ex + to_y * ey, root(ex * ex + ey * ey)
    s = across / largest(length, LEAST_DIVISOR)
    square = s * s
    series = 1.0 + square * (1.0 / 6.0 + square * (3.0 / 40.0 + square * (15.0 / 336.0)))
    direction = part_at(toward, (TO_ANGLE, k)) + s * series
    far = (abs(across) >= _NEAR * along) & (length > 0.0)
    if any_of(far):
        off = where(far, 1.0, 0.0)
        for i in range(WIDTH):
            if entry_of(off, i) > 0.0:
                direction = with_entry(direction, i, math.atan2(entry_of(ey, i), entry_of(ex, i)))
    return direction


@kernel
def touch_worn_walls(model, surfaces, now, turned, k, ex, ey):
    """Penetrations of eight joints from joint k on, and what depends on the place on worn walls.

    ``turned``: crank angle relative to that of the tables [rad]; eccentricities (ex, ey) [m].

    Returns
    -------
    delta, nx, ny, cam, clearance, coefficient
        As in a sample.
    """
    turn_b, turn_j = _of_bodies(now.turn_line, k)
    angle_b, angle_j = _of_bodies(now.angle_line, k)
    angle_b, angle_j = angle_b + turn_b * turned, angle_j + turn_j * turned
    direction = directions_of(ex, ey, k, now.toward)
    contacts, fresh = model.contacts, vector_at(model.law, (FRESH_COEFFICIENT, k))
    depth_b, slope_b, bend_b = profiles_at(surfaces.depth, k, BUSHING, direction - angle_b)
    depth_j, slope_j, bend_j = profiles_at(surfaces.depth, k, JOURNAL, direction - angle_j)
    radius, given = part_at(contacts.bushing_radius, k), part_at(contacts.stiffness, k)
    bushing, journal = radius + depth_b, radius - part_at(contacts.clearance, k) - depth_j
    clearance = bushing - journal
    delta, nx, ny, cam_b, cam_j = touch_walls(ex, ey, clearance, slope_b, slope_j, bend_b, bend_j)
    inside = largest(delta, 0.0)
    softer_b, softer_j = hertz_softening(given, inside, bushing, journal, slope_b, slope_j)
    nx, ny, cam_b, cam_j = soften(ex, ey, nx, ny, cam_b, cam_j, softer_b, softer_j)
    modulus, width = part_at(contacts.modulus, k), part_at(contacts.width, k)
    coefficient = where(delta > 0.0, hertz_coefficient(given, modulus, width, bushing, journal), fresh)
    cam = cam_b * turn_b + cam_j * turn_j
    if not model.usual:
        for i in range(min(WIDTH, contacts.joint.shape[0] - k)):
            d, x, y, b, j, by_b, by_j = penetration(
                contacts, surfaces, k + i, entry_of(ex, i), entry_of(ey, i), entry_of(direction, i),
                entry_of(angle_b, i), entry_of(angle_j, i),
            )  # fmt: skip
            local = coefficient_at(contacts, k + i, b, j) if d > 0.0 else entry_of(fresh, i)
            delta, nx, ny = with_entry(delta, i, d), with_entry(nx, i, x), with_entry(ny, i, y)
            coefficient, clearance = with_entry(coefficient, i, local), with_entry(clearance, i, b - j)
            cam = with_entry(cam, i, by_b * entry_of(turn_b, i) + by_j * entry_of(turn_j, i))
    return delta, nx, ny, cam, clearance, coefficient


@kernel
def _of_bodies(line, k):
    """Values of the bushings' and the journals' bodies of eight joints; in turn in a line (2 k,)."""
    first, second = part_at(line, 2 * k), part_at(line, 2 * k + WIDTH)
    return evens(first, second), odds(first, second)


# Films of oil or grease in clearance coordinates: forces and their effect on the leg (physics.md section 7).
#
# A film's force is conjugate to the eccentricity, as the contact's is. Its moments turn the bodies of bushing
# and journal, whose rates depend on all eccentricities and on the crank. The kernels of a step call the entry
# by its address, which only a leg with films has: a dry leg neither compiles nor runs it.


# rows of a sample: force of the film on the journal [N], its moments on the bushing's and the journal's
# body [N m], speeds of these bodies [rad/s]
FILM_X, FILM_Y, MOMENT_B, MOMENT_J, SPEED_B, SPEED_J = range(SAMPLE, SAMPLE + 6)
FILM_SAMPLE = SAMPLE + 6

# settings of a film: radius of the bushing, width [m], viscosity [Pa s], 0 for a dry joint, roughness [m]
RADIUS, FILM_WIDTH, VISCOSITY, ROUGHNESS = range(4)


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
                settings[k, RADIUS], settings[k, FILM_WIDTH], settings[k, VISCOSITY], settings[k, ROUGHNESS],
            )  # fmt: skip
            for i in range(d):
                x[out_a, i] += inverse_mass[b, i] * fx + inverse_mass[j, i] * fy
                x[out_a, i] += response[b, i] * moment_b + response[j, i] * moment_j
            out_sample[FILM_X, k], out_sample[FILM_Y, k] = fx, fy
            out_sample[MOMENT_B, k], out_sample[MOMENT_J, k] = moment_b, moment_j
            out_sample[SPEED_B, k], out_sample[SPEED_J, k] = speed_b, speed_j
    return settings.shape[0]


ADD_FILMS = ByAddress(add_films, types.int64)

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


# What films do beside their force: tables, drive torque, reactions, integrals (physics.md section 7).


@kernel
def load_spins(tables, points, e, v, ahead, now):
    """Rates of the films' bodies, for the eccentricities ``ahead`` [s] later.

    ``points`` (i, w): row of the table and fraction to the next. physics.md section 7.
    """
    spin, (i, w), d = tables.spin, points, e.shape[0]
    for r in range(now.spin.shape[0]):
        now.spin_turn[r] = now.turn_line[r]
        for c in range(d):
            here = (1.0 - w) * spin[i, 0, r, c] + w * spin[i + 1, 0, r, c]
            slope = (1.0 - w) * spin[i, 1, r, c] + w * spin[i + 1, 1, r, c]
            now.spin[r, c] = here
            now.spin_turn[r] += slope * (e[c] + ahead * v[c])
            now.spin_response[r, c] = 0.0
        for c in range(d):
            for a in range(d):
                now.spin_response[r, a] += now.inverse_mass[c, a] * now.spin[r, c]


@kernel
def film_torque(now, sample):
    """Drive torque [N m] that the films' moments need."""
    torque = 0.0
    for r in range(now.spin.shape[0]):
        torque -= now.spin_turn[r] * sample[MOMENT_B + r % 2, r // 2]
    return torque


@kernel
def add_film_reactions(tables, points, now, sample, out_reaction):
    """Add what the films' moments make of drive torque and reactions (r,); ``points`` as in `load_spins`."""
    table, (i, w) = tables.spin_reaction, points
    for m in range(now.spin.shape[0]):
        moment = sample[MOMENT_B + m % 2, m // 2]
        for r in range(table.shape[2]):
            out_reaction[r] += moment * ((1.0 - w) * table[i, m, r] + w * table[i + 1, m, r])


@kernel
def _power(k, sample):
    """Power [W] that the film of joint k takes from the leg."""
    power = sample[FILM_X, k] * sample[VX, k] + sample[FILM_Y, k] * sample[VY, k]
    return -power - sample[MOMENT_B, k] * sample[SPEED_B, k] - sample[MOMENT_J, k] * sample[SPEED_J, k]


@kernel
def joint_force(films, k, sample):
    """Force [N] of contact and film in clearance joint k; ``films``: settings of the leg's films."""
    if films.shape[0] > 0:
        return _total_force(k, sample)
    return math.sqrt(sample[F_N, k] ** 2 + sample[F_T, k] ** 2)


@kernel
def _total_force(k, sample):
    """As `joint_force`, with films."""
    f_n, f_t = sample[F_N, k], sample[F_T, k]
    fx = sample[FILM_X, k] - f_n * sample[NX, k] - f_t * sample[NY, k]
    fy = sample[FILM_Y, k] - f_n * sample[NY, k] + f_t * sample[NX, k]
    return math.sqrt(fx * fx + fy * fy)


@kernel
def integrate_films(settings, joint, h, start, end, out_added, out_peak):
    """Add what films change in the integrals of a step of length h [s]; out_added (ADDED, room).

    ``out_peak`` [N]: largest force of each joint of the mechanism.
    """
    for k in range(settings.shape[0]):
        if settings[k, VISCOSITY] > 0.0:
            for end_of_step in range(2):
                sample = end if end_of_step else start
                total, contact = _total_force(k, sample), sample[F_N, k] ** 2 + sample[F_T, k] ** 2
                out_added[FORCE, k] += 0.5 * h * (total - math.sqrt(contact))
                out_added[FORCE_SQUARED, k] += 0.5 * h * (total * total - contact)
                out_added[DISSIPATION, k] += 0.5 * h * _power(k, sample)
            out_peak[joint[k]] = max(out_peak[joint[k]], _total_force(k, end))

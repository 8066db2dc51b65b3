"""Contact forces and accelerations in clearance coordinates (physics.md sections 3, 4 and 7).

This is the innermost loop. The joints are the entries of vectors, and a dependence on a joint's state is a
choice of two values, not a jump.
"""

import math
from typing import NamedTuple

import numpy as np

from leg_wear_monitor.compiled.kernel import entry, kernel
from leg_wear_monitor.compiled.vectors import (
    LEAST_DIVISOR,
    WIDTH,
    any_of,
    entry_of,
    evens,
    every,
    largest,
    odds,
    only,
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
from leg_wear_monitor.contact.geometry import journal_contact
from leg_wear_monitor.contact.laws import (
    LAWS,
    NONE,
    VECTOR_LAWS,
    against,
    ambrosio_ramp,
    friction_force,
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
    F_T,
    SAMPLE,
    VX,
    VY,
    coefficient_at,
    penetration,
    soften,
    touch_walls,
)
from leg_wear_monitor.dynamics.run import JOINT_RATES
from leg_wear_monitor.mechanism.arrays import Floats, Ints
from leg_wear_monitor.wear import BUSHING, JOURNAL, profiles_at

# Laws of the clearance joints in vectors: normal and friction forces of eight joints at once.
#
# The usual laws are formulas for vectors: a dependence on a joint's state is a choice of two values, not a
# jump. Laws of other forms are computed joint by joint.


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
    """True if vectors of joints compute all laws: Hertz's form, and a friction law of `VECTOR_LAWS`."""
    is_hertz = (contacts.normal_form == _HERTZ).all()
    return bool(is_hertz and np.isin(contacts.friction_law, VECTOR_LAWS).all())


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
        Same values as in a sample; all 0 for a joint that is open or apart.
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

_NEAR = 0.1  # largest sine of an angle for the arc sine's series; its error is then 3e-11 rad


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
    """Angles [rad] of the eccentricities of eight joints, from a reference direction if it is near."""
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
    """Penetrations of eight joints from joint k on, and the values that depend on the place on worn walls.

    ``turned``: crank angle relative to the crank angle of the tables [rad]; eccentricities (ex, ey) [m].

    Returns
    -------
    delta, nx, ny, cam, clearance, coefficient
        Same values as in a sample.
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


# further rows of a sample: normal, slip speed [m/s], derivatives of the normal force by
# the penetration [N/m] and by its rate [N s/m], its elastic part [N], derivative of the penetration by the
# crank angle through the rotation of worn bodies [m/rad], the normal law's coefficient for the local radii
# (unit of the law), and the local clearance [m]
NX, NY, SLIP, STIFFNESS = range(SAMPLE, SAMPLE + 4)
DAMPING, ELASTIC, CAM, COEFFICIENT, CLEARANCE = range(SAMPLE + 4, SAMPLE + 9)
SAMPLE_ROWS = SAMPLE + 9

# Integrals of a joint in a step, in addition to the integrals of the run statistics: friction force [N s];
# moment about the crank of the normal force on rotating worn walls [N m s].
RUB, LIFT = JOINT_RATES, JOINT_RATES + 1
ADDED = JOINT_RATES + 2

# rows of the step's vectors (d,): eccentricities, rates and accelerations at its start (0), between its
# stages (M) and at its end (1); accelerations without contact; slopes of the stages; right-hand sides;
# change of the rates in the last step; coefficients of the rates in the drive torque; forces of the contacts
E0, V0, A0, EM, VM, E1, V1, A1, DRIFT, K1E, K1V, K2E, K2V, RE, RV, DV, BY_V, PUSH = range(18)
VECTORS = 18


def fresh_sample(law: Floats) -> Floats:
    """A sample (SAMPLE_ROWS, room) with the values that stay the same as long as the walls are not worn."""
    sample = np.zeros((SAMPLE_ROWS, law.shape[1]))
    sample[CLEARANCE], sample[COEFFICIENT] = law[FRESH_CLEARANCE], law[FRESH_COEFFICIENT]
    return sample


@kernel
def accelerate_clearances(model, surfaces, approach, now, turned, x, at_e, at_v, out_a, out_sample, whole):
    """Accelerations of the eccentricities [m/s^2] with all contact forces, and samples of the joints.

    ``approach`` (k,): approach speeds [m/s], 0 for open joints; ``now``: the step's tables; ``turned``: crank
    angle relative to the crank angle of the tables [rad]; x (VECTORS, room) with eccentricities [m] and rates
    [m/s] in rows at_e and at_v, the result in row out_a; out_sample (SAMPLE_ROWS, room), if not ``whole``
    only the rows that the accelerations need.
    """
    for k in range(0, out_sample.shape[1], WIDTH):
        _push_joints(model, surfaces, approach, now, turned, k, x, at_e, at_v, out_sample, whole)
    _accelerate(now.inverse_mass, now.moment, x, out_a, out_sample)


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
    if not whole:
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


@kernel
def force_in_joint(k, sample):
    """Force [N] in clearance joint k."""
    return math.sqrt(sample[F_N, k] ** 2 + sample[F_T, k] ** 2)


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

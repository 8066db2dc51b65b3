"""A trial step in clearance coordinates, and its integrals and wear when accepted (physics.md section 7)."""

import math

from leg_wear_monitor.dynamics.clearance.contact import (
    A0,
    A1,
    BY_V,
    CAM,
    CLEARANCE,
    COEFFICIENT,
    DRIFT,
    DV,
    E0,
    E1,
    ELASTIC,
    EM,
    F_T,
    K1E,
    K1V,
    K2E,
    K2V,
    LIFT,
    RE,
    RUB,
    RV,
    SLIP,
    V0,
    V1,
    VM,
    accelerate_clearances,
)
from leg_wear_monitor.dynamics.clearance.film_system import factorise_step, solve_step
from leg_wear_monitor.dynamics.clearance.joint_laws import joint_forces
from leg_wear_monitor.dynamics.joint.contact_event import DELTA, DELTA_DOT, EX, EY, F_N
from leg_wear_monitor.dynamics.joint.joint_contact import wear_joint
from leg_wear_monitor.dynamics.run.dormand_prince import hermite
from leg_wear_monitor.dynamics.run.run_statistics import (
    ARCHARD,
    CONTACT,
    DISSIPATION,
    FORCE,
    FORCE_SQUARED,
    FRICTION,
)
from leg_wear_monitor.kernel import kernel
from leg_wear_monitor.vectors import (
    WIDTH,
    any_of,
    every,
    largest,
    part_at,
    put_part,
    put_vector,
    root,
    vector_at,
    vector_max,
    vector_sum,
    where,
)


@kernel
def drift(now, x):
    """Terms that depend on the rates in row V0 of x (VECTORS, room).

    Row DRIFT: acceleration without contact, by gravity, crank, Coriolis terms and dampers [m/s^2]; row BY_V:
    coefficients of e' in the drive torque [N s].
    """
    viscous, d = now.viscous, now.bare.shape[0]
    for i in range(0, d, WIDTH):
        total, by_v = part_at(now.bare, i), part_at(now.torque_by_v, i)
        for j in range(d):
            total += x[V0, j] * part_at(now.drift, (j, i))
            by_v += x[V0, j] * part_at(now.torque_vv, (j, i))
        put_vector(x, (DRIFT, i), total)
        put_vector(x, (BY_V, i), by_v)
    for i in range(viscous.shape[0]):
        for j in range(d):
            x[DRIFT, i] += viscous[i, j] * x[V0, j]


@kernel
def try_step(model, surfaces, approach, h, turned, now, system, x, start, end):
    """Trial step of length h [s] from rows E0, V0, A0 of x to E1, V1, A1 and the sample ``end``.

    ``turned``: crank angle at the end of the step, relative to that of the tables [rad]. Returns the local
    error over the tolerance: the difference of the second-order step and the cubic through the accelerations
    at both ends, filtered like a stage so that stiff contacts do not exaggerate it (Shampine's filter).
    """
    film, d, tolerance = model.film, now.bare.shape[0], model.tolerance
    m = factorise_step(film, h, 1.0 / tolerance[1], now, start, system)
    solve_step(film, h, now, system, m, 1.0, x, V0, A0, K1E, K1V)
    for i in range(0, d, WIDTH):
        put_vector(x, (EM, i), vector_at(x, (E0, i)) + h * vector_at(x, (K1E, i)))
        put_vector(x, (VM, i), vector_at(x, (V0, i)) + h * vector_at(x, (K1V, i)))
    accelerate_clearances(model, surfaces, approach, now, turned, x, EM, VM, RV, end, False)
    for i in range(0, d, WIDTH):
        put_vector(x, (RE, i), vector_at(x, (VM, i)) - 2.0 * vector_at(x, (K1E, i)))
        put_vector(x, (RV, i), vector_at(x, (RV, i)) - 2.0 * vector_at(x, (K1V, i)))
    solve_step(film, h, now, system, m, -1.0, x, RE, RV, K2E, K2V)
    first, second = 1.5 * h, 0.5 * h
    for i in range(0, d, WIDTH):
        moved = first * vector_at(x, (K1E, i)) + second * vector_at(x, (K2E, i))
        gained = first * vector_at(x, (K1V, i)) + second * vector_at(x, (K2V, i))
        put_vector(x, (E1, i), vector_at(x, (E0, i)) + moved)
        put_vector(x, (V1, i), vector_at(x, (V0, i)) + gained)
    accelerate_clearances(model, surfaces, approach, now, turned, x, E1, V1, A1, end, True)
    third, sixth = h * h / 3.0, h * h / 6.0
    for i in range(0, d, WIDTH):
        before, after = vector_at(x, (A0, i)), vector_at(x, (A1, i))
        moved = vector_at(x, (E1, i)) - vector_at(x, (E0, i)) - h * vector_at(x, (V0, i))
        put_vector(x, (RE, i), moved - third * before - sixth * after)
        gained = vector_at(x, (V1, i)) - vector_at(x, (V0, i))
        put_vector(x, (RV, i), gained - second * (before + after))
    solve_step(film, h, now, system, m, 0.0, x, RE, RV, RE, RV)
    worst, total = every(0.0), every(0.0)
    for i in range(0, d, WIDTH):
        off = abs(vector_at(x, (RE, i))) * tolerance[0]
        rate_off = abs(vector_at(x, (RV, i))) * tolerance[1]
        total += off + rate_off
        worst = largest(worst, largest(off, rate_off))
    return vector_max(worst) if math.isfinite(vector_sum(total)) else math.inf


@kernel
def shift_start(now, x):
    """Move the end of the step to the start of the next one, with its own DRIFT and BY_V; sets row DV."""
    d = now.bare.shape[0]
    for i in range(0, d, WIDTH):
        rate = vector_at(x, (V1, i))
        put_vector(x, (DV, i), rate - vector_at(x, (V0, i)))
        put_vector(x, (E0, i), vector_at(x, (E1, i)))
        put_vector(x, (V0, i), rate)
        put_vector(x, (A0, i), vector_at(x, (A1, i)) - vector_at(x, (DRIFT, i)))
    drift(now, x)
    for i in range(0, d, WIDTH):
        put_vector(x, (A0, i), vector_at(x, (A0, i)) + vector_at(x, (DRIFT, i)))


@kernel
def integrate_joints(model, approach, h, start, end, out_added):
    """Integrals of the clearance joints over a step of length h [s]; out_added (ADDED, room).

    Simpson's rule with the contact law at the middle of the penetration's cubic, because an impact takes few
    steps, and small errors of the same sign in many steps add up.
    """
    for k in range(0, out_added.shape[1], WIDTH):
        for r in range(out_added.shape[0]):
            put_vector(out_added, (r, k), every(0.0))
        if any_of(vector_at(start, (ELASTIC, k)) + vector_at(end, (ELASTIC, k)) > 0.0):
            weight = h / 6.0
            delta, rate = hermite(
                0.5, h, vector_at(start, (DELTA, k)), vector_at(start, (DELTA_DOT, k)),
                vector_at(end, (DELTA, k)), vector_at(end, (DELTA_DOT, k)),
            )  # fmt: skip
            slip, cam = _middle(start, end, SLIP, k), _middle(start, end, CAM, k)
            f_n, _, _, elastic, f_t = joint_forces(
                model, k, _middle(start, end, COEFFICIENT, k), _middle(start, end, CLEARANCE, k),
                part_at(approach, k), delta, rate, slip,
            )  # fmt: skip
            _add_rates(k, 4.0 * weight, f_n, f_t, elastic, rate, slip, cam, out_added)
            _add_sample(k, weight, start, out_added)
            _add_sample(k, weight, end, out_added)


@kernel
def _middle(start, end, row, k):
    """Means of a row at both ends, of eight joints."""
    return 0.5 * (vector_at(start, (row, k)) + vector_at(end, (row, k)))


@kernel
def _add_sample(k, weight, sample, out_added):
    """Add the rates of the integrals of eight joints at a sample (SAMPLE_ROWS, room), times a weight [s]."""
    f_n, f_t = vector_at(sample, (F_N, k)), vector_at(sample, (F_T, k))
    elastic, rate = vector_at(sample, (ELASTIC, k)), vector_at(sample, (DELTA_DOT, k))
    slip, cam = vector_at(sample, (SLIP, k)), vector_at(sample, (CAM, k))
    _add_rates(k, weight, f_n, f_t, elastic, rate, slip, cam, out_added)


@kernel
def _add_rates(k, weight, f_n, f_t, elastic, delta_dot, slip, cam, out_added):
    """Add the rates of the integrals of eight joints at one instant, times a weight [s]."""
    squared = f_n * f_n + f_t * f_t
    _add(FORCE, k, weight, root(squared), out_added)
    _add(FORCE_SQUARED, k, weight, squared, out_added)
    _add(CONTACT, k, weight, where(f_n > 0.0, 1.0, 0.0), out_added)
    _add(FRICTION, k, -weight, f_t * slip, out_added)
    _add(ARCHARD, k, weight, f_n * abs(slip), out_added)
    _add(RUB, k, weight, f_t, out_added)
    _add(LIFT, k, weight, f_n * cam, out_added)
    _add(DISSIPATION, k, weight, (f_n - elastic) * delta_dot, out_added)


@kernel
def _add(row, k, weight, value, out_added):
    """Add a value of eight joints, times a weight."""
    put_vector(out_added, (row, k), vector_at(out_added, (row, k)) + weight * value)


@kernel
def gather_wear(added, start, end, pending):
    """Add a step's Archard integrals, and the eccentricities at which they acted, to ``pending`` (4, k)."""
    for k in range(0, added.shape[1], WIDTH):
        integral = vector_at(added, (ARCHARD, k))
        if any_of(integral > 0.0):
            after = vector_at(end, (F_N, k))
            both = vector_at(start, (F_N, k)) + after
            w = where(both > 0.0, after, 0.5) / where(both > 0.0, both, 1.0)
            ex, ey = vector_at(start, (EX, k)), vector_at(start, (EY, k))
            ex += w * (vector_at(end, (EX, k)) - ex)
            ey += w * (vector_at(end, (EY, k)) - ey)
            length = root(ex * ex + ey * ey)
            per_length = integral / where(integral > 0.0, length, 1.0)
            put_part(pending, (0, k), part_at(pending, (0, k)) + integral)
            put_part(pending, (1, k), part_at(pending, (1, k)) + per_length * ex)
            put_part(pending, (2, k), part_at(pending, (2, k)) + per_length * ey)
            put_part(pending, (3, k), part_at(pending, (3, k)) + integral * length)


@kernel
def deposit_pending(contacts, surfaces, k, start, now, turned, acted, pending, out_weight):
    """Deposit the pending wear of joint k at its mean direction and eccentricity.

    ``turned``: crank angle relative to that of the tables [rad], ``acted``: the same at the time the wear
    acted. Returns the contact energy lost with the removed material [J].
    """
    lost = 0.0
    integral = pending[0, k]
    if integral > 0.0:
        scale = pending[3, k] / integral / math.sqrt(pending[1, k] ** 2 + pending[2, k] ** 2)
        ex, ey = scale * pending[1, k], scale * pending[2, k]
        angle_b, turn_b = now.angle[k, 0], now.turn[k, 0]
        angle_j, turn_j = now.angle[k, 1], now.turn[k, 1]
        acted_at = (ex, ey, angle_b + turn_b * acted, angle_j + turn_j * acted)
        lost = wear_joint(
            contacts, surfaces, k, start[EX, k], start[EY, k],
            angle_b + turn_b * turned, angle_j + turn_j * turned, acted_at, integral, out_weight,
        )  # fmt: skip
        for i in range(pending.shape[0]):
            pending[i, k] = 0.0
    return lost


@kernel
def deposit_due(contacts, surfaces, approach, start, now, turned, pending, out_weight):
    """Deposit pending wear where the contact has ended or its normal has rotated by two sectors.

    Returns the contact energy lost with the removed material [J]; ``turned`` as in `deposit_pending`.
    """
    limit, lost = 4.0 * math.pi / surfaces.depth.shape[2], 0.0
    for k in range(pending.shape[1]):
        across = abs(pending[1, k] * start[EY, k] - pending[2, k] * start[EX, k])
        if approach[k] == 0.0 or across > limit * pending[3, k]:
            lost += deposit_pending(contacts, surfaces, k, start, now, turned, 0.0, pending, out_weight)
    return lost

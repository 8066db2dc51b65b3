"""A trial step in clearance coordinates, and its integrals and wear when accepted (physics.md section 7)."""

import math

from leg_wear_monitor.contact.friction import friction_force
from leg_wear_monitor.contact.normal.laws import normal_force
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
    FRICTION_COEFFICIENT,
    FRICTION_LAW,
    HYSTERESIS_FACTOR,
    K1E,
    K1V,
    K2E,
    K2V,
    LIFT,
    NORMAL_FORM,
    RAMP_0,
    RAMP_1,
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
from leg_wear_monitor.pairs import pair_at, put_pair


@kernel
def drift(now, x):
    """Terms that depend on the rates in row V0 of x (VECTORS, d).

    Row DRIFT: acceleration without contact, by gravity, crank, Coriolis terms and dampers [m/s^2]; row BY_V:
    coefficients of e' in the drive torque [N s].
    """
    by_v, torque, viscous, d = now.drift, now.torque_vv, now.viscous, x.shape[1]
    for i in range(d):
        x[DRIFT, i], x[BY_V, i] = now.bare[i], now.torque_by_v[i]
    for k in range(now.lever.shape[0]):
        vx, vy = x[V0, 2 * k], x[V0, 2 * k + 1]
        for i in range(d):
            x[DRIFT, i] += by_v[2 * k, i] * vx + by_v[2 * k + 1, i] * vy
        for i in range(d):
            x[BY_V, i] += torque[2 * k, i] * vx + torque[2 * k + 1, i] * vy
    for i in range(viscous.shape[0]):
        for j in range(d):
            x[DRIFT, i] += viscous[i, j] * x[V0, j]


@kernel
def try_step(model, surfaces, approach, h, turned, now, system, x, start, end):
    """Trial step of length h [s] from rows E0, V0, A0 of x to E1, V1, A1 and sample ``end`` (k, COLUMNS).

    ``turned``: crank angle at the end of the step, relative to that of the tables [rad]. Returns the local
    error over the tolerance: the difference of the second-order step and the cubic through the accelerations
    at both ends, filtered like a stage so that stiff contacts do not exaggerate it (Shampine's filter).
    """
    film, d, tolerance = model.film, x.shape[1], model.tolerance
    m = factorise_step(film, h, 1.0 / tolerance[1], now, start, system)
    solve_step(film, h, now, system, m, 1.0, x, V0, A0, K1E, K1V)
    for i in range(0, d, 2):
        put_pair(x, EM, i, pair_at(x, E0, i) + h * pair_at(x, K1E, i))
        put_pair(x, VM, i, pair_at(x, V0, i) + h * pair_at(x, K1V, i))
    accelerate_clearances(model, surfaces, approach, now, turned, x, EM, VM, RV, end)
    for i in range(0, d, 2):
        put_pair(x, RE, i, pair_at(x, VM, i) - 2.0 * pair_at(x, K1E, i))
        put_pair(x, RV, i, pair_at(x, RV, i) - 2.0 * pair_at(x, K1V, i))
    solve_step(film, h, now, system, m, -1.0, x, RE, RV, K2E, K2V)
    first, second = 1.5 * h, 0.5 * h
    for i in range(0, d, 2):
        put_pair(x, E1, i, pair_at(x, E0, i) + first * pair_at(x, K1E, i) + second * pair_at(x, K2E, i))
        put_pair(x, V1, i, pair_at(x, V0, i) + first * pair_at(x, K1V, i) + second * pair_at(x, K2V, i))
    accelerate_clearances(model, surfaces, approach, now, turned, x, E1, V1, A1, end)
    third, sixth = h * h / 3.0, h * h / 6.0
    for i in range(0, d, 2):
        before, after = pair_at(x, A0, i), pair_at(x, A1, i)
        moved = pair_at(x, E1, i) - pair_at(x, E0, i) - h * pair_at(x, V0, i)
        put_pair(x, RE, i, moved - third * before - sixth * after)
        put_pair(x, RV, i, pair_at(x, V1, i) - pair_at(x, V0, i) - second * (before + after))
    solve_step(film, h, now, system, m, 0.0, x, RE, RV, RE, RV)
    worst, total = 0.0, 0.0
    for i in range(d):
        off, rate_off = abs(x[RE, i]) * tolerance[0], abs(x[RV, i]) * tolerance[1]
        total += off + rate_off
        worst = off if off > worst else worst
        worst = rate_off if rate_off > worst else worst
    return worst if math.isfinite(total) else math.inf


@kernel
def shift_start(now, x):
    """Move the end of the step to the start of the next one, with its own DRIFT and BY_V; sets row DV."""
    for i in range(x.shape[1]):
        x[DV, i] = x[V1, i] - x[V0, i]
        x[E0, i], x[V0, i] = x[E1, i], x[V1, i]
        x[A0, i] = x[A1, i] - x[DRIFT, i]
    drift(now, x)
    for i in range(x.shape[1]):
        x[A0, i] += x[DRIFT, i]


@kernel
def integrate_joints(law, approach, h, start, end, out_added):
    """Integrals of the clearance joints over a step of length h [s]; out_added (k, ADDED).

    Simpson's rule with the contact law at the middle of the penetration's cubic, because an impact takes few
    steps, and small errors of the same sign in many steps add up.
    """
    for k in range(start.shape[0]):
        for r in range(out_added.shape[1]):
            out_added[k, r] = 0.0
        if start[k, F_N] + end[k, F_N] > 0.0:
            weight = h / 6.0
            delta, rate = hermite(
                0.5, h, start[k, DELTA], start[k, DELTA_DOT], end[k, DELTA], end[k, DELTA_DOT]
            )
            slip = 0.5 * (start[k, SLIP] + end[k, SLIP])
            coefficient = 0.5 * (start[k, COEFFICIENT] + end[k, COEFFICIENT])
            clearance = 0.5 * (start[k, CLEARANCE] + end[k, CLEARANCE])
            loss = law[k, HYSTERESIS_FACTOR] / approach[k]
            f_n, _, _, elastic = normal_force(law[k, NORMAL_FORM], coefficient, clearance, loss, delta, rate)
            mu, code = law[k, FRICTION_COEFFICIENT], law[k, FRICTION_LAW]
            f_t = friction_force(code, mu, law[k, RAMP_0], law[k, RAMP_1], f_n, slip)
            cam = 0.5 * (start[k, CAM] + end[k, CAM])
            _add_rates(k, 4.0 * weight, f_n, f_t, elastic, rate, slip, cam, out_added)
            _add_sample(k, weight, start, out_added)
            _add_sample(k, weight, end, out_added)


@kernel
def _add_sample(k, weight, sample, out_added):
    """Add the rates of joint k's integrals at a sample (k, COLUMNS), times a weight [s]."""
    f_n, f_t, elastic = sample[k, F_N], sample[k, F_T], sample[k, ELASTIC]
    rate, slip, cam = sample[k, DELTA_DOT], sample[k, SLIP], sample[k, CAM]
    _add_rates(k, weight, f_n, f_t, elastic, rate, slip, cam, out_added)


@kernel
def _add_rates(k, weight, f_n, f_t, elastic, delta_dot, slip, cam, out_added):
    """Add the rates of joint k's integrals at one instant, times a weight [s]."""
    if f_n > 0.0:
        squared = f_n * f_n + f_t * f_t
        out_added[k, FORCE] += weight * math.sqrt(squared)
        out_added[k, FORCE_SQUARED] += weight * squared
        out_added[k, CONTACT] += weight
        out_added[k, FRICTION] -= weight * f_t * slip
        out_added[k, ARCHARD] += weight * f_n * abs(slip)
        out_added[k, RUB] += weight * f_t
        out_added[k, LIFT] += weight * f_n * cam
    out_added[k, DISSIPATION] += weight * (f_n - elastic) * delta_dot


@kernel
def gather_wear(added, start, end, pending):
    """Add a step's Archard integrals, and the eccentricities at which they acted, to ``pending`` (k, 4)."""
    for k in range(pending.shape[0]):
        integral = added[k, ARCHARD]
        if integral > 0.0:
            w = end[k, F_N] / (start[k, F_N] + end[k, F_N])
            ex = start[k, EX] + w * (end[k, EX] - start[k, EX])
            ey = start[k, EY] + w * (end[k, EY] - start[k, EY])
            length = math.sqrt(ex * ex + ey * ey)
            pending[k, 0] += integral
            pending[k, 1] += integral * ex / length
            pending[k, 2] += integral * ey / length
            pending[k, 3] += integral * length


@kernel
def deposit_pending(contacts, surfaces, k, start, now, turned, acted, pending, out_weight):
    """Deposit the pending wear of joint k at its mean direction and eccentricity.

    ``turned``: crank angle relative to that of the tables [rad], ``acted``: the same at the time the wear
    acted. Returns the contact energy lost with the removed material [J].
    """
    lost = 0.0
    integral = pending[k, 0]
    if integral > 0.0:
        scale = pending[k, 3] / integral / math.hypot(pending[k, 1], pending[k, 2])
        ex, ey = scale * pending[k, 1], scale * pending[k, 2]
        angle_b, turn_b = now.angle[k, 0], now.turn[k, 0]
        angle_j, turn_j = now.angle[k, 1], now.turn[k, 1]
        acted_at = (ex, ey, angle_b + turn_b * acted, angle_j + turn_j * acted)
        lost = wear_joint(
            contacts, surfaces, k, start[k, EX], start[k, EY],
            angle_b + turn_b * turned, angle_j + turn_j * turned, acted_at, integral, out_weight,
        )  # fmt: skip
        for i in range(pending.shape[1]):
            pending[k, i] = 0.0
    return lost


@kernel
def deposit_due(contacts, surfaces, approach, start, now, turned, pending, out_weight):
    """Deposit pending wear where the contact has ended or its normal has rotated by two sectors.

    Returns the contact energy lost with the removed material [J]; ``turned`` as in `deposit_pending`.
    """
    limit, lost = 4.0 * math.pi / surfaces.depth.shape[2], 0.0
    for k in range(pending.shape[0]):
        across = abs(pending[k, 1] * start[k, EY] - pending[k, 2] * start[k, EX])
        if approach[k] == 0.0 or across > limit * pending[k, 3]:
            lost += deposit_pending(contacts, surfaces, k, start, now, turned, 0.0, pending, out_weight)
    return lost

"""A trial step in clearance coordinates, and its integrals and wear when accepted (physics.md section 7)."""

import math

from leg_wear_monitor.compiled.kernel import kernel
from leg_wear_monitor.compiled.vectors import (
    WIDTH,
    any_of,
    every,
    largest,
    part_at,
    put_vector,
    root,
    vector_at,
    vector_max,
    vector_sum,
    where,
)
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
    factorise_contacts,
    joint_forces,
    solve_contacts,
    take_directions,
)
from leg_wear_monitor.dynamics.clearance.model import (
    ACCELERATION,
    ANGLE,
    DAMPING,
    SPEED,
    STIFFNESS,
    blend,
    fetch_tables,
    hold_eccentricities,
    take_tables,
)
from leg_wear_monitor.dynamics.joint import DELTA, DELTA_DOT, EX, EY, F_N, F_T, begin_contact, wear_joint
from leg_wear_monitor.dynamics.run import (
    ARCHARD,
    CONTACT,
    DISSIPATION,
    FORCE,
    FORCE_SQUARED,
    FRICTION,
    POWER,
    TORQUE,
    hermite,
)


@kernel
def drift(now, x):
    """Terms that depend on the rates in row V0 of x (VECTORS, room).

    Row DRIFT: acceleration without contact, by gravity, crank and Coriolis terms [m/s^2]; row BY_V:
    coefficients of e' in the drive torque [N s].
    """
    d = now.bare.shape[0]
    for i in range(0, d, WIDTH):
        total, by_v = part_at(now.bare, i), part_at(now.torque_by_v, i)
        for j in range(d):
            total += x[V0, j] * part_at(now.drift, (j, i))
            by_v += x[V0, j] * part_at(now.torque_vv, (j, i))
        put_vector(x, (DRIFT, i), total)
        put_vector(x, (BY_V, i), by_v)


@kernel
def try_step(model, surfaces, approach, h, turned, now, system, x, start, end):
    """Trial step of length h [s] from rows E0, V0, A0 of x to E1, V1, A1 and the sample ``end``.

    ``turned``: crank angle at the end of the step, relative to the crank angle of the tables [rad]. Returns
    the local error over the tolerance: the difference of the second-order step and the cubic through the
    accelerations at both ends, filtered like a stage so that stiff contacts do not exaggerate it (Shampine's
    filter).
    """
    d, tolerance = now.bare.shape[0], model.tolerance
    m = factorise_contacts(h, now.inverse_mass, now.speed[0], start, system)
    solve_contacts(h, system, m, 1.0, x, V0, A0, K1E, K1V)
    for i in range(0, d, WIDTH):
        put_vector(x, (EM, i), vector_at(x, (E0, i)) + h * vector_at(x, (K1E, i)))
        put_vector(x, (VM, i), vector_at(x, (V0, i)) + h * vector_at(x, (K1V, i)))
    accelerate_clearances(model, surfaces, approach, now, turned, x, EM, VM, RV, end, False)
    for i in range(0, d, WIDTH):
        put_vector(x, (RE, i), vector_at(x, (VM, i)) - 2.0 * vector_at(x, (K1E, i)))
        put_vector(x, (RV, i), vector_at(x, (RV, i)) - 2.0 * vector_at(x, (K1V, i)))
    solve_contacts(h, system, m, -1.0, x, RE, RV, K2E, K2V)
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
    solve_contacts(h, system, m, 0.0, x, RE, RV, RE, RV)
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
def take_pending(pending, out_pending):
    """Copy pending wear (4, k) into rows with room for vectors (4, room)."""
    for r in range(pending.shape[0]):
        for k in range(pending.shape[1]):
            out_pending[r, k] = pending[r, k]


@kernel
def leave_pending(pending, out_pending):
    """Copy pending wear (4, room) back into rows (4, k)."""
    for r in range(out_pending.shape[0]):
        for k in range(out_pending.shape[1]):
            out_pending[r, k] = pending[r, k]


@kernel
def gather_wear(added, start, end, pending):
    """Add a step's Archard integrals, and where the journals were, to ``pending`` (4, room)."""
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
            _add(0, k, 1.0, integral, pending)
            _add(1, k, per_length, ex, pending)
            _add(2, k, per_length, ey, pending)
            _add(3, k, integral, length, pending)


@kernel
def deposit_pending(contacts, surfaces, k, start, now, turned, acted, pending, out_weight):
    """Deposit the pending wear of joint k at its mean direction and eccentricity.

    ``turned``: crank angle relative to the crank angle of the tables [rad], ``acted``: the same angle at the
    time the wear acted. Returns the contact energy lost with the removed material [J].
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
    for k in range(approach.shape[0]):
        across = abs(pending[1, k] * start[EY, k] - pending[2, k] * start[EX, k])
        if approach[k] == 0.0 or across > limit * pending[3, k]:
            lost += deposit_pending(contacts, surfaces, k, start, now, turned, 0.0, pending, out_weight)
    return lost


# The motion of a crank behind a coupling, a spring and a damper (physics.md section 7).
#
# The drive turns as given; the crank's angle and speed are states. In a part of an interval of length h the
# coupling's torque T is the torque in the part's middle, where the crank is at angle + h/2 speed. With the
# crank's change of speed at the end this is Störmer's and Verlet's method. The crank's acceleration a follows
# within each step,
#
#     A e'' + m a = F + Q,    m e'' + (c + h d / 2) a = T - T_rest,
#
# with m the drive torque's coefficients of e'', c the coefficients of a, and T_rest the drive torque without
# both. The term h d / 2 appears because the damper d sees the mean of the speeds. Elimination of a changes
# the inverse of A by a product of vectors, and the accelerations without contact by a second product: a light
# crank yields to impacts, as a real crank does.
#
# Neglected: the contribution of rotating worn walls (row CAM of a sample) to T_rest in e'', but not in a.


@kernel
def coupling_torque(law, drive_angle, drive_speed, angle, speed):
    """Torque [N m] of a coupling, by angles [rad] and speeds [rad/s] of drive and crank."""
    return law[STIFFNESS] * (drive_angle - angle) + law[DAMPING] * (drive_speed - speed)


@kernel
def release(coupling, angle, length, torque, work):
    """Let the crank yield in a part of a length [s] under a torque [N m]; see `_let_yield`."""
    i, w = blend(coupling.inertia.shape[0] - 1, angle)
    inertia = coupling.inertia[i] + w * (coupling.inertia[i + 1] - coupling.inertia[i])
    inertia += 0.5 * length * coupling.law[DAMPING]
    whole, steeper = _let_yield(inertia, torque, work.now, work.x, V0, BY_V, K1E, K1V)
    drift(work.now, work.x)
    return whole, steeper


@kernel
def turn_crank(law, whole, steeper, length, torque, impulse, state, statistics, work):
    """Turn the crank in a part of a length [s], and let the statistics count the coupling's torque [N m].

    ``impulse``: integral of the torque before the part. Since then, the statistics counted the torque at a
    steady crank.
    """
    integral, motor, crank, now = statistics.drive_integral, state.drive[SPEED], work.crank, work.now
    needed = integral[TORQUE] - impulse
    turned, gained = _turned(whole, steeper, length, needed, torque, now, state.e, state.v, work.x, E0, V0)
    torque -= 0.5 * law[DAMPING] * gained
    integral[TORQUE] = impulse + torque * length
    integral[POWER] += torque * motor * length - needed * now.speed[0]
    state.drive[ANGLE], state.drive[SPEED] = crank[ANGLE] + turned, crank[SPEED] + gained
    state.drive[ACCELERATION] = gained / length
    # value of the last sample, for the reactions of the ideal joints: an impact changes it as it changes e''
    now.speed[1] = (torque - work.drive_start[0] - steeper * gained) / whole


@kernel
def _let_yield(inertia, torque, now, x, v, by_v, along, by_speed):
    """Let a torque [N m] move the crank: change the step tables ``now`` of a part of a step.

    ``inertia``: of the crank with all clearance joints open [kg m^2]. Rows of x: ``v`` has the rates at the
    begin, ``by_v`` the coefficients of e' in the drive torque; ``along`` and ``by_speed`` are room.

    Returns
    -------
    whole, steeper
        Inertia of the leg with its eccentricities held [kg m^2], and derivative of the drive torque by the
        speed of the crank [N m s].
    """
    d, by = now.bare.shape[0], now.torque_a
    whole = inertia
    for i in range(d):
        x[along, i] = 0.0
        for j in range(d):
            x[along, i] += now.inverse_mass[j, i] * by[j]
        whole += by[i] * x[along, i]
    steeper = _follow_speed(whole, now, x, v, by_v, by_speed)
    rest = now.torque_0[0] - torque
    for i in range(d):
        rest += now.torque_by_e[i] * now.middle[i] + by[i] * now.bare[i]
        for j in range(d):
            rest -= x[v, i] * now.torque_vv[j, i] * x[v, j]
        rest += steeper * by[i] * x[v, i] / whole
    for i in range(d):
        by_rate = x[by_v, i] - steeper * by[i] / whole
        for j in range(d):
            by_rate += by[j] * now.drift[i, j] + now.torque_vv[i, j] * x[v, j]
        for j in range(d):
            now.drift[i, j] += by_rate * x[along, j] / inertia
            now.inverse_mass[i, j] += x[along, i] * x[along, j] / inertia
        now.bare[i] += rest * x[along, i] / inertia
        for k in range(now.moment.shape[0]):
            now.moment[k, i] -= now.lever_drive[k] * by[i] / whole
    return whole, steeper


@kernel
def _follow_speed(whole, now, x, v, by_v, by_speed):
    """Update the forces of the tables to the crank speed; returns the derivative of the drive torque [N m s].

    An impact changes the speed as it changes e', because whole w + m e' does not change. With the speed at
    the start of the part, the masses that turn with the crank would push a light crank away.
    """
    d, by, speed, held = now.bare.shape[0], now.torque_a, now.speed[0], 0.0
    steeper = 2.0 * speed * now.torque[2]
    for i in range(d):
        held += by[i] * x[v, i] / whole
        steeper += now.torque_v[i] * x[v, i] + 2.0 * speed * now.torque_e[2, i] * now.middle[i]
        total = 0.0
        for j in range(d):
            total += now.coriolis[j, i] * x[v, j] + 2.0 * speed * now.inverse_mass[j, i] * now.free[2, j]
        x[by_speed, i] = total
    for i in range(d):
        now.bare[i] += held * x[by_speed, i]
        for j in range(d):
            now.drift[i, j] -= by[i] / whole * x[by_speed, j]
    return steeper


@kernel
def _turned(whole, steeper, length, needed, torque, now, e, v, x, e1, v1):
    """Change of the crank's angle [rad] and speed [rad/s] in a part of a length [s].

    ``needed``: integral of the drive torque at a steady crank [N m s]; ``torque``: of the coupling [N m]. The
    eccentricities and rates at the end are in rows e1 and v1 of x, at the start in e and v (d,).
    """
    ahead, faster = 0.0, 0.0
    for i in range(e.shape[0]):
        ahead -= now.torque_a[i] / whole * (x[e1, i] - e[i] - length * v[i])
        faster -= now.torque_a[i] / whole * (x[v1, i] - v[i])
    gained = (torque * length - needed - steeper * ahead) / whole
    return length * now.speed[0] + ahead + 0.5 * length * (gained - faster), gained


# Start of a part of an interval: state, step tables, samples of the joints (physics.md section 7).


@kernel
def load_state(model, surfaces, state, angle, speed, acceleration, ahead, work):
    """Load the state, and the tables at a crank angle [rad] for the eccentricities ``ahead`` [s] later."""
    x, now = work.x, work.now
    take_tables(model.tables, angle, speed, acceleration, now)
    hold_eccentricities(model.tables, angle, state.e, state.v, ahead, now)
    for i in range(state.e.shape[0]):
        x[E0, i], x[V0, i] = state.e[i], state.v[i]
    fetch_tables(model.tables, angle, speed)
    if surfaces.feeds_back:
        take_directions(state.e, now.toward)
    drift(now, x)


@kernel
def sample_start(model, surfaces, state, turned, t, statistics, work):
    """Sample the joints at the start of a step at t [s]; begin contacts that rotating worn walls caused."""
    x, start, now, approach, contacts = work.x, work.start, work.now, state.approach, model.contacts
    closed = True
    while closed:
        accelerate_clearances(model, surfaces, approach, now, turned, x, E0, V0, A0, start, True)
        closed = False
        for k in range(approach.shape[0]):
            if approach[k] == 0.0 and start[DELTA, k] > 0.0 and start[DELTA_DOT, k] > 0.0:
                begin_contact(
                    k, contacts.joint, contacts.speed_floor, t, start[DELTA_DOT, k],
                    approach, state.recent, statistics.impact, statistics.impacts,
                )  # fmt: skip
                closed = True

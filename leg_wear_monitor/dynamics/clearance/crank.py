"""The motion of a crank behind a coupling, a spring and a damper (physics.md section 7).

The drive turns as given; the crank's angle and speed are states. In a part of an interval of length h the
coupling's torque T is that of its middle, where the crank is at angle + h/2 speed; with the crank's change of
speed at the end this is Störmer's and Verlet's method. The crank's acceleration a follows within each step,

    A e'' + m a = F + Q,    m e'' + (c + h d / 2) a = T - T_rest,

with m the drive torque's coefficients of e'', c those of a, T_rest the drive torque without both, and h d / 2
because the damper d sees the mean of the speeds. Elimination of a changes the inverse of A by a product of
vectors, and the accelerations without contact by another: a light crank yields to impacts, as a real one.

Neglected: what the rotation of worn walls (row CAM of a sample) adds to T_rest in e'', not in a.
"""

from leg_wear_monitor.dynamics.clearance.contact import BY_V, E0, K1E, K1V, V0
from leg_wear_monitor.dynamics.clearance.coupling import DAMPING, STIFFNESS
from leg_wear_monitor.dynamics.clearance.model import ACCELERATION, ANGLE, SPEED, blend
from leg_wear_monitor.dynamics.clearance.step import drift
from leg_wear_monitor.dynamics.run.run_statistics import POWER, TORQUE
from leg_wear_monitor.kernel import kernel


@kernel
def coupling_torque(law, drive_angle, drive_speed, angle, speed):
    """Torque [N m] of a coupling, by angles [rad] and speeds [rad/s] of drive and crank."""
    return law[STIFFNESS] * (drive_angle - angle) + law[DAMPING] * (drive_speed - speed)


@kernel
def release(coupling, angle, length, torque, work):
    """Let the crank yield in a part of a length [s] in which a torque [N m] acts; as `_let_yield`."""
    i, w = blend(coupling.inertia.shape[0] - 1, angle)
    inertia = coupling.inertia[i] + w * (coupling.inertia[i + 1] - coupling.inertia[i])
    inertia += 0.5 * length * coupling.law[DAMPING]
    whole, steeper = _let_yield(inertia, torque, work.now, work.x, V0, BY_V, K1E, K1V)
    drift(work.now, work.x)
    return whole, steeper


@kernel
def turn_crank(law, whole, steeper, length, torque, impulse, state, statistics, work):
    """Turn the crank in a part of a length [s], and let the statistics count the coupling's torque [N m].

    ``impulse``: integral of the torque before the part; since then, they counted that at a steady crank.
    """
    integral, motor, crank, now = statistics.drive_integral, state.drive[SPEED], work.crank, work.now
    needed = integral[TORQUE] - impulse
    turned, gained = _turned(whole, steeper, length, needed, torque, now, state.e, state.v, work.x, E0, V0)
    torque -= 0.5 * law[DAMPING] * gained
    integral[TORQUE] = impulse + torque * length
    integral[POWER] += torque * motor * length - needed * now.speed[0]
    state.drive[ANGLE], state.drive[SPEED] = crank[ANGLE] + turned, crank[SPEED] + gained
    state.drive[ACCELERATION] = gained / length
    # that of the last sample, for the reactions of the ideal joints: an impact changes it as it changes e''
    now.speed[1] = (torque - work.drive_start[0] - steeper * gained) / whole


@kernel
def _let_yield(inertia, torque, now, x, v, by_v, along, by_speed):
    """Let the crank yield: change the step tables ``now`` of a part in which a torque [N m] acts on it.

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
    _release_films(inertia, now, x, along)
    for j in range(min(d, now.viscous.shape[0])):
        by_rate = 0.0
        for i in range(d):
            by_rate += by[i] * now.viscous[i, j]
        for i in range(d):
            now.viscous[i, j] += by_rate * x[along, i] / inertia
    return whole, steeper


@kernel
def _follow_speed(whole, now, x, v, by_v, by_speed):
    """Let the tables' forces follow the crank's speed; returns the drive torque's derivative by it [N m s].

    An impact changes the speed as it changes e', since whole w + m e' does not: with the speed at the begin
    of the part, what turns with the crank would have pushed a light crank away.
    """
    d, by, speed, held = now.bare.shape[0], now.torque_a, now.speed[0], 0.0
    steeper = 2.0 * speed * now.torque[2] + now.torque[3]
    for i in range(d):
        held += by[i] * x[v, i] / whole
        steeper += now.torque_v[0, i] * x[v, i] + 2.0 * speed * now.torque_e[2, i] * now.middle[i]
        total = now.viscous[i, d] if now.viscous.shape[0] > 0 else 0.0
        for j in range(d):
            total += now.coriolis[j, i] * x[v, j] + 2.0 * speed * now.inverse_mass[j, i] * now.free[2, j]
        x[by_speed, i] = total
    for i in range(d):
        now.bare[i] += held * x[by_speed, i]
        for j in range(d):
            now.drift[i, j] -= by[i] / whole * x[by_speed, j]
    return steeper


@kernel
def _release_films(inertia, now, x, along):
    """As `_let_yield`, of what the films' moments accelerate."""
    for row in range(now.spin.shape[0]):
        by_moment = -now.spin_turn[row]
        for i in range(now.bare.shape[0]):
            by_moment += now.torque_a[i] * now.spin_response[row, i]
        for i in range(now.bare.shape[0]):
            now.spin_response[row, i] += by_moment * x[along, i] / inertia


@kernel
def _turned(whole, steeper, length, needed, torque, now, e, v, x, e1, v1):
    """What a part of a length [s] adds to the crank's angle [rad] and speed [rad/s].

    ``needed``: integral of the drive torque at a steady crank [N m s]; ``torque``: of the coupling [N m]. The
    eccentricities and rates at the end are in rows e1 and v1 of x, those at the begin in e and v (d,).
    """
    ahead, faster = 0.0, 0.0
    for i in range(e.shape[0]):
        ahead -= now.torque_a[i] / whole * (x[e1, i] - e[i] - length * v[i])
        faster -= now.torque_a[i] / whole * (x[v1, i] - v[i])
    gained = (torque * length - needed - steeper * ahead) / whole
    return length * now.speed[0] + ahead + 0.5 * length * (gained - faster), gained

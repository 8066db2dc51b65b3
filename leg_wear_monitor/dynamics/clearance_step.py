"""One trial step in clearance coordinates, and what is added up when it is taken."""

import math

from leg_wear_monitor.dynamics.clearance import at, blend
from leg_wear_monitor.dynamics.clearance_contact import (
    ELASTIC,
    F_T,
    SLIP,
    accelerate_clearances,
)
from leg_wear_monitor.dynamics.rosenbrock import GAMMA, factorise_contacts, solve_contacts
from leg_wear_monitor.dynamics.tally import (
    ARCHARD,
    CONTACT,
    DISSIPATION,
    FORCE,
    FORCE_SQUARED,
    FRICTION,
    POWER,
    TORQUE,
    TORQUE_SQUARED,
)
from leg_wear_monitor.dynamics.touch import DELTA_DOT, EX, EY, F_N
from leg_wear_monitor.kernel import kernel
from leg_wear_monitor.wear.surfaces import deposit_wear

# rows of the work vectors: acceleration at the step's start and end, the part of it that is not contact,
# the two stages' slopes, states between, the end of the step
A0, A1, DRIFT, K1E, K1V, K2E, K2V, E, V, E1, V1, RE, RV = range(13)


@kernel
def drift(now, v, out_drift):
    """Acceleration (d,) that is not contact: gravity, the crank's motion, Coriolis, dampers."""
    for i in range(v.shape[0]):
        total = now.free[i]
        for j in range(v.shape[0]):
            total += now.damping[i, j] * v[j]
        out_drift[i] = total


@kernel
def try_step(model, state, h, work):
    """Step of length h [s] from the state, left in E1, V1, A1 and the samples ``end``; error over tolerance.

    The error is that of the second-order step against the cubic through the accelerations at both ends,
    filtered like a stage so that stiff contacts do not exaggerate it (Shampine's habit).
    """
    x, now, contacts, system = work.vectors, work.now, model.contacts, work.system
    d = state.e.shape[0]
    m = factorise_contacts(h, now.inverse_mass, work.start, system)
    solve_contacts(h, system, m, state.v, x[A0], x[K1E], x[K1V])
    for i in range(d):
        x[E, i] = state.e[i] + h * x[K1E, i]
        x[V, i] = state.v[i] + h * x[K1V, i]
    accelerate_clearances(contacts, state.local, state.approach, x[E], x[V], now, x[DRIFT], work.end, x[RV])
    for i in range(d):
        x[RE, i] = x[V, i] - 2.0 * x[K1E, i]
        x[RV, i] -= 2.0 * x[K1V, i]
    solve_contacts(h, system, m, x[RE], x[RV], x[K2E], x[K2V])
    for i in range(d):
        x[E1, i] = state.e[i] + h * (1.5 * x[K1E, i] + 0.5 * x[K2E, i])
        x[V1, i] = state.v[i] + h * (1.5 * x[K1V, i] + 0.5 * x[K2V, i])
    accelerate_clearances(contacts, state.local, state.approach, x[E1], x[V1], now, x[DRIFT], work.end, x[A1])
    for i in range(d):
        x[RE, i] = x[E1, i] - state.e[i] - h * state.v[i] - h * h / 6.0 * (2.0 * x[A0, i] + x[A1, i])
        x[RV, i] = x[V1, i] - state.v[i] - 0.5 * h * (x[A0, i] + x[A1, i])
    solve_contacts(h, system, m, x[RE], x[RV], x[RE], x[RV])
    worst = 0.0
    for i in range(d):
        ratio = max(abs(x[RE, i]) / model.tolerance[0], abs(x[RV, i]) / model.tolerance[1])
        if not math.isfinite(ratio):
            return math.inf
        worst = max(worst, ratio)
    return worst


@kernel
def drive_torque(now, speed, acceleration, a, v, sample):
    """Torque of the drive [N m] at accelerations a and rates v (d,) of the eccentricities."""
    d, row = v.shape[0], now.torque
    torque = row[0] + acceleration * row[1] + speed * speed * row[2] + speed * row[3]
    for i in range(d):
        torque += row[4 + i] * a[i] + (speed * row[4 + d + i] + row[4 + 2 * d + i]) * v[i]
    for k in range(sample.shape[0]):
        torque += row[4 + 3 * d + k] * sample[k, F_T]
    return torque


@kernel
def add_joints(contacts, sample, weight, tally):
    """Add the rates of the loose joints' integrals at one end of a step, by half its length [s]."""
    for k in range(sample.shape[0]):
        f_n = sample[k, F_N]
        if f_n > 0.0:
            f_t, slip = sample[k, F_T], sample[k, SLIP]
            squared = f_n * f_n + f_t * f_t
            total = tally.integral[contacts.joint[k]]
            total[FORCE] += weight * math.sqrt(squared)
            total[FORCE_SQUARED] += weight * squared
            total[CONTACT] += weight
            total[FRICTION] -= weight * f_t * slip
            total[DISSIPATION] += weight * (f_n - sample[k, ELASTIC]) * sample[k, DELTA_DOT]
            total[ARCHARD] += weight * f_n * abs(slip)


@kernel
def add_drive(torque, speed, load, weight, tally):
    """Add drive torque [N m] and power at one end of a step, ``load`` being the power of loads [W]."""
    tally.drive_integral[TORQUE] += weight * torque
    tally.drive_integral[TORQUE_SQUARED] += weight * torque * torque
    tally.drive_integral[POWER] += weight * (torque * speed + load)
    tally.drive_range[0] = min(tally.drive_range[0], torque)
    tally.drive_range[1] = max(tally.drive_range[1], torque)


@kernel
def external_power_now(tables, now, speed, v):
    """Power of loads and of the springs' dampers [W]."""
    d = v.shape[0]
    power = now.load_power[d] * speed
    for i in range(d):
        power += now.load_power[i] * v[i]
    if tables.damper.shape[0] > 0:
        for i in range(d + 1):
            rate = v[i] if i < d else speed
            for j in range(d + 1):
                power -= rate * now.damper[i, j] * (v[j] if j < d else speed)
    return power


@kernel
def reaction(tables, angle, speed, acceleration, a, v, sample, out_reaction):
    """Drive torque and reactions (r,) of the ideal joints at a crank angle; rows as in the tables."""
    d = v.shape[0]
    i, w = blend(tables.reaction, angle)
    for r in range(out_reaction.shape[0]):
        before, after = tables.reaction[i, r], tables.reaction[i + 1, r]
        total = at(before, after, 0, w) + speed * at(before, after, 3, w)
        total += acceleration * at(before, after, 1, w) + speed * speed * at(before, after, 2, w)
        for l in range(d):
            by_rate = speed * at(before, after, 4 + d + l, w) + at(before, after, 4 + 2 * d + l, w)
            total += at(before, after, 4 + l, w) * a[l] + by_rate * v[l]
        for k in range(sample.shape[0]):
            total += at(before, after, 4 + 3 * d + k, w) * sample[k, F_T]
        out_reaction[r] = total


@kernel
def toe_deviation(now, speed, acceleration, e, v, a, torque, out_response):
    """Raise the largest deviations of toe and drive torque from the ideal linkage."""
    d = e.shape[0]
    px, py, vx, vy, ax, ay = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(d):
        sx, sy = now.toe[0, 1 + i], now.toe[1, 1 + i]
        tx, ty = speed * now.toe[0, 1 + d + i], speed * now.toe[1, 1 + d + i]
        px += sx * e[i]
        py += sy * e[i]
        vx += sx * v[i] + tx * e[i]
        vy += sy * v[i] + ty * e[i]
        ax += sx * a[i] + 2.0 * tx * v[i]
        ay += sy * a[i] + 2.0 * ty * v[i]
    out_response[0] = max(out_response[0], math.hypot(px, py))
    out_response[1] = max(out_response[1], math.hypot(vx, vy))
    out_response[2] = max(out_response[2], math.hypot(ax, ay))
    row = now.torque
    ideal = row[0] + acceleration * row[1] + speed * speed * row[2] + speed * row[3]
    out_response[3] = max(out_response[3], abs(torque - ideal))


@kernel
def gather_wear(h, start, end, pending):
    """Gather the Archard integral of a step, and where it acted; pending (k, 3) as in ClearanceState."""
    for k in range(pending.shape[0]):
        before = 0.5 * h * start[k, F_N] * abs(start[k, SLIP])
        after = 0.5 * h * end[k, F_N] * abs(end[k, SLIP])
        pending[k, 0] += before + after
        pending[k, 1] += before * start[k, EX] + after * end[k, EX]
        pending[k, 2] += before * start[k, EY] + after * end[k, EY]


@kernel
def wear_off(contacts, surfaces, k, angle, pending, out_weight):
    """Wear the surfaces of joint k by what is pending, around its mean eccentricity."""
    integral = pending[0]
    if integral > 0.0:
        ex, ey = pending[1] / integral, pending[2] / integral
        deposit_wear(contacts, surfaces, k, ex, ey, angle[0], angle[1], integral, out_weight)
        pending[:] = 0.0

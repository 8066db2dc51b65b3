"""One trial step in clearance coordinates, and what is added up when it is taken."""

import math

from leg_wear_monitor.dynamics.clearance import blend
from leg_wear_monitor.dynamics.clearance_contact import (
    A0,
    A1,
    DRIFT,
    E0,
    E1,
    ELASTIC,
    EM,
    F_T,
    K1E,
    K1V,
    K2E,
    K2V,
    RE,
    RV,
    SLIP,
    V0,
    V1,
    VM,
    accelerate_clearances,
)
from leg_wear_monitor.dynamics.rosenbrock import factorise_contacts, solve_contacts
from leg_wear_monitor.dynamics.tally import ARCHARD, CONTACT, DISSIPATION, FORCE, FORCE_SQUARED, FRICTION
from leg_wear_monitor.dynamics.touch import DELTA_DOT, EX, EY, F_N
from leg_wear_monitor.kernel import kernel
from leg_wear_monitor.wear.surfaces import deposit_wear


@kernel
def drift(now, x, at_v):
    """Acceleration that is not contact: gravity, the crank's motion, Coriolis, dampers; fills the row DRIFT."""
    coriolis, viscous, speed, d = now.coriolis, now.viscous, now.speed[0], x.shape[1]
    for i in range(d):
        total = 0.0
        for j in range(d):
            total += coriolis[i, j] * x[at_v, j]
        x[DRIFT, i] = now.bare[i] + speed * total
    for i in range(viscous.shape[0]):
        for j in range(d):
            x[DRIFT, i] += viscous[i, j] * x[at_v, j]


@kernel
def try_step(law, tolerance, local, approach, h, now, system, x, start, end):
    """Step of length h [s] from rows E0, V0, A0 of x to E1, V1, A1 and sample ``end``; error over tolerance.

    The error is that of the second-order step against the cubic through the accelerations at both ends,
    filtered like a stage so that stiff contacts do not exaggerate it (as Shampine does).
    """
    d = x.shape[1]
    m = factorise_contacts(h, now.inverse_mass, start, system)
    solve_contacts(h, system, m, x, V0, A0, K1E, K1V)
    for i in range(d):
        x[EM, i] = x[E0, i] + h * x[K1E, i]
        x[VM, i] = x[V0, i] + h * x[K1V, i]
    accelerate_clearances(law, local, approach, now, x, EM, VM, RV, end)
    for i in range(d):
        x[RE, i] = x[VM, i] - 2.0 * x[K1E, i]
        x[RV, i] -= 2.0 * x[K1V, i]
    solve_contacts(h, system, m, x, RE, RV, K2E, K2V)
    for i in range(d):
        x[E1, i] = x[E0, i] + h * (1.5 * x[K1E, i] + 0.5 * x[K2E, i])
        x[V1, i] = x[V0, i] + h * (1.5 * x[K1V, i] + 0.5 * x[K2V, i])
    accelerate_clearances(law, local, approach, now, x, E1, V1, A1, end)
    for i in range(d):
        x[RE, i] = x[E1, i] - x[E0, i] - h * x[V0, i] - h * h / 6.0 * (2.0 * x[A0, i] + x[A1, i])
        x[RV, i] = x[V1, i] - x[V0, i] - 0.5 * h * (x[A0, i] + x[A1, i])
    solve_contacts(h, system, m, x, RE, RV, RE, RV)
    worst = 0.0
    for i in range(d):
        ratio = max(abs(x[RE, i]) * tolerance[0], abs(x[RV, i]) * tolerance[1])
        if not math.isfinite(ratio):
            return math.inf
        worst = max(worst, ratio)
    return worst


@kernel
def shift_start(now, x):
    """Make the end of the step the start of the next one; its acceleration gets the drift of its own rates."""
    for i in range(x.shape[1]):
        x[E0, i], x[V0, i] = x[E1, i], x[V1, i]
        x[A0, i] = x[A1, i] - x[DRIFT, i]
    drift(now, x, V0)
    for i in range(x.shape[1]):
        x[A0, i] += x[DRIFT, i]


@kernel
def drive_torque(now, x, sample):
    """Torque of the drive [N m] at rows A0 and V0, and its value in the ideal linkage."""
    row, speed, d = now.torque, now.speed[0], x.shape[1]
    ideal = row[0] + now.speed[1] * row[1] + speed * speed * row[2] + speed * row[3]
    torque = ideal
    for i in range(d):
        torque += row[4 + i] * x[A0, i] + (speed * row[4 + d + i] + row[4 + 2 * d + i]) * x[V0, i]
    for k in range(sample.shape[0]):
        torque += row[4 + 3 * d + k] * sample[k, F_T]
    return torque, ideal


@kernel
def reactions(tables, angle, now, x, sample, out_reaction):
    """Drive torque and reactions (r,) of the ideal joints at a crank angle; rows as in the tables."""
    table, speed, d = tables.reaction, now.speed[0], x.shape[1]
    i, w = blend(table.shape[0] - 1, angle)
    for r in range(out_reaction.shape[0]):
        out_reaction[r] = 0.0
        for side in range(2):
            j, share = i + side, w if side else 1.0 - w
            total = table[j, r, 0] + now.speed[1] * table[j, r, 1] + speed * (speed * table[j, r, 2] + table[j, r, 3])
            for c in range(d):
                total += table[j, r, 4 + c] * x[A0, c]
                total += (speed * table[j, r, 4 + d + c] + table[j, r, 4 + 2 * d + c]) * x[V0, c]
            for k in range(sample.shape[0]):
                total += table[j, r, 4 + 3 * d + k] * sample[k, F_T]
            out_reaction[r] += share * total


@kernel
def outside_power(now, x):
    """Power of loads and of the springs' dampers [W] at row V0."""
    d, speed, damper = x.shape[1], now.speed[0], now.damper
    power = now.load_power[d] * speed
    for i in range(d):
        power += now.load_power[i] * x[V0, i]
    for i in range(damper.shape[0]):
        rate = x[V0, i] if i < d else speed
        for j in range(d + 1):
            power -= rate * damper[i, j] * (x[V0, j] if j < d else speed)
    return power


@kernel
def stored_energy_now(tables, angle, speed, x):
    """Kinetic energy, and that of gravity and springs [J], at rows E0 and V0."""
    d, energy = x.shape[1], 0.0
    i, w = blend(tables.energy.shape[0] - 1, angle)
    for side in range(2):
        j, share = i + side, w if side else 1.0 - w
        form = tables.energy[j]
        energy += share * (form[d, d] * speed * speed + form[d + 1, d + 1])
        for a in range(d):
            energy += share * (2.0 * form[a, d] * speed * x[V0, a] - tables.push[j, a] * x[E0, a])
            for b in range(d):
                energy += share * form[a, b] * x[V0, a] * x[V0, b]
    return energy


@kernel
def add_joints(joint, sample, weight, integral):
    """Add the rates of the loose joints' integrals at one end of a step, by half its length [s]."""
    for k in range(sample.shape[0]):
        f_n = sample[k, F_N]
        if f_n > 0.0:
            f_t, slip, j = sample[k, F_T], sample[k, SLIP], joint[k]
            squared = f_n * f_n + f_t * f_t
            integral[j, FORCE] += weight * math.sqrt(squared)
            integral[j, FORCE_SQUARED] += weight * squared
            integral[j, CONTACT] += weight
            integral[j, FRICTION] -= weight * f_t * slip
            integral[j, DISSIPATION] += weight * (f_n - sample[k, ELASTIC]) * sample[k, DELTA_DOT]
            integral[j, ARCHARD] += weight * f_n * abs(slip)


@kernel
def toe_deviation(now, x, out_response):
    """Raise the largest deviations (position, velocity, acceleration) of the toe from the ideal linkage."""
    d, speed, toe = x.shape[1], now.speed[0], now.toe
    px, py, vx, vy, ax, ay = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(d):
        sx, sy = toe[0, 1 + i], toe[1, 1 + i]
        tx, ty = speed * toe[0, 1 + d + i], speed * toe[1, 1 + d + i]
        px += sx * x[E0, i]
        py += sy * x[E0, i]
        vx += sx * x[V0, i] + tx * x[E0, i]
        vy += sy * x[V0, i] + ty * x[E0, i]
        ax += sx * x[A0, i] + 2.0 * tx * x[V0, i]
        ay += sy * x[A0, i] + 2.0 * ty * x[V0, i]
    out_response[0] = max(out_response[0], math.hypot(px, py))
    out_response[1] = max(out_response[1], math.hypot(vx, vy))
    out_response[2] = max(out_response[2], math.hypot(ax, ay))


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
    integral = pending[k, 0]
    if integral > 0.0:
        ex, ey = pending[k, 1] / integral, pending[k, 2] / integral
        deposit_wear(contacts, surfaces, k, ex, ey, angle[k, 0], angle[k, 1], integral, out_weight)
        pending[k, 0], pending[k, 1], pending[k, 2] = 0.0, 0.0, 0.0

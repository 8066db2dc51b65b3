"""Drive torque, reactions of ideal joints and toe motion from the eccentricities (physics.md section 7)."""

import math

from leg_wear_monitor.dynamics.clearance.contact import A0, BY_V, CAM, DV, E0, F_T, LIFT, RUB, V0
from leg_wear_monitor.dynamics.clearance.film_effects import add_film_reactions, film_torque
from leg_wear_monitor.dynamics.clearance.model import blend
from leg_wear_monitor.dynamics.joint.contact_event import F_N
from leg_wear_monitor.kernel import kernel


@kernel
def drive_torque(now, x, sample):
    """Drive torque [N m] from rows E0, V0, A0 and BY_V of x, and its smooth part [N m].

    The smooth part lacks the terms of e'' and of the contact forces, which impacts change suddenly.
    """
    sudden, smooth = 0.0, now.torque_0[0]
    for i in range(x.shape[1]):
        smooth += x[BY_V, i] * x[V0, i] + now.torque_by_e[i] * x[E0, i]
        sudden += now.torque_a[i] * x[A0, i]
    for k in range(sample.shape[0]):
        sudden += sample[k, F_N] * sample[k, CAM] - now.lever_drive[k] * sample[k, F_T]
    if now.spin.shape[0] > 0:
        smooth += film_torque(now, sample)
    return smooth + sudden, smooth


@kernel
def sudden_impulse(now, x, added):
    """Integral over a step [N m s] of the drive torque without its smooth part.

    The term of e'' follows from the change of the rates, row DV, which is exact for the torque peaks of
    impacts; those of the contact forces from their integrals in ``added``, which have the rule of the losses.
    """
    total = 0.0
    for i in range(x.shape[1]):
        total += now.torque_a[i] * x[DV, i]
    for k in range(added.shape[0]):
        total += added[k, LIFT] - now.lever_drive[k] * added[k, RUB]
    return total


@kernel
def reactions(tables, angle, now, x, sample, out_by, out_reaction):
    """Drive torque [N m] and reactions of the ideal joints [N] (r,) at a crank angle, in the tables' order.

    ``out_by`` (4 + 3 d + k,) contains the factors of the table's columns.
    """
    table, speed, d = tables.reaction, now.speed[0], x.shape[1]
    out_by[0], out_by[1], out_by[2], out_by[3] = 1.0, now.speed[1], speed * speed, speed
    for i in range(d):
        out_by[4 + i], out_by[4 + d + i], out_by[4 + 2 * d + i] = x[A0, i], speed * x[V0, i], x[V0, i]
    for k in range(sample.shape[0]):
        out_by[4 + 3 * d + k] = sample[k, F_T]
    i, w = blend(table.shape[0] - 1, angle)
    for r in range(out_reaction.shape[0]):
        out_reaction[r] = 0.0
    for c in range(out_by.shape[0]):
        before, after = (1.0 - w) * out_by[c], w * out_by[c]
        for r in range(out_reaction.shape[0]):
            out_reaction[r] += before * table[i, c, r] + after * table[i + 1, c, r]
    if now.spin.shape[0] > 0:
        points = blend(tables.spin_reaction.shape[0] - 1, angle)
        add_film_reactions(tables, points, now, sample, out_reaction)


@kernel
def outside_power(now, x):
    """Power of loads and of the springs' dampers [W] for the rates in row V0."""
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
def toe_deviation(now, x, out_response):
    """Update the toe's largest deviations from the ideal linkage: position, velocity, acceleration."""
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
    out_response[0] = max(out_response[0], math.sqrt(px * px + py * py))
    out_response[1] = max(out_response[1], math.sqrt(vx * vx + vy * vy))
    out_response[2] = max(out_response[2], math.sqrt(ax * ax + ay * ay))

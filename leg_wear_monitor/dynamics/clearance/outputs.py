"""Drive torque, reactions of ideal joints and toe motion from the eccentricities (physics.md section 7)."""

import math

from leg_wear_monitor.dynamics.clearance.contact import A0, BY_V, CAM, DV, E0, F_T, LIFT, RUB, V0
from leg_wear_monitor.dynamics.clearance.film_effects import add_film_reactions, film_torque
from leg_wear_monitor.dynamics.clearance.model import blend
from leg_wear_monitor.dynamics.joint.contact_event import F_N
from leg_wear_monitor.kernel import kernel
from leg_wear_monitor.vectors import WIDTH, every, part_at, put_part, vector_at, vector_sum


@kernel
def drive_torque(now, x, sample):
    """Drive torque [N m] from rows E0, V0, A0 and BY_V of x, and its smooth part [N m].

    The smooth part lacks the terms of e'' and of the contact forces, which impacts change suddenly.
    """
    steady, abrupt = every(0.0), every(0.0)
    for i in range(0, now.torque_a.shape[0], WIDTH):
        steady += vector_at(x, (BY_V, i)) * vector_at(x, (V0, i))
        steady += part_at(now.torque_by_e, i) * vector_at(x, (E0, i))
        abrupt += part_at(now.torque_a, i) * vector_at(x, (A0, i))
    for k in range(0, sample.shape[1], WIDTH):
        abrupt += vector_at(sample, (F_N, k)) * vector_at(sample, (CAM, k))
        abrupt -= part_at(now.lever_drive, k) * vector_at(sample, (F_T, k))
    smooth = now.torque_0[0] + vector_sum(steady)
    if now.spin.shape[0] > 0:
        smooth += film_torque(now, sample)
    return smooth + vector_sum(abrupt), smooth


@kernel
def sudden_impulse(now, x, added):
    """Integral over a step [N m s] of the drive torque without its smooth part.

    The term of e'' follows from the change of the rates, row DV, which is exact for the torque peaks of
    impacts; those of the contact forces from their integrals in ``added``, which have the rule of the losses.
    """
    total = every(0.0)
    for i in range(0, now.torque_a.shape[0], WIDTH):
        total += part_at(now.torque_a, i) * vector_at(x, (DV, i))
    for k in range(0, added.shape[1], WIDTH):
        total += vector_at(added, (LIFT, k)) - part_at(now.lever_drive, k) * vector_at(added, (RUB, k))
    return vector_sum(total)


@kernel
def reactions(tables, angle, now, x, sample, out_by, out_reaction):
    """Drive torque [N m] and reactions of the ideal joints [N] (r,) at a crank angle, in the tables' order.

    ``out_by`` (4 + 3 d + k,) contains the factors of the table's columns.
    """
    table, speed, d = tables.reaction, now.speed[0], now.torque_a.shape[0]
    out_by[0], out_by[1], out_by[2], out_by[3] = 1.0, now.speed[1], speed * speed, speed
    for i in range(d):
        out_by[4 + i], out_by[4 + d + i], out_by[4 + 2 * d + i] = x[A0, i], speed * x[V0, i], x[V0, i]
    for k in range(now.lever_drive.shape[0]):
        out_by[4 + 3 * d + k] = sample[F_T, k]
    i, w = blend(table.shape[0] - 1, angle)
    for r in range(0, out_reaction.shape[0], WIDTH):
        before, after = every(0.0), every(0.0)
        for c in range(out_by.shape[0]):
            before += out_by[c] * part_at(table, (i, c, r))
            after += out_by[c] * part_at(table, (i + 1, c, r))
        put_part(out_reaction, r, (1.0 - w) * before + w * after)
    if now.spin.shape[0] > 0:
        points = blend(tables.spin_reaction.shape[0] - 1, angle)
        add_film_reactions(tables, points, now, sample, out_reaction)


@kernel
def outside_power(now, x):
    """Power of loads and of the springs' dampers [W] for the rates in row V0."""
    d, speed, damper = now.torque_a.shape[0], now.speed[0], now.damper
    total = every(0.0)
    for i in range(0, d, WIDTH):
        total += part_at(now.load_power, i) * vector_at(x, (V0, i))
    power = now.load_power[d] * speed + vector_sum(total)
    for i in range(damper.shape[0]):
        rate = x[V0, i] if i < d else speed
        for j in range(d + 1):
            power -= rate * damper[i, j] * (x[V0, j] if j < d else speed)
    return power


@kernel
def toe_deviation(now, x, out_response):
    """Update the toe's largest deviations from the ideal linkage: position, velocity, acceleration."""
    along = _along_toe(0, now, x), _along_toe(1, now, x)
    for i in range(3):
        out_response[i] = max(out_response[i], math.sqrt(along[0][i] ** 2 + along[1][i] ** 2))


@kernel
def _along_toe(row, now, x):
    """Deviation of the toe along x (row 0) or y (1): position, velocity, acceleration."""
    d, toe, double = now.torque_a.shape[0], now.toe, 2.0 * now.speed[0]
    position, velocity, acceleration = every(0.0), every(0.0), every(0.0)
    for i in range(0, d, WIDTH):
        e, v, a = vector_at(x, (E0, i)), vector_at(x, (V0, i)), vector_at(x, (A0, i))
        by, turning = part_at(toe, (row, 1 + i)), double * part_at(toe, (row, 1 + d + i))
        position += by * e
        velocity += by * v + 0.5 * turning * e
        acceleration += by * a + turning * v
    return vector_sum(position), vector_sum(velocity), vector_sum(acceleration)

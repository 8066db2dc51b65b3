"""What follows from the eccentricities' motion: drive torque, reactions of ideal joints, the toe."""

import math

from leg_wear_monitor.dynamics.clearance import blend
from leg_wear_monitor.dynamics.clearance_contact import A0, CAM_TORQUE, DV, E0, F_T, TA, TV, V0
from leg_wear_monitor.kernel import kernel


@kernel
def drive_torque(now, x, sample):
    """Torque of the drive [N m] at rows E0, V0 and A0; the part by e'' alone; its value in the ideal linkage.

    Leaves the torque by each of e'' in row TA.
    """
    speed, acceleration, d = now.speed[0], now.speed[1], x.shape[1]
    by, by_e, ae, vv, ve = now.torque, now.torque_e, now.torque_ae, now.torque_vv, now.torque_ve
    ideal = by[0] + acceleration * by[1] + speed * (speed * by[2] + by[3])
    for i in range(d):
        x[TA, i] = now.torque_a[i]
        x[TV, i] = speed * now.torque_v[0, i] + now.torque_v[1, i]
    for j in range(d):
        for i in range(d):
            x[TA, i] += ae[j, i] * x[E0, j]
            x[TV, i] += vv[j, i] * x[V0, j] + ve[j, i] * (speed * x[E0, j])
    sudden, torque = 0.0, ideal
    for i in range(d):
        sudden += x[TA, i] * x[A0, i]
        torque += x[TV, i] * x[V0, i]
        torque += (by_e[0, i] + acceleration * by_e[1, i] + speed * speed * by_e[2, i]) * x[E0, i]
    for k in range(sample.shape[0]):
        torque += now.torque_t[k] * sample[k, F_T] + sample[k, CAM_TORQUE]
    return torque + sudden, sudden, ideal


@kernel
def half_impulse(x):
    """Half the integral over a step [N m s] of the drive torque's part by e'', by row TA at one end.

    By the change of the rates, row DV: exact where impacts make the torque spiky.
    """
    total = 0.0
    for i in range(x.shape[1]):
        total += 0.5 * x[TA, i] * x[DV, i]
    return total


@kernel
def reactions(tables, angle, now, x, sample, out_reaction):
    """Drive torque and reactions (r,) of the ideal joints at a crank angle; rows as in the tables."""
    table, speed, d = tables.reaction, now.speed[0], x.shape[1]
    i, w = blend(table.shape[0] - 1, angle)
    for r in range(out_reaction.shape[0]):
        out_reaction[r] = 0.0
        for side in range(2):
            j, share = i + side, w if side else 1.0 - w
            total = (
                table[j, r, 0]
                + now.speed[1] * table[j, r, 1]
                + speed * (speed * table[j, r, 2] + table[j, r, 3])
            )
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

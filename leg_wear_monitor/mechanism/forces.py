"""Generalised forces Q of gravity, springs, loads and drive, and energy (physics.md section 2)."""

import math

from leg_wear_monitor.kernel import entry, kernel
from leg_wear_monitor.mechanism.constraints import arm, rotations


@kernel
def add_force(body, sx, sy, fx, fy, out_force):
    """Add a force (fx, fy) [N] on a body at (sx, sy) [m] from its centre of mass to out_force (n, 3)."""
    out_force[body, 0] += fx
    out_force[body, 1] += fy
    out_force[body, 2] += sx * fy - sy * fx


@kernel
def applied_forces(arrays, q, v, cs, out_force):
    """Generalised forces (n, 3) [N, N, N m] of gravity, springs and loads, at q and v (n, 3)."""
    for i in range(q.shape[0]):
        out_force[i, 0] = arrays.mass[i, 0] * arrays.gravity[0]
        out_force[i, 1] = arrays.mass[i, 1] * arrays.gravity[1]
        out_force[i, 2] = 0.0
    for k in range(arrays.spring_body.shape[0]):
        _add_spring(arrays, k, q, v, cs, out_force)
    for k in range(arrays.load_body.shape[0]):
        body = arrays.load_body[k]
        fx, fy = load_force(arrays, k, q[arrays.drive_body, 2])
        sx, sy = arm(cs, body, arrays.load_point[k])
        add_force(body, sx, sy, fx, fy, out_force)


@kernel
def load_force(arrays, k, crank_angle):
    """Force (2,) [N] of load k at a crank angle [rad], linear between the entries of its table."""
    i, w = _place(arrays.load_phase[k], crank_angle)
    before, after = arrays.load_force[k, i - 1], arrays.load_force[k, i]
    return before[0] + w * (after[0] - before[0]), before[1] + w * (after[1] - before[1])


@kernel
def _place(table, crank_angle):
    """Index of a table's first phase not before a crank angle [rad], and the fraction of the way to it."""
    phase = crank_angle / (2.0 * math.pi)
    phase -= math.floor(phase)
    i = 1
    while i < table.shape[0] - 1 and table[i] < phase:
        i += 1
    width = table[i] - table[i - 1]
    return i, (phase - table[i - 1]) / width if width > 0.0 else 0.0


@kernel
def controller_torque(arrays, wanted, angle, speed):
    """Torque [N m] of a controller or a constant-torque drive: feed-forward and gains on the errors, limited.

    ``wanted`` contains the angle [rad] and speed [rad/s] to follow; ``angle`` and ``speed`` are the crank's.
    """
    i, w = _place(arrays.drive_phase, wanted[0])
    before, after = arrays.drive_feed[i - 1], arrays.drive_feed[i]
    by_angle, by_speed, most = arrays.drive_gains
    torque = before + w * (after - before) + by_angle * (wanted[0] - angle) + by_speed * (wanted[1] - speed)
    return min(max(torque, -most), most)


@kernel
def _spring_line(arrays, k, q, cs):
    """Bodies, lever arms [m] and the vector [m] from the first to the second point of spring k."""
    a, b = arrays.spring_body[k, 0], arrays.spring_body[k, 1]
    sax, say = arm(cs, a, arrays.spring_point[k, 0])
    sbx, sby = arm(cs, b, arrays.spring_point[k, 1])
    return a, b, sax, say, sbx, sby, q[b, 0] + sbx - q[a, 0] - sax, q[b, 1] + sby - q[a, 1] - say


@kernel
def _add_spring(arrays, k, q, v, cs, out_force):
    """Add the force of spring and damper k on both bodies to out_force (n, 3)."""
    a, b, sax, say, sbx, sby, dx, dy = _spring_line(arrays, k, q, cs)
    length = math.hypot(dx, dy)
    if length == 0.0:
        return
    dvx = v[b, 0] - v[b, 2] * sby - v[a, 0] + v[a, 2] * say
    dvy = v[b, 1] + v[b, 2] * sbx - v[a, 1] - v[a, 2] * sax
    stiffness, free_length, damping = arrays.spring_law[k]
    pull = stiffness * (length - free_length) + damping * (dvx * dx + dvy * dy) / length
    fx, fy = pull * dx / length, pull * dy / length
    add_force(a, sax, say, fx, fy, out_force)
    add_force(b, sbx, sby, -fx, -fy, out_force)


@kernel
def stored_energy(arrays, q, v, cs):
    """Kinetic energy plus the potential energy of gravity and springs [J]."""
    energy = 0.0
    for i in range(q.shape[0]):
        for d in range(3):
            energy += 0.5 * arrays.mass[i, d] * v[i, d] * v[i, d]
        energy -= arrays.mass[i, 0] * (arrays.gravity[0] * q[i, 0] + arrays.gravity[1] * q[i, 1])
    for k in range(arrays.spring_body.shape[0]):
        dx, dy = _spring_line(arrays, k, q, cs)[6:]
        stiffness, free_length, _ = arrays.spring_law[k]
        energy += 0.5 * stiffness * (math.hypot(dx, dy) - free_length) ** 2
    return energy


@kernel
def external_power(arrays, q, v, cs):
    """Power of loads and of spring dampers [W]."""
    power = 0.0
    for k in range(arrays.load_body.shape[0]):
        body = arrays.load_body[k]
        fx, fy = load_force(arrays, k, q[arrays.drive_body, 2])
        sx, sy = arm(cs, body, arrays.load_point[k])
        power += fx * (v[body, 0] - v[body, 2] * sy) + fy * (v[body, 1] + v[body, 2] * sx)
    for k in range(arrays.spring_body.shape[0]):
        a, b, sax, say, sbx, sby, dx, dy = _spring_line(arrays, k, q, cs)
        length = math.hypot(dx, dy)
        if length > 0.0:
            rate = (v[b, 0] - v[b, 2] * sby - v[a, 0] + v[a, 2] * say) * dx
            rate += (v[b, 1] + v[b, 2] * sbx - v[a, 1] - v[a, 2] * sax) * dy
            power -= arrays.spring_law[k, 2] * (rate / length) ** 2
    return power


@entry
def applied_forces_at(arrays, q, v, cs, out_force):
    """`applied_forces` (p, n, 3) at p positions and velocities (p, n, 3); cs (n, 2) is a work array."""
    for p in range(q.shape[0]):
        rotations(q[p], cs)
        applied_forces(arrays, q[p], v[p], cs, out_force[p])


@entry
def stored_energy_at(arrays, q, v, cs, out_energy):
    """`stored_energy` (p,) at p positions and velocities (p, n, 3); cs (n, 2) is a work array."""
    for p in range(q.shape[0]):
        rotations(q[p], cs)
        out_energy[p] = stored_energy(arrays, q[p], v[p], cs)

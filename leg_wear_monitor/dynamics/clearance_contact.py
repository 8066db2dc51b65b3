"""Contact forces in the loose joints, and the acceleration they make, in clearance coordinates."""

import math

from leg_wear_monitor.contact.friction import friction_force
from leg_wear_monitor.contact.normal import elastic_force, normal_force
from leg_wear_monitor.dynamics.joint_contact import stiffness_at
from leg_wear_monitor.dynamics.touch import DELTA, DELTA_DOT, EX, EY, F_N, SAMPLE, VX, VY
from leg_wear_monitor.kernel import kernel
from leg_wear_monitor.wear.surfaces import local_radii

# a sample of a loose joint goes on with: unit normal, friction force [N], slip speed [m/s], derivatives of
# the normal force by penetration [N/m] and by its rate [N s/m], and its elastic part [N]
NX, NY, F_T, SLIP, STIFFNESS, DAMPING, ELASTIC = SAMPLE, SAMPLE + 1, 8 + 1, 10, 11, 12, 13
COLUMNS = 14

# the clearance around a direction: its value [m] and derivative by the angle [m] there, the direction, and
# the contact stiffness [N/m^1.5]
CLEARANCE, SLOPE, TO_X, TO_Y, LOCAL_STIFFNESS = 0, 1, 2, 3, 4
LOCAL = 5

_TURNED = 0.02  # rad from that direction at which it is looked up again


@kernel
def look_around(contacts, surfaces, k, nx, ny, angle_b, angle_j, out_local):
    """Clearance of joint k around the direction (nx, ny); row (LOCAL,)."""
    direction = math.atan2(ny, nx)
    half = math.pi / surfaces.depth.shape[2]
    bushing, journal = local_radii(contacts, surfaces, k, direction, angle_b, angle_j)
    out_local[CLEARANCE], out_local[SLOPE] = bushing - journal, 0.0
    if surfaces.feeds_back:
        ahead, inside = local_radii(contacts, surfaces, k, direction + half, angle_b, angle_j)
        behind, within = local_radii(contacts, surfaces, k, direction - half, angle_b, angle_j)
        out_local[SLOPE] = ((ahead - inside) - (behind - within)) / (2.0 * half)
    out_local[TO_X], out_local[TO_Y] = nx, ny
    out_local[LOCAL_STIFFNESS] = stiffness_at(contacts, k, bushing, journal)


@kernel
def follow_clearance(contacts, surfaces, sample, angle, local):
    """Look up the clearance of the joints whose normal has turned away from where it was known."""
    if surfaces.feeds_back:
        for k in range(sample.shape[0]):
            nx, ny = sample[k, NX], sample[k, NY]
            along = local[k, TO_X] * nx + local[k, TO_Y] * ny
            if not (abs(local[k, TO_X] * ny - local[k, TO_Y] * nx) < _TURNED and along > 0.0):
                look_around(contacts, surfaces, k, nx, ny, angle[k, 0], angle[k, 1], local[k])


@kernel
def sample_joint(contacts, local, k, e, v, lever, lever_drive, approach, out_sample):
    """Sample loose joint k at eccentricities e and rates v (d,); row (COLUMNS,)."""
    ex, ey, vx, vy = e[2 * k], e[2 * k + 1], v[2 * k], v[2 * k + 1]
    length = math.sqrt(ex * ex + ey * ey)
    nx, ny = (ex / length, ey / length) if length > 0.0 else (1.0, 0.0)
    delta = length - local[CLEARANCE] - local[SLOPE] * (local[TO_X] * ny - local[TO_Y] * nx)
    delta_dot = nx * vx + ny * vy
    f_n, f_t, slip, elastic, stiffness, damping = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if delta > 0.0 and approach > 0.0:
        f_n = normal_force(local[LOCAL_STIFFNESS], contacts.hysteresis[k], delta, delta_dot, approach)
    if f_n > 0.0:
        elastic = elastic_force(local[LOCAL_STIFFNESS], delta)
        stiffness = 1.5 * f_n / delta
        damping = elastic * contacts.hysteresis[k] / approach
        slip = nx * vy - ny * vx + lever_drive
        for i in range(v.shape[0]):
            slip += lever[i] * v[i]
        mu, v0, v1 = contacts.friction[k, 0], contacts.friction[k, 1], contacts.friction[k, 2]
        f_t = friction_force(contacts.friction_law[k], mu, v0, v1, f_n, slip)
    out_sample[EX], out_sample[EY], out_sample[VX], out_sample[VY] = ex, ey, vx, vy
    out_sample[F_N], out_sample[DELTA], out_sample[DELTA_DOT] = f_n, delta, delta_dot
    out_sample[NX], out_sample[NY], out_sample[F_T], out_sample[SLIP] = nx, ny, f_t, slip
    out_sample[STIFFNESS], out_sample[DAMPING], out_sample[ELASTIC] = stiffness, damping, elastic


@kernel
def accelerate_clearances(contacts, local, approach, e, v, now, drift, out_sample, out_a):
    """Accelerations (d,) of the eccentricities: what is there without contact (d,), and the contacts' share.

    ``now`` holds the tables at the present crank angle.
    """
    d = e.shape[0]
    for i in range(d):
        out_a[i] = drift[i]
    for k in range(approach.shape[0]):
        sample_joint(contacts, local[k], k, e, v, now.lever[k], now.lever_drive[k], approach[k], out_sample[k])
        f_n = out_sample[k, F_N]
        if f_n > 0.0:
            f_t, nx, ny = out_sample[k, F_T], out_sample[k, NX], out_sample[k, NY]
            fx, fy = -f_n * nx - f_t * ny, -f_n * ny + f_t * nx
            x_row, y_row, t_row = now.inverse_mass[2 * k], now.inverse_mass[2 * k + 1], now.lever_response[k]
            for i in range(d):
                out_a[i] += x_row[i] * fx + y_row[i] * fy + t_row[i] * f_t

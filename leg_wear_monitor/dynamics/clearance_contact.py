"""Contact forces in the loose joints, and the acceleration they make, in clearance coordinates.

The hot path: plain arrays indexed in place, since views and calls per joint would cost more than the laws.
"""

import math

import numpy as np

from leg_wear_monitor.contact.arrays import ContactArrays
from leg_wear_monitor.contact.friction import friction_force
from leg_wear_monitor.contact.normal import damped_force, elastic_force
from leg_wear_monitor.dynamics.joint_contact import stiffness_at
from leg_wear_monitor.dynamics.touch import DELTA, DELTA_DOT, EX, EY, F_N, SAMPLE, VX, VY
from leg_wear_monitor.kernel import kernel
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.wear.surfaces import local_radii, local_slopes

# a sample of a loose joint goes on with: unit normal, friction force [N], slip speed [m/s], derivatives of
# the normal force by penetration [N/m] and by its rate [N s/m], its elastic part [N], the share of the
# penetration's rate that the bodies' turning makes, by the crank's speed [m/rad], and the torque on the
# crank by that [N m]
NX, NY, F_T, SLIP, STIFFNESS, DAMPING, ELASTIC, CAM, CAM_TORQUE = range(SAMPLE, SAMPLE + 9)
COLUMNS = SAMPLE + 9

# the clearance around a direction, to the second order in the angle from it and in how far the crank has
# turned the worn surfaces since: its value [m]; first and second derivative by the angle; how fast it
# closes by the crank angle, and the second derivatives by angle and crank, and by crank; the direction; and
# the contact stiffness [N/m^1.5]
CLEARANCE, SLOPE, CURVATURE, TURNING, SLOPE_TURNING, TURNING_TURNING, TO_X, TO_Y, LOCAL_STIFFNESS = range(9)
LOCAL = 9

# the laws of a joint: hysteresis factor, friction coefficient, ramp, code of the friction law
HYSTERESIS_FACTOR, FRICTION_COEFFICIENT, RAMP_0, RAMP_1, FRICTION_LAW = range(5)

# rows of the step's vectors (d,): eccentricities, rates and accelerations at its start (0), between its
# stages (M) and at its end (1); the acceleration that is not contact; the stages' slopes; right-hand sides;
# the change of the rates in the last step; the drive torque by accelerations and by rates
E0, V0, A0, EM, VM, E1, V1, A1, DRIFT, K1E, K1V, K2E, K2V, RE, RV, DV, TA, TV = range(18)
VECTORS = 18

_TURNED = 0.02  # rad from that direction at which it is looked up again


def contact_laws(contacts: ContactArrays) -> Floats:
    """Laws of the loose joints (k, 5) in one array."""
    return np.column_stack([contacts.hysteresis, contacts.friction, contacts.friction_law])


@kernel
def look_around(contacts, surfaces, k, nx, ny, now, beyond, local):
    """Clearance of joint k around the direction (nx, ny); fills its row of local (k, LOCAL).

    ``beyond`` [rad] is how far the crank has turned since the angle of the tables ``now``.
    """
    direction, turn = math.atan2(ny, nx), now.turn
    angle_b, angle_j = now.angle[k, 0] + turn[k, 0] * beyond, now.angle[k, 1] + turn[k, 1] * beyond
    bushing, journal = local_radii(contacts, surfaces, k, direction, angle_b, angle_j)
    slope_b, slope_j = local_slopes(surfaces, k, direction, angle_b, angle_j)
    local[k, CLEARANCE], local[k, SLOPE], local[k, CURVATURE] = bushing - journal, slope_b + slope_j, 0.0
    local[k, TURNING] = slope_b * turn[k, 0] + slope_j * turn[k, 1]
    if surfaces.feeds_back:
        ahead_b, ahead_j = local_slopes(surfaces, k, direction + _TURNED, angle_b, angle_j)
        behind_b, behind_j = local_slopes(surfaces, k, direction - _TURNED, angle_b, angle_j)
        bend_b, bend_j = (ahead_b - behind_b) / (2.0 * _TURNED), (ahead_j - behind_j) / (2.0 * _TURNED)
        local[k, CURVATURE] = bend_b + bend_j
        local[k, SLOPE_TURNING] = bend_b * turn[k, 0] + bend_j * turn[k, 1]
        local[k, TURNING_TURNING] = bend_b * turn[k, 0] ** 2 + bend_j * turn[k, 1] ** 2
    local[k, TO_X], local[k, TO_Y] = nx, ny
    local[k, LOCAL_STIFFNESS] = stiffness_at(contacts, k, bushing, journal)


@kernel
def has_turned(k, nx, ny, local):
    """Whether the normal of joint k has turned away from where its clearance is known."""
    along = local[k, TO_X] * nx + local[k, TO_Y] * ny
    return not (abs(local[k, TO_X] * ny - local[k, TO_Y] * nx) < _TURNED and along > 0.0)


@kernel
def accelerate_clearances(law, local, approach, now, ahead, x, at_e, at_v, out_a, out_sample):
    """Accelerations of the eccentricities with all contact forces; samples the joints.

    law (k, 5), local (k, LOCAL), approach (k,); ``now`` the tables at the present crank angle; ``ahead``
    [s] how long the worn surfaces have turned since ``local`` was right; x (VECTORS, d) with
    eccentricities and rates in rows at_e and at_v, the result in row out_a; out_sample (k, COLUMNS).
    """
    d, speed = x.shape[1], now.speed[0]
    inverse_mass, lever, response = now.inverse_mass, now.lever, now.lever_response
    for i in range(d):
        x[out_a, i] = x[DRIFT, i]
    for k in range(approach.shape[0]):
        ex, ey, vx, vy = x[at_e, 2 * k], x[at_e, 2 * k + 1], x[at_v, 2 * k], x[at_v, 2 * k + 1]
        length = math.sqrt(ex * ex + ey * ey)
        inverse = 1.0 / length if length > 0.0 else 0.0
        nx, ny = ex * inverse, ey * inverse
        delta, cam = length - local[k, CLEARANCE], 0.0
        if local[k, SLOPE] != 0.0:  # worn: as contact.geometry.worn_contact, with the wall's own turning
            across, slope = local[k, TO_X] * ny - local[k, TO_Y] * nx, local[k, SLOPE]
            delta -= across * (slope + 0.5 * local[k, CURVATURE] * across) - local[k, TURNING] * speed * ahead
            tilt = (slope + local[k, CURVATURE] * across) / max(length, local[k, CLEARANCE])
            scale = 1.0 / math.sqrt(1.0 + tilt * tilt)
            delta *= scale
            cam = local[k, TURNING] * scale
            nx, ny = (nx + tilt * ny) * scale, (ny - tilt * nx) * scale
        delta_dot = nx * vx + ny * vy + cam * speed
        f_n, f_t, slip, elastic, stiffness, damping = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        if delta > 0.0 and approach[k] > 0.0:
            elastic = elastic_force(local[k, LOCAL_STIFFNESS], delta)
            loss = law[k, HYSTERESIS_FACTOR] / approach[k]
            f_n = damped_force(elastic, loss, delta_dot)
            if f_n > 0.0:
                stiffness = 1.5 * f_n / delta
                damping = elastic * loss
                slip = nx * vy - ny * vx + now.lever_drive[k] * speed
                for i in range(d):
                    slip += lever[k, i] * x[at_v, i]
                mu, code = law[k, FRICTION_COEFFICIENT], law[k, FRICTION_LAW]
                f_t = friction_force(code, mu, law[k, RAMP_0], law[k, RAMP_1], f_n, slip)
                fx, fy = -f_n * nx - f_t * ny, -f_n * ny + f_t * nx
                row = 2 * k
                for i in range(d):
                    pushed = inverse_mass[row, i] * fx + inverse_mass[row + 1, i] * fy
                    x[out_a, i] += pushed + response[k, i] * f_t
        out_sample[k, EX], out_sample[k, EY], out_sample[k, VX], out_sample[k, VY] = ex, ey, vx, vy
        out_sample[k, F_N], out_sample[k, DELTA], out_sample[k, DELTA_DOT] = f_n, delta, delta_dot
        out_sample[k, NX], out_sample[k, NY], out_sample[k, F_T], out_sample[k, SLIP] = nx, ny, f_t, slip
        out_sample[k, STIFFNESS], out_sample[k, DAMPING], out_sample[k, ELASTIC] = stiffness, damping, elastic
        out_sample[k, CAM], out_sample[k, CAM_TORQUE] = cam, f_n * cam


@kernel
def turn_surfaces(angle, local):
    """Let the crank turn the worn surfaces by an angle [rad]: their clearances close or open."""
    for k in range(local.shape[0]):
        local[k, CLEARANCE] -= angle * (local[k, TURNING] - 0.5 * angle * local[k, TURNING_TURNING])
        local[k, SLOPE] -= angle * local[k, SLOPE_TURNING]
        local[k, TURNING] -= angle * local[k, TURNING_TURNING]

"""A clearance joint, for both formulations: contact force and contact events (physics.md sections 3 to 6)."""

import math

from leg_wear_monitor.compiled.kernel import kernel
from leg_wear_monitor.compiled.vectors import LEAST_DIVISOR, largest
from leg_wear_monitor.contact.geometry import journal_contact, worn_contact
from leg_wear_monitor.contact.laws import (
    elastic_energy,
    friction_force,
    law_coefficient,
    normal_force,
    softening,
)
from leg_wear_monitor.dynamics.run import begin_impact, end_impact, hermite, parabola_peak, raise_peak
from leg_wear_monitor.wear import deposit_wear, local_surfaces

# Contact events: begin and end of contact inside a step, on the penetration's cubic Hermite interpolant.
#
# The kernels take samples (SAMPLE, k) of the clearance joints at the start and at the end of a step.
# The contact begins where the penetration of physics.md section 3 becomes positive.


# rows of a sample: eccentricity [m], its rate [m/s], normal force [N], penetration [m], its rate [m/s],
# friction force [N]
EX, EY, VX, VY, F_N, DELTA, DELTA_DOT, F_T = 0, 1, 2, 3, 4, 5, 6, 7
SAMPLE = 8

CONTACT_EVENT = 1.0e-11  # penetration [m] at which a contact counts as just begun
NEVER = 2.0

_CLOSE = 1.0e-14  # tolerance of a crossing, as a fraction of the step
# A maximum counts as large above this fraction of a joint's largest force so far. With all maxima, the
# largest reactions of the default leg are the same.
_LARGE = 0.25


@kernel
def _crossing(low, high, rising, h, k, start, end):
    """Fraction of a step, between low and high, at which the penetration of joint k changes sign.

    Newton's iteration, with bisection where Newton's step leaves the bracket. h is the length of the step
    [s].
    """
    u = 0.5 * (low + high)
    for _ in range(48):
        delta, rate = hermite(u, h, start[DELTA, k], start[DELTA_DOT, k], end[DELTA, k], end[DELTA_DOT, k])
        if (delta > 0.0) == rising:
            high = u
        else:
            low = u
        last, u = u, u - delta / (h * rate)
        if not low < u < high:
            u = 0.5 * (low + high)
        if abs(u - last) < _CLOSE:
            break
    return u


@kernel
def _delta_at(u, h, k, start, end):
    """Penetration [m] of joint k at the fraction u of a step of length h [s]."""
    return hermite(u, h, start[DELTA, k], start[DELTA_DOT, k], end[DELTA, k], end[DELTA_DOT, k])[0]


@kernel
def first_contact_event(approach, h, start, end):
    """Fraction of a step after which the first open joint comes into contact; NEVER if none does.

    ``approach`` (k,) [m/s] is 0 for open joints; ``start`` and ``end`` (SAMPLE, k) are samples. The middle of
    the step is checked too, for a contact that begins and ends inside the step.
    """
    earliest = NEVER
    for k in range(approach.shape[0]):
        if approach[k] == 0.0 and start[DELTA, k] <= CONTACT_EVENT:
            if start[DELTA_DOT, k] > 0.0 and _delta_at(0.5, h, k, start, end) > CONTACT_EVENT:
                earliest = min(earliest, _crossing(0.0, 0.5, True, h, k, start, end))
            elif end[DELTA, k] > CONTACT_EVENT:
                earliest = min(earliest, _crossing(0.5, 1.0, True, h, k, start, end))
    return earliest


@kernel
def begin_contact(k, joint, speed_floor, t, rate, approach, recent, impact, impacts):
    """Begin a contact in clearance joint k at time t [s]; ``rate`` [m/s] is the rate of penetration.

    Changes approach (k,) [m/s], recent (k, 4) [s, N, s, N], and the run statistics' impact and impacts.
    """
    approach[k] = max(rate, speed_floor[k])
    begin_impact(impact, impacts, joint[k], t, rate)
    recent[k, 0], recent[k, 1], recent[k, 2], recent[k, 3] = t, 0.0, t, 0.0


@kernel
def update_contacts(joint, speed_floor, t, h, start, end, approach, recent, peak, impact, impacts):
    """Process the contacts after a step from t to t + h [s]: beginnings, ends, and force peaks.

    Changes approach (k,) [m/s] and recent (k, 4), the last two samples of time [s] and normal force [N] of
    each joint, and the run statistics' peak, impact and impacts.

    Returns
    -------
    changed, peaked
        True if a contact began or ended; true if a force passed a large maximum at the step's start.
    """
    changed, peaked = False, False
    for k in range(approach.shape[0]):
        rate, force = end[DELTA_DOT, k], end[F_N, k]
        if approach[k] == 0.0:
            # a rotating worn profile can come into contact with a journal that does not approach it
            nearer = rate > 0.0 or end[DELTA, k] > start[DELTA, k]
            if end[DELTA, k] >= -CONTACT_EVENT and nearer:
                begin_contact(k, joint, speed_floor, t + h, rate, approach, recent, impact, impacts)
                changed = True
            continue
        top = force
        if recent[k, 3] >= force and recent[k, 3] >= recent[k, 1] and recent[k, 0] < recent[k, 2]:
            top = parabola_peak(recent[k, 0], recent[k, 1], recent[k, 2], recent[k, 3], t + h, force)
            peaked = peaked or top > _LARGE * peak[joint[k]]
        raise_peak(peak, impact, impacts, joint[k], top)
        recent[k, 0], recent[k, 1], recent[k, 2], recent[k, 3] = recent[k, 2], recent[k, 3], t + h, force
        if end[DELTA, k] <= 0.0 and rate < 0.0:
            end_impact(impact, impacts, joint[k], t + h * _crossing(0.0, 1.0, False, h, k, start, end))
            approach[k] = 0.0
            changed = True
    return changed, peaked


@kernel
def pushed_through(bushing_radius, sample):
    """First clearance joint with a penetration of more than a tenth of the bushing's radius, else -1."""
    for k in range(bushing_radius.shape[0]):
        if not sample[DELTA, k] < 0.1 * bushing_radius[k]:
            return k
    return -1


# Contact force of a clearance joint, for both formulations (physics.md sections 3 to 6).


@kernel
def penetration(contacts, surfaces, k, ex, ey, direction, angle_b, angle_j):
    """Penetration, contact normal and local radii of clearance joint k.

    ``direction`` [rad] is the direction of the eccentricity (ex, ey) [m]; it is used only with wear feedback.
    The normal is a unit vector on fresh surfaces, see `worn_contact` for worn surfaces: the normal force
    times the normal is the gradient of the contact's energy, including the change of the local radii with
    direction. physics.md section 3.

    Returns
    -------
    delta, nx, ny, bushing, journal, cam_b, cam_j
        Penetration [m], normal, local radii [m], and the derivatives of the penetration by the rotation of
        bushing and journal [m/rad].
    """
    bushing, journal, slope_b, slope_j, bend_b, bend_j = local_surfaces(
        contacts, surfaces, k, direction, angle_b, angle_j
    )
    if not surfaces.feeds_back:
        delta, nx, ny = journal_contact(ex, ey, contacts.clearance[k])
        return delta, nx, ny, bushing, journal, 0.0, 0.0
    delta, nx, ny, cam_b, cam_j = touch_walls(ex, ey, bushing - journal, slope_b, slope_j, bend_b, bend_j)
    if delta > 0.0:
        softer_b, softer_j = softening(
            contacts.normal_form[k], contacts.stiffness[k], delta, bushing, journal, slope_b, slope_j
        )
        nx, ny, cam_b, cam_j = soften(ex, ey, nx, ny, cam_b, cam_j, softer_b, softer_j)
    return delta, nx, ny, bushing, journal, cam_b, cam_j


@kernel
def touch_walls(ex, ey, clearance, slope_b, slope_j, bend_b, bend_j):
    """Penetration, normal and derivatives of `penetration` by the geometry; for numbers or vectors."""
    delta, nx, ny, scale, by_slope = worn_contact(ex, ey, clearance, slope_b + slope_j, bend_b + bend_j)
    cam_b, cam_j = slope_b * scale + by_slope * bend_b, slope_j * scale + by_slope * bend_j
    return delta, nx, ny, cam_b, cam_j


@kernel
def soften(ex, ey, nx, ny, cam_b, cam_j, softer_b, softer_j):
    """Normal and derivatives with the change of the law's coefficient; for numbers or vectors."""
    along = (softer_b + softer_j) / largest(ex * ex + ey * ey, LEAST_DIVISOR)
    return nx + along * ey, ny - along * ex, cam_b + softer_b, cam_j + softer_j


@kernel
def coefficient_at(contacts, k, bushing, journal):
    """Coefficient of the normal law of clearance joint k for local radii [m]; physics.md section 4."""
    form, given = contacts.normal_form[k], contacts.stiffness[k]
    return law_coefficient(form, given, contacts.modulus[k], contacts.width[k], bushing, journal)


@kernel
def joint_force(contacts, surfaces, k, ex, ey, vx, vy, angle_b, angle_j, speed_b, speed_j, approach_speed):
    """Forces in clearance joint k; 0 for an open joint, whose ``approach_speed`` [m/s] is 0.

    Eccentricity (ex, ey) [m] and its rate [m/s]; angles [rad] and speeds [rad/s] of the bushing's and the
    journal's body. Both forces act at the bushing's surface point P_b + R_b n, so action equals reaction in
    moments as well; the slip is the slip of the two bodies at this point. A rotating worn bushing lifts the
    journal like a cam, by the couple ``moment`` between the bodies. The work of these forces is exactly F_N
    delta_dot and F_t v_t. physics.md sections 3 and 4.

    Returns
    -------
    f_n, f_t, delta, delta_dot, slip, nx, ny, elastic, moment
        The force on the journal is -f_n n + f_t t [N] with t = (-n_y, n_x), the couple on it ``moment``
        [N m]; penetration [m], its rate [m/s], slip speed [m/s]; ``elastic`` [N] is the part of f_n that
        stores energy.
    """
    direction = math.atan2(ey, ex) if surfaces.feeds_back else 0.0
    delta, nx, ny, bushing, journal, slope_b, slope_j = penetration(
        contacts, surfaces, k, ex, ey, direction, angle_b, angle_j
    )
    delta_dot = nx * vx + ny * vy + slope_b * speed_b + slope_j * speed_j
    arm = contacts.bushing_radius[k] * (nx * nx + ny * ny)
    slip = nx * vy - ny * vx + speed_j * (arm - ex * nx - ey * ny) - speed_b * arm
    if delta <= 0.0 or approach_speed == 0.0:
        return 0.0, 0.0, delta, delta_dot, slip, nx, ny, 0.0, 0.0
    coefficient, loss = coefficient_at(contacts, k, bushing, journal), contacts.hysteresis[k] / approach_speed
    f_n, _, _, elastic = normal_force(
        contacts.normal_form[k], coefficient, bushing - journal, loss, delta, delta_dot
    )
    mu, v0, v1 = contacts.friction[k, 0], contacts.friction[k, 1], contacts.friction[k, 2]
    f_t = friction_force(contacts.friction_law[k], mu, v0, v1, f_n, slip)
    return f_n, f_t, delta, delta_dot, slip, nx, ny, elastic, f_n * slope_b


@kernel
def contact_energy(contacts, surfaces, k, ex, ey, angle_b, angle_j):
    """Elastic energy [J] of the contact in clearance joint k; physics.md section 3."""
    direction = math.atan2(ey, ex) if surfaces.feeds_back else 0.0
    delta, _, _, bushing, journal, _, _ = penetration(
        contacts, surfaces, k, ex, ey, direction, angle_b, angle_j
    )
    coefficient = coefficient_at(contacts, k, bushing, journal)
    return elastic_energy(contacts.normal_form[k], coefficient, bushing - journal, delta)


@kernel
def wear_joint(contacts, surfaces, k, ex, ey, angle_b, angle_j, acted, integral, out_weight):
    """Deposit the wear of an increment ``integral`` of F_N |v_t| dt [J]; returns the lost energy [J].

    The lost energy is the elastic energy of the contact that disappears with the removed material, for the
    journal's present eccentricity (ex, ey) [m]. ``acted`` is the position at which the increment acted:
    eccentricity [m, m], angles of bushing and journal [rad, rad]. physics.md sections 5 and 6.
    """
    stored = 0.0
    if surfaces.feeds_back:
        stored = contact_energy(contacts, surfaces, k, ex, ey, angle_b, angle_j)
    deposit_wear(contacts, surfaces, k, acted[0], acted[1], acted[2], acted[3], integral, out_weight)
    if surfaces.feeds_back:
        stored -= contact_energy(contacts, surfaces, k, ex, ey, angle_b, angle_j)
    return stored

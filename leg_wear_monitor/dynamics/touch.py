"""Contacts that begin and end inside a step, found on the cubic through its ends."""

import math

from leg_wear_monitor.dynamics.dormand_prince import hermite
from leg_wear_monitor.dynamics.joint_contact import penetration
from leg_wear_monitor.dynamics.tally import begin_impact, end_impact, parabola_peak, raise_peak
from leg_wear_monitor.kernel import kernel

TOUCH = 1.0e-11  # penetration [m] at which a contact counts as just begun
NEVER = 2.0


@kernel
def _delta_at(contacts, surfaces, k, u, h, start, end, angle_b, angle_j):
    """Penetration [m] at the share u of a step, from eccentricities and their rates (4,) at its ends."""
    ex = hermite(u, h, start[0], start[2], end[0], end[2])[0]
    ey = hermite(u, h, start[1], start[3], end[1], end[3])[0]
    return penetration(contacts, surfaces, k, ex, ey, angle_b, angle_j)[0]


@kernel
def touch_share(contacts, surfaces, k, h, start, end, angle_b, angle_j):
    """Share of a step after which a joint that was open touches; NEVER if it stays open."""
    low, high = 0.0, 0.5
    if not _delta_at(contacts, surfaces, k, 0.5, h, start, end, angle_b, angle_j) > TOUCH:
        low, high = 0.5, 1.0
        if not _delta_at(contacts, surfaces, k, 1.0, h, start, end, angle_b, angle_j) > TOUCH:
            return NEVER
    for _ in range(48):
        middle = 0.5 * (low + high)
        if _delta_at(contacts, surfaces, k, middle, h, start, end, angle_b, angle_j) > 0.0:
            high = middle
        else:
            low = middle
    return 0.5 * (low + high)


@kernel
def part_share(contacts, surfaces, k, h, start, end, angle_b, angle_j):
    """Share of a step after which a joint that touched at its start is open for good."""
    low, high = 0.0, 1.0
    for _ in range(48):
        middle = 0.5 * (low + high)
        if _delta_at(contacts, surfaces, k, middle, h, start, end, angle_b, angle_j) > 0.0:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@kernel
def first_touch(contacts, surfaces, approach, joint_body, h, angles, start, end):
    """Share of a step after which the first of the open joints touches; NEVER if none does.

    start and end (k, 6) hold eccentricities and rates; angles (n, 3) the coordinates at the step's end.
    """
    earliest = NEVER
    for k in range(approach.shape[0]):
        if approach[k] == 0.0:
            joint = contacts.joint[k]
            b, j = joint_body[joint, 0], joint_body[joint, 1]
            if penetration(contacts, surfaces, k, end[k, 0], end[k, 1], angles[b, 2], angles[j, 2])[
                0
            ] > TOUCH or (math.hypot(start[k, 2], start[k, 3]) * h > contacts.clearance[k] * 0.1):
                share = touch_share(contacts, surfaces, k, h, start[k], end[k], angles[b, 2], angles[j, 2])
                earliest = min(earliest, share)
    return earliest


@kernel
def update_contacts(contacts, surfaces, joint_body, t, h, angles, start, end, approach, recent, tally):
    """After a step from t to t + h: contacts that begin or end, and the peaks of those that go on.

    Changes approach (k,) and recent (k, 4), the last two samples of time and normal force of each joint.
    Returns whether a contact began or ended.
    """
    changed = False
    for k in range(approach.shape[0]):
        joint = contacts.joint[k]
        angle_b, angle_j = angles[joint_body[joint, 0], 2], angles[joint_body[joint, 1], 2]
        delta, nx, ny, _, _ = penetration(contacts, surfaces, k, end[k, 0], end[k, 1], angle_b, angle_j)
        delta_dot = nx * end[k, 2] + ny * end[k, 3]
        if approach[k] == 0.0:
            if delta >= -TOUCH and delta_dot > 0.0:
                approach[k] = max(delta_dot, contacts.speed_floor[k])
                begin_impact(tally, joint, t + h, delta_dot)
                recent[k, 0], recent[k, 1], recent[k, 2], recent[k, 3] = t + h, 0.0, t + h, 0.0
                changed = True
            continue
        force = end[k, 4]
        raise_peak(tally, joint, force)
        if recent[k, 3] >= force and recent[k, 3] >= recent[k, 1] and recent[k, 0] < recent[k, 2]:
            top = parabola_peak(recent[k, 0], recent[k, 1], recent[k, 2], recent[k, 3], t + h, force)
            raise_peak(tally, joint, top)
        recent[k, 0], recent[k, 1], recent[k, 2], recent[k, 3] = recent[k, 2], recent[k, 3], t + h, force
        if delta <= 0.0 and delta_dot < 0.0:
            end_impact(
                tally, joint, t + h * part_share(contacts, surfaces, k, h, start[k], end[k], angle_b, angle_j)
            )
            approach[k] = 0.0
            changed = True
    return changed

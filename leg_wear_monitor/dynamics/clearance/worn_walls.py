"""Contact of eight joints on walls that wear has changed (physics.md sections 3 and 6)."""

import math

from leg_wear_monitor.contact.normal.hertz import hertz_coefficient, hertz_softening
from leg_wear_monitor.dynamics.clearance.joint_laws import FRESH_COEFFICIENT
from leg_wear_monitor.dynamics.joint.joint_contact import coefficient_at, penetration, soften, touch_walls
from leg_wear_monitor.kernel import kernel
from leg_wear_monitor.vectors import (
    LEAST_DIVISOR,
    WIDTH,
    any_of,
    entry_of,
    evens,
    largest,
    odds,
    part_at,
    root,
    vector_at,
    where,
    with_entry,
)
from leg_wear_monitor.wear.surfaces import BUSHING, JOURNAL, profiles_at

# rows of a reference direction, near which angles are computed without an arc tangent: cosine, sine and
# angle [rad]
TO_X, TO_Y, TO_ANGLE = range(3)

_NEAR = 0.1  # largest sine of an angle for the arc sine's series, whose error is then 3e-11 rad


@kernel
def take_directions(e, out_toward):
    """Reference directions (3, k) of the eccentricities e (d,)."""
    for k in range(out_toward.shape[1]):
        ex, ey = e[2 * k], e[2 * k + 1]
        length = math.sqrt(ex * ex + ey * ey)
        out_toward[TO_X, k] = ex / length if length > 0.0 else 1.0
        out_toward[TO_Y, k] = ey / length if length > 0.0 else 0.0
        out_toward[TO_ANGLE, k] = math.atan2(ey, ex)


@kernel
def directions_of(ex, ey, k, toward):
    """Angles [rad] of the eccentricities of eight joints, from the reference directions where near."""
    to_x, to_y = part_at(toward, (TO_X, k)), part_at(toward, (TO_Y, k))
    across, along, length = to_x * ey - to_y * ex, to_x * ex + to_y * ey, root(ex * ex + ey * ey)
    s = across / largest(length, LEAST_DIVISOR)
    square = s * s
    series = 1.0 + square * (1.0 / 6.0 + square * (3.0 / 40.0 + square * (15.0 / 336.0)))
    direction = part_at(toward, (TO_ANGLE, k)) + s * series
    far = (abs(across) >= _NEAR * along) & (length > 0.0)
    if any_of(far):
        off = where(far, 1.0, 0.0)
        for i in range(WIDTH):
            if entry_of(off, i) > 0.0:
                direction = with_entry(direction, i, math.atan2(entry_of(ey, i), entry_of(ex, i)))
    return direction


@kernel
def touch_worn_walls(model, surfaces, now, turned, k, ex, ey):
    """Penetrations of eight joints from joint k on, and what depends on the place on worn walls.

    ``turned``: crank angle relative to that of the tables [rad]; eccentricities (ex, ey) [m].

    Returns
    -------
    delta, nx, ny, cam, clearance, coefficient
        As in a sample.
    """
    turn_b, turn_j = _of_bodies(now.turn_line, k)
    angle_b, angle_j = _of_bodies(now.angle_line, k)
    angle_b, angle_j = angle_b + turn_b * turned, angle_j + turn_j * turned
    direction = directions_of(ex, ey, k, now.toward)
    contacts, fresh = model.contacts, vector_at(model.law, (FRESH_COEFFICIENT, k))
    depth_b, slope_b, bend_b = profiles_at(surfaces.depth, k, BUSHING, direction - angle_b)
    depth_j, slope_j, bend_j = profiles_at(surfaces.depth, k, JOURNAL, direction - angle_j)
    radius, given = part_at(contacts.bushing_radius, k), part_at(contacts.stiffness, k)
    bushing, journal = radius + depth_b, radius - part_at(contacts.clearance, k) - depth_j
    clearance = bushing - journal
    delta, nx, ny, cam_b, cam_j = touch_walls(ex, ey, clearance, slope_b, slope_j, bend_b, bend_j)
    inside = largest(delta, 0.0)
    softer_b, softer_j = hertz_softening(given, inside, bushing, journal, slope_b, slope_j)
    nx, ny, cam_b, cam_j = soften(ex, ey, nx, ny, cam_b, cam_j, softer_b, softer_j)
    modulus, width = part_at(contacts.modulus, k), part_at(contacts.width, k)
    coefficient = where(delta > 0.0, hertz_coefficient(given, modulus, width, bushing, journal), fresh)
    cam = cam_b * turn_b + cam_j * turn_j
    if not model.usual:
        for i in range(min(WIDTH, contacts.joint.shape[0] - k)):
            d, x, y, b, j, by_b, by_j = penetration(
                contacts, surfaces, k + i, entry_of(ex, i), entry_of(ey, i), entry_of(direction, i),
                entry_of(angle_b, i), entry_of(angle_j, i),
            )  # fmt: skip
            local = coefficient_at(contacts, k + i, b, j) if d > 0.0 else entry_of(fresh, i)
            delta, nx, ny = with_entry(delta, i, d), with_entry(nx, i, x), with_entry(ny, i, y)
            coefficient, clearance = with_entry(coefficient, i, local), with_entry(clearance, i, b - j)
            cam = with_entry(cam, i, by_b * entry_of(turn_b, i) + by_j * entry_of(turn_j, i))
    return delta, nx, ny, cam, clearance, coefficient


@kernel
def _of_bodies(line, k):
    """Values of the bushings' and the journals' bodies of eight joints; in turn in a line (2 k,)."""
    first, second = part_at(line, 2 * k), part_at(line, 2 * k + WIDTH)
    return evens(first, second), odds(first, second)

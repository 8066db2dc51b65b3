"""Worn surfaces: depth over angular sectors of bushing and journal (physics.md sections 5 and 6).

Sector i spans the angles [i, i + 1] x 2 pi / N of its own body's frame. Wear is deposited in the sectors
where the two profiles overlap, in proportion to the overlap. On fresh surfaces these are the sectors of the
arc cos psi = (R_b^2 + e^2 - R_j^2) / (2 R_b e); on worn surfaces, the sectors where the journal overlaps the
worn profile. A journal under a constant load therefore wears its own shape into the bushing, as in the
closed-form solution.
"""

import math
from typing import NamedTuple

import numpy as np

from leg_wear_monitor.compiled.kernel import kernel
from leg_wear_monitor.compiled.vectors import floor, gather, where
from leg_wear_monitor.contact.arrays import ContactArrays
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import TURN

SECTORS = 720

BUSHING, JOURNAL = 0, 1

_TURNS_PER_RAD = 0.5 / math.pi
_BESIDE = 16  # sectors on either side of the eccentricity's direction that are searched for an overlap


class Surfaces(NamedTuple):
    """Wear ``depth`` (k, 2, N) [m] of bushing and journal; ``feeds_back``: 1 if wear widens clearances."""

    depth: Floats
    feeds_back: int


def fresh_surfaces(contacts: ContactArrays, feeds_back: bool, sectors: int = SECTORS) -> Surfaces:
    """Surfaces without wear."""
    return Surfaces(np.zeros((len(contacts.joint), 2, sectors)), int(feeds_back))


@kernel
def profile_at(profile, angle):
    """Depth [m] at an angle [rad] of the surface's own frame, and its derivatives [m/rad, m/rad^2].

    The profile (N,) is interpolated by a quadratic spline with a continuous slope. physics.md section 6.
    """
    n = profile.shape[0]
    before, here, after, w = _sectors_at(n, angle)
    return _spline(n, w, profile[int(before)], profile[int(here)], profile[int(after)])


@kernel
def profiles_at(depth, k, surface, angle):
    """Same as `profile_at`, for eight joints from joint k on: depth (k, 2, N), a vector of angles."""
    n = depth.shape[2]
    before, here, after, w = _sectors_at(n, angle)
    return _spline(
        n,
        w,
        gather(depth, k, surface, before),
        gather(depth, k, surface, here),
        gather(depth, k, surface, after),
    )


@kernel
def _sectors_at(n, angle):
    """Numbers of the sectors before, at and after an angle [rad], and the fraction of the sector before it.

    The arguments are numbers or vectors; the sectors' numbers are floats.
    """
    turns, last = angle * _TURNS_PER_RAD, n - 1.0
    u = n * (turns - floor(turns))
    here = where(u < n, floor(u), last)
    return where(here > 0.0, here - 1.0, last), here, where(here < last, here + 1.0, 0.0), u - here


@kernel
def _spline(n, w, before, here, after):
    """Quadratic spline in one of n sectors, and its derivatives; for numbers or vectors."""
    rest = 1.0 - w
    depth = 0.5 * (rest * rest * before + (1.0 + 2.0 * w * rest) * here + w * w * after)
    per_rad = n * _TURNS_PER_RAD
    rise, next_rise = here - before, after - here
    return depth, (rise + w * (next_rise - rise)) * per_rad, (next_rise - rise) * per_rad * per_rad


@kernel
def local_surfaces(contacts, surfaces, k, direction, angle_b, angle_j):
    """Local radii [m] of bushing and journal in a direction [rad] of the ground's frame, and derivatives.

    The derivatives are derivatives of the depths by the direction: slopes of bushing and journal [m/rad],
    then second derivatives [m/rad^2]; 0 without wear feedback. physics.md section 6.
    """
    bushing = contacts.bushing_radius[k]
    journal = bushing - contacts.clearance[k]
    if not surfaces.feeds_back:
        return bushing, journal, 0.0, 0.0, 0.0, 0.0
    depth_b, slope_b, bend_b = profile_at(surfaces.depth[k, BUSHING], direction - angle_b)
    depth_j, slope_j, bend_j = profile_at(surfaces.depth[k, JOURNAL], direction - angle_j)
    return bushing + depth_b, journal - depth_j, slope_b, slope_j, bend_b, bend_j


@kernel
def _weigh_arc(contacts, surfaces, k, ex, ey, angle_b, angle_j, centre, side, turning, out_weight):
    """Overlap [m] of the sectors from ``centre`` to one side (1 or -1); returns its sum [m] and their number.

    ``turning``: cosine and sine of a sector; each step turns the direction by this angle. physics.md section
    6.
    """
    n = surfaces.depth.shape[2]
    width = TURN / n
    along = angle_b + (centre + 0.5) * width
    cos_step, sin_step = turning[0], side * turning[1]
    c, s = math.cos(along), math.sin(along)
    total, count, sector = 0.0, 0, centre
    for step in range(n // 2):
        if step > 0:
            c, s = c * cos_step - s * sin_step, s * cos_step + c * sin_step
            sector = _beside(sector, side, n)
        if step > 0 or side > 0:
            overlap = ex * c + ey * s - contacts.clearance[k]
            if surfaces.feeds_back:
                overlap -= surfaces.depth[k, BUSHING, sector]
                overlap -= profile_at(surfaces.depth[k, JOURNAL], along + side * step * width - angle_j)[0]
            if overlap <= 0.0:
                break
            out_weight[sector] = overlap
            total += overlap
        count += 1
    return total, count


@kernel
def _beside(sector, side, n):
    """The next of n sectors on one side (1 or -1), without a division, which would take most of the time."""
    beside = sector + side
    if beside == n:
        return 0
    return n - 1 if beside < 0 else beside


@kernel
def deposit_wear(contacts, surfaces, k, ex, ey, angle_b, angle_j, integral, out_weight):
    """Deposit the wear of an increment ``integral`` of F_N |v_t| dt [J] on both surfaces of joint k.

    ``ex, ey`` [m] is the eccentricity, ``angle_b, angle_j`` [rad] the angles of the bodies, out_weight (N,) a
    work array. The removed volumes are k_b and k_j times the integral: sums over sectors of depth x R_b x
    sector angle x width. Both surfaces have the area of the contact, so equal coefficients give equal depths.
    physics.md sections 5 and 6.
    """
    n = surfaces.depth.shape[2]
    sector = TURN / n
    turning = math.cos(sector), math.sin(sector)
    towards = math.floor((math.atan2(ey, ex) - angle_b) / sector) % n
    # On a worn flank the overlap may begin some sectors away. The search order is 0, 1, -1, 2, ...
    for beside in range(2 * _BESIDE + 1):
        aside = (beside + 1) // 2
        centre = (towards + (aside if beside % 2 == 1 else -aside)) % n
        right, count_right = _weigh_arc(
            contacts, surfaces, k, ex, ey, angle_b, angle_j, centre, 1, turning, out_weight
        )
        if right > 0.0:
            break
    left, count_left = _weigh_arc(
        contacts, surfaces, k, ex, ey, angle_b, angle_j, centre, -1, turning, out_weight
    )
    if right <= 0.0:  # contact narrower than a sector
        centre, count_right, count_left = towards, 1, 1
        out_weight[centre] = right = 1.0
        left = 0.0
    depth = integral / ((right + left) * contacts.bushing_radius[k] * sector * contacts.width[k])
    shift = (angle_b - angle_j) / sector
    floor = math.floor(shift)
    w = shift - floor
    i = (centre - count_left + 1) % n
    j = (i + int(floor)) % n
    for _ in range(count_left + count_right - 1):
        fraction = depth * out_weight[i]
        surfaces.depth[k, BUSHING, i] += contacts.wear_coefficient[k, BUSHING] * fraction
        worn = contacts.wear_coefficient[k, JOURNAL] * fraction
        after = _beside(j, 1, n)
        surfaces.depth[k, JOURNAL, j] += (1.0 - w) * worn
        surfaces.depth[k, JOURNAL, after] += w * worn
        i, j = _beside(i, 1, n), after


def wear_zone(depth: Floats, fraction: float = 0.9) -> tuple[float, float] | None:
    """Narrowest zone of the surface that contains a fraction of the wear.

    Parameters
    ----------
    depth : (N,) array, m
    fraction : float

    Returns
    -------
    (from, to) : tuple of float, or None
        Angles [deg] in the surface's own frame: ``from`` in [0, 360), ``to`` at most 360 above it. None
        without wear.
    """
    n, total = len(depth), depth.sum()
    if not total > 0.0:
        return None
    sums = np.concatenate([[0.0], np.cumsum(np.concatenate([depth, depth]))])
    # The first end that contains the fraction, for every start.
    ends = np.searchsorted(sums, sums[:n] + fraction * total * (1.0 - 1.0e-12))
    start = int(np.argmin(ends - np.arange(n)))
    return 360.0 * start / n, 360.0 * int(ends[start]) / n

"""Worn surfaces: Archard's closed form, volume, frames, the wear zone."""

import math
from collections.abc import Callable

import attrs
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.optimize import brentq

from leg_wear_monitor import Mechanism
from leg_wear_monitor.contact.arrays import ContactArrays, compile_contacts
from leg_wear_monitor.wear import (
    BUSHING,
    JOURNAL,
    SECTORS,
    Surfaces,
    deposit_wear,
    fresh_surfaces,
    local_surfaces,
    profile_at,
    wear_zone,
)

TURN = 2.0 * math.pi
RADIUS, CLEARANCE, WIDTH = 0.010, 3.0e-4, 0.015  # m


@pytest.fixture(scope="session")
def bushing(leg: Mechanism) -> Callable[[tuple[float, float]], ContactArrays]:
    """One clearance joint, by the wear coefficients of its bushing and its journal [1/Pa]."""
    size = {"bushing_radius": RADIUS, "radial_clearance": CLEARANCE, "width": WIDTH}

    def clearance_joints(wear_coefficient: tuple[float, float]) -> ContactArrays:
        settings = attrs.evolve(leg.clearances["G"], **size, wear_coefficient=wear_coefficient)
        return compile_contacts(leg, ["G"], [settings])

    return clearance_joints


# Archard's law in a bushing under a force of one direction: a closed form. The journal sinks into the
# bushing by h; the two circles meet at cos theta0 = c / (c + h), the worn area is A(h) = 2 R ((c + h) sin
# theta0 - c theta0), and width A(h) = k F s.


FORCE, BUSHING_WEAR = 100.0, 1.0e-13
PRESSED = 1.0e-7  # penetration of the journal, small beside every depth [m]
SECTOR = TURN / SECTORS

# slid distance [m], depth [m], half arc [deg]
PUBLISHED = [
    (10.0, 3.3584e-6, 8.53),
    (100.0, 15.777e-6, 18.19),
    (1.0e3, 77.294e-6, 37.33),
    (1.0e4, 443.15e-6, 66.19),
]


@pytest.fixture(scope="module")
def soft_bushing(bushing):
    """One clearance joint of which only the bushing wears."""
    return bushing((BUSHING_WEAR, 0.0))


def closed_form(distance):
    """Depth [m] and half arc [rad] after a distance [m]."""

    def missing(h):
        arc = math.acos(CLEARANCE / (CLEARANCE + h))
        area = 2.0 * RADIUS * ((CLEARANCE + h) * math.sin(arc) - CLEARANCE * arc)
        return WIDTH * area / (BUSHING_WEAR * FORCE) - distance

    h = brentq(missing, 1.0e-9, 5.0e-3, xtol=1.0e-15)
    return h, math.acos(CLEARANCE / (CLEARANCE + h))


def slid(soft_bushing, distance, direction):
    """Surfaces after a distance of sliding with the journal at the local clearance in one direction."""
    surfaces, weight = fresh_surfaces(soft_bushing, True), np.zeros(SECTORS)
    left = FORCE * distance
    while left > 0.0:
        e = CLEARANCE + profile_at(surfaces.depth[0, BUSHING], direction)[0] + PRESSED
        arc = max(math.acos(CLEARANCE / e), SECTOR)
        # as much as wears the arc about as deep as it is pressed
        bite = min(left, PRESSED * 2.0 * RADIUS * math.sin(arc) * WIDTH / BUSHING_WEAR)
        ex, ey = e * math.cos(direction), e * math.sin(direction)
        deposit_wear(soft_bushing, surfaces, 0, ex, ey, 0.0, 0.0, bite, weight)
        left -= bite
    return surfaces.depth[0]


@pytest.mark.parametrize(("distance", "depth", "half_arc"), PUBLISHED)
def test_closed_form_as_published(distance, depth, half_arc):
    h, arc = closed_form(distance)
    assert h == pytest.approx(depth, rel=5.0e-5)
    assert math.degrees(arc) == pytest.approx(half_arc, abs=0.005)


@pytest.mark.parametrize("distance", [10.0, 100.0, 1.0e3, 1.0e4])
def test_worn_depth_is_the_closed_form(soft_bushing, distance):
    """Within 1 % asked; 0.02 % and a sector at either end of the arc reached."""
    direction = 100.5 * SECTOR
    worn = slid(soft_bushing, distance, direction)
    h, arc = closed_form(distance)
    assert worn[BUSHING].max() == pytest.approx(h, rel=1.0e-3)
    assert np.count_nonzero(worn[BUSHING]) * SECTOR == pytest.approx(2.0 * arc, abs=2.5 * SECTOR)
    assert not worn[JOURNAL].any()


def test_worn_profile_is_the_journals_own_shape(soft_bushing):
    direction = 100.5 * SECTOR
    h, arc = closed_form(1.0e3)
    off = (np.arange(SECTORS) + 0.5) * SECTOR - direction
    shape = np.where(np.abs(off) < arc, (CLEARANCE + h) * np.cos(off) - CLEARANCE, 0.0)
    np.testing.assert_allclose(slid(soft_bushing, 1.0e3, direction)[BUSHING], shape, atol=0.005 * h)


def test_direction_between_two_sectors_wears_as_deep(soft_bushing):
    assert slid(soft_bushing, 100.0, 100.0 * SECTOR)[BUSHING].max() == pytest.approx(
        closed_form(100.0)[0], rel=0.01
    )


# Worn surfaces: volume, frames, and what they do to the clearance.


WEAR = (2.0e-13, 0.5e-13)  # 1/Pa, bushing and journal

angles = st.floats(-20.0, 20.0)
touches = st.floats(1.0e-8, 1.0e-5)  # penetration, m


@pytest.fixture(scope="module")
def joint(bushing):
    """One clearance joint whose bushing wears four times as fast as its journal."""
    return bushing(WEAR)


def _worn(seed, feeds_back=1):
    """Surfaces with a smooth random wear of some micrometres."""
    rng = np.random.default_rng(seed)
    centres = (np.arange(SECTORS) + 0.5) * TURN / SECTORS
    depth = [1.0e-6 * (1.0 + rng.uniform() * np.cos(centres - rng.uniform(0.0, TURN))) for _ in range(2)]
    return Surfaces(np.array([depth]), feeds_back)


def _rub(joint, surfaces, direction, delta, angle_b, angle_j, integral=1.0e6):
    """Wear a joint whose journal is pressed in a direction by some penetration."""
    bushing, journal, *_ = local_surfaces(joint, surfaces, 0, direction, angle_b, angle_j)
    e = bushing - journal + delta
    ex, ey = e * math.cos(direction), e * math.sin(direction)
    deposit_wear(joint, surfaces, 0, ex, ey, angle_b, angle_j, integral, np.zeros(surfaces.depth.shape[2]))


contacts = st.lists(st.tuples(angles, touches, angles, angles, st.floats(0.0, 1.0e6)), min_size=1, max_size=8)


@given(
    sector=st.integers(0, SECTORS - 1),
    width=st.integers(1, 9),
    notch=st.floats(2.0e-6, 1.0e-4),
    delta=st.floats(1.0e-6, 1.9e-6),
    angle_j=angles,
)
def test_a_notch_that_the_journal_spans_wears_no_deeper(joint, sector, width, notch, delta, angle_j):
    """It rests on the flanks, wherever its centre points: there is no overlap in the notch."""
    surfaces = fresh_surfaces(joint, feeds_back=True)
    inside = (sector + np.arange(width) - width // 2) % SECTORS
    surfaces.depth[0, BUSHING, inside] = notch
    before = surfaces.depth.copy()
    e, direction = CLEARANCE + delta, (sector + 0.5) * TURN / SECTORS
    ex, ey = e * math.cos(direction), e * math.sin(direction)
    deposit_wear(joint, surfaces, 0, ex, ey, 0.0, angle_j, 1.0, np.zeros(SECTORS))
    worn = surfaces.depth[0, BUSHING] - before[0, BUSHING]
    np.testing.assert_array_equal(worn[inside], 0.0)
    assert worn.sum() > 0.0


@given(contacts=contacts, feeds_back=st.sampled_from([0, 1]), seed=st.integers(0, 9))
def test_volume_is_archards_to_rounding(joint, contacts, feeds_back, seed):
    """On each surface by itself: V = k x integral of F_N |v_t| dt, wherever and however it wore."""
    surfaces = _worn(seed, feeds_back)
    face = RADIUS * WIDTH * SECTOR  # m^2
    before = surfaces.depth.sum(axis=2) * face
    for direction, delta, angle_b, angle_j, integral in contacts:
        _rub(joint, surfaces, direction, delta, angle_b, angle_j, integral)
    total = sum(contact[-1] for contact in contacts)
    worn = surfaces.depth.sum(axis=2) * face - before
    np.testing.assert_allclose(worn[0], np.array(WEAR) * total, rtol=1.0e-9, atol=1.0e-12 * before[0].max())


@given(direction=angles, delta=touches, angle_b=angles, angle_j=angles)
def test_a_fresh_contact_wears_the_arc_of_the_two_circles(joint, direction, delta, angle_b, angle_j):
    surfaces = fresh_surfaces(joint, True)
    _rub(joint, surfaces, direction, delta, angle_b, angle_j)
    off, journal = CLEARANCE + delta, RADIUS - CLEARANCE
    psi = math.acos((RADIUS**2 + off**2 - journal**2) / (2.0 * RADIUS * off))  # the two circles meet there
    sector = TURN / SECTORS
    for side, body in ((BUSHING, angle_b), (JOURNAL, angle_j)):
        profile = surfaces.depth[0, side]
        off = (np.arange(SECTORS) + 0.5) * sector + body - direction
        off = np.abs((off + math.pi) % TURN - math.pi)
        # the journal's sectors lie across the bushing's: one more may be touched at either end
        assert (profile[off > psi + 1.5 * sector] == 0.0).all()
        assert (profile[off < psi - 1.5 * sector] > 0.0).all()
        assert profile.min() >= 0.0


@given(direction=angles, delta=touches, angle_b=angles, angle_j=angles, turn=angles, seed=st.integers(0, 9))
def test_where_the_ground_lies_does_not_matter(joint, direction, delta, angle_b, angle_j, turn, seed):
    """Turn the whole joint: the profiles, which ride on the bodies, wear the same."""
    u = (direction - angle_b) * SECTORS / TURN
    assume(0.01 < u - math.floor(u) < 0.99)  # at a border rounding picks the sector
    here, there = _worn(seed), _worn(seed)
    _rub(joint, here, direction, delta, angle_b, angle_j)
    _rub(joint, there, direction + turn, delta, angle_b + turn, angle_j + turn)
    np.testing.assert_allclose(there.depth, here.depth, atol=1.0e-5 * here.depth.max())


@given(direction=angles, angle_b=angles, angle_j=angles, turn=angles, seed=st.integers(0, 9))
def test_local_surfaces_ride_on_the_bodies(joint, direction, angle_b, angle_j, turn, seed):
    surfaces = _worn(seed)
    here = local_surfaces(joint, surfaces, 0, direction, angle_b, angle_j)
    there = local_surfaces(joint, surfaces, 0, direction + turn, angle_b + turn, angle_j + turn)
    assert there[:2] == pytest.approx(here[:2], abs=1.0e-17 * SECTORS)
    assert there[2:4] == pytest.approx(here[2:4], abs=1.0e-17 * SECTORS**2)
    at = (direction - np.array([angle_b, angle_j])) * SECTORS / TURN
    if np.abs(at - np.round(at)).min() > 1.0e-6:  # at a sector's edge rounding decides on which side it is
        assert there[4:] == pytest.approx(here[4:], abs=1.0e-17 * SECTORS**3)
    assert here[0] - RADIUS == pytest.approx(profile_at(surfaces.depth[0, BUSHING], direction - angle_b)[0])
    assert RADIUS - CLEARANCE - here[1] == pytest.approx(
        profile_at(surfaces.depth[0, JOURNAL], direction - angle_j)[0]
    )


@given(direction=angles, seed=st.integers(0, 9))
def test_wear_that_does_not_feed_back_leaves_the_radii(joint, direction, seed):
    expected = (RADIUS, RADIUS - CLEARANCE, 0.0, 0.0, 0.0, 0.0)
    assert local_surfaces(joint, _worn(seed, 0), 0, direction, 0.3, -0.7) == expected


@given(angle=angles, seed=st.integers(0, 9))
def test_depth_is_periodic_between_its_neighbours_and_smooth(angle, seed):
    """A quadratic spline: inside its three sectors, its slope the derivative, exact where depth is linear."""
    profile = _worn(seed).depth[0, 0]
    i = math.floor(angle * SECTORS / TURN)
    near = profile[[(i - 1) % SECTORS, i % SECTORS, (i + 1) % SECTORS]]
    assert near.min() <= profile_at(profile, angle)[0] * (1.0 + 1.0e-12)
    assert profile_at(profile, angle)[0] <= near.max() * (1.0 + 1.0e-12)
    assert profile_at(profile, angle + TURN)[0] == pytest.approx(profile_at(profile, angle)[0], rel=1.0e-6)
    step = 1.0e-6
    rise = (profile_at(profile, angle + step)[0] - profile_at(profile, angle - step)[0]) / (2.0 * step)
    assert profile_at(profile, angle)[1] == pytest.approx(rise, abs=1.0e-9)
    if 0.01 < angle * SECTORS / TURN - i < 0.99:  # the second derivative is the sector's own
        bend = (profile_at(profile, angle + step)[1] - profile_at(profile, angle - step)[1]) / (2.0 * step)
        assert profile_at(profile, angle)[2] == pytest.approx(bend, rel=1.0e-6, abs=1.0e-9)
    ramp = np.arange(SECTORS) * 1.0e-9
    middle = math.pi + (angle % 1.0)
    assert profile_at(ramp, middle)[0] == pytest.approx((middle * SECTORS / TURN - 0.5) * 1.0e-9, rel=1.0e-9)


# The wear zone: the narrowest part of the circle that holds a fraction of the wear.


N = 72

profiles = arrays(float, N, elements=st.floats(0.0, 1.0).map(lambda x: round(x, 3))).filter(np.any)
fractions = st.floats(0.05, 1.0)


def _sectors(zone):
    start, end = zone[0] * N / 360.0, zone[1] * N / 360.0
    return np.arange(round(start), round(end)) % N


@given(depth=profiles, fraction=fractions)
def test_it_holds_the_share_and_nothing_narrower_does(depth, fraction):
    zone = wear_zone(depth, fraction)
    held = _sectors(zone)
    assert 0.0 <= zone[0] < 360.0
    assert zone[0] < zone[1] <= zone[0] + 360.0
    assert depth[held].sum() >= fraction * depth.sum() * (1.0 - 1.0e-9)
    narrower = [np.roll(depth, -start)[: len(held) - 1].sum() for start in range(N)]
    assert max(narrower) < fraction * depth.sum()


def test_no_zone_without_wear():
    assert wear_zone(np.zeros(N)) is None

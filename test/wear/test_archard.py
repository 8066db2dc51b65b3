"""Archard's law in a bushing under a force of one direction: a closed form.

The journal sinks into the bushing by h; the two circles meet at cos theta0 = c / (c + h), the worn area is
A(h) = 2 R ((c + h) sin theta0 - c theta0), and width A(h) = k F s.
"""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from leg_wear_monitor.wear import BUSHING, JOURNAL, SECTORS, deposit_wear, fresh_surfaces, profile_at

RADIUS, CLEARANCE, WIDTH = 0.010, 3.0e-4, 0.015
FORCE, WEAR = 100.0, 1.0e-13
PRESSED = 1.0e-7  # penetration of the journal, small beside every depth [m]
SECTOR = 2.0 * math.pi / SECTORS

# slid distance [m], depth [m], half arc [deg]
PUBLISHED = [
    (10.0, 3.3584e-6, 8.53),
    (100.0, 15.777e-6, 18.19),
    (1.0e3, 77.294e-6, 37.33),
    (1.0e4, 443.15e-6, 66.19),
]


@pytest.fixture(scope="module")
def contacts(bushing):
    """One clearance joint of which only the bushing wears."""
    return bushing((WEAR, 0.0))


def closed_form(distance):
    """Depth [m] and half arc [rad] after a distance [m]."""

    def missing(h):
        arc = math.acos(CLEARANCE / (CLEARANCE + h))
        area = 2.0 * RADIUS * ((CLEARANCE + h) * math.sin(arc) - CLEARANCE * arc)
        return WIDTH * area / (WEAR * FORCE) - distance

    h = brentq(missing, 1.0e-9, 5.0e-3, xtol=1.0e-15)
    return h, math.acos(CLEARANCE / (CLEARANCE + h))


def slid(contacts, distance, direction):
    """Surfaces after a distance of sliding with the journal at the local clearance in one direction."""
    surfaces, weight = fresh_surfaces(contacts, True), np.zeros(SECTORS)
    left = FORCE * distance
    while left > 0.0:
        e = CLEARANCE + profile_at(surfaces.depth[0, BUSHING], direction)[0] + PRESSED
        arc = max(math.acos(CLEARANCE / e), SECTOR)
        # as much as wears the arc about as deep as it is pressed
        bite = min(left, PRESSED * 2.0 * RADIUS * math.sin(arc) * WIDTH / WEAR)
        ex, ey = e * math.cos(direction), e * math.sin(direction)
        deposit_wear(contacts, surfaces, 0, ex, ey, 0.0, 0.0, bite, weight)
        left -= bite
    return surfaces.depth[0]


@pytest.mark.parametrize(("distance", "depth", "half_arc"), PUBLISHED)
def test_closed_form_as_published(distance, depth, half_arc):
    h, arc = closed_form(distance)
    assert h == pytest.approx(depth, rel=5.0e-5)
    assert math.degrees(arc) == pytest.approx(half_arc, abs=0.005)


@pytest.mark.parametrize("distance", [10.0, 100.0, 1.0e3, 1.0e4])
def test_worn_depth_is_the_closed_form(contacts, distance):
    """Within 1 % asked; 0.02 % and a sector at either end of the arc reached."""
    direction = 100.5 * SECTOR
    worn = slid(contacts, distance, direction)
    h, arc = closed_form(distance)
    assert worn[BUSHING].max() == pytest.approx(h, rel=1.0e-3)
    assert np.count_nonzero(worn[BUSHING]) * SECTOR == pytest.approx(2.0 * arc, abs=2.5 * SECTOR)
    assert not worn[JOURNAL].any()


def test_worn_profile_is_the_journals_own_shape(contacts):
    direction = 100.5 * SECTOR
    h, arc = closed_form(1.0e3)
    off = (np.arange(SECTORS) + 0.5) * SECTOR - direction
    shape = np.where(np.abs(off) < arc, (CLEARANCE + h) * np.cos(off) - CLEARANCE, 0.0)
    np.testing.assert_allclose(slid(contacts, 1.0e3, direction)[BUSHING], shape, atol=0.005 * h)


def test_direction_between_two_sectors_wears_as_deep(contacts):
    assert slid(contacts, 100.0, 100.0 * SECTOR)[BUSHING].max() == pytest.approx(
        closed_form(100.0)[0], rel=0.01
    )

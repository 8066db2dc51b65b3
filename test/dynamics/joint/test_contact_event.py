"""Contacts inside a step: where a free journal meets its bushing."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from leg_wear_monitor.contact.geometry import journal_contact
from leg_wear_monitor.dynamics.joint import DELTA, DELTA_DOT, NEVER, SAMPLE, first_contact_event

CLEARANCE = 3.0e-4


def _sample(ex, ey, vx, vy):
    """One joint as the integrators hand it over."""
    sample = np.zeros((SAMPLE, 1))
    delta, nx, ny = journal_contact(ex, ey, CLEARANCE)
    sample[DELTA, 0], sample[DELTA_DOT, 0] = delta, nx * vx + ny * vy
    return sample


@given(
    fraction=st.floats(0.0, 0.9), angle=st.floats(-4.0, 4.0), heading=st.floats(-1.2, 1.2),
    speed=st.floats(0.01, 5.0), reach=st.floats(0.0, 0.3),
)  # fmt: skip
def test_a_free_flight_touches_where_the_circle_is_met(fraction, angle, heading, speed, reach):
    """|e + v t| = c, a quadratic; the cubic through a short step's ends finds it.

    From a fraction of the clearance outwards, in a step that moves it by about reach c.
    """
    ex, ey = fraction * CLEARANCE * math.cos(angle), fraction * CLEARANCE * math.sin(angle)
    vx, vy = speed * math.cos(angle + heading), speed * math.sin(angle + heading)
    h = (reach + 1.0e-3) * CLEARANCE / speed
    along, square = ex * vx + ey * vy, ex * ex + ey * ey - CLEARANCE**2
    time = (-along + math.sqrt(along**2 - speed**2 * square)) / speed**2
    assume(abs(time / h - 1.0) > 1.0e-6)
    start, end = _sample(ex, ey, vx, vy), _sample(ex + vx * h, ey + vy * h, vx, vy)
    got = first_contact_event(np.zeros(1), h, start, end)
    if time > h:
        assert got == NEVER
    else:
        assert got == pytest.approx(time / h, abs=0.02)


def test_the_first_of_several_counts():
    start = np.hstack([_sample(fraction * CLEARANCE, 0.0, 1.0, 0.0) for fraction in (0.5, 0.9, 0.7)])
    h = 0.6 * CLEARANCE
    end = np.hstack([_sample((fraction + 0.6) * CLEARANCE, 0.0, 1.0, 0.0) for fraction in (0.5, 0.9, 0.7)])
    assert first_contact_event(np.zeros(3), h, start, end) == pytest.approx(0.1 / 0.6, rel=1.0e-6)
    assert first_contact_event(np.array([0.0, 1.0, 0.0]), h, start, end) == pytest.approx(0.5, rel=1.0e-6)


def test_a_touch_and_parting_inside_one_step_is_seen():
    """Penetration -1, 0.5, -1 um over the step: both ends are open."""
    start, end = np.zeros((SAMPLE, 1)), np.zeros((SAMPLE, 1))
    start[DELTA, 0], start[DELTA_DOT, 0] = -1.0e-6, 6.0
    end[DELTA, 0], end[DELTA_DOT, 0] = -1.0e-6, -6.0
    fraction = first_contact_event(np.zeros(1), 1.0e-6, start, end)
    assert 6.0 * fraction * (1.0 - fraction) == pytest.approx(1.0, rel=1.0e-9)

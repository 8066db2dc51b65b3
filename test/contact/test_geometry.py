"""Geometry and modulus of a journal in its bushing."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leg_wear_monitor.contact.geometry import contact_half_angle, contact_modulus, journal_contact

pytestmark = pytest.mark.plain

eccentricities = st.floats(-1.0e-3, 1.0e-3)


@given(ex=eccentricities, ey=eccentricities, clearance=st.floats(1.0e-5, 1.0e-3))
def test_penetration_is_the_eccentricity_less_the_clearance(ex, ey, clearance):
    delta, nx, ny = journal_contact(ex, ey, clearance)
    assert delta == pytest.approx(math.hypot(ex, ey) - clearance, abs=1.0e-18)
    assert math.hypot(nx, ny) == pytest.approx(1.0, abs=1.0e-9)
    assert (delta + clearance) * nx == pytest.approx(ex, abs=1.0e-15)
    assert (delta + clearance) * ny == pytest.approx(ey, abs=1.0e-15)


@given(gap=st.floats(0.0, 1.0), clearance=st.floats(1.0e-5, 1.0e-3))
def test_no_arc_without_contact(gap, clearance):
    assert contact_half_angle(gap * clearance * (1.0 - 1.0e-9), 0.01, 0.01 - clearance) == 0.0


@given(fraction=st.floats(1.0e-6, 1.0), clearance=st.floats(1.0e-5, 1.0e-3))
def test_the_two_circles_meet_at_the_ends_of_the_arc(fraction, clearance):
    bushing, journal = 0.01, 0.01 - clearance
    e = clearance * (1.0 + fraction)
    psi = contact_half_angle(e, bushing, journal)
    distance = math.hypot(bushing * math.cos(psi) - e, bushing * math.sin(psi))
    assert distance == pytest.approx(journal, rel=1.0e-9)


@given(delta=st.floats(1.0e-9, 1.0e-7))
def test_a_shallow_arc_is_the_root_of_two_delta_over_clearance(delta):
    clearance = 3.0e-4
    psi = contact_half_angle(clearance + delta, 0.01, 0.01 - clearance)
    assert psi == pytest.approx(math.sqrt(2.0 * delta / clearance), rel=0.05)


@given(soft=st.floats(1.0e8, 2.0e11), nu=st.floats(0.0, 0.5))
def test_modulus_does_not_ask_which_side_is_soft(soft, nu):
    assert contact_modulus(soft, nu, 2.07e11, 0.29) == pytest.approx(contact_modulus(2.07e11, 0.29, soft, nu))
    assert contact_modulus(soft, nu, 2.07e11, 0.29) < contact_modulus(soft, nu, np.inf, 0.29)

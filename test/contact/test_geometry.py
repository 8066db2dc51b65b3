"""Geometry and modulus of a journal in its bushing."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leg_wear_monitor.contact.arrays import contact_modulus, journal_contact

pytestmark = pytest.mark.plain

eccentricities = st.floats(-1.0e-3, 1.0e-3)


@given(ex=eccentricities, ey=eccentricities, clearance=st.floats(1.0e-5, 1.0e-3))
def test_penetration_is_the_eccentricity_less_the_clearance(ex, ey, clearance):
    delta, nx, ny = journal_contact(ex, ey, clearance)
    assert delta == pytest.approx(math.hypot(ex, ey) - clearance, abs=1.0e-18)
    assert math.hypot(nx, ny) == pytest.approx(1.0, abs=1.0e-9)
    assert (delta + clearance) * nx == pytest.approx(ex, abs=1.0e-15)
    assert (delta + clearance) * ny == pytest.approx(ey, abs=1.0e-15)


@given(soft=st.floats(1.0e8, 2.0e11), nu=st.floats(0.0, 0.5))
def test_modulus_does_not_ask_which_side_is_soft(soft, nu):
    assert contact_modulus(soft, nu, 2.07e11, 0.29) == pytest.approx(contact_modulus(2.07e11, 0.29, soft, nu))
    assert contact_modulus(soft, nu, 2.07e11, 0.29) < contact_modulus(soft, nu, np.inf, 0.29)

"""Hertz's force, by hand."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from leg_wear_monitor.contact.geometry import contact_modulus
from leg_wear_monitor.contact.normal import (
    HERTZ,
    LAWS,
    contact_stiffness,
    elastic_energy,
    elastic_force,
    law_coefficient,
    softening,
)

K = 6.6102e10
NUMBER = LAWS["hertz"].number


def test_stiffness_of_the_slider_crank():
    """Steel in steel, 10 mm, 0.5 mm clearance: 6.6102e10 N/m^1.5, by hand from physics.md section 4."""
    modulus = contact_modulus(2.07e11, 0.3, 2.07e11, 0.3)
    assert modulus == pytest.approx(4.0 / (3.0 * 2.0 * 0.91 / 2.07e11), rel=1.0e-12)
    assert contact_stiffness(modulus, 0.010, 0.0095) == pytest.approx(K, rel=1.0e-5)
    assert law_coefficient(NUMBER, 0.0, modulus, 0.02, 0.010, 0.0095) == pytest.approx(K, rel=1.0e-5)


@given(delta=st.floats(1.0e-6, 1.0e-3))
def test_force_and_energy_are_powers_of_the_penetration(delta):
    assert elastic_force(K, delta) == pytest.approx(K * delta**1.5, rel=1.0e-12)
    assert elastic_energy(NUMBER, K, 5.0e-4, delta) == pytest.approx(0.4 * K * delta**2.5, rel=1.0e-12)


def test_a_given_stiffness_does_not_follow_the_radii():
    assert HERTZ.takes_stiffness
    assert law_coefficient(NUMBER, K, 1.0e11, 0.02, 0.010, 0.0095) == K
    assert softening(NUMBER, K, 1.0e-5, 0.010, 0.0095, 1.0e-3, -1.0e-3) == (0.0, 0.0)


@given(soft=st.floats(1.0e8, 2.0e11), nu=st.floats(0.0, 0.5))
def test_modulus_does_not_ask_which_side_is_soft(soft, nu):
    assert contact_modulus(soft, nu, 2.07e11, 0.29) == pytest.approx(contact_modulus(2.07e11, 0.29, soft, nu))
    assert contact_modulus(soft, nu, 2.07e11, 0.29) < contact_modulus(soft, nu, math.inf, 0.29)

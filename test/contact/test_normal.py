"""Normal force: what every law has in common, and each one's damping."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leg_wear_monitor.contact.normal import (
    HYSTERESIS,
    elastic_energy,
    elastic_force,
    normal_force,
)
from leg_wear_monitor.mechanism.clearance import NORMAL_LAWS

pytestmark = pytest.mark.plain

K = 6.6e10

penetrations = st.floats(-1.0e-3, 1.0e-3)
rates = st.floats(-50.0, 50.0)
factors = st.floats(0.0, 20.0)
approaches = st.floats(1.0e-3, 10.0)


@given(delta=penetrations, rate=rates, chi=factors, approach=approaches)
def test_surfaces_never_pull(delta, rate, chi, approach):
    force = normal_force(K, chi, delta, rate, approach)
    assert force >= 0.0
    assert force == 0.0 or delta > 0.0


@given(delta=st.floats(1.0e-12, 1.0e-9), rate=rates, chi=factors, approach=approaches)
def test_force_begins_at_nothing(delta, rate, chi, approach):
    """Continuous where the surfaces meet, at any speed: the damping, too, starts from 0."""
    bound = K * delta**1.5 * (1.0 + chi * abs(rate) / approach)
    assert normal_force(K, chi, delta, rate, approach) <= bound * (1.0 + 1.0e-12)


@given(
    delta=st.floats(1.0e-9, 1.0e-3), chi=factors, approach=approaches, rate=rates, faster=st.floats(0.0, 10.0)
)
def test_approaching_is_harder_than_parting(delta, chi, approach, rate, faster):
    slow = normal_force(K, chi, delta, rate, approach)
    assert normal_force(K, chi, delta, rate + faster, approach) >= slow
    assert normal_force(K, chi, delta, 0.0, approach) == elastic_force(K, delta)


@given(delta=st.floats(1.0e-6, 1.0e-3))
def test_elastic_force_is_the_derivative_of_its_energy(delta):
    h = 1.0e-4 * delta
    slope = (elastic_energy(K, delta + h) - elastic_energy(K, delta - h)) / (2.0 * h)
    assert slope == pytest.approx(elastic_force(K, delta), rel=1.0e-6)
    assert elastic_force(K, delta) == pytest.approx(K * delta**1.5, rel=1.0e-12)


@given(delta=st.floats(-1.0e-3, 0.0))
def test_no_energy_without_contact(delta):
    assert elastic_energy(K, delta) == 0.0


@given(e=st.floats(0.01, 1.0))
def test_damping_of_each_law(e):
    """The factors of physics.md section 4 at the start of contact, where delta_dot is the approach speed."""
    wanted = {
        "hertz": 1.0,
        "hunt-crossley": 1.0 + 3.0 * (1.0 - e) / 2.0,
        "lankarani-nikravesh": 1.0 + 3.0 * (1.0 - e**2) / 4.0,
        "gonthier": 1.0 + (1.0 - e**2) / e,
        "flores": 1.0 + 8.0 * (1.0 - e) / (5.0 * e),
        "hu-guo": 1.0 + 3.0 * (1.0 - e) / (2.0 * e),
    }
    for name, factor in wanted.items():
        force = normal_force(K, HYSTERESIS[name](e), 1.0e-5, 2.0, 2.0)
        assert force == pytest.approx(factor * elastic_force(K, 1.0e-5), rel=1.0e-12)


def test_a_file_can_choose_every_law_and_no_other():
    assert set(NORMAL_LAWS) == set(HYSTERESIS)


@given(e=st.floats(0.01, 0.99))
def test_laws_agree_where_nothing_is_lost(e):
    assert all(math.isclose(law(1.0), 0.0, abs_tol=1.0e-15) for law in HYSTERESIS.values())
    assert all(law(e) > 0.0 for name, law in HYSTERESIS.items() if name != "hertz")
    assert np.isfinite([law(e) for law in HYSTERESIS.values()]).all()

"""Normal force: what laws of every form have in common, and each one's damping."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leg_wear_monitor.contact.geometry import contact_modulus
from leg_wear_monitor.contact.normal import LAWS, elastic_energy, law_coefficient, normal_force, softening
from leg_wear_monitor.mechanism import NORMAL_LAWS

MODULUS, WIDTH = contact_modulus(2.07e11, 0.29, 2.07e11, 0.29), 0.02
BUSHING, CLEARANCE = 0.01, 3.0e-4

forms = pytest.mark.parametrize("form", sorted({law.number for law in LAWS.values()}))
penetrations = st.floats(-1.0e-3, 1.0e-3)
rates = st.floats(-50.0, 50.0)
losses = st.floats(0.0, 2.0e2)


def coefficient_of(form, bushing=BUSHING, journal=BUSHING - CLEARANCE):
    return law_coefficient(form, 0.0, MODULUS, WIDTH, bushing, journal)


def force_of(form, loss, delta, rate):
    return normal_force(form, coefficient_of(form), CLEARANCE, loss, delta, rate)


def energy_of(form, delta, bushing=BUSHING, journal=BUSHING - CLEARANCE):
    return elastic_energy(form, coefficient_of(form, bushing, journal), bushing - journal, delta)


@forms
@given(delta=penetrations, rate=rates, loss=losses)
def test_surfaces_never_pull(form, delta, rate, loss):
    f_n, stiffness, damping, elastic = force_of(form, loss, delta, rate)
    assert f_n >= 0.0
    assert damping >= 0.0
    assert elastic == 0.0 if delta <= 0.0 else elastic >= 0.0
    assert f_n > 0.0 or (stiffness, damping) == (0.0, 0.0)


@forms
@given(rate=rates, loss=losses)
def test_force_begins_at_nothing(form, rate, loss):
    """Continuous where the surfaces meet, at any speed: the damping, too, starts from 0."""
    before = force_of(form, loss, 1.0e-12, rate)[0]
    assert before <= 1.0e-5 * force_of(form, loss, 1.0e-6, abs(rate))[0]


@forms
@given(delta=st.floats(1.0e-9, 1.0e-3), loss=losses, rate=rates, faster=st.floats(0.0, 10.0))
def test_approaching_is_harder_than_parting(form, delta, loss, rate, faster):
    assert force_of(form, loss, delta, rate + faster)[0] >= force_of(form, loss, delta, rate)[0]
    f_n, _, _, elastic = force_of(form, loss, delta, 0.0)
    assert f_n == elastic


@forms
@given(delta=st.floats(1.0e-7, 1.0e-3), loss=st.floats(0.0, 1.0e-2), rate=rates)
def test_stiffness_and_damping_are_the_force_s_derivatives(form, delta, loss, rate):
    """By central differences; what the implicit system of the clearance coordinates relies on."""
    h, dv = 1.0e-5 * delta, 1.0e-3

    def force(aside, faster):
        return force_of(form, loss, delta + aside, rate + faster)[0]

    _, stiffness, damping, _ = force_of(form, loss, delta, rate)
    by_delta, by_rate = (
        (force(h, 0.0) - force(-h, 0.0)) / (2 * h),
        (force(0.0, dv) - force(0.0, -dv)) / (2 * dv),
    )
    scale = force_of(form, 0.0, delta, 0.0)[0]
    assert stiffness == pytest.approx(by_delta, rel=1.0e-7, abs=1.0e-9 * scale / delta)
    assert damping == pytest.approx(by_rate, rel=1.0e-7, abs=1.0e-9 * scale)


@forms
@given(delta=st.floats(1.0e-7, 1.0e-3))
def test_elastic_force_is_the_derivative_of_its_energy(form, delta):
    h = 1.0e-4 * delta
    slope = (energy_of(form, delta + h) - energy_of(form, delta - h)) / (2.0 * h)
    assert slope == pytest.approx(force_of(form, 0.0, delta, 0.0)[0], rel=1.0e-6)


@forms
@given(delta=st.floats(1.0e-7, 1.0e-4), slope_b=st.floats(-1.0, 1.0), slope_j=st.floats(-1.0, 1.0))
def test_softening_is_what_deeper_wear_takes_from_the_energy(form, delta, slope_b, slope_j):
    """Wear widens the bushing and thins the journal."""
    h, journal = 1.0e-4 * CLEARANCE, BUSHING - CLEARANCE
    got = softening(form, 0.0, delta, BUSHING, journal, slope_b, slope_j)
    by_b = energy_of(form, delta, BUSHING - h) - energy_of(form, delta, BUSHING + h)
    by_j = energy_of(form, delta, BUSHING, journal + h) - energy_of(form, delta, BUSHING, journal - h)
    wanted = np.array([slope_b * by_b, slope_j * by_j]) / (2.0 * h * force_of(form, 0.0, delta, 0.0)[0])
    assert got == pytest.approx(wanted, rel=1.0e-4, abs=1.0e-7 * delta)


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
        law = LAWS[name]
        f_n, _, _, elastic = force_of(law.number, law.hysteresis(e) / 2.0, 1.0e-5, 2.0)
        assert f_n == pytest.approx(factor * elastic, rel=1.0e-12)


def test_a_file_can_choose_every_law_and_no_other():
    assert set(NORMAL_LAWS) == set(LAWS)


@given(e=st.floats(0.01, 0.99))
def test_laws_agree_where_nothing_is_lost(e):
    factors = {name: law.hysteresis for name, law in LAWS.items()}
    assert all(math.isclose(factor(1.0), 0.0, abs_tol=1.0e-15) for factor in factors.values())
    assert all(factor(e) > 0.0 for name, factor in factors.items() if name != "hertz")
    assert np.isfinite([factor(e) for factor in factors.values()]).all()

"""Normal force: Hertz, the damping of each law, and the restitution that it gives."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from leg_wear_monitor.contact.geometry import contact_modulus
from leg_wear_monitor.contact.laws import (
    HERTZ,
    LAWS,
    contact_stiffness,
    delivered_restitution,
    elastic_energy,
    elastic_force,
    law_coefficient,
    normal_force,
    softening,
)
from leg_wear_monitor.mechanism import NORMAL_LAWS

# Hertz's force, by hand.


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


# Normal force: what laws of every form have in common, and each one's damping.


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


# What each law returns of the speed of a mass that is dropped on it, against the closed form. For F =
# F_elastic (1 + chi delta_dot / approach), whatever F_elastic, mass and speed, the speed that comes out, as
# a share e of the one that went in, solves chi (1 + e) = ln((1 + chi) / (1 - chi e)).


ASKED = np.arange(0.05, 0.951, 0.05)

# delivered for 0.3, 0.5, 0.7, 0.9 asked, computed independently
PUBLISHED = {
    "lankarani-nikravesh": [0.6842, 0.7252, 0.7960, 0.9132],
    "hunt-crossley": [0.5813, 0.6630, 0.7680, 0.9090],
    "gonthier": [0.3042, 0.4877, 0.6696, 0.8764],
    "flores": [0.2562, 0.4704, 0.6832, 0.8939],
    "hu-guo": [0.2707, 0.4877, 0.6973, 0.8999],
}


def dropped(chi, speed=1.0, mass=0.14, form=NUMBER):
    """Share of its speed that a mass keeps through one contact, by integrating its motion.

    Time runs in units of the Hertz contact's own, length likewise, so that the tolerances fit any contact.
    """
    length = (mass * speed**2 / 6.6102e10) ** 0.4
    period = length / speed
    coefficient = law_coefficient(form, 0.0, contact_modulus(2.07e11, 0.3, 2.07e11, 0.3), 0.02, 0.01, 0.0095)

    def slope(_t, y):
        force = normal_force(form, coefficient, 5.0e-4, chi / speed, y[0] * length, y[1] * speed)[0]
        return [y[1], -force * period / (mass * speed)]

    def parts(_t, y):
        return y[0] if y[1] < 0.0 else 1.0

    parts.terminal, parts.direction = True, -1.0
    run = solve_ivp(slope, (0.0, 1.0e4), [0.0, 1.0], "DOP853", events=parts, rtol=1.0e-10, atol=1.0e-13)
    assert run.status == 1
    return -run.y[1, -1]


@pytest.mark.parametrize("law", LAWS)
def test_dropped_mass_returns_what_the_closed_form_says(law):
    for asked in ASKED:
        chi = LAWS[law].hysteresis(asked)
        returned = dropped(chi, form=LAWS[law].number)
        assert returned == pytest.approx(delivered_restitution(chi), abs=1.0e-6), asked


@given(chi=st.floats(0.01, 10.0), speed=st.floats(0.01, 10.0), mass=st.floats(0.01, 10.0))
def test_neither_mass_nor_speed_matter(chi, speed, mass):
    assert dropped(chi, speed, mass) == pytest.approx(delivered_restitution(chi), abs=1.0e-5)


@pytest.mark.parametrize("law", PUBLISHED)
def test_delivered_restitution_as_published(law):
    got = [delivered_restitution(LAWS[law].hysteresis(asked)) for asked in (0.3, 0.5, 0.7, 0.9)]
    assert got == pytest.approx(PUBLISHED[law], abs=5.1e-5)


@given(chi=st.floats(1.0e-3, 100.0))
def test_delivered_restitution_solves_its_equation(chi):
    e = delivered_restitution(chi)
    assert 0.0 < e < 1.0
    # both sides' exponential: the logarithm has its pole beside the root of strong damping
    assert 1.0 - chi * e == pytest.approx((1.0 + chi) * math.exp(-chi * (1.0 + e)), abs=1.0e-12)


def test_hertz_returns_everything():
    assert delivered_restitution(LAWS["hertz"].hysteresis(0.3)) == 1.0
    assert dropped(0.0) == pytest.approx(1.0, abs=1.0e-8)

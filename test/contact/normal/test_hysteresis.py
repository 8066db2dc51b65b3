"""What each law returns of the speed of a mass that is dropped on it, against the closed form.

For F = F_elastic (1 + chi delta_dot / approach), whatever F_elastic, mass and speed, the speed that comes
out, as a share e of the one that went in, solves chi (1 + e) = ln((1 + chi) / (1 - chi e)).
"""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from leg_wear_monitor.contact.geometry import contact_modulus
from leg_wear_monitor.contact.normal import LAWS, delivered_restitution, law_coefficient, normal_force

ASKED = np.arange(0.05, 0.951, 0.05)
HERTZ = LAWS["hertz"].number

# delivered for 0.3, 0.5, 0.7, 0.9 asked, computed independently
PUBLISHED = {
    "lankarani-nikravesh": [0.6842, 0.7252, 0.7960, 0.9132],
    "hunt-crossley": [0.5813, 0.6630, 0.7680, 0.9090],
    "gonthier": [0.3042, 0.4877, 0.6696, 0.8764],
    "flores": [0.2562, 0.4704, 0.6832, 0.8939],
    "hu-guo": [0.2707, 0.4877, 0.6973, 0.8999],
}


def dropped(chi, speed=1.0, mass=0.14, form=HERTZ):
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

"""Friction: against the slip, never more than Coulomb's, nothing at rest."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from leg_wear_monitor.contact.friction import (
    FRICTION_CODES,
    RAMPS,
    ambrosio_ramp,
    friction_force,
    threlfall_ramp,
)
from leg_wear_monitor.mechanism import FRICTION_LAWS

V0, V1 = 1.0e-3, 1.0e-2

laws = st.sampled_from(list(FRICTION_CODES.values()))
slips = st.floats(-1.0, 1.0)
loads = st.floats(0.0, 1.0e4)


@given(law=laws, mu=st.floats(0.0, 2.0), load=loads, slip=slips)
def test_friction_opposes_the_slip_and_keeps_below_coulomb(law, mu, load, slip):
    force = friction_force(law, mu, V0, V1, load, slip)
    assert force * slip <= 0.0
    assert abs(force) <= mu * load


@given(law=laws, load=loads, slip=slips)
def test_friction_is_odd(law, load, slip):
    assert friction_force(law, 0.1, V0, V1, load, -slip) == -friction_force(law, 0.1, V0, V1, load, slip)


@given(law=laws, load=loads, slip=st.floats(0.0, 1.0), more=st.floats(0.0, 1.0))
def test_ramps_rise_with_speed(law, load, slip, more):
    weak = friction_force(law, 0.1, V0, V1, load, slip)
    assert friction_force(law, 0.1, V0, V1, load, slip + more) <= weak


@given(slip=slips)
def test_a_ramp_of_no_width_is_coulomb(slip):
    fraction = ambrosio_ramp(abs(slip), V0, V0)
    assert fraction == (0.0 if abs(slip) <= V0 else 1.0)


def test_published_points_of_the_ramps():
    """Ambrosio's is 0 up to v0, 1 from v1, half way half; Threlfall's reaches 95 % at v1."""
    fractions = [ambrosio_ramp(v, V0, V1) for v in (0.0, V0, 0.5 * (V0 + V1), V1, 1.0)]
    assert fractions == pytest.approx([0.0, 0.0, 0.5, 1.0, 1.0])
    assert threlfall_ramp(V1, V0, V1) == pytest.approx(1.0 - math.exp(-3.0))
    assert threlfall_ramp(0.0, V0, V1) == 0.0


def test_a_file_can_choose_every_law_and_no_other():
    assert set(FRICTION_LAWS) == set(RAMPS)

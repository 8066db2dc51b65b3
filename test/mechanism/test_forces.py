"""Applied forces do what the energies say; loads follow their tables."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from leg_wear_monitor.mechanism.arrays import compile_arrays
from leg_wear_monitor.mechanism.constraints import (
    applied_forces,
    external_power,
    load_force,
    rotations,
    stored_energy,
)
from leg_wear_monitor.mechanism.loader import parse_mechanism

TURN = 2.0 * np.pi
PHASES = [0.05, 0.2, 0.6, 0.85]
FORCES = [[0.0, 100.0], [-30.0, 800.0], [60.0, 750.0], [0.0, 0.0]]
STEP = 1.0e-5

moving = arrays(float, (3, 3), elements=st.floats(-2.0, 2.0)).map(lambda rows: np.vstack([np.zeros(3), rows]))


@pytest.fixture(scope="module")
def pulled(document):
    """Arrays of the four-bar with everything that can pull at it, driven by a torque."""
    four_bar = document("four_bar")
    four_bar["drive"] = {"body": "crank", "torque": 0.7}
    up = {"bodies": ["ground", "coupler"], "points": ["D", "toe"], "stiffness": 300.0, "free_length": 0.1}
    across = {"bodies": ["rocker", "crank"], "points": ["C", "B"], "stiffness": 500.0, "free_length": 0.05}
    four_bar["springs"] = {"up": up | {"damping": 4.0}, "across": across}
    four_bar["loads"] = {
        "foot": {"body": "coupler", "point": "toe", "phase": PHASES, "force": FORCES},
        "push": {"body": "rocker", "point": "C", "force": [3.0, -5.0]},
    }
    return compile_arrays(parse_mechanism(four_bar, "four_bar"))


def _turned(q):
    cs = np.empty((len(q), 2))
    rotations(q, cs)
    return cs


def _power(mechanism, q, v):
    force = np.empty_like(q)
    applied_forces(mechanism, q, v, _turned(q), force)
    return (force * v).sum()


def _potential(mechanism, q):
    return stored_energy(mechanism, q, np.zeros_like(q), _turned(q))


@given(q=moving, v=moving)
def test_power_of_the_forces_is_that_from_outside_less_what_is_stored(pulled, q, v):
    """Gravity, springs, dampers, loads and torque together, whatever the position and velocity."""
    stored = (_potential(pulled, q + STEP * v) - _potential(pulled, q - STEP * v)) / (2.0 * STEP)
    outside = external_power(pulled, q, v, _turned(q))
    assert _power(pulled, q, v) == pytest.approx(outside - stored, rel=1.0e-6, abs=1.0e-5)


@given(q=moving, v=moving)
def test_kinetic_energy(pulled, q, v):
    kinetic = stored_energy(pulled, q, v, _turned(q)) - _potential(pulled, q)
    assert kinetic == pytest.approx(0.5 * (pulled.mass * v * v).sum(), abs=1.0e-9)


@given(phase=st.floats(-3.0, 3.0))
def test_load_is_linear_between_the_knots_and_periodic(pulled, phase):
    expected = [np.interp(phase % 1.0, PHASES, column, period=1.0) for column in zip(*FORCES, strict=True)]
    assert load_force(pulled, 0, TURN * phase) == pytest.approx(expected, abs=1.0e-7)

"""Closures and applied forces: each is the derivative that it should be."""

from collections.abc import Callable

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
from leg_wear_monitor.mechanism.position import Linkage, build_linkage, evaluate

# Closures: the Jacobian and gamma are the derivatives of phi, in any position whatever.


STEP = 1.0e-5

# the crank's pin drives a block along a swinging arm: a prismatic joint whose guide moves
QUICK_RETURN = {
    "name": "quick_return",
    "gravity": [0.0, -9.81],
    "ground": {"points": {"O": [0.0, 0.1], "P": [0.0, -0.2]}},
    "bodies": {
        "crank": {"mass": 0.5, "inertia": 1e-4, "com": [0.03, 0.01], "points": {"O": [0, 0], "A": [0.08, 0]}},
        "block": {"mass": 0.2, "inertia": 1e-5, "com": [0.01, 0.02], "points": {"A": [0, 0], "S": [0, -0.1]}},
        "arm": {"mass": 0.9, "inertia": 1e-2, "com": [0.2, 0.01], "points": {"P": [0, 0], "S": [0.02, 0.03]}},
    },
    "joints": {
        "O": {"bushing": "ground", "journal": "crank"},
        "A": {"bushing": "block", "journal": "crank"},
        "S": {"kind": "prismatic", "guide": "arm", "slider": "block", "axis": [1.0, 0.2]},
        "P": {"bushing": "ground", "journal": "arm"},
    },
    "drive": {"body": "crank", "speed": 10.0},
    "assembly": {"crank_angle": 0.0, "crank": [0, 0.1, 0], "block": [0.08, 0.1, 1.4], "arm": [0, -0.2, 1.3]},
}  # fmt: skip


@pytest.fixture(scope="module")
def any_linkage(linkage_of: Callable[[str], Linkage]) -> Callable[[str], Linkage]:
    quick_return = build_linkage(parse_mechanism(QUICK_RETURN, "quick_return"))
    return lambda name: quick_return if name == "quick_return" else linkage_of(name)


def coordinates(bodies: int) -> st.SearchStrategy[np.ndarray]:
    """Coordinates or velocities (n, 3) of every body; those of the ground are 0."""
    moving = arrays(float, (bodies - 1, 3), elements=st.floats(-3.0, 3.0))
    return moving.map(lambda rows: np.vstack([np.zeros(3), rows]))


@pytest.mark.parametrize("name", ["bionic_leg", "slider_crank", "quick_return"])
@given(st.data())
def test_jacobian_is_the_derivative_of_phi(any_linkage, name, data):
    linkage = any_linkage(name)
    q, w = (data.draw(coordinates(len(linkage.arrays.mass))) for _ in range(2))

    def phi(q: np.ndarray) -> np.ndarray:
        return evaluate(linkage, q, np.zeros_like(q), (0.3, 0.0, 0.0)).phi

    difference = (phi(q + STEP * w) - phi(q - STEP * w)) / (2.0 * STEP)
    jacobian = evaluate(linkage, q, np.zeros_like(q), (0.3, 0.0, 0.0)).jacobian
    np.testing.assert_allclose(difference, jacobian @ w[1:].ravel(), atol=1.0e-7)


@pytest.mark.parametrize("name", ["bionic_leg", "slider_crank", "quick_return"])
@given(st.data())
def test_gamma_is_what_the_acceleration_of_phi_lacks(any_linkage, name, data):
    """Phi'' = phi_q a - gamma: gamma is minus the derivative of phi_q v along v; the drive's is theta''."""
    linkage = any_linkage(name)
    q, v = (data.draw(coordinates(len(linkage.arrays.mass))) for _ in range(2))
    alpha = data.draw(st.floats(-100.0, 100.0))

    def rate(q: np.ndarray) -> np.ndarray:
        return evaluate(linkage, q, v, (0.0, 0.0, 0.0)).jacobian @ v[1:].ravel()

    difference = -(rate(q + STEP * v) - rate(q - STEP * v)) / (2.0 * STEP)
    difference[linkage.rows.drive_row] += alpha
    gamma = evaluate(linkage, q, v, (0.0, 0.0, alpha)).gamma
    np.testing.assert_allclose(difference, gamma, atol=1.0e-6)


# Applied forces do what the energies say; loads follow their tables.


TURN = 2.0 * np.pi
PHASES = [0.05, 0.2, 0.6, 0.85]
FORCES = [[0.0, 100.0], [-30.0, 800.0], [60.0, 750.0], [0.0, 0.0]]

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

"""Closures: the Jacobian and gamma are the derivatives of phi, in any position whatever."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from leg_wear_monitor.mechanism.loader import parse_mechanism
from leg_wear_monitor.mechanism.position import Linkage, build_linkage, evaluate

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

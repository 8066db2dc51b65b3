"""The integrator's own promises."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from leg_wear_monitor.dynamics.run import (
    STAGES,
    error_norm,
    hermite,
    next_step,
    stage_state,
)

coefficients = arrays(float, 4, elements=st.floats(-10.0, 10.0))


def _oscillator(steps):
    """Error of the unit circle's point at t = 2 after equal steps."""
    y, h, k = np.array([1.0, 0.0]), 2.0 / steps, np.zeros((STAGES, 2))
    for _ in range(steps):
        stage = np.empty(2)
        for s in range(STAGES):
            stage_state(s, h, y, k, stage)
            k[s] = stage[1], -stage[0]
        y = stage.copy()  # first same as last: the last stage is the step's end
    return np.hypot(y[0] - np.cos(2.0), y[1] + np.sin(2.0))


def test_order_is_five():
    assert np.log2(_oscillator(8) / _oscillator(16)) == pytest.approx(5.0, abs=0.3)


def test_error_estimate_is_of_order_five():
    """The estimate is the fourth-order solution's local error: 32 times less at half the step."""
    norms = []
    for h in (0.2, 0.1):
        k, stage = np.zeros((STAGES, 2)), np.empty(2)
        for s in range(STAGES):
            stage_state(s, h, np.array([1.0, 0.3]), k, stage)
            k[s] = stage[1], -stage[0]
        norms.append(error_norm(h, k, np.ones(2)))
    assert np.log2(norms[0] / norms[1]) == pytest.approx(5.0, abs=0.3)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_is_no_small_error(bad):
    k = np.zeros((STAGES, 3))
    k[2, 1] = bad
    assert error_norm(0.1, k, np.ones(3)) == np.inf
    assert next_step(0.1, np.inf, 5.0) < 0.1


@given(error=st.floats(0.0, 1.0e20), h=st.floats(1.0e-12, 1.0))
def test_step_shrinks_after_a_failure_and_grows_within_bounds(error, h):
    new = next_step(h, error, 5.0)
    assert 0.1 * h <= new <= 5.0 * h
    assert new < h or error <= 1.0


@given(c=coefficients, h=st.floats(1.0e-3, 10.0), u=st.floats(0.0, 1.0))
def test_hermite_reproduces_cubics(c, h, u):
    curve = np.polynomial.Polynomial(c)
    slope = curve.deriv()
    value, rate = hermite(u, h, curve(0.0), slope(0.0), curve(h), slope(h))
    size = 1.0 + np.abs(c).sum() * max(1.0, h) ** 3
    assert value == pytest.approx(curve(u * h), abs=1.0e-12 * size)
    assert rate == pytest.approx(slope(u * h), abs=1.0e-11 * size / h)

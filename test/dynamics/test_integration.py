"""Parts of the integration: solver, method, crank motion, control of the step, the ideal toe."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from leg_wear_monitor.dynamics.clearance.advance import inverse_cube_root
from leg_wear_monitor.dynamics.full_run import NO_TOE, factorise, ideal_toe, interpolate, substitute
from leg_wear_monitor.dynamics.run import (
    DEGREE,
    STAGES,
    drive_at,
    error_norm,
    hermite,
    next_step,
    stage_state,
)
from leg_wear_monitor.mechanism.position import TURN, ideal_motion, point_motion

# Cholesky inside an envelope gives what dense algebra gives.


@st.composite
def systems(draw):
    """First columns of an envelope, and a positive definite matrix that fills it."""
    m = draw(st.integers(1, 12))
    first = np.array([draw(st.integers(0, i)) for i in range(m)])
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    factor = np.tril(rng.uniform(-1.0, 1.0, (m, m)))
    factor[np.arange(m)[None, :] < first[:, None]] = 0.0
    np.fill_diagonal(factor, rng.uniform(0.5, 2.0, m))
    return first, factor @ factor.T, rng.uniform(-1.0, 1.0, m)


@given(systems())
def test_solution_is_numpys_and_nothing_outside_the_envelope_is_read(system):
    first, matrix, b = system
    lower, x = np.tril(matrix), b.copy()
    lower[np.arange(len(b))[None, :] < first[:, None]] = np.nan
    lower[np.triu_indices(len(b), 1)] = np.nan
    assert factorise(first, lower)
    substitute(first, lower, x)
    np.testing.assert_allclose(x, np.linalg.solve(matrix, b), rtol=1.0e-6, atol=1.0e-8)


@given(systems(), st.data())
def test_a_matrix_that_is_not_positive_definite_is_told(system, data):
    first, matrix, b = system
    lower = np.tril(matrix)
    i = data.draw(st.integers(0, len(b) - 1))
    lower[i, i] = -1.0e-9
    assert not factorise(first, lower)


# The integrator's own promises.


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


# The crank's polynomial and its derivatives.


@given(
    c=arrays(float, DEGREE + 1, elements=st.floats(-10.0, 10.0)),
    since=st.floats(-5.0, 5.0),
    t=st.floats(-5.0, 5.0),
)
def test_speed_and_acceleration_are_derivatives_of_the_angle(c, since, t):
    drive = np.empty(3)
    drive_at(np.array([since, *c]), t, drive)
    angle = np.polynomial.Polynomial(c)
    wanted = [curve(t - since) for curve in (angle, angle.deriv(), angle.deriv(2))]
    np.testing.assert_allclose(
        drive, wanted, rtol=1.0e-9, atol=1.0e-9 * (1.0 + np.abs(c).sum()) * 10.0**DEGREE
    )


# Control of the step.


@given(st.floats(-300.0, 300.0).map(lambda power: 10.0**power))
def test_the_inverse_cube_root(x):
    assert inverse_cube_root(x) ** 3 * x == pytest.approx(1.0, abs=4.0e-5)


# The ideal toe's table.


@pytest.fixture(scope="module")
def toe(linkage_of):
    return ideal_toe(linkage_of("bionic_leg"), TURN)


def test_between_its_points_the_table_is_the_ideal_motion(linkage_of, toe):
    linkage = linkage_of("bionic_leg")
    angles = np.linspace(0.3, 6.0, 17)
    motion = ideal_motion(linkage, angles, TURN)
    wanted = np.column_stack([*point_motion(motion, linkage, *linkage.mechanism.toe), motion.drive_torque])
    for column in range(7):
        got = [interpolate(toe.ideal, column, angle) for angle in angles]
        np.testing.assert_allclose(got, wanted[:, column], atol=1.0e-8 * np.ptp(toe.ideal[:, column]))


@pytest.mark.parametrize("turns", [-3, 0, 2])
def test_the_table_is_periodic_and_exact_at_its_points(toe, turns):
    n = len(toe.ideal)
    for i in (0, 1, n // 2, n - 1):
        got = interpolate(toe.ideal, 0, TURN * (turns + i / n))
        assert math.isclose(got, toe.ideal[i, 0], rel_tol=1.0e-10)


def test_nothing_to_compare_without_a_toe(linkage_of):
    assert ideal_toe(linkage_of("slider_crank"), 1.0) is NO_TOE

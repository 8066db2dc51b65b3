"""Cholesky inside an envelope gives what dense algebra gives."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from leg_wear_monitor.dynamics.full_model import factorise, substitute


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

"""Three levels in closed form: against the covariance matrix of all parts, and laws of the variances."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from leg_wear_monitor.fleet.learning import Evidence, Variances, predict, variances

pytestmark = pytest.mark.plain

VARIANCE = st.floats(0.001, 3.0)
PARTS = st.lists(
    st.tuples(st.integers(0, 4), st.floats(-3.0, 3.0), st.floats(0.03, 3.0)), min_size=2, max_size=12
)


def evidence_of(parts):
    """Parts (lot, mean, sigma) as evidence, and the same as arrays in its order."""
    lot, mean, sigma = (np.array(column) for column in zip(*sorted(parts), strict=True))
    precision = sigma**-2.0
    return Evidence(precision, precision * mean, np.unique(lot, return_inverse=True)[1]), lot, mean, sigma


def covariance(lot, pair, between_lots, between_parts):
    """Prior covariance of ln x of parts."""
    same = lot[:, None] == lot
    return pair + between_lots * same + between_parts * np.eye(len(lot))


def log_density(mean, matrix):
    """Of a normal distribution about 0, without its constant."""
    return -0.5 * (np.linalg.slogdet(matrix)[1] + mean @ np.linalg.solve(matrix, mean))


def conditional(mean, matrix, noise, i):
    """Mean and variance of ln x of a part, given the measured ones of all others."""
    others = np.arange(len(mean)) != i
    seen = matrix + np.diag(noise)
    gain = np.linalg.solve(seen[np.ix_(others, others)], matrix[others, i])
    return gain @ mean[others], matrix[i, i] - gain @ matrix[others, i]


@given(PARTS, VARIANCE, VARIANCE, VARIANCE)
def test_with_known_variances_it_is_the_conditional_normal_distribution(
    parts, pair, between_lots, between_parts
):
    evidence, lot, mean, sigma = evidence_of(parts)
    known = Variances(pair, np.array([between_lots]), np.array([between_parts]), np.zeros((1, 1)))
    found = predict(evidence, known)
    matrix = covariance(lot, pair, between_lots, between_parts)
    for i in range(len(parts)):
        expected, variance = conditional(mean, matrix, sigma**2, i)
        assert found.mean[i] == pytest.approx(expected, rel=1e-7, abs=1e-7)
        assert found.sigma[i] == pytest.approx(np.sqrt(variance), rel=1e-7)


@settings(max_examples=15)
@given(PARTS)
def test_variances_are_weighted_by_their_marginal_likelihood(parts):
    """A plain sum over the grid, each node with the density of all other parts under its covariance."""
    evidence, lot, mean, sigma = evidence_of(parts)
    grid = variances(0.7)
    found, i = predict(evidence, grid), len(parts) - 1
    others = np.arange(len(parts)) != i
    nodes = []
    for a, between_lots in enumerate(grid.lot):
        for b, between_parts in enumerate(grid.part):
            matrix = covariance(lot, grid.pair, between_lots, between_parts)
            seen = (matrix + np.diag(sigma**2))[np.ix_(others, others)]
            log_weight = grid.log_prior[a, b] + log_density(mean[others], seen)
            nodes.append((log_weight, *conditional(mean, matrix, sigma**2, i)))
    log_weight, centre, variance = (np.array(column) for column in zip(*nodes, strict=True))
    weight = np.exp(log_weight - log_weight.max())
    weight /= weight.sum()
    assert found.mean[i] == pytest.approx(weight @ centre, rel=1e-6, abs=1e-6)
    spread = weight @ (variance + (centre - weight @ centre) ** 2)
    assert found.sigma[i] == pytest.approx(np.sqrt(spread), rel=1e-6)


@given(st.floats(0.01, 3.0))
def test_without_evidence_the_prediction_is_the_configured_spread(sigma):
    found = predict(Evidence(np.zeros(3), np.zeros(3), np.array([0, 0, 1])), variances(sigma))
    np.testing.assert_allclose(found.mean, 0.0, atol=1e-12)
    np.testing.assert_allclose(found.sigma, sigma, rtol=1e-12)


@given(PARTS)
def test_a_part_without_evidence_changes_nothing_but_rounding(parts):
    evidence, *_ = evidence_of(parts)
    more = Evidence(*(np.append(each, 0.0) for each in (evidence.precision, evidence.pull)),
                    np.append(evidence.lot, evidence.lot[-1]))  # fmt: skip
    one, other = predict(evidence, variances(0.7)), predict(more, variances(0.7))
    # one more term changes how numpy groups its sums, and so the last bits
    np.testing.assert_allclose(other.mean[:-1], one.mean, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(other.sigma[:-1], one.sigma, rtol=1e-10)


def test_standard_deviations_of_lots_and_parts_are_found_in_many():
    random = np.random.default_rng(5)
    lot = np.repeat(np.arange(60), 20)
    level = 0.3 + 0.6 * random.standard_normal(60)
    mean = level[lot] + 0.15 * random.standard_normal(1200) + 0.05 * random.standard_normal(1200)
    precision = np.full(1200, 0.05**-2.0)
    found = predict(Evidence(precision, precision * mean, lot), variances(0.7))
    assert found.lot_sigma == pytest.approx(0.6, rel=0.25)
    assert found.part_sigma == pytest.approx(0.15, rel=0.1)

"""The wear of cycles that are not followed, and its standard error, on growth that is made up."""

import numpy as np
import pytest

from leg_wear_monitor.twin.sampling import Block, Condition, WearEstimate, student_quantile

SHAPE = (2, 2, 3)
SLOW, FAST = Condition(1, 100, 0), Condition(1, 110, 1)

pytestmark = pytest.mark.plain


def block(growth: np.ndarray) -> Block:
    """A block of some growths (n,); the second joint grows twice as fast, each evenly on both surfaces."""
    both = np.outer(growth, [1.0, 2.0])
    return Block(both, np.broadcast_to(0.5 * both.mean(axis=0)[:, None, None], SHAPE))


def opened(depth: np.ndarray) -> np.ndarray:
    """Mean clearances (k,) that wear depths open."""
    return depth.sum(axis=1).mean(axis=1)


def test_a_steady_growth_is_extrapolated_exactly():
    wear = WearEstimate(SHAPE)
    total = wear.end_block(SLOW, block(np.ones(20)))
    for _ in range(200):
        total = total + wear.pass_over(SLOW, 1.0)
    np.testing.assert_allclose(opened(total), [200.0, 400.0])
    assert wear.estimated_cycles == 200.0


def test_a_linear_drift_is_interpolated_exactly():
    wear, total = WearEstimate(SHAPE), np.zeros(SHAPE)
    growth = 1.0 + 1.0e-3 * np.arange(2200)
    for begin in range(0, 2200, 200):
        total = total + wear.end_block(SLOW, block(growth[begin : begin + 20]))
        if begin < 2000:
            total = total + wear.pass_over(SLOW, 180.0)
    expected = sum(growth[begin + 20 : begin + 200].sum() for begin in range(0, 2000, 200))
    np.testing.assert_allclose(opened(total)[0], expected, rtol=1e-9)


def test_each_condition_wears_as_its_own_blocks_do():
    wear, total = WearEstimate(SHAPE), np.zeros(SHAPE)
    total += wear.end_block(SLOW, block(np.ones(20)))
    total += wear.pass_over(FAST, 2.0)  # as the nearest, until it has a block
    assert opened(total)[0] == pytest.approx(2.0)
    total += wear.end_block(FAST, block(np.full(20, 5.0)))
    assert opened(total)[0] == pytest.approx(10.0)
    total += wear.pass_over(FAST, 10.0) + wear.pass_over(SLOW, 10.0)
    assert opened(total)[0] == pytest.approx(70.0)


def test_what_no_block_is_known_of_may_be_off_by_all():
    wear = WearEstimate(SHAPE)
    wear.end_block(SLOW, block(np.ones(20)))
    wear.pass_over(FAST, 50.0)
    assert wear.variance_m2[0] == pytest.approx(2500.0)


@pytest.mark.parametrize(("freedom", "quantile"), [(2, 4.3027), (3, 3.1824), (5, 2.5706), (20, 2.0860)])
def test_the_quantile_of_students_t(freedom, quantile):
    assert student_quantile(freedom) == pytest.approx(quantile, rel=0.02)


def bursts(rng: np.random.Generator, cycles: int) -> np.ndarray:
    """Growth of gait cycles: bursts that hang together, and a slow drift."""
    noise = np.zeros(cycles)
    for k in range(1, cycles):
        noise[k] = 0.5 * noise[k - 1] + rng.normal()
    return np.exp(0.3 * noise) * (1.0 + 0.2 * np.arange(cycles) / cycles)


@pytest.mark.parametrize("cycles", [1100, pytest.param(3600, marks=pytest.mark.slow)])
def test_95_percent_lie_within_the_stated_error(cycles):
    rng, held, offs = np.random.default_rng(1), 0, []
    is_fast = np.arange(cycles) // 500 % 2 == 0
    for _ in range(200):
        wear, total = WearEstimate(SHAPE), np.zeros(SHAPE)
        growth = bursts(rng, cycles) * np.where(is_fast, 1.5, 1.0)
        passed, k = 0.0, 0
        while k < cycles:
            end, until = min(k + 20, cycles), min(k + int(rng.integers(120, 280)), cycles)
            for condition, own in ((FAST, is_fast), (SLOW, ~is_fast)):
                if own[k:end].any():
                    total += wear.end_block(condition, block(growth[k:end][own[k:end]]))
                total += wear.pass_over(condition, float(own[end:until].sum()))
            passed += growth[end:until].sum()
            k = until
        off = opened(total)[0] - passed
        held += abs(off) <= 1.96 * np.sqrt(wear.variance_m2[0])
        offs.append(off / passed)
    assert held >= 180  # of 200 with a probability of 0.95, fewer come once in a thousand times
    assert abs(np.mean(offs)) < 4.0 * np.std(offs) / np.sqrt(200.0)

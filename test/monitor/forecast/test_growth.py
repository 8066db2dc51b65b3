"""Growth: exact for even growth, honest about scatter, silent without enough data."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leg_wear_monitor.monitor.forecast.growth import (
    LEAST_CYCLES,
    GrowthWindow,
    extended,
    growth_rate,
)

pytestmark = pytest.mark.plain


def window(growths, moving_s=1.0, cycles=30):
    found = GrowthWindow()
    for growth in growths:
        found = extended(found, growth, moving_s, cycles)
    return found


@given(st.floats(1e-15, 1e-6), st.floats(0.1, 10.0), st.integers(LEAST_CYCLES, 60))
def test_even_growth_is_known_exactly(growth, period_s, n):
    rate = growth_rate(window([growth] * n, period_s))
    assert rate.per_cycle_m == pytest.approx(growth, rel=1e-12)
    assert rate.per_second_m == pytest.approx(growth / period_s, rel=1e-12)
    assert rate.error_m == pytest.approx(0.0, abs=1e-12 * growth)


@given(st.integers(0, LEAST_CYCLES - 1))
def test_too_few_cycles_are_not_enough(n):
    assert growth_rate(window([1.0e-12] * n)) is None


def test_scatter_as_large_as_the_mean_is_not_enough():
    growths = np.zeros(30)
    growths[7] = 1.0e-12
    assert growth_rate(window(growths)) is None


def test_no_wear_is_a_rate_of_zero():
    rate = growth_rate(window([0.0] * 30))
    assert rate.per_cycle_m == 0.0


def test_only_the_last_cycles_count():
    growths = [5.0e-12] * 40 + [1.0e-12] * 30
    assert growth_rate(window(growths)).per_cycle_m == pytest.approx(1.0e-12)


@given(st.lists(st.floats(1e-14, 1e-9), min_size=LEAST_CYCLES, max_size=60))
def test_what_is_said_adds_up(growths):
    found = window(growths, cycles=100)
    rate = growth_rate(found)
    if rate is not None:
        assert rate.per_cycle_m * len(growths) == pytest.approx(sum(growths), rel=1e-9)


def test_the_stated_error_holds_for_scattering_cycles():
    """Of many windows of log-normal growth, nearly all lie within three stated errors of the truth."""
    random = np.random.default_rng(7)
    true = np.exp(0.5 * 0.4**2)
    rates = [growth_rate(window(np.exp(0.4 * random.standard_normal(30)))) for _ in range(400)]
    off = [abs(rate.per_cycle_m - true) / rate.error_m for rate in rates]
    # five batches leave four degrees of freedom: Student's t is beyond 3 in 4.0 %
    assert 0.01 < np.mean(np.array(off) > 3.0) < 0.09

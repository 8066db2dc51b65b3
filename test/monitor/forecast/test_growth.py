"""Growth: exact for even growth, honest about scatter, silent without enough data."""

from statistics import NormalDist

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leg_wear_monitor.monitor.forecast.growth import (
    LEAST_CYCLES,
    GrowthRate,
    GrowthWindow,
    extended,
    growth_rate,
)

P90 = NormalDist().inv_cdf(0.9)


def window(growths, moving_s=1.0, cycles=30):
    found = GrowthWindow()
    for growth in growths:
        found = extended(found, growth, moving_s, cycles)
    return found


@given(st.just(0.0) | st.floats(1e-15, 1e-6), st.floats(0.1, 10.0), st.integers(LEAST_CYCLES, 60))
def test_even_growth_is_known_exactly(growth, period_s, n):
    rate = growth_rate(window([growth] * n, period_s))
    assert rate.per_cycle_m == pytest.approx(growth, rel=1e-12)
    assert rate.per_second_m == pytest.approx(growth / period_s, rel=1e-12)
    assert rate.sampling_m == pytest.approx(0.0, abs=1e-12 * growth)
    assert rate.error_m(0.03) == pytest.approx(0.03 * growth)  # a model that is off remains


@given(st.integers(0, LEAST_CYCLES - 1))
def test_too_few_cycles_are_not_enough(n):
    assert growth_rate(window([1.0e-12] * n)) is None


def test_scatter_as_large_as_the_mean_is_not_enough():
    growths = np.zeros(30)
    growths[7] = 1.0e-12
    assert growth_rate(window(growths)) is None


def test_only_the_last_cycles_count():
    growths = [5.0e-12] * 40 + [1.0e-12] * 30
    assert growth_rate(window(growths)).per_cycle_m == pytest.approx(1.0e-12)


@given(st.lists(st.floats(1e-14, 1e-9), min_size=LEAST_CYCLES, max_size=60))
def test_what_is_said_adds_up(growths):
    found = window(growths, cycles=100)
    rate = growth_rate(found)
    if rate is not None:
        assert rate.per_cycle_m * len(growths) == pytest.approx(sum(growths), rel=1e-9)


def covered(random, correlation, cycles, legs=1500):
    """Fraction of 80 % intervals that hold the truth, 1: growth that hangs together from cycle to cycle."""
    scatter = random.standard_normal((legs, cycles))
    for i in range(1, cycles):
        scatter[:, i] = correlation * scatter[:, i - 1] + (1.0 - correlation**2) ** 0.5 * scatter[:, i]
    rates = [growth_rate(GrowthWindow(1.0 + 0.15 * row, np.ones(cycles))) for row in scatter]
    return np.mean([abs(rate.per_cycle_m - 1.0) <= P90 * rate.error_m(0.0) for rate in rates])


# a fraction of 0.8 of 1500 scatters by 0.0103; batches are long enough for cycles that hang together
@pytest.mark.parametrize(("correlation", "cycles"), [(0.0, 10), (0.0, 30), (0.3, 60), (0.6, 300)])
def test_an_interval_of_80_percent_holds_the_truth_in_80_percent(correlation, cycles):
    assert covered(np.random.default_rng(7), correlation, cycles) == pytest.approx(0.8, abs=4.0 * 0.0103)


def test_the_interval_narrows_with_the_square_root_of_the_window():
    random = np.random.default_rng(8)

    def width(cycles):
        growth = 1.0 + 0.15 * random.standard_normal((400, cycles))
        return np.mean([growth_rate(GrowthWindow(row, np.ones(cycles))).sampling_m for row in growth])

    # 400 standard errors of four degrees of freedom: each scatters by 0.36, their mean by 0.018
    assert width(30) / width(270) == pytest.approx(3.0, rel=4.0 * 0.018 * 2.0**0.5)


def test_scatter_and_model_are_independent():
    rate = GrowthRate(per_cycle_m=1.0e-11, sampling_m=3.0e-13, per_second_m=1.0e-11)
    assert rate.error_m(0.04) == pytest.approx(5.0e-13)

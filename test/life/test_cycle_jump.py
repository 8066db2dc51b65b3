"""Cycle jumps: smoothing keeps volume, errors see through scatter, jumps stay within their bounds."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leg_wear_monitor.life.life import (
    WearRate,
    jump_error,
    longest_jump,
    next_jump,
    smoothed,
    wear_rate,
)

SECTORS = 90


def rate(growth, scatter=0.0):
    """A rate at which one joint's bushing wears evenly."""
    depth = np.zeros((1, 2, SECTORS))
    depth[0, 0] = growth
    return WearRate(depth, np.array([scatter]))


@given(st.lists(st.floats(0.0, 1e-9), min_size=SECTORS, max_size=SECTORS), st.floats(0.0, 60.0))
def test_smoothing_keeps_the_volume_and_takes_nothing_back(profile, width):
    before = np.array(profile)
    after = smoothed(before, width)
    assert after.min() >= 0.0
    assert after.sum() == pytest.approx(before.sum(), rel=1e-12, abs=1e-24)


def test_smoothing_by_nothing_changes_nothing_and_turns_with_the_profile():
    profile = np.random.default_rng(1).random(SECTORS)
    np.testing.assert_allclose(smoothed(profile, 0.0), profile, rtol=1e-12)
    np.testing.assert_allclose(
        np.roll(smoothed(profile, 9.0), 7), smoothed(np.roll(profile, 7), 9.0), rtol=1e-9
    )


def test_a_rate_is_the_mean_and_its_scatter_falls_with_the_number_of_cycles():
    chance = np.random.default_rng(2)
    worn = 1e-9 + 1e-10 * chance.standard_normal((400, 1, 2, 1)) * np.ones((1, 1, 1, SECTORS))
    few, many = wear_rate(worn[:25], 0.0), wear_rate(worn, 0.0)
    assert many.clearance[0] == pytest.approx(2e-9, rel=0.02)
    assert few.scatter[0] / many.scatter[0] == pytest.approx(4.0, rel=0.4)


def test_no_jump_goes_deeper_than_it_may():
    assert longest_jump(rate(2e-9), 1e-5) == pytest.approx(5000.0)
    assert longest_jump(rate(0.0), 1e-5) == np.inf


def test_scatter_alone_is_no_error():
    assert jump_error(rate(1e-9, 1e-10), rate(1.1e-9, 1e-10), 1000.0)[0] == 0.0
    assert jump_error(rate(1e-9), rate(1.1e-9), 1000.0)[0] == pytest.approx(0.5e-7)


@given(st.floats(1.0, 1e6), st.floats(0.0, 1e-3))
def test_a_jump_shrinks_beyond_its_tolerance_and_changes_by_bounded_factors(cycles, error):
    tolerance = 1e-6
    after = next_jump(cycles, error, tolerance)
    assert 0.29 * cycles <= after <= 2.01 * cycles
    if error > tolerance:
        assert after < cycles

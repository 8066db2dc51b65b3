"""Sums of a run against numpy's on the same samples."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from leg_wear_monitor.dynamics.run import (
    DRIVE_RATES,
    FORCE,
    JOINT_RATES,
    TORQUE,
    add_step,
    begin_impact,
    bin_of,
    end_impact,
    new_run_statistics,
    parabola_peak,
    percentile,
    raise_peak,
    signed_percentile,
)

BIN = 1.0085  # ratio of two bins' magnitudes

magnitudes = arrays(float, st.integers(1, 200), elements=st.floats(1.0e-3, 1.0e5))
signed = st.tuples(st.sampled_from([-1.0, 1.0]), st.floats(1.0e-3, 1.0e5)).map(np.prod)
fractions = st.floats(0.0, 1.0, exclude_min=True)


def _histogram(samples):
    """Equal time at each sample."""
    seconds = np.zeros(new_run_statistics(1).force_time.shape[1])
    for sample in samples:
        seconds[bin_of(sample)] += 0.001
    return seconds


@given(samples=magnitudes, fraction=fractions)
def test_percentile_divides_the_time_to_the_width_of_a_bin(samples, fraction):
    got = percentile(_histogram(samples), fraction)
    assert np.mean(samples <= got * BIN) >= fraction - 1.0e-9
    assert np.mean(samples < got / BIN) <= fraction + 1.0e-9


@given(samples=st.lists(signed, min_size=2, max_size=60).map(np.array), fraction=fractions)
def test_signed_percentile_divides_the_time_too(samples, fraction):
    below, above = -samples[samples < 0.0], samples[samples > 0.0]
    got = signed_percentile(np.array([_histogram(below), _histogram(above)]), fraction)
    slack = (BIN - 1.0) * abs(got)
    assert np.mean(samples <= got + slack) >= fraction - 1.0e-9
    assert np.mean(samples < got - slack) <= fraction + 1.0e-9


def test_percentile_of_nothing_is_nothing():
    assert percentile(_histogram([]), 0.99) == 0.0
    assert signed_percentile(np.zeros((2, 16)), 0.99) == 0.0


@given(rates=arrays(float, (4, 2, JOINT_RATES), elements=st.floats(0.0, 1.0e3)), h=st.floats(1.0e-9, 1.0e-3))
def test_a_step_adds_its_quadrature_and_its_end(rates, h):
    statistics, weights = new_run_statistics(2), np.array([0.5, 0.0, 0.3, 0.2])
    drive = -rates[:, 0, :DRIVE_RATES]
    for _ in range(2):
        add_step(statistics, h, weights, rates, drive)
    assert statistics.time[0] == pytest.approx(2.0 * h)
    mean = np.tensordot(weights, rates, axes=1)
    np.testing.assert_allclose(statistics.integral, 2.0 * h * mean, atol=1.0e-15)
    np.testing.assert_allclose(statistics.drive_integral, 2.0 * h * (weights @ drive), atol=1.0e-15)
    np.testing.assert_array_equal(statistics.peak, rates[-1, :, FORCE])
    np.testing.assert_array_equal(statistics.drive_range, drive[-1, TORQUE])
    assert statistics.force_time.sum(axis=1) == pytest.approx(2.0 * h)
    assert statistics.torque_time.sum() == pytest.approx(2.0 * h)


@given(
    apex=st.floats(-1.0, 1.0), top=st.floats(-1.0e4, 1.0e4), sharp=st.floats(0.1, 1.0e4),
    before=st.floats(0.11, 1.0), gap=st.floats(0.11, 1.0), fraction=st.floats(0.0, 1.0),
)  # fmt: skip
def test_peak_of_a_parabola_is_exact(apex, top, sharp, before, gap, fraction):
    """Three samples of which the middle one is largest, wherever the apex lies among them."""
    middle = apex + (fraction - 0.5) * min(before, gap)
    t = np.array([middle - before, middle, middle + gap])
    f = top - sharp * (t - apex) ** 2
    got = parabola_peak(t[0], f[0], t[1], f[1], t[2], f[2])
    assert got == pytest.approx(top, abs=1.0e-9 * (abs(top) + np.abs(f).max() + sharp / min(before, gap)))


@given(
    start=st.floats(0.0, 5.0e3), jump=st.floats(0.0, 50.0), end=st.floats(0.0, 5.0e3),
    long=st.floats(1.0e-7, 1.0e-3), ratio=st.floats(1.0e-9, 1.0), earlier=st.booleans(),
)  # fmt: skip
def test_a_jump_over_a_short_step_is_no_peak(start, jump, end, long, ratio, earlier):
    """Deposited wear lowers the force at once; the peak stays at the samples' size for any two steps."""
    middle, short = max(start, end) + jump, long * ratio
    first, second = (long, short) if earlier else (short, long)
    peak = parabola_peak(0.0, start, first, middle, first + second, end)
    assert middle <= peak <= middle + 3.0 * (middle - min(start, end))


def test_three_samples_in_a_line_have_no_other_peak():
    assert parabola_peak(0.0, 2.0, 1.0, 2.0, 2.0, 2.0) == 2.0


def test_an_impact_is_noted_from_begin_to_end():
    statistics = new_run_statistics(2)
    impact, impacts = statistics.impact, statistics.impacts
    begin_impact(impact, impacts, 1, 0.1, 0.5)
    raise_peak(statistics.peak, impact, impacts, 1, 30.0)
    raise_peak(statistics.peak, impact, impacts, 1, 20.0)
    assert np.isnan(impact[1, 0, 2])
    end_impact(impact, impacts, 1, 0.2)
    raise_peak(statistics.peak, impact, impacts, 1, 99.0)  # no contact any more: the impact keeps its peak
    end_impact(impact, impacts, 1, 0.3)
    np.testing.assert_array_equal(impact[1, 0], [0.1, 0.5, 0.2, 30.0])
    assert list(impacts) == [0, 1]


def test_impacts_beyond_the_room_are_counted():
    statistics = new_run_statistics(1)
    room = statistics.impact.shape[1]
    for i in range(room + 5):
        begin_impact(statistics.impact, statistics.impacts, 0, float(i), 1.0)
        end_impact(statistics.impact, statistics.impacts, 0, i + 0.5)
    assert statistics.impacts[0] == room + 5
    assert statistics.impact[0, -1, 0] == room - 1.0

"""Pairs of numbers in compiled code, and without a compiler: the same numbers."""

import numpy as np
import pytest

from leg_wear_monitor import pairs
from leg_wear_monitor.kernel import entry
from leg_wear_monitor.pairs import pair_at, pair_sum, put_pair


@entry
def along(scale, a, b, out):
    """Out = b + scale a - a b in both rows; returns the sum of the products in row 1."""
    total = pair_at(a, 1, 0) * pair_at(b, 1, 0)
    for i in range(2, a.shape[1], 2):
        total += pair_at(a, 1, i) * pair_at(b, 1, i)
    for row in range(2):
        for i in range(0, a.shape[1], 2):
            value = pair_at(b, row, i) + scale * pair_at(a, row, i)
            value -= pair_at(a, row, i) * pair_at(b, row, i)
            put_pair(out, row, i, value)
    return pair_sum(total)


@pytest.mark.parametrize("width", [2, 10, 14])
def test_pairs_are_the_numbers_one_by_one(width):
    random = np.random.default_rng(1)
    a, b, out = random.normal(size=(3, 2, width))
    total = along(0.3, a, b, out)
    np.testing.assert_array_equal(out, (b + 0.3 * a) - a * b)
    assert total == pytest.approx(a[1] @ b[1], rel=1.0e-13)


def test_a_row_that_starts_at_any_number():
    """Tables are views into one array: a pair need not start at a multiple of its own length."""
    flat = np.arange(13.0)
    a, out = flat[1:13].reshape(2, 6), np.zeros((2, 6))
    along(2.0, a, np.ones((2, 6)), out)
    np.testing.assert_array_equal(out, 1.0 + 2.0 * a - a)


def test_without_a_compiler():
    x = np.arange(8.0).reshape(2, 4)
    pairs._stored(x, 0, 2, pairs._loaded(x, 1, 0) + 2.0 * pairs._loaded(x, 1, 2))
    np.testing.assert_array_equal(x[0], [0.0, 1.0, 16.0, 19.0])
    assert pairs._summed(pairs._loaded(x, 0, 2)) == 35.0

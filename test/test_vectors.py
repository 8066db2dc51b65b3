"""Vectors in compiled code, and without a compiler: the same numbers."""

import math

import numpy as np
import pytest

from leg_wear_monitor.compiled import vector_kinds
from leg_wear_monitor.compiled.kernel import entry, kernel
from leg_wear_monitor.compiled.vectors import (
    WIDTH,
    any_of,
    bits_of,
    entry_of,
    evens,
    every,
    largest,
    number_of,
    odds,
    only,
    padded,
    part_at,
    put_part,
    put_vector,
    root,
    vector_at,
    vector_max,
    vector_sum,
    where,
    with_entry,
    zip_first,
    zip_last,
)


@entry
def along(scale, a, b, out):
    """Out = b + scale a - a b in both rows; returns the sum and the maximum of the products in row 1."""
    total, most = every(0.0), every(-math.inf)
    for i in range(0, a.shape[1], WIDTH):
        product = part_at(a, (1, i)) * part_at(b, (1, i))
        total += product
        most = largest(most, product)
    for row in range(2):
        for i in range(0, a.shape[1], WIDTH):
            value = part_at(b, (row, i)) + scale * part_at(a, (row, i))
            value -= part_at(a, (row, i)) * part_at(b, (row, i))
            put_part(out, (row, i), value)
    return vector_sum(total), vector_max(most)


@pytest.mark.parametrize("width", [2, 8, 10, 20])
def test_vectors_are_the_numbers_one_by_one(width):
    random = np.random.default_rng(1)
    a, b, out = random.normal(size=(3, 2, width))
    total, most = along(0.3, a, b, out)
    np.testing.assert_array_equal(out, (b + 0.3 * a) - a * b)
    assert total == pytest.approx(a[1] @ b[1], rel=1.0e-12)
    largest_of_row = (a[1] * b[1]).max()
    assert most == (max(0.0, largest_of_row) if width % WIDTH else largest_of_row)


def test_a_row_that_starts_at_any_number_and_a_store_that_stays_inside():
    """Tables are views into one array: a vector need not start at a multiple of its own length."""
    flat = np.arange(23.0)
    a, whole = flat[1:23].reshape(2, 11), np.zeros((3, 11))
    along(2.0, a, np.ones((2, 11)), whole[:2])
    np.testing.assert_array_equal(whole[:2], 1.0 + 2.0 * a - a)
    assert not whole[2].any()


@entry
def shuffled(x, out):
    a, b = vector_at(x, 0), vector_at(x, WIDTH)
    put_vector(out, (0, 0), evens(a, b))
    put_vector(out, (1, 0), odds(a, b))
    put_vector(x, 0, zip_first(evens(a, b), odds(a, b)))
    put_vector(x, WIDTH, zip_last(evens(a, b), odds(a, b)))
    put_vector(out, (2, 0), with_entry(a, 3, 7.5))
    put_vector(out, (3, 0), only(entry_of(b, 2), 5))
    return any_of(a > 6.5), any_of(a > 7.5)


def test_entries():
    x, out = np.arange(16.0), np.zeros((4, WIDTH))
    assert shuffled(x, out) == (True, False)
    np.testing.assert_array_equal(x, np.arange(16.0))
    np.testing.assert_array_equal(out[0], x[::2])
    np.testing.assert_array_equal(out[1], x[1::2])
    np.testing.assert_array_equal(out[2], [0, 1, 2, 7.5, 4, 5, 6, 7])
    np.testing.assert_array_equal(out[3], [0, 0, 0, 0, 0, 10, 0, 0])


@kernel
def formula(a, b):
    """Of numbers or of vectors."""
    return where((a > b) & (b >= -0.5), -root(abs(a)), 2.0 - largest(a, 0.25) / (1.0 + b * b))


@entry
def formulas(a, b, out_vector, out_number):
    put_vector(out_vector, 0, formula(vector_at(a, 0), vector_at(b, 0)))
    for i in range(a.shape[0]):
        out_number[i] = formula(a[i], b[i])


def test_one_formula_for_numbers_and_vectors():
    random = np.random.default_rng(2)
    a, b, found, expected = random.normal(size=(4, WIDTH))
    formulas(a, b, found, expected)
    np.testing.assert_array_equal(found, expected)
    plain = np.where((a > b) & (b >= -0.5), -np.sqrt(abs(a)), 2.0 - np.maximum(a, 0.25) / (1.0 + b * b))
    np.testing.assert_array_equal(found, plain)


@entry
def widened(x, out):
    put_vector(out, 0, part_at(x, (1, 1, 2)))


def test_single_precision_rows_of_three_dimensions():
    x, out = np.arange(24.0, dtype=np.float32).reshape(2, 3, 4), np.full(WIDTH, 9.0)
    widened(x, out)
    np.testing.assert_array_equal(out, [18.0, 19.0, 0, 0, 0, 0, 0, 0])


@entry
def there_and_back(number):
    whole = bits_of(number)
    return whole, number_of(whole)


@pytest.mark.parametrize("number", [0.0, 1.0, -2.5, 1.0e-300, math.pi, math.inf])
def test_bits(number):
    assert there_and_back(number) == (int(np.float64(number).view(np.int64)), number)


@pytest.mark.parametrize(("count", "room"), [(0, 0), (1, 8), (8, 8), (9, 16)])
def test_padded(count, room):
    assert padded(count) == room


def test_without_a_compiler():
    x = np.arange(8.0).reshape(2, 4)
    vector_kinds.stored(x, (0, 2), vector_kinds.loaded(x, (1, 0)) + 2.0 * vector_kinds.loaded(x, (1, 2)))
    np.testing.assert_array_equal(x[0], [0.0, 1.0, 16.0, 19.0])
    assert vector_kinds.folded(vector_kinds.loaded(x, (0, 2)), np.add) == 35.0
    assert vector_kinds.chosen(True, 1.0, 2.0) == 1.0
    assert vector_kinds.root_of(4.0) == 2.0

"""The ensemble's draws: even in each dimension, and in every two of them."""

import numpy as np
import pytest

from leg_wear_monitor.monitor.forecast.forecast import MEMBERS, even_fractions, even_normals

pytestmark = pytest.mark.plain


def test_each_dimension_has_the_same_evenly_spaced_numbers():
    even = (np.arange(MEMBERS) + 0.5) / MEMBERS
    np.testing.assert_allclose(np.sort(even_fractions(17), axis=1), np.tile(even, (17, 1)))
    assert abs(even_normals(17).mean(axis=1)).max() < 1e-12
    assert even_normals(17).std(axis=1) == pytest.approx(np.ones(17), abs=0.01)


@pytest.mark.parametrize(("dimensions", "lines"), [(17, 15), (32, 6)])
def test_no_few_parallel_lines_hold_two_dimensions(dimensions, lines):
    """The shortest vector h with h . (i, j) whole for all members is the number of lines at least."""
    index = np.floor(even_fractions(dimensions) * MEMBERS).astype(int)
    steps = (index[:, 1] - index[:, 0]) % MEMBERS
    for i in range(dimensions):
        for j in range(i):
            h = np.arange(1, 40)
            ratio = steps[i] * pow(int(steps[j]), -1, MEMBERS) % MEMBERS
            other = h * ratio % MEMBERS
            shortest = np.hypot(h, np.minimum(other, MEMBERS - other)).min()
            assert shortest > lines, (i, j)


def test_no_member_is_extreme_in_everything():
    assert abs(even_normals(17)).min(axis=0).max() < 1.0

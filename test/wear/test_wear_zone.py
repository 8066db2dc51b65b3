"""The wear zone: the narrowest part of the circle that holds a fraction of the wear."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from leg_wear_monitor.wear import wear_zone

N = 72

profiles = arrays(float, N, elements=st.floats(0.0, 1.0).map(lambda x: round(x, 3))).filter(np.any)
fractions = st.floats(0.05, 1.0)


def _sectors(zone):
    start, end = zone[0] * N / 360.0, zone[1] * N / 360.0
    return np.arange(round(start), round(end)) % N


@given(depth=profiles, fraction=fractions)
def test_it_holds_the_share_and_nothing_narrower_does(depth, fraction):
    zone = wear_zone(depth, fraction)
    held = _sectors(zone)
    assert 0.0 <= zone[0] < 360.0
    assert zone[0] < zone[1] <= zone[0] + 360.0
    assert depth[held].sum() >= fraction * depth.sum() * (1.0 - 1.0e-9)
    narrower = [np.roll(depth, -start)[: len(held) - 1].sum() for start in range(N)]
    assert max(narrower) < fraction * depth.sum()


@given(start=st.integers(0, N - 1), length=st.integers(1, N - 1))
def test_a_box_is_found_where_it_is(start, length):
    """All of an even wear is just where it is, across 0 deg too."""
    depth = np.zeros(N)
    depth[np.arange(start, start + length) % N] = 1.0
    assert wear_zone(depth, 1.0) == pytest.approx((start * 360.0 / N, (start + length) * 360.0 / N))


def test_no_zone_without_wear():
    assert wear_zone(np.zeros(N)) is None

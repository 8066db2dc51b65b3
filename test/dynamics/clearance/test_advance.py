"""Control of the step."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from leg_wear_monitor.dynamics.clearance.advance import inverse_cube_root


@given(st.floats(-300.0, 300.0).map(lambda power: 10.0**power))
def test_the_inverse_cube_root(x):
    assert inverse_cube_root(x) ** 3 * x == pytest.approx(1.0, abs=4.0e-5)

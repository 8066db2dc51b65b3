"""The crank's polynomial and its derivatives."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from leg_wear_monitor.dynamics.run import DEGREE, drive_at


@given(
    c=arrays(float, DEGREE + 1, elements=st.floats(-10.0, 10.0)),
    since=st.floats(-5.0, 5.0),
    t=st.floats(-5.0, 5.0),
)
def test_speed_and_acceleration_are_derivatives_of_the_angle(c, since, t):
    drive = np.empty(3)
    drive_at(np.array([since, *c]), t, drive)
    angle = np.polynomial.Polynomial(c)
    wanted = [curve(t - since) for curve in (angle, angle.deriv(), angle.deriv(2))]
    np.testing.assert_allclose(
        drive, wanted, rtol=1.0e-9, atol=1.0e-9 * (1.0 + np.abs(c).sum()) * 10.0**DEGREE
    )

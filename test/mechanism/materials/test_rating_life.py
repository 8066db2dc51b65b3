"""SKF's formula of the life of a bushing gives SKF's own example."""

import math

import pytest

import leg_wear_monitor as lw
from leg_wear_monitor.mechanism.materials import rating_life_hours


def test_the_published_example() -> None:
    """The door of a tramway: published 1.64 N/mm^2, 0.01 m/s and 22 500 h; 22 464 h by the formula."""
    pair = lw.load_material("skf-ptfe-composite-on-steel")
    assert pair.rating_life is not None
    assert pair.limits.dynamic_pressure is not None
    pressure = pair.limits.dynamic_pressure.si * 800.0 / 39_000.0
    assert pressure == pytest.approx(1.64e6, rel=2.0e-3)
    speed = 5.82e-7 * 20.0 * 90.0 * 10.0  # of 20 mm by 90 degrees, ten times a minute
    assert pressure * speed < 0.025e6  # so the least p v stands for it
    hours = 1.3 * 0.6 * 1.5 * rating_life_hours(pressure * speed, pair.rating_life)  # c1, c4, c5
    assert hours == pytest.approx(22_464.0)
    assert hours == pytest.approx(22_500.0, rel=2.0e-3)


def test_the_constants_hold_for_their_range_only() -> None:
    """GLYCODUR A: K_M 1900, n 1 up to 1 MPa m/s, at least 0.1 inserted."""
    constants = lw.load_material("glycodur-a-on-steel").rating_life
    assert constants is not None
    hours = [rating_life_hours(1.0e6 * pv, constants) for pv in (0.05, 0.1, 0.5, 1.0)]
    assert hours == pytest.approx([19_000.0, 19_000.0, 3800.0, 1900.0])
    assert math.isnan(rating_life_hours(1.01e6, constants))


def test_above_the_least_value_the_life_falls_with_p_v() -> None:
    constants = lw.load_material("skf-ptfe-composite-on-steel").rating_life
    assert constants is not None
    one, two = (rating_life_hours(pv, constants) for pv in (0.1e6, 0.2e6))
    assert one == pytest.approx(4800.0)
    assert one / two == pytest.approx(2.0**constants.exponent.si)

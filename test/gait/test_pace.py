"""How the crank turns: what the pace says of angle, speed and acceleration fits together."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leg_wear_monitor.configuration import FieldError
from leg_wear_monitor.dynamics.run import CrankMotion, quintic
from leg_wear_monitor.gait.config import PaceConfig
from leg_wear_monitor.gait.leg import Pace

SPEEDS = st.lists(st.floats(-120.0, 120.0), min_size=1, max_size=4)
NUMBERS = st.floats(-10.0, 10.0)


def pace_of(speeds: list[float], ripple: float = 0.0, ramp: float = 0.5) -> Pace:
    times = tuple(float(i) for i in range(len(speeds)))
    return Pace(PaceConfig(times_s=times, speeds_rpm=tuple(speeds), ramp_s=ramp, ripple=ripple))


@given(SPEEDS, st.floats(0.0, 0.5), st.floats(0.1, 5.0))
def test_speed_and_acceleration_are_the_derivatives_of_the_angle(
    speeds: list[float], ripple: float, t: float
) -> None:
    pace, h = pace_of(speeds, ripple), 1.0e-5
    before, here, after = (pace.at(t + shift) for shift in (-h, 0.0, h))
    assert (after.angle - before.angle) / (2.0 * h) == pytest.approx(here.speed, abs=1e-4)
    assert (after.speed - before.speed) / (2.0 * h) == pytest.approx(here.acceleration, abs=1e-2)


@given(SPEEDS)
def test_it_reaches_the_last_speed(speeds: list[float]) -> None:
    motion = pace_of(speeds).at(len(speeds) + 0.5)
    assert motion.speed == pytest.approx(speeds[-1] * 2.0 * math.pi / 60.0)
    assert motion.acceleration == 0.0


def test_a_crank_that_stops_stands_still() -> None:
    pace = pace_of([60.0, 0.0], ripple=0.3)
    assert pace.at(1.5).angle == pace.at(9.0).angle
    assert pace.at(9.0).speed == 0.0


@given(st.floats(0.0, 0.9), st.floats(0.0, 10.0))
def test_the_ripple_is_its_share_of_the_speed(ripple: float, t: float) -> None:
    even, real = pace_of([60.0]).at(t), pace_of([60.0], ripple).at(t)
    assert abs(real.speed - even.speed) <= ripple * even.speed + 1e-12
    assert abs(real.angle - even.angle) <= 0.5 * ripple + 1e-12


@given(st.tuples(NUMBERS, NUMBERS, NUMBERS), st.tuples(NUMBERS, NUMBERS, NUMBERS), st.floats(0.05, 2.0))
def test_the_quintic_passes_through_both_states(
    start: tuple[float, float, float], end: tuple[float, float, float], span: float
) -> None:
    coefficients = quintic(3.0, CrankMotion(*start), span, CrankMotion(*end))
    polynomial = np.polynomial.Polynomial(coefficients[1:])
    slope, bend = polynomial.deriv(), polynomial.deriv(2)
    assert coefficients[0] == 3.0
    assert [polynomial(0.0), slope(0.0), bend(0.0)] == pytest.approx(start)
    assert [polynomial(span), slope(span), bend(span)] == pytest.approx(end, abs=1e-9 / span**2)


@pytest.mark.parametrize(
    ("changes", "fault"),
    [
        ({"times_s": (0.0, 1.0)}, "speeds_rpm: has 1 speeds for 2 times. Expected one each"),
        ({"times_s": (1.0,)}, "times_s: [1.0] does not increase from 0 s"),
        ({"times_s": (0.0, 0.2), "speeds_rpm": (0.0, 60.0)}, "ramp_s: 0.5 s is longer than"),
        ({"ripple": 1.0}, "ripple: 1.0 is not at most 0.9"),
    ],
)
def test_a_pace_that_cannot_be_is_refused(changes: dict[str, tuple[float, ...]], fault: str) -> None:
    with pytest.raises(FieldError) as refused:
        PaceConfig(**changes)
    assert str(refused.value).startswith(fault)

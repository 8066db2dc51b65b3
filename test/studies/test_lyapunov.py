"""The exponent's code gives what is known: maps, a flow, a bouncing ball; calm legs differ from wild ones."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.studies.tables import exponent
from leg_wear_monitor.studies.tasks import lyapunov_exponent, stretches


def measured(advance, starts, steps, step_time=1.0, skip=50, comparable=None, distance=1.0e-9):
    """Exponent of a system from several starts."""
    logs = []
    for start in starts:
        state = np.array(start, dtype=float)
        direction, scale = np.ones(len(state)), np.ones(len(state))
        logs.append(stretches(advance, state, direction, scale, distance, steps, comparable))
    return exponent(np.array(logs), step_time, skip)


def agrees(estimate, value, within=0.0):
    return abs(estimate.value - value) < 4.0 * estimate.error + within


def test_lorenz_s_flow():
    """0.9056, e.g. Sprott, Chaos and Time-Series Analysis, 2003; Runge and Kutta's fourth order."""

    def field(p):
        x, y, z = p
        return np.array([10.0 * (y - x), x * (28.0 - z) - y, x * y - 8.0 / 3.0 * z])

    def advance(p, h=0.01):
        for _ in range(5):
            a = field(p)
            b = field(p + 0.5 * h * a)
            c = field(p + 0.5 * h * b)
            d = field(p + h * c)
            p = p + h / 6.0 * (a + 2.0 * b + 2.0 * c + d)
        return p

    estimate = measured(advance, [[1.0, 1.0, 20.0], [-4.0, 2.0, 25.0], [5.0, 3.0, 30.0]], 1600, 0.05, 200)
    assert agrees(estimate, 0.9056, 0.01)


def test_a_ball_that_bounces_on_a_shaking_table():
    """Motion that jumps: high bounces without loss are the standard map (Chirikov, Physics Reports 52, 1979).

    Its exponent is ln(K / 2) for large K. The neighbour may be across the seam of a turn, where it is not
    brought back.
    """
    kick = 40.0

    def bounce(state):
        rate = state[1] + kick * np.sin(state[0])
        return np.array([(state[0] + rate) % (2.0 * np.pi), rate])

    def comparable(one, other):
        return abs(one[0] - other[0]) < 1.0

    estimate = measured(bounce, [[1.0, 0.3], [2.0, 0.1], [3.0, 0.7]], 3000, comparable=comparable)
    assert agrees(estimate, np.log(kick / 2.0), 0.02)


@given(rate=st.floats(-3.0, 3.0), distance=st.floats(1.0e-9, 1.0e-3), scale=st.floats(1.0e-6, 1.0e6))
def test_a_linear_map_has_the_logarithm_of_its_larger_factor(rate, distance, scale):
    factors = np.exp([rate, rate - 1.0])

    logs = stretches(lambda x: factors * x, np.zeros(2), np.ones(2), np.full(2, scale), distance, 60)
    assert logs[40:].mean() == pytest.approx(rate, abs=1.0e-6)


def test_a_coordinate_without_a_scale_is_the_first_one_s():
    seen = []

    def advance(x):
        seen.append(x.copy())
        return np.array([2.0 * x[0], x[1] + 1.0])

    stretches(advance, np.array([0.0, 5.0]), np.ones(2), np.array([1.0, 0.0]), 1.0e-6, 3)
    assert [x[1] for x in seen] == [5.0, 5.0, 6.0, 6.0, 7.0, 7.0]


def test_neighbours_that_meet_do_not_end_the_count():
    logs = stretches(lambda x: 0.0 * x, np.ones(1), np.ones(1), np.ones(1), 1.0e-6, 5)
    assert np.isfinite(logs).all()
    assert logs.mean() < -10.0


SETTINGS = {
    "clearances": ["G"], "clearance_m": 3.0e-4, "perturb_fraction": 0.3, "seed": 1, "skip_cycles": 2,
    "runs": 2, "cycles": 6, "renewals": 32, "distance": 1.0e-8, "tolerance_m": 1.0e-9,
}  # fmt: skip


@pytest.mark.chaotic
def test_a_leg_that_stays_in_contact_forgets_and_one_that_bounces_does_not():
    """At 20 rpm the knee stays in contact all the time; the hip at 60 rpm bounces."""
    calm = lyapunov_exponent(load_mechanism(), SETTINGS | {"speed_rpm": 20.0})["stretch_per_cycle"]
    wild = lyapunov_exponent(load_mechanism(), SETTINGS | {"clearances": ["A", "B"], "speed_rpm": 60.0})[
        "stretch_per_cycle"
    ]
    assert calm.shape == wild.shape == (2, 6)
    assert calm.mean() < 0.0
    assert wild.mean() > 10.0


@pytest.mark.chaotic
def test_the_exponent_of_the_leg_does_not_depend_on_how_far_the_neighbour_stands():
    place = SETTINGS | {"clearances": ["A", "B"], "speed_rpm": 60.0}
    near, far = (
        lyapunov_exponent(load_mechanism(), place | {"distance": distance})["stretch_per_cycle"].mean()
        for distance in (1.0e-9, 1.0e-6)
    )
    assert near == pytest.approx(far, rel=0.05)

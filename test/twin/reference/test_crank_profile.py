"""How a crank turns, found again from samples of its angle."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.twin.reference import HARMONICS, CrankProfile, cycle_profile, mean_profile

AMPLITUDES = st.lists(st.floats(-0.01, 0.01), min_size=HARMONICS, max_size=HARMONICS)


def samples(profile: CrankProfile, rate_hz: float = 400.0):
    """Times and angles from where the crank passes its zero, and the duration of the cycle."""
    duration = TURN / abs(profile.speed)
    phi = np.linspace(-0.1, 1.2, 2000) * np.copysign(TURN, profile.speed)
    angle = np.array([profile.at(each).angle for each in phi])
    rising = np.copysign(1.0, profile.speed)
    zero = np.interp(0.0, rising * angle, phi)
    time_s = np.arange(0.0, duration, 1.0 / rate_hz)
    return time_s, np.array([profile.at(zero + profile.speed * t).angle for t in time_s]), duration


@settings(max_examples=15)
@given(cosine=AMPLITUDES, sine=AMPLITUDES, speed=st.sampled_from([TURN, -TURN, 3.0 * TURN]))
def test_a_profile_is_found_again(cosine: list[float], sine: list[float], speed: float) -> None:
    h = np.arange(1.0, HARMONICS + 1.0)
    # a crank that never turns back
    true = CrankProfile(speed, np.array(cosine) / h, np.array(sine) / h)
    found = cycle_profile(*samples(true))
    assert found.speed == pytest.approx(speed, rel=1e-9)
    assert found.departure(true) < 1e-3


def test_speed_and_acceleration_are_the_derivatives_of_the_angle() -> None:
    profile = CrankProfile(TURN, np.full(HARMONICS, 1e-3), np.full(HARMONICS, -2e-3))
    for phi in (0.3, 2.0, 5.5):
        less, now, more = (profile.at(phi + d) for d in (-1e-5, 0.0, 1e-5))
        assert now.speed == pytest.approx((more.angle - less.angle) / 2e-5 * TURN, rel=1e-7)
        assert now.acceleration == pytest.approx((more.speed - less.speed) / 2e-5 * TURN, rel=1e-6)


def test_noise_of_the_encoder_averages_out() -> None:
    true = CrankProfile(TURN, np.zeros(HARMONICS), np.r_[0.0, 0.015, np.zeros(HARMONICS - 2)])
    random = np.random.default_rng(1)
    time_s, angle, duration = samples(true, 200.0)
    cycles = [
        cycle_profile(time_s, angle + 1e-3 * random.standard_normal(len(angle)), duration) for _ in range(20)
    ]
    assert mean_profile(cycles).departure(true) < 0.003  # 0.01 in a single cycle


def test_times_in_whole_milliseconds_give_the_same_profile_in_each_cycle() -> None:
    """Seen before: 2 % from cycle to cycle, so a CSV with such times never had five gait cycles alike."""
    true = CrankProfile(0.95 * TURN, np.zeros(HARMONICS), np.r_[0.0, 0.015, np.zeros(HARMONICS - 2)])
    random, (time_s, angle, duration) = np.random.default_rng(1), samples(true, 199.6)
    for begin in random.uniform(0.0, 1.0, 20):
        shown = np.round(begin + time_s, 3)
        ends = np.round(1000.0 * (begin + np.array([0.0, duration])) + random.uniform(-0.5, 0.5, 2)) / 1000.0
        noisy = angle + 1e-3 * random.standard_normal(len(angle))
        assert cycle_profile(shown - ends[0], noisy, ends[1] - ends[0]).departure(true) < 0.015


def test_irregular_times_that_are_right_are_kept() -> None:
    true = CrankProfile(TURN, np.zeros(HARMONICS), np.r_[0.0, 0.015, np.zeros(HARMONICS - 2)])
    time_s, angle, duration = samples(true, 2000.0)
    some = np.sort(np.random.default_rng(1).choice(len(time_s), 200, replace=False))
    assert cycle_profile(time_s[some], angle[some], duration).departure(true) < 1e-3


def test_ripple_departs_from_a_steady_crank_by_its_amplitude() -> None:
    ripple = CrankProfile(TURN, np.zeros(HARMONICS), np.r_[0.0, 0.015, np.zeros(HARMONICS - 2)])
    assert ripple.departure(CrankProfile.steady(TURN)) == pytest.approx(0.03, rel=1e-3)

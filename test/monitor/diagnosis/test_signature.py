"""Signatures of gait cycles: laws that hold for any torque."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leg_wear_monitor.monitor.diagnosis.signature import TorqueSensor, averaged, quiet_phases, signatures

SENSOR = TorqueSensor(period_s=0.005, cycle_s=1.0, size_nm=10.0)
ANGLE = 2.0 * np.pi * (np.arange(200) + 0.5) / 200


def signature(torque, sensor=SENSOR, angle=ANGLE):
    step = np.diff(torque, prepend=np.nan)
    return signatures(np.zeros(len(torque), np.int64), angle, torque, step, sensor)[0]


@given(constant=st.floats(-30.0, 30.0))
def test_a_constant_torque_shifts_the_means_alone(constant: float) -> None:
    torque = 8.0 * np.sin(3.0 * ANGLE)
    before, after = signature(torque), signature(torque + constant)
    np.testing.assert_allclose(after[:40] - before[:40], constant, atol=1e-9)
    np.testing.assert_allclose(after[40:], before[40:], atol=1e-6)


@given(scale=st.floats(0.2, 3.0))
def test_a_scale_scales_the_means_and_shifts_the_roughness(scale: float) -> None:
    torque = 8.0 * np.sin(7.0 * ANGLE + 1.0)
    before, after = signature(torque), signature(scale * torque)
    np.testing.assert_allclose(after[:40], scale * before[:40], atol=1e-9)
    np.testing.assert_allclose(after[40:] - before[40:], np.log(scale), atol=0.05)  # but for the floor


def test_a_phase_shows_where_the_torque_is_rough() -> None:
    torque = np.zeros(200)
    torque[100:105] = [0.0, 5.0, -5.0, 5.0, 0.0]  # half a turn: phase 20
    assert np.flatnonzero(signature(torque)[40:] > 0.0).tolist() == [20]


def test_a_peak_counts_as_at_most_eight_times_the_size() -> None:
    torque = np.zeros(200)
    torque[50:55] = 1.0e6
    assert signature(torque)[10] == pytest.approx(80.0)


def test_a_lost_sample_leaves_no_step_across_the_gap() -> None:
    torque = np.where(np.pi > ANGLE, 0.0, 50.0)
    step = np.diff(torque, prepend=np.nan)
    step[100] = np.nan
    rough = signatures(np.zeros(200, np.int64), ANGLE, torque, step, SENSOR)[0, 40:]
    assert rough.max() == rough.min()


def test_a_phase_without_samples_is_unknown() -> None:
    found = signature(np.zeros(150), angle=ANGLE[:150])
    assert np.isnan(found[:40]).tolist() == [False] * 30 + [True] * 10


@pytest.mark.parametrize(
    ("rate_hz", "together", "phases"),
    [(1000, 5, 40), (200, 1, 40), (100, 1, 40), (50, 1, 20), (25, 1, 10), (20, 1, 0)],
)
def test_sampling_determines_phases(rate_hz: float, together: int, phases: int) -> None:
    sensor = TorqueSensor(period_s=1.0 / rate_hz, cycle_s=1.0, size_nm=10.0)
    assert (sensor.together, sensor.phases) == (together, phases)


def test_averaging_keeps_the_mean_of_whole_groups() -> None:
    np.testing.assert_array_equal(averaged(np.arange(7.0), 3), [1.0, 4.0])


def test_quiet_phases_are_the_calmest_third() -> None:
    found = quiet_phases(np.concatenate([np.zeros(6), [3.0, 1.0, 2.0, 6.0, 5.0, 4.0]]))
    assert np.flatnonzero(found).tolist() == [7, 8]

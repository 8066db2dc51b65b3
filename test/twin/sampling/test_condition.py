"""Conditions: gait cycles of about the same cadence and load are of one class."""

import math

import numpy as np
import pytest

from leg_wear_monitor.twin.follower_state import FINE_PHASES
from leg_wear_monitor.twin.sampling import condition_of, measured_load
from leg_wear_monitor.twin.statistics import TorqueProfile

pytestmark = pytest.mark.plain


def profile(measured: np.ndarray, lever: np.ndarray, number: float = 3.0) -> TorqueProfile:
    count = np.full(FINE_PHASES, number)
    return TorqueProfile(count, count, number * measured, np.full(FINE_PHASES, np.nan), number * lever)


@pytest.mark.parametrize("load_n", [-20.0, 0.0, 35.0])
def test_the_load_is_that_of_the_measured_torque(load_n):
    """A constant torque, such as friction, is none."""
    lever = 0.1 * np.sin(np.arange(FINE_PHASES) / FINE_PHASES * 2.0 * np.pi)
    assert measured_load(profile(load_n * lever + 0.7, lever)) == pytest.approx(load_n, abs=1e-12)


def test_without_torque_or_toe_there_is_no_load():
    nothing = np.zeros(FINE_PHASES)
    assert math.isnan(measured_load(profile(nothing, nothing)))
    assert math.isnan(measured_load(profile(nothing, nothing + 1.0, number=0.0)))
    assert condition_of(60.0, math.nan).load is None


def test_a_condition_is_kept_near_its_border():
    one = condition_of(60.0, 2.0)
    border = math.exp(0.04 * (one.cadence + 0.65))  # steps from the middle
    assert condition_of(border, 2.0) != one
    assert condition_of(border, 2.7, one) == one
    assert condition_of(70.0, 2.0, one) != one
    assert condition_of(60.0, 3.0, one) != one


def test_forward_and_backward_are_unlike():
    forward, backward, faster = (condition_of(rpm, 0.0) for rpm in (60.0, -60.0, 90.0))
    assert forward.distance(faster) < forward.distance(backward)

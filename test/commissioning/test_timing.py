"""The lag to allow for: what is measured, declared or neither."""

import math

import attrs
import pytest

from leg_wear_monitor.commissioning.evidence import Timing

pytestmark = pytest.mark.plain

ONE_CADENCE = Timing(False, math.nan, math.nan, 0.0025)


def measured(late_s: float, error_s: float) -> Timing:
    return Timing(True, late_s, error_s, 0.0025)


def test_nothing_is_allowed_for_of_which_nothing_is_known() -> None:
    assert ONE_CADENCE.lag_s == 0.0025
    assert ONE_CADENCE.lag_sigma_s > 0.01


def test_at_one_cadence_a_declared_lag_is_taken_of_which_a_low_pass_is_a_part() -> None:
    one = attrs.evolve(ONE_CADENCE, declared_s=0.008)
    assert (one.lag_s, one.lag_sigma_s) == (pytest.approx(0.0105), pytest.approx(0.001))
    one = attrs.evolve(one, low_pass_s=0.004, low_pass_sigma_s=0.002)
    assert (one.lag_s, one.lag_sigma_s) == (pytest.approx(0.0145), pytest.approx(math.hypot(0.001, 0.002)))


def test_a_lag_near_none_is_none_a_clear_one_is_as_measured_and_no_drive_is_early() -> None:
    assert measured(0.0005, 0.001).lag_s == pytest.approx(0.0025, abs=1.0e-4)
    assert measured(0.012, 0.001).lag_s == pytest.approx(0.0145, abs=1.0e-4)
    assert measured(0.012, 0.001).lag_sigma_s == pytest.approx(0.001, rel=0.05)
    assert measured(-0.006, 0.003).lag_s == pytest.approx(0.0025, abs=2.0e-4)


def test_a_lag_that_may_be_one_or_none_is_uncertain() -> None:
    one = measured(0.006, 0.003)
    assert 0.0025 < one.lag_s < 0.0085
    assert one.lag_sigma_s > 0.003

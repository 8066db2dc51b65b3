"""A corrected clearance: the opening that counting had missed says nothing of the wear coefficient."""

import math

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leg_wear_monitor.estimate.cause import Cause, Change
from leg_wear_monitor.monitor.config.sections import Forecasting
from leg_wear_monitor.monitor.cycle_report import correct
from leg_wear_monitor.monitor.forecast.forecast import JointCondition, forecast, no_law
from leg_wear_monitor.monitor.forecast.wear_coefficients import (
    ClearanceAtWear,
    estimate_coefficient,
    measured_factor,
)
from leg_wear_monitor.monitor.ledger.entry import CorrectedClearance

FRESH, SETTINGS = 3.0e-4, Forecasting(wear_coefficient_sigma=0.7)
BEFORE, OPENED, SIGMA = 6.0e-5, 1.0e-3, 4.0e-5  # wear counted before, clearance that the torque shows
CORRECTED = CorrectedClearance(
    stamp_ns=5, joint="A", clearance_m=OPENED, sigma_m=SIGMA,
    before_m=BEFORE, wear_m=OPENED - FRESH, replaced_ns=0,
)  # fmt: skip
EARLY = ClearanceAtWear(FRESH + 1.8 * BEFORE, 2e-6, BEFORE)  # 1.8 times the nominal wear


def believed(wear_m, observations, corrections=(CORRECTED,)):
    """The clearance that the forecast believes in, p10, p50 and p90 [m]."""
    estimate = estimate_coefficient(SETTINGS, FRESH, observations, corrections=corrections)
    now = JointCondition(
        joint="A", fresh_m=FRESH, wear_m=wear_m, limit_m=1e-2, growth_m=1e-11, growth_error_m=0.0
    )
    law = no_law(np.array([FRESH]), SETTINGS.model_sigma)
    found = forecast([now], [estimate], SETTINGS, law, cycle_s=1.0, valid=True).joints[0].clearance_m
    return np.array([found.p10, found.p50, found.p90])


@pytest.mark.plain
@pytest.mark.parametrize("observations", [[], [EARLY]])
def test_after_a_correction_the_corrected_clearance_is_believed_whatever_the_coefficient(observations):
    low, middle, high = believed(CORRECTED.wear_m, observations)
    assert middle == pytest.approx(OPENED, abs=0.02 * SIGMA)
    assert high - low == pytest.approx(2.0 * 1.2816 * SIGMA, rel=0.03)


@pytest.mark.plain
def test_only_the_wear_since_is_multiplied_by_what_was_learned():
    since = 5.0e-5
    assert believed(CORRECTED.wear_m + since, [EARLY])[1] == pytest.approx(
        OPENED + 1.8 * since, abs=0.02 * SIGMA + 0.06 * since
    )


@pytest.mark.plain
@given(st.floats(0.2, 5.0), st.floats(1e-7, 1e-4))
def test_what_was_measured_before_teaches_the_same_after_a_correction(factor, sigma):
    early = [ClearanceAtWear(FRESH + factor * wear, sigma, wear) for wear in (0.0, 2e-5, BEFORE)]
    assert measured_factor(SETTINGS, FRESH, early, [CORRECTED]) == measured_factor(SETTINGS, FRESH, early)


@pytest.mark.plain
@given(st.floats(0.2, 5.0))
def test_measurements_on_both_sides_of_a_correction_agree_on_the_factor(factor):
    since = 4.0e-5
    late = [
        ClearanceAtWear(OPENED + 3e-5, 2e-6, CORRECTED.wear_m),  # the torque was 0.03 mm off
        ClearanceAtWear(OPENED + 3e-5 + factor * since, 2e-6, CORRECTED.wear_m + since),
    ]
    early = [ClearanceAtWear(FRESH, 2e-6, 0.0), ClearanceAtWear(FRESH + factor * BEFORE, 2e-6, BEFORE)]
    alone = [measured_factor(SETTINGS, FRESH, each, [CORRECTED]) for each in (early, late)]
    together, precision = measured_factor(SETTINGS, FRESH, [*late, *early], [CORRECTED])
    assert together == pytest.approx(factor, rel=0.01)
    assert precision == pytest.approx(alone[0][1] + alone[1][1])


@pytest.mark.plain
def test_two_corrections_each_count_from_themselves():
    again = attrs.evolve(CORRECTED, clearance_m=2e-3, before_m=CORRECTED.wear_m + 1e-5, wear_m=1.7e-3)
    between = ClearanceAtWear(OPENED + 1.8e-5, 2e-6, CORRECTED.wear_m + 1e-5)
    factor, precision = measured_factor(SETTINGS, FRESH, [EARLY, between], [CORRECTED, again])
    alone = [
        measured_factor(SETTINGS, FRESH, [each], corrections)
        for each, corrections in ((EARLY, ()), (between, [CORRECTED]))
    ]
    assert precision == pytest.approx(sum(each[1] for each in alone))
    assert factor == pytest.approx(sum(math.prod(each) for each in alone) / precision)
    assert believed(again.wear_m, [EARLY, between], [CORRECTED, again])[1] == pytest.approx(2e-3, rel=1e-3)


@pytest.mark.plain
def test_corrections_are_read_as_written(reopened) -> None:
    other = attrs.evolve(CORRECTED, stamp_ns=9, joint="G", replaced_ns=3)
    assert reopened(CORRECTED, other).corrections == (CORRECTED, other)


def test_a_monitor_believes_a_corrected_clearance_now_and_in_its_next_run(begin, gait) -> None:
    monitor = begin()
    monitor.update(gait(2.5))
    change = Change(
        cause=Cause.CLEARANCE,
        subject="G",
        since_ns=1,
        value=OPENED,
        sigma=SIGMA,
        counted=FRESH,
        log_odds=99.0,
    )
    correct(monitor._parts, change)
    reports = monitor.update(gait(2.0, begin_s=2.5))
    first = reports.cycles[-1].joints[1]
    assert first.clearance_m == pytest.approx(OPENED, rel=1e-4)
    assert first.forecast.clearance_m.p50 == pytest.approx(OPENED, abs=0.02 * SIGMA)
    monitor.close()
    monitor = begin()
    again = monitor.update(gait(2.5, begin_s=4.5)).cycles[-1].joints[1]
    assert again.forecast.clearance_m.p50 == pytest.approx(OPENED, abs=0.02 * SIGMA)
    assert again.forecast.clearance_m.p90 - again.forecast.clearance_m.p10 < 3.0 * SIGMA

"""Another nominal wear coefficient than the one that wear was counted with: what was measured of it stays."""

import itertools
import math

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leg_wear_monitor.monitor.config.sections import Forecasting
from leg_wear_monitor.monitor.forecast.forecast import JointCondition, forecast, no_law
from leg_wear_monitor.monitor.forecast.wear_coefficients import (
    ClearanceAtWear,
    coefficient_doubts,
    estimate_coefficient,
    measured_factor,
)
from leg_wear_monitor.monitor.ledger.entry import (
    CorrectedClearance,
    JointWear,
    coefficient_spans,
)

FRESH, SETTINGS = 3.0e-4, Forecasting(wear_coefficient_sigma=0.7)
WEAR, WAS = 6.0e-5, 2.0e-15  # counted with this coefficient [m, 1/Pa]
MEASURED = ClearanceAtWear(FRESH + 1.8 * WEAR, 2.0e-6, WEAR)  # 1.8 times the nominal wear


def part(wear_m, per_pa=WAS, replaced_ns=0, joint="A"):
    """A joint with so much wear, the last of it counted with a coefficient."""
    return JointWear(joint, np.full((2, 720), 0.5 * wear_m), 4000, 4000.0, replaced_ns, per_pa)


def joint_forecast(now_per_pa, observations=(), prior=None):
    """Forecast of a joint whose growth is counted with a coefficient, and its wear before with `WAS`."""
    spans = coefficient_spans([part(WEAR)], {"A": now_per_pa})
    estimate = estimate_coefficient(SETTINGS, FRESH, observations, prior, spans)
    now = JointCondition(
        joint="A", fresh_m=FRESH, wear_m=WEAR, limit_m=6e-4, growth_m=1e4 * now_per_pa, growth_error_m=0.0
    )
    law = no_law(np.array([FRESH]), SETTINGS.model_sigma)
    return forecast([now], [estimate], SETTINGS, law, cycle_s=1.0, valid=True).joints[0]


@pytest.mark.plain
@pytest.mark.parametrize("ratio", [0.1, 0.5, 2.0, 10.0])
def test_a_measured_life_stays_whatever_coefficient_is_nominal(ratio):
    before, after = (joint_forecast(each, [MEASURED]) for each in (WAS, ratio * WAS))
    assert before.cycles.p10 < after.cycles.p50 < before.cycles.p90
    assert after.cycles.p50 == pytest.approx(before.cycles.p50, rel=0.02)
    assert after.clearance_m.p50 == pytest.approx(before.clearance_m.p50, abs=0.5e-6)


@pytest.mark.plain
@pytest.mark.parametrize("observations", [[], [ClearanceAtWear(FRESH, 5e-6, 0.0)]])
def test_without_a_measurement_of_wear_the_life_follows_and_the_counted_wear_stays(observations):
    before, after = (joint_forecast(each, observations) for each in (WAS, 2.0 * WAS))
    assert after.clearance_m == before.clearance_m
    assert after.cycles.p50 == pytest.approx(0.5 * before.cycles.p50)


PIECES = st.lists(st.tuples(st.floats(1e-16, 1e-14), st.floats(1e9, 1e10)), min_size=1, max_size=4)


@pytest.mark.plain
@given(PIECES, st.floats(1e-16, 1e-14), st.floats(1e-16, 1e-14))
def test_measurements_find_the_coefficient_over_any_changes_of_the_nominal_one(
    pieces, now_per_pa, true_per_pa
):
    """Each piece: a nominal coefficient, and pressure times sliding distance [Pa m] under it."""
    worn, passed = (
        [*itertools.accumulate(each)] for each in ((k * p for k, p in pieces), (p for _, p in pieces))
    )
    states = [part(wear_m, k) for wear_m, (k, _) in zip(worn, pieces, strict=True)]
    spans = coefficient_spans(states, {"A": now_per_pa})

    def found(wear_m, corrections=()):
        observations = [
            ClearanceAtWear(FRESH + true_per_pa * p, 1e-7, w) for w, p in zip(wear_m, passed, strict=True)
        ]
        return measured_factor(SETTINGS, FRESH, observations, corrections)

    factor, precision = found([state.mean_m for state in states], spans)
    assert factor * now_per_pa == pytest.approx(true_per_pa, rel=1e-5)
    # as if all had been counted with the present one
    assert precision == pytest.approx(found([now_per_pa * p for p in passed])[1], rel=1e-5)


@pytest.mark.plain
def test_measurements_on_both_sides_of_a_correction_find_it_too():
    """Two thirds of the wear before it, and all since, were counted with other coefficients than the last."""
    corrected = CorrectedClearance(
        stamp_ns=5, joint="A", clearance_m=1e-3, sigma_m=4e-5, before_m=WEAR, wear_m=7e-4, replaced_ns=0
    )
    states = [part(2e-5, WAS), part(WEAR, 2.0 * WAS), part(7.4e-4, 2.0 * WAS)]
    early = [ClearanceAtWear(FRESH, 1e-7, 0.0), ClearanceAtWear(FRESH + 1.5 * (2e-5 + 2e-5), 1e-7, WEAR)]
    late = [
        ClearanceAtWear(1.03e-3, 1e-7, 7e-4),  # the torque was 0.03 mm off
        ClearanceAtWear(1.03e-3 + 1.5 * 2e-5, 1e-7, 7.4e-4),
    ]
    spans = coefficient_spans(states, {"A": 4.0 * WAS})
    for observations in (early, late, early + late):
        factor, _ = measured_factor(SETTINGS, FRESH, observations, [corrected, *spans])
        assert factor * 4.0 == pytest.approx(1.5, rel=1e-3)


@pytest.mark.plain
def test_parts_and_unknown_coefficients_are_kept_apart():
    """A reset begins anew; what is not known, as in joints without a coefficient, is taken as it is."""
    states = [part(5e-5, WAS), part(2e-5, WAS, 7), part(3e-5, 3.0 * WAS, 7), part(4e-5, 0.0, joint="G")]
    spans = coefficient_spans(states, {"A": 3.0 * WAS, "G": WAS})
    assert [(each.replaced_ns, each.from_m, each.to_m) for each in spans] == [
        (0, 0.0, pytest.approx(5e-5)), (7, 0.0, pytest.approx(2e-5)),
    ]  # fmt: skip
    assert [each.factor for each in spans] == pytest.approx([3.0, 3.0])
    assert coefficient_spans(states, {"A": 0.0}) == coefficient_spans(states, {}) == ()


@pytest.mark.plain
def test_a_line_names_the_joints_and_both_coefficients(leg):
    now = {
        "A": (1e-15, 1e-15),
        "B": (1e-15, 1e-15),
        "G": (2e-15, 2e-15),
        "I": (0.0, 0.0),
        "J": (2e-15, 2e-15),
    }
    leg = attrs.evolve(
        leg,
        clearances={name: attrs.evolve(leg.clearances[name], wear_coefficient=k) for name, k in now.items()},
    )
    counted = [part(WEAR, WAS, joint=joint) for joint in "ABGI"]
    first, second = coefficient_doubts([*counted, part(0.0, WAS, joint="J")], leg)
    stays = "(bushing and journal together), and the wear in the ledger was counted with 2e-15 1/Pa"
    assert str(first) == (
        f"wear coefficient of joint G: 4e-15 1/Pa {stays}; that wear stays as counted, wear from now on is "
        "counted with the new one, and the forecast keeps a measured coefficient (its factor is 0.5 times as "
        "large)"
    )
    assert str(second) == (
        f"wear coefficient of joint I: 0 1/Pa {stays}; that wear stays as counted, and no more is counted"
    )


@pytest.fixture
def worn_run(begin):
    """Begin a run with a wear coefficient of both surfaces; in the first, A is worn and measured."""

    def run(per_pa):
        monitor = begin({"wear_coefficients_per_pa": [per_pa], "clearances_m": [FRESH]})
        if not monitor.measurements:
            monitor._twin.set_depth(np.full((2, 2, 720), 0.5 * WEAR))
            monitor.measure("A", FRESH + 1.8 * WEAR, 2e-6, 10**18, "ann")
        return monitor

    return run


def test_a_monitor_keeps_the_measured_coefficient_over_runs_with_others(worn_run, rows) -> None:
    worn_run(1.0e-15).close()
    for per_pa in (2.0e-15, 5.0e-16):
        monitor = worn_run(per_pa)
        assert len(monitor.coefficient_doubts) == 1
        assert monitor.wear_of("A").mean_m == monitor.wear_of("G").mean_m == pytest.approx(WEAR)
        measured, other = monitor._parts.forecaster.state.coefficient_estimates
        assert math.exp(measured.mean) * per_pa == pytest.approx(1.8e-15, rel=0.02)
        assert measured.clearance_m(WEAR) == pytest.approx(FRESH + 1.8 * WEAR, abs=1e-6)
        assert other.mean == pytest.approx(0.0, abs=1e-9)
        assert other.clearance_m(WEAR) == pytest.approx(FRESH + WEAR)
        assert monitor.measurements[0].wear_m == pytest.approx(WEAR)
        monitor.close()
    monitor = worn_run(5.0e-16)
    assert monitor.coefficient_doubts == ()
    monitor.close()
    changes = rows("SELECT who, what, joint, wear_coefficient_per_pa FROM audit ORDER BY id")
    assert changes == [
        ("parameters", "change_coefficient", joint, per_pa) for per_pa in (2e-15, 4e-15) for joint in "AG"
    ]


def test_a_reset_that_is_taken_back_under_another_coefficient_keeps_the_measured_one(worn_run) -> None:
    monitor = worn_run(1.0e-15)
    monitor.reset_wear("A", 10**18 + 1, "ann")
    monitor.close()
    monitor = worn_run(2.0e-15)
    monitor.undo_reset("A", 10**18 + 2, "ann")
    measured = monitor._parts.forecaster.state.coefficient_estimates[0]
    assert math.exp(measured.mean) == pytest.approx(0.9, rel=0.02)
    assert measured.clearance_m(monitor.wear_of("A").mean_m) == pytest.approx(FRESH + 1.8 * WEAR, abs=1e-6)

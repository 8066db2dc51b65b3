"""What a measured clearance teaches: limits that are known in closed form, order, parts, contradictions."""

import math
import statistics

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.mechanism.materials import USUAL_SPREAD
from leg_wear_monitor.monitor.config.settings import Forecasting
from leg_wear_monitor.monitor.forecast.measurement import measure
from leg_wear_monitor.monitor.forecast.wear_coefficients import (
    ClearanceAtWear,
    CoefficientPrior,
    estimate_coefficient,
)
from leg_wear_monitor.monitor.ledger.entry import JointWear

FRESH = 3.0e-4
PRIOR = Forecasting(new_clearance_sigma=5e-6 / FRESH)
CLEARANCE = load_mechanism("bionic_leg").clearances["A"]
HOUR = 3_600_000_000_000


def worn(wear_m, cycles=1000, replaced_ns=0):
    """Joint A with so much wear."""
    return JointWear("A", np.full((2, 720), 0.5 * wear_m), cycles, float(cycles), replaced_ns)


def found(wear, mm, earlier=(), **more):
    """What a clearance in mm says, good to 5 µm."""
    given = {"sigma_m": 5e-6, "stamp_ns": 9 * HOUR, "who": "ann", **more}
    return measure(PRIOR, CLEARANCE, wear, earlier, clearance_m=1e-3 * mm, **given)


def test_without_a_measurement_the_belief_is_the_lognormal_prior():
    coefficient_estimate = estimate_coefficient(PRIOR, FRESH)
    assert coefficient_estimate.mean == pytest.approx(0.0, abs=1e-12)
    assert coefficient_estimate.sigma == pytest.approx(USUAL_SPREAD, rel=1e-3)
    z = statistics.NormalDist().inv_cdf(0.9)
    assert coefficient_estimate.log_factors(0.9) == pytest.approx(USUAL_SPREAD * z, rel=1e-3)


@given(st.floats(0.3, 3.0))
def test_an_accurate_measurement_of_much_wear_tells_the_factor(factor):
    exact = attrs.evolve(PRIOR, new_clearance_sigma=1e-7 / FRESH)
    wear = 1e-4
    coefficient_estimate = estimate_coefficient(
        exact, FRESH, [ClearanceAtWear(FRESH + factor * wear, 5e-6, wear)]
    )
    assert math.exp(coefficient_estimate.mean) == pytest.approx(factor, rel=0.02 / factor + 0.01)
    assert coefficient_estimate.sigma == pytest.approx(5e-6 / (factor * wear), rel=0.2)


@given(st.floats(-3.0, 3.0), st.floats(-7.0, -4.0))
def test_exact_measurements_are_believed_however_far_they_are_from_the_prior(power, sigma_power):
    """Two measurements of one part: their difference is the factor times the wear between them."""
    factor, sigma = 10.0**power, 10.0**sigma_power * 10.0**power * 1e-3
    observations = [
        ClearanceAtWear(FRESH, sigma, 0.0),
        ClearanceAtWear(FRESH + factor * 1e-4, sigma, 1e-4),
    ]
    coefficient_estimate = estimate_coefficient(
        attrs.evolve(PRIOR, new_clearance_sigma=1e-3 / FRESH), FRESH, observations
    )
    spread = sigma * math.sqrt(2.0) / (factor * 1e-4)
    p10, p50, p90 = np.exp(coefficient_estimate.log_factors((0.1, 0.5, 0.9)))
    # the prior's pull is its slope times the variance of what was measured
    assert math.log(p50 / factor) == pytest.approx(0.0, abs=spread + 40.0 * spread**2)
    assert coefficient_estimate.sigma == pytest.approx(spread, rel=0.05)
    z = statistics.NormalDist().inv_cdf(0.9)
    assert math.log(p90 / p50) == pytest.approx(z * spread, rel=0.1)
    assert math.log(p50 / p10) == pytest.approx(z * spread, rel=0.1)


@pytest.mark.parametrize("factor", [0.02, 60.0, 200.0, 5000.0])
def test_an_accepted_measurement_moves_the_belief_as_far_as_it_says(factor):
    result = found(worn(1e-6 if factor > 1.0 else 1e-4), 1e3 * (FRESH + factor * 1e-6), accept=True)
    if factor > 1.0:
        low, middle, high = np.exp(result.after.log_factors((0.1, 0.5, 0.9)))
        assert middle == pytest.approx(factor, rel=0.5 if factor < 100.0 else 0.05)
        assert 0.0 < low < middle < high
        assert f"{middle:.3g} times the nominal one" in result.words[-1]
    else:  # next to no wear where the twin has counted much
        assert np.exp(result.after.log_factors(0.9)) < 0.2


@given(st.permutations(range(4)))
def test_the_order_of_measurements_does_not_matter(order):
    observations = [ClearanceAtWear(FRESH + 1e-5 * (i + 1), 3e-6 + 1e-6 * i, 0.8e-5 * i) for i in range(4)]
    one, other = (
        estimate_coefficient(PRIOR, FRESH, observations),
        estimate_coefficient(PRIOR, FRESH, [observations[i] for i in order]),
    )
    np.testing.assert_allclose(one.weight, other.weight, rtol=1e-6, atol=1e-12)


def test_a_new_part_s_measurement_tells_its_clearance_and_nothing_of_the_coefficient():
    coefficient_estimate = estimate_coefficient(PRIOR, FRESH, [ClearanceAtWear(3.05e-4, 5e-6, 0.0)])
    assert coefficient_estimate.sigma == pytest.approx(USUAL_SPREAD, rel=1e-3)
    # equal sigmas: half of what was found, and 1 / sqrt 2 of the spread
    np.testing.assert_allclose(coefficient_estimate.excess_m, 2.5e-6)
    assert coefficient_estimate.excess_sigma_m == pytest.approx(5e-6 / math.sqrt(2.0))


def test_a_later_measurement_knows_the_clearance_when_new():
    alone = estimate_coefficient(PRIOR, FRESH, [ClearanceAtWear(3.5e-4, 2e-6, 5e-5)])
    both = estimate_coefficient(
        PRIOR, FRESH, [ClearanceAtWear(3.0e-4, 2e-6, 0.0), ClearanceAtWear(3.5e-4, 2e-6, 5e-5)]
    )
    assert both.sigma < 0.7 * alone.sigma


def test_measurements_that_repeat_the_same_model_are_expected_evenly():
    """Probability integral transform: figures drawn from the belief fall evenly into it."""
    random, wear = np.random.default_rng(3), 6e-5
    coefficient_estimate = estimate_coefficient(PRIOR, FRESH)
    drawn = FRESH + PRIOR.new_clearance_sigma * FRESH * random.standard_normal(400)
    drawn += wear * np.exp(USUAL_SPREAD * random.standard_normal(400))
    drawn += 5e-6 * random.standard_normal(400)
    below = [coefficient_estimate.probability_below(ClearanceAtWear(c, 5e-6, wear)) for c in drawn]
    assert 0.75 <= np.mean((np.array(below) > 0.1) & (np.array(below) < 0.9)) <= 0.85
    assert np.mean(below) == pytest.approx(0.5, abs=0.05)


def test_a_measurement_says_in_words_what_it_taught():
    assert "adds little" in found(worn(2e-7), 0.302).words[0]
    result = found(worn(6e-5), 0.42)
    assert not result.contradicts
    assert result.measurement.counts
    (line,) = result.words
    assert line.startswith("the wear coefficient is 1.9")
    assert "times smaller than before" in line


def test_a_contradiction_is_said_and_kept_but_does_not_count():
    result = found(worn(1e-5), 0.9)
    assert (result.contradicts, result.measurement.counts) == (True, False)
    assert "contradicts the model: the clearance of A is far larger" in result.words[0]
    assert "if the part was replaced, reset its wear first" in result.words[1]
    assert result.after.observations == 0
    # and the next one is judged as if it had not been
    assert not found(worn(1e-5), 0.31, [result.measurement]).contradicts
    asked_for = found(worn(1e-5), 0.9, accept=True)
    assert (asked_for.measurement.counts, asked_for.after.observations) == (True, 1)
    assert asked_for.after.mean > 1.0
    assert "--accept" in result.words[1] and "--accept" not in " ".join(asked_for.words)


def test_an_accepted_measurement_that_no_wear_explains_is_doubted_in_words():
    """Also where the drive torque shows it: it explains the clearance, not the coefficient."""
    result = found(worn(5e-11), 0.63, accept=True)
    assert "that is 6.6e-09 1/Pa, usually below 1e-09 1/Pa" in result.words[-1]
    shown = attrs.evolve(result, shown_m=0.6e-3, shown_sigma_m=0.05e-3, shown_by="the drive torque")
    assert result.words[-1] in attrs.evolve(shown, limit_m=1e-3).lines
    assert "usual" not in found(worn(1e-6), 0.33, accept=True).words[-1]


def test_a_clearance_smaller_than_when_new_contradicts_too():
    result = found(worn(6e-5), 0.2)
    assert result.contradicts
    assert "far smaller" in result.words[0]


def test_measurements_of_a_part_that_was_replaced_say_nothing_of_the_new_one():
    old = found(worn(6e-5), 0.42).measurement
    result = found(worn(6e-5, replaced_ns=5), 0.34, [old])
    assert result.before.observations == 0
    assert result.after.observations == 1


def test_a_clock_that_has_jumped_is_said_and_changes_nothing():
    early, right = found(worn(6e-5), 0.42, stamp_ns=HOUR, kept_ns=3 * HOUR), found(worn(6e-5), 0.42)
    assert "the clock is 2 h before the ledger's last entry" in early.words[0]
    np.testing.assert_array_equal(early.after.weight, right.after.weight)


@given(st.floats(0.02, 3.0), st.floats(-1.0, 60.0), st.floats(0.1, 10.0))
def test_the_estimate_is_its_prior_times_the_likelihood(sigma, factor, own):
    """Against a sum over a wide and fine grid."""
    exact = Forecasting(new_clearance_sigma=1e-9 / FRESH)
    observation = ClearanceAtWear(3.0e-4 + factor * 1e-5, own * 1e-5, 1e-5)
    found = estimate_coefficient(exact, 3.0e-4, [observation], CoefficientPrior(sigma=sigma))
    u = np.linspace(-12.0 * sigma - 5.0, 12.0 * sigma + 5.0, 200_001)
    density = -0.5 * (u / sigma) ** 2 - 0.5 * ((np.exp(u) - factor) / own) ** 2
    weight = np.exp(density - density.max())
    weight /= weight.sum()
    assert found.mean == pytest.approx(weight @ u, abs=0.01 * found.sigma + 2e-4)
    assert found.sigma == pytest.approx(np.sqrt(weight @ (u - weight @ u) ** 2), rel=0.02)
    assert found.weight[[0, -1]].max() < 1e-6

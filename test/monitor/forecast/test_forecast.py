"""The forecast of the remaining life, and the growth laws behind it."""

import math
import statistics
from statistics import NormalDist

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.mechanism.materials import USUAL_SPREAD
from leg_wear_monitor.monitor.config.settings import Forecasting
from leg_wear_monitor.monitor.forecast.forecast import Answer, JointCondition, cycles_to, forecast
from leg_wear_monitor.monitor.forecast.forecaster import (
    LEAST_CYCLES,
    Forecaster,
    GrowthRate,
    growth_rate,
)
from leg_wear_monitor.monitor.forecast.wear_coefficients import (
    ClearanceAtWear,
    CoefficientPrior,
    estimate_coefficient,
    when_new,
)
from leg_wear_monitor.monitor.ledger.entry import JointWear

# A forecast: wear coefficients, measurements, and what they tell of the life.


# Remaining life of joints and leg: closed forms, what widens it, what it refuses to say.


SETTINGS = Forecasting(model_sigma=0.05)
SURE = Forecasting(load_sigma=0.0, model_sigma=0.0, new_clearance_sigma=1e-6)
NOW = JointCondition(joint="A", fresh_m=3e-4, wear_m=0.0, limit_m=6e-4, growth_m=1.5e-11, growth_error_m=0.0)
B = attrs.evolve(NOW, joint="B", growth_m=5e-12)
Z = statistics.NormalDist().inv_cdf(0.9)


def whole(joints, settings=SETTINGS, observations=(), valid=True):
    """Forecast of joints; ``observations`` (joint's number, ClearanceAtWear)."""
    own = [[observation for at, observation in observations if at == k] for k in range(len(joints))]
    coefficient_estimates = [
        estimate_coefficient(when_new(settings, each.fresh_m), o) for each, o in zip(joints, own, strict=True)
    ]
    return forecast(joints, coefficient_estimates, settings, cycle_s=0.5, valid=valid)


def alone(now=NOW, settings=SETTINGS, observations=(), **more):
    return whole([now], settings, [(0, observation) for observation in observations], **more).joints[0]


def test_with_the_coefficient_alone_unknown_life_is_lognormal():
    result = alone(settings=SURE)
    assert result.answer is Answer.KNOWN
    assert result.cycles.p50 == pytest.approx(2e7 * math.log(2.0), rel=0.01)
    spread = math.exp(Z * USUAL_SPREAD)
    assert result.cycles.p90 / result.cycles.p50 == pytest.approx(spread, rel=0.02)
    assert result.cycles.p50 / result.cycles.p10 == pytest.approx(spread, rel=0.02)
    assert result.hours.p50 == pytest.approx(0.5 * result.cycles.p50 / 3600.0)


def test_what_is_not_known_adds_up_in_squares():
    load = attrs.evolve(SURE, load_sigma=0.5)
    noisy = attrs.evolve(NOW, growth_error_m=0.3 * NOW.growth_m)
    result = alone(noisy, load)
    both = math.sqrt(0.7**2 + 0.5**2 + 0.3**2)
    assert math.log(result.cycles.p90 / result.cycles.p10) == pytest.approx(2.0 * Z * both, rel=0.03)


@given(st.floats(0.1, 10.0))
def test_all_wear_faster_by_a_factor_is_life_shorter_by_it(factor):
    fast = attrs.evolve(NOW, growth_m=factor * NOW.growth_m)
    assert alone(fast).cycles.p10 == pytest.approx(alone().cycles.p10 / factor, rel=1e-9)


def test_a_measurement_narrows_and_moves_the_forecast():
    """The part was measured when it was new: else the error of its fit is in the first measurement."""
    now = attrs.evolve(NOW, wear_m=6e-5)
    before = alone(now)
    when_new = ClearanceAtWear(3e-4, 5e-6, 0.0)
    after = alone(now, observations=[when_new, ClearanceAtWear(3e-4 + 1.5 * 6e-5, 5e-6, 6e-5)])
    assert after.cycles.p50 < 0.75 * before.cycles.p50
    lives = [math.log(one.cycles.p90 / one.cycles.p10) for one in (before, after)]
    assert lives[1] < lives[0] / 3.0
    widths_m = [one.clearance_m.p90 - one.clearance_m.p10 for one in (before, after)]
    assert widths_m[1] < 0.2 * widths_m[0]
    assert after.measurements == 2


@pytest.mark.parametrize(
    ("changes", "answer"),
    [
        ({"growth_m": None}, Answer.NOT_ENOUGH_DATA),
        ({"growth_m": 0.0}, Answer.NO_GROWTH),
        ({"valid": False}, Answer.OUTSIDE_VALIDITY),
        ({"valid": False, "growth_m": None}, Answer.OUTSIDE_VALIDITY),
    ],
)
def test_what_cannot_be_known_is_said(changes, answer):
    valid = changes.pop("valid", True)
    result = whole([attrs.evolve(NOW, **changes)], valid=valid)
    for each in (result.joints[0], result.leg):
        assert (each.answer, each.cycles, each.hours) == (answer, None, None)
    assert (result.leg.first, result.leg.first_probability) == (None, {})


def test_at_the_limit_nothing_remains_whatever_else():
    result = whole([B, attrs.evolve(NOW, wear_m=3.1e-4, growth_m=None)], valid=False)
    for each in (result.joints[1], result.leg):
        assert each.answer is Answer.AT_LIMIT
        assert attrs.astuple(each.cycles) == (0.0, 0.0, 0.0)
    assert result.joints[0].answer is Answer.OUTSIDE_VALIDITY
    assert result.leg.first_probability == {"B": 0.0, "A": 1.0}


def test_a_leg_of_one_joint_lasts_as_long_as_it():
    result = whole([NOW])
    assert result.leg.cycles == result.joints[0].cycles
    assert (result.leg.first, result.leg.first_probability) == ("A", {"A": 1.0})


def test_a_leg_ends_with_the_first_of_two_lognormal_lives():
    """The smaller of two; the probability that it is A's is that of a difference of normals."""
    result = whole([NOW, B], SURE).leg
    gap = math.log(NOW.growth_m / B.growth_m) / (math.sqrt(2.0) * USUAL_SPREAD)
    assert result.first == "A"
    assert result.first_probability["A"] == pytest.approx(statistics.NormalDist().cdf(gap), abs=0.01)
    random = np.random.default_rng(0)
    lives = np.array([[2e7], [6e7]]) / np.exp(USUAL_SPREAD * random.standard_normal((2, 200_000)))
    first, other = np.sort(lives, axis=0)  # at the present growth, which rises with the mean clearance
    rise = 0.5 * (1.0 + first / other)
    expected = np.quantile(first * np.log1p(rise) / rise, (0.1, 0.5, 0.9))
    np.testing.assert_allclose(attrs.astuple(result.cycles), expected, rtol=0.03)


def test_a_joint_without_a_growth_rate_leaves_the_leg_partly_known():
    result = whole([NOW, attrs.evolve(B, growth_m=None)])
    assert [each.answer for each in result.joints] == [Answer.KNOWN, Answer.NOT_ENOUGH_DATA]
    assert result.leg.answer is Answer.PARTLY_KNOWN
    assert result.leg.cycles == result.joints[0].cycles


def test_a_joint_without_a_growth_rate_does_not_end_the_leg_by_what_its_clearance_may_be():
    """Seen before: the leg was at its limit now with 10 %, of a joint that is said to be left out."""
    near = attrs.evolve(B, growth_m=None, wear_m=2.8e-4)
    unsure = attrs.evolve(SURE, new_clearance_sigma=2e-5 / 3e-4)
    result = whole([NOW, near], unsure)
    assert result.joints[1].clearance_m.p90 > near.limit_m
    assert (result.leg.answer, result.leg.cycles) == (Answer.PARTLY_KNOWN, result.joints[0].cycles)
    assert result.leg.first_probability == {"A": 1.0, "B": 0.0}


@pytest.mark.parametrize("wear_m", [0.0, 2.98e-4])
def test_a_joint_that_does_not_grow_never_ends_the_leg(wear_m):
    """Nor by a clearance that may be at its limit."""
    result = whole([NOW, attrs.evolve(B, growth_m=0.0, wear_m=wear_m)])
    assert (result.leg.answer, result.leg.cycles) == (Answer.KNOWN, result.joints[0].cycles)
    assert result.leg.first_probability == {"A": 1.0, "B": 0.0}


# What a measured clearance teaches: limits that are known in closed form, order, parts, contradictions.


FRESH = 3.0e-4
PRIOR = Forecasting(new_clearance_sigma=5e-6 / FRESH)
LEG = load_mechanism("bionic_leg")
HOUR = 3_600_000_000_000


def worn(wear_m, cycles=1000, replaced_ns=0):
    """Joint A with so much wear."""
    return JointWear("A", np.full((2, 720), 0.5 * wear_m), cycles, float(cycles), replaced_ns)


def found(wear, mm, earlier=(), **more):
    """What a clearance in mm says, good to 5 µm."""
    given = {"sigma_m": 5e-6, "stamp_ns": 9 * HOUR, "who": "ann", **more}
    forecaster = Forecaster(LEG, PRIOR, earlier, [wear.replaced_ns] * len(LEG.clearance_joints))
    return forecaster.measured(wear, clearance_m=1e-3 * mm, **given)


def test_without_a_measurement_the_belief_is_the_lognormal_prior():
    coefficient_estimate = estimate_coefficient(when_new(PRIOR, FRESH))
    assert coefficient_estimate.mean == pytest.approx(0.0, abs=1e-12)
    assert coefficient_estimate.sigma == pytest.approx(USUAL_SPREAD, rel=1e-3)
    z = statistics.NormalDist().inv_cdf(0.9)
    assert coefficient_estimate.log_factors(0.9) == pytest.approx(USUAL_SPREAD * z, rel=1e-3)


@given(st.floats(0.3, 3.0))
def test_an_accurate_measurement_of_much_wear_tells_the_factor(factor):
    exact = attrs.evolve(PRIOR, new_clearance_sigma=1e-7 / FRESH)
    wear = 1e-4
    coefficient_estimate = estimate_coefficient(
        when_new(exact, FRESH), [ClearanceAtWear(FRESH + factor * wear, 5e-6, wear)]
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
        when_new(attrs.evolve(PRIOR, new_clearance_sigma=1e-3 / FRESH), FRESH), observations
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
        assert f"{middle:.3g} times the nominal one" in result.lines[-1]
    else:  # next to no wear where the twin has counted much
        assert np.exp(result.after.log_factors(0.9)) < 0.2


@given(st.permutations(range(4)))
def test_the_order_of_measurements_does_not_matter(order):
    observations = [ClearanceAtWear(FRESH + 1e-5 * (i + 1), 3e-6 + 1e-6 * i, 0.8e-5 * i) for i in range(4)]
    one, other = (
        estimate_coefficient(when_new(PRIOR, FRESH), observations),
        estimate_coefficient(when_new(PRIOR, FRESH), [observations[i] for i in order]),
    )
    np.testing.assert_allclose(one.weight, other.weight, rtol=1e-6, atol=1e-12)


def test_a_new_part_s_measurement_tells_its_clearance_and_nothing_of_the_coefficient():
    coefficient_estimate = estimate_coefficient(when_new(PRIOR, FRESH), [ClearanceAtWear(3.05e-4, 5e-6, 0.0)])
    assert coefficient_estimate.sigma == pytest.approx(USUAL_SPREAD, rel=1e-3)
    # equal sigmas: half of what was found, and 1 / sqrt 2 of the spread
    np.testing.assert_allclose(coefficient_estimate.excess_m, 2.5e-6)
    assert coefficient_estimate.excess_sigma_m == pytest.approx(5e-6 / math.sqrt(2.0))


def test_a_later_measurement_knows_the_clearance_when_new():
    alone = estimate_coefficient(when_new(PRIOR, FRESH), [ClearanceAtWear(3.5e-4, 2e-6, 5e-5)])
    both = estimate_coefficient(
        when_new(PRIOR, FRESH), [ClearanceAtWear(3.0e-4, 2e-6, 0.0), ClearanceAtWear(3.5e-4, 2e-6, 5e-5)]
    )
    assert both.sigma < 0.7 * alone.sigma


def test_measurements_that_repeat_the_same_model_are_expected_evenly():
    """Probability integral transform: figures drawn from the belief fall evenly into it."""
    random, wear = np.random.default_rng(3), 6e-5
    coefficient_estimate = estimate_coefficient(when_new(PRIOR, FRESH))
    drawn = FRESH + PRIOR.new_clearance_sigma * FRESH * random.standard_normal(400)
    drawn += wear * np.exp(USUAL_SPREAD * random.standard_normal(400))
    drawn += 5e-6 * random.standard_normal(400)
    below = [coefficient_estimate.probability_below(ClearanceAtWear(c, 5e-6, wear)) for c in drawn]
    assert 0.75 <= np.mean((np.array(below) > 0.1) & (np.array(below) < 0.9)) <= 0.85
    assert np.mean(below) == pytest.approx(0.5, abs=0.05)


def test_a_measurement_says_what_it_taught():
    assert found(worn(2e-7), 0.302).findings[-1] == "adds_little"
    result = found(worn(6e-5), 0.42)
    assert (result.contradicts, result.measurement.counts) == (False, True)
    assert result.findings == ("measured", "modelled", "coefficient")
    assert result.before.sigma > result.after.sigma


def test_a_contradiction_is_said_and_kept_but_does_not_count():
    result = found(worn(1e-5), 0.9)
    assert (result.contradicts, result.measurement.counts) == (True, False)
    assert result.findings == ("measured", "modelled", "not_accepted")
    assert result.after.observations == 0
    # and the next one is judged as if it had not been
    assert not found(worn(1e-5), 0.31, [result.measurement]).contradicts
    asked_for = found(worn(1e-5), 0.9, accept=True)
    assert (asked_for.measurement.counts, asked_for.after.observations) == (True, 1)
    assert asked_for.after.mean > 1.0
    assert asked_for.findings[2] == "accepted"


def test_a_clearance_smaller_than_when_new_contradicts_too():
    result = found(worn(6e-5), 0.2)
    assert result.contradicts and result.measurement.expected_below < 0.5


def test_measurements_of_a_part_that_was_replaced_say_nothing_of_the_new_one():
    old = found(worn(6e-5), 0.42).measurement
    result = found(worn(6e-5, replaced_ns=5), 0.34, [old])
    assert result.before.observations == 0
    assert result.after.observations == 1


@pytest.mark.parametrize("is_measured", [True, False])
def test_a_changed_coefficient_keeps_the_clearance_and_what_was_measured(is_measured):
    """The product of factor and coefficient stays if it was measured; otherwise the new coefficient holds."""
    earlier = [found(worn(6e-5), 0.42).measurement] if is_measured else []
    wear = attrs.evolve(worn(6e-5), wear_coefficient_per_pa=1e-15)
    replaced_ns = [0] * len(LEG.clearance_joints)
    forecaster = Forecaster(LEG, PRIOR, earlier, replaced_ns)
    before = forecaster.coefficient_estimates[0]
    correction = forecaster.other_coefficient(wear, 2e-15, HOUR)
    after = forecaster.coefficient_estimates[0]
    assert after.mean == pytest.approx(before.mean - math.log(2.0) * is_measured, abs=0.01)
    assert after.sigma == pytest.approx(before.sigma, rel=0.01)
    for one in ("clearance_m", "clearance_sigma_m"):
        then, now = (getattr(each, one)(wear.mean_m) for each in (before, after))
        assert now == pytest.approx(then, rel=1e-3)
    again = Forecaster(LEG, PRIOR, earlier, replaced_ns, [correction]).coefficient_estimates[0]
    np.testing.assert_array_equal(again.weight, after.weight)


@given(st.floats(0.02, 3.0), st.floats(-1.0, 60.0), st.floats(0.1, 10.0))
def test_the_estimate_is_its_prior_times_the_likelihood(sigma, factor, own):
    """Against a sum over a wide and fine grid."""
    exact = Forecasting(new_clearance_sigma=1e-9 / FRESH)
    observation = ClearanceAtWear(3.0e-4 + factor * 1e-5, own * 1e-5, 1e-5)
    found = estimate_coefficient(when_new(exact, 3.0e-4), [observation], CoefficientPrior(sigma=sigma))
    u = np.linspace(-12.0 * sigma - 5.0, 12.0 * sigma + 5.0, 200_001)
    density = -0.5 * (u / sigma) ** 2 - 0.5 * ((np.exp(u) - factor) / own) ** 2
    weight = np.exp(density - density.max())
    weight /= weight.sum()
    assert found.mean == pytest.approx(weight @ u, abs=0.01 * found.sigma + 2e-4)
    assert found.sigma == pytest.approx(np.sqrt(weight @ (u - weight @ u) ** 2), rel=0.02)
    assert found.weight[[0, -1]].max() < 1e-6


# Growth of clearances: the fit, the law, the error of the model.


# Growth: exact for even growth, honest about scatter, silent without enough data.


P90 = NormalDist().inv_cdf(0.9)


def rate_of(growths, moving_s=1.0):
    return growth_rate(np.array(growths), np.full(len(growths), moving_s))


@given(st.just(0.0) | st.floats(1e-15, 1e-6), st.floats(0.1, 10.0), st.integers(LEAST_CYCLES, 60))
def test_even_growth_is_known_exactly(growth, period_s, n):
    rate = rate_of([growth] * n, period_s)
    assert rate.per_cycle_m == pytest.approx(growth, rel=1e-12)
    assert rate.per_second_m == pytest.approx(growth / period_s, rel=1e-12)
    assert rate.sampling_m == pytest.approx(0.0, abs=1e-12 * growth)
    assert rate.error_m(0.03) == pytest.approx(0.03 * growth)  # a model that is off remains


@given(st.integers(0, LEAST_CYCLES - 1))
def test_too_few_cycles_are_not_enough(n):
    assert rate_of([1.0e-12] * n) is None


def test_scatter_as_large_as_the_mean_is_not_enough():
    growths = np.zeros(30)
    growths[7] = 1.0e-12
    assert rate_of(growths) is None


@given(st.lists(st.floats(1e-14, 1e-9), min_size=LEAST_CYCLES, max_size=60))
def test_what_is_said_adds_up(growths):
    rate = rate_of(growths)
    if rate is not None:
        assert rate.per_cycle_m * len(growths) == pytest.approx(sum(growths), rel=1e-9)


def covered(random, correlation, cycles, legs=1500):
    """Fraction of 80 % intervals that hold the truth, 1: growth that hangs together from cycle to cycle."""
    scatter = random.standard_normal((legs, cycles))
    for i in range(1, cycles):
        scatter[:, i] = correlation * scatter[:, i - 1] + (1.0 - correlation**2) ** 0.5 * scatter[:, i]
    rates = [growth_rate(1.0 + 0.15 * row, np.ones(cycles)) for row in scatter]
    return np.mean([abs(rate.per_cycle_m - 1.0) <= P90 * rate.error_m(0.0) for rate in rates])


# a fraction of 0.8 of 1500 scatters by 0.0103; batches are long enough for cycles that hang together
@pytest.mark.parametrize(("correlation", "cycles"), [(0.0, 10), (0.0, 30), (0.3, 60), (0.6, 300)])
def test_an_interval_of_80_percent_holds_the_truth_in_80_percent(correlation, cycles):
    assert covered(np.random.default_rng(7), correlation, cycles) == pytest.approx(0.8, abs=4.0 * 0.0103)


def test_the_interval_narrows_with_the_square_root_of_the_window():
    random = np.random.default_rng(8)

    def width(cycles):
        growth = 1.0 + 0.15 * random.standard_normal((400, cycles))
        return np.mean([growth_rate(row, np.ones(cycles)).sampling_m for row in growth])

    # 400 standard errors of four degrees of freedom: each scatters by 0.36, their mean by 0.018
    assert width(30) / width(270) == pytest.approx(3.0, rel=4.0 * 0.018 * 2.0**0.5)


def test_scatter_and_model_are_independent():
    rate = GrowthRate(per_cycle_m=1.0e-11, sampling_m=3.0e-13, per_second_m=1.0e-11)
    assert rate.error_m(0.04) == pytest.approx(5.0e-13)


# Joints that grow together: closed forms, and what must hold for any leg.


FRESH_M = np.array([3e-4, 2e-4, 3e-4])
LIMIT_M = np.array([6e-4, 3e-4, 5e-4])
GROWTH_M = np.array([2e-11, 5e-12, 7e-12])
factors = st.tuples(*[st.floats(0.2, 5.0)] * 3).map(np.array)


def ends(clearance_m=FRESH_M, growth_m=GROWTH_M, limit_m=LIMIT_M, fresh_m=FRESH_M):
    columns = (np.array(each, float)[:, None] for each in (limit_m, clearance_m, growth_m, fresh_m))
    return cycles_to(*columns)[:, 0]


@given(st.floats(1.0, 1.9), st.floats(0.2, 5.0))
def test_a_joint_alone_grows_exponentially(opened, factor):
    (found,) = ends([opened * 3e-4], [factor * 1e-11], [6e-4], [3e-4])
    assert found == pytest.approx(opened * 3e-4 * math.log(2.0 / opened) / (factor * 1e-11), rel=1e-9)


def test_the_growth_is_that_of_small_steps():
    clearance, cycles, found = FRESH_M.copy(), 0.0, np.full(3, np.nan)
    step = 2e3
    while np.isnan(found).any():
        going = clearance < LIMIT_M
        factor = (clearance / FRESH_M).mean()
        clearance = np.where(going, np.minimum(clearance + step * factor * GROWTH_M, LIMIT_M), clearance)
        cycles += step
        found = np.where(going & (clearance >= LIMIT_M), cycles, found)
    np.testing.assert_allclose(ends(), found, rtol=1e-3)


@given(st.floats(0.05, 20.0), factors)
def test_all_factors_alike_only_change_the_pace(pace, factor):
    growth_m = factor * GROWTH_M
    np.testing.assert_allclose(ends(growth_m=pace * growth_m), ends(growth_m=growth_m) / pace, rtol=1e-9)


@given(factors, st.integers(0, 2), st.floats(1.01, 1.5))
def test_a_wider_limit_is_reached_later(factor, k, wider):
    limit_m = LIMIT_M.copy()
    limit_m[k] *= wider
    growth_m = factor * GROWTH_M
    assert ends(growth_m=growth_m, limit_m=limit_m)[k] > ends(growth_m=growth_m)[k]


def test_a_joint_at_its_limit_stays_there_and_one_that_does_not_grow_never_ends():
    found = ends([7e-4, 2e-4, 3e-4], [2e-11, 0.0, 7e-12])
    assert (found[0], found[1]) == (0.0, np.inf)
    assert found[2] == ends([7e-4, 2e-4, 3e-4], [0.0, 0.0, 7e-12])[2]

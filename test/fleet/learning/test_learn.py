"""Learning across legs: exact sums without a normal approximation, order, lots, outliers, and coverage."""

import math

import attrs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from leg_wear_monitor.fleet.learning import LOT_FRACTION, PAIR_FRACTION, PART_FRACTION, Part, learn, variances
from leg_wear_monitor.monitor.forecast.wear_coefficients import CoefficientPrior

pytestmark = pytest.mark.plain

SIGMA, GROWTH_M, ERROR_M = 0.7, 6.0e-5, 7.0e-6
Z90, USUAL = 1.2815515655, CoefficientPrior(sigma=0.7, basis="usual")


def part(leg, lot="2026-03", factor=1.0, sigma=0.1, **more):
    """A part whose measured factor has this standard deviation; not measured without one."""
    precision = sigma**-2.0 if sigma else 0.0
    given = {"joint": "A", "pair": "steel", "nominal_per_pa": 2e-15, "prior": USUAL, **more}
    return Part(leg=leg, lot=lot, factor=factor, precision=precision, **given)


def measured(random, leg, lot, log_factor, growth_m=GROWTH_M):
    """A part with this ln x, measured after this counted wear."""
    sigma = ERROR_M / growth_m
    return part(leg, lot, math.exp(log_factor) + sigma * random.standard_normal(), sigma)


def fleet(random, lots, legs, growth_m=GROWTH_M, scale=1.0):
    """Parts of some lots of so many legs each, and their ln x, drawn from the model with scaled variances."""
    fractions = PAIR_FRACTION, LOT_FRACTION, PART_FRACTION
    pair, between, within = (SIGMA * math.sqrt(scale * one) for one in fractions)
    centre, drawn = pair * random.standard_normal(), []
    for lot in range(lots):
        level = centre + between * random.standard_normal()
        for leg in range(legs):
            log_factor = level + within * random.standard_normal()
            drawn.append((measured(random, f"{lot}-{leg}", f"lot {lot}", log_factor, growth_m), log_factor))
    return drawn


def test_without_a_measurement_nothing_is_learned():
    assert learn([part("a", sigma=0.0), part("b", sigma=0.0)]) == {}


def test_pairs_do_not_learn_from_each_other():
    steel, bronze = [part(str(i), factor=3.0) for i in range(4)], part("x", pair="bronze")
    both = learn([*steel, bronze])
    assert both["steel"] == learn(steel)["steel"]
    (alone,) = both["bronze"].measured
    assert alone.prior == USUAL


@settings(max_examples=10)
@given(st.permutations(range(9)))
def test_the_order_of_parts_does_not_matter_to_the_bit(order):
    random = np.random.default_rng(2)
    parts = [one for one, _ in fleet(random, 3, 3)]
    assert learn([parts[i] for i in order]) == learn(parts)


@settings(max_examples=10)
@given(st.floats(0.2, 5.0), st.floats(0.05, 1.0))
def test_names_of_legs_do_not_matter(factor, sigma):
    others = [part("b", factor=2.0), part("c", factor=0.7, sigma=0.3)]
    one, other = (learn([*others, part(leg, factor=factor, sigma=sigma)]) for leg in ("a", "z"))
    assert one["steel"].lots["2026-03"].mean == pytest.approx(other["steel"].lots["2026-03"].mean, abs=1e-9)
    assert one["steel"].new_lot.sigma == pytest.approx(other["steel"].new_lot.sigma, abs=1e-9)


def test_a_prior_leaves_its_own_part_out():
    others = [part(str(i), factor=1.5) for i in range(5)]
    one, other = (learn([*others, part("x", factor=factor)])["steel"].measured[-1] for factor in (1.0, 2.0))
    assert one.part.leg == other.part.leg == "x"
    # the likelihood of x is approximated elsewhere, which moves nothing but x
    assert one.prior.mean == pytest.approx(other.prior.mean, abs=1e-3)
    assert one.prior.basis == "5 parts of lot 2026-03"


def test_a_new_part_of_a_known_lot_is_nearer_to_it_than_one_of_a_new_lot():
    parts = [part(f"a{i}", "fast", 3.0) for i in range(8)] + [part(f"b{i}", "slow", 0.5) for i in range(8)]
    found = learn([*parts, part("c", "unmeasured", sigma=0.0)])["steel"]
    fast, slow = found.lots["fast"], found.lots["slow"]
    assert slow.mean < found.new_lot.mean < fast.mean
    assert max(fast.sigma, slow.sigma) < found.new_lot.sigma
    assert found.lots["unmeasured"] == found.new_lot
    assert fast.basis == "8 parts of lot fast and 8 of other lots"
    assert found.new_lot.basis == "16 parts of other lots"


def test_parts_of_unknown_lots_have_lots_of_their_own():
    parts = [part(f"a{i}", "", 1.0 + 0.2 * i) for i in range(4)]
    apart = [attrs.evolve(each, lot=f"lot {i}") for i, each in enumerate(parts)]
    one, other = (learn(each)["steel"].new_lot for each in (parts, apart))
    assert (one.mean, one.sigma) == pytest.approx((other.mean, other.sigma), rel=1e-12)


@pytest.mark.parametrize("factor", [9.0, -3.0])
def test_an_outlier_is_named_and_the_others_are_forecast_as_without_it(factor):
    good = [part(f"a{i:02d}", factor=1.0 + 0.03 * (i % 5)) for i in range(20)]
    found, without = learn([*good, part("bad", factor=factor)])["steel"], learn(good)["steel"]
    for one, other in ((found.lots["2026-03"], without.lots["2026-03"]), (found.new_lot, without.new_lot)):
        assert (one.mean, one.sigma) == pytest.approx((other.mean, other.sigma), rel=1e-9)
        assert one.basis == other.basis
    (bad,) = [each for each in found.measured if not each.counts]
    assert bad.part.leg == "bad"
    assert abs(bad.residual) > 4.0
    assert bad.prior.basis == "20 parts of lot 2026-03"
    direction = "faster" if factor > 0.0 else "slower"
    assert bad.finding.startswith(f"joint A wears {direction} than 20 parts of lot 2026-03 predict")
    assert not any(each.finding for each in found.measured if each.counts)


def test_of_two_that_contradict_each_other_both_count_and_both_are_named():
    found = learn([part("a", factor=0.1, sigma=0.01), part("b", factor=60.0)])["steel"]
    assert [each.counts for each in found.measured] == [True, True]
    assert all("too few others" in each.finding for each in found.measured if abs(each.residual) > 4.0)


def exact(parts, lots):
    """Mean and standard deviation of ln x of a further part of each lot, by sums over grids alone."""
    grid, u = variances(SIGMA), np.linspace(-6.0, 3.0, 361)
    log_likelihood = np.array([-0.5 * p.precision * (np.exp(u) - p.factor) ** 2 for p in parts])
    likelihood = np.exp(log_likelihood - log_likelihood.max(axis=1, keepdims=True))
    own = np.array([lots.index(p.lot) for p in parts])
    nodes = []
    for b, between_parts in enumerate(grid.part):
        spread = np.exp(-0.5 * (u[:, None] - u) ** 2 / between_parts) / math.sqrt(between_parts)
        log_level = np.log(likelihood @ spread + 1e-300)
        of_lot = np.array([log_level[own == k].sum(axis=0) for k in range(len(lots))])
        scale = of_lot.max(axis=1)
        for a, between_lots in enumerate(grid.lot):
            spread = np.exp(-0.5 * (u[:, None] - u) ** 2 / between_lots) / math.sqrt(between_lots)
            to_pair = np.log(np.exp(of_lot - scale[:, None]) @ spread + 1e-300)
            pair = to_pair.sum(axis=0) - 0.5 * u**2 / grid.pair
            log_weight = grid.log_prior[a, b] + scale.sum() + np.logaddexp.reduce(pair)
            row = [log_weight]
            for k in range(len(lots)):
                rest = pair - to_pair[k]
                level = np.log(np.exp(rest - rest.max()) @ spread + 1e-300) + of_lot[k] - scale[k]
                density = np.exp(level - level.max())
                mean = density @ u / density.sum()
                row += [mean, density @ (u - mean) ** 2 / density.sum() + between_parts]
            nodes.append(row)
    nodes = np.array(nodes)
    weight = np.exp(nodes[:, 0] - nodes[:, 0].max())
    weight /= weight.sum()
    mean = weight @ nodes[:, 1::2]
    return mean, np.sqrt(weight @ (nodes[:, 2::2] + (nodes[:, 1::2] - mean) ** 2))


@pytest.mark.parametrize(("growth_m", "tolerance"), [(6.0e-5, 0.02), (1.5e-5, 0.1)])
def test_the_approximation_agrees_with_exact_sums(growth_m, tolerance):
    """Growth of 9 and 2 times the error; in standard deviations of the prediction."""
    parts = [one for one, _ in fleet(np.random.default_rng(7), 3, 8, growth_m)]
    lots = ["lot 0", "lot 1", "lot 2"]
    found, (mean, sigma) = learn(parts)["steel"].lots, exact(parts, lots)
    for k, lot in enumerate(lots):
        assert found[lot].mean == pytest.approx(mean[k], abs=tolerance * sigma[k])
        assert found[lot].sigma == pytest.approx(sigma[k], rel=tolerance)


def test_coverage_and_narrowing_over_synthetic_fleets():
    """The interval p10 to p90 of the 1st, 5th and 20th leg of a lot contains 80 % of their true factors."""
    fleets, inside, sigma = 80, {1: 0, 5: 0, 20: 0}, {1: [], 5: [], 20: []}
    random = np.random.default_rng(11)
    for _ in range(fleets):
        drawn = fleet(random, 1, 20)
        for leg in inside:
            earlier = [one for one, _ in drawn[: leg - 1]]
            prior = learn(earlier)["steel"].lots["lot 0"] if earlier else drawn[0][0].prior
            inside[leg] += abs(drawn[leg - 1][1] - prior.mean) < Z90 * prior.sigma
            sigma[leg].append(prior.sigma)
    # three standard deviations of a binomial distribution
    for leg, count in inside.items():
        assert count / fleets == pytest.approx(0.8, abs=3.0 * math.sqrt(0.16 / fleets)), leg
    first, fifth, twentieth = (np.mean(sigma[leg]) for leg in (1, 5, 20))
    assert first == pytest.approx(SIGMA)
    assert twentieth < fifth < 0.7 * first
    # what is left is the spread within a lot, which no other part can tell
    assert SIGMA * math.sqrt(PART_FRACTION) < twentieth < 1.15 * SIGMA * math.sqrt(PART_FRACTION)

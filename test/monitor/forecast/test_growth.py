"""Growth of clearances: the fit, the law, the error of the model."""

from statistics import NormalDist

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.mechanism.person import PERSON_TOLERANCE, with_ground_reaction, with_person
from leg_wear_monitor.monitor.forecast.growth import (
    LEAST_CYCLES,
    GrowthLaw,
    GrowthRate,
    GrowthWindow,
    ModelError,
    SimulatedLife,
    cycles_to,
    fitted_law,
    growth_rate,
    model_error,
    no_law,
)
from leg_wear_monitor.twin.reference import MASS_TOLERANCE

# Growth: exact for even growth, honest about scatter, silent without enough data.


P90 = NormalDist().inv_cdf(0.9)


def window(growths, moving_s=1.0, cycles=30):
    found = GrowthWindow()
    for growth in growths:
        found = found.extended(growth, moving_s, cycles)
    return found


@given(st.just(0.0) | st.floats(1e-15, 1e-6), st.floats(0.1, 10.0), st.integers(LEAST_CYCLES, 60))
def test_even_growth_is_known_exactly(growth, period_s, n):
    rate = growth_rate(window([growth] * n, period_s))
    assert rate.per_cycle_m == pytest.approx(growth, rel=1e-12)
    assert rate.per_second_m == pytest.approx(growth / period_s, rel=1e-12)
    assert rate.sampling_m == pytest.approx(0.0, abs=1e-12 * growth)
    assert rate.error_m(0.03) == pytest.approx(0.03 * growth)  # a model that is off remains


@given(st.integers(0, LEAST_CYCLES - 1))
def test_too_few_cycles_are_not_enough(n):
    assert growth_rate(window([1.0e-12] * n)) is None


def test_scatter_as_large_as_the_mean_is_not_enough():
    growths = np.zeros(30)
    growths[7] = 1.0e-12
    assert growth_rate(window(growths)) is None


def test_only_the_last_cycles_count():
    growths = [5.0e-12] * 40 + [1.0e-12] * 30
    assert growth_rate(window(growths)).per_cycle_m == pytest.approx(1.0e-12)


@given(st.lists(st.floats(1e-14, 1e-9), min_size=LEAST_CYCLES, max_size=60))
def test_what_is_said_adds_up(growths):
    found = window(growths, cycles=100)
    rate = growth_rate(found)
    if rate is not None:
        assert rate.per_cycle_m * len(growths) == pytest.approx(sum(growths), rel=1e-9)


def covered(random, correlation, cycles, legs=1500):
    """Fraction of 80 % intervals that hold the truth, 1: growth that hangs together from cycle to cycle."""
    scatter = random.standard_normal((legs, cycles))
    for i in range(1, cycles):
        scatter[:, i] = correlation * scatter[:, i - 1] + (1.0 - correlation**2) ** 0.5 * scatter[:, i]
    rates = [growth_rate(GrowthWindow(1.0 + 0.15 * row, np.ones(cycles))) for row in scatter]
    return np.mean([abs(rate.per_cycle_m - 1.0) <= P90 * rate.error_m(0.0) for rate in rates])


# a fraction of 0.8 of 1500 scatters by 0.0103; batches are long enough for cycles that hang together
@pytest.mark.parametrize(("correlation", "cycles"), [(0.0, 10), (0.0, 30), (0.3, 60), (0.6, 300)])
def test_an_interval_of_80_percent_holds_the_truth_in_80_percent(correlation, cycles):
    assert covered(np.random.default_rng(7), correlation, cycles) == pytest.approx(0.8, abs=4.0 * 0.0103)


def test_the_interval_narrows_with_the_square_root_of_the_window():
    random = np.random.default_rng(8)

    def width(cycles):
        growth = 1.0 + 0.15 * random.standard_normal((400, cycles))
        return np.mean([growth_rate(GrowthWindow(row, np.ones(cycles))).sampling_m for row in growth])

    # 400 standard errors of four degrees of freedom: each scatters by 0.36, their mean by 0.018
    assert width(30) / width(270) == pytest.approx(3.0, rel=4.0 * 0.018 * 2.0**0.5)


def test_scatter_and_model_are_independent():
    rate = GrowthRate(per_cycle_m=1.0e-11, sampling_m=3.0e-13, per_second_m=1.0e-11)
    assert rate.error_m(0.04) == pytest.approx(5.0e-13)


# The law of growth: found again where it holds, and in closed form where joints do not act on each other.


FRESH = np.array([3e-4, 2e-4, 3e-4])
LIMIT = np.array([6e-4, 3e-4, 5e-4])
COUPLING = np.array([[0.3, -0.4, 0.2], [0.5, 0.1, 0.0], [-0.2, 0.6, 0.4]])
LAW = GrowthLaw(COUPLING, FRESH, np.full(3, 1e-3), np.full(3, 0.05))
BASE = np.array([2e-11, 5e-12, 7e-12])
factors = st.tuples(*[st.floats(0.2, 5.0)] * 3).map(np.array)


def one(law=LAW, clearance=FRESH, base=BASE, limit=LIMIT):
    return cycles_to(law, clearance[:, None], base[:, None], limit)[:, 0]


def lived(factor, noise=0.0, seed=0, steps=400):
    """A life by the law itself until the first joint is at its limit."""
    random = np.random.default_rng(seed)
    clearance, growth, cycles = [FRESH], [], [0.0]
    while True:
        rate = factor * BASE * np.exp(COUPLING @ np.log(clearance[-1] / FRESH))
        growth.append(rate * np.exp(noise * random.standard_normal(3)))
        if (clearance[-1] >= LIMIT).any():
            break
        jump = ((LIMIT - FRESH) / rate).min() / steps
        clearance.append(clearance[-1] + jump * rate)
        cycles.append(cycles[-1] + jump)
    return SimulatedLife(factor, np.array(cycles), np.array(clearance), np.array(growth))


SPREAD = [np.array(f) for f in ((1, 1, 1), (1, 3, 1), (1, 1, 4), (0.3, 1, 2), (0.5, 4, 1), (0.2, 2, 2))]


@given(factors)
def test_joints_that_do_not_act_on_each_other_last_as_long_as_they_grow(factor):
    cycles = one(no_law(FRESH, 0.1), base=factor * BASE)
    assert cycles == pytest.approx((LIMIT - FRESH) / (factor * BASE), rel=1e-9)


def test_one_joint_whose_growth_rises_with_its_clearance_has_a_closed_form():
    law = GrowthLaw(np.array([[0.8]]), FRESH[:1], np.array([1e-3]), np.zeros(1))
    cycles = one(law, FRESH[:1], BASE[:1], LIMIT[:1])
    # integral of (c / c_0)^-b dc over growth when new
    expected = FRESH[0] / 0.2 * ((LIMIT[0] / FRESH[0]) ** 0.2 - 1.0) / BASE[0]
    assert cycles == pytest.approx(expected, rel=1e-3)


@given(st.floats(0.05, 20.0), factors)
def test_all_factors_alike_only_change_the_pace(pace, factor):
    np.testing.assert_allclose(one(base=pace * factor * BASE), one(base=factor * BASE) / pace, rtol=1e-9)


@given(factors, st.integers(0, 2), st.floats(1.01, 1.5))
def test_a_wider_limit_is_reached_later(factor, k, wider):
    limit = LIMIT.copy()
    limit[k] *= wider
    base = factor * BASE
    assert one(base=base, limit=limit)[k] > one(base=base)[k]


@given(factors)
def test_steps_are_short_enough(factor):
    life = lived(factor)
    cycles = one(base=factor * BASE, limit=life.clearance_m[-1])
    np.testing.assert_allclose(cycles, life.cycles[-1], rtol=0.01)


def test_a_joint_at_its_limit_stays_there_and_one_that_does_not_grow_never_ends():
    clearance, base = FRESH.copy(), BASE.copy()
    clearance[0], base[1] = 1.2 * LIMIT[0], 0.0
    cycles = one(clearance=clearance, base=base)
    assert cycles[0] == 0.0
    assert cycles[1] == np.inf
    # as if the first were at its limit just now
    rate = BASE[2] * np.exp(COUPLING[2, 0] * np.log(LIMIT[0] / FRESH[0]))
    held = attrs.evolve(LAW, coupling=np.diag(np.diag(COUPLING)))
    alone = cycles_to(held, FRESH[:, None], np.array([[0.0], [0.0], [rate]]), LIMIT)
    assert cycles[2] == pytest.approx(alone[2, 0])


def test_beyond_what_lives_have_seen_growth_stays_as_it_is_there():
    law = attrs.evolve(LAW, widest_m=np.array([4e-4, 2.5e-4, 4e-4]))
    np.testing.assert_array_equal(law.log_growth(LIMIT[:, None]), law.log_growth(law.widest_m[:, None]))


def test_what_lives_have_not_seen_is_as_uncertain_as_without_lives():
    """From the law's own sigma, where they go to the limit, to that of a leg without lives, where nowhere."""
    law, k = attrs.evolve(LAW, sigma=np.full(3, 0.02)), len(FRESH)
    np.testing.assert_array_equal(law.sigma_to(law.widest_m, 0.4), 0.02)
    np.testing.assert_allclose(attrs.evolve(law, widest_m=FRESH).sigma_to(LIMIT, 0.4), 0.4)
    halfway = attrs.evolve(law, widest_m=np.sqrt(FRESH * LIMIT)).sigma_to(LIMIT, 0.4)
    np.testing.assert_allclose(halfway, np.sqrt(0.02**2 + 0.25 * (0.4**2 - 0.02**2)))
    np.testing.assert_array_equal(no_law(FRESH, 0.4).sigma_to(LIMIT, 0.4), np.full(k, 0.4))


def test_the_law_is_found_again_in_its_own_lives():
    law = fitted_law([lived(f) for f in SPREAD], sigma=0.3)
    np.testing.assert_allclose(law.coupling, COUPLING, atol=0.03)
    assert law.sigma.max() < 0.01
    assert law.lives == len(SPREAD)


def test_what_lives_are_off_the_law_is_its_sigma():
    """Factors that the law does not know: each joint's own, for all of its life."""
    random = np.random.default_rng(1)
    lives = [lived(np.exp(0.5 * random.standard_normal(3))) for _ in range(40)]
    off = [np.exp(0.2 * random.standard_normal(3)) for _ in lives]
    known = [attrs.evolve(life, factor=life.factor / x) for life, x in zip(lives, off, strict=True)]
    assert fitted_law(known, sigma=0.9).sigma == pytest.approx(np.full(3, 0.2), rel=0.35)


def test_one_life_alone_does_not_tell_its_sigma():
    life = lived(SPREAD[0])
    law = fitted_law([life], sigma=0.3)
    np.testing.assert_array_equal(law.sigma, 0.3)
    # yet growth follows it
    np.testing.assert_allclose(one(law, limit=life.clearance_m[-1]), life.cycles[-1], rtol=0.02)


def test_a_joint_that_never_opens_has_no_law_of_its_own_and_leaves_the_others_theirs():
    still = np.array([1.0, 1.0, 0.0])
    lives = []
    for life in (lived(f) for f in SPREAD):
        clearance = np.where(still, life.clearance_m, FRESH)
        lives.append(
            attrs.evolve(life, clearance_m=clearance, growth_m_per_cycle=still * life.growth_m_per_cycle)
        )
    law = fitted_law(lives, sigma=0.3)
    np.testing.assert_array_equal(law.coupling[2], 0.0)
    assert law.sigma[2] == 0.3
    assert (law.sigma[:2] < 0.3).all()


# What masses within tolerance make of growth: bounds that hold for any leg, and a case with one body.


def scaled(mechanism, factors):
    """Mechanism with other masses and inertias."""
    bodies = {
        name: attrs.evolve(body, mass=factors[name] * body.mass, inertia=factors[name] * body.inertia)
        for name, body in mechanism.bodies.items()
    }
    return attrs.evolve(mechanism, bodies=bodies)


@pytest.mark.parametrize("name", ["bionic_leg", "jansen_leg", "klann_leg", "four_bar", "slider_crank"])
def test_all_masses_together_make_all_of_the_force(name):
    """Sensitivities to n masses add up to one: their root sum of squares is at least 1 over root n."""
    mechanism = load_mechanism(name)
    found = model_error(mechanism, mechanism.drive.speed)
    assert (found.sensitivity >= 0.99 / np.sqrt(len(mechanism.bodies))).all()


def test_where_one_body_makes_all_of_the_force_growth_is_as_uncertain_as_its_mass():
    light = scaled(load_mechanism("four_bar"), {"crank": 1e-9, "coupler": 1.0, "rocker": 1e-9})
    found = model_error(light, 20.0)
    for k, growth_m in enumerate(found.ideal_m):
        assert found.relative(k, growth_m) == pytest.approx(MASS_TOLERANCE, rel=1e-6)


def test_lighter_bodies_wear_less_and_are_as_uncertain():
    leg = load_mechanism("bionic_leg")
    whole, lighter = model_error(leg, 6.0), model_error(scaled(leg, dict.fromkeys(leg.bodies, 0.4)), 6.0)
    assert lighter.ideal_m == pytest.approx(0.4 * whole.ideal_m, rel=1e-6)
    assert lighter.sensitivity == pytest.approx(whole.sensitivity, rel=1e-6)


def test_where_a_person_makes_all_of_the_force_growth_is_as_uncertain_as_the_person() -> None:
    leg = load_mechanism("bionic_leg")
    light = with_person(scaled(leg, dict.fromkeys(leg.bodies, 1.0e-6)), 80.0)
    found = model_error(light, 6.0)
    for k, growth_m in enumerate(found.ideal_m):
        # and by the three segments, each of which is known as bodies are
        assert PERSON_TOLERANCE < found.relative(k, growth_m) < 1.1 * PERSON_TOLERANCE


def test_what_impacts_make_is_less_sure():
    model = ModelError(np.array([1.0e-11]), np.array([0.6]), np.zeros(1))
    even, more, all_of_it = (model.relative(0, growth_m) for growth_m in (1.0e-11, 2.0e-11, 1.0e-6))
    assert even == pytest.approx(0.6 * MASS_TOLERANCE)
    assert even < more < all_of_it < 3.0 * even


def test_no_growth_has_no_error_by_impacts():
    model = ModelError(np.array([1.0e-11]), np.array([0.6]), np.zeros(1))
    assert model.relative(0, 0.0) == 0.6 * MASS_TOLERANCE


@pytest.mark.parametrize(("peak_n", "simulated"), [(300.0, (2.6, 6.0, 4.2)), (600.0, (4.6, 7.9, 6.1))])
def test_a_load_whose_size_is_not_sure_widens_growth_by_its_sensitivity(peak_n, simulated) -> None:
    """Of A, B and G, ideal motion makes most: 10 % of load are so many % of simulated growth (appendix)."""
    leg = with_ground_reaction(load_mechanism("bionic_leg"), peak_n)
    known, unsure = (model_error(leg, leg.drive.speed, load_sigma=sigma) for sigma in (0.0, 0.1))
    assert not known.load.any()
    for k, percent in enumerate(simulated):
        growth_m = known.ideal_m[k]
        assert unsure.by_load(k, growth_m) == pytest.approx(0.01 * percent, rel=0.4)
        alone, both = (one.relative(k, growth_m) for one in (known, unsure))
        assert both**2 == pytest.approx(alone**2 + unsure.by_load(k, growth_m) ** 2)
        assert unsure.by_load(k, 3.0 * growth_m) < unsure.by_load(k, growth_m)  # what impacts make


def test_of_a_leg_in_the_air_no_load_is_unsure() -> None:
    found = model_error(load_mechanism("bionic_leg"), 6.0)
    assert not found.load.any()


def test_what_a_heavy_joint_grows_by_is_that_of_its_ideal_motion():
    """A of the leg hardly knocks: the simulated growth is that of Archard's law along the ideal motion."""
    leg = load_mechanism("bionic_leg")
    assert model_error(leg, leg.drive.speed).ideal_m[0] == pytest.approx(1.511e-11, rel=0.08)

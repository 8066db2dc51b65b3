"""The law of growth: found again where it holds, and in closed form where joints do not act on each other."""

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leg_wear_monitor.monitor.forecast.growth import GrowthLaw, SimulatedLife, cycles_to, fitted_law, no_law

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

"""CUSUM tests on signatures of which the statistics are known."""

import math

import attrs
import numpy as np
import pytest

from leg_wear_monitor.estimate.clearance_fit import FACTORS, ChangeDetector, excess, fit_clearances, threshold
from leg_wear_monitor.estimate.explanations import Baseline, Explainer
from leg_wear_monitor.estimate.leg_model import commissioned_baseline, parts_left_out, with_scatter_of
from leg_wear_monitor.estimate.signature import Changes, CommissionedTorque, SignatureModel, TorqueSensor

NEW = np.array([3.0e-4, 3.0e-4])
F = 12


def model(entries: int = F) -> SignatureModel:
    """Two joints whose signatures are linear in the logarithm of their clearances."""
    random = np.random.default_rng(1)
    grid = np.tile(NEW[0] * np.array([1.0, 2.0, 5.0]), (2, 1))
    slopes = random.standard_normal((2, entries))
    change = np.log(grid / NEW[0])[:, :, None] * 4.0 * slopes[:, None, :]
    sensor = TorqueSensor(0.005, 1.0, 10.0)
    return SignatureModel(
        sensor, random.standard_normal(entries), Changes(grid, change), np.eye(entries), 1.0e-9
    )


def detector(hours: float = 240.0) -> ChangeDetector:
    none = Baseline(np.zeros(F), np.zeros((F, F)))
    return ChangeDetector(Explainer(model(), ("A", "B"), none, ()), NEW, 3600.0 * hours)


def walked(tests, clearance, cycles, seed, begin=0):
    """State after some cycles, and the cycles until a detection."""
    random, state = np.random.default_rng(seed), tests.fresh()
    mean = model().at(np.asarray(clearance))[0]
    for i in range(cycles):
        state = tests.with_cycle(state, mean + random.standard_normal(F), begin + 1 + i)
        found = tests.detected_ns(state)
        if found:
            return state, found, i + 1
    return state, 0, cycles


def test_the_threshold_grows_with_the_time_between_false_alarms_and_with_the_tests() -> None:
    assert threshold(math.e, 1) == pytest.approx(1.0)
    assert threshold(1000.0, 20) == pytest.approx(math.log(20_000.0))


@pytest.mark.parametrize("k", [0, 1])
def test_the_widest_joint_that_is_not_seen_is_the_last_that_is_not_found(k: int) -> None:
    """Within as many gait cycles, on a leg that shows 0.8 of what the model expects."""
    tests, own, cycles = detector(), model(), 8
    unseen = tests.unseen_m(cycles)[k]
    after = FACTORS[int(np.searchsorted(FACTORS, unseen / NEW[k] + 1e-9))]
    for size, least, most in ((unseen, 0, 11), (after * NEW[k], 14, 20)):
        wide, found = NEW.copy(), 0
        wide[k] = size
        mean = own.mean + 0.8 * (own.at(wide)[0] - own.mean)
        for seed in range(20):
            random, state = np.random.default_rng(seed), tests.fresh()
            for i in range(round(1.3 * cycles)):
                state = tests.with_cycle(state, mean + random.standard_normal(F), 1 + i)
            found += tests.detected_ns(state) > 0
        assert least <= found <= most


def test_a_joint_that_the_torque_does_not_show_is_never_seen() -> None:
    own = model()
    change = own.joints.change * np.array([1.0, 0.0])[:, None, None]
    hidden = attrs.evolve(own, joints=attrs.evolve(own.joints, change=change))
    none = Baseline(np.zeros(F), np.zeros((F, F)))
    tests = ChangeDetector(Explainer(hidden, ("A", "B"), none, ()), NEW, 1e6)
    unseen = tests.unseen_m(10**6)
    assert unseen[0] == NEW[0]
    assert unseen[1] == FACTORS[-1] * NEW[1]


def test_false_alarms_are_as_rare_as_chosen() -> None:
    """With a chosen mean of 200 cycles, in 6000 cycles at most 30 are expected; the bound is conservative."""
    tests, alarms = detector(200.0 / 3600.0), 0
    random, state, mean = np.random.default_rng(5), tests.fresh(), model().mean
    for i in range(6000):
        state = tests.with_cycle(state, mean + random.standard_normal(F), i + 1)
        if tests.detected_ns(state):
            alarms, state = alarms + 1, tests.fresh()
    assert alarms <= 30


@pytest.mark.parametrize("k", [0, 1])
def test_a_wider_joint_is_detected_within_a_few_cycles_and_named(k: int) -> None:
    for seed in range(20):
        wide = NEW.copy()
        wide[k] *= 1.5
        state, found, cycles = walked(detector(), wide, 100, seed)
        assert found
        assert cycles <= 20
        assert int(state.sums.argmax()) // len(FACTORS) == k


def test_two_cycles_alone_raise_nothing() -> None:
    tests, strange = detector(), model().at(5.0 * NEW)[0]
    state = tests.fresh()
    for i in (1, 2):
        state = tests.with_cycle(state, strange, i)
        assert not tests.detected_ns(state)
    assert tests.detected_ns(tests.with_cycle(state, strange, 3))


def test_since_is_the_begin_of_the_change() -> None:
    tests, random = detector(), np.random.default_rng(2)
    state, wide = tests.fresh(), model().at(np.array([6.0e-4, 3.0e-4]))[0]
    for i in range(40):
        mean = model().mean if i < 30 else wide
        state = tests.with_cycle(state, mean + random.standard_normal(F), 1000 + i)
        found = tests.detected_ns(state)
        if found:
            break
    assert 1028 <= found <= 1030


def test_the_offset_of_a_commissioned_leg_is_not_taken_for_a_clearance() -> None:
    own, offset = model(), 5.0 * np.random.default_rng(3).standard_normal(F)
    explainer = Explainer(own, ("A", "B"), Baseline(offset, np.zeros((F, F))), ())
    wide = np.array([6.0e-4, 3.0e-4])
    found = fit_clearances(explainer, own.at(wide)[0] + offset, 100, NEW, NEW)
    assert found.clearance_m == pytest.approx(wide, rel=0.02)


def test_later_cycles_scatter_as_the_tests_expect() -> None:
    """Seen before: tests expected half of it, since their covariance was made of the cycles they knew."""
    entries = 160
    legs, found = model(entries), []
    for seed in range(40):
        random = np.random.default_rng(seed)
        root = np.eye(entries) + 0.08 * random.standard_normal((entries, entries))
        known, later = (legs.mean + random.standard_normal((n, entries)) @ root.T for n in (50, 2000))
        own = attrs.evolve(legs, covariance=with_scatter_of(legs.covariance, known))
        baseline = commissioned_baseline(
            CommissionedTorque(1, NEW, known),
            legs.mean,
            own.covariance,
            parts_left_out(legs.covariance, known),
        )
        tests = ChangeDetector(Explainer(own, ("A", "B"), baseline, ()), NEW, 1000.0)
        ratio = (later - later.mean(axis=0)) @ tests._weighted.T / np.sqrt(tests._excess)
        supposed = ((tests._weighted @ own.covariance) * tests._weighted).sum(axis=1)
        there = supposed > 0.0
        found.append((ratio.var(axis=0)[there] / supposed[there]).mean())
    # 0.98, with a standard error of 0.024; 1.45 before
    assert 0.85 < np.mean(found) < 1.12


def test_a_leg_that_scatters_more_than_expected_counts_less() -> None:
    random = np.random.default_rng(4)
    found = excess(random.standard_normal((4000, 3)) * [0.5, 1.0, 2.0])
    assert found == pytest.approx([1.0, 1.0, 4.0], rel=0.1)
    assert excess(np.zeros((0, 3))).tolist() == [1.0, 1.0, 1.0]
    alternating = np.tile([[1.0], [-1.0]], (50, 1))  # neighbours that cancel add up to nothing
    assert excess(alternating).tolist() == [1.0]

"""Cycle jumps: smoothing keeps volume, errors see through scatter, jumps stay within their bounds."""

import doctest

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import leg_wear_monitor as lw
from leg_wear_monitor.dynamics.clearance.stepper import ClearanceStepper
from leg_wear_monitor.dynamics.run import DONE, new_run_statistics, steady_drive
from leg_wear_monitor.dynamics.simulation import Leg, prepare
from leg_wear_monitor.life import life as life_module
from leg_wear_monitor.life.life import (
    WearRate,
    jump_error,
    longest_jump,
    next_jump,
    smoothed,
    wear_rate,
)
from leg_wear_monitor.life.result import validity

SECTORS = 90


def rate(growth, scatter=0.0):
    """A rate at which one joint's bushing wears evenly."""
    depth = np.zeros((1, 2, SECTORS))
    depth[0, 0] = growth
    return WearRate(depth, np.array([scatter]))


@given(st.lists(st.floats(0.0, 1e-9), min_size=SECTORS, max_size=SECTORS), st.floats(0.0, 60.0))
def test_smoothing_keeps_the_volume_and_takes_nothing_back(profile, width):
    before = np.array(profile)
    after = smoothed(before, width)
    assert after.min() >= 0.0
    assert after.sum() == pytest.approx(before.sum(), rel=1e-12, abs=1e-24)


def test_smoothing_by_nothing_changes_nothing_and_turns_with_the_profile():
    profile = np.random.default_rng(1).random(SECTORS)
    np.testing.assert_allclose(smoothed(profile, 0.0), profile, rtol=1e-12)
    np.testing.assert_allclose(
        np.roll(smoothed(profile, 9.0), 7), smoothed(np.roll(profile, 7), 9.0), rtol=1e-9
    )


def test_a_rate_is_the_mean_and_its_scatter_falls_with_the_number_of_cycles():
    chance = np.random.default_rng(2)
    worn = 1e-9 + 1e-10 * chance.standard_normal((400, 1, 2, 1)) * np.ones((1, 1, 1, SECTORS))
    few, many = wear_rate(worn[:25], 0.0), wear_rate(worn, 0.0)
    assert many.clearance[0] == pytest.approx(2e-9, rel=0.02)
    assert few.scatter[0] / many.scatter[0] == pytest.approx(4.0, rel=0.4)


def test_no_jump_goes_deeper_than_it_may():
    assert longest_jump(rate(2e-9), 1e-5) == pytest.approx(5000.0)
    assert longest_jump(rate(0.0), 1e-5) == np.inf


def test_scatter_alone_is_no_error():
    assert jump_error(rate(1e-9, 1e-10), rate(1.1e-9, 1e-10), 1000.0)[0] == 0.0
    assert jump_error(rate(1e-9), rate(1.1e-9), 1000.0)[0] == pytest.approx(0.5e-7)


@given(st.floats(1.0, 1e6), st.floats(0.0, 1e-3))
def test_a_jump_shrinks_beyond_its_tolerance_and_changes_by_bounded_factors(cycles, error):
    tolerance = 1e-6
    after = next_jump(cycles, error, tolerance)
    assert 0.29 * cycles <= after <= 2.01 * cycles
    if error > tolerance:
        assert after < cycles


def test_the_example_in_the_documentation_runs():
    done = doctest.testmod(life_module)
    assert (done.attempted, done.failed) == (5, 0)


def test_p_v_is_the_archard_integral_over_area_and_period(leg, lived):
    """Over the first jump; the growth of the clearance is k W / (2 pi R w), counted apart."""
    run, life = lived
    rubbing = life.rubbing_j_per_cycle[:2].mean(axis=0, keepdims=True)
    valid = validity(leg, attrs.evolve(life, rubbing_j_per_cycle=rubbing, period_s=0.5))
    found = {joint: one["mean_pressure_speed_pa_mps"] for joint, one in valid.items()}
    wear = np.array([sum(leg.clearances[joint].wear_coefficient) for joint in found])
    by_growth = np.pi * life.growth_m_per_cycle[:2].mean(axis=0) / (0.5 * wear)
    np.testing.assert_allclose(list(found.values()), by_growth, rtol=2e-3)
    area = np.array(
        [2.0 * leg.clearances[joint].bushing_radius * leg.clearances[joint].width for joint in found]
    )
    expected = run.points[1].archard_j / run.points[1].cycles / (0.5 * area)
    assert list(found) == ["A", "B"]
    np.testing.assert_allclose(list(found.values()), expected, rtol=2e-3)


@pytest.mark.chaotic
def test_jumps_meet_every_single_cycle(leg):
    """Within the scatter of a few hundred cycles; benchmarks/life.py has the long comparison."""
    cycles, factor = 150, 3000.0
    setup = prepare(leg, clearances=("A", "B"), wear=True)
    setup.contacts.wear_coefficient[:] *= factor
    stepper = ClearanceStepper(setup)
    start = Leg(mechanism=leg, clearances=("A", "B"), crank_angle_rad=1.0)
    start.start(stepper)
    for cycle in range(1, cycles + 1):
        status = stepper.advance(
            steady_drive(1.0, setup.speed), float(cycle), new_run_statistics(len(leg.joints))
        )
        assert status[0] == DONE
    every = setup.surfaces.depth.mean(axis=2).sum(axis=1)
    settings = lw.LifeSettings(legs=2, cycles=5, max_wear_per_jump_m=2e-5)
    run = lw.LifeRun(leg, settings, clearances=("A", "B"), wear_factor=factor)
    lw.simulate_life(run, limit_m=9.0e-3, horizon_cycles=float(cycles))
    assert run.points[-1].cycles == pytest.approx(cycles)
    np.testing.assert_allclose(run.points[-1].opened_m, every, rtol=0.12)


def test_a_life_that_takes_too_many_jumps_says_so(lived, monkeypatch):
    run, opened_m = lived[0], lived[0].points[-1].opened_m.max()
    jumps = len(run.points) - 1  # more than a life to this limit takes by the length of a jump
    monkeypatch.setattr(life_module, "MOST_JUMPS", jumps)
    with pytest.raises(lw.SimulationError, match=f"does not end within {jumps} jumps"):
        lw.simulate_life(run, limit_m=run.fresh_m + opened_m + 1e-6, horizon_cycles=1e9)

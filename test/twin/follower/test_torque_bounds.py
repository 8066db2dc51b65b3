"""A foot that cannot pull, and what repeats of a torque that is sampled at instants."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leg_wear_monitor.compiled.kernel import new_records, record_of
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.twin.cycle import INSTANT_CYCLES, LoadEstimate, RepeatingResidual, find
from leg_wear_monitor.twin.digital_twin import DigitalTwin
from leg_wear_monitor.twin.follower_state import PHASES, REGRESSORS, TORQUE_SUMS
from leg_wear_monitor.twin.sample import TwinSettings, gait_samples
from leg_wear_monitor.twin.statistics import NotCompared

ANGLE = np.linspace(0.0, TURN, 200, endpoint=False)
COLUMNS = np.stack([0.1 * np.sin(ANGLE), np.ones(200), 40.0 * np.cos(3.0 * ANGLE), np.zeros(200)], axis=1)


def sums_of(residual):
    sums = record_of(new_records(1, TORQUE_SUMS))
    sums.number = sums.weight = len(residual)
    sums.residual_squares = residual @ residual
    sums.gram[:], sums.along[:] = COLUMNS.T @ COLUMNS, COLUMNS.T @ residual
    return sums


@pytest.mark.plain
def test_a_foot_that_pulls_is_not_explained_by_a_load():
    """What a load below 0 would explain is left in the mismatch; the friction beside it is still found."""
    residual = COLUMNS @ [-50.0, 1.5, 0.001, 0.0]
    free, bounded = find(sums_of(residual), 10.0), find(sums_of(residual), 10.0, (0.0, 1000.0))
    assert free.left == pytest.approx(0.0, abs=1e-4)
    assert bounded.left == pytest.approx(5.0 / np.sqrt(2.0), rel=1e-6)
    np.testing.assert_allclose(bounded.values, [-50.0, 1.5, 0.001, 0.0], rtol=1e-9)
    estimate = LoadEstimate(1000.0, 0.0)
    estimate.take(bounded, True)
    assert estimate.values[0] == estimate.acting == 0.0
    assert estimate.room == (0.0, 1000.0)


@pytest.mark.plain
@given(st.floats(0.0, 500.0))
def test_a_load_within_its_bounds_is_explained(load):
    found = find(sums_of(COLUMNS @ [load, 0.0, 0.0, 0.0]), 10.0, (0.0, 1000.0))
    assert found.left == pytest.approx(0.0, abs=1e-3)


def instants(repeats: float, scatter: float, seed: int = 0):
    """Residuals by phase: a wave that repeats, noise that does not, a friction of 2 N m."""
    found, chance = RepeatingResidual(), np.random.default_rng(seed)
    phase = (np.arange(PHASES) + 0.5) / PHASES * TURN
    for _ in range(INSTANT_CYCLES):
        sums = np.ones((2 + REGRESSORS, PHASES))
        wave = np.sqrt(2.0) * repeats * np.sin(5.0 * phase)
        sums[1] = 2.0 + wave + scatter * chance.standard_normal(PHASES)
        sums[2], sums[4] = 0.1 * np.sin(phase), np.cos(2.0 * phase)
        weight = chance.uniform(0.5, 2.0, PHASES)
        found.take(sums * weight)
    return found


@pytest.mark.plain
def test_what_scatters_is_taken_off_and_what_repeats_stays():
    quiet = [instants(0.0, 2.0, seed).rms_nm()[0] for seed in range(20)]
    assert np.sqrt(np.mean(np.square(quiet))) < 0.35  # of 2 N m, 0.7 in a mean of eight cycles
    loud = [instants(3.0, 2.0, seed).rms_nm()[0] for seed in range(20)]
    assert np.mean(loud) == pytest.approx(3.0, rel=0.05)
    assert instants(3.0, 0.0).rms_nm()[0] == pytest.approx(3.0, rel=1e-6)


@pytest.mark.plain
def test_before_enough_cycles_nothing_is_told():
    found = instants(1.0, 0.0)
    found.cycles = found.cycles[1:]
    assert np.isnan(found.rms_nm()[0])


def test_gait_cycles_that_cannot_be_compared_say_why(leg):
    """The first since a start, one with another cadence than the one before, one with a bridged gap."""
    n = np.arange(9 * 200)
    seconds = n / 200
    turned = seconds + np.where(seconds > 4.5, 0.25 * (seconds - 4.5), 0.0)  # turns: 60 rpm, then 75 rpm
    samples = gait_samples(
        1_700_000_000_000_000_000 + n * 5_000_000,
        crank_angle_rad=TURN * turned % TURN,
        torque_nm=np.sin(TURN * turned),
    )
    samples = samples[(seconds < 6.8) | (seconds > 6.85)]
    cycles = DigitalTwin(leg, TwinSettings()).update(samples).cycles
    first, *rest = [cycle.not_compared for cycle in cycles]
    assert first is NotCompared.FIRST
    assert rest.count(NotCompared.CADENCE) == 2  # the cycle of the change, and the one after it
    assert rest.count(NotCompared.GAP) == 1
    assert rest.count(None) == len(rest) - 3
    without = samples.copy()
    without["torque_nm"] = np.nan
    cycles = DigitalTwin(leg, TwinSettings()).update(without).cycles
    assert {cycle.not_compared for cycle in cycles} == {NotCompared.SAMPLES}

"""What sums of a torque tell: load, friction and lag; what repeats of one that is sampled at instants."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leg_wear_monitor.compiled.kernel import Record, new_records, record_of
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.twin.cycle import INSTANT_CYCLES, LoadEstimate, RepeatingResidual, find
from leg_wear_monitor.twin.digital_twin import DigitalTwin
from leg_wear_monitor.twin.following import (
    FRICTION,
    LAG,
    LOAD,
    LOAD_FRICTION,
    PHASES,
    REGRESSORS,
    TORQUE_SUMS,
)
from leg_wear_monitor.twin.sample import gait_samples
from leg_wear_monitor.twin.statistics import NotCompared

ANGLE = np.linspace(0.0, TURN, 200, endpoint=False)
COLUMNS = np.stack([0.1 * np.sin(ANGLE), np.ones(200), 40.0 * np.cos(3.0 * ANGLE), np.zeros(200)], axis=1)


def sums_of(columns: np.ndarray, residual: np.ndarray) -> Record:
    """Sums with the first regressors; the others are not there."""
    columns = np.pad(columns, ((0, 0), (0, REGRESSORS - columns.shape[1])))
    sums = record_of(new_records(1, TORQUE_SUMS))
    sums.number = sums.weight = len(residual)
    sums.residual_squares = residual @ residual
    sums.gram[:], sums.along[:] = columns.T @ columns, columns.T @ residual
    return sums


@given(
    load=st.floats(-500.0, 500.0), friction=st.floats(-5.0, 5.0), lag=st.floats(-0.01, 0.01),
    phase=st.floats(0.0, TURN),
)  # fmt: skip
def test_load_friction_and_lag_are_told_apart(load, friction, lag, phase):
    angle = np.linspace(0.0, TURN, 200, endpoint=False)
    columns = np.stack([0.1 * np.sin(angle + phase), np.ones(200), 40.0 * np.cos(3.0 * angle)], axis=1)
    found = find(sums_of(columns, columns @ [load, friction, lag]), 10.0)
    np.testing.assert_allclose(found[0], [load, friction, lag, 0.0], atol=1.0e-9 * 500.0)
    assert found[2] < 1.0e-4


@given(
    load=st.floats(-500.0, 500.0), friction=st.floats(-5.0, 5.0), load_friction=st.floats(0.0, 0.4),
    phase=st.floats(0.0, TURN),
)  # fmt: skip
def test_friction_that_grows_with_the_torque_is_told_from_a_constant_one(
    load, friction, load_friction, phase
):
    angle = np.linspace(0.0, TURN, 200, endpoint=False)
    torque = 10.0 * np.sin(angle + phase) + 5.0 * np.sin(3.0 * angle)
    columns = np.stack(
        [0.1 * np.sin(angle), np.ones(200), 10.0 * np.cos(angle + phase), np.abs(torque)], axis=1
    )
    found = find(sums_of(columns, columns @ [load, friction, 0.0, load_friction]), 10.0, (-1e3, 1e3))
    condition = np.linalg.cond(columns / np.linalg.norm(columns, axis=0))
    if found is not None and condition < 100.0:  # load and lag are alike at some phases
        np.testing.assert_allclose(found[0][[1, 3]], [friction, load_friction], atol=1.0e-6)
        assert found[2] < 1.0e-3


def test_a_drive_does_not_gain_from_its_load():
    """Friction below 0 or above what gears have is not explained; the constant one beside it still is."""
    angle = np.linspace(0.0, TURN, 200, endpoint=False)
    columns = np.stack(
        [0.1 * np.sin(angle), np.ones(200), np.cos(3.0 * angle), np.abs(np.sin(angle))], axis=1
    )
    found = find(sums_of(columns, columns @ [0.0, 1.0, 0.0, -1.0]), 1.0)
    mean = 2.0 / np.pi
    assert found[2] == pytest.approx(np.sqrt(0.5 - mean**2), rel=0.01)  # of |sin| about its mean
    estimate = LoadEstimate()
    estimate.take(*found[:2], True)
    assert estimate.values[LOAD_FRICTION] == 0.0


def test_without_a_toe_only_friction_and_lag_are_sought():
    angle = np.linspace(0.0, TURN, 50, endpoint=False)
    columns = np.stack([np.zeros(50), np.ones(50), np.cos(angle)], axis=1)
    found = find(sums_of(columns, columns @ [0.0, 2.0, 0.1]), 1.0)
    np.testing.assert_allclose(found[0], [0.0, 2.0, 0.1, 0.0])
    estimate = LoadEstimate()
    estimate.take(*found[:2], True)
    assert estimate.acting == 0.0


def test_what_cannot_be_told_apart_is_not_guessed():
    columns = np.ones((50, 3))
    assert find(sums_of(columns, np.ones(50)), 1.0) is None
    assert find(sums_of(columns[:3], np.ones(3)), 1.0) is None


def test_a_sudden_load_is_believed_soon_and_a_doubtful_one_not():
    estimate = LoadEstimate()

    def take(load: float, sigma: float) -> None:
        columns, chance = np.zeros((200, 3)), np.random.default_rng(0)
        columns[:, LOAD] = 0.1 * np.sin(np.arange(200) * TURN / 200)
        columns[:, FRICTION], columns[:, LAG] = 1.0, np.cos(np.arange(200) * 3.0 * TURN / 200)
        residual = columns @ [load - estimate.acting, 0.0, 0.0] + sigma * chance.standard_normal(200)
        estimate.take(*find(sums_of(columns, residual), 10.0)[:2], True)

    for _ in range(20):
        take(1.0, 1.0)
    assert estimate.acting == 0.0
    take(40.0, 0.3)
    take(40.0, 0.3)
    assert estimate.acting == pytest.approx(40.0, abs=4.0)
    for _ in range(5):
        take(0.0, 0.3)
    assert estimate.acting == 0.0


def test_a_foot_that_pulls_is_not_explained_by_a_load():
    """What a load below 0 would explain is left in the mismatch; the friction beside it is still found."""
    sums = sums_of(COLUMNS, COLUMNS @ [-50.0, 1.5, 0.001, 0.0])
    free, bounded = find(sums, 10.0), find(sums, 10.0, (0.0, 1000.0))
    assert free[2] == pytest.approx(0.0, abs=1e-4)
    assert bounded[2] == pytest.approx(5.0 / np.sqrt(2.0), rel=1e-6)
    np.testing.assert_allclose(bounded[0], [-50.0, 1.5, 0.001, 0.0], rtol=1e-9)
    estimate = LoadEstimate()
    estimate.take(*bounded[:2], True)
    assert estimate.values[0] == estimate.acting == 0.0
    assert estimate.room == (0.0, 1000.0)


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


def test_what_scatters_is_taken_off_and_what_repeats_stays():
    quiet = [instants(0.0, 2.0, seed).rms_nm() for seed in range(20)]
    assert np.sqrt(np.mean(np.square(quiet))) < 0.35  # of 2 N m, 0.7 in a mean of eight cycles
    loud = [instants(3.0, 2.0, seed).rms_nm() for seed in range(20)]
    assert np.mean(loud) == pytest.approx(3.0, rel=0.05)
    assert instants(3.0, 0.0).rms_nm() == pytest.approx(3.0, rel=1e-6)


def test_before_enough_cycles_nothing_is_reported():
    found = instants(1.0, 0.0)
    found.cycles = found.cycles[1:]
    assert np.isnan(found.rms_nm())


def test_gait_cycles_that_cannot_be_compared_say_why(leg, twin):
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
    cycles = twin.update(samples).cycles
    first, *rest = [cycle.not_compared for cycle in cycles]
    assert first is NotCompared.FIRST
    assert rest.count(NotCompared.CADENCE) == 2  # the cycle of the change, and the one after it
    assert rest.count(NotCompared.GAP) == 1
    assert rest.count(None) == len(rest) - 3
    without = samples.copy()
    without["torque_nm"] = np.nan
    cycles = DigitalTwin(leg).update(without).cycles
    assert {cycle.not_compared for cycle in cycles} == {NotCompared.SAMPLES}

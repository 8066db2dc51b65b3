"""A torque sensor that samples instants: a healthy leg's mismatch is small, a knocking one's is not."""

import attrs
import numpy as np
import pytest

from leg_wear_monitor import Mechanism
from leg_wear_monitor.dynamics.clearance.stepper import ClearanceRun
from leg_wear_monitor.dynamics.run import new_run_statistics
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.twin.cycle import INSTANT_CYCLES
from leg_wear_monitor.twin.digital_twin import DigitalTwin, TwinSnapshot
from leg_wear_monitor.twin.sample import INSTANT, Samples, TwinSettings, gait_samples

START_NS, RATE = 1_700_000_000_000_000_000, 200
ERROR = 0.1  # of the alarm, by default


def sampled_at_instants(leg: Mechanism, seconds: int) -> Samples:
    """Crank samples with the torque at their instants, which scatter by a quarter of a millisecond."""
    run, statistics, chance = (
        ClearanceRun(prepare(leg), 11 * RATE),
        new_run_statistics(10),
        np.random.default_rng(3),
    )
    n = seconds * RATE
    t = np.arange(1, n + 1) / RATE + 2.5e-4 * chance.uniform(-1.0, 1.0, n)
    torque = np.zeros(n)
    for i in range(n):
        run.advance(t[i], statistics)
        torque[i] = run.sample_at(t[i]).drive_torque
    stamps = START_NS + np.round(1.0e9 * t).astype(np.int64)
    angle = TURN * t + 1.0e-3 * chance.standard_normal(n)
    return gait_samples(
        stamps, crank_angle_rad=angle % TURN, torque_nm=torque + 0.05 * chance.standard_normal(n)
    )


@pytest.fixture(scope="module")
def made(leg: Mechanism) -> tuple[DigitalTwin, TwinSnapshot]:
    """A twin whose torque sensor samples instants, and its state as new."""
    twin = DigitalTwin(leg, TwinSettings(torque_sampling=INSTANT))
    return twin, twin.snapshot()


@pytest.fixture
def twin(made: tuple[DigitalTwin, TwinSnapshot]) -> DigitalTwin:
    """That twin as new."""
    made[0].restore(made[1])
    return made[0]


def mismatches(twin: DigitalTwin, samples: Samples) -> list[float]:
    cycles = twin.update(samples).cycles
    return [cycle.torque.unexplained_rms_nm / cycle.torque.predicted_rms_nm for cycle in cycles]


@pytest.mark.chaotic
def test_a_healthy_leg_is_as_predicted_if_its_sensor_is_known(leg, twin):
    """By the mean of its cycles, each of which is an average with the seven before it.

    Taken for averages, the same samples have 0.125, with a sigma of 0.035: too near to 0.1 for one draw.
    """
    known = mismatches(twin, sampled_at_instants(leg, 25))
    assert np.isnan(known[:INSTANT_CYCLES]).all()
    # 34 starts moved by 1e-12, 2026-11-25: 0.0322, sigma 0.0092; of the logarithm 0.285, of which 4.5
    assert np.mean(known[INSTANT_CYCLES:]) < 0.111


@pytest.mark.slow
@pytest.mark.chaotic
def test_a_knock_is_still_reported(leg, twin):
    """A knee of 4 mm, by the mean of 29 cycles; of five it was 0.174 with 0.15 in the logarithm."""
    broken = attrs.evolve(leg.clearances["G"], radial_clearance=4.0e-3)
    other = attrs.evolve(leg, clearances={**leg.clearances, "G": broken})
    known = mismatches(twin, sampled_at_instants(other, 37))
    # 34 starts moved by 1e-12, 2026-11-25: 0.180, 0.0107, smallest 0.160
    assert np.mean(known[INSTANT_CYCLES:]) > ERROR


def test_it_goes_on_bit_for_bit_from_a_snapshot(twin):
    chance = np.random.default_rng(0)
    n = np.arange(11 * RATE)
    samples = gait_samples(
        START_NS + n * (10**9 // RATE),
        crank_angle_rad=TURN * n / RATE % TURN,
        torque_nm=chance.standard_normal(len(n)),
    )
    twin.update(samples[:500])
    middle = twin.snapshot()
    first = twin.update(samples[500:]).cycles
    twin.restore(middle)
    again = twin.update(samples[500:]).cycles
    assert repr([cycle.torque for cycle in first]) == repr([cycle.torque for cycle in again])
    assert not np.isnan(first[-1].torque.unexplained_rms_nm)

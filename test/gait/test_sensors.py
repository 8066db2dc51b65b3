"""What arrives of the leg's sensors: noise, loss and disorder as asked for, and nothing else."""

from collections import Counter
from typing import Any

import attrs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from readings_as_samples import samples

from leg_wear_monitor.dynamics.run import CrankMotion
from leg_wear_monitor.gait.config import EncoderConfig, GaitConfig, TorqueSensorConfig, TransportConfig
from leg_wear_monitor.gait.leg import Instant
from leg_wear_monitor.gait.sensors import Reading, readings
from leg_wear_monitor.twin import CRANK, TORQUE
from leg_wear_monitor.twin.sample import NO_FAULT

CLEAN = GaitConfig(
    duration_s=2.0,
    encoder=EncoderConfig(noise_rad=0.0, velocity_noise_radps=0.0, counts_per_turn=0.0),
    torque_sensor=TorqueSensorConfig(noise_nm=0.0, resolution_nm=0.0),
    transport=TransportConfig(jitter_s=0.0),
)
FRACTION = st.floats(0.0, 0.5)


class EvenLeg:
    """Turns at 6 rad/s under a torque of 4 N m + 1 N m/s t."""

    def advance(self, t: float) -> Instant:
        return Instant(CrankMotion(6.0 * t, 6.0, 0.0), 4.0 * t + 0.5 * t * t, torque_nm=4.0 + t)


def heard(config: GaitConfig = CLEAN, **transport: Any) -> list[Reading]:
    changed = attrs.evolve(config, transport=attrs.evolve(config.transport, **transport))
    return list(readings(EvenLeg(), changed))  # type: ignore[arg-type]


def key(reading: Reading) -> tuple[int, float, float]:
    """What a reading is, whenever it arrives."""
    return reading.kind, reading.taken_s, reading[4] if reading.kind == CRANK else reading.torque_nm


def test_clean_sensors_tell_the_truth() -> None:
    got = heard()
    crank = [reading for reading in got if reading.kind == CRANK]
    torque = [reading for reading in got if reading.kind == TORQUE]
    assert len(crank) == len(torque) == 399
    assert [r.crank_angle_rad for r in crank] == pytest.approx([6.0 * r.taken_s for r in crank])
    # the mean over 5 ms is the value half way back
    assert [r.torque_nm for r in torque] == pytest.approx([4.0 + r.taken_s - 0.0025 for r in torque])
    assert all(reading.fault == NO_FAULT and reading.arrival_s == reading.taken_s for reading in got)


def test_the_crank_can_bring_the_torque() -> None:
    got = heard(attrs.evolve(CLEAN, torque_sensor=attrs.evolve(CLEAN.torque_sensor, source="effort")))
    assert {reading.kind for reading in got} == {CRANK}
    assert [r.torque_nm for r in got] == pytest.approx([4.0 + r.taken_s - 0.0025 for r in got])


def test_a_sensor_may_sample_instants() -> None:
    got = heard(attrs.evolve(CLEAN, torque_sensor=attrs.evolve(CLEAN.torque_sensor, sampling="instant")))
    torque = [reading for reading in got if reading.kind == TORQUE]
    assert [r.torque_nm for r in torque] == pytest.approx([4.0 + r.taken_s for r in torque])


def test_noise_has_the_deviation_asked_for() -> None:
    torque_sensor = TorqueSensorConfig(noise_nm=0.2)
    noisy = attrs.evolve(CLEAN, encoder=EncoderConfig(noise_rad=0.01), torque_sensor=torque_sensor)
    block, clean = samples(heard(noisy), 0), samples(heard(), 0)
    angle = (block["crank_angle_rad"] - clean["crank_angle_rad"])[clean["kind"] == CRANK]
    torque = (block["torque_nm"] - clean["torque_nm"])[clean["kind"] == TORQUE]
    assert angle.std() == pytest.approx(0.01, rel=0.15)
    assert torque.std() == pytest.approx(0.2, rel=0.15)


def test_equal_seeds_give_equal_readings_and_others_do_not() -> None:
    noisy = GaitConfig(duration_s=0.5, transport=TransportConfig(drop_fraction=0.1, late_fraction=0.1))
    assert repr(heard(noisy)) == repr(heard(noisy))
    assert repr(heard(noisy)) != repr(heard(attrs.evolve(noisy, seed=1)))


@given(FRACTION, FRACTION, FRACTION, st.floats(0.0, 0.05))
@settings(max_examples=20)
def test_they_arrive_in_order_and_none_is_made_up(
    drop: float, twice: float, late: float, late_s: float
) -> None:
    got = heard(drop_fraction=drop, duplicate_fraction=twice, late_fraction=late, late_s=late_s)
    arrival = np.array([reading.arrival_s for reading in got])
    delay = arrival - np.array([reading.taken_s for reading in got])
    assert (np.diff(arrival) >= 0.0).all()
    assert np.minimum(delay, np.abs(delay - late_s)).max() < 1e-12
    count = Counter(key(reading) for reading in got)
    assert set(count) <= {key(reading) for reading in heard()}
    assert max(count.values()) <= 2


def test_shares_are_met() -> None:
    whole = len(heard())
    assert len(heard(drop_fraction=0.2)) == pytest.approx(0.8 * whole, rel=0.1)
    assert len(heard(duplicate_fraction=0.2)) == pytest.approx(1.2 * whole, rel=0.1)
    faulty = [reading.fault for reading in heard(fault_fraction=0.2) if reading.fault != NO_FAULT]
    assert len(faulty) == pytest.approx(0.2 * whole, rel=0.25)
    assert len(set(faulty)) > 5


def test_nothing_is_heard_in_a_gap() -> None:
    taken = np.array([reading.taken_s for reading in heard(gaps_s=(0.5, 1.2), gap_s=0.25)])
    assert not ((taken >= 0.5) & (taken < 0.75)).any()
    assert not ((taken >= 1.2) & (taken < 1.45)).any()
    assert len(taken) == pytest.approx(798 - 200, abs=4)


def test_jitter_never_swaps_two_readings_of_a_sensor() -> None:
    taken = [reading.taken_s for reading in heard(jitter_s=0.01) if reading.kind == CRANK]
    assert (np.diff(taken) > 0.0).all()
    assert np.std(np.diff(taken)) > 1.0e-3

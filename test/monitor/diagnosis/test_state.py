"""Gait cycles that wait for a reference: those alike, whatever comes between."""

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leg_wear_monitor.estimate.signature import SimulatedSensor, TorqueSensor, signatures
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.monitor.diagnosis.gait_cycles import cycle_torque
from leg_wear_monitor.monitor.diagnosis.state import (
    WINDOW_CYCLES,
    SignedCycle,
    TorqueSamples,
    TorqueState,
)
from leg_wear_monitor.twin.reference import POINTS, CrankProfile, LegParameters
from leg_wear_monitor.twin.sample import CRANK, TORQUE, gait_samples
from leg_wear_monitor.twin.torque_reference import TorqueReference

pytestmark = pytest.mark.plain
STEADY = CrankProfile.steady(TURN)
ODD = attrs.evolve(STEADY, sine=np.array([0.03, *np.zeros(len(STEADY.sine) - 1)]))


def waited(kinds: list[bool]) -> TorqueState:
    """The state after gait cycles, steady ones or odd ones, of which none has a reference."""
    state = TorqueState(np.full(5, 3.0e-4))
    for i, is_odd in enumerate(kinds):
        state.wait_with(SignedCycle(i, i + 1, np.zeros(4), ODD if is_odd else STEADY))
    return state


def test_one_odd_cycle_in_five_does_not_begin_the_wait_anew() -> None:
    """Seen before: on a crank that turns as a real motor did, a leg waited for 3900 gait cycles."""
    assert len(waited([False] * 4 + [True] + [False]).waiting) == 5
    assert not STEADY.is_like(ODD)


@given(st.lists(st.booleans(), min_size=1, max_size=2 * WINDOW_CYCLES))
def test_all_of_the_last_cycles_are_kept_once_and_those_that_wait_are_alike(kinds: list[bool]) -> None:
    state = waited(kinds)
    kept = sorted((*state.waiting, *state.odd), key=lambda one: one.begin_ns)
    assert [one.begin_ns for one in kept] == list(range(len(kinds)))[-WINDOW_CYCLES:]
    assert all(one.profile.is_like(state.waiting[-1].profile) for one in state.waiting)
    assert not any(one.profile.is_like(state.waiting[-1].profile) for one in state.odd)


@pytest.mark.parametrize("rate_hz", [100.0, 200.0, 480.0, 1000.0])
@pytest.mark.parametrize("rpm", [60.0, 61.0, 45.0])
def test_a_gait_cycle_has_the_signature_that_a_simulated_one_would(leg, rate_hz: float, rpm: float) -> None:
    """The same samples, averaged and sorted by phases in the same way, whatever the cadence."""
    profile, random, cycles, late = CrankProfile.steady(TURN * rpm / 60.0), np.random.default_rng(3), 4, 0.3
    torque = random.normal(0.0, 5.0, (cycles, POINTS)).astype(np.float16)
    reference = TorqueReference(profile, np.full((1, 5), 3.0e-4), (torque,), LegParameters.none(leg))
    period_s, cycle_s = 1.0 / rate_hz, 60.0 / rpm
    sensor = TorqueSensor(period_s, cycle_s, 5.0)
    expected = SimulatedSensor(reference, cycles, sensor, late=late).signatures(0)
    impulse = np.concatenate([[0.0], np.cumsum(torque.astype(float).ravel())]) * cycle_s / POINTS
    time_of = np.arange(len(impulse)) * cycle_s / POINTS
    for cycle in range(1, cycles):
        begin_s = cycle * cycle_s
        time = begin_s + period_s * (late + np.arange(np.ceil(cycle_s / period_s - late)))
        mean = (np.interp(time, time_of, impulse) - np.interp(time - period_s, time_of, impulse)) / period_s
        stamps = np.round(1e9 * time).astype(np.int64)
        turned = np.linspace(-0.1, TURN + 0.1, 2001)
        crank_ns = np.round(1e9 * (begin_s + turned / profile.speed)).astype(np.int64)
        crank = gait_samples(crank_ns, CRANK, crank_angle_rad=turned)
        kept = TorqueSamples(crank, gait_samples(stamps, TORQUE, torque_nm=mean))
        found = cycle_torque(kept, round(1e9 * begin_s), round(1e9 * (begin_s + cycle_s)), sensor)
        own = signatures(np.zeros(len(found.angle), np.int64), found.angle, found.torque, found.step, sensor)
        np.testing.assert_allclose(own[0], expected[cycle], atol=2e-3)


@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.parametrize("phase", [0.0, 0.4])
def test_torques_beside_the_passages_of_zero_have_their_own_angles(direction: float, phase: float) -> None:
    """Beyond the crank's first and last sample of a cycle, which may be 20 ms away, all had one angle."""
    time, torque_s = (np.arange(50) + phase) / 50.0, (np.arange(200) + 0.5) / 200.0
    crank_ns, torque_ns = (np.round(1e9 * at).astype(np.int64) + 10**9 for at in (time, torque_s))
    kept = TorqueSamples(
        gait_samples(crank_ns, CRANK, crank_angle_rad=direction * TURN * time),
        gait_samples(torque_ns, TORQUE, torque_nm=np.sin(TURN * torque_s)),
    )
    found = cycle_torque(kept, 10**9, 2 * 10**9, TorqueSensor(0.005, 1.0, 9.2))
    off = (found.angle - direction * TURN * torque_s + 0.5 * TURN) % TURN - 0.5 * TURN
    assert np.abs(off).max() < 1e-6

"""The fit of a torque with that of a leg: what clearances change, a lag that moves the crank, a low-pass."""

import attrs
import numpy as np
import pytest

from leg_wear_monitor import Mechanism
from leg_wear_monitor.estimate.drive import Channel
from leg_wear_monitor.estimate.joint_motion import (
    Pair,
    Series,
    motion_of,
    paired,
    why_not_a_crank,
    with_repeating_acceleration,
)
from leg_wear_monitor.estimate.torque_fit import Fit, Start, Terms, fit
from leg_wear_monitor.estimate.torque_model import TorqueModel, with_clearances
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.twin.reference import HARMONICS, CrankProfile
from leg_wear_monitor.twin.torque_reference import TorqueReference, TorqueReferenceRun
from leg_wear_monitor.wear import SECTORS

from .conftest import Walk

STEP_S, SECONDS = 0.005, 30.0


def pair_of(profile: CrankProfile) -> Pair:
    """Samples without torque of a crank."""
    time_s = np.arange(0.0, SECONDS, STEP_S)
    still = np.zeros(len(time_s), np.int64)
    return Pair(time_s, np.zeros(len(time_s)), *motion(profile, time_s), still, STEP_S)


def motion(profile: CrankProfile, time_s: Floats) -> tuple[Floats, Floats, Floats]:
    """Angle, speed and acceleration of a crank at some times."""
    at = [profile.at(float(profile.speed * time)) for time in time_s]
    angle, speed, acceleration = (
        np.array([getattr(one, name) for one in at]) for name in ("angle", "speed", "acceleration")
    )
    return angle, speed, acceleration


def steady(pair: Pair, model: TorqueModel, lag_s: float, low_pass_s: float = 0.0) -> Fit:
    """Fit at a known gear ratio."""
    start = Start(1.0, 0.05, 1, 1.0, 0, lag_s=lag_s, low_pass_s=low_pass_s)
    return fit(pair, model, start, Terms(ratio=False, load_friction=True), with_errors=True)


@pytest.fixture(scope="module")
def simulated(leg: Mechanism) -> TorqueReference:
    """The leg as expected, with clearances, at 60 rpm."""
    run = TorqueReferenceRun(leg)
    new_m = np.array([leg.clearances[joint].radial_clearance for joint in leg.clearance_joints])
    run.begin(new_m, np.zeros((len(new_m), 2, SECTORS)), CrankProfile.steady(TURN))
    while run.part is None:
        run.advance(waits=True)
    assert run.part is not None
    return run.part


@pytest.mark.chaotic
def test_what_clearances_change_is_in_the_model_with_those_of_a_simulated_leg(
    walked: Walk, model: TorqueModel, simulated: TorqueReference
) -> None:
    """The recorded leg is in full coordinates: its motion takes power, which seemed to be the drive's.

    34 starts of the simulated leg moved by 1e-12, 2026-11-25: gain 0.9983 ± 0.0001, load friction -0.0035 ±
    0.0001, mismatch 0.0275 ± 0.0001.
    """
    speed, still = np.gradient(walked.angle_rad, walked.time_s), np.zeros(len(walked.time_s), np.int64)
    pair = Pair(walked.time_s, walked.torque_nm, walked.angle_rad, speed, 0.0 * speed, still, STEP_S)
    ideal, own = (
        steady(pair, one, lag_s=0.5 * STEP_S) for one in (model, with_clearances(model, [simulated]))
    )
    assert abs(own.gain - 1.0) < 0.005 < 0.02 < ideal.gain - 1.0
    assert abs(own.linear["load_friction"]) < 0.006 < 0.01 < ideal.linear["load_friction"]
    assert own.mismatch < 0.85 * ideal.mismatch
    assert own.error.load_friction < ideal.error.load_friction


def test_a_late_torque_is_that_of_the_motion_before(model: TorqueModel) -> None:
    """To first order in the lag, the inertia of a ripple seemed to be friction."""
    ripple = np.zeros(HARMONICS)
    ripple[3] = 0.004
    profile, lag_s = CrankProfile(1.3 * TURN, ripple, ripple), 0.03
    pair = pair_of(profile)
    late = attrs.evolve(pair, torque=model.torque(*motion(profile, pair.time_s - lag_s))[0] + 1.0)
    one = steady(late, model, lag_s)
    assert one.linear["friction"] == pytest.approx(1.0, abs=0.01)
    assert one.linear["load_friction"] == pytest.approx(0.0, abs=0.002)
    assert one.offset_rad[0] == pytest.approx(0.0, abs=0.001)


def test_behind_a_low_pass_the_torque_is_that_of_the_leg(model: TorqueModel) -> None:
    pair, low_pass_s = pair_of(CrankProfile.steady(1.3 * TURN)), 1.0 / (TURN * 15.0)
    torque = model.torque(pair.position_rad, pair.speed_radps, pair.acceleration_radps2)[0]
    channel = Channel(time_constant_s=low_pass_s, load_friction=0.2)
    pair = attrs.evolve(pair, torque=channel.received(torque, STEP_S, 1.0))
    late, behind = steady(pair, model, low_pass_s), steady(pair, model, low_pass_s, low_pass_s)
    assert behind.gain == pytest.approx(1.0, abs=1.0e-4)
    assert behind.linear["load_friction"] == pytest.approx(0.2, abs=1.0e-3)
    assert abs(late.gain - 1.0) > 0.02


@pytest.mark.parametrize("gear", [0.5, -9.0])
def test_an_acceleration_that_repeats_is_found_behind_the_noise_of_an_encoder(gear: float) -> None:
    """Seen before: 6 mrad at 39 rpm left none of it, and a load friction of 0.13 was 0.03 ± 0.01."""
    time_s, slow = np.arange(0.0, 60.0, 0.01), 39.0 / 60.0 * TURN
    phase = slow * time_s
    angle = phase + 0.017 * np.sin(2.0 * phase)
    true = -0.017 * (2.0 * slow) ** 2 * np.sin(2.0 * phase)
    position = gear * angle + 0.006 * abs(gear) * np.random.default_rng(4).standard_normal(len(angle))
    alone = np.zeros(len(angle), np.int64)
    pair = paired(motion_of(Series(time_s, position, alone)), Series(time_s, np.cos(phase), alone))
    found = with_repeating_acceleration(pair, 1.0 / gear)
    true = np.interp(pair.time_s, time_s, true)
    off, off_before = (one.acceleration_radps2 / gear - true for one in (found, pair))
    assert off.std() < 0.25 * true.std() < off_before.std()


def recordings(lengths: list[int], rate_hz: float) -> Series:
    """An even turn of a crank, in recordings of given numbers of samples."""
    time_s = np.concatenate([10.0 * k + np.arange(n) / rate_hz for k, n in enumerate(lengths)])
    return Series(time_s, TURN * time_s, np.repeat(np.arange(len(lengths)), lengths))


@pytest.mark.parametrize("short", [14, 20, 24])
def test_a_recording_that_is_too_short_to_be_smoothed_is_left_out(short: int) -> None:
    """It ended in a traceback from fourteen samples on, which a window at 200 Hz is longer than."""
    found = motion_of(recordings([1000, short], 200.0))
    assert set(found.recording.tolist()) == {0}
    assert found.acceleration_radps2 == pytest.approx(np.zeros(len(found.time_s)), abs=1.0e-6)


def test_recordings_that_are_all_too_short_are_of_no_crank() -> None:
    assert "no recording that is long enough" in why_not_a_crank(recordings([10] * 10, 2.0))

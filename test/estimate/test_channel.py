"""The channel of a drive from a mean signature: found in the air, half observable on the ground, declared."""

import math

import attrs
import numpy as np
import pytest
from scipy import signal

from leg_wear_monitor.estimate.channel import channel_of
from leg_wear_monitor.estimate.drive import DIRECT, Channel, DriveFigures
from leg_wear_monitor.estimate.leg_model import nuisances
from leg_wear_monitor.estimate.signature import TorqueSensor, simulated_signatures
from leg_wear_monitor.mechanism.position import TURN, build_linkage
from leg_wear_monitor.monitor.diagnosis.reference_file import shipped_references
from leg_wear_monitor.twin.load import torque_size

HZ = 35.0
DRIVE = Channel(delay_s=0.0075, time_constant_s=1.0 / (TURN * HZ), load_friction=0.2)


@pytest.fixture(scope="module")
def known(leg):
    reference = shipped_references(leg)[0]
    sensor = TorqueSensor(0.005, 1.0, torque_size(build_linkage(leg), TURN), noise_nm=0.5)
    return reference, sensor, nuisances(leg, reference, sensor)


def behind(known, channel: Channel) -> np.ndarray:
    """Mean signature of the leg as expected behind a drive, in gait cycles that the search does not use."""
    reference, sensor, _ = known
    return simulated_signatures(reference, 0, attrs.evolve(sensor, channel=channel))[20:].mean(axis=0)


def test_lag_low_pass_and_load_friction_are_found_in_the_air(known):
    reference, sensor, columns = known
    found = channel_of(reference, sensor, behind(known, DRIVE), columns)
    assert found.channel.lateness_s == pytest.approx(DRIVE.lateness_s, abs=0.0025)
    assert found.channel.load_friction == pytest.approx(0.2, abs=3.0 * found.load_friction_sigma)
    assert found.load_friction_sigma < 0.04


@pytest.mark.parametrize(("hz", "delay_s"), [(17.0, 0.0), (22.4, 0.0), (29.6, 0.0072)])
def test_a_low_pass_is_found_whatever_its_corner_frequency(known, hz, delay_s):
    """Such corner frequencies are the furthest from those with which the search begins."""
    reference, sensor, columns = known
    drive = Channel(delay_s=delay_s, time_constant_s=1.0 / (TURN * hz))
    found = channel_of(reference, sensor, behind(known, drive), columns).channel
    assert found.time_constant_s == pytest.approx(drive.time_constant_s, rel=0.05)
    assert found.lateness_s == pytest.approx(drive.lateness_s, abs=0.0003)


@pytest.mark.parametrize("hz", [15.0, 20.0])
def test_a_low_pass_of_second_order_is_found(known, hz):
    """One of first order would be 1.9 to 2.9 ms later, and leave 12 to 22 times the mean square."""
    reference, sensor, columns = known
    drive = Channel(time_constant_s=math.sqrt(2.0) / (TURN * hz), second_order=0.5)
    found = channel_of(reference, sensor, behind(known, drive), columns)
    assert found.channel.bandwidth_hz == pytest.approx(hz, rel=0.05)
    assert found.channel.lateness_s == pytest.approx(drive.lateness_s, abs=0.0005)
    assert found.square < 0.1


@pytest.mark.parametrize(("second_order", "order"), [(0.0, 1), (0.5, 2)])
def test_low_passes_are_those_of_butterworth(second_order, order):
    time_constant_s = math.sqrt(order) / (TURN * 20.0)
    channel = Channel(time_constant_s=time_constant_s, second_order=second_order)
    omega = TURN * np.array([1.0, 20.0, 100.0])
    _, expected = signal.freqs(*signal.butter(order, TURN * 20.0, analog=True), omega)
    np.testing.assert_allclose(channel.response(omega), expected)
    assert channel.bandwidth_hz == pytest.approx(20.0)
    two = Channel(time_constant_s=2.0 * time_constant_s, second_order=0.25)  # in a row
    one = Channel(time_constant_s=time_constant_s)
    np.testing.assert_allclose(two.response(omega), one.response(omega) ** 2)
    assert abs(two.response(np.array([TURN * two.bandwidth_hz])))[0] == pytest.approx(math.sqrt(0.5))
    assert math.isinf(DIRECT.bandwidth_hz)


@pytest.mark.parametrize("channel", [pytest.param(DIRECT, marks=pytest.mark.slow), DRIVE])
def test_a_leg_that_is_commissioned_with_a_worn_joint_has_its_right_channel(known, leg, channel):
    """Lateness, by joints: 1.0 ± 0.1 and 0.8 ± 0.1 ms RMS (25 draws of cycles); 1.9 if as modelled."""
    reference, sensor, columns = known
    behind_it, off_s = attrs.evolve(sensor, channel=channel), []
    for k in range(len(leg.clearance_joints)):
        worn = int(np.argmin(np.abs(reference.clearance_m[:, k] - 1.5 * reference.clearance_m[0, k])))
        measured = simulated_signatures(reference, worn, behind_it).mean(axis=0)
        found = channel_of(reference, sensor, measured, columns)
        off_s.append(found.channel.lateness_s - channel.lateness_s)
        assert found.channel.load_friction == pytest.approx(
            channel.load_friction, abs=3.0 * found.load_friction_sigma
        )
    assert np.sqrt(np.mean(np.square(off_s))) < 0.0017


def test_a_direct_drive_has_no_channel(known):
    reference, sensor, columns = known
    assert channel_of(reference, sensor, behind(known, DIRECT), columns).channel == DIRECT


def test_under_an_unknown_load_the_lag_is_found_and_the_load_friction_is_not_observable(known):
    reference, sensor, columns = known
    phase = (np.arange(sensor.phases) + 0.5) / sensor.phases
    stance = np.concatenate(
        [60.0 * np.clip(np.sin(TURN * (phase - 0.1)), 0.0, None), np.zeros(sensor.phases)]
    )
    measured = behind(known, attrs.evolve(DRIVE, load_friction=0.0)) + stance
    found = channel_of(reference, sensor, measured, columns)
    assert found.channel.lateness_s == pytest.approx(DRIVE.lateness_s, abs=0.0025)
    assert found.channel.load_friction == 0.0
    assert math.isnan(found.load_friction_sigma)


def test_declared_figures_are_used(known):
    reference, sensor, columns = known
    figures = DriveFigures(bandwidth_hz=HZ, load_friction=0.2)
    found = channel_of(reference, sensor, behind(known, DRIVE), columns, figures)
    assert found.channel.time_constant_s == DRIVE.time_constant_s
    assert found.channel.delay_s == pytest.approx(DRIVE.delay_s, abs=0.0013)
    assert found.channel.load_friction == pytest.approx(0.2, abs=0.05)
    assert figures.lateness_s == pytest.approx(DRIVE.time_constant_s)


def test_a_drive_that_rubs_takes_power_whichever_way_the_power_flows():
    """The motor drives with more than the leg takes, and is driven by less than the leg gives."""
    torque = np.array([10.0, -10.0, 0.0])
    rubbing = Channel(load_friction=0.3)
    np.testing.assert_allclose(rubbing.received(torque, 0.01, 1.0), [13.0, -7.0, 0.0])
    np.testing.assert_allclose(rubbing.received(torque, 0.01, -1.0), [7.0, -13.0, 0.0])


def test_a_drive_without_a_declared_stiffness_or_a_large_one_is_rigid():
    assert DriveFigures().compliance == DriveFigures(stiffness_nm_per_rad=1.0e5).compliance == 0.0
    assert DriveFigures(stiffness_nm_per_rad=1000.0).compliance == pytest.approx(1.0e-3)

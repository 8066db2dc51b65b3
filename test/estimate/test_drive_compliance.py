"""Compliance of a drive from the mean torque: found where it is, not where lag, filter or friction are."""

import attrs
import numpy as np
import pytest

from leg_wear_monitor.estimate.coupling import compliance_of, leg_behind_coupling
from leg_wear_monitor.estimate.drive import Channel
from leg_wear_monitor.estimate.signature import TorqueSensor, simulated_signatures
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.monitor.diagnosis.reference_file import shipped_references
from leg_wear_monitor.twin.reference import CrankProfile, LegParameters, LegSimulation
from leg_wear_monitor.twin.torque_reference import TorqueReference
from leg_wear_monitor.wear import SECTORS

SENSOR = TorqueSensor(period_s=0.005, cycle_s=1.0, size_nm=9.2, noise_nm=0.5)
MASS = (1.04, 0.96, 1.04, 0.96, 1.04, 0.96, 1.04)
CHANNELS = {
    "direct": Channel(),
    "lag": Channel(delay_s=0.01),
    "low-pass": Channel(time_constant_s=1.0 / (TURN * 20.0)),
    "both and load friction": Channel(delay_s=0.01, time_constant_s=1.0 / (TURN * 20.0), load_friction=0.2),
}


@pytest.fixture(scope="module")
def behind(leg) -> TorqueReference:
    """A leg with other masses behind 1000 N m/rad, on a crank with ripple."""
    profile = attrs.evolve(CrankProfile.steady(TURN), sine=np.array([0.0, 0.01, *[0.0] * 6]))
    parameters = attrs.evolve(LegParameters.none(leg), mass=np.array(MASS), compliance=1.0e-3)
    clearance, unworn = np.full(5, 3.0e-4), np.zeros((5, 2, SECTORS))
    found = LegSimulation(leg).simulate(profile, parameters, clearance, unworn, 2, 6)
    assert found is not None
    return TorqueReference(profile, clearance[None], (found.torque.astype(np.float16),), parameters)


@pytest.mark.chaotic
@pytest.mark.parametrize("channel", CHANNELS)
def test_a_stiffness_is_found_behind_any_channel(leg, behind, channel):
    """Found are 1018 to 1032 N m/rad with a sigma of 0.9 (12 moved starts, 2026-11-24); 0.1 of it are half a
    resonance's width in frequency, from which identification goes on.
    """
    mean = simulated_signatures(behind, 0, attrs.evolve(SENSOR, channel=CHANNELS[channel])).mean(axis=0)
    found = leg_behind_coupling(leg, SENSOR, behind.profile, mean)
    assert found is not None
    assert 1.0 / found.compliance == pytest.approx(1000.0, rel=0.1)
    assert 0.03 < found.damping < 0.07  # 0.05; factors of two change the torque


@pytest.mark.parametrize("channel", CHANNELS)
def test_a_rigid_drive_stays_rigid(leg, channel):
    reference = shipped_references(leg)[0]
    sensor = attrs.evolve(SENSOR, channel=CHANNELS[channel])
    for wide in (0, 18):  # as counted, and with a worn joint
        mean = simulated_signatures(reference, wide, sensor).mean(axis=0)
        assert leg_behind_coupling(leg, SENSOR, reference.profile, mean) is None


def test_what_is_stiff_enough_is_rigid():
    assert compliance_of(1.0e5) == 0.0
    assert compliance_of(1000.0) == pytest.approx(1.0e-3)


@pytest.mark.parametrize("mean_nm", [0.0, 3.7, 1.0e-308, 1.0e-3, 73.6])
@pytest.mark.parametrize("swing_nm", [0.0, 1.0e-308, 1.0e-3, 73.6])
def test_no_torque_makes_the_fit_fail(leg, mean_nm: float, swing_nm: float) -> None:
    """Signatures are bounded by eight times the size of the predicted torque."""
    signature = mean_nm + swing_nm * np.resize([1.0, -1.0], 2 * SENSOR.phases)
    found = leg_behind_coupling(leg, SENSOR, CrankProfile.steady(TURN), signature)
    assert found is None or found.is_possible(leg)

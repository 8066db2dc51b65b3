"""The twin of a leg behind a coupling: its crank swings as that of the leg does."""

from types import SimpleNamespace

import attrs
import numpy as np
import pytest

from leg_wear_monitor.dynamics.full_run import FullRun
from leg_wear_monitor.dynamics.run import ARCHARD, TORQUE, new_run_statistics
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.mechanism.spec import Track, TrackDrive
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.twin.reference import LegParameters
from leg_wear_monitor.twin.sample import gait_samples

START_NS, RATE, CYCLES, SETTLING = 1_700_000_000_000_000_000, 200, 12, 4
STIFFNESS, DAMPING = 1000.0, 1.75  # N m/rad, N m s/rad: 0.05 of the critical damping


@pytest.fixture(scope="module")
def walk(leg) -> SimpleNamespace:
    """Samples of a leg in full coordinates behind a controller with the gains of a coupling, and its wear."""
    track = Track(speed_radps=TURN, kp_nm_per_rad=STIFFNESS, kd_nm_s_per_rad=DAMPING)
    setup = prepare(attrs.evolve(leg, drive=TrackDrive(body=leg.drive.body, track=track)))
    run, statistics, impulse = FullRun(setup, tolerance_m=1.0e-9), new_run_statistics(10), [0.0]
    time = np.arange(1, RATE * CYCLES + 1) / RATE
    for i, t in enumerate(time):
        if i == RATE * SETTLING:
            before = statistics.integral[:, ARCHARD].copy()
        run.advance(t, statistics)
        impulse.append(float(statistics.drive_integral[TORQUE]))
    archard = (statistics.integral[:, ARCHARD] - before)[setup.contacts.joint] / (CYCLES - SETTLING)
    samples = gait_samples(
        START_NS + np.round(1.0e9 * time).astype(np.int64),
        crank_angle_rad=(TURN * time) % TURN,
        torque_nm=RATE * np.diff(impulse),
    )
    return SimpleNamespace(samples=samples, archard=archard)


@pytest.mark.chaotic
@pytest.mark.parametrize("is_known", [True, False])
def test_behind_a_coupling_the_torque_is_as_predicted_where_the_coupling_is_known(leg, twin, walk, is_known):
    """Else the mismatch is the torque's size, and the hip wears half as fast as it does."""
    limit = MonitorConfig().limits.torque_mismatch
    if is_known:
        twin.set_parameters(attrs.evolve(LegParameters.none(leg), compliance=1.0 / STIFFNESS))
    cycles = twin.update(walk.samples).cycles[SETTLING:]
    mismatch = [one.torque.unexplained_rms_nm / one.torque.predicted_rms_nm for one in cycles]
    archard = np.mean([one.archard_j for one in cycles], axis=0) / walk.archard
    assert (np.array(mismatch) < limit).all() == is_known
    assert (np.abs(archard - 1.0) < 0.3).all() == is_known

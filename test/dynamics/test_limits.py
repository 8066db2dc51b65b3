"""Small clearances, mirrors, drift: what the motion must do whatever the leg."""

import numpy as np
import pytest

from leg_wear_monitor.dynamics.full_run import BAUMGARTE, TOLERANCE_M, FullRun
from leg_wear_monitor.dynamics.run import new_run_statistics
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.mechanism.constraints import closures_at
from leg_wear_monitor.mechanism.position import TURN, dense_jacobian, one_cycle
from leg_wear_monitor.wear import SECTORS


@pytest.mark.chaotic
def test_a_vanishing_clearance_is_an_ideal_joint(leg_cycles, leg, linkage_of):
    """Mean forces fall towards the ideal ones as all clearances shrink, and come within 5 %, J's 20 %.

    From 3e-4 m on, means of three cycles have sigmas of 0.4 % (J 2.9 %) and less, of the ideal force; J comes
    from 0.136 to 0.117 above it in the last step, with sigmas of 0.012 and 0.004 (10 starts, 2026-11-23).
    """
    ideal = one_cycle(linkage_of("bionic_leg"), 360, TURN).joint_force
    joints = [list(leg.joints).index(name) for name in "ABGIJ"]
    wanted = np.linalg.norm(ideal[:, joints], axis=2).mean(axis=0)
    forces = [leg_cycles("ABGIJ", 3, clearance_m=c).force for c in (1.0e-3, 3.0e-4, 1.0e-4, 3.0e-5)]
    surplus = np.array([force.mean(axis=0) for force in forces]) - wanted
    assert (np.diff(surplus[:3], axis=0) < 0.0).all()
    assert (surplus[3] - surplus[2] < 0.05 * wanted).all()
    assert (surplus[-1] < 0.35 * surplus[0]).all()
    assert (np.abs(surplus[-1, :4]) < 0.05 * wanted[:4]).all()
    assert abs(surplus[-1, 4]) < 0.2 * wanted[4]


def test_a_mirrored_leg_moves_and_wears_mirrored(leg, mirrored):
    """Through a hundred impacts: no sign is lost anywhere, so even chaos is the same."""
    runs, surfaces = [], []
    for mechanism in (leg, mirrored(leg)):
        setup = prepare(mechanism)
        run = FullRun(setup)
        run.advance(0.3, new_run_statistics(len(leg.joints)))
        runs.append(run)
        surfaces.append(setup.surfaces.depth)
    flip = np.array([-1.0, 1.0, -1.0])
    np.testing.assert_allclose(runs[1].q * flip, runs[0].q, atol=1.0e-9)
    np.testing.assert_allclose(runs[1].v * flip, runs[0].v, atol=1.0e-6)
    # an angle turns into pi less it: sector i into N / 2 - 1 - i
    sector = (SECTORS // 2 - 1 - np.arange(SECTORS)) % SECTORS
    np.testing.assert_allclose(surfaces[1][:, :, sector], surfaces[0], atol=1.0e-6 * surfaces[0].max())


def _drift(leg, clearance_joints, seconds, baumgarte, tolerance_m=TOLERANCE_M):
    """Largest residual [m, rad] and its rate in each second of a run, looked at 100 times."""
    setup = prepare(leg, clearances=clearance_joints)
    run, statistics = FullRun(setup, tolerance_m=tolerance_m), new_run_statistics(len(leg.joints))
    run.model = run.model._replace(baumgarte=baumgarte)
    rows, n = run.model.rows, len(run.q)
    phi, blocks, gamma = np.empty(len(rows.body)), np.zeros((len(rows.body), 2, 3)), np.empty(len(rows.body))
    cs, drift = np.empty((n, 2)), np.zeros((seconds, 2))
    for i in range(100 * seconds):
        run.advance((i + 1) / 100.0, statistics)
        drive = np.array([TURN * run.time, TURN, 0.0])
        closures_at(run.model.arrays, rows, run.q, run.v, drive, cs, phi, blocks, gamma)
        phi_dot = dense_jacobian(rows, blocks, n) @ run.v[1:].ravel()
        phi_dot[rows.drive_row] -= TURN
        drift[i // 100] = np.maximum(drift[i // 100], [np.abs(phi).max(), np.abs(phi_dot).max()])
    return drift


@pytest.mark.parametrize("clearance_joints", ["", "ABGIJ"])
def test_closures_stay_closed(leg, clearance_joints):
    """Below 1e-8 m and 1e-6 m/s over several cycles, without a trend."""
    drift = _drift(leg, tuple(clearance_joints), 4, BAUMGARTE)
    assert (drift < [1.0e-8, 1.0e-6]).all()
    assert drift[-1, 0] < 3.0 * drift[0, 0]


def test_closures_drift_apart_without_baumgarte(leg):
    """At ten times the default's step error, so that four seconds show it."""
    drift = _drift(leg, tuple("ABGIJ"), 4, 0.0, 10.0 * TOLERANCE_M)[:, 0]
    assert drift[-1] > 3.0 * drift[0]
    assert drift[-1] > 1.0e-8

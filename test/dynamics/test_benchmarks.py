"""Published motions: Andrews' squeezing mechanism, and a slider-crank with clearance in the pin."""

import numpy as np
import pytest

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.dynamics.full_run import FullRun
from leg_wear_monitor.dynamics.run import POWER, new_run_statistics
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.mechanism.position import one_cycle

# IVP Test Set, problem "andrews", at t = 0.03 s: beta, Theta, gamma, phi, delta, Omega, epsilon [rad]
ANDREWS_ANGLES = [
    15.81077119629904, -15.75637105984298, 0.04082224013073101, -0.5347301163226948,
    0.5244099658805304, 0.5347301163226948, 1.048080741042263,
]  # fmt: skip
# and the force that body 2 meets in each joint of the pin P [N]
ANDREWS_FORCES = {
    "P23": (199.1753333731910, -29.75531228015052),
    "P24": (23.06654341098399, 31.45271365475927),
    "P26": (22.64249232082739, 11.61740699100673),
}

# slider-crank with Lankarani-Nikravesh: impacts begin [ms], speed [m/s], end [ms], peak [N], by RK4 at 5 ns
IMPACTS = [
    (0.22729, 4.38586, 0.28073, 45872.0),
    (0.63706, 2.75699, 0.69090, 20870.0),
    (0.74971, 1.82696, 0.81516, 25926.0),
    (1.08596, 1.10188, 1.14672, 6558.0),
    (1.20583, 0.82381, 1.49090, 12916.0),
]
ROTATION = 5000.0 * 2.0 * np.pi / 60.0


@pytest.fixture(scope="module")
def andrews():
    """The run at its end, and what it added up."""
    run, statistics = FullRun(prepare(load_mechanism("andrews")), tolerance_m=1.0e-11), new_run_statistics(10)
    start = run.stored_energy
    run.advance(0.03, statistics)
    return run, statistics.drive_integral[POWER], run.stored_energy - start


def test_andrews_angles(andrews):
    theta = andrews[0].q[:, 2]
    got = [
        theta[1],
        theta[2] - theta[1],
        theta[3],
        theta[4] - theta[5],
        theta[5],
        theta[6] - theta[7],
        theta[7],
    ]
    np.testing.assert_allclose(got, ANDREWS_ANGLES, atol=1.0e-6)


def test_andrews_reactions(andrews):
    run = andrews[0]
    names = list(load_mechanism("andrews").joints)
    row = {names[joint]: r for joint, r in zip(run.model.rows.closure, run.model.rows.row, strict=True)}
    for joint, force in ANDREWS_FORCES.items():
        got = run.lam[row[joint] : row[joint] + 2]
        assert np.linalg.norm(got - force) < 1.0e-4 * np.linalg.norm(force)


def test_andrews_keeps_its_energy(andrews):
    """Ideal joints lose nothing: the torque's work is kinetic energy and that of the spring."""
    _, work, stored = andrews
    assert stored == pytest.approx(work, rel=1.0e-9)


def test_slider_crank_without_clearance(linkage_of):
    """At the outer dead centre the slider's acceleration is r omega^2 (1 + r / l)."""
    motion = one_cycle(linkage_of("slider_crank"), 1, ROTATION)
    assert -motion.a[0, 3, 0] == pytest.approx(0.05 * ROTATION**2 * (1.0 + 0.05 / 0.12), rel=1.0e-9)
    assert -motion.a[0, 3, 0] == pytest.approx(19419.0, abs=0.5)


def test_slider_crank_impacts():
    run, statistics = (
        FullRun(prepare(load_mechanism("slider_crank")), tolerance_m=1.0e-12),
        new_run_statistics(4),
    )
    run.advance(1.5e-3, statistics)
    assert statistics.impacts[2] == len(IMPACTS)
    for got, (begin, speed, end, peak) in zip(statistics.impact[2], IMPACTS, strict=False):
        assert 1.0e3 * got[0] == pytest.approx(begin, abs=1.0e-3)
        assert got[1] == pytest.approx(speed, abs=1.0e-3)
        assert 1.0e3 * got[2] == pytest.approx(end, abs=1.0e-3)
        assert got[3] == pytest.approx(peak, rel=1.0e-3)

"""Full coordinates: published motions, their equations, and the motion whatever the leg."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from leg_wear_monitor import load_mechanism
from leg_wear_monitor.contact.arrays import clearance_settings, compile_contacts
from leg_wear_monitor.dynamics.full_run import (
    BAUMGARTE,
    TOLERANCE_M,
    FullRun,
    accelerate,
    add_contacts,
    eccentricity,
    full_model,
    full_scratch,
)
from leg_wear_monitor.dynamics.joint import joint_force
from leg_wear_monitor.dynamics.run import (
    ARCHARD,
    FRICTION,
    JOINT_RATES,
    POWER,
    new_run_statistics,
    steady_drive,
)
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.mechanism.constraints import closures, closures_at, rotations
from leg_wear_monitor.mechanism.position import TURN, dense_jacobian, one_cycle
from leg_wear_monitor.wear import SECTORS, Surfaces

# Published motions: Andrews' squeezing mechanism, and a slider-crank with clearance in the pin.


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


# Full coordinates: their equations, the motion, and what it must do whatever the leg.


# Equations of motion: structure against dense algebra, and what contact forces may and may not do.


CLEARANCE_JOINTS = ("A", "B", "G", "I", "J")
APPROACH = np.full(len(CLEARANCE_JOINTS), 0.2)

phases = st.integers(0, 35)
# m and rad: enough to bring journals into contact and others out of it
offsets = arrays(float, (8, 3), elements=st.floats(-4.0e-4, 4.0e-4))
velocities = arrays(float, (8, 3), elements=st.floats(-3.0, 3.0))


@pytest.fixture(scope="module")
def cycle(linkage_of):
    return one_cycle(linkage_of("bionic_leg"), 36, TURN)


@pytest.fixture(scope="module")
def model(leg, linkage_of):
    contacts = compile_contacts(leg, CLEARANCE_JOINTS, clearance_settings(leg, CLEARANCE_JOINTS))
    return full_model(linkage_of("bionic_leg").arrays, contacts, driven=True)


@pytest.fixture(scope="module")
def worn():
    """Surfaces with some micrometres of uneven wear that opens the clearances."""
    rng, centres = np.random.default_rng(3), np.arange(SECTORS) * TURN / SECTORS
    waves = [[1.0 + np.cos(centres * n + shift) for shift in rng.uniform(0, TURN, 2)] for n in range(1, 6)]
    return Surfaces(5.0e-6 * np.array(waves), 1)


def _state(cycle, phase, offset, velocity):
    """A state near the ideal motion; the ground stays where it is."""
    q, v = cycle.q[phase] + offset, cycle.v[phase] + velocity
    q[0] = v[0] = 0.0
    return q, v


def _contacts(model, surfaces, q, v):
    """Generalised contact forces (n, 3) and the rates of the integrals."""
    scratch, rate = full_scratch(model), np.zeros((10, JOINT_RATES))
    rotations(q, scratch.cs)
    add_contacts(model, surfaces, APPROACH, q, v, scratch, rate)
    return scratch.force, rate, scratch.cs


def _forces(model, surfaces, k, q, v, cs):
    """Normal and tangential force, delta_dot and slip of clearance joint k."""
    ex, ey, vx, vy, b, j, _, _ = eccentricity(model, k, q, v, cs)
    f_n, f_t, _, delta_dot, slip, *_ = joint_force(
        model.contacts, surfaces, k, ex, ey, vx, vy, q[b, 2], q[j, 2], v[b, 2], v[j, 2], APPROACH[k]
    )
    return f_n, f_t, delta_dot, slip


@pytest.mark.slow  # kernels that only tests call are compiled for it
@given(phase=phases, offset=offsets, velocity=velocities)
def test_contact_is_action_and_reaction_moments_included(model, worn, cycle, phase, offset, velocity):
    """All forces, the ground's too, sum to nothing; so do their moments about the origin, hence any point."""
    q, v = _state(cycle, phase, offset, velocity)
    force, _, _ = _contacts(model, worn, q, v)
    size = np.abs(force).max()
    np.testing.assert_allclose(force[:, :2].sum(axis=0), 0.0, atol=1.0e-12 * size)
    moment = force[:, 2] + q[:, 0] * force[:, 1] - q[:, 1] * force[:, 0]
    assert abs(moment.sum()) <= 1.0e-12 * size


@pytest.mark.slow  # kernels that only tests call are compiled for it
@given(phase=phases, offset=offsets, velocity=velocities)
def test_contact_does_no_work_but_that_of_its_two_forces(model, worn, cycle, phase, offset, velocity):
    """Generalised forces times velocities = sum of - F_N delta_dot + F_T v_t."""
    q, v = _state(cycle, phase, offset, velocity)
    force, rate, cs = _contacts(model, worn, q, v)
    power = 0.0
    for k, joint in enumerate(model.contacts.joint):
        f_n, f_t, delta_dot, slip = _forces(model, worn, k, q, v, cs)
        power += -f_n * delta_dot + f_t * slip
        assert rate[joint, FRICTION] == pytest.approx(-f_t * slip)
        assert rate[joint, ARCHARD] == pytest.approx(f_n * abs(slip))
    assert (force * v).sum() == pytest.approx(power, rel=1.0e-9, abs=1.0e-12 * np.abs(force).max())


@pytest.mark.slow  # kernels that only tests call are compiled for it
@given(phase=phases, offset=offsets, velocity=velocities)
def test_accelerations_are_those_of_dense_algebra(model, worn, cycle, phase, offset, velocity):
    """[M, phi_q^T; phi_q, 0] [a; lambda] = [Q; gamma - 2 alpha phi' - alpha^2 phi], solved whole."""
    q, v = _state(cycle, phase, offset, velocity)
    arrays_, rows, n = model.arrays, model.rows, len(q)
    scratch, a = full_scratch(model), np.zeros_like(q)
    good = accelerate(
        model, worn, APPROACH, steady_drive(cycle.crank_angle[phase], TURN), 0.0, q, v, scratch, a,
        np.zeros((10, JOINT_RATES)), np.zeros(3),
    )  # fmt: skip
    assert good
    m = len(rows.body)
    phi, blocks, gamma = np.empty(m), np.zeros((m, 2, 3)), np.empty(m)
    drive = np.array([cycle.crank_angle[phase], TURN, 0.0])
    closures(arrays_, rows, q, v, scratch.cs, drive, phi, blocks, gamma)
    jacobian = dense_jacobian(rows, blocks, n)
    phi_dot = jacobian @ v[1:].ravel()
    phi_dot[rows.drive_row] -= TURN
    mass = np.diag(arrays_.mass[1:].ravel())
    matrix = np.block([[mass, jacobian.T], [jacobian, np.zeros((m, m))]])
    right = np.concatenate(
        [scratch.force[1:].ravel(), gamma - 2.0 * BAUMGARTE * phi_dot - BAUMGARTE**2 * phi]
    )
    solution = np.linalg.solve(matrix, right)
    size = np.abs(solution).max()
    np.testing.assert_allclose(a[1:].ravel(), solution[: 3 * (n - 1)], atol=1.0e-9 * size)
    np.testing.assert_allclose(scratch.lam, solution[3 * (n - 1) :], atol=1.0e-9 * size)
    np.testing.assert_array_equal(a[0], 0.0)


# Small clearances, drift: what the motion must do whatever the leg.


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


@pytest.mark.slow
@pytest.mark.parametrize("clearance_joints", ["", "ABGIJ"])
def test_closures_stay_closed(leg, clearance_joints):
    """Below 1e-8 m and 1e-6 m/s over several cycles, without a trend."""
    drift = _drift(leg, tuple(clearance_joints), 4, BAUMGARTE)
    assert (drift < [1.0e-8, 1.0e-6]).all()
    assert drift[-1, 0] < 3.0 * drift[0, 0]


@pytest.mark.slow
def test_closures_drift_apart_without_baumgarte(leg):
    """At ten times the default's step error, so that four seconds show it."""
    drift = _drift(leg, tuple("ABGIJ"), 4, 0.0, 10.0 * TOLERANCE_M)[:, 0]
    assert drift[-1] > 3.0 * drift[0]
    assert drift[-1] > 1.0e-8

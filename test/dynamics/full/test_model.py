"""Equations of motion: structure against dense algebra, and what contact forces may and may not do."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from leg_wear_monitor.contact.arrays import clearance_settings, compile_contacts
from leg_wear_monitor.dynamics.full_model import (
    BAUMGARTE,
    accelerate,
    add_contacts,
    eccentricity,
    full_model,
    full_scratch,
)
from leg_wear_monitor.dynamics.joint import joint_force
from leg_wear_monitor.dynamics.run import ARCHARD, FRICTION, JOINT_RATES, steady_drive
from leg_wear_monitor.mechanism.constraints import closures, rotations
from leg_wear_monitor.mechanism.position import TURN, dense_jacobian, one_cycle
from leg_wear_monitor.wear import SECTORS, Surfaces

pytestmark = pytest.mark.slow  # kernels that only tests call are compiled for it

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


@given(phase=phases, offset=offsets, velocity=velocities)
def test_contact_is_action_and_reaction_moments_included(model, worn, cycle, phase, offset, velocity):
    """All forces, the ground's too, sum to nothing; so do their moments about the origin, hence any point."""
    q, v = _state(cycle, phase, offset, velocity)
    force, _, _ = _contacts(model, worn, q, v)
    size = np.abs(force).max()
    np.testing.assert_allclose(force[:, :2].sum(axis=0), 0.0, atol=1.0e-12 * size)
    moment = force[:, 2] + q[:, 0] * force[:, 1] - q[:, 1] * force[:, 0]
    assert abs(moment.sum()) <= 1.0e-12 * size


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

"""Ideal motion: published and independently computed cycles, and the laws between its parts."""

import attrs
import numpy as np
import pytest

from leg_wear_monitor.mechanism.position import TURN, build_linkage, ideal_motion, one_cycle, point_motion

SPEED = TURN  # 60 rpm

# foot of Jansen's linkage at crank angles 0, 45, ... 315 deg, in his units, from his published lengths
JANSEN_FOOT = [
    (-5.1601, -83.9569), (13.6015, -83.9909), (30.3109, -82.5894), (31.9830, -79.5393),
    (4.2703, -65.7171), (-26.5616, -73.6897), (-32.6706, -81.8428), (-21.5130, -83.9612),
]  # fmt: skip
# Klann's linkage, in percent of its stride: height of a step, deviation from a line on the ground
KLANN_STEP = (52.3, 5.5)


@pytest.fixture(scope="module")
def leg_linkage(linkage_of):
    return linkage_of("bionic_leg")


@pytest.fixture(scope="module")
def cycle(leg_linkage):
    return one_cycle(leg_linkage, 36, SPEED)


def test_jansen_foot(linkage_of):
    linkage = linkage_of("jansen_leg")
    foot = point_motion(one_cycle(linkage, 8, 1.0), linkage, *linkage.mechanism.toe)[0]
    np.testing.assert_allclose(foot / 0.008 + [38.0, 7.8], JANSEN_FOOT, atol=1.0e-4)


def klann_foot(linkage):
    """Foot (360, 2) in a turn, in units and axes of the patent."""
    foot = point_motion(one_cycle(linkage, 360, 1.0), linkage, *linkage.mechanism.toe)[0]
    return foot / 0.4 + [1.599, 0.750]


def klann_step(foot):
    """Height of a step, and deviation from a line in the half turn on the ground [% of the stride]."""
    height, below = foot[:, 1], foot[:181, 1]
    return 100.0 * np.array([height.max() - below.min(), np.ptp(below)]) / np.ptp(foot[:, 0])


def test_klann_foot(linkage_of):
    """The coordinates of the patent have three digits, and the lengths of the file follow from them."""
    foot = klann_foot(linkage_of("klann_leg"))
    np.testing.assert_allclose(foot[[0, 180]], [(1.0, 0.0), (0.0, 0.0)], atol=1.0e-3)
    np.testing.assert_allclose(klann_step(foot), KLANN_STEP, atol=0.1)


def test_velocity_and_acceleration_are_derivatives(leg_linkage):
    """Central differences over the crank angle, its speed being constant."""
    h = 1.0e-4
    q = ideal_motion(leg_linkage, [1.0 - h, 1.0, 1.0 + h], SPEED)
    before, here, after = q.q
    np.testing.assert_allclose((after - before) * SPEED / (2.0 * h), q.v[1], atol=1.0e-6)
    np.testing.assert_allclose((after - 2.0 * here + before) * (SPEED / h) ** 2, q.a[1], atol=1.0e-4)


def test_joint_forces_move_every_body_as_newton_and_euler_say(leg_linkage, cycle):
    arrays = leg_linkage.arrays
    rest = arrays.mass * cycle.a
    rest[:, :, :2] -= arrays.mass[:, :1] * arrays.gravity
    rest[:, arrays.drive_body, 2] -= cycle.drive_torque
    for joint, bodies in enumerate(arrays.joint_body):
        for body, point, sign in zip(bodies, arrays.joint_point[joint], (-1.0, 1.0), strict=True):
            c, s = np.cos(cycle.q[:, body, 2]), np.sin(cycle.q[:, body, 2])
            x, y = c * point[0] - s * point[1], s * point[0] + c * point[1]
            force = sign * cycle.joint_force[:, joint]
            rest[:, body, :2] -= force
            rest[:, body, 2] -= x * force[:, 1] - y * force[:, 0]
    assert np.abs(rest[:, 1:]).max() < 1.0e-9  # N and N m; the ground takes what is left


def test_work_of_the_drive_is_the_change_of_energy(leg_linkage):
    motion = one_cycle(leg_linkage, 720, SPEED)
    mass, gravity = leg_linkage.arrays.mass, leg_linkage.arrays.gravity
    energy = 0.5 * (mass * motion.v**2).sum(axis=(1, 2)) - (mass[:, 0] * (motion.q[:, :, :2] @ gravity)).sum(
        axis=1
    )
    spectrum = 1j * np.fft.rfftfreq(720, 1.0 / 720) * np.fft.rfft(energy)  # derivative of a periodic curve
    np.testing.assert_allclose(np.fft.irfft(spectrum), motion.drive_torque, atol=1.0e-8)


def test_backwards_is_the_same_positions_and_forces(leg_linkage, cycle):
    back = one_cycle(leg_linkage, 36, -SPEED)
    np.testing.assert_array_equal(back.q, cycle.q)
    np.testing.assert_array_equal(back.v, -cycle.v)
    np.testing.assert_allclose(back.a, cycle.a, atol=1.0e-10)
    np.testing.assert_allclose(back.joint_force, cycle.joint_force, atol=1.0e-10)


def test_inertia_forces_grow_with_the_square_of_speed(leg):
    linkage = build_linkage(attrs.evolve(leg, gravity=(0.0, 0.0)))
    slow, fast = (one_cycle(linkage, 8, speed) for speed in (SPEED, 3.0 * SPEED))
    np.testing.assert_allclose(fast.joint_force, 9.0 * slow.joint_force, rtol=1.0e-9)
    np.testing.assert_allclose(fast.drive_torque, 9.0 * slow.drive_torque, rtol=1.0e-9)

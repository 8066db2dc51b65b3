"""The ideal toe's table."""

import math

import numpy as np
import pytest

from leg_wear_monitor.dynamics.full_model import NO_TOE, ideal_toe, interpolate
from leg_wear_monitor.mechanism.position import TURN, ideal_motion, point_motion


@pytest.fixture(scope="module")
def toe(linkage_of):
    return ideal_toe(linkage_of("bionic_leg"), TURN)


def test_between_its_points_the_table_is_the_ideal_motion(linkage_of, toe):
    linkage = linkage_of("bionic_leg")
    angles = np.linspace(0.3, 6.0, 17)
    motion = ideal_motion(linkage, angles, TURN)
    wanted = np.column_stack([*point_motion(motion, linkage, *linkage.mechanism.toe), motion.drive_torque])
    for column in range(7):
        got = [interpolate(toe.ideal, column, angle) for angle in angles]
        np.testing.assert_allclose(got, wanted[:, column], atol=1.0e-8 * np.ptp(toe.ideal[:, column]))


@pytest.mark.parametrize("turns", [-3, 0, 2])
def test_the_table_is_periodic_and_exact_at_its_points(toe, turns):
    n = len(toe.ideal)
    for i in (0, 1, n // 2, n - 1):
        got = interpolate(toe.ideal, 0, TURN * (turns + i / n))
        assert math.isclose(got, toe.ideal[i, 0], rel_tol=1.0e-10)


def test_nothing_to_compare_without_a_toe(linkage_of):
    assert ideal_toe(linkage_of("slider_crank"), 1.0) is NO_TOE

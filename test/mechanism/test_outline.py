"""The outline of a mechanism: its joints lie on both of their bodies."""

import numpy as np
import pytest

from leg_wear_monitor.mechanism.loader import load_mechanism, shipped_mechanisms
from leg_wear_monitor.mechanism.position import is_on_ground, outline_of

pytestmark = pytest.mark.plain


def distance(place, corners):
    return float(np.hypot(*(corners - place).T).min())


@pytest.mark.parametrize("name", shipped_mechanisms())
def test_every_joint_is_a_corner_of_its_bodies(name):
    mechanism = load_mechanism(name)
    corners, joints = outline_of(mechanism)
    assert list(joints) == list(mechanism.joints)
    for joint, place in joints.items():
        bodies = [body for body in mechanism.sides(joint) if body != "ground"]
        inside = [body for body in bodies if len(corners[body]) > 1]
        assert all(distance(place, corners[body]) < 1e-9 for body in inside), joint
        assert is_on_ground(mechanism, joint) is (len(bodies) == 1)


def test_the_leg_hangs_below_its_hip():
    _, joints = outline_of(load_mechanism("bionic_leg"))
    assert joints["A"] == pytest.approx([0.0, 0.0], abs=1e-12)
    assert joints["G"][1] < joints["A"][1] > joints["I"][1]

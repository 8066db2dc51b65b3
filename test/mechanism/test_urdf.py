"""A linkage as URDF: its tree moves as the linkage, and its cut loops close."""

import math
from xml.etree import ElementTree

import numpy as np
import pytest

import leg_wear_monitor as lw
from leg_wear_monitor.mechanism.loader import shipped_mechanisms
from leg_wear_monitor.mechanism.position import build_linkage, check_cycle, ideal_motion, point_motion
from leg_wear_monitor.mechanism.spec import GROUND
from leg_wear_monitor.mechanism.urdf import joint_positions, tree, urdf

MECHANISMS = sorted(shipped_mechanisms())
STEPS = 12


def transform(xyz, rpy):
    """Homogeneous matrix; the only turn here is about y."""
    x, y, z = map(float, xyz.split())
    roll, pitch, yaw = map(float, rpy.split())
    assert roll == yaw == 0.0
    c, s = math.cos(pitch), math.sin(pitch)
    return np.array([[c, 0.0, s, x], [0.0, 1.0, 0.0, y], [-s, 0.0, c, z], [0.0, 0.0, 0.0, 1.0]])


def frames(robot, positions):
    """Place of each link by positions of the joints, as a publisher of transforms computes it."""
    found = {GROUND: np.eye(4)}
    waiting = list(robot.iter("joint"))
    while waiting:
        joint = waiting.pop(0)
        parent, child = (joint.find(side).get("link") for side in ("parent", "child"))
        if parent not in found:
            waiting.append(joint)
            continue
        origin = joint.find("origin")
        here = found[parent] @ transform(origin.get("xyz"), origin.get("rpy"))
        if joint.get("type") != "fixed":
            axis = np.array(list(map(float, joint.find("axis").get("xyz").split())))
            value = positions[joint.get("name")]
            if joint.get("type") == "continuous":
                assert axis.tolist() == [0.0, 1.0, 0.0]
                here = here @ transform("0 0 0", f"0 {value} 0")
            else:
                here = here @ np.block([[np.eye(3), value * axis[:, None]], [np.zeros((1, 3)), 1.0]])
        found[child] = here
    return found


@pytest.mark.parametrize("name", MECHANISMS)
def test_cut_loops_close_and_bodies_are_where_they_are_in_the_linkage(name):
    mechanism = lw.load_mechanism(name)
    linkage = build_linkage(mechanism)
    angles = np.linspace(0.0, 2.0 * math.pi, STEPS, endpoint=False)
    motion = ideal_motion(linkage, angles, 1.0)
    positions = joint_positions(linkage, motion.q)
    robot = ElementTree.fromstring(urdf(mechanism))
    carried = set(tree(mechanism))
    for step in range(STEPS):
        here = frames(robot, {joint: float(values[step]) for joint, values in positions.items()})
        for joint in set(mechanism.joints) - carried:
            one, other = (here[f"{joint}_on_{body}"][:3, 3] for body in mechanism.sides(joint))
            assert np.abs(one - other).max() < 1e-6
        for joint, (_, child) in tree(mechanism).items():
            expected, _, _ = point_motion(motion, linkage, child, joint)
            x, y, z = here[child][:3, 3]
            assert (-x, z) == pytest.approx(tuple(expected[step]), abs=1e-6)
            assert y == 0.0


@pytest.mark.parametrize("name", MECHANISMS)
def test_it_is_a_tree_of_all_bodies_with_their_masses(name):
    mechanism = lw.load_mechanism(name)
    check_cycle(build_linkage(mechanism))
    robot = ElementTree.fromstring(urdf(mechanism))
    links = [link.get("name") for link in robot.iter("link")]
    children = [joint.find("child").get("link") for joint in robot.iter("joint")]
    assert len(set(links)) == len(links)
    assert sorted(children) == sorted(set(links) - {GROUND})
    total = sum(float(mass.get("value")) for mass in robot.iter("mass"))
    assert total == pytest.approx(sum(body.mass for body in mechanism.bodies.values()))
    for inertia in robot.iter("inertia"):
        xx, yy, zz = (float(inertia.get(axis)) for axis in ("ixx", "iyy", "izz"))
        assert xx + zz == pytest.approx(yy)  # a thin plate, the limit of what is physical

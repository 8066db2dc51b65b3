"""Position analysis against closed forms, and what it says where there is no position."""

import re

import numpy as np
import pytest

from leg_wear_monitor.errors import AssemblyError
from leg_wear_monitor.mechanism.loader import parse_mechanism
from leg_wear_monitor.mechanism.position import TURN, assemble, build_linkage, check_cycle, one_cycle

POINTS = 24


def _linkage(document):
    return build_linkage(parse_mechanism(document, "edited.yaml"))


def test_four_bar_follows_freudenstein(linkage_of):
    """K1 cos(out) - K2 cos(in) + K3 = cos(in - out), solved for the output angle (Freudenstein 1955)."""
    motion = one_cycle(linkage_of("four_bar"), POINTS, 1.0)
    crank, coupler, rocker, ground = 0.050, 0.200, 0.150, 0.200
    k1, k2 = ground / crank, ground / rocker
    k3 = (crank**2 - coupler**2 + rocker**2 + ground**2) / (2.0 * crank * rocker)
    theta = motion.crank_angle
    a = np.cos(theta) - k1 - k2 * np.cos(theta) + k3
    b = -2.0 * np.sin(theta)
    c = k1 - (k2 + 1.0) * np.cos(theta) + k3
    out = 2.0 * np.arctan2(-b - np.sqrt(b * b - 4.0 * a * c), 2.0 * a)
    np.testing.assert_allclose(motion.q[:, 3, 2], out % TURN, atol=1.0e-11)


def test_slider_crank_closed_form(linkage_of):
    motion = one_cycle(linkage_of("slider_crank"), POINTS, 1.0)
    theta, r, rod = motion.crank_angle, 0.05, 0.12
    reach = np.sqrt(rod**2 - (r * np.sin(theta)) ** 2)
    np.testing.assert_allclose(motion.q[:, 3, 0], r * np.cos(theta) + reach, atol=1.0e-12)
    np.testing.assert_allclose(motion.q[:, 2, 2], -np.arcsin(r * np.sin(theta) / rod), atol=1.0e-12)
    slider_speed = -r * np.sin(theta) * (1.0 + r * np.cos(theta) / reach)
    np.testing.assert_allclose(motion.v[:, 3, 0], slider_speed, atol=1.0e-12)


@pytest.mark.parametrize("speed", [-3.0, 3.0])
def test_dead_point_names_its_crank_angle(document, speed):
    """Against Grashof, the crank stops where coupler and rocker stretch out: the triangle A B D."""
    four_bar = document("four_bar")
    four_bar["drive"]["speed"] = speed
    four_bar["bodies"]["crank"]["points"]["B"] = [0.1, 0.0]
    four_bar["ground"]["points"]["D"] = [0.3, 0.0]
    four_bar["assembly"]["coupler"] = [0.1, 0.0, 0.81]
    four_bar["assembly"]["rocker"] = [0.3, 0.0, 1.8]
    angle = np.rad2deg(np.arccos((0.1**2 + 0.3**2 - 0.35**2) / (2.0 * 0.1 * 0.3)))
    with pytest.raises(AssemblyError, match="dead point at crank angle") as caught:
        check_cycle(_linkage(four_bar))
    named = float(re.search(r"crank angle ([\d.]+) deg", str(caught.value)).group(1))
    assert named == pytest.approx(angle, abs=0.02)


def test_mobility_is_named(document):
    four_bar = document("four_bar")
    del four_bar["joints"]["C"], four_bar["clearances"]
    with pytest.raises(AssemblyError, match=r"edited\.yaml: joints: mobility is 3 .*Expected 1"):
        _linkage(four_bar)


def test_joint_that_stays_open_is_named_with_its_gap(document):
    """At crank angle 0, B is 150 mm from D: a coupler of 500 mm is 200 mm too long for a rocker of 150 mm."""
    four_bar = document("four_bar")
    four_bar["bodies"]["coupler"]["points"]["C"] = [0.5, 0.0]
    with pytest.raises(
        AssemblyError, match=r"edited\.yaml: assembly: .*joint ([A-D]) stays open by"
    ) as caught:
        assemble(_linkage(four_bar))
    gap = float(re.search(r"by ([\d.]+) mm", str(caught.value)).group(1))
    assert gap == pytest.approx(200.0, rel=0.01)


def test_lengths_too_far_apart_are_no_assembly(document):
    four_bar = document("four_bar")
    four_bar["bodies"]["coupler"]["com"][1] = 1.0e30
    with pytest.raises(AssemblyError, match=r"edited\.yaml: assembly: no assembly near the given start"):
        assemble(_linkage(four_bar))


def test_start_nearer_to_another_assembly_is_refused(document):
    four_bar = document("four_bar")
    four_bar["assembly"]["coupler"][2] -= 1.0
    four_bar["assembly"]["rocker"][2] += 1.0
    with pytest.raises(AssemblyError, match=r"assembly\.(coupler|rocker): no assembly near the given start"):
        assemble(_linkage(four_bar))


def test_assembly_is_closed_to_rounding(linkage_of):
    for name in ("bionic_leg", "jansen_leg", "klann_leg", "andrews", "four_bar", "slider_crank"):
        linkage = linkage_of(name)
        arrays, q = linkage.arrays, assemble(linkage)
        for body, point in zip(arrays.joint_body, arrays.joint_point, strict=True):
            c, s = np.cos(q[body, 2]), np.sin(q[body, 2])
            x = q[body, 0] + c * point[:, 0] - s * point[:, 1]
            y = q[body, 1] + s * point[:, 0] + c * point[:, 1]
            # a prismatic joint along x lets the points part in x
            assert abs(np.diff(y)) < 1.0e-11
            assert abs(np.diff(x)) < 1.0e-11 or name == "slider_crank"

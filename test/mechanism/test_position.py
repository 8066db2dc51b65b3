"""Positions of a linkage: closed forms, and what is said where there is no position."""

import re

import numpy as np
import pytest

from leg_wear_monitor.errors import AssemblyError
from leg_wear_monitor.mechanism.loader import load_mechanism, parse_mechanism, shipped_mechanisms
from leg_wear_monitor.mechanism.position import TURN, assemble, build_linkage, check_cycle, one_cycle
from leg_wear_monitor.mechanism.reach import findings, headline, loop_of, reach_of

# Position analysis against closed forms, and what it says where there is no position.


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


# How far a mechanism closes and turns, against closed forms of the four-bar and the slider-crank.


CRANK, COUPLER, ROCKER, BASE = 0.1, 0.2, 0.15, 0.3


@pytest.fixture
def rocking(document):
    """A four-bar against Grashof's rule: its crank rocks."""

    def four_bar(base=BASE):
        made = document("four_bar")
        made["bodies"]["crank"]["points"]["B"] = [CRANK, 0.0]
        made["ground"]["points"]["D"] = [base, 0.0]
        made["assembly"]["coupler"] = [CRANK, 0.0, 0.81]
        made["assembly"]["rocker"] = [base, 0.0, 1.8]
        return made

    return four_bar


def reach(document, *angle):
    return reach_of(parse_mechanism(document, "edited.yaml"), *angle)


def corner(a, b, opposite):
    """Angle between two sides of a triangle [rad]."""
    return np.arccos((a**2 + b**2 - opposite**2) / (2.0 * a * b))


@pytest.mark.parametrize("name", shipped_mechanisms())
def test_a_shipped_mechanism_closes_and_turns(name):
    found = reach_of(load_mechanism(name))
    assert found.turns
    assert (found.low, found.high, findings(found)) == (None, None, ())
    assert found.crank_angle[0] == 0.0
    assert len(found.q) == len(found.crank_angle) == 180
    assert max(float(found.gap_of(joint).max()) for joint in found.mechanism.joints) < 1e-9
    assert headline(found) == "closes, and the crank turns through"


def test_a_crank_that_rocks_turns_until_coupler_and_rocker_are_in_line(rocking):
    found = reach(rocking())
    end = corner(CRANK, BASE, COUPLER + ROCKER)
    assert not found.turns
    assert (found.low.crank_angle, found.high.crank_angle) == pytest.approx((-end, end), abs=4e-4)
    assert found.crank_angle[0] == found.low.crank_angle
    assert (np.diff(found.crank_angle) > 0.0).all()
    (line,) = findings(found)
    assert line.startswith("drive.body: crank turns only from -112.0 deg to 112.0 deg, 224.0 of 360 deg, ")
    assert line.endswith("between two dead points")


def test_a_range_ends_where_the_bodies_are_folded(rocking):
    """With a base of 130 mm, B comes as near to D as coupler and rocker folded: 50 mm."""
    folded = rocking(base=0.13)
    folded["assembly"] = {
        "crank_angle": np.pi, "crank": [0.0, 0.0, np.pi],
        "coupler": [-0.1, 0.0, 0.7], "rocker": [0.13, 0.0, 2.1],
    }  # fmt: skip
    found = reach(folded)
    end = corner(CRANK, 0.13, COUPLER - ROCKER)
    assert found.low.crank_angle == pytest.approx(end, abs=4e-4)


def test_a_rod_shorter_than_the_crank_stands_at_a_right_angle_to_its_guide(document):
    short = document("slider_crank")
    short["bodies"]["rod"]["points"]["B"] = [0.04, 0.0]
    short["assembly"]["slider"] = [0.09, 0.0, 0.0]
    found = reach(short)
    assert np.sin(found.high.crank_angle) == pytest.approx(0.04 / 0.05, abs=1e-3)


def test_an_asked_angle_is_among_those_of_the_result(rocking, document):
    angle = np.deg2rad(37.3)
    for made in (rocking(), document("four_bar")):
        assert np.abs((reach(made, angle).crank_angle - angle) % TURN).min() < 1e-12
        assert np.abs((reach(made, angle - TURN).crank_angle - angle + 1e-9) % TURN).min() < 1e-8
    assert np.abs(reach(rocking(), np.pi).crank_angle - np.pi).min() > 1.0


def test_the_gap_of_a_coupler_that_is_too_long(document):
    """B is 150 to 250 mm from D: a coupler of 500 mm leaves 100 mm to 200 mm."""
    long = document("four_bar")
    long["bodies"]["coupler"]["points"]["C"] = [0.5, 0.0]
    found = reach(long)
    distance = np.hypot(0.2 - 0.05 * np.cos(found.crank_angle), 0.05 * np.sin(found.crank_angle))
    assert found.gap_m == pytest.approx(0.5 - 0.15 - distance, rel=2e-3)
    assert found.gap_m == pytest.approx(found.gap_of(found.open_joint))
    assert [joint for joint in found.mechanism.joints if found.is_open(joint)] == [found.open_joint]
    assert found.low is None
    (line,) = findings(found)
    assert "is open by 200 mm" in line
    assert "the least gap is 100 mm, at 180.0 deg" in line
    assert all(body in line.split("check the lengths of ")[1] for body in ("coupler", "rocker", "crank"))


def test_where_a_mechanism_closes_that_is_open_at_the_start(document):
    """A rocker of 60 mm and a coupler of 165 mm reach 225 mm: not B at 250 mm, but B at 150 mm."""
    short = document("four_bar")
    short["bodies"]["coupler"]["points"]["C"] = [0.165, 0.0]
    short["bodies"]["rocker"]["points"]["C"] = [0.06, 0.0]
    short["assembly"] |= {"crank_angle": np.pi, "crank": [0.0, 0.0, np.pi]}
    found = reach(short)
    end = corner(0.05, 0.2, 0.225)
    assert found.open_joint
    assert found.gap_m[0] == pytest.approx(0.025, rel=2e-3)
    assert (found.low.crank_angle, found.high.crank_angle) == pytest.approx(
        (TURN - end, TURN + end), abs=4e-4
    )
    assert "it closes only from" in findings(found)[0]


def test_another_mobility_is_drawn_as_far_as_it_closes(document):
    free = document("four_bar")
    del free["joints"]["C"], free["clearances"]
    found = reach(free)
    assert (found.mobility, len(found.q), found.turns) == (3, 1, False)
    assert "a joint is missing" in findings(found)[0]


def test_a_start_near_another_assembly_is_named(document):
    far = document("four_bar")
    far["assembly"]["coupler"][2] -= 1.0
    far["assembly"]["rocker"][2] += 1.0
    found = reach(far)
    assert found.turns
    assert "no assembly near the given start" in findings(found)[0]


def test_a_length_in_mm_is_named(document):
    wrong = document("four_bar")
    wrong["bodies"]["coupler"]["points"]["C"] = [200.0, 0.0]
    assert "Is it in mm?" in findings(reach(wrong))[-1]


def test_the_loop_of_a_joint():
    four_bar = load_mechanism("four_bar")
    assert loop_of(four_bar, "C") == ("rocker", "ground", "crank", "coupler")

"""Closures, positions and ideal motion of a linkage; a person on it, the ground under it."""

import re
from collections.abc import Callable

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from leg_wear_monitor import ConfigError, load_mechanism
from leg_wear_monitor.errors import AssemblyError
from leg_wear_monitor.mechanism.arrays import compile_arrays
from leg_wear_monitor.mechanism.constraints import (
    applied_forces,
    external_power,
    load_force,
    rotations,
    stored_energy,
)
from leg_wear_monitor.mechanism.loader import parse_mechanism, shipped_mechanisms
from leg_wear_monitor.mechanism.person import (
    FORE_AFT,
    heavier_person,
    nominal_stance,
    stance_template,
    upwards,
    with_person,
    with_toe_force,
)
from leg_wear_monitor.mechanism.position import (
    TURN,
    Linkage,
    assemble,
    build_linkage,
    check_cycle,
    evaluate,
    ideal_motion,
    one_cycle,
    point_motion,
)
from leg_wear_monitor.mechanism.reach import findings, headline, loop_of, reach_of
from leg_wear_monitor.mechanism.spec import SpeedDrive, Track, TrackDrive

# Closures, positions and ideal motion of a linkage, and its URDF.


# Closures and applied forces: each is the derivative that it should be.


# Closures: the Jacobian and gamma are the derivatives of phi, in any position whatever.


STEP = 1.0e-5

# the crank's pin drives a block along a swinging arm: a prismatic joint whose guide moves
QUICK_RETURN = {
    "name": "quick_return",
    "gravity": [0.0, -9.81],
    "ground": {"points": {"O": [0.0, 0.1], "P": [0.0, -0.2]}},
    "bodies": {
        "crank": {"mass": 0.5, "inertia": 1e-4, "com": [0.03, 0.01], "points": {"O": [0, 0], "A": [0.08, 0]}},
        "block": {"mass": 0.2, "inertia": 1e-5, "com": [0.01, 0.02], "points": {"A": [0, 0], "S": [0, -0.1]}},
        "arm": {"mass": 0.9, "inertia": 1e-2, "com": [0.2, 0.01], "points": {"P": [0, 0], "S": [0.02, 0.03]}},
    },
    "joints": {
        "O": {"bushing": "ground", "journal": "crank"},
        "A": {"bushing": "block", "journal": "crank"},
        "S": {"kind": "prismatic", "guide": "arm", "slider": "block", "axis": [1.0, 0.2]},
        "P": {"bushing": "ground", "journal": "arm"},
    },
    "drive": {"body": "crank", "speed": 10.0},
    "assembly": {"crank_angle": 0.0, "crank": [0, 0.1, 0], "block": [0.08, 0.1, 1.4], "arm": [0, -0.2, 1.3]},
}  # fmt: skip


@pytest.fixture(scope="module")
def any_linkage(linkage_of: Callable[[str], Linkage]) -> Callable[[str], Linkage]:
    quick_return = build_linkage(parse_mechanism(QUICK_RETURN, "quick_return"))
    return lambda name: quick_return if name == "quick_return" else linkage_of(name)


def coordinates(bodies: int) -> st.SearchStrategy[np.ndarray]:
    """Coordinates or velocities (n, 3) of every body; those of the ground are 0."""
    moving = arrays(float, (bodies - 1, 3), elements=st.floats(-3.0, 3.0))
    return moving.map(lambda rows: np.vstack([np.zeros(3), rows]))


@pytest.mark.parametrize("name", ["bionic_leg", "slider_crank", "quick_return"])
@given(st.data())
def test_jacobian_is_the_derivative_of_phi(any_linkage, name, data):
    linkage = any_linkage(name)
    q, w = (data.draw(coordinates(len(linkage.arrays.mass))) for _ in range(2))

    def phi(q: np.ndarray) -> np.ndarray:
        return evaluate(linkage, q, np.zeros_like(q), (0.3, 0.0, 0.0)).phi

    difference = (phi(q + STEP * w) - phi(q - STEP * w)) / (2.0 * STEP)
    jacobian = evaluate(linkage, q, np.zeros_like(q), (0.3, 0.0, 0.0)).jacobian
    np.testing.assert_allclose(difference, jacobian @ w[1:].ravel(), atol=1.0e-7)


@pytest.mark.parametrize("name", ["bionic_leg", "slider_crank", "quick_return"])
@given(st.data())
def test_gamma_is_what_the_acceleration_of_phi_lacks(any_linkage, name, data):
    """Phi'' = phi_q a - gamma: gamma is minus the derivative of phi_q v along v; the drive's is theta''."""
    linkage = any_linkage(name)
    q, v = (data.draw(coordinates(len(linkage.arrays.mass))) for _ in range(2))
    alpha = data.draw(st.floats(-100.0, 100.0))

    def rate(q: np.ndarray) -> np.ndarray:
        return evaluate(linkage, q, v, (0.0, 0.0, 0.0)).jacobian @ v[1:].ravel()

    difference = -(rate(q + STEP * v) - rate(q - STEP * v)) / (2.0 * STEP)
    difference[linkage.rows.drive_row] += alpha
    gamma = evaluate(linkage, q, v, (0.0, 0.0, alpha)).gamma
    np.testing.assert_allclose(difference, gamma, atol=1.0e-6)


# Applied forces do what the energies say; loads follow their tables.


WHOLE_TURN = 2.0 * np.pi
PHASES = [0.05, 0.2, 0.6, 0.85]
FORCES = [[0.0, 100.0], [-30.0, 800.0], [60.0, 750.0], [0.0, 0.0]]

moving = arrays(float, (3, 3), elements=st.floats(-2.0, 2.0)).map(lambda rows: np.vstack([np.zeros(3), rows]))


@pytest.fixture(scope="module")
def pulled(document):
    """Arrays of the four-bar with everything that can pull at it, driven by a torque."""
    four_bar = document("four_bar")
    four_bar["drive"] = {"body": "crank", "torque": 0.7}
    up = {"bodies": ["ground", "coupler"], "points": ["D", "toe"], "stiffness": 300.0, "free_length": 0.1}
    across = {"bodies": ["rocker", "crank"], "points": ["C", "B"], "stiffness": 500.0, "free_length": 0.05}
    four_bar["springs"] = {"up": up | {"damping": 4.0}, "across": across}
    four_bar["loads"] = {
        "foot": {"body": "coupler", "point": "toe", "phase": PHASES, "force": FORCES},
        "push": {"body": "rocker", "point": "C", "force": [3.0, -5.0]},
    }
    return compile_arrays(parse_mechanism(four_bar, "four_bar"))


def _turned(q):
    cs = np.empty((len(q), 2))
    rotations(q, cs)
    return cs


def _power(mechanism, q, v):
    force = np.empty_like(q)
    applied_forces(mechanism, q, v, _turned(q), force)
    return (force * v).sum()


def _potential(mechanism, q):
    return stored_energy(mechanism, q, np.zeros_like(q), _turned(q))


@given(q=moving, v=moving)
def test_power_of_the_forces_is_that_from_outside_less_what_is_stored(pulled, q, v):
    """Gravity, springs, dampers, loads and torque together, whatever the position and velocity."""
    stored = (_potential(pulled, q + STEP * v) - _potential(pulled, q - STEP * v)) / (2.0 * STEP)
    outside = external_power(pulled, q, v, _turned(q))
    assert _power(pulled, q, v) == pytest.approx(outside - stored, rel=1.0e-6, abs=1.0e-5)


@given(q=moving, v=moving)
def test_kinetic_energy(pulled, q, v):
    kinetic = stored_energy(pulled, q, v, _turned(q)) - _potential(pulled, q)
    assert kinetic == pytest.approx(0.5 * (pulled.mass * v * v).sum(), abs=1.0e-9)


@given(phase=st.floats(-3.0, 3.0))
def test_load_is_linear_between_the_knots_and_periodic(pulled, phase):
    expected = [np.interp(phase % 1.0, PHASES, column, period=1.0) for column in zip(*FORCES, strict=True)]
    assert load_force(pulled, 0, WHOLE_TURN * phase) == pytest.approx(expected, abs=1.0e-7)


# Positions of a linkage: closed forms, and what is said where there is no position.


# Position analysis against closed forms, and what it says where there is no position.


FEW_POINTS = 24


def _linkage(document):
    return build_linkage(parse_mechanism(document, "edited.yaml"))


def test_four_bar_follows_freudenstein(linkage_of):
    """K1 cos(out) - K2 cos(in) + K3 = cos(in - out), solved for the output angle (Freudenstein 1955)."""
    motion = one_cycle(linkage_of("four_bar"), FEW_POINTS, 1.0)
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
    motion = one_cycle(linkage_of("slider_crank"), FEW_POINTS, 1.0)
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


def reach(document):
    return reach_of(parse_mechanism(document, "edited.yaml"))


def corner(a, b, opposite):
    """Angle between two sides of a triangle [rad]."""
    return np.arccos((a**2 + b**2 - opposite**2) / (2.0 * a * b))


@pytest.mark.parametrize("name", shipped_mechanisms())
def test_a_shipped_mechanism_closes_and_turns(name):
    found = reach_of(load_mechanism(name))
    assert found.turns
    assert findings(found) == ()
    assert found.crank_angle[0] == 0.0
    assert len(found.q) == len(found.crank_angle) == 180
    assert max(float(found.gap_of(joint).max()) for joint in found.mechanism.joints) < 1e-9
    assert headline(found) == "closes, and the crank turns through"


def test_a_crank_that_rocks_turns_until_coupler_and_rocker_are_in_line(rocking):
    found = reach(rocking())
    end = corner(CRANK, BASE, COUPLER + ROCKER)
    assert not found.turns
    assert found.crank_angle[[0, -1]] == pytest.approx([-end, end], abs=4e-4)
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
    assert found.crank_angle[0] == pytest.approx(end, abs=4e-4)


def test_a_rod_shorter_than_the_crank_stands_at_a_right_angle_to_its_guide(document):
    short = document("slider_crank")
    short["bodies"]["rod"]["points"]["B"] = [0.04, 0.0]
    short["assembly"]["slider"] = [0.09, 0.0, 0.0]
    found = reach(short)
    assert np.sin(found.crank_angle[-1]) == pytest.approx(0.04 / 0.05, abs=1e-3)


def test_the_gap_of_a_coupler_that_is_too_long(document):
    """B is 150 mm from D at the start: a coupler of 500 mm and a rocker of 150 mm leave 200 mm."""
    long = document("four_bar")
    long["bodies"]["coupler"]["points"]["C"] = [0.5, 0.0]
    found = reach(long)
    distance = np.hypot(0.2 - 0.05 * np.cos(found.crank_angle), 0.05 * np.sin(found.crank_angle))
    assert found.gap_m == pytest.approx(0.5 - 0.15 - distance, rel=2e-3)
    assert found.gap_of(found.open_joint) == pytest.approx(found.gap_m)
    assert [joint for joint in found.mechanism.joints if found.is_open(joint)] == [found.open_joint]
    (line,) = findings(found)
    assert "is open by 200 mm" in line
    assert all(body in line.split("check the lengths of ")[1] for body in ("coupler", "rocker", "crank"))


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


# Ideal motion: published and independently computed cycles, and the laws between its parts.


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


def test_inertia_forces_grow_with_the_square_of_speed(leg):
    linkage = build_linkage(attrs.evolve(leg, gravity=(0.0, 0.0)))
    slow, fast = (one_cycle(linkage, 8, speed) for speed in (SPEED, 3.0 * SPEED))
    np.testing.assert_allclose(fast.joint_force, 9.0 * slow.joint_force, rtol=1.0e-9)
    np.testing.assert_allclose(fast.drive_torque, 9.0 * slow.drive_torque, rtol=1.0e-9)


# A person's leg on a linkage: masses and moments of inertia by hand, and its weight on the drive.


LEG = load_mechanism("bionic_leg")


def test_a_sixth_of_the_body_hangs_on_the_leg() -> None:
    before, after = (sum(body.mass for body in leg.bodies.values()) for leg in (LEG, with_person(LEG, 80.0)))
    assert after - before == pytest.approx(0.161 * 80.0)


def test_a_heavier_person_is_one_with_another_mass() -> None:
    heavier = heavier_person(with_person(LEG, 80.0))
    assert heavier.person_kg == pytest.approx(96.0)
    for name, body in with_person(LEG, 96.0).bodies.items():
        found = heavier.bodies[name]
        assert (found.mass, found.inertia, *found.com) == pytest.approx((body.mass, body.inertia, *body.com))


def test_the_thigh_by_hand() -> None:
    """3.5 kg at 0.18 m of 0.42 m, and 8 kg at 0.433 of it with a radius of gyration of 0.323 of it."""
    thigh, length = with_person(LEG, 80.0).bodies["thigh"], 0.42
    com = (3.5 * 0.18 + 8.0 * 0.433 * length) / 11.5
    inertia = 0.059062 + 3.5 * (com - 0.18) ** 2
    inertia += 8.0 * ((0.323 * length) ** 2 + (0.433 * length - com) ** 2)
    assert thigh.com == pytest.approx((com, 0.0))
    assert thigh.inertia == pytest.approx(inertia)


def test_the_drive_holds_the_weight_of_the_segments() -> None:
    """Standing, by virtual work: torque against gravity is m g dy/dtheta of each segment's centre of mass."""
    slow = 1.0e-4 * TURN
    plain, carrying = (one_cycle(build_linkage(leg), 256, slow) for leg in (LEG, with_person(LEG, 80.0)))
    expected = np.zeros(256)
    for name, mass, upper, lower, centre in (
        ("thigh", 8.0, "B", "G", 0.433), ("shank", 3.72, "G", "I", 0.433), ("foot", 1.16, "I", "toe", 0.5),
    ):  # fmt: skip
        body = LEG.bodies[name]
        i = 1 + list(LEG.bodies).index(name)
        own = np.array(body.points[upper])
        own = own + centre * (np.array(body.points[lower]) - own) - np.array(body.com)
        angle = plain.q[:, i, 2]
        height = plain.q[:, i, 1] + np.sin(angle) * own[0] + np.cos(angle) * own[1]
        expected += 9.81 * mass * np.gradient(np.append(height[-1:], np.append(height, height[0])))[1:-1]
    expected /= TURN / 256
    assert carrying.drive_torque - plain.drive_torque == pytest.approx(expected, abs=2e-3 * np.ptp(expected))


def test_nobody_is_no_change() -> None:
    assert with_person(LEG, 0.0) is LEG


def test_a_linkage_without_these_bodies_is_refused_in_a_line() -> None:
    with pytest.raises(ConfigError, match=r"four_bar.yaml: bodies: has no thigh, shank and foot"):
        with_person(load_mechanism("four_bar"), 80.0)


# The ground under the toe: a template of stance, and when a leg stands.


POINTS = 1024


def test_template_has_the_two_peaks_and_the_valley_of_walking():
    s = np.linspace(0.0, 1.0, 1001)
    vertical, along = stance_template(s)
    assert vertical.max() == pytest.approx(1.0, abs=1e-5)
    assert vertical[[0, -1]] == pytest.approx(0.0, abs=1e-12)
    rising = np.flatnonzero((np.diff(vertical)[:-1] > 0.0) & (np.diff(vertical)[1:] <= 0.0))
    assert len(rising) >= 2
    assert vertical[450:550].min() < 0.8
    assert np.mean(along) == pytest.approx(0.0, abs=1e-12)
    assert stance_template(np.array([1.01]))[0] == 0.0


@pytest.mark.parametrize("name", ["bionic_leg", "jansen_leg", "klann_leg"])
def test_the_foot_brakes_then_pushes_while_the_toe_moves_backwards(name):
    linkage = build_linkage(load_mechanism(name))
    stance = nominal_stance(linkage)
    force = stance.force(points=POINTS)
    position, velocity, _ = point_motion(one_cycle(linkage, POINTS, 1.0), linkage, *linkage.mechanism.toe)
    vertical, along = force @ stance.up, force @ stance.back
    in_stance = vertical > 0.0
    assert (velocity[in_stance] @ stance.back > 0.0).all()
    assert in_stance[(position @ stance.up).argmin()]
    assert vertical.max() == pytest.approx(1.0, abs=1e-3)
    assert along.max() == pytest.approx(FORE_AFT, rel=1e-2)
    soon = round(stance.heel_strike * POINTS) + np.arange(1, POINTS // 10)
    assert (along[soon % POINTS] > 0.0).all()


@pytest.mark.parametrize(
    "drive",
    [
        SpeedDrive(body="crank", speed=-TURN),
        TrackDrive(body="crank", track=Track(speed_radps=-TURN, kp_nm_per_rad=4000.0)),
    ],
)
def test_reversed_the_leg_walks_the_other_way(drive):
    mechanism = load_mechanism("bionic_leg")
    back = attrs.evolve(mechanism, drive=drive)
    there, other = (nominal_stance(build_linkage(one)) for one in (mechanism, back))
    assert (other.heel_strike, other.toe_off) == (there.toe_off, there.heel_strike)
    assert other.back == pytest.approx(-there.back)


def test_a_toe_force_adds_a_load_once():
    mechanism = load_mechanism("bionic_leg")
    force = np.outer(np.ones(4), upwards(mechanism))
    once = with_toe_force(mechanism, force)
    assert with_toe_force(once, 2.0 * force).loads.keys() == once.loads.keys()
    with pytest.raises(ConfigError, match="toe"):
        with_toe_force(load_mechanism("slider_crank"), force)

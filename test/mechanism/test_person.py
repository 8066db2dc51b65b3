"""A person's leg on a linkage, and the ground under its foot."""

import attrs
import numpy as np
import pytest

from leg_wear_monitor import ConfigError, load_mechanism
from leg_wear_monitor.mechanism.person import (
    FORE_AFT,
    heavier_person,
    nominal_stance,
    stance_template,
    upwards,
    with_person,
    with_toe_force,
)
from leg_wear_monitor.mechanism.position import TURN, build_linkage, one_cycle, point_motion
from leg_wear_monitor.mechanism.spec import SpeedDrive, Track, TrackDrive

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

"""Clearances from plays: the effect of a clearance against geometry, joints told apart and not."""

import attrs
import numpy as np
import pytest

from leg_wear_monitor import LegWearError, Mechanism, load_mechanism
from leg_wear_monitor.mechanism.arrays import body_names
from leg_wear_monitor.mechanism.position import build_linkage, ideal_motion
from leg_wear_monitor.play.fit import clearances_of, effects, solved
from leg_wear_monitor.twin.angle_reference import angle_model

POSTURES = np.array([0.3, 1.5, 2.9, 4.4, 5.6])
SHIFT_M = 1.0e-5


def angles(mechanism: Mechanism, encoder: str) -> np.ndarray:
    """Angle of a joint in the postures, from the bushing's body to the journal's."""
    motion = ideal_motion(build_linkage(mechanism), POSTURES, 1.0)
    bushing, journal = (body_names(mechanism).index(body) for body in mechanism.sides(encoder))
    return motion.q[:, journal, 2] - motion.q[:, bushing, 2]


def moved(mechanism: Mechanism, joint: str, by: tuple[float, float]) -> Mechanism:
    """The mechanism with a joint moved on the bushing's body, as an eccentricity moves it."""
    bushing, _ = mechanism.sides(joint)
    body = mechanism.ground if bushing == "ground" else mechanism.bodies[bushing]
    points = {**body.points, joint: tuple(np.add(body.points[joint], by))}
    other = attrs.evolve(body, points=points)
    if bushing == "ground":
        return attrs.evolve(mechanism, ground=other)
    return attrs.evolve(mechanism, bodies={**mechanism.bodies, bushing: other})


@pytest.mark.parametrize(("encoder", "joint"), [("G", "A"), ("G", "I"), ("E", "A"), ("I", "J"), ("G", "G")])
def test_the_effect_of_a_clearance_is_that_of_a_moved_joint(encoder: str, joint: str) -> None:
    leg = load_mechanism("bionic_leg")
    expected = effects(angle_model(leg, [encoder]), POSTURES)[:, leg.clearance_joints.index(joint)]
    slopes = []
    for direction in ((SHIFT_M, 0.0), (0.0, SHIFT_M)):
        back = tuple(-each for each in direction)
        change = angles(moved(leg, joint, direction), encoder) - angles(moved(leg, joint, back), encoder)
        slopes.append(change / (2.0 * SHIFT_M))
    assert expected == pytest.approx(2.0 * np.hypot(*slopes), rel=2e-3, abs=1e-6)


def test_several_postures_tell_joints_apart_and_the_sigma_holds() -> None:
    leg = attrs.evolve(load_mechanism("bionic_leg"), clearance_joints=("A", "G"))
    effect = effects(angle_model(leg, ["G"]), POSTURES)
    true = np.array([0.0004, 0.0006])
    sigma = np.full(len(POSTURES), 2.0e-5)
    rng = np.random.default_rng(1)
    errors = []
    for _ in range(200):
        play = effect @ true + sigma * rng.standard_normal(len(sigma))
        found = solved(("A", "G"), effect, play, sigma)
        assert not found.not_told_apart
        errors += [(one.clearance_m - c) / one.sigma_m for one, c in zip(found.joints, true, strict=True)]
    print(f"rms error in standard deviations: {np.sqrt(np.mean(np.square(errors))):.3f}")
    assert 0.85 < np.sqrt(np.mean(np.square(errors))) < 1.15


def test_what_one_posture_cannot_tell_apart_is_said_together() -> None:
    leg = load_mechanism("bionic_leg")
    found = clearances_of(leg, "G", [0.3], [0.004], [0.0001])
    effect = effects(angle_model(leg, ["G"]), np.array([0.3]))[0]
    shown = [name for name, one in zip(leg.clearance_joints, effect, strict=True) if one]
    assert list(found.not_told_apart) == shown
    for one, each in zip(found.joints, effect, strict=True):
        assert one.clearance_m is None
        assert one.most_m == (pytest.approx(0.0042 / each) if each else None)


def test_plays_that_do_not_fit_are_found() -> None:
    effect = np.array([[1.0, 2.0], [2.0, 1.0], [1.0, 1.0]])
    sigma = np.full(3, 0.01)
    assert not solved("AB", effect, effect @ [1.0, 1.0], sigma).findings
    assert "no clearances explain" in solved("AB", effect, np.array([3.0, 3.0, 5.0]), sigma).findings[0]
    negative = solved("AB", effect, effect @ [1.0, -0.2], sigma)
    assert "of B would be -200 mm" in negative.findings[0]


def test_a_joint_without_an_effect_is_not_reported() -> None:
    found = solved("AB", np.array([[1.0, 0.0]]), np.array([1.0]), np.array([0.01]))
    assert found.joints[0].clearance_m == pytest.approx(1.0)
    assert found.joints[1].most_m is None
    with pytest.raises(LegWearError, match="has an effect"):
        solved("A", np.zeros((1, 1)), np.array([1.0]), np.array([0.01]))

"""Masses, lengths and friction of a leg, from its commissioned torque."""

import math

import attrs
import numpy as np
import pytest

from leg_wear_monitor.estimate.identification import (
    FAR_FROM_FILE,
    identified_leg,
    leg_of_ideal_torque,
    misfit,
)
from leg_wear_monitor.estimate.leg_model import nuisances
from leg_wear_monitor.estimate.signature import (
    CommissionedTorque,
    SimulatedSensor,
    TorqueSensor,
    signature_model,
)
from leg_wear_monitor.mechanism.position import TURN, build_linkage, one_cycle
from leg_wear_monitor.monitor.diagnosis.reference_file import shipped_references
from leg_wear_monitor.twin.reference import POINTS, LegParameters
from leg_wear_monitor.twin.torque_reference import HEAVIER, LONGER, ROUGHER, design

SENSOR = TorqueSensor(period_s=0.005, cycle_s=1.0, size_nm=9.2, noise_nm=0.3)


@pytest.fixture(scope="module")
def known(leg):
    reference = shipped_references(leg)[0]
    return reference, signature_model(reference, SENSOR), nuisances(leg, reference, SENSOR)


def ideal(leg, bodies: LegParameters):
    """Drive torque of ideal joints at the steps of a reference."""
    return one_cycle(build_linkage(bodies.applied(leg)), POINTS, TURN).drive_torque


def walked(leg, reference, bodies: LegParameters, number: int = 0):
    """Torques of a leg of the reference, with the change that other bodies make with ideal joints."""
    change = ideal(leg, bodies) - ideal(leg, LegParameters.none(leg))
    return (reference.torque_nm[number].astype(float) + change).astype(np.float16)


@pytest.fixture(scope="module")
def legs(leg, known):
    """Legs in which all bodies are changed at once, and friction, which scales the torque."""
    reference, none, bodies = known[0], LegParameters.none(leg), len(leg.bodies)
    torques = []
    for level in design(2 * bodies + 1):
        mass, length, friction = np.split(level, [bodies, 2 * bodies])
        own = LegParameters(none.mass + HEAVIER * mass, none.length + LONGER * length)
        rougher = friction.item() * math.log(ROUGHER) * of_friction(reference)
        torques.append((walked(leg, reference, own) + rougher).astype(np.float16))
    return attrs.evolve(reference, torque_nm=tuple(torques), parameters=none)


def of_friction(reference):
    """Change (POINTS,) of the torque [N m] by one unit of the logarithm of the friction, of any shape."""
    return 0.4 * np.sign(np.sin(3.0 * np.linspace(0.0, TURN, POINTS, endpoint=False)))


def commissioned(reference, torque) -> CommissionedTorque:
    drawn = SimulatedSensor(attrs.evolve(reference, torque_nm=(torque,)), len(torque), SENSOR).draws(0)
    return CommissionedTorque(1, reference.clearance_m[0], drawn.reshape(-1, drawn.shape[2]))


def test_a_leg_of_its_file_keeps_its_bodies(known, legs) -> None:
    reference, model, found = known
    same = commissioned(reference, reference.torque_nm[0])
    assert misfit(model, found, same) < 0.1
    bodies = identified_leg(legs, model, found, same)
    np.testing.assert_allclose(np.concatenate([bodies.mass, bodies.length]), 1.0, atol=1e-6)
    assert bodies.friction == pytest.approx(1.0, abs=1e-5)


def test_friction_is_identified_from_the_torque(known, legs) -> None:
    reference, model, found = known
    torque = (reference.torque_nm[0] + math.log(2.0) * of_friction(reference)).astype(np.float16)
    other = identified_leg(legs, model, found, commissioned(reference, torque))
    assert other.friction == pytest.approx(2.0, rel=0.1)


def test_other_bodies_are_identified_from_the_torque(leg, known, legs) -> None:
    reference, model, found = known
    none = LegParameters.none(leg)
    names = list(leg.bodies)
    truth = attrs.evolve(none, mass=none.mass + 0.05 * (np.array(names) == "shank"))
    truth = attrs.evolve(truth, length=truth.length + 0.008 * (np.array(names) == "thigh"))
    other = commissioned(reference, walked(leg, reference, truth))
    bodies = identified_leg(legs, model, found, other)
    # only combinations act on the torque: what is judged is the torque of the identified leg
    mean = commissioned(reference, walked(leg, reference, bodies)).mean
    own = misfit(model, found, commissioned(reference, reference.torque_nm[0]))
    before = misfit(model, found, other) - own
    after = misfit(attrs.evolve(model, mean=mean), found, other) - own
    assert after < 0.25 * before


# legs that can turn
@pytest.mark.parametrize("seed", [1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (4, 6))])
def test_a_leg_far_from_its_file_is_found_near_by_the_ideal_torque(leg, known, seed) -> None:
    reference, model, found = known
    mass, length = np.random.default_rng(seed).uniform(0.95, 1.05, (2, len(leg.bodies)))
    truth = LegParameters(mass, length)
    other = commissioned(reference, walked(leg, reference, truth))
    assert misfit(model, found, other) > FAR_FROM_FILE
    near = leg_of_ideal_torque(leg, model, other, TURN, reference.parameters.load)
    left, whole = (ideal(leg, bodies) - ideal(leg, truth) for bodies in (near, LegParameters.none(leg)))
    assert np.sqrt(np.mean(left**2)) < 0.15 * np.sqrt(np.mean(whole**2))


def test_a_leg_of_its_file_is_not_moved_by_the_ideal_torque(leg, known) -> None:
    reference, model, _ = known
    same = commissioned(reference, reference.torque_nm[0])
    near = leg_of_ideal_torque(leg, model, same, TURN, reference.parameters.load)
    np.testing.assert_allclose(np.concatenate([near.mass, near.length]), 1.0, atol=2.0e-3)


def test_factors_scale_bodies(leg) -> None:
    none = LegParameters.none(leg)
    assert none.applied(leg) == leg
    twice = LegParameters(2.0 * none.mass, 2.0 * none.length).applied(leg)
    for name, body in leg.bodies.items():
        other = twice.bodies[name]
        assert (other.mass, other.inertia) == pytest.approx((2.0 * body.mass, 8.0 * body.inertia))
        for point, place in body.points.items():
            assert other.points[point] == pytest.approx(tuple(2.0 * np.array(place)))


def test_a_factor_scales_the_friction_of_all_joints(leg) -> None:
    rough = attrs.evolve(LegParameters.none(leg), friction=3.0).applied(leg)
    for joint, one in leg.clearances.items():
        assert rough.clearances[joint].friction.coefficient == pytest.approx(3.0 * one.friction.coefficient)
    assert rough.bodies == leg.bodies

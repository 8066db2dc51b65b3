"""Clearances from encoders: what is put into angles is found again, and what cannot be seen is said."""

import attrs
import numpy as np
import pytest

from leg_wear_monitor import ConfigError
from leg_wear_monitor.dynamics.full_run import FullRun
from leg_wear_monitor.dynamics.run import new_run_statistics
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.mechanism.arrays import body_names
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.monitor.config.inputs import Encoders
from leg_wear_monitor.monitor.encoders import (
    ClearanceRegression,
    clearance_estimates,
    commissioned,
    errors_of,
    prior_with,
)
from leg_wear_monitor.monitor.reports import ClearanceObservation
from leg_wear_monitor.twin.reference import HARMONICS, CrankProfile, even_angles, worn_to
from leg_wear_monitor.twin.references import (
    PHASES,
    AngleReference,
    AngleReferenceRun,
    angle_columns,
    angle_model,
    at_phases,
)

SENSORS = ("B", "G", "I")  # hip, knee, ankle
FRESH = np.full(5, 3e-4)
UNKNOWN = errors_of(Encoders(names=("hip", "knee", "ankle"), joints=SENSORS), None)
ERRORS = np.array([1e-3, 0.01, -0.02, 0.015, 2e-3, -1e-3, 3e-3])  # crank's offset, offsets, scales


@pytest.fixture(scope="module")
def model(leg):
    return angle_model(leg, SENSORS)


@pytest.fixture(scope="module")
def shape():
    """Directions that turn with the crank, each joint's in its own way."""
    phase = (np.arange(PHASES) + 0.5) * (TURN / PHASES)
    angle = np.stack([a * np.sin(phase + a) + b for a, b in ((1, 0), (2, 1), (3, 4), (1, 2), (2, 5))], axis=1)
    return np.stack([np.cos(angle), np.sin(angle)], axis=2)


@pytest.fixture(scope="module")
def reference(model, shape):
    """Of a leg that obeys the linear model, so well known as if from any number of gait cycles."""
    columns = angle_columns(model, shape)
    return AngleReference(FRESH, columns[:, :, :5] @ FRESH, columns, 10**9, CrankProfile.steady(TURN))


@pytest.fixture(scope="module")
def simulated(leg, model):
    """A reference by simulation; of few gait cycles, for time."""
    run = AngleReferenceRun(leg, model, cycles=16)
    run.begin(FRESH, np.zeros((5, 2, 720)))
    return run.finish()


def read(model, shape, clearance, errors=ERRORS, noise=0.0, seed=0, scatter=0.05):
    """A cycle's samples of encoders on a leg that obeys the model, but for scatter of its clearances."""
    random = np.random.default_rng(seed)
    crank = (np.arange(PHASES) + 0.5) * (TURN / PHASES)
    seen = np.asarray(clearance) * (1.0 + scatter * random.standard_normal(len(clearance)))
    deviation = angle_columns(model, shape) @ np.concatenate([seen, errors])
    ideal = model.angle[len(model.angle) // PHASES // 2 :: len(model.angle) // PHASES]
    return crank, ideal + deviation + noise * random.standard_normal(ideal.shape)


def watched(model, shape, reference, before, clearance, cycles=40, **more):
    """Encoders watched over cycles."""
    hidden = ClearanceRegression(model, reference, before)
    for seed in range(cycles):
        hidden.add(*read(model, shape, clearance, seed=seed, **more))
    return hidden


def observations(found):
    return [one.observation for one in clearance_estimates(found, FRESH)]


def others(found):
    """Joints that are reported as other than new."""
    return [k for k, one in enumerate(clearance_estimates(found, FRESH)) if one.is_other]


WORN = [3e-4, 3.3e-4, 4.5e-4, 3e-4, 3.1e-4]


@pytest.mark.parametrize("noise", [0.0, 1e-4, 1e-3])
def test_clearances_and_the_encoders_errors_are_found_at_once(model, shape, reference, noise):
    found = watched(model, shape, reference, prior_with(UNKNOWN, FRESH, 3e-4), WORN, noise=noise).fused()
    np.testing.assert_allclose(found.clearance_m, WORN, atol=1e-5 + 0.02 * noise)
    np.testing.assert_allclose(found.mean[5:9], ERRORS[:4], atol=2e-4 + noise)
    assert (found.sigma_m < 3e-5 + 0.02 * noise).all()


def test_outliers_do_no_harm(model, shape, reference):
    hidden = ClearanceRegression(model, reference, prior_with(UNKNOWN, FRESH, 3e-4))
    for seed in range(30):
        crank, angles = read(model, shape, WORN, seed=seed, noise=1e-4)
        angles[seed::20] += 0.5
        hidden.add(crank, angles)
    np.testing.assert_allclose(hidden.fused().clearance_m, WORN, atol=2e-5)


def test_too_few_cycles_say_nothing(model, shape, reference):
    assert watched(model, shape, reference, prior_with(UNKNOWN, FRESH, 3e-4), WORN, cycles=5).fused() is None


def test_the_hip_alone_says_nothing_of_the_ankle(model, shape, reference):
    """What was known before stays, mean and deviation."""

    def by_hip(sigma_m):
        hidden = ClearanceRegression(model, reference, prior_with(UNKNOWN, FRESH, sigma_m))
        for seed in range(30):
            crank, angles = read(model, shape, WORN, seed=seed)
            angles[:, 1:] = np.nan
            hidden.add(crank, angles)
        return hidden.fused()

    expected = [ClearanceObservation.SEEN] * 3 + [ClearanceObservation.NOT_OBSERVABLE] * 2
    assert observations(by_hip(1e-3)) == expected
    found = by_hip(2e-5)
    np.testing.assert_allclose(found.clearance_m[3:], FRESH[3:], atol=1e-9)
    np.testing.assert_allclose(found.sigma_m[3:], 2e-5, rtol=1e-3)


def test_a_worn_joint_is_named_and_a_sound_leg_is_left_alone(model, shape, reference):
    new = watched(model, shape, reference, prior_with(UNKNOWN, FRESH, 5e-6), FRESH, noise=1e-4).fused()
    before = prior_with(commissioned(UNKNOWN, new), FRESH, 1e-4)
    for k in range(5):
        worn = [4.5e-4 if j == k else 3e-4 for j in range(5)]
        assert others(watched(model, shape, reference, before, worn, noise=1e-4).fused()) == [k]
    assert others(watched(model, shape, reference, before, FRESH, noise=1e-4).fused()) == []


def test_fusion_weighs_by_covariance(model, shape, reference):
    """A sure prediction moves little, an unsure one takes over what is seen."""
    sure = watched(model, shape, reference, prior_with(UNKNOWN, FRESH, 1e-7), WORN, scatter=0.2).fused()
    unsure = watched(model, shape, reference, prior_with(UNKNOWN, FRESH, 1e-3), WORN, scatter=0.2).fused()
    assert sure.clearance_m[2] == pytest.approx(FRESH[2], abs=1e-6)
    assert unsure.clearance_m[2] == pytest.approx(WORN[2], abs=3e-5)


@pytest.mark.chaotic
def test_a_leg_in_full_coordinates_shows_its_worn_knee(leg, model, simulated):
    """Its angles come from its own equations of motion, not from the model that looks at them."""
    setup, names = prepare(leg), body_names(leg)
    setup.contacts.clearance[setup.clearance_joints.index("G")] = 4.5e-4
    run, statistics = FullRun(setup, tolerance_m=1e-9), new_run_statistics(len(leg.joints))
    run.advance(1.0, statistics)
    hidden = ClearanceRegression(model, simulated, prior_with(UNKNOWN, FRESH, 1e-3))
    random, pairs = np.random.default_rng(1), [[names.index(b) for b in leg.sides(j)] for j in SENSORS]
    for cycle in range(20):
        turned = []
        for sample in range(200):
            run.advance(1.0 + cycle + (sample + 1) / 200.0, statistics)
            turned.append(run.q[:, 2].copy())
        angle = np.array(turned)
        seen = np.stack([angle[:, j] - angle[:, b] for b, j in pairs], axis=1)
        hidden.add(angle[:, 1], seen + 1e-4 * random.standard_normal(seen.shape))
    found = hidden.fused()
    assert others(found) == [setup.clearance_joints.index("G")]
    np.testing.assert_allclose(found.clearance_m, [3e-4, 3e-4, 4.5e-4, 3e-4, 3e-4], atol=5e-5)


def test_an_encoder_that_is_absent_is_as_one_that_was_never_there(leg, model, simulated, shape):
    """What I and J do to the hip by way of others shows in a simulated reference; it is not to be used."""
    hip, own = angle_model(leg, ("B",)), [*range(7), 9]
    reference = attrs.evolve(
        simulated, deviation=simulated.deviation[:, :1], columns=simulated.columns[:, :1, own]
    )
    errors = errors_of(Encoders(names=("hip",), joints=("B",)), None)
    alone = ClearanceRegression(hip, reference, prior_with(errors, FRESH, 1e-3))
    absent = ClearanceRegression(model, simulated, prior_with(UNKNOWN, FRESH, 1e-3))
    for seed in range(30):
        crank, angles = read(model, shape, WORN, seed=seed, noise=1e-4)
        alone.add(crank, angles[:, :1])
        angles[:, 1:] = np.nan
        absent.add(crank, angles)
    found, expected = absent.fused(), alone.fused()
    assert observations(found)[3:] == observations(expected)[3:] == [ClearanceObservation.NOT_OBSERVABLE] * 2
    np.testing.assert_allclose(found.mean[own], expected.mean, rtol=1e-3, atol=1e-7)
    np.testing.assert_allclose(found.sigma_m, expected.sigma_m, rtol=1e-2)


def test_a_worn_joint_is_worn_more_where_it_is_worn():
    depth = np.zeros((2, 2, 720))
    depth[0, 0, :180] = 8e-5  # 20 um in the mean
    fresh, target = np.array([3e-4, 3e-4]), np.array([3.5e-4, 3.5e-4])
    clearance, profile = worn_to(fresh, depth, target)
    np.testing.assert_allclose(clearance, [3e-4, 3.5e-4])
    np.testing.assert_allclose(clearance + profile.sum(axis=1).mean(axis=1), target)
    np.testing.assert_allclose(profile[0, 0, :180], 2e-4)


@pytest.mark.parametrize("target", [3e-4, 2.9e-4])
def test_a_joint_that_is_to_be_new_has_no_wear(target: float):
    """Worn by more than its clearance when new, it had a negative one, and a torque of 1e143 N m."""
    clearance, profile = worn_to(np.array([3e-4]), np.full((1, 2, 720), 3e-4), np.array([target]))
    assert clearance == [target]
    assert not profile.any()


def test_a_sensor_has_to_sit_on_a_revolute_joint(leg):
    with pytest.raises(ConfigError, match="'Z' is not a revolute joint"):
        angle_model(leg, ("Z",))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_phases_are_where_they_are_however_the_crank_turns(sign) -> None:
    """A crank with ripple passes each phase at another time, but at the same angle."""
    ripple = CrankProfile(sign * TURN, np.zeros(HARMONICS), 0.015 * np.eye(HARMONICS)[1])
    angle = ripple.angles(even_angles(ripple))[1:]
    found = at_phases(ripple, np.stack([np.cos(angle), np.sin(angle)], axis=1)[:, None])
    wanted = (np.arange(PHASES) + 0.5) * (TURN / PHASES)
    np.testing.assert_allclose(found[:, 0], np.stack([np.cos(wanted), np.sin(wanted)], axis=1), atol=2e-5)

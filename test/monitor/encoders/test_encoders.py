"""Clearances by encoders of joints."""

import math
import sqlite3
from contextlib import closing

import attrs
import numpy as np
import pytest
from reported import status_of

from leg_wear_monitor import ConfigError, WearMonitor
from leg_wear_monitor.dynamics.full_run import FullRun
from leg_wear_monitor.dynamics.run import new_run_statistics
from leg_wear_monitor.dynamics.simulation import prepare
from leg_wear_monitor.mechanism.arrays import body_names
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.monitor.config.inputs import Encoders
from leg_wear_monitor.monitor.config.parameters import config_from
from leg_wear_monitor.monitor.encoders import (
    ClearanceRegression,
    binned,
    clearance_estimates,
    errors_of,
    prior_with,
)
from leg_wear_monitor.monitor.encoders import commissioned as commissioned_errors
from leg_wear_monitor.monitor.ledger.entry import Commissioned
from leg_wear_monitor.monitor.ledger.file import read as read_records
from leg_wear_monitor.monitor.reports import ClearanceObservation
from leg_wear_monitor.state import Level
from leg_wear_monitor.twin.reference import HARMONICS, CrankProfile, even_angles, worn_to
from leg_wear_monitor.twin.references import (
    PHASES,
    AngleReference,
    AngleReferenceRun,
    angle_columns,
    angle_model,
    at_phases,
)
from leg_wear_monitor.twin.sample import EMPTY

# Further encoders in the monitor: commissioned, held, watched; the stream may be cut anywhere.


NAMES, JOINTS = ("hip", "knee", "ankle"), ("B", "G", "I")
WATCHED = {"encoders.names": NAMES, "encoders.joints": JOINTS}
FRESH = np.full(5, 3.0e-4)
ERRORS = np.array([1e-3, 0.01, -0.02, 0.015, 2e-3, -1e-3, 3e-3])  # crank's offset, offsets, scales
REFERENCE_CYCLES = 1  # for time: the encoders here obey the reference, whatever it is


@pytest.fixture(scope="module")
def reference(leg):
    run = AngleReferenceRun(leg, angle_model(leg, JOINTS), REFERENCE_CYCLES)
    run.begin(FRESH, np.zeros((5, 2, 720)))
    return run.finish()


@pytest.fixture(scope="module")
def read(leg, gait, reference):
    """Crank samples with the angles of encoders, on a leg with given clearances; cycles scatter a little."""
    model = angle_model(leg, JOINTS)
    fine = np.arange(len(model.angle)) * (TURN / len(model.angle))

    def make(duration_s, begin_s=0.0, clearance=FRESH, shift=(0.0, 0.0, 0.0)):
        samples = gait(duration_s, begin_s=begin_s, noise_rad=1e-4)
        crank = samples["crank_angle_rad"]
        phase = np.minimum((crank * (PHASES / TURN)).astype(int), PHASES - 1)
        cycle = np.floor(begin_s + np.arange(len(samples)) / 200.0).astype(int)
        opened = clearance - FRESH + 2e-6 * np.random.default_rng(0).standard_normal((2000, 5))[cycle]
        errors = np.broadcast_to(ERRORS, (len(samples), 7))
        for i, angle in enumerate(np.unwrap(model.angle, axis=0).T):
            off = reference.columns[phase, i] * np.hstack([opened, errors])
            deviation = reference.deviation[phase, i] + off.sum(axis=1)
            samples["encoder_rad"][:, i] = np.interp(crank, fine, angle, period=TURN) + deviation + shift[i]
        return samples

    return make


def soon(config):
    """The configuration with few gait cycles for each estimate."""
    few = attrs.evolve(config.encoders, commissioning_cycles=20, window_cycles=20)
    return attrs.evolve(config, encoders=few)


def quick(monitor):
    """With the reference that encoders obey: of so few cycles, any other is not like it."""
    run = monitor._leg.encoders._reference
    run._cycles, begin = REFERENCE_CYCLES, run.begin
    run.begin = lambda *_: begin(FRESH, np.zeros((5, 2, 720)))
    return monitor


@pytest.fixture(scope="module")
def new_watch(leg):
    """Makes a monitor with encoders."""
    return lambda: quick(WearMonitor(leg, soon(config_from(WATCHED))))


@pytest.fixture(scope="module")
def commissioned(new_watch, read):
    """Makes a monitor whose encoders are commissioned."""

    def make():
        monitor = new_watch()
        reports = monitor.update(read(24.0, shift=(0.0, 2.9, -1.0)))
        found = {joint.seen.observation for joint in reports.cycles[15].joints}
        assert found == {ClearanceObservation.COMMISSIONING}
        return monitor

    return make


def seen(reports):
    return {joint.joint: joint.seen for joint in reports.cycles[-1].joints}


def test_encoders_are_commissioned_and_show_what_is_there(commissioned, read):
    """Wherever they count from."""
    monitor = commissioned()
    values = status_of(monitor, "encoders").values
    assert values["hip_scale_error"] == pytest.approx(ERRORS[4], abs=5e-4)
    assert values["knee_offset_rad"] == pytest.approx(2.88, abs=2e-3)
    reports = monitor.update(read(10.0, 24.0, shift=(0.0, 2.9, -1.0)))
    for one in seen(reports).values():
        assert one.observation is ClearanceObservation.SEEN
        assert one.clearance_m == pytest.approx(3.0e-4, abs=8e-6)
        assert one.believed
        assert not one.is_other
    assert status_of(monitor, "encoders").message == "clearances agree with the model"
    assert reports.cycles[-1].joints[0].forecast.measurements == 1


def test_a_worn_joint_is_found_named_and_alarmed(commissioned, read):
    monitor = commissioned()
    worn = FRESH + np.array([0.0, 0.0, 1.5e-4, 0.0, 0.0])
    samples = read(25.0, 24.0, worn, shift=(0.0, 2.9, -1.0))
    reports = monitor.update(samples)
    shown = seen(reports)
    assert [joint for joint, one in shown.items() if one.is_other] == ["G"]
    assert shown["G"].departure_m == pytest.approx(1.5e-4, abs=1e-5)
    assert not shown["G"].believed  # nothing has worn: the forecast holds it next to impossible
    assert status_of(monitor, "encoders").message == "joint G is wider than modelled"
    assert status_of(monitor, "encoders").level is Level.ERROR
    first = next(
        change.stamp_ns
        for change in reports.alarms
        for alarm in change.alarms
        if alarm.name == "clearance_departure G" and alarm.level is not Level.OK
    )
    assert first - samples["stamp_ns"][0] < 24 * 10**9
    monitor.reset_wear("G", 0, "ann")
    reports = monitor.update(read(24.0, 49.0, shift=(0.0, 2.9, -1.0)))
    assert not any(one.is_other for one in seen(reports).values())


def said(monitor, reports):
    cycles = [cycle for report in reports for cycle in report.cycles]
    alarms = [change for report in reports for change in report.alarms]
    return repr(cycles), repr(alarms), repr(monitor.status())


def messy(read):
    """Repeats, late, missing and odd angles, a gap, and an encoder that falls off."""
    samples = read(12.0, 24.0, shift=(0.0, 2.9, -1.0))
    stream = np.concatenate([samples[:600], samples[590:600], samples[800:]])
    stream["encoder_rad"][100:140:3, 1] = np.nan
    stream["encoder_rad"][140:150, 0] = np.inf
    stream["encoder_rad"][1200:, 2] = np.nan
    stream["fault"][300:310:2] = EMPTY
    stream[[1000, 1003]] = stream[[1003, 1000]]
    return stream


def test_what_encoders_show_does_not_depend_on_blocks(commissioned, read):
    stream = messy(read)
    monitor = commissioned()
    whole = said(monitor, [monitor.update(stream)])
    assert "SEEN" in whole[0]
    monitor = commissioned()
    cuts = np.sort(np.random.default_rng(0).integers(0, len(stream), 12))
    assert said(monitor, [monitor.update(block) for block in np.split(stream, cuts) if len(block)]) == whole


@pytest.mark.parametrize(
    "value, words", [(math.nan, "is not in joint_states with the crank"), (math.inf, "gives no angle")]
)
def test_an_encoder_that_says_nothing_is_reported_and_no_cycle_is_used(new_watch, read, value, words):
    monitor = new_watch()
    samples = read(3.5)
    samples["encoder_rad"][:, 1] = value
    monitor.update(samples)
    assert status_of(monitor, "encoders").level is Level.WARN
    assert status_of(monitor, "encoders").message.startswith(f"knee {words}")
    assert status_of(monitor, "encoders").values["cycles"] == 0.0
    assert len(monitor.status()[1].values) > 0 and monitor.lost.unmonitored_s < 0.2


def test_a_leg_that_cannot_be_simulated_is_reported_and_the_crank_goes_on(new_watch, read, monkeypatch):
    monitor = new_watch()
    # whatever the stepper says, it failed
    monkeypatch.setattr("leg_wear_monitor.twin.reference.DONE", -1)
    reports = monitor.update(read(7.5))
    assert "could not be simulated" in status_of(monitor, "encoders").message
    assert status_of(monitor, "encoders").level is Level.WARN
    assert len(reports.cycles) == 6


def test_an_encoder_on_another_joint_than_said_is_reported(new_watch, read):
    monitor = new_watch()
    samples = read(3.5)
    samples["encoder_rad"][:, 2] *= -1.0
    monitor.update(samples)
    assert "ankle does not turn like joint I" in status_of(monitor, "encoders").message


def test_other_encoders_are_commissioned_again_and_the_same_ones_are_not(begin, read, tmp_path):
    whole = WATCHED | {"clearance_joints": []}
    first = quick(begin(whole | {"encoders.names": ["hip"], "encoders.joints": ["B"]}, soon))
    reports = first.update(read(24.0))
    shown = [one.observation for one in seen(reports).values()]
    assert shown[3:] == [ClearanceObservation.NOT_OBSERVABLE] * 2
    assert "hip_offset_rad" in status_of(first, "encoders").values
    first.close()
    second = quick(begin(whole, soon))
    assert "hip_offset_rad" not in status_of(second, "encoders").values
    reports = second.update(read(25.0, 24.0))
    assert {one.observation for one in seen(reports).values()} == {ClearanceObservation.SEEN}
    assert status_of(second, "encoders").values["ankle_offset_rad"] == pytest.approx(ERRORS[3], abs=2e-3)
    second.close()
    stored = kept(tmp_path)
    assert errors_of(config_from(WATCHED).encoders, stored).known
    third = quick(begin(whole, soon))
    values = status_of(third, "encoders").values
    assert values["ankle_offset_rad"] == stored.centre_rad[2] + stored.mean[3]
    third.close()


def kept(tmp_path):
    with closing(sqlite3.connect(tmp_path / "wear.ledger")) as db:
        return read_records(db, Commissioned)[-1]


def test_without_encoders_there_is_nothing_new(monitor, gait):
    reports = monitor.update(gait(2.5))
    assert [joint.seen for joint in reports.cycles[-1].joints] == [None] * 5
    assert "encoders" not in {one.name for one in monitor.status()}
    assert not any("departure" in alarm.name for alarm in monitor.alarms.alarms)


# Clearances from encoders: what is put into angles is found again, and what cannot be seen is said.


UNKNOWN = errors_of(Encoders(names=NAMES, joints=JOINTS), None)


@pytest.fixture(scope="module")
def model(leg):
    return angle_model(leg, JOINTS)


@pytest.fixture(scope="module")
def shape():
    """Directions that turn with the crank, each joint's in its own way."""
    phase = (np.arange(PHASES) + 0.5) * (TURN / PHASES)
    angle = np.stack([a * np.sin(phase + a) + b for a, b in ((1, 0), (2, 1), (3, 4), (1, 2), (2, 5))], axis=1)
    return np.stack([np.cos(angle), np.sin(angle)], axis=2)


@pytest.fixture(scope="module")
def simulated_reference(model, shape):
    """Of a leg that obeys the linear model, so well known as if from any number of gait cycles."""
    columns = angle_columns(model, shape)
    return AngleReference(FRESH, columns[:, :, :5] @ FRESH, columns, 10**9, CrankProfile.steady(TURN))


@pytest.fixture(scope="module")
def simulated(leg, model):
    """A reference by simulation; of few gait cycles, for time."""
    run = AngleReferenceRun(leg, model, cycles=16)
    run.begin(FRESH, np.zeros((5, 2, 720)))
    return run.finish()


def read_cycle(model, shape, clearance, errors=ERRORS, noise=0.0, seed=0, scatter=0.05):
    """A cycle's samples of encoders on a leg that obeys the model, but for scatter of its clearances."""
    random = np.random.default_rng(seed)
    crank = (np.arange(PHASES) + 0.5) * (TURN / PHASES)
    seen = np.asarray(clearance) * (1.0 + scatter * random.standard_normal(len(clearance)))
    deviation = angle_columns(model, shape) @ np.concatenate([seen, errors])
    ideal = model.angle[len(model.angle) // PHASES // 2 :: len(model.angle) // PHASES]
    return crank, ideal + deviation + noise * random.standard_normal(ideal.shape)


def watched(model, shape, simulated_reference, before, clearance, cycles=40, **more):
    """Encoders watched over cycles."""
    hidden = ClearanceRegression(model, simulated_reference, before)
    for seed in range(cycles):
        hidden.add(*binned(model, *read_cycle(model, shape, clearance, seed=seed, **more)))
    return hidden


def observations(found):
    return [one.observation for one in clearance_estimates(found, FRESH)]


def others(found):
    """Joints that are reported as other than new."""
    return [k for k, one in enumerate(clearance_estimates(found, FRESH)) if one.is_other]


WORN = [3e-4, 3.3e-4, 4.5e-4, 3e-4, 3.1e-4]


@pytest.mark.parametrize("noise", [0.0, 1e-4, 1e-3])
def test_clearances_and_the_encoders_errors_are_found_at_once(model, shape, simulated_reference, noise):
    found = watched(
        model, shape, simulated_reference, prior_with(UNKNOWN, FRESH, 3e-4), WORN, noise=noise
    ).fused()
    np.testing.assert_allclose(found.clearance_m, WORN, atol=1e-5 + 0.02 * noise)
    np.testing.assert_allclose(found.mean[5:9], ERRORS[:4], atol=2e-4 + noise)
    assert (found.sigma_m < 3e-5 + 0.02 * noise).all()


def test_outliers_do_no_harm(model, shape, simulated_reference):
    hidden = ClearanceRegression(model, simulated_reference, prior_with(UNKNOWN, FRESH, 3e-4))
    for seed in range(30):
        crank, angles = read_cycle(model, shape, WORN, seed=seed, noise=1e-4)
        angles[seed::20] += 0.5
        hidden.add(*binned(model, crank, angles))
    np.testing.assert_allclose(hidden.fused().clearance_m, WORN, atol=2e-5)


def test_too_few_cycles_say_nothing(model, shape, simulated_reference):
    assert (
        watched(model, shape, simulated_reference, prior_with(UNKNOWN, FRESH, 3e-4), WORN, cycles=5).fused()
        is None
    )


def test_the_hip_alone_says_nothing_of_the_ankle(leg, model, shape, simulated_reference):
    """What was known before stays, mean and deviation; effects by way of other joints are not used."""
    hip, own, every = angle_model(leg, ("B",)), [*range(7), 9], simulated_reference
    its = attrs.evolve(every, deviation=every.deviation[:, :1], columns=every.columns[:, :1, own])
    errors = errors_of(Encoders(names=("hip",), joints=("B",)), None)

    def by_hip(sigma_m):
        hidden = ClearanceRegression(hip, its, prior_with(errors, FRESH, sigma_m))
        for seed in range(30):
            crank, angles = read_cycle(model, shape, WORN, seed=seed)
            hidden.add(*binned(hip, crank, angles[:, :1]))
        return hidden.fused()

    expected = [ClearanceObservation.SEEN] * 3 + [ClearanceObservation.NOT_OBSERVABLE] * 2
    assert observations(by_hip(1e-3)) == expected
    found = by_hip(2e-5)
    np.testing.assert_allclose(found.clearance_m[3:], FRESH[3:], atol=1e-9)
    np.testing.assert_allclose(found.sigma_m[3:], 2e-5, rtol=1e-3)


def test_a_worn_joint_is_named_and_a_sound_leg_is_left_alone(model, shape, simulated_reference):
    new = watched(
        model, shape, simulated_reference, prior_with(UNKNOWN, FRESH, 5e-6), FRESH, noise=1e-4
    ).fused()
    before = prior_with(commissioned_errors(UNKNOWN, new), FRESH, 1e-4)
    for k in range(5):
        worn = [4.5e-4 if j == k else 3e-4 for j in range(5)]
        assert others(watched(model, shape, simulated_reference, before, worn, noise=1e-4).fused()) == [k]
    assert others(watched(model, shape, simulated_reference, before, FRESH, noise=1e-4).fused()) == []


def test_fusion_weighs_by_covariance(model, shape, simulated_reference):
    """A sure prediction moves little, an unsure one takes over what is seen."""
    sure = watched(
        model, shape, simulated_reference, prior_with(UNKNOWN, FRESH, 1e-7), WORN, scatter=0.2
    ).fused()
    unsure = watched(
        model, shape, simulated_reference, prior_with(UNKNOWN, FRESH, 1e-3), WORN, scatter=0.2
    ).fused()
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
    random, pairs = np.random.default_rng(1), [[names.index(b) for b in leg.sides(j)] for j in JOINTS]
    for cycle in range(20):
        turned = []
        for sample in range(200):
            run.advance(1.0 + cycle + (sample + 1) / 200.0, statistics)
            turned.append(run.q[:, 2].copy())
        angle = np.array(turned)
        seen = np.stack([angle[:, j] - angle[:, b] for b, j in pairs], axis=1)
        hidden.add(*binned(model, angle[:, 1], seen + 1e-4 * random.standard_normal(seen.shape)))
    found = hidden.fused()
    assert others(found) == [setup.clearance_joints.index("G")]
    np.testing.assert_allclose(found.clearance_m, [3e-4, 3e-4, 4.5e-4, 3e-4, 3e-4], atol=5e-5)


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

"""Further encoders in the monitor: commissioned, held, watched; the stream may be cut anywhere."""

import math
import sqlite3
from contextlib import closing

import attrs
import numpy as np
import pytest
from reported import status_of

from leg_wear_monitor import WearMonitor
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.monitor.config.parameters import config_from
from leg_wear_monitor.monitor.encoders import errors_of
from leg_wear_monitor.monitor.ledger.entry import Commissioned
from leg_wear_monitor.monitor.ledger.file import read as read_records
from leg_wear_monitor.monitor.reports import ClearanceObservation
from leg_wear_monitor.state import Level
from leg_wear_monitor.twin.references import PHASES, AngleReferenceRun, angle_model
from leg_wear_monitor.twin.sample import EMPTY

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
def test_an_encoder_that_says_nothing_is_reported_and_the_others_go_on(new_watch, read, value, words):
    monitor = new_watch()
    samples = read(3.5)
    samples["encoder_rad"][:, 1] = value
    monitor.update(samples)
    assert status_of(monitor, "encoders").level is Level.WARN
    assert status_of(monitor, "encoders").message.startswith(f"knee {words}")
    assert monitor._leg.encoders.state.present == (True, False, True)
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

"""A measured clearance beside the counted one: status, alarm and verdict, in a run and the next."""

from contextlib import closing
from pathlib import Path

import attrs
import numpy as np
import pytest
from reported import status_of

from leg_wear_monitor import open_ledger
from leg_wear_monitor.dashboard.ledger_leg import LedgerLeg
from leg_wear_monitor.estimate.cause import Cause, Change
from leg_wear_monitor.estimate.signature import CommissionedTorque
from leg_wear_monitor.monitor.config.settings import Limits
from leg_wear_monitor.monitor.diagnosis import reasons
from leg_wear_monitor.monitor.diagnosis.observer import TorqueObserver
from leg_wear_monitor.monitor.diagnosis.state import Diagnosis, DiagnosisState, SignedCycle
from leg_wear_monitor.monitor.forecast.forecast import Answer
from leg_wear_monitor.monitor.ledger.entry import Measurement
from leg_wear_monitor.monitor.operators import limit_in
from leg_wear_monitor.state import Figure, Level

START_NS = 1_700_000_000_123_456_789
MEASURED = {"diagnosis.enabled": False, "limits.clearance_m": 6.0e-4}


def test_a_measured_clearance_stands_beside_the_counted_one_and_raises_its_alarm(begin, gait) -> None:
    monitor = begin(MEASURED)
    monitor.update(gait(2.5))
    assert status_of(monitor, "joint G").level is Level.OK
    counted_m = status_of(monitor, "joint G").values["clearance_m"]
    found = monitor.measure("G", 5.8e-4, 5e-6, START_NS, "ann", accept=True)
    assert found.measurement.counts
    status = status_of(monitor, "joint G")
    assert (status.level, status.fault_code) == (Level.WARN, "CLEARANCE_G")
    assert "0.58 mm ± 0.005 mm was measured, 0.3 mm is counted" in status.message
    assert status.values["clearance_m"] == counted_m
    assert status.values["measured_clearance_m"] == 5.8e-4
    assert status_of(monitor, "joint A").level is Level.OK
    monitor.measure("G", 6.1e-4, 5e-6, START_NS, "ann", accept=True)
    assert status_of(monitor, "joint G").level is Level.ERROR
    verdict = monitor.verdict.verdict
    assert (verdict.state.value, verdict.fault_code) == ("stop", "CLEARANCE_G")
    assert verdict.why.startswith("the ")
    assert "0.61 mm ± 0.005 mm was measured, 0.3 mm is counted" in verdict.why
    evidence = {each.name: each.value for each in verdict.evidence}
    assert evidence["measured clearance G"] == 6.1e-4
    assert evidence["counted clearance G"] == pytest.approx(counted_m, rel=1e-3)


def test_a_healthy_leg_s_own_limit_is_in_its_ledger(begin, gait) -> None:
    """So that an operator's verb and a page without its parameters do not judge by the default one."""
    monitor = begin(MEASURED | {"limits.joint_clearance_m": [6.0e-4, 4.5e-4]})
    monitor.update(gait(2.5))
    monitor.close()
    with closing(open_ledger(monitor.mechanism, monitor.config)) as kept:
        assert not kept.alarm_history
        assert [limit_in(kept, joint) for joint in "AG"] == [6.0e-4, 4.5e-4]
    leg = LedgerLeg(Path(kept.path), attrs.evolve(monitor.config, limits=Limits()), monitor.mechanism, float)
    assert "limit 0.45 mm" in leg.content().regions["joints"]


def test_what_contradicts_the_model_raises_the_alarm_too_and_a_new_part_ends_it(begin, gait) -> None:
    monitor = begin(MEASURED)
    monitor.update(gait(2.5))
    found = monitor.measure("G", 1.2e-3, 5e-6, START_NS, "ann")
    assert found.contradicts and not found.measurement.counts
    assert status_of(monitor, "joint G").level is Level.ERROR
    assert "contradicts the model, not in the forecast" in status_of(monitor, "joint G").message
    assert monitor.verdict.verdict.why.startswith("the measured clearance of joint G (knee) is 1.2 mm")
    assert monitor.verdict.verdict.not_valid == (Figure.FORECAST,)  # no 4000 h beside a stop
    assert set(monitor.state.life.values()) == {None}
    assert set(monitor.state.life_answers.values()) == {Answer.OUTSIDE_VALIDITY.value}
    monitor.reset_wear("G", START_NS + 1, "ann")
    monitor.update(gait(3.0, begin_s=2.5))
    assert "measured" not in status_of(monitor, "joint G").message
    status = status_of(monitor, "joint G")  # nobody has to acknowledge what was of the old part
    assert (status.level, status.fault_code) == (Level.WARN, "PART_REPLACED_G")
    assert not any(alarm.level for alarm in monitor.alarms.alarms if alarm.subject == "G")


def test_what_was_measured_between_two_runs_is_judged_with_the_first_samples(begin, gait) -> None:
    first = begin(MEASURED)
    first.update(gait(2.5))
    first.close()
    config = first.config
    kept = open_ledger(first.mechanism, config)
    (part,) = (one for one in kept.entry.joints if one.name == "G")
    wear_m = float(part.depth.sum(axis=0).mean())
    kept.note(Measurement(START_NS, "G", "ann", 7e-4, 5e-6, wear_m, part.cycles, 0, 0.9, True))
    kept.record()
    kept.close()
    again = begin(MEASURED)
    assert "was measured" in status_of(again, "joint G").message
    reports = again.update(gait(1.0, begin_s=2.5))
    raised = [alarm.name for alarms in reports.alarms for alarm in alarms.alarms if alarm.level]
    assert "clearance G" in raised
    assert status_of(again, "joint G").level is Level.ERROR
    again.close()
    kept = open_ledger(first.mechanism, config)
    kept.withdraw(1, START_NS, "ann")
    kept.record()
    kept.close()
    third = begin(MEASURED)
    third.update(gait(3.0, begin_s=3.5))
    third.acknowledge(START_NS)
    assert status_of(third, "joint G").level is Level.OK


def opened(since_s: float) -> Change:
    """What the drive torque shows of joint G since some time."""
    since_ns = START_NS + round(1e9 * since_s)
    known = {"value": 4.8e-4, "sigma": 3.8e-5, "counted": 3.0e-4, "log_odds": 50.0}
    return Change(cause=Cause.CLEARANCE, subject="G", since_ns=since_ns, **known)


@pytest.mark.parametrize(
    ("measured_m", "measured_s", "since_s", "is_corrected"),
    [
        (3.1e-4, 3.0, 2.0, False),  # 0.17 mm apart, three standard deviations are 0.13 mm
        (4.4e-4, 3.0, 2.0, True),
        (3.1e-4, 3.0, 3.5, True),  # the joint opened after it was measured
        (3.1e-4, 0.0, 1.0, False),  # measured between two runs, of the leg as it walks in this one
        (3.1e-4, 0.0, 2.0, False),  # one gait cycle does not show the leg before the change
        (3.1e-4, 0.0, 4.0, True),  # as measured in the first gait cycles of this run
    ],
)
def test_what_contradicts_a_measurement_of_the_changed_leg_is_not_corrected(
    monitor, gait, monkeypatch, measured_m, measured_s, since_s, is_corrected
) -> None:
    if measured_s:
        monitor.update(gait(measured_s))
    shows(monitor, monkeypatch, since_s)
    contradicted = set()
    monkeypatch.setattr(TorqueObserver, "contradicted", lambda _, *of: contradicted.add(of[1:]))
    monitor.measure("G", measured_m, 2.0e-5, START_NS + round(1e9 * measured_s), "ann")
    monitor.update(gait(1.5, begin_s=measured_s))
    assert contradicted == (set() if is_corrected else {(measured_m, 2.0e-5)})
    assert monitor.state.clearances["G"].counted_m == pytest.approx(
        4.8e-4 if is_corrected else 3.0e-4, rel=1e-3
    )


def shows(monitor, monkeypatch, since_s: float) -> None:
    """The drive torque shows joint G open since some time, in gait cycles from 1, 2, 3 s on."""
    torque, change = monitor._parts.torque, opened(since_s)
    begins_ns = [START_NS + second * 10**9 for second in (1, 2, 3)]
    torque.state.cycles = tuple(SignedCycle(at, at + 10**9, np.zeros(1), None) for at in begins_ns)
    monkeypatch.setattr(torque, "end_period", lambda *_: change)
    monkeypatch.setattr(torque, "corrected", lambda *_: None)


@pytest.mark.parametrize(("walked", "is_corrected"), [(1, False), (100_000, False), (100_001, True)])
def test_a_restart_does_not_forget_a_contradiction_but_honest_wear_since_is_corrected(
    begin, gait, monkeypatch, walked, is_corrected
) -> None:
    """Measured some gait cycles of the part before this run began."""
    first = begin({})
    first.update(gait(2.5))
    first.measure("G", 3.1e-4, 2.0e-5, START_NS + 2 * 10**9, "ann")
    first.close()
    again = begin({})
    again._parts.accounting._before["cycles"] += walked
    again._parts.accounting.state.cycles += walked
    shows(again, monkeypatch, 1.0)
    again.update(gait(1.5, begin_s=2.5))
    assert again.state.clearances["G"].counted_m == pytest.approx(
        4.8e-4 if is_corrected else 3.0e-4, rel=1e-3
    )


@pytest.mark.parametrize(("measured_s", "is_asked"), [(3.0, False), (1.0, True)])
def test_a_joint_that_was_measured_since_a_correction_is_not_asked_for(
    monitor, gait, monkeypatch, measured_s, is_asked
) -> None:
    """Seen before: the status asked for measurements, and went on asking when they were there."""
    monitor.update(gait(3.0))
    torque, counted_m = monitor._parts.torque, np.full(5, 3.0e-4)
    sigma_m = np.array([3e-4, 3e-4, 4e-5, 3e-4, 3e-4])
    known = CommissionedTorque(START_NS + 2 * 10**9, counted_m, np.zeros((1, 4)), sigma_m)
    torque.state.baselines = (known,)
    monkeypatch.setattr(torque, "end_period", lambda *_: None)

    def asked() -> str:
        return reasons._hidden(torque.state, known, monitor._parts.clearance_joints).partition(" may")[0]

    monitor.measure("A", 3.1e-4, 2.0e-5, START_NS + round(1e9 * measured_s), "ann")
    monitor.update(gait(1.5, begin_s=3.0))
    assert asked() == ("A, B, I, J" if is_asked else "B, I, J")


def test_a_measurement_and_a_torque_that_disagree_are_reported_with_what_to_do(
    monitor, gait, monkeypatch
) -> None:
    shown = Diagnosis(state=DiagnosisState.CHANGED, changes=(opened(2.0),))
    monkeypatch.setattr(TorqueObserver, "diagnosis", shown)
    monitor.update(gait(3.0))
    words = "joint G disagree, so its counted clearance is not corrected: measure it again"
    for clearance_m, is_reported in ((3.1e-4, True), (4.7e-4, False)):
        monitor.measure("G", clearance_m, 2.0e-5, START_NS + 3 * 10**9, "ann")
        for text in (status_of(monitor, "diagnosis").message, monitor.verdict.verdict.why):
            assert (words in text) == is_reported
    monitor.measure("G", 3.1e-4, 2.0e-5, START_NS + 3 * 10**9, "ann")
    both = "the drive torque (0.48 mm ± 0.038 mm) and a measurement (0.31 mm ± 0.02 mm) of joint G disagree"
    assert both in monitor.verdict.verdict.why
    assert monitor.verdict.verdict.why.count("0.31 mm") == 1

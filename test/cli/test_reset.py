"""`reset`: a replaced part into a ledger, as the service of a node does it."""

import attrs
import numpy as np
import pytest
from ledger_contents import rows_of

from leg_wear_monitor.mechanism.loader import load_mechanism
from leg_wear_monitor.monitor.alarms import Alarm
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.ledger.ledger import open_ledger
from leg_wear_monitor.state import Level

LEG = load_mechanism("bionic_leg")


def opened(path):
    config = MonitorConfig()
    config = attrs.evolve(config, ledger=attrs.evolve(config.ledger, path=str(path)))
    return config, open_ledger(LEG, config)


@pytest.fixture
def ledger(worn_ledger):
    """A ledger of a worn leg; G is at its limit, say its alarms."""
    raised = {"level": Level.ERROR, "raised_ns": 5, "worst": 1.7e-3, "limit": 6e-4}
    alarms = (
        Alarm(kind="clearance", subject="G", present=Level.ERROR, cause="torque", sigma=4e-4, **raised),
        Alarm(kind="impact_force", subject="G", **raised),
        Alarm(kind="clearance", subject="A", **raised),
    )
    return worn_ledger(alarms=alarms)


def content(path):
    _, kept = opened(path)
    entry, spans = kept.entry, kept.counted_ns.tolist()
    kept.close()
    return entry, spans


def last_verdict(path):
    _, kept = opened(path)
    verdict = kept.verdict
    kept.close()
    return verdict


def history(path):
    alarm = "alarm ->> 'kind', alarm ->> 'subject', alarm ->> 'level'"
    return rows_of(path, f"SELECT {alarm} FROM alarm_history ORDER BY id")


def audits(path):
    joint = "joint ->> 'name', joint ->> 'cycles', joint ->> 'moving_s'"
    return rows_of(path, f"SELECT what, {joint} FROM audit")


def test_a_reset_gives_new_surfaces_and_keeps_the_history(run, ledger):
    before, spans = content(ledger)
    result = run("reset", "G", "--ledger", str(ledger))
    assert (result.exit_code, result.stderr) == (0, "")
    reply = "joint G: new surfaces, 60 um of wear from 4000 gait cycles are set to 0, history kept"
    assert result.stdout.splitlines() == [
        f"{reply}; --undo reverts it",
        "alarms cleared: impact_force G, clearance G; still present: clearance A",
        "let the leg walk: the next gait cycles confirm the repair",
    ]
    after, now = content(ledger)
    assert now == spans
    joints = {each.name: each for each in after.joints}
    assert not joints["G"].depth.any()
    assert (joints["G"].cycles, joints["G"].moving_s) == (0, 0.0)
    assert joints["G"].replaced_ns > 10**18
    assert all(np.array_equal(joints[one.name].depth, one.depth) for one in before.joints if one.name != "G")
    assert {name: after.totals[name] for name in before.totals} == before.totals
    alarms = {alarm.name: alarm for alarm in after.alarms}
    assert set(alarms) == {"clearance A"}
    assert not alarms["clearance A"].acknowledged
    assert audits(ledger) == [("reset_wear", "G", 4000, 4000.0)]


def test_an_undone_reset_is_as_before(run, ledger):
    before, spans = content(ledger)
    run("reset", "G", "--ledger", str(ledger))
    result = run("reset", "G", "--undo", "--ledger", str(ledger))
    assert "the wear is again 60 um of wear from 4000 gait cycles, including the wear since" in result.stdout
    after, now = content(ledger)
    assert now == spans
    for one, other in zip(before.joints, after.joints, strict=True):
        assert np.array_equal(one.depth, other.depth)
        assert attrs.astuple(one)[2:] == attrs.astuple(other)[2:]
    again = run("reset", "G", "--undo", "--ledger", str(ledger))
    assert (again.exit_code, again.stderr) == (2, "error: joint G: the ledger has no reset to undo\n")
    assert audits(ledger)[1] == ("undo_reset", "G", 0, 0.0)


def test_what_a_reset_has_cleared_is_raised_again_once_it_is_undone(run, ledger):
    before, stopped, rises = content(ledger)[0], last_verdict(ledger), history(ledger)
    run("reset", "G", "--ledger", str(ledger))
    assert history(ledger)[len(rises) :] == [("impact_force", "G", 0), ("clearance", "G", 0)]
    assert "G" not in last_verdict(ledger).joints
    run("reset", "G", "--undo", "--ledger", str(ledger))
    alarms = (
        sorted(each, key=lambda alarm: alarm.name) for each in (before.alarms, content(ledger)[0].alarms)
    )
    for one, other in zip(*alarms, strict=True):
        assert not other.acknowledged
        for name in ("name", "level", "worst", "limit", "raised_ns", "cause"):
            assert getattr(one, name) == getattr(other, name)
        assert str(one.sigma) == str(other.sigma)
    now = last_verdict(ledger)
    assert (now.state, now.fault_code, now.joints) == (stopped.state, stopped.fault_code, stopped.joints)


@pytest.mark.parametrize(
    ("arguments", "fault"),
    [
        (("g",), "'g' is not a clearance joint. Expected one of A, B, G, I, J; did you mean G?"),
        (("A", "--undo"), "joint A: the ledger has no reset to undo"),
        ((), "Missing argument 'JOINT'"),
    ],
)
def test_what_cannot_be_reset_is_one_line(refused, ledger, arguments, fault):
    assert fault in refused("reset", *arguments, "--ledger", str(ledger))
    assert audits(ledger) == []


def test_a_ledger_without_wear_has_nothing_to_reset(run, tmp_path):
    path = tmp_path / "new.ledger"
    opened(path)[1].abandon()
    result = run("reset", "G", "--ledger", str(path))
    assert (result.exit_code, result.stderr) == (2, "error: the ledger contains no wear yet\n")


def test_a_stop_that_a_measurement_has_ended_stays_ended_once_a_reset_is_undone(run, worn_ledger):
    stop = {"level": Level.ERROR, "worst": 1.7e-3, "limit": 6e-4, "raised_ns": 5, "cause": "torque"}
    raised = Alarm(kind="clearance", subject="G", present=Level.ERROR, sigma=4e-4, **stop)
    path = worn_ledger(alarms=(raised,))
    run("measure", "G", "0.37", "--sigma", "0.01", "--ledger", str(path))
    (before,) = content(path)[0].alarms
    run("reset", "G", "--ledger", str(path))
    run("reset", "G", "--undo", "--ledger", str(path))
    (after,) = content(path)[0].alarms
    assert before.acknowledged and after.acknowledged
    assert (after.worst, after.sigma, after.cause) == (1.7e-3, 4e-4, "torque")
    assert last_verdict(path).state.value != "stop"

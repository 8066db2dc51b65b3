"""`measure` and `reset`: what an operator tells a ledger, and the reply."""

import json
from collections.abc import Callable
from pathlib import Path

import attrs
import numpy as np
import pytest
from ledger_contents import rows_of

from leg_wear_monitor import load_mechanism, open_ledger
from leg_wear_monitor.monitor.alarm_specs import KINDS
from leg_wear_monitor.monitor.alarms import Alarm
from leg_wear_monitor.monitor.config.parameters import load_config
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.forecast.forecaster import with_codes
from leg_wear_monitor.monitor.ledger.entry import AlarmEvent, Entry, JointWear
from leg_wear_monitor.monitor.monitored_leg import MonitoredLeg
from leg_wear_monitor.monitor.operator_actions import note_verdict
from leg_wear_monitor.state import Level


@pytest.fixture
def worn_ledger(tmp_path: Path) -> Callable[..., Path]:
    """Write a ledger of the default leg whose joints have opened by 60 µm in 4000 of 5000 gait cycles."""

    def write(config: MonitorConfig | None = None, alarms: tuple[Alarm, ...] = ()) -> Path:
        """The alarms were raised at their worst values; the verdict is that of them."""
        alarms = tuple(attrs.evolve(alarm, unit=KINDS[alarm.kind].unit) for alarm in alarms)
        config, path, leg = config or MonitorConfig(), tmp_path / "wear.ledger", load_mechanism("bionic_leg")
        config = attrs.evolve(config, ledger=attrs.evolve(config.ledger, path=str(path)))
        kept = open_ledger(leg, config)
        worn = np.full((2, 720), 3.0e-5)
        nominal = {name: sum(leg.clearances[name].wear_coefficient) for name in leg.clearance_joints}
        joints = tuple(JointWear(name, worn, 4000, 4000.0, 0, k) for name, k in nominal.items())
        totals = {"cycles": 5e3, "moving_s": 5e3}
        entry = Entry(stamp_ns=10**9, joints=joints, totals=totals, alarms=alarms, spans=((0, 10**9, 0),))
        for alarm in alarms:
            kept.note(AlarmEvent(alarm.raised_ns, attrs.evolve(alarm, value=alarm.worst)))
        kept.keep(entry, closed=True)
        kept.close()
        kept = open_ledger(leg, config)
        note_verdict(MonitoredLeg(leg, config, kept), 10**9)
        kept.keep(entry, closed=True)
        kept.close()
        return path

    return write


@pytest.fixture
def ledger(worn_ledger):
    return worn_ledger()


def rows(path):
    return rows_of(path, "SELECT joint, clearance_m, wear_m, cycles, counts FROM measurement")


def test_a_measurement_is_kept_and_explained(run, ledger):
    result = run("measure", "A", "0.42", "--sigma", "0.005", "--ledger", str(ledger))
    assert (result.code, result.err) == (0, "")
    first, second, third = result.out.splitlines()
    assert first == "A: 0.42 mm ± 0.005 mm, 4000 gait cycles after the part was new"
    assert "0.36 mm" in second and "0.6 mm" in second
    assert third.startswith("the wear coefficient is 1.79")
    assert rows(ledger) == [("A", pytest.approx(4.2e-4), pytest.approx(6e-5), 4000, 1)]


def test_a_different_wear_coefficient_is_reported_and_needs_the_parameter_file(
    run, refused, ledger, tmp_path
):
    config = tmp_path / "monitor.yaml"
    config.write_text("/**:\n  ros__parameters:\n    wear_coefficients_per_pa: [2.0e-15]\n")
    given = ("measure", "A", "0.42", "--sigma", "0.005", "--ledger", str(ledger))
    assert run(*given).err == ""
    (line,) = run(*given, "--config", str(config)).err.splitlines()
    assert line.startswith(
        f"warning: {config}: wear coefficient of joints A, B, G, I, J: 4e-15 1/Pa (bushing and journal "
        "together), but the wear in the ledger was modelled with 2e-15 1/Pa; that wear stays as modelled"
    )
    assert "name the parameter file of this leg" in refused(*given)


def test_a_contradiction_ends_with_findings_and_leaves_wear_as_it_is(run, ledger):
    result = run("measure", "G", "3.0", "--sigma", "0.005", "--ledger", str(ledger))
    assert result.code == 1
    assert "contradicts the model" in result.out
    assert "the measured clearance is at its limit: stop the leg when it is safe" in result.out
    assert [row[-1] for row in rows(ledger)] == [0]
    assert run("measure", "G", "3.0", "--sigma", "0.005", "--ledger", str(ledger), "--accept").code == 1
    assert [row[-1] for row in rows(ledger)] == [0, 1]


@pytest.mark.parametrize(
    ("arguments", "fault"),
    [
        (("Z", "0.4", "--sigma", "0.01"), "'Z' is not a clearance joint. Expected one of A, B, G, I, J"),
        (("A", "-1", "--sigma", "0.01"), "No such option"),
        (("A", "0.4", "--sigma", "0"), "0.0 is not in the range x>0.0"),
        (("A", "0,4", "--sigma", "0.01"), "'0,4' is not a valid float range"),
        (("A", "0.00042", "--sigma", "0.005"), "mm is not between 0.003 mm, 1 % of the new clearance"),
        (("A", "420", "--sigma", "0.005"), "and 10 mm, the radius of its bushing; did you mean 0.42 mm?"),
        (("A", "10.1", "--sigma", "0.01"), "10.1 mm is not between"),
        (("A", "0.42", "--sigma", "5e-6"), "5e-06 mm is not a standard deviation from 0.0001 mm to 0.42 mm"),
        (("A", "0.42", "--sigma", "10"), "the measured clearance; did you mean 0.01 mm?"),
        (("A", "--withdraw"), "no measurement of joint A can be withdrawn"),
        (("A", "0.4", "--withdraw"), "cannot be combined with MM, --sigma or --accept"),
        (("A", "--withdraw", "--accept"), "cannot be combined with MM, --sigma or --accept"),
        (("A", "0.4"), "MM needs --sigma. Expected JOINT MM --sigma MM, or JOINT --withdraw"),
        ((), "Missing argument 'JOINT'"),
        (("A", "0.4", "--sigma", "0.01", "--node", "/leg_wear_monitor"), "--node cannot be combined with"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(refused, ledger, arguments, fault):
    assert fault in refused("measure", *arguments, "--ledger", str(ledger))
    assert rows(ledger) == []


def alarms(path):
    now = rows_of(path, "SELECT subject, level, acknowledged, worst, cause FROM alarm")
    return now, rows_of(path, "SELECT alarm ->> 'subject', alarm ->> 'level' FROM alarm_history")


def verdict(path):
    ((*row, evidence),) = rows_of(
        path,
        "SELECT verdict ->> 'state', verdict ->> 'fault_code', verdict -> 'evidence' FROM verdict "
        "ORDER BY id DESC LIMIT 1",
    )
    return *row, json.loads(evidence)


@pytest.mark.parametrize(
    ("mm", "level", "state", "code"),
    [("0.7", 2, "stop", "CLEARANCE_G"), ("0.5", 1, "watch", "CLEARANCE_NEAR_G")],
)
def test_a_measurement_at_the_limit_or_near_it_raises_alarm_and_verdict(run, ledger, mm, level, state, code):
    """At the limit, the caller has to act."""
    assert run("measure", "G", mm, "--sigma", "0.02", "--ledger", str(ledger)).code == (state == "stop")
    value = pytest.approx(1e-3 * float(mm))
    assert alarms(ledger) == ([("G", level, 0, value, "measured")], [("G", level)])
    now = verdict(ledger)
    assert (now[0], code in {now[1], "CLEARANCE_NEAR_G"}) == (state, True)
    # the alarm has the unit of the measurement beside it
    own = {each["name"]: (each["value"], each["unit"]) for each in now[2]}
    assert own["clearance G"] == own["measured clearance G"] == (value, "m")


def test_a_harmless_measurement_leaves_alarms_and_verdict_as_they_are(run, ledger):
    before = verdict(ledger)
    run("measure", "G", "0.4", "--sigma", "0.02", "--ledger", str(ledger))
    assert (alarms(ledger), verdict(ledger)) == (([], []), before)


@pytest.mark.parametrize("present", [Level.OK, Level.ERROR])
def test_a_withdrawn_measurement_does_not_end_a_stop(run, worn_ledger, present):
    stop = {"level": Level.ERROR, "worst": 1.7e-3, "limit": 6e-4, "raised_ns": 5, "cause": "torque"}
    path = worn_ledger(alarms=(Alarm(kind="clearance", subject="G", present=present, sigma=4e-4, **stop),))
    before = verdict(path)[:2]
    assert before == ("stop", "CLEARANCE_DETECTED_G")
    for mm in ("0.36", "0.37"):
        run("measure", "knee", mm, "--sigma", "0.01", "--ledger", str(path))
        assert verdict(path)[0] != "stop"
    run("measure", "G", "--withdraw", "--ledger", str(path))
    assert verdict(path)[0] != "stop"  # the other one says so, too
    run("measure", "G", "--withdraw", "--ledger", str(path))
    assert verdict(path)[:2] == before
    assert alarms(path)[0] == [("G", 2, 0, 1.7e-3, "torque")]


def test_a_stop_by_a_limit_of_the_leg_is_not_judged_by_another_one(run, refused, worn_ledger, tmp_path):
    (tmp_path / "mine.yaml").write_text("/**: {ros__parameters: {limits.clearance_m: 0.00045}}")
    stop = {"level": Level.ERROR, "worst": 5.2e-4, "limit": 4.5e-4, "raised_ns": 5, "cause": "torque"}
    path = worn_ledger(
        alarms=(Alarm(kind="clearance", subject="G", present=Level.ERROR, sigma=1e-5, **stop),)
    )
    arguments = ("measure", "G", "0.5", "--sigma", "0.01", "--ledger", str(path))
    fault = "limit of joint G: 0.45 mm in the ledger and 0.6 mm in the parameters; name the parameter file"
    assert fault in refused(*arguments)
    assert (rows(path), verdict(path)[0]) == ([], "stop")
    assert "at its limit" in run(*arguments, "--config", "mine.yaml").out
    assert verdict(path)[0] == "stop"
    assert fault in refused("measure", "G", "--withdraw", "--ledger", str(path))
    assert run("measure", "G", "--withdraw", "--ledger", str(path), "--config", "mine.yaml").code == 0
    for verb in (("acknowledge",), ("reset", "A"), ("reset", "A", "--undo")):
        assert fault in refused(*verb, "--ledger", str(path))
    assert verdict(path)[0] == "stop"


def test_an_alarm_by_a_measurement_that_was_wrong_clears_once_it_is_withdrawn_and_acknowledged(run, ledger):
    kept = ("--ledger", str(ledger))
    run("measure", "G", "0.7", "--sigma", "0.02", *kept)
    run("measure", "G", "--withdraw", *kept)
    assert verdict(ledger)[0] == "stop"  # until somebody has seen to it
    assert run("acknowledge", *kept).out == "cleared: clearance G; still present: none\n"
    assert verdict(ledger)[0] != "stop"


def test_a_withdrawn_measurement_is_kept_and_teaches_nothing(run, ledger):
    kept = ("--ledger", str(ledger))
    first = run("measure", "A", "0.42", "--sigma", "0.005", *kept)
    run("measure", "B", "0.31", "--sigma", "0.005", *kept)
    shown = run("measure", "A", "--withdraw", *kept)
    assert (shown.code, shown.err) == (0, "")
    assert shown.out.startswith("A: 0.42 mm ± 0.005 mm, entered 20")
    assert shown.out.endswith(", is withdrawn\n")
    assert len(rows(ledger)) == 2
    # the next one is judged as the first was
    again = run("measure", "A", "0.42", "--sigma", "0.005", *kept)
    assert again.out.splitlines()[:3] == first.out.splitlines()[:3]
    assert run("measure", "A", "--withdraw", *kept).code == 0


def test_a_ledger_has_to_be_named(refused):
    assert "no ledger is given" in refused("measure", "A", "0.4", "--sigma", "0.01")


def test_of_a_file_for_two_legs_a_section_is_chosen_by_its_node(run, refused, worn_ledger, tmp_path):
    ledgers = {"left": tmp_path / "left.ledger", "right": worn_ledger(MonitorConfig(hardware_id="right"))}
    sections = [
        f"/{side}/leg_wear_monitor: {{ros__parameters: {{ledger.path: {path}}}}}\n"
        for side, path in ledgers.items()
    ]
    (tmp_path / "two.yaml").write_text("".join(sections), encoding="utf-8")
    verbs = ("measure", "A", "0.42", "--sigma", "0.005"), ("acknowledge",), ("reset", "A")
    for verb in verbs:
        told = refused(*verb, "--config", "two.yaml")
        assert "for: /left/leg_wear_monitor, /right/leg_wear_monitor; choose one with --node" in told
    chosen = ("--config", "two.yaml", "--node", "/right/leg_wear_monitor")
    assert [run(*verb, *chosen).code for verb in verbs] == [0, 0, 0]
    assert [row[0] for row in rows(ledgers["right"])] == ["A"]
    assert run("measure", "A", "--withdraw", *chosen).out.startswith("A: 0.42 mm")
    assert not ledgers["left"].exists()


def test_a_leg_that_carries_a_person_is_the_one_of_its_ledger(run, worn_ledger, tmp_path):
    config = tmp_path / "carries.yaml"
    config.write_text("/**: {ros__parameters: {load.person_kg: 80.0}}\n", encoding="utf-8")
    ledger = worn_ledger(load_config(config))
    result = run("measure", "A", "0.42", "--sigma", "0.005", "--ledger", str(ledger), "--config", str(config))
    assert (result.code, result.err) == (0, "")
    assert rows(ledger)[0][0] == "A"


def test_what_does_not_count_does_not_end_a_stop_by_a_measurement_that_counts(run, ledger):
    kept = ("--sigma", "0.006", "--ledger", str(ledger))
    run("measure", "A", "0.63", *kept, "--accept")
    second = run("measure", "A", "0.31", *kept)
    assert "but not used" in second.out and "raised" not in second.out
    ((joint, level, is_acknowledged, *_),) = alarms(ledger)[0]
    assert (joint, level, is_acknowledged) == ("A", 2, 0)
    assert verdict(ledger)[:2] == ("stop", "CLEARANCE_A")


def test_a_measurement_that_ends_the_stop_of_an_earlier_one_says_so(run, ledger):
    kept = ("--sigma", "0.006", "--ledger", str(ledger))
    run("measure", "A", "3.0", *kept)
    second = run("measure", "A", "0.36", *kept)
    assert "the alarm clearance A that an earlier measurement raised ends" in second.out
    assert alarms(ledger)[0] == []


@pytest.mark.parametrize(
    ("codes", "code"), [((), 0), (("AT_LIMIT",), 1), (("CONTRADICTS_MODEL", "NOT_STORED"), 1)]
)
def test_the_codes_of_a_node_are_findings(run, monkeypatch, codes, code):
    client = pytest.importorskip("leg_wear_monitor.ros.measure")
    reply = with_codes(codes, "A: 0.42 mm, in whatever words")
    monkeypatch.setattr(client, "measure_on", lambda *_: reply)
    result = run("measure", "A", "0.42", "--sigma", "0.005", "--node", "/leg")
    assert (result.code, result.out) == (code, f"{reply}\n")


# --- reset ---


def opened(path):
    config = MonitorConfig()
    config = attrs.evolve(config, ledger=attrs.evolve(config.ledger, path=str(path)))
    return config, open_ledger(load_mechanism("bionic_leg"), config)


@pytest.fixture
def stopped_ledger(worn_ledger):
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


def test_a_reset_gives_new_surfaces_and_keeps_the_history(run, stopped_ledger):
    before, spans = content(stopped_ledger)
    result = run("reset", "G", "--ledger", str(stopped_ledger))
    assert (result.code, result.err) == (0, "")
    reply = "joint G: new surfaces, 60 µm of wear from 4000 gait cycles are set to 0, history kept"
    assert result.out.splitlines() == [
        f"{reply}; --undo reverts this",
        "alarms cleared: impact_force G, clearance G; still present: clearance A",
        "let the leg walk: the next gait cycles confirm the repair",
    ]
    after, now = content(stopped_ledger)
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
    assert audits(stopped_ledger) == [("reset_wear", "G", 4000, 4000.0)]


def test_an_undone_reset_is_as_before(run, stopped_ledger):
    before, spans = content(stopped_ledger)
    run("reset", "G", "--ledger", str(stopped_ledger))
    result = run("reset", "G", "--undo", "--ledger", str(stopped_ledger))
    assert "the wear is again 60 µm of wear from 4000 gait cycles, including the wear since" in result.out
    after, now = content(stopped_ledger)
    assert now == spans
    for one, other in zip(before.joints, after.joints, strict=True):
        assert np.array_equal(one.depth, other.depth)
        assert attrs.astuple(one)[2:] == attrs.astuple(other)[2:]
    again = run("reset", "G", "--undo", "--ledger", str(stopped_ledger))
    assert (again.code, again.err) == (2, "error: joint G: the ledger has no reset to undo\n")
    assert audits(stopped_ledger)[1] == ("undo_reset", "G", 0, 0.0)


def test_what_a_reset_has_cleared_is_raised_again_once_it_is_undone(run, stopped_ledger):
    before, stopped, rises = content(stopped_ledger)[0], last_verdict(stopped_ledger), history(stopped_ledger)
    run("reset", "G", "--ledger", str(stopped_ledger))
    assert history(stopped_ledger)[len(rises) :] == [("impact_force", "G", 0), ("clearance", "G", 0)]
    assert "G" not in last_verdict(stopped_ledger).joints
    run("reset", "G", "--undo", "--ledger", str(stopped_ledger))
    after = content(stopped_ledger)[0]
    alarms = (sorted(each, key=lambda alarm: alarm.name) for each in (before.alarms, after.alarms))
    for one, other in zip(*alarms, strict=True):
        assert not other.acknowledged
        for name in ("name", "level", "worst", "limit", "raised_ns", "cause"):
            assert getattr(one, name) == getattr(other, name)
        assert str(one.sigma) == str(other.sigma)
    now = last_verdict(stopped_ledger)
    assert (now.state, now.fault_code, now.joints) == (stopped.state, stopped.fault_code, stopped.joints)


@pytest.mark.parametrize(
    ("arguments", "fault"),
    [
        (("g",), "'g' is not a clearance joint. Expected one of A, B, G, I, J; did you mean G?"),
        (("A", "--undo"), "joint A: the ledger has no reset to undo"),
        ((), "Missing argument 'JOINT'"),
    ],
)
def test_what_cannot_be_reset_is_one_line(refused, stopped_ledger, arguments, fault):
    assert fault in refused("reset", *arguments, "--ledger", str(stopped_ledger))
    assert audits(stopped_ledger) == []


def test_a_ledger_without_wear_has_nothing_to_reset(run, tmp_path):
    path = tmp_path / "new.ledger"
    opened(path)[1].abandon()
    result = run("reset", "G", "--ledger", str(path))
    assert (result.code, result.err) == (2, "error: the ledger contains no wear yet\n")


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

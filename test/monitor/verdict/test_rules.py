"""Rules of the verdict."""

import math
import re
from typing import Any

import attrs
import pytest
from hypothesis import given
from hypothesis import strategies as st

from leg_wear_monitor.estimate.cause import Cause, Change, NamedCause, TorqueExplanation
from leg_wear_monitor.monitor.alarms import (
    EXCHANGED,
    SCALE,
    SIGN,
    STUCK,
    ZERO,
    Alarm,
    guide_of,
    joint_of,
)
from leg_wear_monitor.monitor.config.parameters import config_from
from leg_wear_monitor.monitor.diagnosis.state import Diagnosis, DiagnosisState
from leg_wear_monitor.monitor.evaluation import specs_of
from leg_wear_monitor.monitor.input_health import INPUT_FAULTS, InputFault, kind_of
from leg_wear_monitor.monitor.verdict.rules import findings, sentence
from leg_wear_monitor.monitor.verdict.situation import JointSituation, KnownClearance, Situation
from leg_wear_monitor.monitor.verdict.verdict import (
    HOW_SURE,
    dated,
    decision_of,
    figures_of,
    guide_to,
    has_changed,
    rules,
    table,
    verdict_of,
)
from leg_wear_monitor.state import (
    Figure,
    FootLoad,
    JointClearance,
    LegState,
    Level,
    State,
    TorqueDiagnosis,
    Verdict,
)
from leg_wear_monitor.twin import CRANK, TORQUE

# The verdict as a pure function: a list of cases, and laws over all alarms.


JOINTS = ("A", "G")
NEW = tuple(JointSituation(joint=joint, modelled_m=3.0e-4, limit_m=6.0e-4) for joint in JOINTS)
HEALTHY = Situation(joints=NEW, mismatch=0.031, mismatch_limit=0.1)
CONFIG = {"encoders.names": ["knee"], "encoders.joints": ["G"], "foot_load.source": "wrench"}
ALARMS = {alarm.name: alarm for _, _, alarm in specs_of(config_from(CONFIG), JOINTS)}


def judged(**changed: Any) -> Verdict:
    return verdict_of(findings(attrs.evolve(HEALTHY, **changed)))


def alarm(name: str, level: Level = Level.ERROR, present: Level | None = None, **values: float) -> Alarm:
    one = ALARMS[name]
    values = {"value": 2.0, "limit": 1.0, "worst": 2.0, "raised_ns": 77} | values
    return attrs.evolve(one, level=level, present=level if present is None else present, **values)


def change(cause: Cause, subject: str = "", **values: Any) -> Change:
    values = {"value": 6.2e-4, "sigma": 3.0e-5, "counted": 3.0e-4, "since_ns": 55, "log_odds": 30.0} | values
    return Change(cause=cause, subject=subject, **values)


def diagnosis(*changes: Change) -> Diagnosis:
    return Diagnosis(state=DiagnosisState.CHANGED, changes=changes)


def raised(name: str, level: Level = Level.ERROR, present: Level | None = None) -> dict[str, Any]:
    """What is changed of a healthy leg by an alarm."""
    return {"alarms": (alarm(name, level, present),)}


def shown(cause: Cause, subject: str = "") -> dict[str, Any]:
    """What is changed of a healthy leg by a cause that the diagnosis finds."""
    return {"diagnosis": diagnosis(change(cause, subject))}


def explained(*causes: Cause, **values: Any) -> TorqueExplanation:
    """One explanation, with made-up values."""
    named = tuple(NamedCause(cause, -0.5, 0.01, "foot" if cause.name == "MASS" else "") for cause in causes)
    given = {"before": 2.0, "after": 0.03, "after_sigma": 0.01, "limit": 0.08, "speed_radps": 6.3} | values
    return TorqueExplanation(alternatives=(named,), **given)


def noted(code: str, text: str) -> dict[str, Any]:
    """What is changed of a healthy leg by what an observer reports."""
    return {"notes": {code: (text,)}}


def seen_as_new(by: str) -> tuple[JointSituation, ...]:
    return tuple(attrs.evolve(each, seen=(KnownClearance(by, 3.0e-4, 1.0e-5),)) for each in NEW)


def seen(by: str, clearance_m: float, sigma_m: float, **more: Any) -> tuple[JointSituation, ...]:
    return (NEW[0], attrs.evolve(NEW[1], seen=(KnownClearance(by, clearance_m, sigma_m),), **more))


def at_limit(**more: Any) -> tuple[JointSituation, ...]:
    return (NEW[0], attrs.evolve(NEW[1], modelled_m=6.1e-4, **more))


def faulty(code: str, since_ns: int = 55) -> dict[str, Any]:
    """What is changed of a healthy leg by a fault of the input."""
    fault = InputFault(code, since_ns, since_ns, dict.fromkeys(("size", "percent", "rate", "ratio"), "1"))
    return {"input_faults": (fault,), "trusted_before_ns": {kind_of(code): since_ns}}


OF_CRANK, OF_TORQUE = ([code for code in INPUT_FAULTS if kind_of(code) == kind] for kind in (CRANK, TORQUE))
ALL, OF_THE_WALK = tuple(Figure), (Figure.GROWTH, Figure.IMPACT_FORCES)
OF_THE_MODEL = (*OF_THE_WALK, Figure.FORECAST)
CASES = [
    ({}, State.HEALTHY, "NONE", ()),
    (raised("clearance G") | {"joints": at_limit()}, State.STOP, "CLEARANCE_G", ()),
    *(  # what stops the leg is not in the forecast
        (raised("clearance G") | {"joints": joints}, State.STOP, "CLEARANCE_G", (Figure.FORECAST,))
        for joints in (NEW, at_limit(is_measurement_used=True, best_estimate_m=5.0e-4))
    ),
    (raised("clearance G", Level.WARN), State.WATCH, "CLEARANCE_NEAR_G", ()),
    (raised("growth G", Level.WARN), State.WATCH, "ALARM_G", ()),
    (
        {"alarms": (alarm("clearance A"), alarm("clearance G"))},
        State.STOP,
        "CLEARANCE_A_G",
        (Figure.FORECAST,),
    ),
    ({"joints": seen("torque", 6.7e-4, 3.0e-5)}, State.STOP, "CLEARANCE_DETECTED_G", ALL),
    ({"joints": (attrs.evolve(NEW[0], replaced_ns=1, part_cycles=19),)}, State.WATCH, "PART_REPLACED_A", ()),
    ({"joints": (attrs.evolve(NEW[0], replaced_ns=1, part_cycles=20),)}, State.HEALTHY, "NONE", ()),
    ({"joints": seen("encoders", 6.2e-4, 3.0e-5)}, State.HEALTHY, "NONE", ()),  # not surely
    (
        {"joints": (NEW[0], attrs.evolve(NEW[1], best_estimate_m=6.1e-4))},
        State.STOP,
        "CLEARANCE_ESTIMATED_G",
        (),
    ),
    (shown(Cause.CLEARANCE, "G"), State.INSPECT, "CLEARANCE_CHANGED_G", ALL),
    (
        {"diagnosis": Diagnosis(changes=(change(Cause.CLEARANCE, "G", is_corrected=True),))},
        State.INSPECT,
        "CLEARANCE_CORRECTED_G",
        (),
    ),
    (shown(Cause.UNKNOWN), State.INSPECT, "MECHANISM_CHANGED", ALL),
    (shown(Cause.LENGTH, "foot"), State.INSPECT, "MECHANISM_CHANGED", ALL),
    (shown(Cause.MASS, "foot"), State.INSPECT, "TORQUE_MASS", ALL),
    (shown(Cause.SCALE), State.INSPECT, "TORQUE_SCALE", ()),
    (shown(Cause.LAG), State.INSPECT, "TORQUE_TIMING", ()),
    (shown(Cause.TIMING), State.INSPECT, "TORQUE_TIMING", ()),
    (shown(Cause.NOISE), State.WATCH, "TORQUE_NOISE", ()),
    (shown(Cause.LOAD), State.WATCH, "TORQUE_LOAD", (Figure.GROWTH, Figure.IMPACT_FORCES, Figure.FORECAST)),
    (shown(Cause.FRICTION), State.WATCH, "FRICTION_CHANGED", ()),
    (shown(Cause.JOINT_FRICTION), State.WATCH, "FRICTION_CHANGED", ()),
    ({"diagnosis": Diagnosis(state=DiagnosisState.AS_MODELLED)}, State.WATCH, "NOT_OBSERVED", ()),
    (raised("clearance_departure G", Level.WARN), State.WATCH, "ALARM_G", ()),
    (raised("clearance_departure G"), State.INSPECT, "CLEARANCE_DEPARTURE_G", ALL),
    (
        {"alarms": (alarm("clearance_departure G"),), "joints": seen("encoders", 4.5e-4, 1e-5, is_used=True)},
        State.INSPECT,
        "CLEARANCE_DEPARTURE_G",
        (Figure.CLEARANCES, Figure.GROWTH, Figure.IMPACT_FORCES),
    ),
    (raised("torque_mismatch", Level.WARN), State.WATCH, "ALARM", ()),  # healthy legs have it
    (raised("torque_mismatch"), State.INSPECT, "TORQUE_MISMATCH", ALL),
    (raised("torque_mismatch", present=Level.OK), State.INSPECT, "TORQUE_MISMATCH", ALL),
    (
        raised("torque_mismatch") | {"diagnosis": Diagnosis(is_load_unknown=True)},
        State.INSPECT,
        "LOAD_NOT_OBSERVED",
        ALL,
    ),
    *(
        (raised("torque_mismatch") | {"explained": explained(cause)}, State.INSPECT, cause.fault_code, ALL)
        for cause in (Cause.SIGN, Cause.SCALE, Cause.TIMING, Cause.LOAD, Cause.MASS)
    ),
    (
        raised("torque_mismatch") | {"explained": explained(Cause.LOAD, after=0.9)},
        State.INSPECT,
        "TORQUE_MISMATCH",
        ALL,
    ),
    (raised("torque_bias"), State.INSPECT, "TORQUE_BIAS", ()),
    (raised("torque_drift"), State.INSPECT, "FRICTION_CHANGED", ()),
    (raised("torque_lag"), State.INSPECT, "TORQUE_TIMING", ()),
    (raised("torque_lag", present=Level.OK), State.INSPECT, "TORQUE_TIMING", ()),  # latched
    (raised("torque_lag", Level.WARN), State.WATCH, "ALARM", ()),
    (raised("impact_force A"), State.INSPECT, "IMPACT_FORCE_A", ()),
    (raised("growth A"), State.INSPECT, "GROWTH_A", ()),
    (raised("remaining_life A"), State.INSPECT, "REMAINING_LIFE_A", ()),
    (
        {"notes": {"ALREADY_COUNTED": ("",), "TRACKING_LOST": ("for 8 s",)}, "has_cycle": False},
        State.NOT_MONITORED,
        "ALREADY_COUNTED",
        OF_THE_WALK,
    ),
    *(
        (raised(kind), State.INSPECT, kind.upper(), OF_THE_MODEL)
        for kind in (STUCK, ZERO, SCALE, EXCHANGED, SIGN)
    ),
    (raised("input_rate foot_load"), State.WATCH, "FOOT_LOAD_MISSING", OF_THE_WALK),
    (raised("input_gaps foot_load"), State.WATCH, "FOOT_LOAD_MISSING", OF_THE_WALK),
    (raised("material_limit A"), State.WATCH, "MATERIAL_LIMIT_A", (Figure.GROWTH, Figure.FORECAST)),
    (raised("material_limit A", Level.WARN), State.WATCH, "ALARM_A", ()),
    (noted("TRACKING_LOST", "two series of crank angles"), State.NOT_MONITORED, "TRACKING_LOST", OF_THE_WALK),
    (raised("input_samples"), State.NOT_MONITORED, "BAD_INPUT", OF_THE_WALK),
    (raised("input_samples", present=Level.OK), State.WATCH, "ALARM", ()),
    (raised("input_rate torque"), State.WATCH, "ALARM", ()),
    (
        noted("CRANK_ZERO", "searching for the crank's zero: 2 of 3 turns"),
        State.NOT_MONITORED,
        "CRANK_ZERO",
        OF_THE_WALK,
    ),
    (noted("NOT_THIS_LEG", "the crank turns at 240 rpm"), State.NOT_MONITORED, "NOT_THIS_LEG", ALL),
    ({"has_cycle": False, "has_torque": False}, State.NOT_MONITORED, "NO_GAIT_CYCLE", ()),
    ({"has_torque": False}, State.WATCH, "NO_DRIVE_TORQUE", ()),
    (raised("input_torque"), State.WATCH, "ALARM", ()),
    *((faulty(code), State.NOT_MONITORED, code, OF_THE_WALK) for code in OF_CRANK),
    *((faulty(code), State.WATCH, code, ()) for code in OF_TORQUE),
    # a fault of the input that began earlier outranks what the input shows of the leg
    (raised("torque_mismatch") | faulty("TORQUE_CONSTANT", 70), State.WATCH, "TORQUE_CONSTANT", ()),
    (raised("impact_force A") | faulty("CRANK_STAMPS", 70), State.NOT_MONITORED, "CRANK_STAMPS", OF_THE_WALK),
    (raised("impact_force A") | faulty("CRANK_STAMPS", 78), State.INSPECT, "IMPACT_FORCE_A", OF_THE_WALK),
    ({"mismatch": math.nan}, State.WATCH, "TORQUE_NOT_COMPARED", ()),
    # beyond its limit, and not yet for long enough
    (
        {"alarms": (alarm("torque_mismatch", Level.OK, beyond=(2, 1)),)},
        State.WATCH,
        "TORQUE_NOT_COMPARED",
        (),
    ),
    ({"alarms": (alarm("torque_mismatch", Level.OK, beyond=(2, 0)),)}, State.HEALTHY, "NONE", ()),
    (
        {"diagnosis": Diagnosis(state=DiagnosisState.WAITING, reason="gait cycles: 2 of 5")},
        State.WATCH,
        "NOT_OBSERVED",
        (),
    ),
    ({"diagnosis": Diagnosis(reason="diagnosis.enabled is false")}, State.HEALTHY, "NONE", ()),
    (
        {
            "diagnosis": Diagnosis(state=DiagnosisState.AS_MODELLED, clearance_m=(3e-4, math.nan)),
            "joints": (seen_as_new("torque")[0], NEW[1]),
        },
        State.WATCH,
        "NOT_OBSERVED",
        (),
    ),
    (
        {
            "diagnosis": Diagnosis(state=DiagnosisState.AS_MODELLED, clearance_m=(3e-4, 3e-4)),
            "joints": seen_as_new("torque"),
        },
        State.HEALTHY,
        "NONE",
        (),
    ),
    (noted("CADENCE", "the leg walks at 70 rpm"), State.WATCH, "CADENCE", (Figure.FORECAST,)),
    (raised("cadence"), State.WATCH, "CADENCE", (Figure.FORECAST,)),
    (noted("ENCODER", "knee gives no angle"), State.WATCH, "ENCODER", ()),
]


@pytest.mark.parametrize(
    ("changed", "state", "code", "not_valid"), CASES, ids=[f"{i}-{c[2]}" for i, c in enumerate(CASES)]
)
def test_each_case_has_its_verdict(changed, state, code, not_valid) -> None:
    verdict = judged(**changed)
    assert (verdict.state, verdict.fault_code, verdict.not_valid) == (state, code, not_valid)
    assert verdict.why and verdict.do and "{" not in verdict.words
    assert verdict.joints == tuple(part for part in code.split("_") if part in JOINTS)
    assert guide_to(verdict) == guide_of(re.sub("(_[AG])+$", "", code))


def test_every_rule_is_the_verdict_of_some_case() -> None:
    reached = {re.sub("(_[AG])+$", "", code) for _, _, code, _ in CASES}
    assert set(rules()) == reached


def test_a_mismatch_that_is_explained_says_by_what_and_by_how_much() -> None:
    found = explained(Cause.SIGN, Cause.TIMING)
    verdict = judged(alarms=(alarm("torque_mismatch"),), explained=found)
    assert (verdict.fault_code, verdict.since_ns) == ("TORQUE_SIGN", 77)
    assert "it is -0.5 ± 0.01 times the predicted torque and the crank is 500 mrad ± 10 mrad" in verdict.why
    assert verdict.do.startswith("reverse drive_torque.sign and turn the crank to a known angle")
    assert verdict.evidence[0].name == "torque_factor" and verdict.evidence[1].unit == "rad"
    partly = judged(alarms=(alarm("torque_mismatch"),), explained=attrs.evolve(found, after=0.2))
    assert partly.fault_code == "TORQUE_SIGN" and "0.2 ± 0.01 of the predicted RMS stays" in partly.why


def test_a_cause_of_an_input_comes_before_what_the_torque_shows_of_the_leg() -> None:
    both = raised("torque_mismatch") | shown(Cause.CLEARANCE, "G")
    assert judged(**both, explained=explained(Cause.SCALE)).fault_code == "TORQUE_SCALE"
    assert judged(**both, explained=explained(Cause.LOAD)).fault_code == "CLEARANCE_CHANGED_G"


@pytest.mark.parametrize(
    ("causes", "after", "values", "is_other"),
    [
        ((Cause.MASS,), 0.03, {}, True),
        ((Cause.LOAD, Cause.MASS), 0.9, {}, True),  # not named: what is left may be friction
        ((Cause.SIGN, Cause.MASS), 0.03, {}, False),  # as received, no gait cycle of it is used
        ((Cause.MASS,), 0.03, {"runner_up": "G", "runner_up_log_odds": 9.0}, False),
        ((Cause.MASS,), 0.03, {"is_corrected": True}, False),
        ((Cause.MASS,), 0.03, {"cause": Cause.MASS}, False),
        ((Cause.MASS,), 0.03, {"cause": Cause.UNKNOWN}, False),
    ],
)
def test_one_story_of_a_torque_that_is_not_as_predicted(
    causes: tuple[Cause, ...], after: float, values: dict[str, Any], is_other: bool
) -> None:
    """Seen before: a dead zone of the torque sensor was friction by the diagnosis, and a mass beside it."""
    found = diagnosis(change(**{"cause": Cause.FRICTION} | values))
    assert found.replaces(explained(*causes, after=after)) is is_other
    past = attrs.evolve(found, state=DiagnosisState.AS_MODELLED)
    assert not past.replaces(explained(*causes, after=after))


def test_a_diagnosis_names_the_joint_that_a_mismatch_does_not() -> None:
    found = change(Cause.CLEARANCE, "G", runner_up="B 0.5 mm", runner_up_log_odds=1.0)
    verdict = judged(**raised("torque_mismatch"), diagnosis=diagnosis(found))
    assert (verdict.fault_code, verdict.joints, verdict.since_ns) == ("CLEARANCE_CHANGED_G", ("G",), 55)
    assert "(change 0.32 mm ± 0.03 mm) (or B 0.5 mm)" in verdict.why
    assert "rock joint G" in verdict.do and "leg-wear-monitor measure G MM --sigma MM" in verdict.do


SAME = [
    (Cause.SCALE, {"value": 1.2}, None),
    (Cause.TIMING, {"value": -0.05}, "torque_lag"),
    (Cause.LOAD, {"value": -40.0}, None),
    (Cause.MASS, {"value": 0.5, "subject": "shank"}, None),
    (Cause.FRICTION, {"value": 2.0}, "torque_drift"),
]


@pytest.mark.parametrize(("cause", "values", "kind"), SAME, ids=[each[0].name for each in SAME])
def test_a_cause_has_one_code_and_one_sentence_whoever_finds_it(cause, values, kind) -> None:
    one = NamedCause(cause, sigma=0.01, **values)
    by_diagnosis = judged(diagnosis=diagnosis(change(cause, sigma=0.01, counted=0.0, **values)))
    if kind is None:
        found = attrs.evolve(explained(), alternatives=((one,),))
        other = judged(alarms=(alarm("torque_mismatch"),), explained=found)
    else:
        other = judged(alarms=(alarm(kind),), torque_causes={kind: one})
    assert by_diagnosis.fault_code == other.fault_code == cause.fault_code
    assert by_diagnosis.why.endswith(sentence(one)) and other.why.endswith(sentence(one))
    assert by_diagnosis.do == other.do
    assert other.state is State.INSPECT  # its alarm is raised


@pytest.mark.parametrize("cause", [*Cause][2:], ids=lambda one: one.name)
def test_every_cause_of_the_diagnosis_has_a_rule_and_words(cause: Cause) -> None:
    verdict = judged(diagnosis=diagnosis(change(cause, "foot", value=0.5, sigma=0.1)))
    assert verdict.fault_code == cause.fault_code and verdict.evidence
    assert ("no single cause" in verdict.why) == (cause is Cause.UNKNOWN)


def test_a_ground_that_is_not_known_accuses_no_joint() -> None:
    on_ground = Diagnosis(state=DiagnosisState.WAITING, is_load_unknown=True)
    verdict = judged(**raised("torque_mismatch"), diagnosis=on_ground)
    assert (verdict.state, verdict.fault_code, verdict.joints) == (State.INSPECT, "LOAD_NOT_OBSERVED", ())
    assert "not observable" in verdict.why and "rock" not in verdict.do


def test_a_joint_and_a_finding_about_timing_stand_together_the_joint_first() -> None:
    verdict = judged(explained=explained(Cause.TIMING), diagnosis=diagnosis(change(Cause.CLEARANCE, "G")))
    assert (verdict.state, verdict.fault_code) == (State.INSPECT, "CLEARANCE_CHANGED_G")
    assert "also: the timing of the drive torque does not fit" in verdict.why


def test_a_reason_to_stop_is_not_hidden_by_an_input_that_fails() -> None:
    fault = "the crank has not been tracked for 4 s"
    verdict = judged(joints=at_limit(), alarms=(alarm("clearance G"),), notes={"TRACKING_LOST": (fault,)})
    assert verdict.state is State.STOP
    assert verdict.why.endswith("the leg is not monitored now: the crank has not been tracked for 4 s")
    assert verdict.not_valid == (Figure.GROWTH, Figure.IMPACT_FORCES)


WAITING = Diagnosis(state=DiagnosisState.WAITING, reason="gait cycles: 2 of 5")


@pytest.mark.parametrize(
    ("missing", "estimated_by", "why"),
    [
        (
            {"has_torque": False},
            "the encoders agree",
            "joints G cannot be observed: there is no drive torque",
        ),
        ({"diagnosis": WAITING}, "the drive torque agrees", "from the drive torque yet; gait cycles: 2 of 5"),
    ],
    ids=["torque", "diagnosis"],
)
def test_joints_that_encoders_show_need_no_torque_and_no_diagnosis(missing, estimated_by, why) -> None:
    eyes = seen_as_new("encoders")
    every, some = judged(**missing, joints=eyes), judged(**missing, joints=(eyes[0], NEW[1]))
    assert (every.state, some.state) == (State.HEALTHY, State.WATCH)
    assert every.why.startswith(f"no alarm is raised, and {estimated_by}")
    assert some.why.endswith(why)


def test_every_alarm_of_a_board_has_a_verdict_and_its_kind_is_known() -> None:
    for name, one in ALARMS.items():
        verdict = judged(alarms=(alarm(name, Level.WARN),))
        assert verdict.state is not State.HEALTHY, name
        assert {one.subject} & set(JOINTS) == set(verdict.joints) == {joint_of(name)} - {""}, name
    for level in (Level.WARN, Level.ERROR):
        assert "NONE" not in {judged(**raised(name, level)).fault_code for name in ALARMS}


levels = st.sampled_from(Level)
raised_alarms = st.lists(
    st.builds(
        lambda name, level, present: alarm(name, level, min(level, present)),
        st.sampled_from(sorted(ALARMS)),
        levels,
        levels,
    ),
    max_size=6,
    unique_by=lambda one: one.name,
)
situations = st.sampled_from([case[0] for case in CASES if "alarms" not in case[0]])


@given(situations, raised_alarms)
def test_a_further_alarm_never_makes_the_verdict_better(changed, alarms) -> None:
    severity, not_valid = -1, set()
    for count in range(len(alarms) + 1):
        verdict = judged(**changed, alarms=tuple(alarms[:count]))
        assert verdict.state.severity >= severity
        assert set(verdict.not_valid) >= not_valid
        severity, not_valid = verdict.state.severity, set(verdict.not_valid)


@given(situations, raised_alarms)
def test_the_verdict_is_the_worst_of_its_findings_and_holds_all_evidence(changed, alarms) -> None:
    found = findings(attrs.evolve(HEALTHY, **changed, alarms=tuple(alarms)))
    verdict = verdict_of(found)
    assert verdict.state.severity == max(finding.state.severity for finding in found)
    assert set(verdict.not_valid) == {figure for finding in found for figure in finding.not_valid}
    names = [each.name for each in verdict.evidence]
    assert len(set(names)) == len(names)
    assert set(names) == {each.name for finding in found for each in finding.evidence}
    assert {each.name for each in alarms if each.level} <= set(names)
    assert verdict_of(found[::-1]).state is verdict.state


def test_a_finding_keeps_the_stamp_since_which_it_holds() -> None:
    found = findings(attrs.evolve(HEALTHY, has_torque=False))
    first = dated(found, (), 10)
    assert [finding.since_ns for finding in first] == [10] * len(found)
    assert dated(found, first, 20) == first
    assert verdict_of(dated(findings(HEALTHY), first, 30)).since_ns == 30
    own = dated([attrs.evolve(first[0], since_ns=3)], first, 30)
    assert own[0].since_ns == 3


def test_values_alone_are_no_change() -> None:
    before = judged(alarms=(alarm("impact_force A"),))
    assert not has_changed(before, judged(alarms=(alarm("impact_force A", value=9.0),)))
    assert has_changed(before, judged(alarms=(alarm("impact_force G"),)))
    assert has_changed(before, judged(alarms=(alarm("impact_force A"), alarm("cadence"))))  # no forecast
    assert has_changed(None, before)


def test_a_verdict_is_plain_data() -> None:
    record = judged(diagnosis=diagnosis(change(Cause.CLEARANCE, "G"))).to_dict()
    assert record["state"] == "inspect" and record["joints"] == ["G"]
    evidence = {"name": "clearance G by torque", "value": 6.2e-4, "limit": None, "unit": "m"}
    assert record["evidence"][0] == evidence
    assert record["not_valid"] == ["clearances", "growth", "impact_forces", "forecast"]


# How sure, how soon, check, cost of an error: constants per code, and measured values where they hold.


def state(code: str, by: str = "torque", on_ground: bool = False, doubt: str = "") -> LegState:
    joints = ("G",) if code != "NONE" else ()
    verdict = Verdict(
        state=State.INSPECT, joints=joints, why="", since_ns=0, do="", evidence=(), not_valid=(),
        fault_code="_".join((code, *joints)),
    )  # fmt: skip
    return LegState(
        verdict=verdict,
        clearances={"G": JointClearance(best_estimate_source=by, modelled_m=3e-4, new_m=3e-4, limit_m=6e-4)},
        load=FootLoad(source="estimated", peak_n=300.0) if on_ground else FootLoad(),
        diagnosis=TorqueDiagnosis(state="as_modelled" if code == "NONE" else "changed", reason=doubt),
    )


def test_every_rule_has_its_columns_and_every_measured_value_is_cited() -> None:
    assert {name for rule in rules().values() for name in rule.measured} == set(table().measured)
    for code in rules():
        assert all(text for _, text in decision_of(state(code)))


@pytest.mark.parametrize(
    ("code", "conditions", "cited"),
    [
        ("CLEARANCE_CHANGED", {}, ("torque_name", "false_findings")),
        ("CLEARANCE_CHANGED", {"doubt": "the model does not fit"}, ("false_findings",)),
        ("CLEARANCE_CHANGED", {"on_ground": True}, ("torque_name_on_ground",)),
        ("CLEARANCE_DETECTED", {}, ("torque_stop",)),
        ("CLEARANCE_DETECTED", {"by": "encoders"}, ("encoder_name",)),
        ("CLEARANCE_DETECTED", {"doubt": "the model does not fit"}, ()),
        ("CLEARANCE_DETECTED", {"on_ground": True}, ()),
        ("CLEARANCE", {"by": "modelled"}, ("life_interval",)),
        ("CLEARANCE", {"by": "measured"}, ()),
        ("NONE", {}, ("opened_found",)),
        ("NONE", {"on_ground": True}, ("opened_found_on_ground",)),
        ("MECHANISM_CHANGED", {}, ()),
    ],
)
def test_a_measured_value_is_cited_only_for_a_leg_that_meets_its_conditions(code, conditions, cited) -> None:
    leg = state(code, **conditions)
    assert figures_of(leg) == tuple(table().measured[name] for name in cited)
    assert (dict(decision_of(leg))[HOW_SURE] == table().how_sure["not_measured"]) == (
        not cited and code != "CLEARANCE"
    )


def test_without_a_comparison_of_the_torque_no_opening_is_promised() -> None:
    off = attrs.evolve(state("NONE"), diagnosis=TorqueDiagnosis(state="off"))
    assert figures_of(off) == ()

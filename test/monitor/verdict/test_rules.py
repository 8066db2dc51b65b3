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
    """Explanations, with made-up values."""
    found = tuple(NamedCause(cause, -0.5, 0.01, "foot" if cause.name == "MASS" else "") for cause in causes)
    given = {"before": 2.0, "after": 0.03, "after_sigma": 0.01, "limit": 0.08, "speed_radps": 6.3} | values
    return TorqueExplanation(alternatives=found, **given)


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
TWO = {"alarms": (alarm("clearance A"), alarm("clearance G"))}
DEPARTED = {
    "alarms": (alarm("clearance_departure G"),),
    "joints": seen("encoders", 4.5e-4, 1e-5, is_used=True),
}
OPENED = shown(Cause.CLEARANCE, "G")
BOTH = raised("torque_mismatch") | OPENED
AT_LIMIT = raised("clearance G") | {"joints": at_limit()}
ESTIMATED = {"joints": (NEW[0], attrs.evolve(NEW[1], best_estimate_m=6.1e-4))}
CORRECTED = {"diagnosis": Diagnosis(changes=(change(Cause.CLEARANCE, "G", is_corrected=True),))}
UNKNOWN_LOAD = raised("torque_mismatch") | {"diagnosis": Diagnosis(is_load_unknown=True)}
UNEXPLAINED = raised("torque_mismatch") | {"explained": explained(Cause.LOAD, after=0.9)}
COUNTED = {"notes": {"ALREADY_COUNTED": ("",), "TRACKING_LOST": ("for 8 s",)}, "has_cycle": False}
WAITING = Diagnosis(state=DiagnosisState.WAITING, reason="gait cycles: 2 of 5")


def beyond(count: int) -> dict[str, Any]:
    """What is changed by a mismatch beyond its limit that has not raised its alarm."""
    return {"alarms": (alarm("torque_mismatch", Level.OK, beyond=(2, count)),)}


def compared(clearance_m: tuple[float, ...], joints: tuple[JointSituation, ...]) -> dict[str, Any]:
    """What is changed by a diagnosis that knows these clearances."""
    return {
        "diagnosis": Diagnosis(state=DiagnosisState.AS_MODELLED, clearance_m=clearance_m),
        "joints": joints,
    }


def replaced(part_cycles: int) -> dict[str, Any]:
    return {"joints": (attrs.evolve(NEW[0], replaced_ns=1, part_cycles=part_cycles),)}


HEALTHY_NOW, WATCH, INSPECT, STOP, NOT_MONITORED = (
    State.HEALTHY, State.WATCH, State.INSPECT, State.STOP, State.NOT_MONITORED,
)  # fmt: skip
CASES = [
    ({}, HEALTHY_NOW, "NONE", ()),
    (AT_LIMIT, STOP, "CLEARANCE_G", ()),
    *(  # what stops the leg is not in the forecast
        (raised("clearance G") | {"joints": joints}, STOP, "CLEARANCE_G", (Figure.FORECAST,))
        for joints in (NEW, at_limit(is_measurement_used=True, best_estimate_m=5.0e-4))
    ),
    (raised("clearance G", Level.WARN), WATCH, "CLEARANCE_NEAR_G", ()),
    (raised("growth G", Level.WARN), WATCH, "ALARM_G", ()),
    (TWO, STOP, "CLEARANCE_A_G", (Figure.FORECAST,)),
    ({"joints": seen("torque", 6.7e-4, 3.0e-5)}, STOP, "CLEARANCE_DETECTED_G", ALL),
    (replaced(19), WATCH, "PART_REPLACED_A", ()),
    (replaced(20), HEALTHY_NOW, "NONE", ()),
    ({"joints": seen("encoders", 6.2e-4, 3.0e-5)}, HEALTHY_NOW, "NONE", ()),  # not surely
    (ESTIMATED, STOP, "CLEARANCE_ESTIMATED_G", ()),
    (OPENED, INSPECT, "CLEARANCE_CHANGED_G", ALL),
    (CORRECTED, INSPECT, "CLEARANCE_CORRECTED_G", ()),
    (shown(Cause.UNKNOWN), INSPECT, "MECHANISM_CHANGED", ALL),
    (shown(Cause.LENGTH, "foot"), INSPECT, "MECHANISM_CHANGED", ALL),
    (shown(Cause.MASS, "foot"), INSPECT, "TORQUE_MASS", ALL),
    (shown(Cause.SCALE), INSPECT, "TORQUE_SCALE", ()),
    (shown(Cause.LAG), INSPECT, "TORQUE_TIMING", ()),
    (shown(Cause.TIMING), INSPECT, "TORQUE_TIMING", ()),
    (shown(Cause.NOISE), WATCH, "TORQUE_NOISE", ()),
    (shown(Cause.LOAD), WATCH, "TORQUE_LOAD", (Figure.GROWTH, Figure.IMPACT_FORCES, Figure.FORECAST)),
    (shown(Cause.FRICTION), WATCH, "FRICTION_CHANGED", ()),
    (shown(Cause.JOINT_FRICTION), WATCH, "FRICTION_CHANGED", ()),
    ({"diagnosis": Diagnosis(state=DiagnosisState.AS_MODELLED)}, WATCH, "NOT_OBSERVED", ()),
    (raised("clearance_departure G", Level.WARN), WATCH, "ALARM_G", ()),
    (raised("clearance_departure G"), INSPECT, "CLEARANCE_DEPARTURE_G", ALL),
    (DEPARTED, INSPECT, "CLEARANCE_DEPARTURE_G", (Figure.CLEARANCES, *OF_THE_WALK)),
    (raised("torque_mismatch", Level.WARN), WATCH, "ALARM", ()),  # healthy legs have it
    (raised("torque_mismatch"), INSPECT, "TORQUE_MISMATCH", ALL),
    (raised("torque_mismatch", present=Level.OK), INSPECT, "TORQUE_MISMATCH", ALL),
    (UNKNOWN_LOAD, INSPECT, "LOAD_NOT_OBSERVED", ALL),
    *(
        (raised("torque_mismatch") | {"explained": explained(cause)}, INSPECT, cause.fault_code, ALL)
        for cause in (Cause.SIGN, Cause.SCALE, Cause.TIMING, Cause.LOAD, Cause.MASS)
    ),
    (UNEXPLAINED, INSPECT, "TORQUE_MISMATCH", ALL),
    # a cause of an input comes before what the torque shows of the leg
    (BOTH | {"explained": explained(Cause.SCALE)}, INSPECT, "TORQUE_SCALE", ALL),
    (BOTH | {"explained": explained(Cause.LOAD)}, INSPECT, "CLEARANCE_CHANGED_G", ALL),
    (OPENED | {"explained": explained(Cause.TIMING)}, INSPECT, "CLEARANCE_CHANGED_G", ALL),
    (raised("torque_bias"), INSPECT, "TORQUE_BIAS", ()),
    (raised("torque_lag"), INSPECT, "TORQUE_TIMING", ()),
    (raised("torque_lag", present=Level.OK), INSPECT, "TORQUE_TIMING", ()),  # latched
    (raised("torque_lag", Level.WARN), WATCH, "ALARM", ()),
    (raised("impact_force A"), INSPECT, "IMPACT_FORCE_A", ()),
    (raised("growth A"), INSPECT, "GROWTH_A", ()),
    (raised("remaining_life A"), INSPECT, "REMAINING_LIFE_A", ()),
    (COUNTED, NOT_MONITORED, "ALREADY_COUNTED", OF_THE_WALK),
    *((raised(kind), INSPECT, kind.upper(), OF_THE_MODEL) for kind in (STUCK, ZERO, SCALE, EXCHANGED, SIGN)),
    (raised("input_rate foot_load"), WATCH, "FOOT_LOAD_MISSING", OF_THE_WALK),
    (raised("input_gaps foot_load"), WATCH, "FOOT_LOAD_MISSING", OF_THE_WALK),
    (raised("material_limit A"), WATCH, "MATERIAL_LIMIT_A", (Figure.GROWTH, Figure.FORECAST)),
    (raised("material_limit A", Level.WARN), WATCH, "ALARM_A", ()),
    (noted("TRACKING_LOST", "two series of crank angles"), NOT_MONITORED, "TRACKING_LOST", OF_THE_WALK),
    # a reason to stop is not hidden by an input that fails
    (AT_LIMIT | noted("TRACKING_LOST", "for 4 s"), STOP, "CLEARANCE_G", OF_THE_WALK),
    (raised("input_samples"), NOT_MONITORED, "BAD_INPUT", OF_THE_WALK),
    (raised("input_samples", present=Level.OK), WATCH, "ALARM", ()),
    (raised("input_rate torque"), WATCH, "ALARM", ()),
    (noted("CRANK_ZERO", "2 of 3 turns"), NOT_MONITORED, "CRANK_ZERO", OF_THE_WALK),
    (noted("NOT_THIS_LEG", "the crank turns at 240 rpm"), NOT_MONITORED, "NOT_THIS_LEG", ALL),
    ({"has_cycle": False, "has_torque": False}, NOT_MONITORED, "NO_GAIT_CYCLE", ()),
    ({"has_torque": False}, WATCH, "NO_DRIVE_TORQUE", ()),
    (raised("input_torque"), WATCH, "ALARM", ()),
    *((faulty(code), NOT_MONITORED, code, OF_THE_WALK) for code in OF_CRANK),
    *((faulty(code), WATCH, code, ()) for code in OF_TORQUE),
    # a fault of the input that began earlier outranks what the input shows of the leg
    (raised("torque_mismatch") | faulty("TORQUE_CONSTANT", 70), WATCH, "TORQUE_CONSTANT", ()),
    (raised("impact_force A") | faulty("CRANK_STAMPS", 70), NOT_MONITORED, "CRANK_STAMPS", OF_THE_WALK),
    (raised("impact_force A") | faulty("CRANK_STAMPS", 78), INSPECT, "IMPACT_FORCE_A", OF_THE_WALK),
    ({"mismatch": math.nan}, WATCH, "TORQUE_NOT_COMPARED", ()),
    (beyond(1), WATCH, "TORQUE_NOT_COMPARED", ()),  # and not yet for long enough
    (beyond(0), HEALTHY_NOW, "NONE", ()),
    ({"diagnosis": WAITING}, WATCH, "NOT_OBSERVED", ()),
    ({"diagnosis": Diagnosis(reason="diagnosis.enabled is false")}, HEALTHY_NOW, "NONE", ()),
    (compared((3e-4, math.nan), (seen_as_new("torque")[0], NEW[1])), WATCH, "NOT_OBSERVED", ()),
    (compared((3e-4, 3e-4), seen_as_new("torque")), HEALTHY_NOW, "NONE", ()),
    # joints that encoders show need no torque and no diagnosis
    *(
        (missing | {"joints": joints}, state, code, ())
        for missing, named in (
            ({"has_torque": False}, "NO_DRIVE_TORQUE"),
            ({"diagnosis": WAITING}, "NOT_OBSERVED"),
        )
        for joints, state, code in (
            (seen_as_new("encoders"), HEALTHY_NOW, "NONE"),
            ((seen_as_new("encoders")[0], NEW[1]), WATCH, named),
        )
    ),
    (noted("CADENCE", "the leg walks at 70 rpm"), WATCH, "CADENCE", (Figure.FORECAST,)),
    (raised("cadence"), WATCH, "CADENCE", (Figure.FORECAST,)),
    (noted("ENCODER", "knee gives no angle"), WATCH, "ENCODER", ()),
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


@pytest.mark.parametrize(
    ("causes", "after", "values", "is_other"),
    [
        ((Cause.MASS,), 0.03, {}, True),
        ((Cause.LOAD, Cause.MASS), 0.9, {}, True),  # not named: what is left may be friction
        ((Cause.SIGN,), 0.03, {}, False),  # as received, no gait cycle of it is used
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


SAME = [
    (Cause.SCALE, {"value": 1.2}, None),
    (Cause.TIMING, {"value": -0.05}, "torque_lag"),
    (Cause.LOAD, {"value": -40.0}, None),
    (Cause.MASS, {"value": 0.5, "subject": "shank"}, None),
]


@pytest.mark.parametrize(("cause", "values", "kind"), SAME, ids=[each[0].name for each in SAME])
def test_a_cause_has_one_code_and_one_sentence_whoever_finds_it(cause, values, kind) -> None:
    one = NamedCause(cause, sigma=0.01, **values)
    by_diagnosis = judged(diagnosis=diagnosis(change(cause, sigma=0.01, counted=0.0, **values)))
    if kind is None:
        found = attrs.evolve(explained(), alternatives=(one,))
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

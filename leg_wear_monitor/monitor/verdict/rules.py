"""The verdict of a situation by all rules; the most severe one that holds decides, the first of equals.

A rule is a row of config/verdict.yaml and a condition: the cases in a situation for which it holds.
docs/reference/monitor.md lists the rules; a test compares the two.
"""

from collections.abc import Mapping, Sequence

from leg_wear_monitor.monitor import alarms
from leg_wear_monitor.monitor.input_health import INPUT_RULES
from leg_wear_monitor.monitor.verdict import conditions
from leg_wear_monitor.monitor.verdict.conditions import Condition, Hit, has_cause, has_fault, noted, raised
from leg_wear_monitor.monitor.verdict.situation import Situation
from leg_wear_monitor.monitor.verdict.table import ALARM, NO_GAIT_CYCLE, NONE, Rule, rules
from leg_wear_monitor.state import Figure, Level, Verdict

CONDITIONS: Mapping[str, Condition] = {
    "CLEARANCE": conditions.modelled_at_limit,
    "CLEARANCE_DETECTED": conditions.detected_at_limit,
    "CLEARANCE_ESTIMATED": conditions.estimated_at_limit,
    "CLEARANCE_CHANGED": conditions.diagnosed,
    "CLEARANCE_CORRECTED": conditions.corrected,
    "CLEARANCE_DEPARTURE": conditions.departing,
    "TORQUE_SIGN": has_cause("TORQUE_SIGN"),
    "TORQUE_SCALE": has_cause("TORQUE_SCALE"),
    "TORQUE_TIMING": has_cause("TORQUE_TIMING"),
    "TORQUE_MASS": has_cause("TORQUE_MASS"),
    "MECHANISM_CHANGED": has_cause("MECHANISM_CHANGED"),
    "TORQUE_LOAD": has_cause("TORQUE_LOAD"),
    "TORQUE_NOISE": has_cause("TORQUE_NOISE"),
    "TORQUE_BIAS": has_cause("TORQUE_BIAS"),
    "FRICTION_CHANGED": has_cause("FRICTION_CHANGED"),
    "LOAD_NOT_OBSERVED": conditions.load_not_observed,
    "TORQUE_MISMATCH": conditions.mismatch,
    "IMPACT_FORCE": raised("impact_force"),
    "GROWTH": raised("growth"),
    "REMAINING_LIFE": raised("remaining_life"),
    "MATERIAL_LIMIT": raised("material_limit"),
    **{kind.upper(): raised(kind) for kind in alarms.FOOT_LOAD_WORDS},
    **{rule.code: has_fault(rule.code) for rule in INPUT_RULES},
    alarms.ALREADY_COUNTED: noted(alarms.ALREADY_COUNTED),
    alarms.CRANK_ZERO: noted(alarms.CRANK_ZERO),
    alarms.TRACKING_LOST: noted(alarms.TRACKING_LOST),
    "NOT_THIS_LEG": noted("NOT_THIS_LEG"),
    "ENCODER": noted("ENCODER"),
    "BAD_INPUT": conditions.blinding,
    NO_GAIT_CYCLE: conditions.no_cycle,
    "FOOT_LOAD_MISSING": conditions.of_foot_load,
    "PART_REPLACED": conditions.replaced,
    "NO_DRIVE_TORQUE": conditions.no_torque,
    "TORQUE_NOT_COMPARED": conditions.not_compared,
    "NOT_OBSERVED": conditions.not_observed,
    "CADENCE": conditions.other_cadence,
    "CLEARANCE_NEAR": raised("clearance", least=Level.WARN, most=Level.WARN),
    ALARM: raised(least=Level.WARN),
    NONE: conditions.nothing_found,
}


def findings(situation: Situation) -> tuple[Verdict, ...]:
    """Verdicts of all rules that hold, in the order of the table; a healthy leg's verdict only alone."""
    found = []
    for code, rule in rules().items():
        hits = CONDITIONS[code](situation)
        if hits := [hit for hit in hits if situation.is_trusted(rule.rests_on, hit.since_ns)]:
            found.append(_finding(code, rule, hits, situation))
    return tuple(each for each in found if each.fault_code != NONE) or tuple(found)


def _finding(code: str, rule: Rule, hits: Sequence[Hit], situation: Situation) -> Verdict:
    """The verdict by one rule alone, with all of its cases."""
    joints = tuple(dict.fromkeys(hit.joint for hit in hits if hit.joint))
    not_valid = {*rule.not_valid, *(figure for hit in hits for figure in hit.not_valid)}
    words = {"joints": situation.joints_words(joints), **hits[0].words, "joint": hits[0].joint}
    return Verdict(
        fault_code="_".join((code, *joints)),
        state=max((rule.state, *(hit.state for hit in hits)), key=lambda state: state.severity),
        joints=joints,
        why="; ".join(dict.fromkeys(rule.why.format(**hit.words) for hit in hits)),
        do=rule.do.format(**words),
        since_ns=min((hit.since_ns for hit in hits if hit.since_ns), default=0),
        evidence=tuple(each for hit in hits for each in hit.evidence),
        not_valid=tuple(figure for figure in Figure if figure in not_valid),
    )

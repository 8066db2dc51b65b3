"""Conditions on clearances: those that the forecast believes, and those that measurements show."""

import math
from collections.abc import Sequence

from leg_wear_monitor.estimate.cause import Cause, Change
from leg_wear_monitor.monitor.alarms.alarm import Alarm, Level
from leg_wear_monitor.monitor.alarms.words import time_words
from leg_wear_monitor.monitor.diagnosis.diagnosis import DiagnosisState
from leg_wear_monitor.monitor.verdict.alarm_rules import hit_of, raised
from leg_wear_monitor.monitor.verdict.belief import SEEN, SOURCES, at_limit_by_estimate
from leg_wear_monitor.monitor.verdict.cause_rules import changes, doubt, words_of
from leg_wear_monitor.monitor.verdict.rule import Hit
from leg_wear_monitor.monitor.verdict.situation import JointSituation, SeenClearance, Situation
from leg_wear_monitor.monitor.verdict.verdict import Evidence, Figure
from leg_wear_monitor.monitor.verdict.words import amount, estimate

CONFIRMED_CYCLES = 20  # gait cycles of a new part; another leg is told in fewer


def believed_at_limit(situation: Situation) -> Sequence[Hit]:
    """Joints whose clearance is at its limit by what the forecast believes, measurements included."""
    return [
        Hit(
            words={
                "joint": situation.joint_words(each.joint),
                "value": amount(each.believed_m, "m"),
                "limit": amount(each.limit_m, "m"),
            },
            joint=each.joint,
            evidence=(Evidence(f"believed clearance {each.joint}", each.believed_m, each.limit_m, "m"),),
        )
        for each in situation.joints
        if each.believed_m >= each.limit_m
    ]


def counted_at_limit(situation: Situation) -> Sequence[Hit]:
    """Alarms of clearances that are at their limit as counted or as measured."""
    alarms = (alarm for alarm in situation.alarms if alarm.kind == "clearance" and alarm.cause not in SEEN)
    return [hit_of(alarm, situation) for alarm in alarms if alarm.level is Level.ERROR]


def seen_at_limit(situation: Situation) -> Sequence[Hit]:
    """Joints whose clearance is surely at its limit by what encoders or the drive torque show, or showed.

    What they showed stays until somebody acknowledges it, or a measurement contradicts it.
    """
    found = ((each, situation.alarm_of(each.joint)) for each in situation.joints)
    estimates = ((each, alarm, at_limit_by_estimate(each, alarm)) for each, alarm in found)
    return [_seen_hit(each, alarm, seen, situation) for each, alarm, seen in estimates if seen is not None]


def _seen_hit(each: JointSituation, alarm: Alarm | None, seen: SeenClearance, situation: Situation) -> Hit:
    raised_ns = alarm.raised_ns if alarm is not None and alarm.level is Level.ERROR else 0
    is_present = seen in each.seen
    past = "" if is_present else f" (since {time_words(raised_ns)}; not shown now)"
    if each.measured is not None:
        past += f"; {estimate(each.measured.clearance_m, each.measured.sigma_m, 'm')} was measured"
    return Hit(
        words={
            "joint": situation.joint_words(each.joint),
            "by": SOURCES[seen.by],
            "value": estimate(seen.clearance_m, seen.sigma_m, "m"),
            "limit": amount(each.limit_m, "m"),
            "past": past,
            "doubt": doubt(situation) if seen.by == "torque" and is_present else "",
        },
        joint=each.joint,
        since_ns=raised_ns,
        evidence=(Evidence(f"clearance {each.joint} by {seen.by}", seen.clearance_m, each.limit_m, "m"),),
    )


def replaced(situation: Situation) -> Sequence[Hit]:
    """Joints whose part is so new that no gait cycles confirm the repair yet."""
    return [
        Hit(
            words={
                "joint": situation.joint_words(each.joint),
                "when": time_words(each.replaced_ns),
                "cycles": str(each.part_cycles),
            },
            joint=each.joint,
        )
        for each in situation.joints
        if each.replaced_ns and each.part_cycles < CONFIRMED_CYCLES and not _is_confirmed(each, situation)
    ]


def _is_confirmed(each: JointSituation, situation: Situation) -> bool:
    """Whether encoders or the drive torque show the counted clearance of a new part already."""
    found = situation.diagnosis
    is_as_counted = found is not None and found.state is DiagnosisState.AS_COUNTED
    return bool(each.seen) and (is_as_counted or each.is_used)


def departing(situation: Situation) -> Sequence[Hit]:
    """Joints whose clearance by encoders differs from the counted one; the forecast may use it."""
    used = {each.joint for each in situation.joints if each.is_used}
    return [
        hit if hit.joint in used else _with_forecast(hit) for hit in raised("clearance_departure")(situation)
    ]


def _with_forecast(hit: Hit) -> Hit:
    return Hit(
        words=hit.words,
        joint=hit.joint,
        since_ns=hit.since_ns,
        evidence=hit.evidence,
        not_valid=(Figure.FORECAST,),
    )


def diagnosed(situation: Situation) -> Sequence[Hit]:
    """Clearances that have changed by the drive torque, and that are not corrected."""
    found = [change for change in changes(situation) if change.cause is Cause.CLEARANCE]
    return [_hit(change, situation, doubt(situation)) for change in found]


def corrected(situation: Situation) -> Sequence[Hit]:
    """Changes by which counted clearances were corrected."""
    found = situation.diagnosis.changes if situation.diagnosis else ()
    return [_hit(change, situation) for change in found if change.is_corrected]


def _hit(change: Change, situation: Situation, doubts: str = "") -> Hit:
    own = (each.measured for each in situation.joints if each.joint == change.subject)
    measured = next(own, None)
    if measured is not None:
        doubts += f"; {estimate(measured.clearance_m, measured.sigma_m, 'm')} was measured"
    return Hit(
        words={"change": f"{words_of(change, situation)}{doubts}"},
        joint=change.subject,
        since_ns=change.since_ns,
        evidence=(Evidence(f"clearance {change.subject} by torque", change.value, math.nan, "m"),),
    )

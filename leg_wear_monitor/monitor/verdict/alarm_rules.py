"""Conditions on alarms. A latched alarm counts like a present one until somebody acknowledges it."""

import math
from collections.abc import Callable, Sequence

from leg_wear_monitor.monitor.alarms.alarm import Alarm, Level
from leg_wear_monitor.monitor.alarms.words import time_words
from leg_wear_monitor.monitor.verdict.rule import Hit
from leg_wear_monitor.monitor.verdict.situation import JointSituation, Situation
from leg_wear_monitor.monitor.verdict.verdict import Evidence
from leg_wear_monitor.monitor.verdict.words import amount, estimate

Condition = Callable[[Situation], Sequence[Hit]]

OF_A_JOINT = (
    "impact_force",
    "clearance",
    "growth",
    "remaining_life",
    "material_limit",
    "clearance_departure",
)


def raised(*kinds: str, least: Level = Level.WARN) -> Condition:
    """Alarms of some kinds (all if none is given) at a level or above it."""

    def hits(situation: Situation) -> Sequence[Hit]:
        return [
            hit_of(alarm, situation)
            for alarm in situation.alarms
            if alarm.level >= least and (not kinds or alarm.kind in kinds)
        ]

    return hits


def blinding(situation: Situation) -> Sequence[Hit]:
    """Present faults of the input of the crank; those of torque and foot load stop no counting."""
    kinds = ("input_sources", "input_rate", "input_samples", "input_gaps", "input_silence")
    causes = f": {situation.input_causes[0]}" if situation.input_causes else ""  # the most frequent
    return [
        hit_of(alarm, situation, causes=causes)
        for alarm in situation.alarms
        if alarm.kind in kinds
        and alarm.subject not in ("torque", "foot_load")
        and alarm.present is Level.ERROR
    ]


def of_foot_load(situation: Situation) -> Sequence[Hit]:
    """Present lack of samples of the foot load."""
    return [
        hit_of(alarm, situation)
        for alarm in situation.alarms
        if alarm.subject == "foot_load" and alarm.present is Level.ERROR
    ]


def hit_of(alarm: Alarm, situation: Situation, **words: str) -> Hit:
    """An alarm as a case of a rule: its worst value if it is known, else its last one."""
    is_present = alarm.present is alarm.level  # a level that has fallen has a value within the limit
    is_last = math.isnan(alarm.worst) or (is_present and not math.isnan(alarm.value))
    value = alarm.value if is_last else alarm.worst
    is_of_a_joint = alarm.kind in OF_A_JOINT
    joint, noun = situation.joint_words(alarm.subject), situation.quantity(alarm)
    told = {
        "quantity": f"{noun} of joint {joint}" if is_of_a_joint else noun,
        "joint": joint,
        "value": amount(value, alarm.unit),
        "limit": amount(alarm.limit, alarm.unit),
        "past": "" if is_present else f" (since {time_words(alarm.raised_ns)}; now within its limit)",
        "known": "counted",
    }
    evidence: tuple[Evidence, ...] = ()
    each = _measured(alarm, value, situation)
    if each is not None and each.measured is not None:
        told["known"] = "measured" if value <= each.measured.clearance_m else "estimated"
        told["past"] += (
            f"; {estimate(each.measured.clearance_m, each.measured.sigma_m, 'm')} was measured, "
            f"{amount(each.counted_m, 'm')} is counted"
        )
        evidence = (
            Evidence(f"measured clearance {each.joint}", each.measured.clearance_m, each.limit_m, "m"),
            Evidence(f"counted clearance {each.joint}", each.counted_m, each.limit_m, "m"),
        )
    return Hit(
        words=told | words,
        joint=alarm.subject if is_of_a_joint else "",
        since_ns=alarm.raised_ns,
        evidence=(Evidence(alarm.name, value, alarm.limit, alarm.unit), *evidence),
    )


def _measured(alarm: Alarm, value: float, situation: Situation) -> JointSituation | None:
    """The joint of an alarm of the clearance, if its value is known by measurement and not by counting."""
    own = (each for each in situation.joints if alarm.kind == "clearance" and each.joint == alarm.subject)
    return next((each for each in own if each.measured is not None and value > each.counted_m), None)

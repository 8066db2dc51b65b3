"""Conditions on loads beyond the limits of a joint's material, where its wear coefficient does not hold."""

from collections.abc import Sequence

import attrs

from leg_wear_monitor.monitor.alarms.alarm import Level
from leg_wear_monitor.monitor.verdict.alarm_rules import raised
from leg_wear_monitor.monitor.verdict.rule import Hit
from leg_wear_monitor.monitor.verdict.situation import JointSituation, Situation
from leg_wear_monitor.monitor.verdict.verdict import Evidence


def outside_limits(situation: Situation) -> Sequence[Hit]:
    """Joints that are, or were, loaded beyond a limit of their material, with each value beyond its limit."""
    joints = {each.joint: each for each in situation.joints}
    return [
        _hit(hit, joints.get(hit.joint)) for hit in raised("material_limit", least=Level.ERROR)(situation)
    ]


def _hit(hit: Hit, joint: JointSituation | None) -> Hit:
    load = joint.load if joint else None
    beyond = load.excesses if load else ()
    outside = load.outside_limits if load else None
    if outside is None:  # now within them
        outside = f"{hit.words['value']} times a limit of its material{hit.words['past']}"
    evidence = (Evidence(f"{each.name} {hit.joint}", each.value, each.limit, each.unit) for each in beyond)
    words = {**hit.words, "outside": outside}
    return attrs.evolve(hit, words=words, evidence=(*hit.evidence, *evidence))

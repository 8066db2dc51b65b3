"""Conditions on the inputs: crank, drive torque, further encoders, cadence."""

import math
from collections.abc import Sequence

from leg_wear_monitor.monitor.alarms.alarm import Level
from leg_wear_monitor.monitor.diagnosis.diagnosis import Diagnosis, DiagnosisState
from leg_wear_monitor.monitor.verdict.alarm_rules import raised
from leg_wear_monitor.monitor.verdict.rule import Hit
from leg_wear_monitor.monitor.verdict.situation import Situation
from leg_wear_monitor.monitor.verdict.verdict import Evidence
from leg_wear_monitor.monitor.verdict.words import amount


def all_counted(situation: Situation) -> Sequence[Hit]:
    """The ledger already contained the wear of all samples."""
    return [Hit()] if situation.is_all_counted else []


def without_zero(situation: Situation) -> Sequence[Hit]:
    """The zero of the crank's encoder is not known."""
    return _said(situation.without_zero)


def unfollowed(situation: Situation) -> Sequence[Hit]:
    """The crank is not followed."""
    return _said(situation.unfollowed)


def doubtful(situation: Situation) -> Sequence[Hit]:
    """The last gait cycle is unlikely to be one of this leg."""
    return _said("; ".join(situation.doubts))


def no_cycle(situation: Situation) -> Sequence[Hit]:
    """No whole gait cycle was monitored in this run."""
    return [] if situation.has_cycle else [Hit()]


def no_torque(situation: Situation) -> Sequence[Hit]:
    """Neither the drive torque nor encoders show the joints.

    The state is `WATCH`: wear is counted from the motion alone, so the leg is monitored, and its alarms of
    clearance, growth and forces hold for the counted leg. But no measurement can contradict the counting: a
    bushing that breaks changes nothing that is received. So nobody may be told that the leg is healthy.
    """
    if not situation.has_cycle or not situation.unobserved:
        return []
    fault = _fault_of_torque(situation)
    joints = ", ".join(map(situation.joint_words, situation.unobserved))
    return [Hit(words={"joints": joints, "cause": fault})] if fault else []


def _fault_of_torque(situation: Situation) -> str:
    if not situation.has_torque:
        return "there is no drive torque"
    stuck = [each for each in situation.alarms if each.kind == "input_torque" and each.present is Level.ERROR]
    return "the drive torque is stuck or saturated" if stuck else ""


def not_compared(situation: Situation) -> Sequence[Hit]:
    """There is a drive torque, but not yet enough of it to be compared."""
    is_known = not situation.has_torque or not math.isnan(situation.mismatch)
    return [] if is_known or not situation.has_cycle or not situation.unobserved else [Hit()]


def not_observed(situation: Situation) -> Sequence[Hit]:
    """The diagnosis does not show some joints yet, or not at all, and no encoder does.

    The mismatch of the torque shows broken hip and knee joints, but not those of the foot
    (monitor.md), so a leg without a mismatch is not known to be healthy. A diagnosis that is off is the
    choice of somebody, and does not raise this.
    """
    found = situation.diagnosis
    if found is None or found.state not in (DiagnosisState.WAITING, DiagnosisState.AS_COUNTED):
        return []
    blind = [each.joint for each in situation.joints if not each.seen]
    if not blind or not situation.has_cycle or not situation.has_torque:
        return []
    cause = f": {found.reason}" if found.reason else ""
    upcoming = f": {found.next_step}" if found.next_step else ""
    unused = tuple(
        Evidence(f"cycles not used: {reason}", float(number), math.nan, "")
        for reason, number in found.cycles_not_used.items()
    )
    joints = ", ".join(map(situation.joint_words, blind))
    return [Hit(words={"joints": joints, "causes": cause, "next": upcoming}, evidence=unused)]


def other_cadence(situation: Situation) -> Sequence[Hit]:
    """The cadence is outside of its tolerance, or was for so long that its alarm is raised."""
    alarms = raised("cadence", least=Level.ERROR)(situation)
    if not situation.is_out_of_step and not alarms:
        return []
    words = {
        "walks": f"walks at {amount(situation.cadence_rpm, 'rpm')}"
        if situation.is_out_of_step
        else "walked at another cadence",
        "commanded": amount(situation.commanded_rpm, "rpm"),
        "tolerance": amount(situation.tolerance_rpm, "rpm"),
    }
    evidence = Evidence("cadence_rpm", situation.cadence_rpm, situation.commanded_rpm, "rpm")
    since_ns = alarms[0].since_ns if alarms else 0
    return [
        Hit(words=words, since_ns=since_ns, evidence=(evidence, *(e for a in alarms for e in a.evidence)))
    ]


def encoder_faults(situation: Situation) -> Sequence[Hit]:
    """A further encoder gives nothing that can be used."""
    return [Hit(words={"cause": fault}) for fault in situation.encoder_faults]


def nothing_found(situation: Situation) -> Sequence[Hit]:
    """Always holds; it counts where no other rule does."""
    observed = "the encoders show the counted clearances"
    evidence: tuple[Evidence, ...] = ()
    if situation.has_torque and not math.isnan(situation.mismatch):
        limit = situation.mismatch_limit
        evidence = (Evidence("torque_mismatch", situation.mismatch, limit, ""),)
        observed = (
            f"the drive torque agrees with the counted leg: {amount(situation.mismatch, '')} of its RMS is "
            f"not explained (limit {amount(limit, '')})"
        )
        observed += _compared(situation.diagnosis)
    return [Hit(words={"observed": observed}, evidence=evidence)]


def _compared(found: Diagnosis | None) -> str:
    """What the torque shows of the clearances of a healthy leg, and what comes next; empty if nothing."""
    if found is None:
        return ""
    if found.state is DiagnosisState.OFF:
        return f"; the torque is not compared with wider joints: {found.reason}"
    known = [each for each in found.sigma_m if not math.isnan(each)]
    told = [f"{found.cycles} gait cycles show clearances to ± {amount(max(known), 'm')}"] if known else []
    return "".join(f"; {each}" for each in (*told, found.next_step) if each)


def _said(cause: str) -> Sequence[Hit]:
    return [Hit(words={"cause": cause})] if cause else []

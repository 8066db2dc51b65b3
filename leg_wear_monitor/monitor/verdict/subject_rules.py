"""Rules of the verdict by subject: clearances, causes of a torque, inputs, materials."""

import math
from collections.abc import Callable, Sequence

import attrs

from leg_wear_monitor.estimate.cause import Cause, Change, NamedCause
from leg_wear_monitor.monitor.alarms import CAUSES_OF_ALARMS, Alarm, amount, time_words
from leg_wear_monitor.monitor.diagnosis.state import Diagnosis, DiagnosisState
from leg_wear_monitor.monitor.verdict.situation import (
    SEEN,
    SOURCES,
    Hit,
    JointSituation,
    KnownClearance,
    Situation,
    at_limit_by_estimate,
    hit_of,
    known_evidence,
    raised,
)
from leg_wear_monitor.monitor.verdict.verdict import EVIDENCE, CauseWords, estimate
from leg_wear_monitor.state import Evidence, Figure, Level, State

# Conditions on what explains the drive torque: one code a cause, whoever finds it.
#
# A torque mismatch is explained while its alarm is raised, further alarms of the torque are limits of single
# causes, and the diagnosis shows what has changed since the leg was commissioned.


def has_cause(code: str) -> Callable[[Situation], Sequence[Hit]]:
    """The condition that the drive torque has a cause of this code; the surest way of finding it decides."""

    def hits(situation: Situation) -> Sequence[Hit]:
        return _explained(code, situation) or _beyond_limits(code, situation) or _diagnosed(code, situation)

    return hits


def _explained(code: str, situation: Situation) -> list[Hit]:
    """A torque mismatch that is explained, where the first of its causes has this code."""
    named = situation.explained.named if situation.explained else ()
    if not named or named[0].cause.fault_code != code:
        return []
    words = words_for(situation)
    texts = {"causes": f": {_in_words(situation)}", "remedy": " and ".join(map(words.remedy, named))}
    alarms = raised("torque_mismatch")(situation)
    since_ns = alarms[0].since_ns if alarms else 0
    evidence = tuple(map(_evidence, named))
    return [Hit(words=texts, since_ns=since_ns, evidence=evidence, state=State.INSPECT)]


def _beyond_limits(code: str, situation: Situation) -> list[Hit]:
    """Alarms of a bias, a drift or a lag beyond its bounds."""
    kinds = [kind for kind, cause in CAUSES_OF_ALARMS.items() if cause.fault_code == code]
    if not kinds:
        return []
    words, hits = words_for(situation), []
    for hit in raised(*kinds, least=Level.ERROR)(situation):
        alarm = hit.evidence[0].name  # the evidence of a raised alarm is the alarm's value, by its name
        cause = situation.torque_causes.get(alarm)
        sentence = f"; {words.cause(cause)}" if cause else ""
        texts = {
            "causes": ": the {quantity} is {value} (limit {limit}){past}".format(**hit.words) + sentence,
            "remedy": words.remedy(cause or NamedCause(CAUSES_OF_ALARMS[alarm], 0.0, 0.0)),
        }
        hits.append(Hit(words=texts, since_ns=hit.since_ns, evidence=hit.evidence, state=State.INSPECT))
    return hits


def _diagnosed(code: str, situation: Situation) -> list[Hit]:
    """Significant changes that the diagnosis shows, other than of a clearance."""
    found = [each for each in changes(situation) if each.cause.fault_code == code]
    return [
        Hit(
            words={
                "causes": f": {words_of(change, situation)}{doubt(situation)}",
                "remedy": words_for(situation).remedy(_named_cause(change, situation)),
            },
            since_ns=change.since_ns,
            evidence=(_evidence(change),),
        )
        for change in found
    ]


def mismatch(situation: Situation) -> Sequence[Hit]:
    """The drive torque is not that of the counted leg; with what may cause it, as far as that is known."""
    words = words_for(situation)
    possible = [*map(words.cause, situation.torque_causes.values())]
    possible += [words_of(change, situation) for change in changes(situation)]
    causes = f"; possible cause: {'; '.join(possible)}" if possible else ""
    if situation.explained is not None:
        causes = f"; {_in_words(situation)}{causes}"
    return [
        attrs.evolve(hit, words={**hit.words, "causes": causes})
        for hit in raised("torque_mismatch", least=Level.ERROR)(situation)
    ]


def changes(situation: Situation) -> tuple[Change, ...]:
    """What the drive torque shows that has changed; empty without an estimator."""
    if situation.diagnosis.state is not DiagnosisState.CHANGED:
        return ()
    return tuple(change for change in situation.diagnosis.changes if not change.is_corrected)


def words_of(change: Change, situation: Situation) -> str:
    """A change in words, such as ``clearance of 0.62 mm ± 0.03 mm in joint G (0.3 mm is counted)``."""
    if change.cause is Cause.CLEARANCE:
        value, counted = estimate(change.value, change.sigma, "m"), amount(change.counted, "m")
        verb, joint = "was" if change.is_corrected else "is", situation.joint_words(change.subject)
        words = f"clearance of {value} in joint {joint} ({counted} {verb} counted)"
        if change.value < change.counted:
            words += ", less than before: if its part was replaced, reset the joint"
    else:
        words = words_for(situation).cause(_named_cause(change, situation))
    if change.runner_up and not change.is_named:
        words += f" (or {change.runner_up})"
    return words


def doubt(situation: Situation) -> str:
    """Why what the drive torque shows is not sure; empty if it is."""
    return f"; {situation.diagnosis.reason}" if situation.diagnosis.reason else ""


def words_for(situation: Situation) -> CauseWords:
    """Words for causes, with the parameters and the speed of a situation."""
    speed = situation.explained.speed_radps if situation.explained else situation.cadence_rpm * math.pi / 30.0
    return CauseWords(situation.crank, situation.drive_torque, speed, situation.diagnosis)


def _named_cause(change: Change, situation: Situation) -> NamedCause:
    """A lag, which the diagnosis finds at one cadence, as the angle that it cannot be distinguished from."""
    speed = situation.cadence_rpm * math.pi / 30.0
    if change.cause is not Cause.LAG or not abs(speed) > 0.0:
        return change
    return NamedCause(Cause.TIMING, -change.value * speed, change.sigma * abs(speed))


def _in_words(situation: Situation) -> str:
    """What explains the torque mismatch; empty where nothing does yet."""
    return words_for(situation).explanation(situation.explained) if situation.explained else ""


def _evidence(one: NamedCause) -> Evidence:
    """The value of a cause; a cause has no limit."""
    name, unit = EVIDENCE[one.cause]
    return Evidence(f"{name} {one.subject}".rstrip(), one.value, math.nan, unit)


# Conditions on clearances: those that the forecast believes, and those that measurements show.


CONFIRMED_CYCLES = 20  # gait cycles of a new part; another leg is found in fewer


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
    """Alarms of clearances that are at their limit as counted or as measured.

    The forecast is valid only if it has the joint at its limit as well: not beside a measurement that it does
    not use, or believes in part only, nor beside an alarm that is only latched.
    """
    alarms = (alarm for alarm in situation.alarms if alarm.kind == "clearance" and alarm.cause not in SEEN)
    hits = [hit_of(alarm, situation) for alarm in alarms if alarm.level is Level.ERROR]
    below = {each.joint for each in situation.joints if not _forecast_m(each) >= each.limit_m}  # NaN, too
    return [attrs.evolve(hit, not_valid=(Figure.FORECAST,)) if hit.joint in below else hit for hit in hits]


def _forecast_m(each: JointSituation) -> float:
    """What the forecast takes for a joint's clearance; by counting alone, it only follows a minute later."""
    return each.believed_m if each.is_used or each.is_measurement_used else each.counted_m


def seen_at_limit(situation: Situation) -> Sequence[Hit]:
    """Joints whose clearance is surely at its limit by what encoders or the drive torque show, or showed.

    What they showed stays until somebody acknowledges it, or a measurement contradicts it.
    """
    found = ((each, situation.alarm_of(each.joint)) for each in situation.joints)
    estimates = ((each, alarm, at_limit_by_estimate(each, alarm)) for each, alarm in found)
    return [_seen_hit(each, alarm, seen, situation) for each, alarm, seen in estimates if seen is not None]


def _seen_hit(each: JointSituation, alarm: Alarm | None, seen: KnownClearance, situation: Situation) -> Hit:
    """A joint at its limit by an estimate: by the present one, or by the one that the alarm keeps."""
    raised_ns = alarm.raised_ns if alarm is not None and alarm.level is Level.ERROR else 0
    is_present = seen in each.seen
    seen_to = ", acknowledged" if alarm is not None and alarm.acknowledged else ""
    past = "" if is_present else f" (since {time_words(raised_ns)}{seen_to}; not shown now)"
    if each.measured is not None:
        past += f"; {each.measured.words} was measured"
    return Hit(
        words={
            "joint": situation.joint_words(each.joint),
            "by": SOURCES[seen.by],
            "value": seen.words,
            "limit": amount(each.limit_m, "m"),
            "past": past,
            "doubt": doubt(situation) if seen.by == "torque" and is_present else "",
        },
        joint=each.joint,
        since_ns=raised_ns,
        evidence=known_evidence(f"clearance {each.joint} by {seen.by}", seen, each.limit_m),
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
    is_as_counted = situation.diagnosis.state is DiagnosisState.AS_COUNTED
    return bool(each.seen) and (is_as_counted or each.is_used)


def departing(situation: Situation) -> Sequence[Hit]:
    """Joints whose clearance by encoders differs from the counted one; the forecast may use it."""
    used = {each.joint for each in situation.joints if each.is_used}
    return [
        hit if hit.joint in used else attrs.evolve(hit, not_valid=(Figure.FORECAST,))
        for hit in raised("clearance_departure", least=Level.ERROR)(situation)
    ]


def diagnosed(situation: Situation) -> Sequence[Hit]:
    """Clearances that have changed by the drive torque, and that are not corrected."""
    found = [change for change in changes(situation) if change.cause is Cause.CLEARANCE]
    return [_clearance_hit(change, situation, doubt(situation)) for change in found]


def corrected(situation: Situation) -> Sequence[Hit]:
    """Changes by which counted clearances were corrected."""
    found = (change for change in situation.diagnosis.changes if change.is_corrected)
    return [_clearance_hit(change, situation) for change in found]


def _clearance_hit(change: Change, situation: Situation, addition: str = "") -> Hit:
    """A changed clearance in words, with an addition and with what somebody measured at that joint."""
    own = (each.measured for each in situation.joints if each.joint == change.subject)
    measured = next(own, None)
    if measured is not None and measured.words not in addition:
        addition += f"; {measured.words} was measured"
    return Hit(
        words={"change": f"{words_of(change, situation)}{addition}"},
        joint=change.subject,
        since_ns=change.since_ns,
        evidence=(Evidence(f"clearance {change.subject} by torque", change.value, math.nan, "m"),),
    )


# Conditions on the inputs: crank, drive torque, further encoders, cadence.


def all_counted(situation: Situation) -> Sequence[Hit]:
    """The ledger already contained the wear of all samples."""
    return [Hit()] if situation.is_all_counted else []


def without_zero(situation: Situation) -> Sequence[Hit]:
    """The zero of the crank's encoder is not known."""
    return _with_cause(situation.without_zero)


def unfollowed(situation: Situation) -> Sequence[Hit]:
    """The crank is not followed."""
    return _with_cause(situation.unfollowed)


def doubtful(situation: Situation) -> Sequence[Hit]:
    """The last gait cycle is unlikely to be one of this leg."""
    return _with_cause("; ".join(situation.doubts))


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
        is_effort = situation.drive_torque.source == "effort"
        return f"there is no drive torque{': the effort of the crank is empty or NaN' if is_effort else ''}"
    stuck = [each for each in situation.alarms if each.kind == "input_torque" and each.present is Level.ERROR]
    return "the drive torque is stuck or saturated" if stuck else ""


def not_compared(situation: Situation) -> Sequence[Hit]:
    """There is a drive torque, but not yet enough of it to be compared, or to raise the mismatch."""
    if not situation.has_torque or not situation.has_cycle:
        return []
    for alarm in situation.alarms:
        if alarm.kind == "torque_mismatch" and alarm.level is Level.OK and alarm.beyond[1]:
            hit = hit_of(alarm, situation)
            causes = ": {value} of the predicted RMS is not explained (limit {limit})".format(**hit.words)
            return [attrs.evolve(hit, words={"causes": causes})]
    is_known = not math.isnan(situation.mismatch) or not situation.unobserved
    return [] if is_known else [Hit(words={"causes": ""})]


def not_observed(situation: Situation) -> Sequence[Hit]:
    """The diagnosis does not show some joints yet, or not at all, and no encoder does.

    The mismatch of the torque shows broken hip and knee joints, but not those of the foot
    (monitor.md), so a leg without a mismatch is not known to be healthy. A diagnosis that is off is the
    choice of somebody, and does not raise this.
    """
    found = situation.diagnosis
    if found.state not in (DiagnosisState.WAITING, DiagnosisState.AS_COUNTED):
        return []
    blind = [each.joint for each in situation.joints if not each.seen]
    if not blind or not situation.has_cycle or not situation.has_torque:
        return []
    cause = f": {found.reason}" if found.reason else ""
    then = ""
    if found.next_step or found.state is DiagnosisState.WAITING:
        cause = f" yet{cause}"
        upcoming = f": {found.next_step}" if found.next_step else ""
        then = f"let the leg walk on at a steady cadence{upcoming}; until then, "
    unused = tuple(
        Evidence(f"cycles not used: {reason}", float(number), math.nan, "")
        for reason, number in found.cycles_not_used.items()
    )
    joints = ", ".join(map(situation.joint_words, blind))
    return [Hit(words={"joints": joints, "causes": cause, "then": then}, evidence=unused)]


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
    evidence = (
        Evidence("cadence_rpm", situation.cadence_rpm, math.nan, "rpm"),
        Evidence("commanded_cadence_rpm", situation.commanded_rpm, math.nan, "rpm"),
        *(each for alarm in alarms for each in alarm.evidence),
    )
    return [Hit(words=words, since_ns=alarms[0].since_ns if alarms else 0, evidence=evidence)]


def encoder_faults(situation: Situation) -> Sequence[Hit]:
    """A further encoder gives nothing that can be used."""
    return [Hit(words={"cause": fault}) for fault in situation.encoder_faults]


_LEAST_REST = 0.01  # of the drive torque: below it, noise and tolerances of the leg decide


def nothing_found(situation: Situation) -> Sequence[Hit]:
    """Always holds; it counts where no other rule does."""
    observed = "the encoders show the counted clearances"
    evidence: tuple[Evidence, ...] = ()
    if situation.has_torque and not math.isnan(situation.mismatch):
        limit = situation.mismatch_limit
        evidence = (Evidence("torque_mismatch", situation.mismatch, limit, ""),)
        rest = f"{100.0 * situation.mismatch:.2g} %" if situation.mismatch >= _LEAST_REST else "less than 1 %"
        observed = (
            f"the drive torque agrees with the counted leg: {rest} of its RMS is not explained "
            f"(limit {100.0 * limit:.3g} %)"
        )
        observed += _compared(situation.diagnosis)
    return [Hit(words={"observed": observed}, evidence=evidence)]


def _compared(found: Diagnosis) -> str:
    """What the torque shows of the clearances of a healthy leg, and what comes next; empty if nothing."""
    if found.state is DiagnosisState.OFF and found.reason:
        return f"; the torque is not compared with wider joints: {found.reason}"
    known = [each for each in found.sigma_m if not math.isnan(each)]
    shown = [f"{found.cycles} gait cycles show clearances to ± {amount(max(known), 'm')}"] if known else []
    return "".join(f"; {each}" for each in (*shown, found.next_step) if each)


def _with_cause(cause: str) -> Sequence[Hit]:
    """A hit with a cause in words; none where there are no words."""
    return [Hit(words={"cause": cause})] if cause else []


# Conditions on loads beyond the limits of a joint's material, where its wear coefficient does not hold.


def outside_limits(situation: Situation) -> Sequence[Hit]:
    """Joints that are, or were, loaded beyond a limit of their material, with each value beyond its limit."""
    joints = {each.joint: each for each in situation.joints}
    return [
        _material_hit(hit, joints.get(hit.joint))
        for hit in raised("material_limit", least=Level.ERROR)(situation)
    ]


def _material_hit(hit: Hit, joint: JointSituation | None) -> Hit:
    load = joint.load if joint else None
    beyond = load.excesses if load else ()
    outside = load.outside_limits if load else None
    if outside is None:  # now within them
        outside = f"{hit.words['value']} times a limit of its material{hit.words['past']}"
    evidence = (Evidence(f"{each.name} {hit.joint}", each.value, each.limit, each.unit) for each in beyond)
    words = {**hit.words, "outside": outside}
    return attrs.evolve(hit, words=words, evidence=(*hit.evidence, *evidence))

"""The verdict of a situation by all rules: the most severe rule that applies decides, the first of equals.

A rule is a row of config/verdict.yaml and a condition: the cases in a situation for which it holds.
docs/reference/monitor.md lists the rules; a test compares the two.
"""

import math
from collections.abc import Callable, Mapping, Sequence

import attrs

from leg_wear_monitor.estimate.cause import Cause, Change, NamedCause, TorqueExplanation
from leg_wear_monitor.monitor import alarms
from leg_wear_monitor.monitor.alarm_specs import INPUT_KINDS, KINDS, QUANTITIES, SILENCE
from leg_wear_monitor.monitor.alarms import (
    ADVICE,
    CAUSES_OF_ALARMS,
    Alarm,
    amount,
    joint_of,
    time_words,
)
from leg_wear_monitor.monitor.diagnosis.state import Diagnosis, DiagnosisState
from leg_wear_monitor.monitor.input_health import INPUT_FAULTS
from leg_wear_monitor.monitor.verdict.situation import (
    ACTS,
    BOTH,
    MEASURED,
    SEEN,
    SOURCES,
    JointSituation,
    Situation,
    at_limit_by_estimate,
)
from leg_wear_monitor.monitor.verdict.verdict import (
    ALARM,
    NO_GAIT_CYCLE,
    NONE,
    Rule,
    estimate,
    rules,
    words_of_cause,
)
from leg_wear_monitor.state import Evidence, Figure, Level, State, Verdict
from leg_wear_monitor.twin import KINDS as SAMPLE_KINDS
from leg_wear_monitor.twin import TORQUE

# Causes of a deviating drive torque in words: one sentence and one remedy per cause.


# grease is stiff in the cold, and a warm motor has less torque
_WITH_TEMPERATURE = (Cause.FRICTION, Cause.LOAD_FRICTION, Cause.SCALE)
_MOST = 3  # alternatives in words


def sentence(one: NamedCause, found: Diagnosis | None = None) -> str:
    """A cause other than a clearance, with its value; with the temperatures of a diagnosis if they matter.

    Parameters
    ----------
    one : NamedCause
    found : Diagnosis, optional
        Gives the temperature of the drive now, and when the leg was commissioned.
    """
    row = words_of_cause(one.cause)
    words = row.why.format(
        value=estimate(one.value, one.sigma, row.unit),
        size=estimate(abs(one.value), one.sigma, row.unit),
        percent=estimate(100.0 * abs(one.value), 100.0 * one.sigma, "%"),
        subject=one.subject,
        way=row.ways[one.value > 0.0],
    )
    if isinstance(one, Change) and one.cause is Cause.NOISE:
        words += f" instead of {amount(one.counted, row.unit)}"
    if found is None or one.cause not in _WITH_TEMPERATURE:
        return words
    now, then = found.temperature_c, found.commissioned_c
    if now is None or then is None:
        return words
    return f"{words} (the drive is at {now:.0f} °C, and was at {then:.0f} °C then)"


def remedy(one: NamedCause) -> str:
    """Action of the operator for a cause."""
    return words_of_cause(one.cause).do.format(subject=one.subject)


def evidence_of(one: NamedCause) -> Evidence:
    """The value of a cause; a cause has no limit."""
    row = words_of_cause(one.cause)
    return Evidence(f"{row.name} {one.subject}".rstrip(), one.value, math.nan, row.unit)


def explanation(explained: TorqueExplanation, found: Diagnosis | None = None) -> str:
    """Alternatives that explain a torque residual, with their values and the unexplained rest."""
    rest = estimate(explained.after, explained.after_sigma, "")
    left = f"{rest} of the predicted RMS stays unexplained: the mechanism or a clearance may have changed"
    if not explained.alternatives:
        return f"no single fault of a sensor, no load and no mass explains the difference; {left}"
    words = ", or ".join(sentence(one, found) for one in explained.alternatives[:_MOST])
    if len(explained.alternatives) > 1:
        words += " (each explains the torque equally well)"
    return words if explained.is_whole else f"{words}; {left}"


@attrs.frozen(kw_only=True)
class Hit:
    """One case for which the condition of a rule holds.

    Attributes
    ----------
    words : mapping of str to str
        Words for the braces of the rule's texts.
    joint : str
        The joint concerned, empty if it is none.
    since_ns : int
        Stamp since which it holds, 0 if it is not known.
    evidence : tuple of Evidence
    not_valid : tuple of Figure
        In addition to the rule's.
    state : State
        Where it is more severe than the rule's.
    """

    words: Mapping[str, str] = attrs.field(factory=dict)
    joint: str = ""
    since_ns: int = 0
    evidence: tuple[Evidence, ...] = ()
    not_valid: tuple[Figure, ...] = ()
    state: State = State.HEALTHY


_TORQUE = SAMPLE_KINDS[TORQUE].name

Condition = Callable[[Situation], Sequence[Hit]]


def noted(code: str) -> Condition:
    """Reports of observers for the rule of this code, one sentence each."""
    return lambda situation: [Hit(words={"cause": text}) for text in situation.notes.get(code, ())]


def has_fault(code: str) -> Condition:
    """A stream of the input has a fault of this code."""
    return lambda situation: [
        Hit(words=one.texts, since_ns=one.since_ns) for one in situation.input_faults if one.code == code
    ]


# Conditions on alarms. A latched alarm counts like a present one until an operator acknowledges it.


def raised(*kinds: str, least: Level = Level.ERROR, most: Level = Level.ERROR) -> Condition:
    """Alarms of some kinds (all if none is given) between two levels."""
    return lambda situation: _of_alarms(
        situation, lambda alarm: least <= alarm.level <= most and (not kinds or alarm.kind in kinds)
    )


def _of_alarms(situation: Situation, holds: Callable[[Alarm], bool]) -> list[Hit]:
    return [hit_of(alarm, situation) for alarm in situation.alarms if alarm.level and holds(alarm)]


def _is_of_input(alarm: Alarm) -> bool:
    """True if an alarm is a present fault of the samples."""
    return alarm.present is Level.ERROR and alarm.kind in (*INPUT_KINDS, SILENCE)


def blinding(situation: Situation) -> Sequence[Hit]:
    """Present faults of the crank's input; without torque or foot load, the model continues."""
    own = ("torque", "foot_load")
    return _of_alarms(
        situation,
        lambda alarm: _is_of_input(alarm) and alarm.subject not in own and alarm.kind != "input_torque",
    )


def of_foot_load(situation: Situation) -> Sequence[Hit]:
    """Present lack of samples of the foot load."""
    return _of_alarms(situation, lambda alarm: _is_of_input(alarm) and alarm.subject == "foot_load")


_KNOWN_BY = {MEASURED: "measured", BOTH: "estimated"}


def hit_of(alarm: Alarm, situation: Situation) -> Hit:
    """An alarm as a case of a rule: its last value if that is beyond the limit, otherwise its worst value."""
    is_present = alarm.present is alarm.level  # after a level has fallen, the value is within the limit
    is_known = is_present and not math.isnan(alarm.value)
    value, past = alarm.worst, ""
    if math.isnan(alarm.worst) or (is_known and (alarm.worst >= alarm.limit) is (alarm.value >= alarm.limit)):
        value = alarm.value
    elif is_known:  # the value is within the limit, but not by the deadband
        past = f", {amount(alarm.value, alarm.unit)} now"
    if not is_present:
        past = f" (since {time_words(alarm.raised_ns)}; now within the limit)"
    own = joint_of(alarm.name)
    noun = QUANTITIES.get(alarm.name) or QUANTITIES.get(alarm.kind) or alarm.name.replace("_", " ")
    joint = situation.joint_words(own)
    evidence = [Evidence(alarm.name, value, alarm.limit, alarm.unit)]
    each = situation.joint(own) if alarm.kind == "clearance" else None
    if each is not None and each.measured is not None and value > each.modelled_m:
        pairs = (("measured", each.measured.clearance_m), ("modelled", each.modelled_m))
        evidence += [Evidence(f"{by} clearance {own}", known_m, each.limit_m, "m") for by, known_m in pairs]
    return Hit(
        words={
            "quantity": f"{noun} of joint {joint}" if own else noun,
            "joint": joint,
            "value": amount(value, alarm.unit),
            "limit": amount(alarm.limit, alarm.unit),
            "past": past,
            "acts": "".join(f"; {text}" for text in situation.notes.get(ACTS, ())),
            "causes": f": {situation.input_causes[0]}" if situation.input_causes else "",
            "known": _KNOWN_BY.get(alarm.cause, "modelled"),
        },
        joint=own,
        since_ns=alarm.raised_ns,
        evidence=tuple(evidence),
    )


# Conditions on causes of a deviating drive torque: one code per cause.
#
# A torque residual is explained while its alarm is raised, further alarms of the torque are limits of single
# causes, and the diagnosis shows changes since the leg was commissioned.


def has_cause(code: str) -> Condition:
    """The drive torque has a cause of this code; the surest way of finding it decides."""
    return lambda situation: (
        _explained(code, situation) or _beyond_limits(code, situation) or _diagnosed(code, situation)
    )


def _explained(code: str, situation: Situation) -> list[Hit]:
    """An explained torque residual whose cause has this code."""
    explained = situation.explained
    named = explained.named if explained else None
    if explained is None or named is None or named.cause.fault_code != code:
        return []
    alarms = raised("torque_mismatch", least=Level.WARN)(situation)
    return [
        Hit(
            words={
                "causes": f": {explanation(explained, situation.diagnosis)}",
                "remedy": remedy(named),
            },
            since_ns=alarms[0].since_ns if alarms else 0,
            evidence=(evidence_of(named),),
            state=State.INSPECT,
        )
    ]


def _beyond_limits(code: str, situation: Situation) -> list[Hit]:
    """Alarms of a bias, a drift or a lag beyond its bounds."""
    kinds = [kind for kind, cause in CAUSES_OF_ALARMS.items() if cause.fault_code == code]
    hits = []
    for hit in raised(*kinds)(situation) if kinds else ():
        alarm = hit.evidence[0].name  # the evidence of a raised alarm is its value, under its name
        cause = situation.torque_causes.get(alarm)
        words = ": the {quantity} is {value} (limit {limit}){past}".format(**hit.words)
        words += f"; {sentence(cause, situation.diagnosis)}" if cause else ""
        do = remedy(cause) if cause else words_of_cause(CAUSES_OF_ALARMS[alarm]).do
        hits.append(attrs.evolve(hit, words={"causes": words, "remedy": do}, state=State.INSPECT))
    return hits


def _diagnosed(code: str, situation: Situation) -> list[Hit]:
    """Significant changes that the diagnosis shows, other than of a clearance."""
    return [
        Hit(
            words={"causes": f": {words_of(change, situation)}{doubt(situation)}", "remedy": remedy(change)},
            since_ns=change.since_ns,
            evidence=(evidence_of(change),),
        )
        for change in changes(situation)
        if change.cause.fault_code == code
    ]


def load_not_observed(situation: Situation) -> Sequence[Hit]:
    """The drive torque does not fit the model on the ground, and the force of the ground is not known."""
    is_unknown = situation.diagnosis.is_load_unknown
    return raised("torque_mismatch")(situation) if is_unknown else []


def mismatch(situation: Situation) -> Sequence[Hit]:
    """The drive torque does not fit the model; with its possible causes."""
    if situation.diagnosis.is_load_unknown:  # a different ground explains as much as a joint
        return []
    possible = [sentence(cause, situation.diagnosis) for cause in situation.torque_causes.values()]
    possible += [words_of(change, situation) for change in changes(situation)]
    causes = f"; possible cause: {'; '.join(possible)}" if possible else ""
    if situation.explained is not None:
        causes = f"; {explanation(situation.explained, situation.diagnosis)}{causes}"
    found = raised("torque_mismatch")(situation)
    return [attrs.evolve(hit, words={**hit.words, "causes": causes}) for hit in found]


def changes(situation: Situation) -> tuple[Change, ...]:
    """Changes that the drive torque shows; empty without an estimator."""
    if situation.diagnosis.state is not DiagnosisState.CHANGED:
        return ()
    return tuple(change for change in situation.diagnosis.changes if not change.is_corrected)


def words_of(change: Change, situation: Situation) -> str:
    """Text for a change, such as ``clearance of 0.62 mm in joint G instead of the modelled 0.3 mm``."""
    if change.cause is Cause.CLEARANCE:
        opened = estimate(change.value - change.counted, change.sigma, "m")
        value, modelled = amount(change.value, "m"), amount(change.counted, "m")
        joint = situation.joint_words(change.subject)
        words = f"clearance of {value} in joint {joint} instead of the modelled {modelled} (change {opened})"
        if change.value < change.counted:
            words += "; this is less than before: if the part was replaced, reset the joint"
    elif change.cause is Cause.SEVERAL:
        names = [situation.joint_words(one.subject) for one in change.joints]
        sizes = [estimate(one.value, one.sigma, "m") for one in change.joints]
        joints = map(" ".join, zip(names, sizes, strict=True))
        words = f"change in several joints: {' and '.join(joints)}"
    else:
        words = sentence(change, situation.diagnosis)
    return f"{words} (or {change.runner_up})" if change.runner_up and not change.is_named else words


def doubt(situation: Situation) -> str:
    """The reason why the diagnosis is not sure; empty if it is sure."""
    return f"; {situation.diagnosis.reason}" if situation.diagnosis.reason else ""


# Conditions on clearances: best estimates of the forecast, and estimates by sensors.


CONFIRMED_CYCLES = 20  # gait cycles of a new part; a different leg is found in fewer


def estimated_at_limit(situation: Situation) -> Sequence[Hit]:
    """Joints whose best estimate in the forecast, measurements included, is at its limit."""
    return [
        Hit(
            words={
                "joint": situation.joint_words(each.joint),
                "value": amount(each.best_estimate_m, "m"),
                "limit": amount(each.limit_m, "m"),
            },
            joint=each.joint,
            evidence=(Evidence(f"best estimate {each.joint}", each.best_estimate_m, each.limit_m, "m"),),
        )
        for each in situation.joints
        if each.best_estimate_m >= each.limit_m
    ]


def modelled_at_limit(situation: Situation) -> Sequence[Hit]:
    """Alarms of modelled or measured clearances at their limit.

    The forecast is valid only if it has the joint at its limit as well: not with a measurement that it does
    not use, or uses only in part, and not with an alarm that is only latched.
    """
    hits = _of_alarms(
        situation,
        lambda alarm: alarm.kind == "clearance" and alarm.level is Level.ERROR and alarm.cause not in SEEN,
    )
    below = {each.joint for each in situation.joints if not _forecast_m(each) >= each.limit_m}  # NaN, too
    return [attrs.evolve(hit, not_valid=(Figure.FORECAST,)) if hit.joint in below else hit for hit in hits]


def _forecast_m(each: JointSituation) -> float:
    """Clearance of a joint in the forecast; without measurements, the modelled clearance a minute later."""
    return each.best_estimate_m if each.is_used or each.is_measurement_used else each.modelled_m


def detected_at_limit(situation: Situation) -> Sequence[Hit]:
    """Joints whose clearance estimate by encoders or the drive torque is or was surely at the limit.

    The estimate stays until an operator acknowledges it, or a measurement contradicts it.
    """
    hits, alarms = [], {one.subject: one for one in situation.alarms if one.kind == "clearance"}
    for each in situation.joints:
        alarm = alarms.get(each.joint)
        seen = at_limit_by_estimate(each, alarm)
        if seen is None:
            continue
        raised_ns = alarm.raised_ns if alarm is not None and alarm.level is Level.ERROR else 0
        if seen.by == "torque" and not situation.is_trusted(_TORQUE, raised_ns):
            continue
        past, unsure = doubt(situation) if seen.by == "torque" else "", ""
        if seen not in each.seen:
            past = f" (since {time_words(raised_ns)}; no estimate is available now)"
        if each.measured is not None:
            unsure = f"; {each.measured.words} was measured"
        words = {
            "joint": situation.joint_words(each.joint),
            "by": SOURCES[seen.by],
            "value": seen.words,
            "limit": amount(each.limit_m, "m"),
            "past": past + unsure,
        }
        evidence = Evidence(f"clearance {each.joint} by {seen.by}", seen.clearance_m, each.limit_m, "m")
        hits.append(Hit(words=words, joint=each.joint, since_ns=raised_ns, evidence=(evidence,)))
    return hits


def replaced(situation: Situation) -> Sequence[Hit]:
    """Joints with a new part whose repair neither gait cycles nor sensors have confirmed yet."""
    is_as_modelled = situation.diagnosis.state is DiagnosisState.AS_MODELLED
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
        if each.replaced_ns
        and each.part_cycles < CONFIRMED_CYCLES
        and not (each.seen and (is_as_modelled or each.is_used))
    ]


def departing(situation: Situation) -> Sequence[Hit]:
    """Joints whose clearance from encoders differs from the modelled clearance; the forecast may use it."""
    used = {each.joint for each in situation.joints if each.is_used}
    return [
        hit if hit.joint in used else attrs.evolve(hit, not_valid=(Figure.FORECAST,))
        for hit in raised("clearance_departure")(situation)
    ]


def diagnosed(situation: Situation) -> Sequence[Hit]:
    """Clearances that changed according to the drive torque, without a correction."""
    found = [one for one in changes(situation) if one.cause in (Cause.CLEARANCE, Cause.SEVERAL)]
    return [hit for change in found for hit in _clearance_hits(change, situation, doubt(situation))]


def corrected(situation: Situation) -> Sequence[Hit]:
    """Changes that corrected modelled clearances."""
    found = (change for change in situation.diagnosis.changes if change.is_corrected)
    return [hit for change in found for hit in _clearance_hits(change, situation)]


def _clearance_hits(change: Change, situation: Situation, addition: str = "") -> list[Hit]:
    """A changed clearance with the measurement of its joint, or joints that explain a change together."""
    joints: Sequence[NamedCause] = change.joints if change.cause is Cause.SEVERAL else (change,)
    own = situation.joint(change.subject)
    if own is not None and own.measured is not None and own.measured.words not in addition:
        addition += f"; {own.measured.words} was measured"
    words = {"change": f"{words_of(change, situation)}{addition}"}
    return [
        Hit(
            words=words,
            joint=one.subject,
            since_ns=change.since_ns,
            evidence=(Evidence(f"clearance {one.subject} by torque", one.value, math.nan, "m"),),
        )
        for one in joints
    ]


# Conditions on the motion and on the observation of the joints.


def no_cycle(situation: Situation) -> Sequence[Hit]:
    """No whole gait cycle was monitored in this run."""
    return [] if situation.has_cycle else [Hit()]


def other_cadence(situation: Situation) -> Sequence[Hit]:
    """The cadence is outside of its tolerance, or was outside long enough to raise its alarm."""
    notes, alarms = situation.notes.get("CADENCE", ()), raised("cadence")(situation)
    if not notes and not alarms:
        return []
    cause = notes[0] if notes else "for several gait cycles, the leg walked at a different cadence"
    since_ns, evidence = (alarms[0].since_ns, alarms[0].evidence) if alarms else (0, ())
    return [Hit(words={"cause": cause}, since_ns=since_ns, evidence=evidence)]


def no_torque(situation: Situation) -> Sequence[Hit]:
    """Neither the drive torque nor encoders show the joints.

    The state is `WATCH`: the monitor models the wear from the motion, so its alarms of clearance, growth and
    forces are valid for the model. No measurement can contradict the model, because a broken bushing does
    not change the received data. Therefore the verdict must not be healthy.
    """
    is_known = situation.has_torque or situation.input_faults
    if not situation.has_cycle or not situation.unobserved or is_known:
        return []
    return [Hit(words={"joints": situation.joints_words(situation.unobserved)})]


def not_compared(situation: Situation) -> Sequence[Hit]:
    """There is a drive torque, but too few gait cycles to compare it or to raise its alarm."""
    if not situation.has_torque or not situation.has_cycle:
        return []
    for alarm in situation.alarms:
        if alarm.kind == "torque_mismatch" and alarm.level is Level.OK and alarm.beyond[1]:
            return [hit_of(alarm, situation)]
    is_known = not math.isnan(situation.mismatch) or not situation.unobserved
    return [] if is_known else [Hit()]


def not_observed(situation: Situation) -> Sequence[Hit]:
    """The diagnosis and the encoders do not show some joints, or not yet.

    The torque residual shows broken hip and knee joints, but not broken foot joints (monitor.md), so a leg
    without a torque residual is not known to be healthy. If the user switched the diagnosis off, this does
    not hold.
    """
    found = situation.diagnosis
    blind = [each.joint for each in situation.joints if not each.seen]
    is_on = found.state in (DiagnosisState.WAITING, DiagnosisState.AS_MODELLED)
    if not is_on or not blind or not situation.has_cycle or not situation.has_torque:
        return []
    is_to_walk = found.state is DiagnosisState.WAITING or bool(found.next_step)
    reasons = [" yet"] if is_to_walk else [""]
    reasons += filter(None, (found.reason, found.next_step))
    words = {
        "joints": situation.joints_words(blind),
        "causes": "; ".join(reasons),
        "then": "let the leg walk on at a steady cadence; until then, " if is_to_walk else "",
    }
    unused = tuple(
        Evidence(f"cycles not used: {reason}", float(number), math.nan, "")
        for reason, number in found.cycles_not_used.items()
    )
    return [Hit(words=words, evidence=unused)]


_LEAST_REST = 0.01  # fraction of the drive torque: below it, noise and tolerances of the leg decide


def nothing_found(situation: Situation) -> Sequence[Hit]:
    """Always holds; it decides if no other rule holds."""
    if not situation.has_torque or math.isnan(situation.mismatch):
        words = {"observed": "the encoders agree with the modelled clearances", "advice": ADVICE}
        return [Hit(words=words)]
    rest, limit, found = situation.mismatch, situation.mismatch_limit, situation.diagnosis
    observed = [
        "the drive torque agrees with the model of this leg: "
        + (f"{100.0 * rest:.2g} %" if rest >= _LEAST_REST else "less than 1 %")
        + f" of its RMS is not explained (limit {100.0 * limit:.3g} %)"
    ]
    known = [each for each in found.sigma_m if not math.isnan(each)]
    if found.state is DiagnosisState.OFF and found.reason:
        observed.append(f"no clearance is estimated from the torque: {found.reason}")
    elif known:
        what = "clearance changes since the baseline" if found.baseline_m else "clearances"
        observed.append(f"{what} are known to ± {amount(max(known), 'm')} after {found.cycles} gait cycles")
    observed += filter(None, (found.next_step,))
    evidence = (Evidence("torque_mismatch", rest, limit, ""),)
    return [Hit(words={"observed": "; ".join(observed), "advice": ADVICE}, evidence=evidence)]


# The condition of each rule, and its finding.


_NOTED = (alarms.ALREADY_COUNTED, alarms.CRANK_ZERO, alarms.TRACKING_LOST, "NOT_THIS_LEG", "ENCODER")

CONDITIONS: Mapping[str, Condition] = {
    **{kind.upper(): raised(kind) for kind in KINDS},
    **{cause.fault_code: has_cause(cause.fault_code) for cause in Cause},
    **{code: has_fault(code) for code in INPUT_FAULTS},
    **{code: noted(code) for code in _NOTED},
    "CLEARANCE": modelled_at_limit,
    "CLEARANCE_DETECTED": detected_at_limit,
    "CLEARANCE_ESTIMATED": estimated_at_limit,
    "CLEARANCE_CHANGED": diagnosed,
    "CLEARANCE_CORRECTED": corrected,
    "CLEARANCE_DEPARTURE": departing,
    "LOAD_NOT_OBSERVED": load_not_observed,
    "TORQUE_MISMATCH": mismatch,
    "BAD_INPUT": blinding,
    NO_GAIT_CYCLE: no_cycle,
    "FOOT_LOAD_MISSING": of_foot_load,
    "PART_REPLACED": replaced,
    "NO_DRIVE_TORQUE": no_torque,
    "TORQUE_NOT_COMPARED": not_compared,
    "NOT_OBSERVED": not_observed,
    "CADENCE": other_cadence,
    "CLEARANCE_NEAR": raised("clearance", least=Level.WARN, most=Level.WARN),
    ALARM: raised(least=Level.WARN),
    NONE: nothing_found,
}
"""By the rule's code. A rule with the name of an alarm, a cause or a fault of the input needs no entry."""


def findings(situation: Situation) -> tuple[Verdict, ...]:
    """Verdicts of all rules that hold, in the order of the table; a healthy leg's verdict only alone."""
    found = []
    for code, rule in rules().items():
        hits = CONDITIONS[code](situation)
        if hits := [hit for hit in hits if situation.is_trusted(rule.rests_on, hit.since_ns)]:
            found.append(_finding(code, rule, hits, situation))
    return tuple(each for each in found if each.fault_code != NONE) or tuple(found)


def _finding(code: str, rule: Rule, hits: Sequence[Hit], situation: Situation) -> Verdict:
    """The verdict by a single rule, with all of its cases."""
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

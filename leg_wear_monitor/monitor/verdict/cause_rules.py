"""Conditions on what explains the drive torque: one code a cause, whoever finds it.

A torque mismatch is explained while its alarm is raised, further alarms of the torque are limits of single
causes, and the diagnosis shows what has changed since the leg was commissioned.
"""

import math
from collections.abc import Callable, Sequence

import attrs

from leg_wear_monitor.estimate.cause import Cause, Change, NamedCause
from leg_wear_monitor.monitor.alarms.alarm import Level
from leg_wear_monitor.monitor.alarms.fault_codes import CAUSES_OF_ALARMS
from leg_wear_monitor.monitor.diagnosis.diagnosis import DiagnosisState
from leg_wear_monitor.monitor.verdict.alarm_rules import raised
from leg_wear_monitor.monitor.verdict.cause_words import EVIDENCE, CauseWords
from leg_wear_monitor.monitor.verdict.rule import Hit
from leg_wear_monitor.monitor.verdict.situation import Situation
from leg_wear_monitor.monitor.verdict.verdict import Evidence, State
from leg_wear_monitor.monitor.verdict.words import amount, estimate

CLOSE_ODDS = 3.0  # log odds below which the runner-up is named as well: 20 to 1


def found(code: str) -> Callable[[Situation], Sequence[Hit]]:
    """The drive torque has a cause of this code; the surest way of finding it decides."""

    def hits(situation: Situation) -> Sequence[Hit]:
        return _explained(code, situation) or _beyond_limits(code, situation) or _diagnosed(code, situation)

    return hits


def _explained(code: str, situation: Situation) -> list[Hit]:
    """The torque mismatch has surely some causes, the first of them one of this code."""
    named = situation.explained.named if situation.explained else ()
    if not named or named[0].cause.fault_code != code:
        return []
    words = words_for(situation)
    told = {"causes": f": {_in_words(situation)}", "remedy": " and ".join(map(words.remedy, named))}
    alarms = raised("torque_mismatch")(situation)
    since_ns = alarms[0].since_ns if alarms else 0
    evidence = tuple(map(_evidence, named))
    return [Hit(words=told, since_ns=since_ns, evidence=evidence, state=State.INSPECT)]


def _beyond_limits(code: str, situation: Situation) -> list[Hit]:
    """Alarms of a bias, a drift or a lag beyond its bounds."""
    kinds = [kind for kind, cause in CAUSES_OF_ALARMS.items() if cause.fault_code == code]
    if not kinds:
        return []
    words, hits = words_for(situation), []
    for hit in raised(*kinds, least=Level.ERROR)(situation):
        cause = situation.torque_causes.get(hit.evidence[0].name)
        sentence = f"; {words.cause(cause)}" if cause else ""
        told = {
            "causes": ": the {quantity} is {value} (limit {limit}){past}".format(**hit.words) + sentence,
            "remedy": words.remedy(cause or NamedCause(CAUSES_OF_ALARMS[hit.evidence[0].name], 0.0, 0.0)),
        }
        hits.append(Hit(words=told, since_ns=hit.since_ns, evidence=hit.evidence, state=State.INSPECT))
    return hits


def _diagnosed(code: str, situation: Situation) -> list[Hit]:
    """Significant changes that the diagnosis shows, other than of a clearance."""
    found = [each for each in changes(situation) if each.cause.fault_code == code]
    return [
        Hit(
            words={
                "causes": f": {words_of(change, situation)}{doubt(situation)}",
                "remedy": words_for(situation).remedy(_as_told(change, situation)),
            },
            since_ns=change.since_ns,
            evidence=(_evidence(change),),
        )
        for change in found
    ]


def mismatch(situation: Situation) -> Sequence[Hit]:
    """The drive torque is not that of the counted leg; with what may cause it, as far as that is known."""
    words = words_for(situation)
    told = [*map(words.cause, situation.torque_causes.values())]
    told += [words_of(change, situation) for change in changes(situation)]
    causes = f"; possible cause: {'; '.join(told)}" if told else ""
    if situation.explained is not None:
        causes = f"; {_in_words(situation)}{causes}"
    return [
        attrs.evolve(hit, words={**hit.words, "causes": causes})
        for hit in raised("torque_mismatch")(situation)
    ]


def changes(situation: Situation) -> tuple[Change, ...]:
    """What the drive torque shows that has changed; empty without an estimator."""
    diagnosis = situation.diagnosis
    if diagnosis is None or diagnosis.state is not DiagnosisState.CHANGED:
        return ()
    return tuple(change for change in diagnosis.changes if not change.is_corrected)


def words_of(change: Change, situation: Situation) -> str:
    """A change in words, such as ``clearance of 0.62 mm ± 0.03 mm in joint G (0.3 mm is counted)``."""
    if change.cause is Cause.CLEARANCE:
        value, counted = estimate(change.value, change.sigma, "m"), amount(change.counted, "m")
        verb, joint = "was" if change.is_corrected else "is", situation.joint_words(change.subject)
        words = f"clearance of {value} in joint {joint} ({counted} {verb} counted)"
        if change.value < change.counted:
            words += ", less than before: if its part was replaced, reset the joint"
    else:
        words = words_for(situation).cause(_as_told(change, situation))
    if change.runner_up and change.runner_up_log_odds < CLOSE_ODDS:
        words += f" (or {change.runner_up})"
    return words


def doubt(situation: Situation) -> str:
    """Why what the drive torque shows is not sure; empty if it is."""
    reason = situation.diagnosis.reason if situation.diagnosis else ""
    return f"; {reason}" if reason else ""


def words_for(situation: Situation) -> CauseWords:
    """Words for causes, with the parameters and the speed of a situation."""
    speed = situation.explained.speed_radps if situation.explained else situation.cadence_rpm * math.pi / 30.0
    return CauseWords(situation.crank, situation.drive_torque, speed)


def _as_told(change: Change, situation: Situation) -> NamedCause:
    """A lag, which the diagnosis finds at one cadence, as the angle that it cannot be told from."""
    speed = situation.cadence_rpm * math.pi / 30.0
    if change.cause is not Cause.LAG or not abs(speed) > 0.0:
        return change
    return NamedCause(Cause.TIMING, -change.value * speed, change.sigma * abs(speed))


def _in_words(situation: Situation) -> str:
    return words_for(situation).explanation(situation.explained) if situation.explained else ""


def _evidence(one: NamedCause) -> Evidence:
    name, unit = EVIDENCE[one.cause]
    return Evidence(f"{name} {one.subject}".rstrip(), one.value, math.nan, unit)

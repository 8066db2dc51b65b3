"""The state of the leg, made of what the monitor holds."""

import math
from collections.abc import Mapping, Sequence

import attrs

from leg_wear_monitor.estimate.cause import Cause, NamedCause, TorqueExplanation
from leg_wear_monitor.files import finite_or_none
from leg_wear_monitor.monitor.alarm_specs import CLEARANCE
from leg_wear_monitor.monitor.alarms import Alarm, state_of
from leg_wear_monitor.monitor.diagnosis.state import Diagnosis, DiagnosisState
from leg_wear_monitor.monitor.forecast.forecast import JointForecast, LegForecast, Quantiles
from leg_wear_monitor.monitor.judgement import joint_situations
from leg_wear_monitor.monitor.parts import Parts
from leg_wear_monitor.monitor.reports import CycleReport
from leg_wear_monitor.monitor.verdict.situation import JointSituation, believed, joint_status, surest
from leg_wear_monitor.monitor.verdict.verdict import Finding, verdict_of
from leg_wear_monitor.state import (
    Drive,
    Estimate,
    Figure,
    FootLoad,
    JointClearance,
    LegAlarm,
    LegAlarms,
    LegState,
    LifeHours,
    TorqueDiagnosis,
    Verdict,
)

_FACTORS = (Cause.SCALE, Cause.SIGN)
_TURN = 2.0 * math.pi


def leg_state(parts: Parts, findings: Sequence[Finding]) -> LegState:
    """State of the leg now, with the verdict of some findings."""
    last, verdict, diagnosis = parts.state.last, verdict_of(findings), parts.diagnosis
    explained, alarms = parts.state.mismatch.explanation, parts.evaluation.board.alarms
    return LegState(
        stamp_ns=parts.twin.intake.stamp_ns,
        life_cycles=parts.accounting.state.cycles,
        verdict=verdict,
        clearances={
            joint.joint: joint_clearance(
                joint,
                alarms[CLEARANCE.name(joint.joint)],
                findings,
                parts.mechanism.clearances[joint.joint].radial_clearance,
            )
            for joint in joint_situations(parts, diagnosis)
        },
        drive=_drive(last, diagnosis, explained),
        load=_load(parts.foot_load.load if parts.foot_load else FootLoad(), diagnosis),
        diagnosis=_diagnosis(last, diagnosis, explained),
        alarms=LegAlarms(now=tuple(map(leg_alarm, alarms.values()))),
        life_answers=_answers(last),
        first_probability=last.forecast.first_probability
        if last and last.forecast and Figure.FORECAST not in verdict.not_valid
        else {},
        life=life_of({joint.joint: joint.forecast for joint in last.joints}, last.forecast, verdict)
        if last
        else {},
    )


def leg_alarm(alarm: Alarm) -> LegAlarm:
    """An alarm as operators see it."""
    return LegAlarm(
        name=alarm.name,
        level=alarm.level,
        state=state_of(alarm),
        value=alarm.value,
        limit=alarm.limit,
        unit=alarm.unit,
        worst=alarm.worst,
        raised_ns=alarm.raised_ns,
    )


def joint_clearance(
    joint: JointSituation, alarm: Alarm | None, findings: Sequence[Finding | Verdict], new_m: float
) -> JointClearance:
    """Clearance of a joint, and what findings say of it.

    Parameters
    ----------
    joint : JointSituation
    alarm : Alarm or None
        That of the joint's clearance.
    findings : sequence of Finding or Verdict
        Those of the verdict, or the verdict alone.
    new_m : float
        The clearance when new.
    """
    not_valid = {figure for finding in findings for figure in finding.not_valid}
    one = believed(joint, alarm, Figure.CLEARANCES not in not_valid)
    best = surest(joint.seen)
    return JointClearance(
        believed_m=one.clearance_m if one else None,
        believed_sigma_m=finite_or_none(one.sigma_m) if one else None,
        believed_by=one.by if one else None,
        counted_m=joint.counted_m,
        seen_m=best.clearance_m if best else None,
        seen_sigma_m=best.sigma_m if best else None,
        seen_by=(best.by,) if best else (),
        measured_m=joint.measured.clearance_m if joint.measured else None,
        measured_sigma_m=joint.measured.sigma_m if joint.measured else None,
        new_m=new_m,
        limit_m=joint.limit_m,
        status=joint_status(joint.joint, one is not None, findings),
    )


def life_of(
    joints: Mapping[str, JointForecast | None], leg: LegForecast | None, verdict: Verdict
) -> dict[str, LifeHours | None]:
    """Remaining life of each joint and of the ``leg`` by their forecasts, as far as it is believed."""
    told: dict[str, JointForecast | LegForecast | None] = {**joints, "leg": leg}
    if Figure.FORECAST in verdict.not_valid:
        return dict.fromkeys(told)
    return {name: life_hours(each.hours) if each else None for name, each in told.items()}


def _answers(last: CycleReport | None) -> dict[str, str]:
    """What the last forecast can say of each joint and of the leg."""
    if last is None:
        return {}
    told: dict[str, JointForecast | LegForecast | None] = {
        **{joint.joint: joint.forecast for joint in last.joints},
        "leg": last.forecast,
    }
    return {name: each.answer.value for name, each in told.items() if each is not None}


def life_hours(hours: Quantiles | None) -> LifeHours | None:
    """Quantiles of a remaining life; None if it is not known."""
    return None if hours is None else LifeHours(p10_h=hours.p10, p50_h=hours.p50, p90_h=hours.p90)


def _drive(last: CycleReport | None, diagnosis: Diagnosis, explained: TorqueExplanation | None) -> Drive:
    """The drive by the last gait cycle, by what explains a torque mismatch, and by the diagnosis."""
    named = explained.named if explained else ()
    factor = next((one for one in named if one.cause in _FACTORS), None)
    pole_s = diagnosis.channel.time_constant_s
    return Drive(
        scale=_estimate(factor.value, factor.sigma) if factor else None,
        lag_s=_estimate(last.torque_lag_s, last.torque_lag_sigma_s) if last else None,
        coulomb_nm=_estimate(last.friction_nm, last.friction_sigma_nm) if last else None,
        load_friction=_estimate(last.load_friction, last.load_friction_sigma) if last else None,
        bandwidth_hz=Estimate(value=1.0 / (_TURN * pole_s)) if pole_s > 0.0 else None,
        temperature_c=None if diagnosis.temperature_c is None else Estimate(value=diagnosis.temperature_c),
    )


def _estimate(value: float, sigma: float) -> Estimate | None:
    return Estimate(value=value, sigma=sigma) if math.isfinite(value) else None


def _load(measured: FootLoad, diagnosis: Diagnosis) -> FootLoad:
    """The measured load, or else the one that the drive torque shows."""
    if measured.source != "none" or diagnosis.load is None:
        return measured
    return attrs.evolve(diagnosis.load, cycles=diagnosis.cycles)


def _diagnosis(
    last: CycleReport | None, diagnosis: Diagnosis, explained: TorqueExplanation | None
) -> TorqueDiagnosis:
    cause = _cause(diagnosis, explained)
    return TorqueDiagnosis(
        state=diagnosis.state.value,
        reason=diagnosis.reason,
        cycles_used=diagnosis.cycles,
        cycles_not_used=dict(diagnosis.cycles_not_used),
        misfit=last.torque_mismatch if last else None,
        cause=cause.cause.name.lower() if cause else None,
        cause_subject=cause.subject if cause else "",
        cause_value=cause.value if cause else None,
        cause_sigma=cause.sigma if cause else None,
    )


def _cause(diagnosis: Diagnosis, explained: TorqueExplanation | None) -> NamedCause | None:
    """What explains the torque: an unsettled change of the leg, or else the one cause of a mismatch."""
    if diagnosis.state is DiagnosisState.CHANGED and diagnosis.changes:
        return diagnosis.changes[-1]
    named = explained.named if explained else ()
    return named[0] if len(named) == 1 else None

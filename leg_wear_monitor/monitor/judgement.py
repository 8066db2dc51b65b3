"""The verdict of a monitor and the state of its leg, from the wear model of this leg and its observers."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import attrs

from leg_wear_monitor.files import finite_or_none
from leg_wear_monitor.monitor import alarm_specs
from leg_wear_monitor.monitor.alarms import ALREADY_COUNTED, CRANK_ZERO, TRACKING_LOST, Alarm, state_of
from leg_wear_monitor.monitor.forecast.forecast import JointForecast, LegForecast, Quantiles
from leg_wear_monitor.monitor.gait_evidence import doubts
from leg_wear_monitor.monitor.ledger.entry import Measurement, VerdictEvent
from leg_wear_monitor.monitor.monitored_leg import MonitoredLeg
from leg_wear_monitor.monitor.reports import AlarmList, VerdictReport
from leg_wear_monitor.monitor.verdict.rules import findings
from leg_wear_monitor.monitor.verdict.situation import (
    COUNTED,
    SEEN,
    JointSituation,
    KnownClearance,
    Situation,
    at_limit_by_estimate,
    believed,
    is_observed,
    is_surely_below,
    joint_status,
    judged,
    surely_at,
    surest,
)
from leg_wear_monitor.monitor.verdict.table import NO_GAIT_CYCLE
from leg_wear_monitor.monitor.verdict.verdict import dated, has_changed, verdict_of
from leg_wear_monitor.state import (
    Figure,
    JointClearance,
    LegAlarm,
    LegAlarms,
    LegState,
    LifeHours,
    Verdict,
)
from leg_wear_monitor.twin.statistics import Tracking


def verdict_report(leg: MonitoredLeg, situation: Situation | None = None) -> VerdictReport:
    """The verdict now; the situation is made if it is not given."""
    stamp_ns = leg.twin.intake.stamp_ns
    found = findings(situation or situation_of(leg))
    return VerdictReport(stamp_ns, dated(found, leg.findings, stamp_ns))


def update_verdict(leg: MonitoredLeg, situation: Situation | None = None) -> tuple[VerdictReport, ...]:
    """The verdict if it has changed since the last call; the change is then also an event.

    To be called where the state does not depend on how the samples are cut into blocks: at the end of an
    evaluation period.
    """
    before = verdict_of(leg.findings) if leg.findings else None
    report = verdict_report(leg, situation)
    leg.findings, now = report.findings, report.verdict
    if not has_changed(before, now):
        return ()
    if before and (Figure.FORECAST in before.not_valid) != (Figure.FORECAST in now.not_valid):
        leg.forecaster.expire()
    if before or now.fault_code != NO_GAIT_CYCLE:  # a run that monitored nothing has no verdict to store
        leg.accounting.note(VerdictEvent(report.stamp_ns, now))
    return (report,)


def is_forecast_valid(leg: MonitoredLeg, found: Sequence[Verdict]) -> bool:
    """True if the leg is in the range of the model and no finding contradicts the model."""
    invalid = any(Figure.FORECAST in finding.not_valid for finding in found)
    return leg.evaluation.is_model_valid() and not invalid


def evaluate_clearances(
    leg: MonitoredLeg, joints: Sequence[JointSituation], stamp_ns: int
) -> tuple[AlarmList, ...]:
    """Compare measured and estimated clearances with their limits; no delay, as they do not scatter."""
    board, values, sources = leg.evaluation.board, {}, {}
    for joint in joints:
        name = alarm_specs.CLEARANCE.name(joint.joint)
        known = _alarm_value(joint, board.alarms[name])
        if known is not None:
            values[name], sources[name] = known.clearance_m, (known.sigma_m, known.by)
    cycles = leg.config.alarms.on_delay_cycles
    return board.evaluate(values, stamp_ns, cycles, sources) if values else ()


def _alarm_value(joint: JointSituation, alarm: Alarm) -> KnownClearance | None:
    """The clearance that its alarm is evaluated with at the end of a period; None to leave it as it is.

    A modelled clearance is evaluated once per gait cycle, unless a different source keeps the alarm present.
    """
    known, sure, shown = judged(joint), surely_at(joint.limit_m, joint.seen), surest(joint.seen)
    if sure is not None and sure.clearance_m > known.clearance_m:
        return sure
    # only the torque clears an estimate of the torque: a new run shows nothing for a while
    is_back = shown is not None and _takes_back(shown, joint.limit_m)
    if is_observed(alarm, SEEN) and known.clearance_m < joint.limit_m and not is_back:
        return None
    return None if known.by == COUNTED and not is_observed(alarm) else known


def _takes_back(shown: KnownClearance, limit_m: float) -> bool:
    """True if an estimate below a limit is sure, or has lasted as long as an estimate above it must."""
    is_below = shown.clearance_m < limit_m and math.isfinite(shown.least_m)
    return is_below or is_surely_below(limit_m, shown)


def shown(leg: MonitoredLeg, joint: JointSituation) -> KnownClearance | None:
    """Best estimate of a joint by encoders or the drive torque, now or when its alarm was raised."""
    alarm = leg.evaluation.board.alarms[alarm_specs.CLEARANCE.name(joint.joint)]
    return at_limit_by_estimate(joint, alarm) or surest(joint.seen)


def situation_of(leg: MonitoredLeg) -> Situation:
    """Inputs of the verdict, at the end of an evaluation period."""
    evaluation, config = leg.evaluation, leg.config
    last, torque = leg.last, leg.torque
    alarms, explained = evaluation.board.alarms, torque.explained
    return Situation(
        joints=_joint_situations(leg),
        alarms=tuple(alarms.values()),
        has_cycle=last is not None,
        # the torque of a refused gait cycle has come, and is not compared
        has_torque=last is not None and (last.torque_samples > 0 or leg.judge.state.was_refused),
        mismatch=last.torque_mismatch if last else math.nan,
        mismatch_limit=config.limits.torque_mismatch,
        torque_causes=torque.causes,
        notes=_notes(leg),
        input_causes=tuple(evaluation.causes),
        input_faults=leg.judge.faults,
        trusted_before_ns=leg.judge.trusted_before_ns,
        diagnosis=torque.diagnosis,
        explained=explained if evaluation.board.level(alarm_specs.MISMATCH.name()) else None,
    )


def _joint_situations(leg: MonitoredLeg) -> tuple[JointSituation, ...]:
    """Present knowledge of each joint's clearance."""
    estimates = leg.encoders.estimates if leg.encoders else None
    diagnosis = leg.torque.diagnosis
    last, measured, joints = leg.last, leg.measured, leg.clearance_joints
    modelled_m, limits_m = leg.twin.clearance_mean_m.tolist(), leg.evaluation.board.clearance_limits_m
    walked, seen, found = leg.accounting, leg.seen, []
    for k, (joint, part) in enumerate(zip(joints, walked.parts, strict=True)):
        report = last.joints[k] if last else None
        by_torque = next((each.sigma_m for each in seen[k] if each.by == "torque"), None)
        one = JointSituation(
            joint=joint,
            modelled_m=modelled_m[k],
            limit_m=limits_m[k],
            best_estimate_m=(
                report.forecast.now_m
                if report and report.forecast
                else leg.forecaster.best_estimate_m(k, modelled_m[k])
            ),
            seen=seen[k],
            change=diagnosis.change_of_joint(k),
            sigma_m=diagnosis.tolerance_of_joint(k) if by_torque is None else by_torque,
            is_used=bool(estimates and estimates[k].believed),
            label=leg.mechanism.joints[joint].label,
            replaced_ns=part.replaced_ns,
            part_cycles=walked.cycles - part.cycles,
        )
        found.append(with_measured(one, measured[k]))
    return tuple(found)


def with_measured(joint: JointSituation, measured: Measurement | None) -> JointSituation:
    """A joint with the last measurement of its part."""
    if measured is None:
        return joint
    by = KnownClearance("measured", measured.clearance_m, measured.sigma_m)
    return attrs.evolve(joint, measured=by, is_measurement_used=measured.counts)


def _notes(leg: MonitoredLeg) -> dict[str, Sequence[str]]:
    """Notes of the monitor and its observers for rules of the verdict, by the rule's code."""
    unfollowed = _unfollowed(leg)
    notes: dict[str, Sequence[str]] = {
        ALREADY_COUNTED: ("",) if leg.accounting.is_all_counted else (),
        TRACKING_LOST: (unfollowed,) if unfollowed else (),
        "NOT_THIS_LEG": _doubts(leg),
        "CADENCE": _other_cadence(leg),
    }
    for each in leg.observers:
        notes |= each.notes
    if leg.guard.cause:
        notes.pop(CRANK_ZERO, None)  # it cannot be found without valid samples
    return notes


def _other_cadence(leg: MonitoredLeg) -> tuple[str, ...]:
    """Note that the leg walks at a wrong cadence: not if it only starts or stops, after a right one."""
    last, cadence = leg.last, leg.config.cadence
    was_right = last is not None and cadence.allows(last.cadence_rpm)
    if leg.twin.tracking is not Tracking.OUT_OF_STEP or was_right:
        return ()
    rpm, commanded = leg.twin.speed_radps * 30.0 / math.pi, cadence.commanded_rpm
    return (f"it walks at {rpm:.3g} rpm. Expected {commanded:g} ± {cadence.tolerance_rpm:g} rpm",)


def _doubts(leg: MonitoredLeg) -> tuple[str, ...]:
    """Reason why the last gait cycle does not fit this leg; an explained torque is not a reason."""
    last = leg.last
    if last is None:
        return ()
    if leg.torque.has_input_fault or leg.judge.faults:
        last = attrs.evolve(last, torque_samples=0)
    found = doubts(last, leg.config)
    return ("; ".join(found),) if found else ()


def _unfollowed(leg: MonitoredLeg) -> str:
    """Why the crank is not tracked; a loss shorter than a commanded gait cycle is reported by its alarm."""
    if leg.guard.cause:
        return leg.guard.cause
    out_s, cycle_s = leg.twin.intake.out_s, 60.0 / abs(leg.config.cadence.commanded_rpm)
    return f"the crank has not been tracked for {out_s:.3g} s" if out_s >= cycle_s else ""


# The state of the leg, from the data in the monitor.


def leg_state(leg: MonitoredLeg, findings: Sequence[Verdict], situation: Situation) -> LegState:
    """State of the leg now, with the verdict of some findings."""
    last, verdict, alarms = leg.last, verdict_of(findings), leg.evaluation.board.alarms
    observed = {name: field for each in leg.observers for name, field in each.leg_fields.items()}
    return LegState(
        stamp_ns=leg.twin.intake.stamp_ns,
        life_cycles=leg.accounting.cycles,
        verdict=verdict,
        clearances={
            joint.joint: joint_clearance(
                joint,
                alarms[alarm_specs.CLEARANCE.name(joint.joint)],
                findings,
                leg.mechanism.clearances[joint.joint].radial_clearance,
            )
            for joint in situation.joints
        },
        alarms=LegAlarms(now=tuple(map(leg_alarm, alarms.values()))),
        **observed,
        **(life_of({one.joint: one.forecast for one in last.joints}, last.forecast, verdict) if last else {}),
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
    joint: JointSituation, alarm: Alarm | None, findings: Sequence[Verdict], new_m: float
) -> JointClearance:
    """Clearance of a joint, and its state by the findings.

    Parameters
    ----------
    joint : JointSituation
    alarm : Alarm or None
        Alarm of the joint's clearance.
    findings : sequence of Verdict
        Findings of the rules, or the verdict alone.
    new_m : float
        The clearance when new.
    """
    not_valid = {figure for finding in findings for figure in finding.not_valid}
    one = believed(joint, alarm, Figure.CLEARANCES not in not_valid)
    if one is not None and one.by == COUNTED:
        one = attrs.evolve(one, sigma_m=joint.sigma_m)
    best = surest(joint.seen)
    return JointClearance(
        best_estimate_m=one.clearance_m if one else None,
        best_estimate_sigma_m=finite_or_none(one.sigma_m) if one else None,
        best_estimate_source=one.by if one else None,
        modelled_m=joint.modelled_m,
        estimated_m=best.clearance_m if best else None,
        estimated_sigma_m=best.sigma_m if best else None,
        change_m=joint.change[0] if joint.change else None,
        change_sigma_m=joint.change[1] if joint.change else None,
        estimated_by=(best.by,) if best else (),
        measured_m=joint.measured.clearance_m if joint.measured else None,
        measured_sigma_m=joint.measured.sigma_m if joint.measured else None,
        new_m=new_m,
        limit_m=joint.limit_m,
        status=joint_status(joint.joint, one is not None, findings),
    )


def life_of(
    joints: Mapping[str, JointForecast | None], leg: LegForecast | None, verdict: Verdict
) -> dict[str, Any]:
    """Remaining life of each joint and of the ``leg`` in a `LegState`, as far as it is valid."""
    forecasts: dict[str, JointForecast | LegForecast | None] = {**joints, "leg": leg}
    is_valid = Figure.FORECAST not in verdict.not_valid
    return {
        "life": {
            name: life_hours(each.hours) if each and is_valid else None for name, each in forecasts.items()
        },
        "life_answers": {name: each.answer.value for name, each in forecasts.items() if each},
        "first_probability": leg.first_probability if leg and is_valid else {},
    }


def life_hours(hours: Quantiles | None) -> LifeHours | None:
    """Quantiles of a remaining life; None if it is not known."""
    return None if hours is None else LifeHours(p10_h=hours.p10, p50_h=hours.p50, p90_h=hours.p90)

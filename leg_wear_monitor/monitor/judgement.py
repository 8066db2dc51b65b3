"""The verdict of a monitor: what it depends on, collected from the monitor's parts, and its changes."""

import math
from collections.abc import Sequence

import attrs

from leg_wear_monitor.monitor import alarm_specs
from leg_wear_monitor.monitor.diagnosis.state import Diagnosis
from leg_wear_monitor.monitor.encoders import faults
from leg_wear_monitor.monitor.gait_evidence import doubts
from leg_wear_monitor.monitor.ledger.entry import Measurement, VerdictEvent
from leg_wear_monitor.monitor.parts import Parts
from leg_wear_monitor.monitor.reports import AlarmList, VerdictReport, shown_by_torque
from leg_wear_monitor.monitor.verdict.rules import findings
from leg_wear_monitor.monitor.verdict.situation import (
    JointSituation,
    KnownClearance,
    Situation,
    alarm_value,
    at_limit_by_estimate,
    surest,
    with_sampling,
)
from leg_wear_monitor.monitor.verdict.verdict import NO_GAIT_CYCLE, Finding, dated, has_changed, verdict_of
from leg_wear_monitor.state import Figure
from leg_wear_monitor.twin.statistics import Tracking


def verdict_report(parts: Parts) -> VerdictReport:
    """The verdict now."""
    stamp_ns, sampling = parts.twin.intake.stamp_ns, parts.twin.sampling
    found = findings(situation_of(parts))
    if sampling:
        found = with_sampling(found, sampling, parts.clearance_joints, parts.accounting.sampling_sigma_m)
    return VerdictReport(stamp_ns, dated(found, parts.state.findings, stamp_ns))


def update_verdict(parts: Parts) -> tuple[VerdictReport, ...]:
    """The verdict if it has changed since the last call; it is then an event, too.

    To be called where the state does not depend on how the samples are cut into blocks: at the end of an
    evaluation period.
    """
    before = verdict_of(parts.state.findings) if parts.state.findings else None
    report = verdict_report(parts)
    parts.state.findings, now = report.findings, report.verdict
    if not has_changed(before, now):
        return ()
    if before and (Figure.FORECAST in before.not_valid) != (Figure.FORECAST in now.not_valid):
        parts.forecaster.expire()
    if before or now.fault_code != NO_GAIT_CYCLE:  # a run that monitored nothing has no verdict to store
        parts.accounting.note(VerdictEvent(report.stamp_ns, now))
    return (report,)


def is_forecast_valid(parts: Parts, found: Sequence[Finding]) -> bool:
    """Whether the leg is in the range of the model, and is the counted one by some findings."""
    invalid = any(Figure.FORECAST in finding.not_valid for finding in found)
    return parts.evaluation.holds() and not invalid


def evaluate_clearances(parts: Parts) -> tuple[AlarmList, ...]:
    """Compare clearances by measurement and by estimate with their limits: at once, for none scatters."""
    board, values, sources = parts.evaluation.board, {}, {}
    for joint in joint_situations(parts):
        name = alarm_specs.CLEARANCE.name(joint.joint)
        known = alarm_value(joint, board.alarms[name])
        if known is not None:
            values[name], sources[name] = known.clearance_m, (known.sigma_m, known.by)
    cycles = parts.config.alarms.on_delay_cycles
    return board.evaluate(values, parts.twin.intake.stamp_ns, cycles, sources) if values else ()


def shown(parts: Parts, joint: JointSituation) -> KnownClearance | None:
    """What encoders or the drive torque show of a joint best, or showed when its alarm was raised."""
    alarm = parts.evaluation.board.alarms[alarm_specs.CLEARANCE.name(joint.joint)]
    return at_limit_by_estimate(joint, alarm) or surest(joint.seen)


def situation_of(parts: Parts) -> Situation:
    """What the verdict depends on, at the end of an evaluation period."""
    evaluation, config, twin = parts.evaluation, parts.config, parts.twin
    last, explained = parts.state.last, parts.state.mismatch.explanation
    alarms, diagnosis = evaluation.board.alarms, parts.diagnosis
    return Situation(
        joints=joint_situations(parts, diagnosis),
        alarms=tuple(alarms.values()),
        quantities=alarm_specs.QUANTITIES,
        has_cycle=last is not None,
        is_all_counted=parts.accounting.is_all_counted,
        has_torque=last is not None and last.torque_samples > 0,
        mismatch=last.torque_mismatch if last else math.nan,
        mismatch_limit=config.limits.torque_mismatch,
        torque_causes=evaluation.present_causes(last, parts.state.torque) if last else {},
        without_zero="" if parts.guard.cause else parts.without_zero,
        unfollowed=_unfollowed(parts),
        input_causes=tuple(evaluation.causes),
        is_out_of_step=_is_out_of_step(parts),
        cadence_rpm=twin.speed_radps * 30.0 / math.pi,
        commanded_rpm=config.cadence.commanded_rpm,
        tolerance_rpm=config.cadence.tolerance_rpm,
        doubts=_doubts(parts),
        encoder_faults=tuple(faults(config.encoders.names, parts.encoders.state)) if parts.encoders else (),
        diagnosis=diagnosis,
        explained=explained if evaluation.board.level(alarm_specs.MISMATCH.name()) else None,
        crank=config.crank,
        drive_torque=config.drive_torque,
    )


def joint_situations(parts: Parts, diagnosis: Diagnosis | None = None) -> tuple[JointSituation, ...]:
    """What is known of each joint's clearance now."""
    last, measured, joints = parts.state.last, parts.measured, parts.clearance_joints
    diagnosis = diagnosis or parts.diagnosis
    counted_m, limits_m = parts.twin.clearance_mean_m.tolist(), parts.evaluation.board.clearance_limits_m
    walked, found = parts.accounting.state, []
    for k, (joint, part) in enumerate(zip(joints, walked.parts, strict=True)):
        report = last.joints[k] if last else None
        by_encoders, by_torque = report.by_encoders if report else None, shown_by_torque(k, diagnosis)
        one = JointSituation(
            joint=joint,
            counted_m=counted_m[k],
            limit_m=limits_m[k],
            believed_m=report.forecast.now_m if report and report.forecast else math.nan,
            seen=tuple(one for one in (by_encoders, by_torque) if one),
            is_used=bool(report and by_encoders and report.seen and report.seen.believed),
            label=parts.mechanism.joints[joint].label,
            load=report.load if report else None,
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


def _is_out_of_step(parts: Parts) -> bool:
    """Whether the leg walks at another cadence: not where it only starts or stops, after a right one."""
    last = parts.state.last
    was_right = last is not None and parts.config.cadence.allows(last.cadence_rpm)
    return parts.twin.tracking is Tracking.OUT_OF_STEP and not was_right


def _doubts(parts: Parts) -> tuple[str, ...]:
    """Why the last gait cycle is unlikely to be one of this leg; a torque that is explained is no reason."""
    last = parts.state.last
    if last is None:
        return ()
    if parts.is_torque_wrong:
        last = attrs.evolve(last, torque_samples=0)
    return tuple(doubts(last, parts.config))


def _unfollowed(parts: Parts) -> str:
    """Why the crank is not followed; a loss shorter than a commanded gait cycle is reported by its alarm."""
    if parts.guard.cause:
        return parts.guard.cause
    out_s, cycle_s = parts.twin.intake.out_s, 60.0 / abs(parts.config.cadence.commanded_rpm)
    return f"the crank has not been followed for {out_s:.3g} s" if out_s >= cycle_s else ""

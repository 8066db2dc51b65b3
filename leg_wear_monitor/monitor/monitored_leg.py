"""The leg that a monitor watches: its wear model with all observers, its verdict, and its state."""

import math
from collections.abc import Sequence
from typing import Any

import attrs

from leg_wear_monitor.estimate.torque_model import torque_model
from leg_wear_monitor.files import finite_or_none
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor import alarm_specs
from leg_wear_monitor.monitor.alarms import (
    ALREADY_COUNTED,
    CRANK_ZERO,
    TRACKING_LOST,
    Alarm,
    leg_alarm,
)
from leg_wear_monitor.monitor.config.inputs import AT_START
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.crank_zero import CrankZero
from leg_wear_monitor.monitor.encoders import EncoderWatch
from leg_wear_monitor.monitor.evaluation import A_CYCLE, AlarmEvaluation, EvaluationPeriods
from leg_wear_monitor.monitor.foot_load import FootLoadCheck
from leg_wear_monitor.monitor.forecast.forecast import JointForecast, LegForecast
from leg_wear_monitor.monitor.gait_evidence import doubts
from leg_wear_monitor.monitor.input_health import InputJudge
from leg_wear_monitor.monitor.inputs import InputGuard
from leg_wear_monitor.monitor.ledger.entry import VerdictEvent
from leg_wear_monitor.monitor.ledger.ledger import Ledger
from leg_wear_monitor.monitor.observer import Observer
from leg_wear_monitor.monitor.reports import AlarmList, CycleReport, VerdictReport
from leg_wear_monitor.monitor.torque_watch import TorqueWatch
from leg_wear_monitor.monitor.verdict.rules import findings
from leg_wear_monitor.monitor.verdict.situation import (
    COUNTED,
    MEASURED,
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
from leg_wear_monitor.monitor.verdict.verdict import NO_GAIT_CYCLE, dated, has_changed, verdict_of
from leg_wear_monitor.monitor.wear_model import WearModel
from leg_wear_monitor.state import Figure, JointClearance, LegAlarms, LegState, LifeHours, Verdict
from leg_wear_monitor.twin.sample import NO_LOAD
from leg_wear_monitor.twin.statistics import Event, Tracking


class MonitoredLeg(WearModel):
    """The wear model of this leg with all observers.

    Parameters
    ----------
    mechanism : Mechanism
    config : MonitorConfig
    ledger : Ledger or None

    Attributes
    ----------
    observers : list of Observer
        In the order in which samples reach them.
    torque : TorqueWatch
        One of them.
    findings : tuple of Verdict
        Findings of the last evaluation period; empty before the first.
    happened : Event or None
        The last event of the twin.
    has_ended : bool
        True if a gait cycle has ended since the last state of the leg was reported.
    """

    def __init__(self, mechanism: Mechanism, config: MonitorConfig, ledger: Ledger | None) -> None:
        super().__init__(mechanism, config, ledger)
        self.guard = InputGuard(self.twin.settings.tracker, self.twin.torque_size_nm)
        self.judge = InputJudge(config, self.twin.torque_size_nm)
        cycle_ns = round(60.0e9 / abs(config.cadence.commanded_rpm))
        self.evaluation = AlarmEvaluation(self.twin, config, cycle_ns, self.guard)
        self.evaluation_periods = EvaluationPeriods(cycle_ns // A_CYCLE)
        board = self.evaluation.board
        self.torque = TorqueWatch(self, board)
        self.encoders = EncoderWatch(self, board) if config.encoders.names else None
        foot_load = FootLoadCheck(self, board) if config.foot_load.source != NO_LOAD else None
        tracker, is_at_start = self.twin.settings.tracker, config.crank.zero == AT_START
        zero = CrankZero(torque_model(self.mechanism), config, tracker) if is_at_start else None
        found = (zero, self.encoders, self.torque, foot_load)
        self.observers: list[Observer] = [each for each in found if each is not None]
        if ledger and ledger.entry:
            board.restore(ledger.entry.alarms)
            self.accounting.note_alarms(AlarmList(ledger.entry.stamp_ns, tuple(board.alarms.values())))
        self.findings: tuple[Verdict, ...] = ()
        self.happened: Event | None = None
        self.has_ended = False

    @property
    def seen(self) -> list[tuple[KnownClearance, ...]]:
        """Clearances that observers see, of each joint."""
        found = [seen for each in self.observers if (seen := each.seen)]
        return [
            tuple(one for seen in found if (one := seen[k]) is not None)
            for k in range(len(self.clearance_joints))
        ]

    @property
    def unmeasured(self) -> frozenset[str]:
        """Alarms of the torque if the last gait cycle had none, and alarms of values without a source."""
        is_gone = self.last is not None and not self.last.torque_samples
        silent = set(SEEN) - {each.shows for each in self.observers} | ({"torque"} if is_gone else set())
        alarms = self.evaluation.board.alarms.values()
        shown = frozenset(alarm.name for alarm in alarms if alarm.cause in silent)
        return alarm_specs.OF_TORQUE | shown if is_gone else shown

    def keep(self, closed: bool = False) -> bool:
        """Write an entry into the ledger; return whether it is on the disk."""
        return self.accounting.keep(self.evaluation.board.alarms.values(), closed)

    def verdict_report(self, situation: Situation | None = None) -> VerdictReport:
        """The verdict now; the situation is made if it is not given."""
        stamp_ns = self.twin.intake.stamp_ns
        found = findings(situation or self.situation())
        return VerdictReport(stamp_ns, dated(found, self.findings, stamp_ns))

    def update_verdict(self, situation: Situation | None = None) -> tuple[VerdictReport, ...]:
        """The verdict if it has changed since the last call; the change is then also an event.

        To be called where the state does not depend on how the samples are cut into blocks: at the end of an
        evaluation period.
        """
        before = verdict_of(self.findings) if self.findings else None
        report = self.verdict_report(situation)
        self.findings, now = report.findings, report.verdict
        if not has_changed(before, now):
            return ()
        if before and (Figure.FORECAST in before.not_valid) != (Figure.FORECAST in now.not_valid):
            self.forecaster.expire()
        if before or now.fault_code != NO_GAIT_CYCLE:  # a run that monitored nothing has no verdict to store
            self.accounting.note(VerdictEvent(report.stamp_ns, now))
        return (report,)

    def is_forecast_valid(self, found: Sequence[Verdict]) -> bool:
        """True if the leg is in the range of the model and no finding contradicts the model."""
        invalid = any(Figure.FORECAST in finding.not_valid for finding in found)
        return self.evaluation.is_model_valid() and not invalid

    def evaluate_clearances(self, joints: Sequence[JointSituation], stamp_ns: int) -> tuple[AlarmList, ...]:
        """Compare measured and estimated clearances with their limits; no delay, as they do not scatter."""
        board, values, sources = self.evaluation.board, {}, {}
        for joint in joints:
            name = alarm_specs.CLEARANCE.name(joint.joint)
            known = _alarm_value(joint, board.alarms[name])
            if known is not None:
                values[name], sources[name] = known.clearance_m, (known.sigma_m, known.by)
        cycles = self.config.alarms.on_delay_cycles
        return board.evaluate(values, stamp_ns, cycles, sources) if values else ()

    def estimate_of(self, joint: JointSituation) -> KnownClearance | None:
        """Best estimate of a joint by encoders or the drive torque, now or when its alarm was raised."""
        alarm = self.evaluation.board.alarms[alarm_specs.CLEARANCE.name(joint.joint)]
        return at_limit_by_estimate(joint, alarm) or surest(joint.seen)

    def situation(self) -> Situation:
        """Inputs of the verdict, at the end of an evaluation period."""
        evaluation, config = self.evaluation, self.config
        last, torque = self.last, self.torque
        alarms, explained = evaluation.board.alarms, torque.explained
        return Situation(
            joints=self._joints(),
            alarms=tuple(alarms.values()),
            has_cycle=last is not None,
            # the torque of a refused gait cycle has come, and is not compared
            has_torque=last is not None and (last.torque_samples > 0 or self.judge.was_refused),
            mismatch=last.torque_mismatch if last else math.nan,
            mismatch_limit=config.limits.torque_mismatch,
            torque_causes=torque.causes,
            notes=self._notes(),
            input_causes=tuple(evaluation.causes),
            input_faults=self.judge.faults,
            trusted_before_ns=self.judge.trusted_before_ns,
            diagnosis=torque.diagnosis,
            explained=explained if evaluation.board.level(alarm_specs.MISMATCH.name()) else None,
        )

    def _joints(self) -> tuple[JointSituation, ...]:
        """Present knowledge of each joint's clearance."""
        estimates = self.encoders.estimates if self.encoders else None
        diagnosis, last, measured, seen = self.torque.diagnosis, self.last, self.measured, self.seen
        modelled_m, limits_m = self.twin.clearance_mean_m.tolist(), self.evaluation.board.clearance_limits_m
        found = []
        for k, (joint, part) in enumerate(zip(self.clearance_joints, self.accounting.parts, strict=True)):
            forecast, by_hand = last.joints[k].forecast if last else None, measured[k]
            by_torque = next((each.sigma_m for each in seen[k] if each.by == "torque"), None)
            best_m = forecast.now_m if forecast else self.forecaster.best_estimate_m(k, modelled_m[k])
            found.append(
                JointSituation(
                    joint=joint,
                    label=self.mechanism.joints[joint].label,
                    modelled_m=modelled_m[k],
                    sigma_m=self.tolerance_m[k] if by_torque is None else by_torque,
                    limit_m=limits_m[k],
                    best_estimate_m=best_m,
                    seen=seen[k],
                    change=diagnosis.change_of_joint(k),
                    is_used=bool(estimates and estimates[k].believed),
                    measured=(
                        KnownClearance(MEASURED, by_hand.clearance_m, by_hand.sigma_m) if by_hand else None
                    ),
                    is_measurement_used=by_hand is not None and by_hand.counts,
                    replaced_ns=part.replaced_ns,
                    part_cycles=self.accounting.cycles - part.cycles,
                )
            )
        return tuple(found)

    def _notes(self) -> dict[str, Sequence[str]]:
        """Notes of the monitor and its observers for rules of the verdict, by the rule's code."""
        notes: dict[str, Sequence[str]] = {
            ALREADY_COUNTED: ("",) if self.accounting.is_all_counted else (),
            TRACKING_LOST: self._untracked(),
            "NOT_THIS_LEG": self._doubts(),
            "CADENCE": self._other_cadence(),
        }
        for each in self.observers:
            notes |= each.notes
        if self.guard.cause:
            notes.pop(CRANK_ZERO, None)  # the monitor cannot find it without valid samples
        return notes

    def _other_cadence(self) -> tuple[str, ...]:
        """Note that the leg walks at a wrong cadence; a start or stop does not count."""
        last, cadence = self.last, self.config.cadence
        was_right = last is not None and cadence.allows(last.cadence_rpm)
        if self.twin.tracking is not Tracking.OUT_OF_STEP or was_right:
            return ()
        rpm, commanded = self.twin.speed_radps * 30.0 / math.pi, cadence.commanded_rpm
        return (f"it walks at {rpm:.3g} rpm. Expected {commanded:g} ± {cadence.tolerance_rpm:g} rpm",)

    def _doubts(self) -> tuple[str, ...]:
        """Reason why the last gait cycle does not fit this leg; an explained torque is not a reason."""
        last = self.last
        if last is None:
            return ()
        if self.torque.has_input_fault or self.judge.faults:
            last = attrs.evolve(last, torque_samples=0)
        found = doubts(last, self.config)
        return ("; ".join(found),) if found else ()

    def _untracked(self) -> tuple[str, ...]:
        """Why the crank is not tracked; an alarm reports a loss shorter than a commanded gait cycle."""
        if self.guard.cause:
            return (self.guard.cause,)
        out_s, cycle_s = self.twin.intake.out_s, 60.0 / abs(self.config.cadence.commanded_rpm)
        return (f"the crank has not been tracked for {out_s:.3g} s",) if out_s >= cycle_s else ()

    def state(self, findings: Sequence[Verdict], situation: Situation) -> LegState:
        """State of the leg now, with the verdict of some findings."""
        last, verdict, alarms = self.last, verdict_of(findings), self.evaluation.board.alarms
        observed = {name: field for each in self.observers for name, field in each.leg_fields.items()}
        return LegState(
            stamp_ns=self.twin.intake.stamp_ns,
            life_cycles=self.accounting.cycles,
            verdict=verdict,
            clearances={
                joint.joint: _joint_clearance(
                    joint,
                    alarms[alarm_specs.CLEARANCE.name(joint.joint)],
                    findings,
                    self.mechanism.clearances[joint.joint].radial_clearance,
                )
                for joint in situation.joints
            },
            alarms=LegAlarms(now=tuple(map(leg_alarm, alarms.values()))),
            **observed,
            **(_life_of(last, verdict) if last else {}),
        )


def _alarm_value(joint: JointSituation, alarm: Alarm) -> KnownClearance | None:
    """The clearance for its alarm at the end of a period; None if the alarm stays unchanged.

    A modelled clearance is evaluated once per gait cycle, unless a different source keeps the alarm present.
    """
    known, sure, shown = judged(joint), surely_at(joint.limit_m, joint.seen), surest(joint.seen)
    if sure is not None and sure.clearance_m > known.clearance_m:
        return sure
    # only the torque clears an estimate from the torque, because a new run has no estimate for a while
    is_back = shown is not None and _takes_back(shown, joint.limit_m)
    if is_observed(alarm, SEEN) and known.clearance_m < joint.limit_m and not is_back:
        return None
    return None if known.by == COUNTED and not is_observed(alarm) else known


def _takes_back(shown: KnownClearance, limit_m: float) -> bool:
    """True if an estimate below a limit is sure, or has lasted as long as an estimate above it must."""
    is_below = shown.clearance_m < limit_m and math.isfinite(shown.least_m)
    return is_below or is_surely_below(limit_m, shown)


def _joint_clearance(
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


def _life_of(last: CycleReport, verdict: Verdict) -> dict[str, Any]:
    """Remaining life of each joint and of the ``leg`` in a `LegState`, as far as it is valid."""
    forecasts: dict[str, JointForecast | LegForecast | None] = {
        one.joint: one.forecast for one in last.joints
    }
    forecasts["leg"] = last.forecast
    is_valid = Figure.FORECAST not in verdict.not_valid
    hours = {name: each.hours if each and is_valid else None for name, each in forecasts.items()}
    return {
        "life": {
            name: LifeHours(p10_h=one.p10, p50_h=one.p50, p90_h=one.p90) if one else None
            for name, one in hours.items()
        },
        "life_answers": {name: each.answer.value for name, each in forecasts.items() if each},
        "first_probability": last.forecast.first_probability if last.forecast and is_valid else {},
    }

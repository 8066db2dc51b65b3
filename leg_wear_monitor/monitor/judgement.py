"""The verdict of a monitor: what it depends on, collected from the monitor's parts, and its changes."""

import math
from collections.abc import Callable, Sequence

import attrs

from leg_wear_monitor.compiled.kernel import Records
from leg_wear_monitor.estimate.cause import TorqueExplanation
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor import alarm_specs
from leg_wear_monitor.monitor.accounting import Accounting, AccountingState
from leg_wear_monitor.monitor.alarms import Alarm
from leg_wear_monitor.monitor.angle_regression import ClearanceEstimate, ClearanceObservation
from leg_wear_monitor.monitor.crank_zero import CrankZeroSnapshot
from leg_wear_monitor.monitor.diagnosis.observer import TorqueObserverSnapshot
from leg_wear_monitor.monitor.diagnosis.state import Diagnosis
from leg_wear_monitor.monitor.encoders import EncoderObserver, EncoderSnapshot, faults
from leg_wear_monitor.monitor.evaluation import AlarmEvaluation, AlarmEvaluationState
from leg_wear_monitor.monitor.foot_load import FootLoadState
from leg_wear_monitor.monitor.forecast.forecaster import RENEWED_NS, Forecaster, ForecastState
from leg_wear_monitor.monitor.forecast.measurement import GrowthWindow
from leg_wear_monitor.monitor.forecast.wear_coefficients import MeasuredClearance
from leg_wear_monitor.monitor.gait_evidence import NO_MISMATCH, MismatchWindow, TorqueRecord, doubts
from leg_wear_monitor.monitor.ledger.entry import Measurement
from leg_wear_monitor.monitor.reports import CycleReport, JointReport, VerdictReport
from leg_wear_monitor.monitor.verdict.rules import findings
from leg_wear_monitor.monitor.verdict.situation import (
    JointSituation,
    KnownClearance,
    Situation,
    at_limit_by_estimate,
    with_sampling,
)
from leg_wear_monitor.monitor.verdict.verdict import NO_GAIT_CYCLE, Finding, dated, has_changed, verdict_of
from leg_wear_monitor.state import Figure
from leg_wear_monitor.twin.digital_twin import DigitalTwin, TwinSnapshot
from leg_wear_monitor.twin.statistics import CycleStatistics, Event, Tracking

# Update of the forecast with clearance estimates from encoders: each minute of stamps, or on a finding.


def update_forecast(
    observer: EncoderObserver,
    forecaster: Forecaster,
    statistics: CycleStatistics,
    worn_m: Floats,
    replaced_ns: Sequence[int],
) -> tuple[ClearanceEstimate, ...]:
    """Clearance estimates after a gait cycle, and whether the forecast uses them.

    Parameters
    ----------
    watch : EncoderObserver
    forecaster : Forecaster
        Updated if that is due.
    statistics : CycleStatistics
    worn_m : (k,) array
        Wear counted by the twin for each part.
    replaced_ns : sequence of int
        When each part was replaced, 0 if it never was.
    """
    state, estimates = observer.state, observer.estimates(statistics.clearance_mean_m)
    other = tuple(one.is_other for one in estimates)
    is_due = other != state.other or not 0 <= statistics.stamp_ns - state.updated_ns < RENEWED_NS
    if is_due and any(one.observation is ClearanceObservation.SEEN for one in estimates):
        state.updated_ns, state.other = statistics.stamp_ns, other
        state.believed = tuple(
            one.observation is ClearanceObservation.SEEN
            and forecaster.use_estimate(k, _measured(one, float(worn_m[k])), replaced_ns[k])
            for k, one in enumerate(estimates)
        )
    believed = state.believed or (False,) * len(estimates)
    return tuple(
        attrs.evolve(one, believed=yes and one.observation is ClearanceObservation.SEEN)
        for one, yes in zip(estimates, believed, strict=True)
    )


def _measured(estimate: ClearanceEstimate, wear_m: float) -> MeasuredClearance:
    return MeasuredClearance(estimate.clearance_m, estimate.sigma_m, wear_m)


# The changing state of a monitor, without its ledger.


@attrs.define
class MonitorState:
    """State beside twin, alarms and accounting; every value is immutable.

    ``findings`` are those of the last evaluation period; empty before the first. ``has_ended``: whether a
    gait cycle has ended since the last state of the leg was reported.
    """

    growth: tuple[GrowthWindow, ...]
    torque: TorqueRecord
    last: CycleReport | None = None
    happened: tuple[Event, ...] = ()
    findings: tuple[Finding, ...] = ()
    mismatch: MismatchWindow = NO_MISMATCH
    has_ended: bool = False


@attrs.frozen(eq=False)
class MonitorSnapshot:
    """Snapshot of a monitor without its ledger."""

    twin: TwinSnapshot
    state: MonitorState
    accounting: AccountingState
    evaluation: AlarmEvaluationState
    forecast: ForecastState
    alarms: dict[str, Alarm]
    evaluation_periods: Records
    guard: Records
    encoders: EncoderSnapshot | None = None
    torque: TorqueObserverSnapshot | None = None
    crank_zero: CrankZeroSnapshot | None = None
    foot_load: FootLoadState | None = None


class Judge:
    """Evaluates the verdict.

    Parameters
    ----------
    twin : DigitalTwin
    evaluation : AlarmEvaluation
    encoders : EncoderObserver or None
    forecaster : Forecaster
        Renewed if a verdict makes its forecast invalid or valid.
    accounting : Accounting
        Stores changes as events.
    diagnosis : callable
        What the drive torque shows now.
    without_zero : callable
        Why nothing is monitored while the crank's zero is not known; empty if it is.
    """

    def __init__(
        self,
        twin: DigitalTwin,
        evaluation: AlarmEvaluation,
        encoders: EncoderObserver | None,
        forecaster: Forecaster,
        accounting: Accounting,
        diagnosis: Callable[[], Diagnosis],
        without_zero: Callable[[], str] = lambda: "",
    ) -> None:
        self._twin, self._evaluation, self._encoders = twin, evaluation, encoders
        self._forecaster, self._accounting, self._diagnosis = forecaster, accounting, diagnosis
        self._without_zero = without_zero

    def report(self, state: MonitorState) -> VerdictReport:
        """The verdict now."""
        intake = self._twin.intake
        stamp_ns = intake.followed_stamp_ns or intake.newest_stamp_ns
        situation = situation_of(
            self._twin,
            self._evaluation,
            state.last,
            state.torque,
            self._encoders,
            self._diagnosis(),
            state.mismatch.explanation,
            self._without_zero(),
            self._forecaster.last_measured(self._accounting.replaced_ns),
            self._accounting.is_all_counted,
            self._accounting.part_lives,
        )
        found = findings(situation)
        if self._twin.sampling:
            joints, sigma_m = self._twin.clearance_joints, self._accounting.sampling_sigma_m
            found = with_sampling(found, self._twin.sampling, joints, sigma_m)
        return VerdictReport(stamp_ns, dated(found, state.findings, stamp_ns))

    def joints(self, state: MonitorState) -> tuple[JointSituation, ...]:
        """What is known of each joint's clearance now."""
        measured = self._forecaster.last_measured(self._accounting.replaced_ns)
        return joint_situations(self._twin, self._evaluation, state.last, self._diagnosis(), measured)

    def shown(self, state: MonitorState, joint: str) -> KnownClearance | None:
        """What encoders or the drive torque show of a joint best, or showed when its alarm was raised."""
        own = next(each for each in self.joints(state) if each.joint == joint)
        alarm = self._evaluation.board.alarms[alarm_specs.CLEARANCE.name(joint)]
        best = min(own.seen, key=lambda one: one.sigma_m, default=None)
        return at_limit_by_estimate(own, alarm) or best

    def changed(self, state: MonitorState) -> tuple[VerdictReport, ...]:
        """The verdict if it has changed since the last call; it is then an event, too.

        To be called where the state does not depend on how the samples are cut into blocks: at the end of an
        evaluation period.
        """
        before = verdict_of(state.findings) if state.findings else None
        report = self.report(state)
        state.findings, now = report.findings, report.verdict
        if not has_changed(before, now):
            return ()
        if before and (Figure.FORECAST in before.not_valid) != (Figure.FORECAST in now.not_valid):
            self._forecaster.expire()
        if before or now.fault_code != NO_GAIT_CYCLE:  # a run that monitored nothing has no verdict to store
            self._accounting.note_verdict(report)
        return (report,)

    def is_forecast_valid(self, found: Sequence[Finding]) -> bool:
        """Whether the leg is in the range of the model, and is the counted one by some findings."""
        invalid = any(Figure.FORECAST in finding.not_valid for finding in found)
        return self._evaluation.holds() and not invalid


def situation_of(
    twin: DigitalTwin,
    evaluation: AlarmEvaluation,
    last: CycleReport | None,
    record: TorqueRecord,
    encoders: EncoderObserver | None = None,
    diagnosis: Diagnosis | None = None,
    explained: TorqueExplanation | None = None,
    without_zero: str = "",
    measured: Sequence[Measurement | None] = (),
    is_all_counted: bool = False,
    parts: Sequence[tuple[int, int]] = (),
) -> Situation:
    """What the verdict depends on, at the end of an evaluation period.

    Parameters
    ----------
    twin : DigitalTwin
    evaluation : AlarmEvaluation
    last : CycleReport or None
        The last gait cycle of this run.
    record : TorqueRecord
    encoders : EncoderObserver, optional
    diagnosis : Diagnosis, optional
        What the drive torque shows.
    explained : TorqueExplanation, optional
        What explains a torque mismatch.
    without_zero : str
        Why nothing is monitored while the crank's zero is not known; empty if it is.
    measured : sequence of Measurement or None, optional
        Last measurement of each joint's part.
    is_all_counted : bool
        Whether the ledger already contained the wear of all samples.
    parts : sequence of (int, int)
        When each joint's part was replaced, 0 if it never was, and its gait cycles.
    """
    alarms, config = evaluation.board.alarms, evaluation.config
    return Situation(
        joints=joint_situations(twin, evaluation, last, diagnosis, measured, parts),
        alarms=tuple(alarms.values()),
        quantities=alarm_specs.QUANTITIES,
        has_cycle=last is not None,
        is_all_counted=is_all_counted,
        has_torque=last is not None and last.torque_samples > 0,
        mismatch=last.torque_mismatch if last else math.nan,
        mismatch_limit=config.limits.torque_mismatch,
        torque_causes=evaluation.present_causes(last, record) if last else {},
        without_zero="" if evaluation.guard.cause else without_zero,
        unfollowed=_unfollowed(twin, evaluation),
        input_causes=tuple(evaluation.causes),
        is_out_of_step=_is_out_of_step(twin, evaluation, last),
        cadence_rpm=twin.speed_radps * 30.0 / math.pi,
        commanded_rpm=config.cadence.commanded_rpm,
        tolerance_rpm=config.cadence.tolerance_rpm,
        doubts=_doubts(last, evaluation, explained),
        encoder_faults=tuple(faults(config.encoders.names, encoders.state)) if encoders else (),
        diagnosis=diagnosis,
        explained=explained if evaluation.board.level(alarm_specs.MISMATCH.name()) else None,
        crank=config.crank,
        drive_torque=config.drive_torque,
    )


def _is_out_of_step(twin: DigitalTwin, evaluation: AlarmEvaluation, last: CycleReport | None) -> bool:
    """Whether the leg walks at another cadence: not where it only starts or stops, after a right one."""
    was_right = last is not None and evaluation.config.cadence.allows(last.cadence_rpm)
    return twin.tracking is Tracking.OUT_OF_STEP and not was_right


def joint_situations(
    twin: DigitalTwin,
    evaluation: AlarmEvaluation,
    last: CycleReport | None,
    diagnosis: Diagnosis | None = None,
    measured: Sequence[Measurement | None] = (),
    parts: Sequence[tuple[int, int]] = (),
) -> tuple[JointSituation, ...]:
    """The clearance joints of a situation; parameters as in `situation_of`."""
    counted_m, limits_m = twin.clearance_mean_m.tolist(), evaluation.board.clearance_limits_m
    labels = (twin.mechanism.joints[name].label for name in twin.clearance_joints)
    found = [
        _joint(k, name, label, counted_m[k], limits_m[k], last, diagnosis)
        for k, (name, label) in enumerate(zip(twin.clearance_joints, labels, strict=True))
    ]
    if measured:
        found = [with_measured(*each) for each in zip(found, measured, strict=True)]
    if parts:
        found = [
            attrs.evolve(each, replaced_ns=replaced_ns, part_cycles=cycles)
            for each, (replaced_ns, cycles) in zip(found, parts, strict=True)
        ]
    return tuple(found)


def _doubts(
    last: CycleReport | None, evaluation: AlarmEvaluation, explained: TorqueExplanation | None
) -> tuple[str, ...]:
    """Why the last gait cycle is unlikely to be one of this leg; a torque that is explained is no reason."""
    if last is None:
        return ()
    if explained is not None and explained.is_input_fault:
        last = attrs.evolve(last, torque_samples=0)
    return tuple(doubts(last, evaluation.config))


def _joint(
    k: int,
    name: str,
    label: str,
    counted_m: float,
    limit_m: float,
    last: CycleReport | None,
    diagnosis: Diagnosis | None,
) -> JointSituation:
    report = last.joints[k] if last else None
    by_encoders = _seen_by_encoders(report)
    seen = [KnownClearance("encoders", by_encoders.clearance_m, by_encoders.sigma_m)] if by_encoders else []
    if diagnosis and diagnosis.clearance_m and math.isfinite(diagnosis.clearance_m[k]):
        seen.append(KnownClearance("torque", diagnosis.clearance_m[k], diagnosis.sigma_m[k]))
    return JointSituation(
        joint=name,
        counted_m=counted_m,
        limit_m=limit_m,
        believed_m=report.forecast.now_m if report and report.forecast else math.nan,
        seen=tuple(seen),
        is_used=bool(by_encoders and by_encoders.believed),
        label=label,
        load=report.load if report else None,
    )


def with_measured(joint: JointSituation, measured: Measurement | None) -> JointSituation:
    """A joint with the last measurement of its part."""
    if measured is None:
        return joint
    by = KnownClearance("measured", measured.clearance_m, measured.sigma_m)
    return attrs.evolve(joint, measured=by, is_measurement_used=measured.counts)


def _seen_by_encoders(report: JointReport | None) -> ClearanceEstimate | None:
    seen = report.seen if report else None
    return seen if seen and seen.observation is ClearanceObservation.SEEN else None


def _unfollowed(twin: DigitalTwin, evaluation: AlarmEvaluation) -> str:
    """Why the crank is not followed; a loss shorter than a commanded gait cycle is reported by its alarm."""
    if evaluation.guard.cause:
        return evaluation.guard.cause
    out_s, cycle_s = twin.intake.out_s, 60.0 / abs(evaluation.config.cadence.commanded_rpm)
    return f"the crank has not been followed for {out_s:.3g} s" if out_s >= cycle_s else ""

"""Alarm evaluation of gait cycles and input, once in each evaluation period."""

import math
from collections.abc import Mapping

import attrs

from leg_wear_monitor.estimate.cause import NamedCause
from leg_wear_monitor.estimate.mismatch import Allowed
from leg_wear_monitor.monitor.alarms.alarm import Level
from leg_wear_monitor.monitor.config.fitting import largest_lag_s
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.evaluation import specs
from leg_wear_monitor.monitor.evaluation.board import AlarmBoard, joint_specs
from leg_wear_monitor.monitor.evaluation.evaluation_period import A_CYCLE
from leg_wear_monitor.monitor.evaluation.specs import CycleEvidence
from leg_wear_monitor.monitor.evaluation.torque_checks import (
    TorqueBounds,
    torque_bounds,
    torque_causes,
    torque_values,
)
from leg_wear_monitor.monitor.evaluation.torque_record import TorqueRecord
from leg_wear_monitor.monitor.inputs.causes import causes
from leg_wear_monitor.monitor.inputs.guard import InputGuard
from leg_wear_monitor.monitor.inputs.health import InputHealth, TorqueRange, input_health, with_torques
from leg_wear_monitor.monitor.reports import AlarmList, CycleReport
from leg_wear_monitor.twin.digital_twin import DigitalTwin
from leg_wear_monitor.twin.sample import Samples
from leg_wear_monitor.twin.statistics import CycleStatistics, Intake, NotCompared, Tracking

_FASTER = 1.1  # than commanded; the default tolerance of the cadence is a tenth


@attrs.define
class AlarmEvaluationState:
    """State of the evaluation; every value is immutable, so a shallow copy is a snapshot.

    Attributes
    ----------
    before : Intake
        Counts at the last evaluation of the input.
    skipped, skipped_before : int
        Samples skipped up to the last evaluation, and up to the one before.
    torque : TorqueRange
        Range of the torques since the last evaluation.
    evaluation_periods, cycles : int
        Evaluation periods and whole gait cycles since the last evaluation.
    health : InputHealth or None
        Health of the input at the last evaluation.
    withheld : int
        Samples that the guard had withheld at the last evaluation.
    causes : tuple of str or None
        Causes of unused samples at the last evaluation.
    cadence_rpm : float
        Of the last gait cycle, 0 before the first.
    """

    before: Intake
    skipped: int = 0
    skipped_before: int = 0
    torque: TorqueRange = TorqueRange()
    evaluation_periods: int = 0
    cycles: int = 0
    health: InputHealth | None = None
    withheld: int = 0
    causes: tuple[str, ...] | None = None
    cadence_rpm: float = 0.0


class AlarmEvaluation:
    """Evaluates a twin's gait cycles and its input.

    Parameters
    ----------
    twin : DigitalTwin
    config : MonitorConfig
    cycle_ns : int
        Duration of a commanded gait cycle.
    guard : InputGuard
    periods : int
        Evaluation periods in that duration.
    """

    def __init__(
        self,
        twin: DigitalTwin,
        config: MonitorConfig,
        cycle_ns: int,
        guard: InputGuard,
        periods: int = A_CYCLE,
    ) -> None:
        self._twin, self._periods = twin, periods
        self.guard = guard
        self._cycle_ns = cycle_ns
        self.config = config
        self.board = AlarmBoard(config, twin.clearance_joints, twin.torque_size_nm)
        self.state = AlarmEvaluationState(twin.intake)

    def configure(self, config: MonitorConfig) -> None:
        """Use other limits from now on."""
        self.config = config
        self.board.configure(config)

    def holds(self) -> bool:
        """Whether the model is valid for the present motion: cadence and torque are as expected."""
        return self.board.level(specs.CADENCE.name(), specs.MISMATCH.name()) is not Level.ERROR

    def add_samples(self, piece: Samples) -> None:
        """Add received samples."""
        saturation_nm = self.config.drive_torque.saturation_nm
        self.state.torque = with_torques(self.state.torque, piece, saturation_nm)

    @property
    def causes(self) -> tuple[str, ...]:
        """Causes of unused samples, at present and over the duration of the last gait cycle."""
        now = (self.guard.cause,) if self.guard.cause else ()
        return now + (self._causes() if self.state.causes is None else self.state.causes)

    @property
    def _withheld(self) -> int:
        return self.guard.conflicting + self.guard.implausible

    def _causes(self) -> tuple[str, ...]:
        withheld = self._withheld - self.state.withheld
        return tuple(causes(self.state.before, self._twin.intake, withheld, self.config))

    @property
    def torque_bounds(self) -> TorqueBounds:
        """Bounds of the drive torque."""
        return torque_bounds(self.config, self._twin.torque_size_nm, largest_lag_s(self.config))

    def is_torque_sound(self, report: CycleReport) -> bool:
        """Whether a gait cycle's torque is as predicted, so that its friction is that of this leg."""
        return report.torque_mismatch < self.allowed_torque.unexplained

    @property
    def allowed_torque(self) -> Allowed:
        """Which torque a leg without a fault may have."""
        limits, bounds = self.config.limits, self.torque_bounds
        return Allowed(
            lag_s=bounds.max_lag_s,
            loads_n=self._twin.settings.loads_n,
            friction_nm=bounds.max_friction_nm,
            unexplained=limits.warn_fraction * limits.torque_mismatch,
        )

    def present_causes(self, report: CycleReport, record: TorqueRecord) -> dict[str, NamedCause]:
        """Causes of the torque's alarms whose values are beyond their limits now, by the alarm."""
        names = {spec.name() for spec in specs.TORQUE}
        raised = {name for name in names if self.board.alarms[name].present is not Level.OK}
        return torque_causes(raised, report, record, self.torque_bounds)

    def why_not_compared(self, statistics: CycleStatistics) -> NotCompared | None:
        """Why the torque of a gait cycle is not compared with the predicted one; None if it is."""
        is_allowed = self.config.cadence.allows(statistics.cadence_rpm)
        return statistics.not_compared if is_allowed else NotCompared.CADENCE

    def end_cycle(
        self, report: CycleReport, record: TorqueRecord, foot_load: Mapping[str, float] | None = None
    ) -> tuple[AlarmList, ...]:
        """Evaluate a whole gait cycle, with its torque and the record; returns all alarms if one changed.

        ``foot_load`` are values of the alarms of the foot load's sensor; None without one.
        """
        self.state.cycles += 1
        sensor = {} if foot_load is None else {spec.name(): spec.value(foot_load) for spec in specs.FOOT_LOAD}
        if not report.is_followed:
            return self._end_tracked(report, sensor)
        torque = torque_values(report, record, self.torque_bounds)
        cycle = CycleEvidence(report, torque, self.config.cadence.commanded_rpm)
        values = {spec.name(): spec.value(cycle) for spec in (*specs.TORQUE, *specs.GAIT)} | sensor
        if not self.config.cadence.allows(report.cadence_rpm):
            del values[specs.MISMATCH.name()]
        for joint in report.joints:
            values |= {spec.name(joint.joint): spec.value(joint) for spec in joint_specs(self.config)}
        for name in self.board.held_by_estimate:  # it is evaluated with the estimate, at the period's end
            values.pop(name, None)
        factor = self._impact_factor(report.cadence_rpm)
        self.state.cadence_rpm = report.cadence_rpm
        return self.board.evaluate(values, report.stamp_ns, impact_factor=factor)

    def _impact_factor(self, rpm: float) -> float:
        """Factor on the limits of impact forces, which are those of the commanded cadence, at another one.

        Forces grow with the square of the speed and more: peaks of a healthy leg are 4.1 kN at 60 and 6.9 kN
        at 75 rpm (medians of joint A over an hour, benchmarks/cadences.py). A gait cycle that ends slower
        than it began has the limits of the one before. Up to a tenth faster than commanded, as by a ripple,
        and slower, the limits stay.
        """
        cadence = self.config.cadence
        commanded = abs(cadence.commanded_rpm)
        fastest = min(max(abs(rpm), abs(self.state.cadence_rpm)), commanded + cadence.tolerance_rpm)
        return (fastest / commanded) ** 2 if fastest > _FASTER * commanded else 1.0

    def _end_tracked(self, report: CycleReport, sensor: Mapping[str, float]) -> tuple[AlarmList, ...]:
        """Evaluate a gait cycle that was tracked only: it has neither forces nor a predicted torque."""
        departure = abs(report.cadence_rpm - self.config.cadence.commanded_rpm)
        clearances = {
            specs.CLEARANCE.name(joint.joint): specs.CLEARANCE.value(joint) for joint in report.joints
        }
        for name in self.board.held_by_estimate:
            clearances.pop(name, None)
        return self.board.evaluate({specs.CADENCE.name(): departure, **clearances, **sensor}, report.stamp_ns)

    def end_period(self, skipped: int = 0) -> tuple[AlarmList, ...]:
        """Evaluate impacts of the running gait cycle, and once per duration of a cycle the input.

        Parameters
        ----------
        skipped : int
            Number of samples skipped so far because their wear is already counted.
        """
        peaks = {
            specs.IMPACT.name(joint): float(peak)
            for joint, peak in zip(self._twin.clearance_joints, self._twin.peak_force_n, strict=True)
        }
        factor = self._impact_factor(self._twin.speed_radps * 30.0 / math.pi)
        early = self.board.evaluate_early(peaks, self._twin.intake.followed_stamp_ns, factor)
        sources = {specs.SOURCES.name(): specs.SOURCES.value(self.guard)}
        early += self.board.evaluate(sources, self.guard.stamp_ns)
        self.state.evaluation_periods += 1
        if self.state.evaluation_periods < self._periods:
            return early
        return early + self._evaluate_input(skipped)

    def pause(self) -> None:
        """Note a pause of the recording: the evaluation of the input starts again with the next sample."""
        intake = attrs.evolve(self._twin.intake, newest_stamp_ns=0)
        self.state = AlarmEvaluationState(
            intake, self.state.skipped, self.state.skipped_before, cadence_rpm=self.state.cadence_rpm
        )

    def _evaluate_input(self, skipped: int) -> tuple[AlarmList, ...]:
        state, intake, config = self.state, self._twin.intake, self.config
        is_whole = skipped == state.skipped == state.skipped_before
        health = input_health(state.before, intake, state.torque, is_whole)
        rate = specs.FOOT_LOAD_RATE
        read = (*specs.INPUT, rate) if rate.name() in self.board.alarms else specs.INPUT
        values = {spec.name(): spec.value(health) for spec in read}
        if state.cycles == 0 and self._twin.tracking is Tracking.OUT_OF_STEP:
            speed_rpm = self._twin.speed_radps * 30.0 / math.pi
            values[specs.CADENCE.name()] = abs(speed_rpm - config.cadence.commanded_rpm)
        self.state = AlarmEvaluationState(
            intake,
            skipped,
            state.skipped,
            health=health,
            withheld=self._withheld,
            causes=self._causes(),
            cadence_rpm=state.cadence_rpm,
        )
        cycles = 1 if math.isnan(health.duration_s) else round(1.0e9 * health.duration_s / self._cycle_ns)
        return self.board.evaluate(values, intake.newest_stamp_ns, max(1, cycles))

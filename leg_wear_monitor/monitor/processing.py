"""Processing of the samples: gait cycles, their reports, what is observed at the ends of periods."""

import attrs
import numpy as np

from leg_wear_monitor.estimate.mismatch import explanation
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.alarm_specs import CLEARANCE, MISMATCH
from leg_wear_monitor.monitor.angle_regression import ClearanceEstimate
from leg_wear_monitor.monitor.diagnosis.observer import Correction
from leg_wear_monitor.monitor.diagnosis.state import TorqueState
from leg_wear_monitor.monitor.forecast.measurement import GrowthWindow, extended
from leg_wear_monitor.monitor.judgement import update_forecast
from leg_wear_monitor.monitor.ledger.entry import Audit, CorrectedClearance, IdentifiedLeg, SimulatedReference
from leg_wear_monitor.monitor.parts import Parts
from leg_wear_monitor.monitor.reports import (
    AlarmList,
    CycleReport,
    SampleReports,
    VerdictReport,
    cycle_report,
    latest,
)
from leg_wear_monitor.monitor.verdict.situation import COUNTED, alarm_value, is_surely_below
from leg_wear_monitor.state import Level
from leg_wear_monitor.twin.reference import LegParameters
from leg_wear_monitor.twin.sample import Samples
from leg_wear_monitor.twin.statistics import CycleStatistics

_KEPT_EVENTS = 1


class Processing:
    """Passes samples to the parts of a monitor, and evaluates gait cycles and periods.

    Parameters
    ----------
    parts : Parts
    """

    def __init__(self, parts: Parts) -> None:
        self._parts, self._clearance_joints = parts, parts.clearance_joints
        self._twin, self._guard, self._accounting = parts.twin, parts.guard, parts.accounting
        self._evaluation, self._forecaster = parts.evaluation, parts.forecaster
        self._encoders, self._torque = parts.encoders, parts.torque
        self._crank_zero, self._foot_load = parts.crank_zero, parts.foot_load

    def take(
        self, piece: Samples, changes: list[AlarmList], ends_period: bool
    ) -> tuple[SampleReports, list[CycleReport]]:
        """Process a piece of an evaluation period, and evaluate the gait cycles that end in it."""
        piece = self._guard.checked(self._accounting.not_counted(piece))
        if self._crank_zero:
            piece = self._crank_zero.passed(piece, ends_period)
            self._accounting.state.without_zero_s = self._crank_zero.unmonitored_s
        update = self._twin.update(piece)
        self._evaluation.add_samples(piece)
        if self._encoders:
            self._encoders.add_samples(piece)
        if self._torque:
            self._torque.add_samples(piece)
        if self._foot_load:
            self._foot_load.add_samples(piece)
        self._accounting.followed(update.samples)
        self._parts.state.happened = (*self._parts.state.happened, *update.events)[-_KEPT_EVENTS:]
        cycles: list[CycleReport] = []
        for statistics in update.cycles:
            if self._encoders:
                self._encoders.ended(statistics)
            if self._torque:
                self._torque.ended(statistics, self._parts.is_torque_wrong, statistics.load_peak_n)
            cycles.append(self._report(statistics))
            self._parts.state.has_ended = True
            sensor = self._foot_load.ended(statistics) if self._foot_load else None
            if self._foot_load and sensor is not None:
                self._twin.freeze_load(*self._foot_load.freezes(sensor))
            record = self._parts.state.torque
            self._add_changes(self._evaluation.end_cycle(cycles[-1], record, sensor), changes)
            if statistics.is_followed:
                self._explain_mismatch(statistics)
                self._keep_torque(statistics, cycles[-1])
        return update.samples, cycles

    def end_period(self, changes: list[AlarmList]) -> tuple[tuple[VerdictReport, ...], bool]:
        """Evaluate what is due at the end of an evaluation period.

        Returns
        -------
        verdicts : tuple of VerdictReport
            Changes of the verdict.
        is_new : bool
            Whether the verdict, an alarm or a gait cycle is new.
        """
        before = len(changes)
        self._add_changes(self._evaluation.end_period(self._accounting.state.skipped), changes)
        self._observe_encoders()
        self._observe_torque()
        self._add_changes(self.evaluate_clearances(), changes)
        verdicts, state = self._parts.judge.changed(self._parts.state), self._parts.state
        is_new = bool(verdicts) or state.has_ended or len(changes) > before
        state.has_ended = False
        return verdicts, is_new

    def evaluate_clearances(self) -> tuple[AlarmList, ...]:
        """Compare clearances by measurement and by estimate with their limits: at once, for none scatters."""
        board, values, sources = self._evaluation.board, {}, {}
        for joint in self._parts.judge.joints(self._parts.state):
            name = CLEARANCE.name(joint.joint)
            known = alarm_value(joint, board.alarms[name])
            if known is not None:
                values[name], sources[name] = known.clearance_m, (known.sigma_m, known.by)
        intake, cycles = self._twin.intake, self._parts.config.alarms.on_delay_cycles
        stamp_ns = intake.followed_stamp_ns or intake.newest_stamp_ns
        return board.evaluate(values, stamp_ns, cycles, sources) if values else ()

    def measured(self, joint: str) -> tuple[AlarmList, ...]:
        """Compare a new measurement with the limit; it ends an alarm of the clearance that it contradicts."""
        changes, board, name = self.evaluate_clearances(), self._evaluation.board, CLEARANCE.name(joint)
        own = next(each for each in self._parts.judge.joints(self._parts.state) if each.joint == joint)
        before = board.alarms[name]
        if own.measured is None or before.cause in ("", COUNTED) or before.level is Level.OK:
            return changes
        if is_surely_below(own.limit_m, own.measured.clearance_m, own.measured.sigma_m):
            board.acknowledge_one(name)
            intake = self._twin.intake
            stamp_ns = intake.followed_stamp_ns or intake.newest_stamp_ns
            changes = (*changes, AlarmList(stamp_ns, tuple(board.alarms.values())))
        return changes

    def part_changed(self, joint: str, replaced_ns: int) -> None:
        """Discard the growth and the estimates of the former part."""
        k, growth = self._clearance_joints.index(joint), self._parts.state.growth
        self._parts.state.growth = (*growth[:k], GrowthWindow(), *growth[k + 1 :])
        self._forecaster.replaced(joint, replaced_ns)
        last = self._parts.state.last
        if last:  # what was estimated is of the former part
            joints = [
                *last.joints[:k],
                attrs.evolve(last.joints[k], seen=None, shown=None),
                *last.joints[k + 1 :],
            ]
            self._parts.state.last = attrs.evolve(last, joints=tuple(joints))
        if self._encoders:
            self._encoders.replaced()
        if self._torque:
            self._torque.replaced(self._twin.clearance_mean_m)

    def _report(self, statistics: CycleStatistics) -> CycleReport:
        """Report of a gait cycle."""
        state, accounting = self._parts.state, self._accounting
        accounting.ended(statistics)
        if statistics.is_followed:
            state.growth = tuple(
                extended(window, float(growth), statistics.moving_s, self._parts.config.growth.window_cycles)
                for window, growth in zip(state.growth, statistics.growth_mean_m, strict=True)
            )
        estimates = self._clearance_estimates(statistics)
        limits = self._evaluation.board.clearance_limits_m
        sigma_m = accounting.sampling_sigma_m
        forecast = self._forecaster.after(
            statistics,
            self._worn_m(statistics),
            limits,
            lambda: self._parts.judge.is_forecast_valid(state.findings),
            sigma_m,
            self._parts.model_error,
        )
        report = cycle_report(
            statistics,
            accounting.state.cycles,
            self._parts.bushings,
            state.growth,
            self._parts.model_error,
            forecast,
            estimates,
            self._parts.measured,
            sigma_m.tolist(),
            self._parts.diagnosis,
        )
        state.last = latest(report, state.last)
        accounting.note_clearances(report)
        return report

    def _explain_mismatch(self, statistics: CycleStatistics) -> None:
        """Look for causes of a torque mismatch after a gait cycle."""
        allowed = self._evaluation.allowed_torque
        was_wrong, alarm = self._parts.is_torque_wrong, self._evaluation.board.alarms[MISMATCH.name()]
        self._parts.state.mismatch = self._parts.state.mismatch.with_cycle(
            statistics,
            alarm,
            lambda cycles: explanation(self._parts.mechanism, cycles, allowed),
        )
        if self._torque and self._parts.is_torque_wrong and not was_wrong:
            # the alarm rose some gait cycles after the torque became wrong
            before = self._parts.config.alarms.on_delay_cycles + 1
            first = self._parts.state.mismatch.cycles[0]
            self._torque.withdraw(first.begin_ns - before * (first.stamp_ns - first.begin_ns))

    def _keep_torque(self, statistics: CycleStatistics, report: CycleReport) -> None:
        """Record the torque of a gait cycle if it is as predicted."""
        is_sound = self._evaluation.is_torque_sound(report)
        why = self._evaluation.why_not_compared(statistics)
        self._parts.state.torque = self._parts.state.torque.with_cycle(statistics, report, is_sound, why)
        self._accounting.state.commissioned = self._parts.state.torque.totals

    def _observe_encoders(self) -> None:
        if self._encoders:
            new = self._encoders.end_period(self._twin.clearance_mean_m, self._twin.depth)
            if new:
                self._accounting.note(new)

    def _observe_torque(self) -> None:
        """Compare the drive torque with that of the counted leg, and correct what is surely counted wrong."""
        if not self._torque:
            return
        before = attrs.evolve(self._torque.state)
        correction = self._torque.end_period(self._twin.clearance_mean_m, self._twin.depth)
        is_wrong = self._parts.is_torque_wrong
        if not is_wrong:
            self._take_parameters(self._torque.parameters)
        if correction is not None and not is_wrong:
            self._correct(correction)
            self._torque.corrected(correction, self._twin.clearance_mean_m)
            self._twin.pull_block()
        self._note_torque(before)
        if correction is not None and not is_wrong:
            self._parts.keep()

    def _correct(self, correction: Correction) -> None:
        """Open a joint to the clearance that the drive torque shows, and count its wear from there."""
        stamp_ns, k = self._twin.intake.followed_stamp_ns, correction.joint
        joint = self._clearance_joints[k]
        was = self._accounting.correct(joint, correction.clearance_m)
        now = self._accounting.wear_of(joint)
        corrected = CorrectedClearance(
            stamp_ns=stamp_ns,
            joint=joint,
            clearance_m=float(self._twin.clearance_mean_m[k]),
            sigma_m=correction.change.sigma,
            before_m=was.mean_m,
            wear_m=now.mean_m,
            replaced_ns=now.replaced_ns,
        )
        self._accounting.note(Audit(stamp_ns, "diagnosis", "correct_clearance", was))
        self._accounting.note(corrected)
        self._forecaster.corrected(corrected)
        if self._encoders:
            self._encoders.state.updated_ns = 0  # the next estimate updates the forecast again
        growth = self._parts.state.growth
        self._parts.state.growth = (*growth[:k], GrowthWindow(), *growth[k + 1 :])

    def _take_parameters(self, found: LegParameters | None) -> None:
        """Let the twin walk on with the masses, lengths and friction that the drive torque shows."""
        if found is None or found == self._twin.parameters or not self._parts.config.diagnosis.correct:
            return
        self._twin.set_parameters(found)
        self._twin.pull_block()
        names = tuple(self._parts.mechanism.bodies)
        stamp_ns = self._twin.intake.followed_stamp_ns
        factors = tuple(found.mass.tolist()), tuple(found.length.tolist()), found.friction
        drive = found.compliance, found.damping
        self._accounting.note(IdentifiedLeg(stamp_ns, names, *factors, *drive, found.load, found.load_sigma))
        self._parts.state.growth = tuple(GrowthWindow() for _ in self._clearance_joints)
        self._parts.keep()

    def _note_torque(self, before: TorqueState) -> None:
        """Store the baselines and the references of the leg that are new since a state.

        To simulate a reference again takes a minute of walking.
        """
        if not self._torque:
            return
        known, stamp_ns = before.all_commissioned, self._twin.intake.followed_stamp_ns
        for one in self._torque.state.all_commissioned:
            if all(one is not other for other in known):
                self._accounting.note(one)
        names, made = tuple(self._parts.mechanism.bodies), [one.reference for one in before.known]
        for reference in self._torque.simulated_references:
            if all(reference is not other for other in made):
                self._accounting.note(SimulatedReference(stamp_ns, names, reference))
                self._parts.keep()

    def _clearance_estimates(self, statistics: CycleStatistics) -> tuple[ClearanceEstimate, ...] | None:
        """Clearances estimated from encoders; they update the forecast."""
        if not self._encoders:
            return None
        replaced_ns = [part.replaced_ns for part in self._accounting.state.parts]
        return update_forecast(
            self._encoders, self._forecaster, statistics, self._worn_m(statistics), replaced_ns
        )

    def _worn_m(self, statistics: CycleStatistics) -> Floats:
        """Wear of each part at the end of a gait cycle; the twin itself may be ahead."""
        fresh = [self._parts.mechanism.clearances[joint].radial_clearance for joint in self._clearance_joints]
        return np.asarray(statistics.clearance_mean_m - fresh)

    def _add_changes(self, changed: tuple[AlarmList, ...], changes: list[AlarmList]) -> None:
        for change in changed:
            self._twin.pull_block()
            changes.append(change)
            self._accounting.note_alarms(change)

"""The monitor: samples in, reports out; the live node and replay use the same code."""

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.accounting import Accounting
from leg_wear_monitor.monitor.alarms.alarm import Alarm
from leg_wear_monitor.monitor.config.fitting import check_limits, fitted, twin_settings
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.cycle_report import cycle_report, with_forecast
from leg_wear_monitor.monitor.diagnosis.diagnosis import Diagnosis, DiagnosisState
from leg_wear_monitor.monitor.diagnosis.observer import TorqueObserver
from leg_wear_monitor.monitor.encoders.clearance_estimate import ClearanceEstimate
from leg_wear_monitor.monitor.encoders.observer import EncoderObserver
from leg_wear_monitor.monitor.evaluation.evaluation import AlarmEvaluation
from leg_wear_monitor.monitor.evaluation.evaluation_period import A_CYCLE, EvaluationPeriods
from leg_wear_monitor.monitor.evaluation.specs import MISMATCH
from leg_wear_monitor.monitor.evaluation.torque_record import TorqueRecord
from leg_wear_monitor.monitor.forecast.forecaster import Forecaster
from leg_wear_monitor.monitor.forecast.growth import GrowthWindow, extended
from leg_wear_monitor.monitor.forecast.measurement import MeasurementResult
from leg_wear_monitor.monitor.forecast.model_error import model_error
from leg_wear_monitor.monitor.forecast_update import update_forecast
from leg_wear_monitor.monitor.inputs.guard import InputGuard
from leg_wear_monitor.monitor.judgement import Judge
from leg_wear_monitor.monitor.ledger.entry import Audit, CommissionedTorque, JointWear, Measurement
from leg_wear_monitor.monitor.ledger.file import LedgerError
from leg_wear_monitor.monitor.ledger.ledger import Ledger
from leg_wear_monitor.monitor.reports import (
    AlarmList,
    CycleReport,
    Lost,
    Reports,
    SampleReports,
    Status,
    VerdictReport,
    lost,
)
from leg_wear_monitor.monitor.resets import last_reset
from leg_wear_monitor.monitor.state import MonitorSnapshot, MonitorState
from leg_wear_monitor.monitor.status import statuses
from leg_wear_monitor.monitor.torque_causes.explainer import TorqueExplainer
from leg_wear_monitor.twin.digital_twin import DigitalTwin
from leg_wear_monitor.twin.sample import GAIT_SAMPLE, Samples
from leg_wear_monitor.twin.statistics import CycleStatistics, joined

WRONG_TORQUE = "the drive torque is wrong as received, see the status torque"
ACCELERATED = "wear is accelerated: clearances grow within the gait cycles that are compared"
_KEPT_EVENTS = 1


class WearMonitor:
    """Monitors the joint wear of a leg from its crank's motion and its drive torque.

    It advises: the absence of an alarm does not mean the joints are healthy.

    Parameters
    ----------
    mechanism : Mechanism
        As loaded from its file; the configuration names the clearance joints.
    config : MonitorConfig, optional
    ledger : Ledger, optional
        See `open_ledger`; its wear is continued. Without one, wear begins at 0 and is lost at the end.

    Attributes
    ----------
    mechanism : Mechanism
        With the clearance joints and clearances of the configuration.
    config : MonitorConfig
    clearance_joints : tuple of str
        The clearance joints, in the order of all values.

    Raises
    ------
    ConfigError, AssemblyError
        For an invalid mechanism or invalid parameters.
    """

    def __init__(
        self, mechanism: Mechanism, config: MonitorConfig | None = None, ledger: Ledger | None = None
    ) -> None:
        self.config = config or MonitorConfig()
        self.mechanism = fitted(mechanism, self.config)
        self.clearance_joints = self.mechanism.clearance_joints
        self._twin = DigitalTwin(self.mechanism, twin_settings(self.config))
        self._guard = InputGuard(self._twin.settings.tracker)
        self._accounting = Accounting(self._twin, ledger, self.config.ledger)
        cycle_ns = round(60.0e9 / abs(self.config.cadence.commanded_rpm))
        self._evaluation = AlarmEvaluation(self._twin, self.config, cycle_ns, self._guard)
        self._forecaster = Forecaster(
            self.mechanism,
            self.config.forecast,
            ledger.measurements if ledger else (),
            [part.replaced_ns for part in self._accounting.state.parts],
        )
        self._encoders = (
            EncoderObserver(self.mechanism, self.config, ledger.commissioned if ledger else None)
            if self.config.encoders.names
            else None
        )
        self._torque = (
            TorqueObserver(
                self.mechanism,
                self.config,
                self._twin.torque_size_nm,
                self._twin.clearance_mean_m,
                ledger.commissioned_torque if ledger else None,
            )
            if self.config.diagnosis.enabled and self.config.wear_acceleration == 1.0
            else None
        )
        self._explainer = TorqueExplainer(self.mechanism)
        self._judge = Judge(
            self._twin,
            self._evaluation,
            self._encoders,
            self._forecaster,
            self._accounting,
            lambda: self.diagnosis,
        )
        if ledger and ledger.entry:
            self._evaluation.board.restore(ledger.entry.alarms)
        speed = self._twin.settings.tracker.commanded_speed_radps
        self._model_error = model_error(self.mechanism, speed, self.config.wear_acceleration)
        self._evaluation_periods = EvaluationPeriods(cycle_ns // A_CYCLE)
        kept = TorqueRecord.of(self._accounting.state.commissioned)
        self._state = MonitorState(tuple(GrowthWindow() for _ in self.clearance_joints), kept)

    def warm_up(self) -> None:
        """Compile all kernels that `update` needs, before the first sample; takes about a minute once."""
        self._guard.warm_up()
        list(EvaluationPeriods(1).pieces(np.zeros(1, GAIT_SAMPLE)))
        self._twin.warm_up()

    def update(self, samples: Samples) -> Reports:
        """Process a block of samples.

        Parameters
        ----------
        samples : (n,) array of GAIT_SAMPLE
            In order of arrival. The reports do not depend on how the stream is cut into blocks.

        Returns
        -------
        Reports
            They end before the newest sample by the tracker's lag.
        """
        sampled: list[SampleReports] = []
        cycles: list[CycleReport] = []
        changes: list[AlarmList] = []
        verdicts: list[VerdictReport] = []
        for piece, ends_period in self._evaluation_periods.pieces(samples):
            reports, ended = self._take(piece, changes)
            sampled.append(reports)
            cycles += ended
            if ends_period:
                self._add_changes(self._evaluation.end_period(self._accounting.state.skipped), changes)
                self._observe_encoders()
                self._observe_torque()
                verdicts += self._judge.changed(self._state)
            self._accounting.keep_if_due(self._evaluation.board.alarms.values())
        samples_ = joined(sampled, len(self.clearance_joints))
        return Reports(samples_, tuple(cycles), tuple(changes), self.lost, tuple(verdicts))

    def pause(self, pause_s: float) -> None:
        """Mark a pause between the previous and the next samples, which is not a fault of the input.

        Parameters
        ----------
        pause_s : float
            From the newest stamp to the next.
        """
        self._evaluation.pause()
        self._accounting.pause(pause_s)

    @property
    def alarms(self) -> AlarmList:
        """State of all alarms."""
        return AlarmList(self._twin.intake.followed_stamp_ns, tuple(self._evaluation.board.alarms.values()))

    @property
    def verdict(self) -> VerdictReport:
        """The verdict now; `update` reports its changes at the ends of evaluation periods."""
        return self._judge.report(self._state)

    @property
    def clearance_limits_m(self) -> tuple[float, ...]:
        """Limit of the mean clearance of each clearance joint."""
        return self._evaluation.board.clearance_limits_m

    @property
    def diagnosis(self) -> Diagnosis:
        """What the drive torque shows of the clearances; nothing while it is wrong as received."""
        if self._torque:
            found = self._torque.diagnosis
            if not self._is_torque_wrong:
                return found
            settled = tuple(change for change in found.changes if change.is_corrected)
            return Diagnosis(state=DiagnosisState.WAITING, reason=WRONG_TORQUE, changes=settled)
        return Diagnosis(
            reason=ACCELERATED if self.config.diagnosis.enabled else "diagnosis.enabled is false"
        )

    @property
    def lost(self) -> Lost:
        """Samples and time that were not integrated so far."""
        accounting = self._accounting.state
        return lost(
            self._twin.intake,
            accounting.skipped,
            self._accounting.unmonitored_s,
            self._guard,
            accounting.pauses,
        )

    @property
    def used(self) -> dict[str, int]:
        """How many samples of each kind were used so far, by the names of `twin.kinds.KINDS`."""
        return dict(self._twin.intake.used)

    @property
    def measurements(self) -> tuple[Measurement, ...]:
        """Measured clearances, those of the ledger first."""
        return self._forecaster.measurements

    @property
    def wear_depth_m(self) -> Floats:
        """Wear depth (clearance joints, 2, sectors) of bushings and journals [m]; a copy."""
        return self._twin.depth

    def wear_of(self, joint: str) -> JointWear:
        """Present wear of a joint's part; raises LegWearError for a joint without clearance."""
        return self._accounting.wear_of(joint)

    def begin_run(self, boot_id: str) -> bool:
        """Store the boot id of the computer; return whether the last run is known to have another one."""
        ledger = self._accounting.ledger
        if ledger is None:
            return False
        ledger.boot_id = boot_id
        return bool(boot_id and ledger.last_run.boot_id) and boot_id != ledger.last_run.boot_id

    def counted(self, samples: Samples) -> NDArray[np.bool_]:
        """Samples that `update` would skip, because the ledger contains the wear of their time."""
        return self._accounting.counted(samples)

    def begin_epoch(self, stamp_ns: int, who: str) -> None:
        """Begin an epoch: the clock of the samples has restarted, and the following samples are counted."""
        self._accounting.begin_epoch()
        if self._torque:
            self._torque.begin_epoch()
        self._accounting.note(Audit(stamp_ns, who, "new_epoch"))
        self._keep()

    def status(self) -> tuple[Status, ...]:
        """Statuses for /diagnostics; their names and order are constant."""
        state = self._state
        return statuses(
            self._twin,
            self._evaluation,
            self._accounting,
            state.last,
            state.happened,
            state.torque,
            self.verdict.verdict,
            self.diagnosis,
            self._encoders,
            state.mismatch.explanation,
        )

    def configure(self, config: MonitorConfig) -> None:
        """Apply parameters that may change while the monitor runs; see `parameters.changed`.

        Raises
        ------
        ConfigError
            For limits that do not fit the mechanism; then nothing changes.
        """
        check_limits(config, self.mechanism)
        self.config = config
        self._evaluation.configure(config)
        if self._encoders:
            self._encoders.config = config
        if self._torque:
            self._torque.config = config

    def acknowledge(self, stamp_ns: int) -> tuple[tuple[Alarm, ...], tuple[Alarm, ...]]:
        """Acknowledge all alarms, and the interruption of the previous run.

        Returns
        -------
        cleared, kept : tuple of Alarm
            Alarms that had returned to normal, and alarms that stay until they do.
        """
        cleared, kept = self._evaluation.board.acknowledge()
        self._accounting.state.cut_off_s = None
        self._accounting.note_alarms(AlarmList(stamp_ns, self.alarms.alarms))
        self._judge.changed(self._state)
        if cleared or kept:
            self._keep()
        return cleared, kept

    def reset_wear(self, joint: str, stamp_ns: int, who: str) -> None:
        """Reset the wear of a joint whose part was replaced; its history stays in the ledger.

        Raises
        ------
        LegWearError
            For a joint without clearance.
        """
        was = self._accounting.replace(joint, stamp_ns)
        self._part_changed(joint, stamp_ns)
        self._accounting.note(Audit(stamp_ns, who, "reset_wear", was))
        self._keep()

    def undo_reset(self, joint: str, stamp_ns: int, who: str) -> JointWear:
        """Undo the last `reset_wear` of a joint whose part was not replaced.

        Returns
        -------
        JointWear
            Sum of the wear before the reset and since.

        Raises
        ------
        LegWearError
            For a joint without clearance, or if the ledger has no reset to undo.
        """
        reset = last_reset(self._accounting.ledger, joint, self._accounting.wear_of(joint))
        since = self._accounting.put_back(joint, reset.before)
        self._part_changed(joint, reset.before.replaced_ns)
        self._accounting.note(Audit(stamp_ns, who, "undo_reset", since, undoes=reset.id))
        self._keep()
        return self._accounting.wear_of(joint)

    def _part_changed(self, joint: str, replaced_ns: int) -> None:
        """Discard the growth and the estimates of the former part."""
        k, growth = self.clearance_joints.index(joint), self._state.growth
        self._state.growth = (*growth[:k], GrowthWindow(), *growth[k + 1 :])
        self._forecaster.replaced(joint, replaced_ns)
        if self._encoders:
            self._encoders.replaced()
        if self._torque:
            self._torque.replaced(self._twin.clearance_mean_m)

    def measure(
        self, joint: str, clearance_m: float, sigma_m: float, stamp_ns: int, who: str, accept: bool = False
    ) -> MeasurementResult:
        """Add a measured clearance to the ledger and update the forecast with it.

        Parameters
        ----------
        joint : str
        clearance_m, sigma_m : float
            Mean radial clearance, and its standard deviation.
        stamp_ns : int
        who : str
        accept : bool
            Whether the measurement counts even if it contradicts the model.

        Raises
        ------
        LegWearError
            For a joint without clearance, or impossible values.
        """
        wear = self._accounting.wear_of(joint)
        kept_ns = self._accounting.ledger.kept_ns if self._accounting.ledger else 0
        found = self._forecaster.measured(
            wear,
            clearance_m=clearance_m,
            sigma_m=sigma_m,
            stamp_ns=stamp_ns,
            who=who,
            kept_ns=kept_ns,
            accept=accept,
        )
        self._accounting.note(found.measurement)
        if self._encoders:
            self._encoders.state.updated_ns = 0  # the next estimate updates the forecast again
        self._keep()
        return found

    def renew_forecast(self) -> CycleReport | None:
        """Renew the forecast now; otherwise it may be a minute old.

        Returns
        -------
        CycleReport or None
            The last gait cycle with the new forecast; None before the first.
        """
        last = self._state.last
        if last is None:
            return None
        fresh = [self.mechanism.clearances[joint].radial_clearance for joint in self.clearance_joints]
        worn_m = np.asarray(self._twin.clearance_mean_m - fresh)
        limits = self._evaluation.board.clearance_limits_m
        self._state.last = with_forecast(
            last,
            self._forecaster.renewed(worn_m, limits, self._judge.is_forecast_valid(self.verdict.findings)),
        )
        return self._state.last

    def save(self) -> None:
        """Write an entry into the ledger now.

        Raises
        ------
        LegWearError
            If there is no ledger, or it could not be written.
        """
        ledger = self._accounting.ledger
        if ledger is None:
            raise LegWearError("no ledger is kept; set ledger.path")
        if not self._keep():
            raise LegWearError(ledger.fault or "the ledger is written at the end of the recording")

    def close(self) -> None:
        """Write the last entry and close the ledger.

        Raises
        ------
        LedgerError
            If a ledger that is written only at the end could not be written; then nothing is stored.
        """
        ledger = self._accounting.ledger
        if ledger is None:
            return
        if self._state.findings:
            self._judge.changed(self._state)
        kept = self._keep(closed=True)
        ledger.close()
        if ledger.at_end and not kept:
            raise LedgerError(f"{ledger.path}: {ledger.fault}; nothing of this run is in it")

    def abandon(self) -> None:
        """Close the ledger without a further entry."""
        if self._accounting.ledger:
            self._accounting.ledger.close()

    @property
    def ledger_loss(self) -> str:
        """Fault of the ledger when it was opened, and the possible loss; empty if there was none."""
        return self._accounting.ledger.loss if self._accounting.ledger else ""

    @property
    def is_all_counted(self) -> bool:
        """Whether there were samples, and the ledger already contained the wear of all of them."""
        return self._accounting.state.skipped > 0 and not self._accounting.state.spans

    def snapshot(self) -> MonitorSnapshot:
        """A copy of the whole state, except for the ledger's."""
        return MonitorSnapshot(
            self._twin.snapshot(),
            attrs.evolve(self._state),
            attrs.evolve(self._accounting.state),
            attrs.evolve(self._evaluation.state),
            attrs.evolve(self._forecaster.state),
            self._evaluation.board.alarms,
            self._evaluation_periods.state.copy(),
            self._guard.snapshot(),
            self._encoders.snapshot() if self._encoders else None,
            self._torque.snapshot() if self._torque else None,
        )

    def restore(self, snapshot: MonitorSnapshot) -> None:
        """Restore a snapshot of a monitor with the same mechanism and parameters, bit for bit."""
        self._twin.restore(snapshot.twin)
        self._state = attrs.evolve(snapshot.state)
        self._accounting.state = attrs.evolve(snapshot.accounting)
        self._evaluation.state = attrs.evolve(snapshot.evaluation)
        self._forecaster.state = attrs.evolve(snapshot.forecast)
        self._evaluation.board.alarms = snapshot.alarms
        self._evaluation_periods.state[:] = snapshot.evaluation_periods
        self._guard.restore(snapshot.guard)
        if self._encoders and snapshot.encoders:
            self._encoders.restore(snapshot.encoders)
        if self._torque and snapshot.torque:
            self._torque.restore(snapshot.torque)

    def _keep(self, closed: bool = False) -> bool:
        return self._accounting.keep(self._evaluation.board.alarms.values(), closed)

    def _take(self, piece: Samples, changes: list[AlarmList]) -> tuple[SampleReports, list[CycleReport]]:
        """Process a piece of an evaluation period, and evaluate the gait cycles that end in it."""
        piece = self._guard.checked(self._accounting.not_counted(piece))
        update = self._twin.update(piece)
        self._evaluation.add_samples(piece)
        if self._encoders:
            self._encoders.add_samples(piece)
        if self._torque:
            self._torque.add_samples(piece)
        self._accounting.followed(update.samples)
        self._state.happened = (*self._state.happened, *update.events)[-_KEPT_EVENTS:]
        cycles: list[CycleReport] = []
        for statistics in update.cycles:
            if self._encoders:
                self._encoders.ended(statistics)
            if self._torque:
                self._torque.ended(statistics)
            cycles.append(self._report(statistics))
            self._add_changes(self._evaluation.end_cycle(cycles[-1], self._state.torque), changes)
            self._explain_mismatch(statistics)
            self._keep_torque(statistics, cycles[-1])
        return update.samples, cycles

    def _report(self, statistics: CycleStatistics) -> CycleReport:
        """Report of a gait cycle."""
        state, accounting = self._state, self._accounting
        accounting.state.cycles += 1
        state.growth = tuple(
            extended(window, float(growth), statistics.moving_s, self.config.growth.window_cycles)
            for window, growth in zip(state.growth, statistics.growth_mean_m, strict=True)
        )
        estimates = self._clearance_estimates(statistics)
        limits = self._evaluation.board.clearance_limits_m
        forecast = self._forecaster.after(
            statistics,
            self._worn_m(statistics),
            limits,
            lambda: self._judge.is_forecast_valid(state.findings),
        )
        state.last = cycle_report(
            statistics,
            accounting.state.cycles,
            self.clearance_joints,
            state.growth,
            self._model_error,
            forecast,
            estimates,
        )
        accounting.note_clearances(state.last)
        return state.last

    @property
    def _is_torque_wrong(self) -> bool:
        """Whether drive torque or crank angle are wrong as received, by what explains a mismatch."""
        explained = self._state.mismatch.explanation
        return explained is not None and explained.is_input_fault

    def _explain_mismatch(self, statistics: CycleStatistics) -> None:
        """Look for causes of a torque mismatch after a gait cycle."""
        max_friction_nm = self._evaluation.torque_bounds.max_friction_nm
        self._state.mismatch = self._state.mismatch.with_cycle(
            statistics,
            self._evaluation.board.alarms[MISMATCH.name()],
            lambda cycles: self._explainer.explanation(
                cycles, self.config, self._twin.settings, max_friction_nm
            ),
        )

    def _keep_torque(self, statistics: CycleStatistics, report: CycleReport) -> None:
        """Record the torque of a gait cycle if it is as predicted."""
        is_sound = self._evaluation.is_torque_sound(report)
        self._state.torque = self._state.torque.with_cycle(statistics, report, is_sound)
        self._accounting.state.commissioned = self._state.torque.totals

    def _observe_encoders(self) -> None:
        if self._encoders:
            new = self._encoders.end_period(self._twin.clearance_mean_m, self._twin.depth)
            if new:
                self._accounting.note(new)

    def _observe_torque(self) -> None:
        """Compare the drive torque with that of the counted leg, and correct what is surely counted wrong."""
        if not self._torque:
            return
        before = self._torque.state.commissioned
        correction = self._torque.end_period(self._twin.clearance_mean_m, self._twin.depth)
        if correction is None or self._is_torque_wrong:
            self._note_commissioned(before)
            return
        joint = self.clearance_joints[correction.joint]
        was = self._accounting.correct(joint, correction.clearance_m)
        self._torque.corrected(correction, self._twin.clearance_mean_m)
        self._note_commissioned(before)
        self._accounting.note(
            Audit(self._twin.intake.followed_stamp_ns, "diagnosis", "correct_clearance", was)
        )
        growth, k = self._state.growth, correction.joint
        self._state.growth = (*growth[:k], GrowthWindow(), *growth[k + 1 :])
        self._keep()

    def _note_commissioned(self, before: CommissionedTorque | None) -> None:
        """Store the signature of the leg that was commissioned since."""
        now = self._torque.state.commissioned if self._torque else None
        if now is not None and now is not before:
            self._accounting.note(now)

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
        fresh = [self.mechanism.clearances[joint].radial_clearance for joint in self.clearance_joints]
        return np.asarray(statistics.clearance_mean_m - fresh)

    def _add_changes(self, changed: tuple[AlarmList, ...], changes: list[AlarmList]) -> None:
        for change in changed:
            changes.append(change)
            self._accounting.note_alarms(change)

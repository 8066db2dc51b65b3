"""The monitor: samples in, reports out; the live node and replay use the same code."""

from collections.abc import Iterable

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.configuration import Doubt
from leg_wear_monitor.configuration.strict import shown
from leg_wear_monitor.errors import ConfigError, LegWearError, closed_on_interrupt
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.alarms import Alarm
from leg_wear_monitor.monitor.config.fitting import check_limits
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.diagnosis.state import Diagnosis
from leg_wear_monitor.monitor.evaluation import EvaluationPeriods
from leg_wear_monitor.monitor.forecast.wear_coefficients import coefficient_doubts
from leg_wear_monitor.monitor.ledger.entry import (
    AlarmEvent,
    Audit,
    JointWear,
    Measurement,
    VerdictEvent,
)
from leg_wear_monitor.monitor.ledger.file import LedgerError
from leg_wear_monitor.monitor.ledger.ledger import Ledger, open_ledger
from leg_wear_monitor.monitor.monitored_leg import MonitoredLeg
from leg_wear_monitor.monitor.operator_actions import OperatorActions
from leg_wear_monitor.monitor.reports import (
    AlarmList,
    CycleReport,
    Lost,
    Reports,
    SampleReports,
    Status,
    VerdictReport,
)
from leg_wear_monitor.monitor.status import statuses
from leg_wear_monitor.monitor.verdict.situation import SEEN, Situation, is_observed, surest
from leg_wear_monitor.state import LegState, Verdict
from leg_wear_monitor.twin import CRANK
from leg_wear_monitor.twin.sample import GAIT_SAMPLE, Samples
from leg_wear_monitor.twin.statistics import CycleStatistics, joined


class WearMonitor(OperatorActions):
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
    reports_states : bool
        True if `update` reports the state of the leg, which takes 0.3 ms per report.

    Raises
    ------
    ConfigError, AssemblyError
        For an invalid mechanism or invalid parameters.

    Examples
    --------
    Four seconds of a crank that turns at 60 rpm, sampled at 200 Hz:

    >>> import numpy as np
    >>> import leg_wear_monitor as lw
    >>> monitor = lw.WearMonitor(lw.load_mechanism("bionic_leg"))
    >>> stamps_ns = 1_000_000_000 + 5_000_000 * np.arange(800)
    >>> reports = monitor.update(lw.gait_samples(stamps_ns, crank_angle_rad=2e-9 * np.pi * stamps_ns))
    >>> len(reports.cycles), monitor.verdict.verdict.state.value
    (2, 'watch')
    """

    def __init__(
        self,
        mechanism: Mechanism,
        config: MonitorConfig | None = None,
        ledger: Ledger | None = None,
    ) -> None:
        config = MonitorConfig() if config is None else config
        for name, given, kind in (("mechanism", mechanism, Mechanism), ("config", config, MonitorConfig)):
            if not isinstance(given, kind):
                fault = f"{shown(given)} is not a {kind.__name__}. Expected the result of load_{name}"
                raise ConfigError(name, "", fault)
        self._leg = leg = MonitoredLeg(mechanism, config, ledger)
        self.mechanism, self.clearance_joints = leg.mechanism, leg.clearance_joints
        self._twin, self._accounting, self._board = leg.twin, leg.accounting, leg.evaluation.board
        self.reports_states = True

    @property
    def config(self) -> MonitorConfig:
        """The present parameters."""
        return self._leg.config

    def warm_up(self) -> None:
        """Compile all kernels that `update` needs, before the first sample; takes about a minute once."""
        list(EvaluationPeriods(1).pieces(np.zeros(1, GAIT_SAMPLE)))
        self._leg.guard.warm_up()
        self._twin.warm_up()
        for observer in self._leg.observers:
            observer.warm_up()

    def go_live(self) -> None:
        """Keep up with samples as they are taken: never wait for a reference that threads simulate.

        On a machine that is too busy a reference comes into force later than in a replay.
        """
        for observer in self._leg.observers:
            observer.go_live()

    def note_late(self, is_late: bool) -> None:
        """Note whether samples may be missing because this program was late: their rate is then unknown."""
        self._leg.evaluation.is_late = is_late

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
        leg, accounting = self._leg, self._accounting
        sampled: list[SampleReports] = []
        cycles: list[CycleReport] = []
        changes: list[AlarmList] = []
        verdicts: list[VerdictReport] = []
        states: list[VerdictReport] = []
        for received, ends_period in leg.evaluation_periods.pieces(samples):
            # Guard: passes on new samples from one source, once the zero of the crank is known.
            piece = leg.guard.checked(accounting.not_counted(received))
            for observer in leg.observers:
                piece = observer.passed(piece, ends_period)
            accounting.without_zero_s = sum(each.unmonitored_s for each in leg.observers)
            # Twin: motion, forces and wear of the leg. The observers get the same samples.
            tracked = self._twin.update(piece)
            leg.judge.add_samples(piece)
            leg.evaluation.add_samples(piece)
            for observer in leg.observers:
                observer.add_samples(piece)
            accounting.followed(tracked.samples)
            sampled.append(tracked.samples)
            leg.happened = tracked.events[-1] if tracked.events else leg.happened
            # Observers, report and alarms of each gait cycle that ended.
            cycles += [self._end_cycle(statistics, changes) for statistics in tracked.cycles]
            if ends_period:
                # Alarms of the input and of clearances; they change only at ends of periods, which do not
                # depend on the blocks.
                before = len(changes)
                situation = self._end_period(changes)
                # Verdict: the most severe rule that holds for this situation.
                changed = leg.update_verdict(situation)
                verdicts += changed
                # Report: the state of the leg, if a gait cycle ended or something changed.
                is_new = bool(changed) or leg.has_ended or len(changes) > before
                leg.has_ended = False
                if is_new and self.reports_states:
                    states.append(self._state_report(leg.findings, situation))
            accounting.keep_if_due(self._board.alarms.values())
        tracked_samples = joined(sampled, len(self.clearance_joints))
        return Reports(
            tracked_samples, tuple(cycles), tuple(changes), self.lost, tuple(verdicts), tuple(states)
        )

    def _end_cycle(self, statistics: CycleStatistics, changes: list[AlarmList]) -> CycleReport:
        """Report a gait cycle, and evaluate its alarms."""
        leg = self._leg
        # A torque from a faulty input is not compared.
        refused = leg.judge.end_cycle(statistics)
        if refused:
            statistics = statistics.without_torque
        # Observers: estimates of this gait cycle.
        self._accounting.cycles += 1
        for observer in leg.observers:
            observer.end_cycle(statistics, bool(refused))
        # Report, with growth, estimates and forecast.
        forecast = leg.forecaster.after(
            statistics,
            leg.worn_m(statistics.clearance_mean_m),  # the twin itself may be ahead
            self.clearance_limits_m,
            lambda: leg.is_forecast_valid(leg.findings),
            leg.load_sigma,
        )
        seen = leg.encoders.estimates if leg.encoders else None
        leg.last = report = leg.report(statistics, forecast, seen, list(map(surest, leg.seen)))
        leg.has_ended = True
        self._accounting.note_clearances(report)
        # Alarms: values of the report and of the observers, which then learn from the gait cycle.
        values = {name: one for each in leg.observers for name, one in each.alarm_values(report).items()}
        self._take_changes(leg.evaluation.end_cycle(report, values, CRANK in refused), changes)
        for observer in leg.observers:
            observer.judge(statistics, report)
        return report

    def _end_period(self, changes: list[AlarmList]) -> Situation:
        """Evaluate the input and the observers' results; returns the inputs of the verdict."""
        leg = self._leg
        if leg.judge.end_period(leg.guard.torque_outliers, bool(leg.guard.cause)):
            # later gait cycles must not be compared with this torque; only ends of periods do not depend on
            # the blocks
            self._twin.forget_torque()
        is_refused = CRANK in leg.judge.trusted_before_ns
        self._take_changes(leg.evaluation.end_period(self._accounting.skipped, is_refused), changes)
        for observer in leg.observers:
            observer.end_period()
        situation = leg.situation()
        self._take_changes(leg.evaluate_clearances(situation.joints, self._twin.intake.stamp_ns), changes)
        return attrs.evolve(situation, alarms=tuple(self._board.alarms.values()))

    def _take_changes(self, changed: tuple[AlarmList, ...], changes: list[AlarmList]) -> None:
        """Add changes of alarms to the reports and to the ledger."""
        for change in changed:
            changes.append(change)
            self._accounting.note_alarms(change)

    def pause(self, pause_s: float) -> None:
        """Mark a pause between the previous and the next samples, which is not a fault of the input.

        Parameters
        ----------
        pause_s : float
            From the newest stamp to the next.
        """
        self._leg.evaluation.pause()
        self._accounting.pause(pause_s)

    @property
    def alarms(self) -> AlarmList:
        """State of all alarms."""
        return AlarmList(self._twin.intake.followed_stamp_ns, tuple(self._board.alarms.values()))

    @property
    def verdict(self) -> VerdictReport:
        """The verdict now; `update` reports its changes at the ends of evaluation periods."""
        return self._leg.verdict_report()

    @property
    def state_report(self) -> VerdictReport:
        """The verdict now, with the state of the leg."""
        situation = self._leg.situation()
        return self._state_report(self._leg.verdict_report(situation).findings, situation)

    def _state_report(self, findings: tuple[Verdict, ...], situation: Situation) -> VerdictReport:
        state = self._leg.state(findings, situation)
        return VerdictReport(state.stamp_ns, findings, state)

    @property
    def state(self) -> LegState:
        """The state of the leg now; `update` reports it after each gait cycle."""
        return self.state_report.state

    @property
    def stored_state(self) -> LegState:
        """The state of a leg that did not walk in this run, with the verdict of its ledger."""
        ledger = self._accounting.ledger
        if ledger is None or ledger.verdict is None:
            return self.state
        state = self._leg.state((ledger.verdict,), self._leg.situation())
        return attrs.evolve(state, stamp_ns=ledger.kept_ns)

    @property
    def predicted_torque_nm(self) -> float:
        """RMS of the drive torque that is predicted for the commanded gait."""
        return float(self._twin.torque_size_nm)

    @property
    def clearances_m(self) -> tuple[float, ...]:
        """Modelled mean clearance of each clearance joint."""
        return tuple(self._twin.clearance_mean_m.tolist())

    @property
    def clearance_limits_m(self) -> tuple[float, ...]:
        """Limit of the mean clearance of each clearance joint."""
        return self._board.clearance_limits_m

    @property
    def diagnosis(self) -> Diagnosis:
        """Clearances estimated from the drive torque; empty while the received torque is wrong."""
        return self._leg.torque.diagnosis

    @property
    def lost(self) -> Lost:
        """Samples and time that were not modelled so far."""
        return self._accounting.lost(self._leg.guard)

    @property
    def used(self) -> dict[str, int]:
        """Number of used samples of each kind so far, by the names of `twin.KINDS`."""
        return dict(self._twin.intake.used)

    @property
    def measurements(self) -> tuple[Measurement, ...]:
        """Measured clearances, the ledger's first."""
        return self._leg.forecaster.measurements

    @property
    def last_cycle(self) -> CycleReport | None:
        """Report of the last gait cycle; None before the first."""
        return self._leg.last

    @property
    def wear_depth_m(self) -> Floats:
        """Wear depth (clearance joints, 2, sectors) of bushings and journals [m]; a copy."""
        return self._twin.depth

    def wear_of(self, joint: str) -> JointWear:
        """Present wear of a joint's part; raises LegWearError for a joint without clearance."""
        return self._accounting.wear_of(joint)

    def begin_run(self, boot_id: str) -> bool:
        """Store the boot id of the computer; return whether the last run is known to have a different one."""
        ledger = self._accounting.ledger
        if ledger is None:
            return False
        ledger.boot_id = boot_id
        return bool(boot_id and ledger.last_run.boot_id) and boot_id != ledger.last_run.boot_id

    def counted(self, samples: Samples) -> NDArray[np.bool_]:
        """Samples that `update` would skip, because the ledger contains the wear of their time."""
        return self._accounting.counted(samples)

    def begin_epoch(self, stamp_ns: int, who: str) -> None:
        """Begin an epoch: the clock of the samples has restarted, and the following samples are new."""
        self._accounting.begin_epoch()
        for observer in self._leg.observers:
            observer.begin_epoch()
        self._accounting.note(Audit(int(stamp_ns), who, "new_epoch"))
        self._leg.keep()

    def status(self) -> tuple[Status, ...]:
        """Statuses for /diagnostics; their names and order are constant."""
        return statuses(self._leg, self.state_report)

    def configure(self, config: MonitorConfig) -> None:
        """Apply parameters that may change while the monitor runs; see `parameters.changed`.

        Raises
        ------
        ConfigError
            For limits that do not fit the mechanism; then nothing changes.
        """
        check_limits(config, self.mechanism)
        self._leg.config = config
        self._leg.evaluation.configure(config)
        self._leg.judge.config = config
        for observer in self._leg.observers:
            observer.configure(config)

    def note_alarms(self, stamp_ns: int, alarms: Iterable[Alarm]) -> None:
        """Store changed alarms that are not of this monitor in the ledger, such as those of its node."""
        own = {alarm.name for alarm in self.alarms.alarms}
        changed = [AlarmEvent(int(stamp_ns), alarm) for alarm in alarms if alarm.name not in own]
        for event in changed:
            self._accounting.note(event)
        if changed:
            self._leg.keep()

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
        if not self._leg.keep():
            raise LegWearError(ledger.fault or "the ledger will be written at the end of the recording")

    def close(self) -> None:
        """Write the last entry, close the ledger, and stop simulating ahead.

        Raises
        ------
        LedgerError
            If the last entry could not be written. Of a ledger that is written only at the end, nothing is
            stored then.
        """
        try:
            self._close_ledger()
        finally:
            for observer in self._leg.observers:
                observer.leave()

    def _close_ledger(self) -> None:
        ledger = self._accounting.ledger
        if ledger is None:
            return
        if self._leg.findings:
            is_noted = bool(self._leg.update_verdict())
            if not is_noted and any(is_observed(alarm, SEEN) for alarm in self.alarms.alarms):
                # the ledger's verdict names the last estimate
                last = self.verdict
                self._accounting.note(VerdictEvent(last.stamp_ns, last.verdict))
        for observer in self._leg.observers:
            observer.close()
        kept = self._leg.keep(closed=True)
        ledger.close()
        if not kept:
            missing = "this run" if ledger.at_end else "the time after its last entry"
            raise LedgerError(f"{ledger.path}: {ledger.fault}; it does not contain {missing}")

    def abandon(self) -> None:
        """Close the ledger without a further entry."""
        if self._accounting.ledger:
            self._accounting.ledger.close()

    @property
    def coefficient_doubts(self) -> tuple[Doubt, ...]:
        """Joints whose wear in the ledger, when opened, was modelled with a different wear coefficient."""
        ledger = self._accounting.ledger
        return coefficient_doubts(ledger.entry.joints, self.mechanism) if ledger and ledger.entry else ()

    @property
    def limit_doubts(self) -> tuple[Doubt, ...]:
        """Joints whose clearance limit was different when the ledger was last written."""
        limits = zip(self.clearance_joints, self.clearance_limits_m, strict=True)
        known = {joint: (self._accounting.limit_before_m(joint), limit) for joint, limit in limits}
        return tuple(
            Doubt(
                f"limit of joint {joint}",
                f"{1e3 * before:.4g} mm in the ledger and {1e3 * now:.4g} mm in the parameters",
            )
            for joint, (before, now) in known.items()
            if before is not None and before != now
        )

    @property
    def has_ledger_entry(self) -> bool:
        """True if the ledger had wear of this leg when it was opened."""
        ledger = self._accounting.ledger
        return ledger is not None and ledger.entry is not None

    @property
    def is_all_counted(self) -> bool:
        """True if there were samples, and the ledger already contained the wear of all of them."""
        return self._accounting.is_all_counted

    @property
    def already_counted_s(self) -> float:
        """Time of the samples that the ledger already contained the wear of [s]."""
        return self._accounting.skipped_s


# A monitor with the ledger in its parameters.


def open_monitor(mechanism: Mechanism, config: MonitorConfig, at_end: bool = False) -> WearMonitor:
    """Open the ledger and build the monitor that continues it.

    Building takes seconds, and a minute where kernels are compiled: if it is cut short, the ledger must not
    look as if a run that monitored something had been.

    Parameters
    ----------
    mechanism : Mechanism
    config : MonitorConfig
    at_end : bool
        True if the ledger is written at the end of the run alone, see `open_ledger`.

    Raises
    ------
    ConfigError, LedgerError
        For parameters or a ledger that cannot be used.
    """
    ledger = open_ledger(mechanism, config, at_end)
    if ledger is None:
        return WearMonitor(mechanism, config)
    with closed_on_interrupt(ledger.abandon):
        try:
            return WearMonitor(mechanism, config, ledger)
        except BaseException:
            ledger.abandon()
            raise

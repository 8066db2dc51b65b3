"""The leg that a monitor watches: its wear model, with all observers."""

from leg_wear_monitor.estimate.torque_model import torque_model
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor import alarm_specs
from leg_wear_monitor.monitor.config.inputs import AT_START
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.counted_leg import CountedLeg
from leg_wear_monitor.monitor.crank_zero import CrankZero
from leg_wear_monitor.monitor.encoder_watch import EncoderWatch
from leg_wear_monitor.monitor.evaluation import A_CYCLE, AlarmEvaluation, EvaluationPeriods
from leg_wear_monitor.monitor.foot_load import FootLoadCheck
from leg_wear_monitor.monitor.input_health import InputJudge
from leg_wear_monitor.monitor.inputs import InputGuard
from leg_wear_monitor.monitor.ledger.ledger import Ledger
from leg_wear_monitor.monitor.observer import Observer
from leg_wear_monitor.monitor.reports import AlarmList
from leg_wear_monitor.monitor.torque_watch import TorqueWatch
from leg_wear_monitor.monitor.verdict.situation import SEEN, KnownClearance
from leg_wear_monitor.state import Verdict
from leg_wear_monitor.twin.sample import NO_LOAD
from leg_wear_monitor.twin.statistics import Event


class MonitoredLeg(CountedLeg):
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
        """Alarms of the drive torque, if none came in the last gait cycle, or of values without a source."""
        is_gone = self.last is not None and not self.last.torque_samples
        silent = set(SEEN) - {each.shows for each in self.observers} | ({"torque"} if is_gone else set())
        alarms = self.evaluation.board.alarms.values()
        shown = frozenset(alarm.name for alarm in alarms if alarm.cause in silent)
        return alarm_specs.OF_TORQUE | shown if is_gone else shown

    def keep(self, closed: bool = False) -> bool:
        """Write an entry into the ledger; return whether it is on the disk."""
        return self.accounting.keep(self.evaluation.board.alarms.values(), closed)

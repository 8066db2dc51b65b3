"""The changing state of a monitor, without its ledger."""

import attrs

from leg_wear_monitor.monitor.accounting import AccountingState
from leg_wear_monitor.monitor.alarms.alarm import Alarm
from leg_wear_monitor.monitor.crank_zero.crank_zero import CrankZeroSnapshot
from leg_wear_monitor.monitor.diagnosis.observer import TorqueObserverSnapshot
from leg_wear_monitor.monitor.encoders.observer import EncoderSnapshot
from leg_wear_monitor.monitor.evaluation.evaluation import AlarmEvaluationState
from leg_wear_monitor.monitor.evaluation.mismatch_window import NO_MISMATCH, MismatchWindow
from leg_wear_monitor.monitor.evaluation.torque_record import TorqueRecord
from leg_wear_monitor.monitor.foot_load import FootLoadState
from leg_wear_monitor.monitor.forecast.forecaster import ForecastState
from leg_wear_monitor.monitor.forecast.growth import GrowthWindow
from leg_wear_monitor.monitor.reports import CycleReport
from leg_wear_monitor.monitor.verdict.verdict import Finding
from leg_wear_monitor.record import Records
from leg_wear_monitor.twin.digital_twin import TwinSnapshot
from leg_wear_monitor.twin.statistics import Event


@attrs.define
class MonitorState:
    """State beside twin, alarms and accounting; every value is immutable.

    ``findings`` are those of the last evaluation period; empty before the first.
    """

    growth: tuple[GrowthWindow, ...]
    torque: TorqueRecord
    last: CycleReport | None = None
    happened: tuple[Event, ...] = ()
    findings: tuple[Finding, ...] = ()
    mismatch: MismatchWindow = NO_MISMATCH


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

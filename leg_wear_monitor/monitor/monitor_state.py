"""All that changes in a monitor, but for its ledger."""

import attrs

from leg_wear_monitor.mechanism.arrays import Ints
from leg_wear_monitor.monitor.alarms import Alarm
from leg_wear_monitor.monitor.book import BookState
from leg_wear_monitor.monitor.encoder_watch import EncoderSnapshot
from leg_wear_monitor.monitor.forecaster import ForecastState
from leg_wear_monitor.monitor.growth import GrowthWindow
from leg_wear_monitor.monitor.input_guard import GuardSnapshot
from leg_wear_monitor.monitor.judge import JudgeState
from leg_wear_monitor.monitor.reports import CycleReport
from leg_wear_monitor.monitor.torque_record import TorqueRecord
from leg_wear_monitor.twin.digital_twin import TwinSnapshot
from leg_wear_monitor.twin.figures import Event


@attrs.define
class MonitorState:
    """What changes, beside twin, alarms and books; every value is immutable."""

    growth: tuple[GrowthWindow, ...]
    torque: TorqueRecord
    last: CycleReport | None = None
    happened: tuple[Event, ...] = ()


@attrs.frozen(eq=False)
class MonitorSnapshot:
    """All of a monitor but its ledger."""

    twin: TwinSnapshot
    state: MonitorState
    book: BookState
    judge: JudgeState
    forecast: ForecastState
    alarms: dict[str, Alarm]
    beats: Ints
    guard: GuardSnapshot
    encoders: EncoderSnapshot | None = None

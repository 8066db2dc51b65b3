"""What is known of a leg at one instant, in the shape of a replay's summary: so the page has its words."""

from collections.abc import Mapping, Sequence

import attrs

from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.alarms.words import ADVICE
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.evaluation.board import AlarmBoard
from leg_wear_monitor.monitor.ledger.entry import Measurement, WalkedLoad
from leg_wear_monitor.monitor.reports import Lost
from leg_wear_monitor.monitor.verdict.verdict import NO_GAIT_CYCLE, Figure, State, Verdict
from leg_wear_monitor.playback.result.condition import JointClearance, LifeHours
from leg_wear_monitor.playback.result.leg import ReplayLeg
from leg_wear_monitor.playback.result.parts import (
    LegLife,
    ReplayAlarm,
    ReplayAlarms,
    ReplayJoint,
    ReplayStatus,
)
from leg_wear_monitor.playback.result.recording import ReplayGait, ReplayMonitor, ReplayRecording
from leg_wear_monitor.playback.result.replay_history import ReplayHistory
from leg_wear_monitor.playback.result.replay_summary import ReplaySummary
from leg_wear_monitor.playback.summary import leg_shape, settings_of

# nothing was recorded: times are times of the day, not those since a recording's begin
_NOT_RECORDED = ReplayRecording(
    files=(), topics={}, time="header", is_partial=False, findings=(), crank_samples=0, torque_samples=0,
    begin_ns=0, end_ns=0, duration_s=0.0,
)  # fmt: skip

_NOTHING_LOST = Lost(
    unmonitored_s=0.0, already_counted=0, faulty={}, conflicting=0, implausible=0, duplicates=0, late=0,
    stray_stamps=0, outliers=0, gaps_bridged=0, gaps_lost=0, backward_jumps=0, failures=0,
)  # fmt: skip

NO_VERDICT = Verdict(
    state=State.NOT_MONITORED,
    joints=(),
    why="there is no verdict on the leg yet",
    since_ns=0,
    do="let the leg walk with the monitor running",
    evidence=(),
    not_valid=(),
    fault_code=NO_GAIT_CYCLE,
)


@attrs.frozen(eq=False)
class LegSetup:
    """The leg and the monitor's settings.

    Attributes
    ----------
    monitor : ReplayMonitor
    shape : ReplayLeg
    limits_m, new_m : dict of str to float
        Limit of each joint's mean clearance, and its clearance when new.
    report_s : float
        Time between two reports of the monitor on itself.
    """

    monitor: ReplayMonitor
    shape: ReplayLeg
    limits_m: dict[str, float]
    new_m: dict[str, float]
    report_s: float = 1.0

    @property
    def joints(self) -> tuple[str, ...]:
        """The clearance joints."""
        return self.monitor.clearance_joints


def leg_setup(config: MonitorConfig, mechanism: Mechanism) -> LegSetup:
    """The leg of a configuration, for a mechanism that `fitted` returned."""
    joints = mechanism.clearance_joints
    limits = AlarmBoard(config, joints).clearance_limits_m
    return LegSetup(
        monitor=settings_of(config, mechanism),
        shape=leg_shape(mechanism),
        limits_m=dict(zip(joints, limits, strict=True)),
        new_m={joint: float(mechanism.clearances[joint].radial_clearance) for joint in joints},
        report_s=config.diagnostics.period_s,
    )


def unknown_leg() -> LegSetup:
    """A leg without joints and shape, until its parameters are known."""
    default = MonitorConfig()
    monitor = ReplayMonitor(
        mechanism="",
        hardware_id="",
        clearance_joints=(),
        commanded_rpm=default.cadence.commanded_rpm,
        wear_acceleration=1.0,
        bushing_radius_m={},
        limits=default.limits,
        duty_hours_per_day=default.forecast.duty_hours_per_day,
    )
    return LegSetup(monitor, ReplayLeg(), {}, {})


@attrs.frozen(kw_only=True, eq=False)
class Known:
    """What a source knows of a leg; empty where it knows nothing.

    Attributes
    ----------
    verdict : Verdict
    history : ReplayHistory
    cycles : int
        Gait cycles over the leg's life.
    joints, clearances, life, forecast, alarms, status, measurements, walked
        As in `ReplaySummary`; `alarms` are those of now.
    missing : str
        Why there is no gait cycle; empty if there is.
    """

    verdict: Verdict
    history: ReplayHistory
    cycles: int = 0
    joints: Mapping[str, ReplayJoint] = attrs.Factory(dict)
    clearances: Mapping[str, JointClearance] = attrs.Factory(dict)
    life: Mapping[str, LifeHours | None] = attrs.Factory(dict)
    forecast: LegLife | None = None
    alarms: Sequence[ReplayAlarm] = ()
    status: Sequence[ReplayStatus] = ()
    measurements: Sequence[Measurement] = ()
    walked: Sequence[WalkedLoad] = ()
    missing: str = ""


def view_of(setup: LegSetup, known: Known) -> ReplaySummary:
    """What is known, as a summary; without lives that the verdict does not believe."""
    is_valid = Figure.FORECAST not in known.verdict.not_valid
    return ReplaySummary(
        verdict=known.verdict,
        recording=_NOT_RECORDED,
        monitor=setup.monitor,
        leg=setup.shape,
        cycles=known.cycles,
        gait=ReplayGait(
            believable_cycles=known.cycles, doubtful_cycles=0, missing=known.missing, is_counted=False
        ),
        joints=dict(known.joints),
        clearances=dict(known.clearances),
        life=dict(known.life) if is_valid else dict.fromkeys(known.life),
        forecast=known.forecast if is_valid else None,
        measurements=tuple(known.measurements),
        walked=tuple(known.walked),
        alarms=ReplayAlarms(now=tuple(known.alarms), changes=()),
        status=tuple(known.status),
        lost=_NOTHING_LOST,
        history=known.history,
        wear_depth_m={},
        advice=ADVICE,
    )


def over_time(view: ReplaySummary) -> ReplaySummary:
    """The same, its times since the first row of its history."""
    stamps = view.history.stamp_ns
    if not len(stamps):
        return view
    begin, end = int(stamps[0]), int(stamps[-1])
    times = attrs.evolve(_NOT_RECORDED, begin_ns=begin, end_ns=end, duration_s=1.0e-9 * (end - begin))
    return attrs.evolve(view, recording=times)

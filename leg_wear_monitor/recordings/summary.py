"""The result of a replay and its summary, the source of its files and its page.

A forecast that the verdict rejects has no remaining life.
"""

from array import array
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import attrs
import numpy as np

from leg_wear_monitor.errors import printable
from leg_wear_monitor.files import or_nan, with_same_fields
from leg_wear_monitor.mechanism.arrays import Floats, Ints
from leg_wear_monitor.mechanism.position import is_on_ground, outline_of
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.alarms import ADVICE, Alarm, has_changed, leg_alarm
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.forecast.forecast import JointForecast, LegForecast
from leg_wear_monitor.monitor.gait_evidence import GaitEvidence
from leg_wear_monitor.monitor.reports import AlarmList, CycleReport, JointReport
from leg_wear_monitor.monitor.wear_monitor import WearMonitor
from leg_wear_monitor.recordings.findings import Finding
from leg_wear_monitor.recordings.result import (
    EncoderEvidence,
    LegJoint,
    Place,
    ReplayGait,
    ReplayHistory,
    ReplayJoint,
    ReplayLeg,
    ReplayMonitor,
    ReplayRecording,
    ReplayStatus,
    ReplaySummary,
    WornDepth,
)
from leg_wear_monitor.state import AlarmChange, Figure, Level, Verdict
from leg_wear_monitor.twin import CRANK, TORQUE
from leg_wear_monitor.twin.sample import Samples, has_value_of
from leg_wear_monitor.wear import BUSHING, JOURNAL

# Replay results per gait cycle, stored as compact columns so that days of walking fit into memory.


SEEN_COLUMNS = ("estimated_m", "estimated_sigma_m")
"""More certain of the two estimates of a joint's clearance: from encoders or from the drive torque."""

_FIELDS = attrs.fields(ReplayHistory)
CYCLE_COLUMNS = tuple(field.name for field in _FIELDS if field.type == Floats)
SUMMARY_COLUMNS = {
    field.name.replace("modelled_", "clearance_"): field.name
    for field in _FIELDS
    if field.type == dict[str, Floats]
}
"""Columns of a joint in a summary, by their names in a report, whose clearance is the modelled one."""

_MOST_CHANGES = 10_000


class History:
    """Gait cycles and alarm changes, in order of arrival.

    Parameters
    ----------
    clearance_joints : tuple of str
        The clearance joints, in the order of the reports.

    Attributes
    ----------
    changes : list of tuples
        Stamp [ns] and state of the alarm after the change; the first ten thousand changes.
    worst : dict
        Highest level of each alarm kind.
    last : CycleReport or None
        The last gait cycle.
    """

    def __init__(self, clearance_joints: tuple[str, ...]) -> None:
        self.clearance_joints = clearance_joints
        self.changes: list[tuple[int, Alarm]] = []
        self.worst: dict[str, Level] = {}
        self.last: CycleReport | None = None
        self._stamps = array("q")
        self._cycles = array("d")
        self._joints = array("d")
        self._before: dict[str, Alarm] = {}

    def __len__(self) -> int:
        return len(self._stamps)

    def add_cycle(self, report: CycleReport) -> None:
        """Add a gait cycle."""
        self.last = report
        self._stamps.append(report.stamp_ns)
        self._cycles.extend(float(getattr(report, name)) for name in CYCLE_COLUMNS)
        for joint in report.joints:
            self._joints.extend(or_nan(getattr(joint, name)) for name in SUMMARY_COLUMNS)

    def add_alarms(self, alarms: AlarmList) -> None:
        """Add the alarms of a list that have changed."""
        for alarm in alarms.alarms:
            before = self._before.get(alarm.name, Alarm(kind=alarm.kind, subject=alarm.subject))
            if has_changed(before, alarm):
                self._before[alarm.name] = alarm
                self.worst[alarm.kind] = max(self.worst.get(alarm.kind, Level.OK), alarm.level)
                if len(self.changes) < _MOST_CHANGES:
                    self.changes.append((alarms.stamp_ns, alarm))

    @property
    def stamp_ns(self) -> Ints:
        """End times of the gait cycles [ns], shape (cycles,)."""
        return np.array(self._stamps, np.int64)

    def column(self, name: str) -> Floats:
        """One of `CYCLE_COLUMNS`, shape (cycles,)."""
        table = np.array(self._cycles).reshape(len(self), len(CYCLE_COLUMNS))
        return table[:, CYCLE_COLUMNS.index(name)]

    def joint_column(self, name: str) -> Floats:
        """One of `SUMMARY_COLUMNS`, shape (cycles, clearance joints); NaN where unknown."""
        table = np.array(self._joints).reshape(len(self), len(self.clearance_joints), len(SUMMARY_COLUMNS))
        return table[:, :, list(SUMMARY_COLUMNS).index(name)]


_Forecast = TypeVar("_Forecast", JointForecast, LegForecast)

# Condition of the leg at the end of a replay. A forecast that the verdict rejects has no remaining life.


def _valid(forecast: _Forecast | None, verdict: Verdict) -> _Forecast | None:
    """A forecast; without life and clearance if the verdict marks them as not valid."""
    if forecast is None or Figure.FORECAST not in verdict.not_valid:
        return forecast
    is_joint = isinstance(forecast, JointForecast)
    unknown: dict[str, Any] = {"clearance_m": None} if is_joint else {"first_probability": {}}
    return attrs.evolve(forecast, cycles=None, hours=None, **unknown)


# The summary of a replay, the source of its files and its page.


POINTS = 1000
"""Points of a thinned history, which keeps peaks of forces and of the mismatch."""

_LONGER, _LONGER_S = 1.05, 1.0  # stamps may span this factor times, plus these seconds, the logged time


@attrs.define(eq=False)
class ReplayResult:
    """Result of a replay.

    Attributes
    ----------
    monitor : WearMonitor
        Monitor in its final state, with a closed ledger.
    history : History
    files : list of pathlib.Path
    topics : dict
        Topics that were read, by their relative name in the node.
    time : str
        Time that stamped the samples.
    findings : list of Finding
        Faults of the recording.
    is_partial : bool
        True if recorded data are lost or may be wrong.
    evidence : GaitEvidence
        Evidence on whether the tracked motion is a gait of this leg.
    crank_samples, torque_samples : int
        Numbers of samples; a crank sample with an effort counts as both.
    begin_ns, end_ns : int
        First and last stamp of valid samples [ns]; 0 if there are none.
    logged_s : float
        Time between the first and the last message, without pauses [s].
    paused_s : float
        Total duration of the pauses [s].
    """

    monitor: WearMonitor
    history: History
    files: list[Path]
    topics: dict[str, str]
    time: str
    evidence: GaitEvidence
    findings: list[Finding] = attrs.Factory(list)
    is_partial: bool = False
    crank_samples: int = 0
    torque_samples: int = 0
    begin_ns: int = 0
    end_ns: int = 0
    logged_s: float = 0.0
    paused_s: float = 0.0

    @property
    def is_believable(self) -> bool:
        """True if at least one gait cycle fits this leg; otherwise no value is meaningful."""
        return self.evidence.believable > 0

    @property
    def is_unusable(self) -> bool:
        """True if no gait cycle fits this leg; a remainder after wear in the ledger may have no cycle."""
        is_rest = self.monitor.lost.already_counted > 0 and not self.evidence.doubtful
        return not self.is_believable and not is_rest

    @property
    def duration_s(self) -> float:
        """Time from the first to the last stamp, without pauses [s]; if stamps jump, time of arrival."""
        stamped_s = (self.end_ns - self.begin_ns) / 1e9 - self.paused_s
        jumps = not 0.0 <= stamped_s <= _LONGER * self.logged_s + _LONGER_S
        return self.logged_s if jumps else stamped_s

    def summary(
        self, wall_s: float | None = None, made_with: Mapping[str, str] | None = None
    ) -> ReplaySummary:
        """Summary of the replay as classes, which give JSON and tables.

        Parameters
        ----------
        wall_s : float, optional
            Wall-clock duration of the replay [s].
        made_with : mapping of str to str, optional
            Names and versions of the programs that made it.
        """
        last, monitor = self.history.last, self.monitor
        state = monitor.state
        is_known = self.is_believable and last is not None
        verdict, known = state.verdict, attrs.asdict(state, recurse=False)
        known["alarms"] = attrs.evolve(state.alarms, changes=_changes(self))
        forecast = _valid(last.forecast, verdict) if is_known and last else None
        return ReplaySummary(
            **(known if is_known else known | {"clearances": {}, "life": {}}),
            recording=_recording(self),
            monitor=settings_of(monitor.config, monitor.mechanism),
            leg=leg_shape(monitor.mechanism),
            wall_s=wall_s,
            real_time_factor=self.duration_s / wall_s if wall_s else None,
            cycles=len(self.history),
            gait=_gait(self),
            joints=_joints(self, verdict) if is_known else {},
            forecast=forecast,
            measurements=tuple(monitor.measurements),
            status=tuple(with_same_fields(ReplayStatus, status) for status in monitor.status()),
            lost=monitor.lost,
            history=_history(self.history),
            wear_depth_m=_wear(self),
            advice=ADVICE,
            made_with=dict(made_with or {}),
        )

    def count(self, samples: Samples) -> None:
        """Count samples that are passed to the monitor."""
        self.evidence.add_samples(samples)
        self.crank_samples += int(np.count_nonzero(has_value_of(samples, CRANK)))
        self.torque_samples += int(np.count_nonzero(has_value_of(samples, TORQUE)))
        stamps = samples["stamp_ns"][samples["fault"] == 0]
        if len(stamps):
            self.begin_ns = self.begin_ns or int(stamps[0])
            self.end_ns = int(stamps[-1])


def _recording(result: ReplayResult) -> ReplayRecording:
    return with_same_fields(
        ReplayRecording,
        result,
        files=tuple(printable(str(path)) for path in result.files),
        topics={role: printable(topic) for role, topic in result.topics.items()},
        findings=tuple(result.findings),
    )


def settings_of(config: MonitorConfig, mechanism: Mechanism) -> ReplayMonitor:
    """Settings that the results depend on, for a mechanism that `fitted` returned."""
    joints = mechanism.clearance_joints
    return ReplayMonitor(
        mechanism=mechanism.name,
        hardware_id=config.hardware,
        clearance_joints=tuple(joints),
        commanded_rpm=config.cadence.commanded_rpm,
        wear_acceleration=config.wear_acceleration,
        bushing_radius_m={joint: mechanism.clearances[joint].bushing_radius for joint in joints},
        limits=config.limits,
    )


def leg_shape(mechanism: Mechanism) -> ReplayLeg:
    """A mechanism as a picture needs it."""
    bodies, joints = outline_of(mechanism)
    return ReplayLeg(
        bodies_m={body: _places(corners) for body, corners in bodies.items()},
        joints={
            name: LegJoint(
                label=mechanism.joints[name].label,
                place_m=_places(place[None])[0],
                is_on_ground=is_on_ground(mechanism, name),
            )
            for name, place in joints.items()
        },
    )


def _places(points: Floats) -> tuple[Place, ...]:
    """Points (n, 2) to the micrometre."""
    return tuple((round(x, 6) + 0.0, round(y, 6) + 0.0) for x, y in points.tolist())


def _gait(result: ReplayResult) -> ReplayGait:
    return ReplayGait(
        believable_cycles=result.evidence.believable,
        doubtful_cycles=result.evidence.doubtful,
        missing=printable(result.evidence.missing()) if result.is_unusable else "",
        is_counted=result.monitor.is_all_counted,
    )


def _joints(result: ReplayResult, verdict: Verdict) -> dict[str, ReplayJoint]:
    """Last values of each joint, and the maximum and the mean of its forces."""
    history = result.history
    joints = history.last.joints if history.last else ()
    return {joint.joint: _joint(history, k, joint, verdict) for k, joint in enumerate(joints)}


def _joint(history: History, k: int, joint: JointReport, verdict: Verdict) -> ReplayJoint:
    clearance, peak, mean, impacts = (
        history.joint_column(name)[:, k]
        for name in ("clearance_m", "peak_force_n", "mean_force_n", "impacts")
    )
    return with_same_fields(
        ReplayJoint,
        joint,
        opened_m=float(clearance[-1] - clearance[0]),
        forecast=_valid(joint.forecast, verdict),
        peak_force_n=_of_known(np.max, peak),
        mean_force_n=_of_known(np.mean, mean),
        encoders=with_same_fields(EncoderEvidence, joint.seen) if joint.seen else None,
        impacts=int(np.nansum(impacts)),
    )


def _of_known(statistic: Callable[[Floats], Any], values: Floats) -> float | None:
    """A statistic of the known values, such as forces of tracked gait cycles."""
    known = values[np.isfinite(values)]
    return float(statistic(known)) if len(known) else None


def _changes(result: ReplayResult) -> tuple[AlarmChange, ...]:
    changes = result.history.changes
    return tuple(AlarmChange(stamp_ns=stamp_ns, alarm=leg_alarm(alarm)) for stamp_ns, alarm in changes)


def _history(history: History) -> ReplayHistory:
    """Columns over groups of gait cycles: last value of each; maximum of peaks, sum of impacts."""
    last = _ends(len(history))
    columns: dict[str, Any] = {name: _thinned(name, history.column(name), last) for name in CYCLE_COLUMNS}
    for name, shown in SUMMARY_COLUMNS.items():
        thinned = _thinned(name, history.joint_column(name), last)
        columns[shown] = {joint: thinned[:, k] for k, joint in enumerate(history.clearance_joints)}
    return ReplayHistory(stamp_ns=history.stamp_ns[last], **columns)


def _thinned(name: str, column: Floats, last: Ints) -> Floats:
    """A column over groups of gait cycles that end with these indices."""
    begins = np.concatenate([[0], last[:-1] + 1]) if len(last) else last
    if name in ("peak_force_n", "torque_mismatch") and len(last):
        return np.asarray(np.fmax.reduceat(column, begins))
    if name == "impacts" and len(last):
        return np.asarray(np.add.reduceat(np.nan_to_num(column), begins))
    return np.asarray(column[last])


def _ends(n: int) -> Ints:
    """Last index of each of at most `POINTS` groups of n cycles."""
    groups = min(n, POINTS)
    return np.asarray((np.arange(groups) + 1) * n // max(groups, 1) - 1, np.int64)


def _wear(result: ReplayResult) -> dict[str, WornDepth]:
    depth: Floats = result.monitor.wear_depth_m
    return {
        joint: WornDepth(depth[k, BUSHING], depth[k, JOURNAL])
        for k, joint in enumerate(result.monitor.clearance_joints)
    }

"""History of a replay, gait cycle by gait cycle, and the sink of its messages."""

from array import array
from contextlib import nullcontext, suppress
from pathlib import Path

import numpy as np

from leg_wear_monitor.files import or_nan
from leg_wear_monitor.mechanism.arrays import Floats, Ints
from leg_wear_monitor.monitor.alarms import Alarm, has_changed
from leg_wear_monitor.monitor.config.parameters import NODE
from leg_wear_monitor.monitor.reports import AlarmList, CycleReport, Reports
from leg_wear_monitor.monitor.wear_monitor import WearMonitor
from leg_wear_monitor.recordings.findings import RecordingError
from leg_wear_monitor.recordings.leg_markers import LegDrawing, LegMarkers
from leg_wear_monitor.recordings.outputs import ALARMS, DIAGNOSTICS, FORECAST, STATE, VERDICT, Messages
from leg_wear_monitor.recordings.streams import ForecastTimes, topic_of
from leg_wear_monitor.state import Level

# Replay results per gait cycle, stored as compact columns so that days of walking fit into memory.


JOINT_COLUMNS = (
    "clearance_m",
    "clearance_max_m",
    "growth_m_per_cycle",
    "peak_force_n",
    "p99_force_n",
    "mean_force_n",
    "impacts",
)
SEEN_COLUMNS = ("estimated_m", "estimated_sigma_m")
"""More certain of the two estimates of a joint's clearance: from encoders or from the drive torque."""

_OF_A_JOINT = (*JOINT_COLUMNS, *SEEN_COLUMNS)

SUMMARY_COLUMNS = {name: name.replace("clearance_", "modelled_") for name in _OF_A_JOINT}
"""Names of the columns of a joint in a summary, whose one clearance of a joint is the believed one."""

CYCLE_COLUMNS = (
    "cycle",
    "cadence_rpm",
    "moving_s",
    "bridged_s",
    "measured_torque_rms_nm",
    "predicted_torque_rms_nm",
    "torque_mismatch",
    "load_n",
    "friction_nm",
)
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
            self._joints.extend(or_nan(getattr(joint, name)) for name in _OF_A_JOINT)

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
        """One of `JOINT_COLUMNS` or `SEEN_COLUMNS`, shape (cycles, clearance joints); NaN where unknown."""
        table = np.array(self._joints).reshape(len(self), len(self.clearance_joints), len(_OF_A_JOINT))
        return table[:, :, _OF_A_JOINT.index(name)]


# Writes reports to an MCAP file, as the messages that a live node would have published.


_CHUNK_BYTES = 2**20


class Sink:
    """An MCAP file with all topics of the monitor, including those without messages.

    Parameters
    ----------
    path : pathlib.Path
    monitor : WearMonitor
    node : str
        Full name of the publishing node.

    Raises
    ------
    RecordingError
        If writing to the disk fails.
    """

    def __init__(self, path: Path, monitor: WearMonitor, node: str = NODE) -> None:
        from leg_wear_monitor.recordings.mcap_writer import McapWriter  # a dashboard is without this library

        self._monitor = monitor
        self._messages = Messages(monitor.config, monitor.clearance_joints, node)
        self._writer = McapWriter(path, chunk_bytes=_CHUNK_BYTES)
        self._channels = {
            output: self._writer.channel(topic_of(output, node), output.type, output.qos)
            for output in self._messages.outputs
        }
        self._start, self._has_begun = (monitor.alarms, monitor.state_report), False
        self._forecasts = ForecastTimes()
        self._markers = (
            LegMarkers(monitor, LegDrawing(monitor.mechanism)) if monitor.config.publish_markers else None
        )

    def __enter__(self) -> "Sink":
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        # report the original error, not one from closing the file
        with suppress(RecordingError) if kind else nullcontext():
            self._writer.close()

    def take(self, reports: Reports, stamp_ns: int) -> None:
        """Write reports and the status of the monitor after them.

        Parameters
        ----------
        reports : Reports
        stamp_ns : int
            Stamp of the status [ns]; 0 if no time is known yet.
        """
        if stamp_ns > 0 and not self._has_begun:
            self._has_begun = True  # like the node, begin with all alarms, the verdict and the state
            alarms, report = self._start
            self._writer.write(self._channels[ALARMS], stamp_ns, self._messages.alarms(alarms))
            self._writer.write(self._channels[VERDICT], stamp_ns, self._messages.verdict(report))
            self._writer.write(self._channels[STATE], stamp_ns, self._messages.state(report))
        for outgoing in self._messages.of(reports):
            self._writer.write_many(self._channels[outgoing.output], outgoing.stamp_ns, outgoing.messages)
        for outgoing in self._markers.of(reports) if self._markers else ():
            self._writer.write_many(self._channels[outgoing.output], outgoing.stamp_ns, outgoing.messages)
        for cycle in self._forecasts.due(reports):
            raw = self._messages.forecast(cycle)
            self._writer.write(self._channels[FORECAST], cycle.stamp_ns, raw)
        if stamp_ns > 0:
            raw = self._messages.diagnostics(stamp_ns, self._monitor.status())
            self._writer.write(self._channels[DIAGNOSTICS], stamp_ns, raw)

"""Checks that need the node (silence, publishers, joint names, clock), for statuses, alarms and the log."""

import math
import time
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import attrs
from rclpy.impl.rcutils_logger import RcutilsLogger
from rclpy.node import Node

from leg_wear_monitor.monitor.alarm_specs import AHEAD, SILENCE
from leg_wear_monitor.monitor.alarms import Alarm, amount, leg_alarm
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.reports import AlarmList, Status, VerdictReport
from leg_wear_monitor.monitor.status import alarms_status, verdict_status
from leg_wear_monitor.monitor.verdict.rules import findings
from leg_wear_monitor.monitor.verdict.situation import Situation
from leg_wear_monitor.monitor.verdict.verdict import code_of_rule, dated
from leg_wear_monitor.recordings.message_checks import WrenchAxis, wanted_interfaces
from leg_wear_monitor.recordings.streams import INTERFACES, WRENCH_STAMPED, streams_of
from leg_wear_monitor.ros import health
from leg_wear_monitor.ros.inputs import (
    Arrival,
    CrankNames,
    InputTopic,
    InterfaceNames,
    publishers_of,
)
from leg_wear_monitor.state import LegAlarms, Level, Verdict
from leg_wear_monitor.twin import CRANK, KINDS
from leg_wear_monitor.twin.sample import NO_FAULT, Samples

if TYPE_CHECKING:
    from leg_wear_monitor.monitor.wear_monitor import WearMonitor


# Log of the node: alarm changes and new faults, each logged once.


# Statuses that are logged; the other statuses follow from alarms, which are logged already.
STATUSES = ("topics", "cpu_load", "recording", "ledger", "clock")


def _write(logger: RcutilsLogger, level: Level, text: str) -> None:
    # separate calls: rclpy rejects one call site that changes its severity
    if level is Level.ERROR:
        logger.error(text)
    elif level is Level.WARN:
        logger.warning(text)
    else:
        logger.info(text)


class AlarmLog:
    """Logs a line for each alarm whose present level changes.

    Parameters
    ----------
    logger : rclpy logger
    """

    def __init__(self, logger: RcutilsLogger) -> None:
        self._logger = logger
        self._present: dict[str, Level] = {}

    def note(self, alarms: AlarmList) -> None:
        """Log the changes in a list of the present state of all alarms."""
        for alarm in alarms.alarms:
            before = self._present.get(alarm.name, Level.OK)
            if alarm.present is not before:
                self._present[alarm.name] = alarm.present
                _write(self._logger, alarm.present, line_of(alarm, before, alarms.stamp_ns))


def line_of(alarm: Alarm, before: Level, stamp_ns: int) -> str:
    """Log line for an alarm's change of level: name, levels, value, limit, time."""
    limit = "" if math.isnan(alarm.limit) else f", limit {amount(alarm.limit, alarm.unit)}"
    value = f"{amount(alarm.value, alarm.unit)}{limit}"
    time = f" at {health.utc(stamp_ns)}" if stamp_ns > 0 else ""
    latched = ", kept until it is acknowledged" if alarm.level > alarm.present else ""
    return f"alarm {alarm.name}: {before.name} -> {alarm.present.name} ({value}){time}{latched}"


class StatusLog:
    """Logs a line when a status becomes a fault, changes to a different fault, or recovers.

    Parameters
    ----------
    logger : rclpy logger
    """

    def __init__(self, logger: RcutilsLogger) -> None:
        self._logger = logger
        self._before: dict[str, tuple[Level, str]] = {}

    def note(self, statuses: Iterable[Status]) -> None:
        """Log the changes of present statuses; only those in `STATUSES` are logged."""
        for status in statuses:
            if status.name not in STATUSES:
                continue
            now = (status.level, status.message)
            level, _ = before = self._before.get(status.name, (Level.OK, ""))
            if now != before and (status.level is not Level.OK or level is not Level.OK):
                _write(self._logger, status.level, f"{status.name}: {status.message}")
            self._before[status.name] = now


# A killed publisher stays in the graph until its lease expires (20 s by default):two publishers with one
# name may be a single restarted publisher.
_SAME_NAME_S = 30.0
# A new node may publish other joints than the crank, which its first message shows.
_NEW_S = 3.0
_OTHERS_S = 60.0  # time that a publisher stays known, because some publish rarely
_OF_A_BLOCK = 4  # number of compared wrenches, to limit the cost
# rules of the verdict that a torque about a wrong axis can trigger
_OF_AXIS = (
    "TORQUE_CONSTANT", "FRICTION_CHANGED", "LOAD_NOT_OBSERVED", "MECHANISM_CHANGED", "TORQUE_BIAS",
    "TORQUE_MASS", "TORQUE_MISMATCH", "TORQUE_SCALE", "TORQUE_TIMING",
)  # fmt: skip


class Supervision:
    """Supervises the inputs and outputs of a node.

    Parameters
    ----------
    node : rclpy.node.Node
    monitor : WearMonitor
    config : MonitorConfig
    """

    def __init__(self, node: Node, monitor: "WearMonitor", config: MonitorConfig) -> None:
        self._node, self._monitor = node, monitor
        self._started_ns = time.monotonic_ns()
        kinds = tuple(KINDS[stream.kind].name for stream in streams_of(config))
        self._silence = health.Silence(kinds, self._started_ns, time.time_ns())
        self._names = CrankNames(config.crank_joint)
        torque = config.drive_torque
        self._interfaces = InterfaceNames(config.crank_joint, wanted_interfaces(config))
        predicted_nm = monitor.predicted_torque_nm / abs(torque.scale * torque.gear_ratio)
        self._axis = WrenchAxis(torque.axis, predicted_nm)
        self._ahead_s = dict.fromkeys(kinds, 0.0)
        self._alarms, self._clock = health.NodeAlarms(kinds), health.ClockMonitor()
        self._alarm_log, self._status_log = AlarmLog(node.get_logger()), StatusLog(node.get_logger())
        self._several_since: dict[str, int] = {}
        self._most_ahead_s, self._other_axis, self._noted_ns = 0.0, "", 0
        self.inputs: Sequence[InputTopic] = ()

    @property
    def is_current(self) -> bool:
        """True if usable crank samples are arriving."""
        return self._silence.level(KINDS[CRANK].name, time.monotonic_ns()) is Level.OK

    def excuse(self, late_ns: int) -> None:
        """Exclude a time in which the node was late [ns] from the silence of its inputs."""
        self._silence.excuse(late_ns)
        for topic in self.inputs:
            topic.heard_ns += late_ns if topic.heard_ns else 0

    def note(self, arrivals: Sequence[Arrival], samples: Samples) -> None:
        """Record processed messages and their samples."""
        self._names.note(arrivals, samples, time.monotonic_ns())
        pairs = zip(arrivals, samples["fault"], strict=True)
        wrenches = [one.raw for one, fault in pairs if one.code == WRENCH_STAMPED and fault == NO_FAULT]
        self._axis.add(wrenches[-_OF_A_BLOCK:])
        self._interfaces.note(arrivals, samples)
        self._note_stamps(samples)
        self._silence.note(self._monitor.used, time.monotonic_ns(), time.time_ns())

    def _note_stamps(self, samples: Samples) -> None:
        """Record by how much the stamps of each kind are ahead of the clock, at most since the last check."""
        now_ns, before_ns = self._now_ns(), self._noted_ns
        self._noted_ns = now_ns
        if now_ns < before_ns:  # the clock was set back after these samples had arrived
            return
        for code, kind in KINDS.items():
            stamps = samples["stamp_ns"][(samples["kind"] == code) & (samples["fault"] == NO_FAULT)]
            if now_ns > 0 and len(stamps) and kind.name in self._ahead_s:
                ahead_s = (int(stamps.max()) - now_ns) * 1.0e-9
                self._ahead_s[kind.name] = max(self._ahead_s[kind.name], ahead_s)

    def _now_ns(self) -> int:
        """Present ROS time [ns]; 0 if there is none."""
        return int(self._node.get_clock().now().nanoseconds)

    def alarms(self, alarms: AlarmList) -> AlarmList:
        """Merge the monitor's alarms with the node's alarms, and log the changes."""
        shown = self._alarms.beside(alarms)
        self._alarm_log.note(shown)
        return shown

    def verdict(self, report: VerdictReport) -> VerdictReport:
        """Merge the monitor's verdict with the node's knowledge; without any, the verdict is unchanged."""
        own, monitors = self._alarms.raised, report.findings
        if self._other_axis:
            monitors = tuple(map(self._with_axis, monitors))
        found = findings(Situation(alarms=own)) if own else ()
        if not found and monitors == report.findings:
            return report
        return attrs.evolve(report, findings=(*monitors, *dated(found, (), report.stamp_ns)))

    def state(self, report: VerdictReport) -> VerdictReport:
        """Merge the state of the leg with the node's own alarms and its part of the verdict."""
        report, leg = self.verdict(report), report.leg
        if leg is None or not self._alarms.raised:
            return report
        now = health.with_worse(leg.alarms.now, map(leg_alarm, self._alarms.raised))
        return attrs.evolve(report, leg=attrs.evolve(leg, alarms=LegAlarms(now=now)))

    def _with_axis(self, finding: Verdict) -> Verdict:
        """Issue of the drive torque with its cause, if the torque is about a different axis."""
        if code_of_rule(finding) not in _OF_AXIS:
            return finding
        do = "correct drive_torque.axis and start the monitor again; then acknowledge the alarms"
        return attrs.evolve(finding, why=f"{finding.why}; {self._other_axis}", do=do)

    def acknowledge(self) -> tuple[tuple[Alarm, ...], tuple[Alarm, ...]]:
        """Acknowledge the node's own alarms; return the cleared ones and the remaining ones."""
        return self._alarms.acknowledge()

    def check(self) -> bool:
        """Check topics and graph; return whether alarms of the node or its part of the verdict changed."""
        now_ns, stamp_ns = time.monotonic_ns(), self._now_ns() or time.time_ns()
        axis, self._other_axis = self._other_axis, self._axis.report()
        values = self._check_topics(now_ns)
        for kind in self._silence.kinds:
            is_silent = self._silence.level(kind, now_ns) is Level.ERROR
            values[f"{SILENCE} {kind}"] = self._silence.silent_s(kind, now_ns) if is_silent else 0.0
            values[f"{AHEAD} {kind}"] = self._ahead_s[kind]
        self._most_ahead_s = max(self._ahead_s.values())
        self._ahead_s = dict.fromkeys(self._ahead_s, 0.0)
        changed = self._alarms.changed(values, stamp_ns)
        self._monitor.note_alarms(stamp_ns, changed)
        return bool(changed) or axis != self._other_axis

    def _check_topics(self, now_ns: int) -> dict[str, float]:
        """Check publishers and contents of the topics; return the values of the alarms of several sources."""
        without, values = self._names.report(), {}
        for topic in self.inputs:
            topic.publishers = publishers_of(self._node, topic.name, topic.stream.type, topic.qos)
            if topic.stream.kind == CRANK:
                topic.without_crank = without
                topic.shared = self._names.others(now_ns - int(_OTHERS_S * 1.0e9))
            elif topic.stream.code == WRENCH_STAMPED:
                topic.other_axis = self._other_axis
            elif topic.stream.code == INTERFACES:
                topic.without_crank = self._interfaces.report()
            topic.sources = self._sources(topic, now_ns)
            values[health.sources_alarm(KINDS[topic.stream.kind].name).name] = float(topic.sources)
        return values

    def statuses(self, statuses: Iterable[Status]) -> tuple[Status, ...]:
        """Add the statuses of topics and clock, and mark statuses without current data."""
        now_ns, ros_ns = time.monotonic_ns(), self._now_ns()
        is_simulated = bool(self._node.get_parameter("use_sim_time").value)
        topics = health.topics_status(self.inputs, now_ns, self._started_ns)
        for topic in self.inputs:
            topic.lost_reported = topic.lost
        clock = self._clock.status(ros_ns, now_ns, is_simulated, self._most_ahead_s)
        given = {status.name: status for status in statuses}
        for own in (
            verdict_status(self.verdict(self._monitor.verdict).verdict),
            alarms_status(self._alarms.beside(self._monitor.alarms).alarms),
        ):
            given[own.name] = own
        # the source has already logged the given clock status
        self._status_log.note((*(one for name, one in given.items() if name != clock.name), topics, clock))
        given[clock.name] = health.both_clocks(given[clock.name], clock) if clock.name in given else clock
        return self._silence.marked((*given.values(), topics), now_ns)

    def _sources(self, topic: InputTopic, now_ns: int) -> int:
        """Number of publishers that certainly send the expected data of a topic."""
        names = topic.publishers.fitting
        sources = len(names) - topic.shared
        if sources < 2:
            self._several_since.pop(topic.name, None)
            return 1
        since_ns = self._several_since.setdefault(topic.name, now_ns)
        wait_s = _SAME_NAME_S if len(set(names)) < 2 else _NEW_S if topic.stream.kind == CRANK else 0.0
        return sources if (now_ns - since_ns) * 1.0e-9 >= wait_s else 1

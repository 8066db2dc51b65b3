"""Checks that need the node (silence, publishers, joint names, clock), for statuses, alarms and the log."""

import time
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import attrs
from rclpy.node import Node

from leg_wear_monitor.messages.streams import streams_read
from leg_wear_monitor.monitor.alarms.alarm import Alarm, Level
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.reports import AlarmList, Status, VerdictReport
from leg_wear_monitor.monitor.status import verdict_status
from leg_wear_monitor.monitor.verdict.rules import findings
from leg_wear_monitor.monitor.verdict.situation import Situation
from leg_wear_monitor.monitor.verdict.verdict import dated
from leg_wear_monitor.ros.health.clock_monitor import ClockMonitor, both_clocks
from leg_wear_monitor.ros.health.node_alarms import QUANTITIES, SILENCE, NodeAlarms, sources_alarm
from leg_wear_monitor.ros.health.node_health import topics_status
from leg_wear_monitor.ros.health.node_log import AlarmLog, StatusLog
from leg_wear_monitor.ros.health.silence import Silence
from leg_wear_monitor.ros.inputs.crank_names import CrankNames
from leg_wear_monitor.ros.inputs.inbox import Arrival
from leg_wear_monitor.ros.inputs.inputs import InputTopic
from leg_wear_monitor.ros.inputs.publishers import publishers_of
from leg_wear_monitor.twin.kinds import CRANK, KINDS
from leg_wear_monitor.twin.sample import Samples

if TYPE_CHECKING:
    from leg_wear_monitor.monitor.wear_monitor import WearMonitor

# A killed publisher stays in the graph until its lease expires (20 s by default): two publishers of one name
# may be one that was restarted.
_SAME_NAME_S = 30.0


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
        kinds = tuple(KINDS[stream.kind].name for stream in streams_read(config.drive_torque.source))
        self._silence = Silence(kinds, self._started_ns, time.time_ns())
        self._names = CrankNames(config.crank_joint)
        self._alarms, self._clock = NodeAlarms(kinds), ClockMonitor()
        self._alarm_log, self._status_log = AlarmLog(node.get_logger()), StatusLog(node.get_logger())
        self._several_since: dict[str, int] = {}
        self.inputs: Sequence[InputTopic] = ()

    @property
    def is_current(self) -> bool:
        """Whether usable crank samples are arriving."""
        return self._silence.level(KINDS[CRANK].name, time.monotonic_ns()) is Level.OK

    def note(self, arrivals: Sequence[Arrival], samples: Samples) -> None:
        """Record processed messages and their samples."""
        self._names.note(arrivals, samples)
        self._silence.note(self._monitor.used, time.monotonic_ns(), time.time_ns())

    def alarms(self, alarms: AlarmList) -> AlarmList:
        """Merge the monitor's alarms with those of the node, and log the changes."""
        shown = self._alarms.beside(alarms)
        self._alarm_log.note(shown)
        return shown

    def verdict(self, report: VerdictReport) -> VerdictReport:
        """Merge the monitor's verdict with what the node's own alarms say; without any, it is unchanged."""
        own = self._alarms.raised
        if not own:
            return report
        found = findings(Situation(alarms=own, quantities=QUANTITIES))
        return attrs.evolve(report, findings=(*report.findings, *dated(found, (), report.stamp_ns)))

    def acknowledge(self) -> tuple[tuple[Alarm, ...], tuple[Alarm, ...]]:
        """Acknowledge the node's own alarms; return the cleared ones and the remaining ones."""
        return self._alarms.acknowledge()

    def check(self) -> bool:
        """Check topics and graph; return whether the node's alarms have changed."""
        now_ns, lack = time.monotonic_ns(), self._names.some_lack_it
        without = self._names.report()
        values: dict[str, float] = {}
        for topic in self.inputs:
            topic.publishers = publishers_of(self._node, topic.name, topic.stream.type)
            is_crank = topic.stream.kind == CRANK
            if is_crank:
                topic.without_crank = without
            # several nodes may publish joints of one robot; then some messages lack the crank
            topic.sources = 1 if is_crank and lack else self._sources(topic, now_ns)
            values[sources_alarm(KINDS[topic.stream.kind].name).name] = float(topic.sources)
        for kind in self._silence.kinds:
            is_silent = self._silence.level(kind, now_ns) is Level.ERROR
            values[f"{SILENCE} {kind}"] = self._silence.silent_s(kind, now_ns) if is_silent else 0.0
        return self._alarms.evaluate(values, time.time_ns())

    def statuses(self, statuses: Iterable[Status]) -> tuple[Status, ...]:
        """Add the statuses of topics and clock, and mark statuses without current data."""
        now_ns, ros_ns = time.monotonic_ns(), self._node.get_clock().now().nanoseconds
        is_simulated = bool(self._node.get_parameter("use_sim_time").value)
        topics = topics_status(self.inputs, now_ns, self._started_ns)
        for topic in self.inputs:
            topic.lost_reported = topic.lost
        clock = self._clock.status(ros_ns, now_ns, is_simulated)
        given = {status.name: status for status in statuses}
        verdict = verdict_status(self.verdict(self._monitor.verdict).verdict)
        given[verdict.name] = verdict
        # the given clock status has already been logged at its source
        self._status_log.note((*(one for name, one in given.items() if name != clock.name), topics, clock))
        given[clock.name] = both_clocks(given[clock.name], clock) if clock.name in given else clock
        return self._silence.marked((*given.values(), topics), now_ns)

    def _sources(self, topic: InputTopic, now_ns: int) -> int:
        """Number of publishers that a topic certainly has."""
        names = topic.publishers.fitting
        if len(names) < 2:
            self._several_since.pop(topic.name, None)
            return 1
        since_ns = self._several_since.setdefault(topic.name, now_ns)
        if len(set(names)) > 1 or (now_ns - since_ns) * 1.0e-9 > _SAME_NAME_S:
            return len(names)
        return 1

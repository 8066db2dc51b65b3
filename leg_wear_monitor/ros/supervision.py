"""Checks that need the node (silence, publishers, contents of messages), for statuses, alarms and the log."""

import math
import time
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import attrs
import numpy as np
from rclpy.node import Node

from leg_wear_monitor.monitor.alarm_specs import SILENCE
from leg_wear_monitor.monitor.alarms import Alarm, amount, leg_alarm
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.reports import AlarmList, Status, VerdictReport
from leg_wear_monitor.monitor.status import alarms_status, verdict_status
from leg_wear_monitor.monitor.verdict.rules import findings
from leg_wear_monitor.monitor.verdict.situation import Situation
from leg_wear_monitor.monitor.verdict.verdict import dated
from leg_wear_monitor.recordings.message_checks import MessageChecks
from leg_wear_monitor.recordings.streams import INTERFACES, WRENCH_STAMPED, streams_of
from leg_wear_monitor.ros import health
from leg_wear_monitor.ros.inputs import Arrival, InputTopic
from leg_wear_monitor.state import LegAlarms, Level
from leg_wear_monitor.twin import CRANK, KINDS
from leg_wear_monitor.twin.sample import Samples

if TYPE_CHECKING:
    from leg_wear_monitor.monitor.wear_monitor import WearMonitor


# Log of the node: alarm changes and new faults, each logged once.


# Statuses that are logged; the other statuses follow from alarms, which are logged already.
STATUSES = ("topics", "cpu_load", "recording", "ledger", "clock")


def line_of(alarm: Alarm, before: Level, stamp_ns: int) -> str:
    """Log line for an alarm's change of level: name, levels, value, limit, time."""
    limit = "" if math.isnan(alarm.limit) else f", limit {amount(alarm.limit, alarm.unit)}"
    value = f"{amount(alarm.value, alarm.unit)}{limit}"
    time = f" at {health.utc(stamp_ns)}" if stamp_ns > 0 else ""
    latched = ", kept until it is acknowledged" if alarm.level > alarm.present else ""
    return f"alarm {alarm.name}: {before.name} -> {alarm.present.name} ({value}){time}{latched}"


_OF_A_BLOCK = 4  # wrenches of a block whose axes are compared


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
        torque = config.drive_torque
        predicted_nm = monitor.predicted_torque_nm / abs(torque.scale * torque.gear_ratio)
        self._checks = MessageChecks(config, predicted_nm, _OF_A_BLOCK)
        self._alarms = health.NodeAlarms(kinds)
        self._logged: dict[str, tuple[Level, str]] = {}
        self.inputs: Sequence[InputTopic] = ()

    def excuse(self, late_ns: int) -> None:
        """Exclude a time in which the node was late [ns] from the silence of its inputs."""
        self._silence.excuse(late_ns)
        for topic in self.inputs:
            topic.heard_ns += late_ns if topic.heard_ns else 0

    def note(self, arrivals: Sequence[Arrival], samples: Samples) -> None:
        """Record processed messages and their samples."""
        codes = np.array([one.code for one in arrivals], np.int64)
        self._checks.add(codes, samples, lambda i: arrivals[i].raw)
        self._silence.note(self._monitor.used, time.monotonic_ns(), time.time_ns())

    def alarms(self, alarms: AlarmList) -> AlarmList:
        """Add the node's alarms to the monitor's alarms, and log the changes."""
        shown = self._alarms.beside(alarms)
        for alarm in shown.alarms:
            name = f"alarm {alarm.name}"
            before, _ = self._logged.get(name, (Level.OK, ""))
            self._log(name, alarm.present, "", line_of(alarm, before, alarms.stamp_ns))
        return shown

    def _log(self, name: str, level: Level, kind: str, text: str) -> None:
        """Log a text if the level or the kind of a fault has changed."""
        before, self._logged[name] = self._logged.get(name, (Level.OK, "")), (level, kind)
        if before == (level, kind) or before[0] is level is Level.OK:
            return
        logger = self._node.get_logger()
        # separate calls: rclpy rejects one call site that changes its severity
        if level is Level.ERROR:
            logger.error(text)
        elif level is Level.WARN:
            logger.warning(text)
        else:
            logger.info(text)

    def verdict(self, report: VerdictReport) -> VerdictReport:
        """Add findings of the node's own alarms to the monitor's verdict; without any, it is unchanged."""
        own = self._alarms.raised
        found = findings(Situation(alarms=own)) if own else ()
        if not found:
            return report
        return attrs.evolve(report, findings=(*report.findings, *dated(found, (), report.stamp_ns)))

    def state(self, report: VerdictReport) -> VerdictReport:
        """Add the node's own alarms and its part of the verdict to the state of the leg."""
        report, leg = self.verdict(report), report.leg
        if leg is None or not self._alarms.raised:
            return report
        now = (*leg.alarms.now, *map(leg_alarm, self._alarms.raised))
        return attrs.evolve(report, leg=attrs.evolve(leg, alarms=LegAlarms(now=now)))

    def acknowledge(self) -> tuple[tuple[Alarm, ...], tuple[Alarm, ...]]:
        """Acknowledge the node's own alarms; return the cleared ones and the remaining ones."""
        return self._alarms.acknowledge()

    def check(self) -> bool:
        """Check topics and graph; return whether alarms of the node changed."""
        now_ns, stamp_ns = time.monotonic_ns(), self._node.get_clock().now().nanoseconds or time.time_ns()
        checks, values = self._checks, {}
        for topic in self.inputs:
            topic.publishers = self._node.count_publishers(topic.name)
            if topic.stream.code == WRENCH_STAMPED:
                topic.content_fault = checks.axis_fault
            elif topic.stream.code == INTERFACES:
                topic.content_fault = checks.interface_fault
            elif topic.stream.kind == CRANK and checks.found + checks.missing:
                topic.content_fault = checks.crank_fault
        checks.forget_names()
        for kind in self._silence.kinds:
            is_silent = self._silence.level(kind, now_ns) is Level.ERROR
            values[f"{SILENCE} {kind}"] = self._silence.silent_s(kind, now_ns) if is_silent else 0.0
        changed = self._alarms.changed(values, stamp_ns)
        self._monitor.note_alarms(stamp_ns, changed)
        return bool(changed)

    def statuses(self, statuses: Iterable[Status]) -> tuple[Status, ...]:
        """Add the status of the topics, log changes, and mark statuses without current data."""
        now_ns = time.monotonic_ns()
        given = {status.name: status for status in statuses}
        for own in (
            verdict_status(self.verdict(self._monitor.verdict).verdict),
            alarms_status(self._alarms.beside(self._monitor.alarms).alarms),
            health.topics_status(self.inputs, now_ns, self._started_ns),
        ):
            given[own.name] = own
        for topic in self.inputs:
            topic.lost_reported = topic.lost
        for name in STATUSES:
            if one := given.get(name):
                self._log(name, one.level, one.message, f"{name}: {one.message}")
        return self._silence.marked(given.values(), now_ns)

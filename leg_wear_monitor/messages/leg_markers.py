"""The leg as markers for RViz and Foxglove, ten times a second of the samples' stamps."""

import math
from collections.abc import Iterator

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.messages import encode
from leg_wear_monitor.messages.leg_drawing import LegDrawing
from leg_wear_monitor.messages.leg_scene import LegScene, Shown
from leg_wear_monitor.messages.marker_array import MarkerArrayTemplate
from leg_wear_monitor.messages.output import Outgoing, Output, single
from leg_wear_monitor.monitor.alarms.alarm import Level
from leg_wear_monitor.monitor.evaluation import specs
from leg_wear_monitor.monitor.reports import AlarmList, CycleReport, Reports, SampleReports, VerdictReport
from leg_wear_monitor.monitor.wear_monitor import WearMonitor

MARKERS = Output("~/markers", encode.MARKER_ARRAY)

PERIOD_NS = 100_000_000
_NEVER_NS = 2**63 - 1
SILENT_NS = 1_000_000_000  # samples apart by more: there was no current data


class LegMarkers:
    """Messages of `MARKERS`: the same live and in replay, however the reports are cut.

    Bodies, joints and the toe's path are those of the ideal leg. Beside it, each journal moves in its
    bushing as in the twin, magnified so that at the clearance limit it has half of the bushing's radius.
    Everything is grey while the leg is not followed.

    Parameters
    ----------
    monitor : WearMonitor
        What it knows now is shown until its next reports.
    drawing : LegDrawing
        Of its mechanism.
    """

    def __init__(self, monitor: WearMonitor, drawing: LegDrawing) -> None:
        self._frame_id, self._joints = monitor.config.frame_id, monitor.clearance_joints
        limit_m = max(monitor.clearance_limits_m, default=monitor.config.limits.clearance_m)
        self._scene = LegScene(drawing, self._joints, limit_m)
        self._now = Shown(
            self._levels(monitor.alarms), monitor.clearances_m, _words(monitor.verdict), is_current=False
        )
        self._changes: list[AlarmList | CycleReport | VerdictReport] = []
        self._template: tuple[Shown, MarkerArrayTemplate] | None = None
        self._last_ns, self._drawn_ns, self._step = 0, 0, 0

    def of(self, reports: Reports) -> Iterator[Outgoing]:
        """Messages at the first sample of each tenth of a second."""
        self._changes += (*reports.alarms, *reports.cycles, *reports.verdicts)
        self._take(0, 1)  # from before the leg was followed
        samples = reports.samples
        before_ns = np.concatenate([[self._last_ns], samples.stamp_ns[:-1]])
        for i in np.flatnonzero(samples.stamp_ns // PERIOD_NS != before_ns // PERIOD_NS).tolist():
            stamp_ns = int(samples.stamp_ns[i])
            if (
                stamp_ns < before_ns[i]
            ):  # what is later than all stamps of the new time base is of the old one
                self._take(int(samples.stamp_ns[-1]) + 1, _NEVER_NS)
                self._drawn_ns = 0
            elif 0 < before_ns[i] < stamp_ns - SILENT_NS:
                yield self.no_data(int(before_ns[i]) + SILENT_NS)
            self._take(self._drawn_ns or stamp_ns - SILENT_NS, stamp_ns)
            self._drawn_ns = stamp_ns
            yield self._at(samples, i)
        self._take(0, self._drawn_ns)
        if len(samples):
            self._last_ns = int(samples.stamp_ns[-1])

    def no_data(self, stamp_ns: int) -> Outgoing:
        """The leg where it was, in grey."""
        self._now = attrs.evolve(self._now, is_current=False)
        return self._drawn(stamp_ns, np.zeros((len(self._joints), 2)))

    def set_state(self, alarms: AlarmList, verdict: VerdictReport) -> None:
        """Set alarms and verdict at once, because an operator has changed them."""
        self._now = attrs.evolve(self._now, levels=self._levels(alarms), verdict=_words(verdict))

    def _at(self, samples: SampleReports, i: int) -> Outgoing:
        angle = float(samples.crank_angle_rad[i])
        if math.isnan(angle):
            return self.no_data(int(samples.stamp_ns[i]))
        self._step = self._scene.drawing.step_at(angle)
        self._now = attrs.evolve(self._now, is_current=True)
        return self._drawn(int(samples.stamp_ns[i]), np.nan_to_num(samples.eccentricity_m[i]))

    def _take(self, begin_ns: int, end_ns: int) -> None:
        """Take the changes from a stamp on, up to another one; the others wait."""
        waiting = []
        for change in self._changes:
            if not begin_ns <= change.stamp_ns < end_ns:
                waiting.append(change)
            elif isinstance(change, AlarmList):
                self._now = attrs.evolve(self._now, levels=self._levels(change))
            elif isinstance(change, VerdictReport):
                self._now = attrs.evolve(self._now, verdict=_words(change))
            else:
                clearances_m = tuple(joint.clearance_m for joint in change.joints)
                self._now = attrs.evolve(self._now, clearances_m=clearances_m)
        self._changes = waiting

    def _levels(self, alarms: AlarmList) -> tuple[Level, ...]:
        """Level of each joint: that of the worst of its alarms."""
        by_name = {alarm.name: alarm.level for alarm in alarms.alarms}
        return tuple(
            max((by_name.get(spec.name(joint), Level.OK) for spec in specs.JOINT), default=Level.OK)
            for joint in self._joints
        )

    def _drawn(self, stamp_ns: int, eccentricity_m: Floats) -> Outgoing:
        """The message with the journals at eccentricities (k, 2) [m]."""
        if self._template is None or self._template[0] != self._now:
            markers = self._scene.markers(self._now)
            self._template = self._now, MarkerArrayTemplate(markers, self._frame_id)
        moving = self._scene.moving(self._step, eccentricity_m)
        rows = self._template[1].messages(np.array([stamp_ns], np.int64), moving[None])
        return single(MARKERS, stamp_ns, rows[0].tobytes())


def _words(report: VerdictReport) -> str:
    """State and joints of a verdict."""
    verdict = report.verdict
    return f"{verdict.state.words}: {', '.join(verdict.joints)}" if verdict.joints else verdict.state.words

"""The leg as markers for RViz and Foxglove, ten times a second of the samples' stamps."""

import math
from collections.abc import Iterator

import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import TURN, build_linkage, ideal_motion, point_motion
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor import alarm_specs
from leg_wear_monitor.monitor.reports import AlarmList, CycleReport, Reports, VerdictReport
from leg_wear_monitor.monitor.wear_monitor import WearMonitor
from leg_wear_monitor.recordings import encode
from leg_wear_monitor.recordings.encode import LINE_LIST, SPHERE, TEXT, Marker
from leg_wear_monitor.recordings.streams import Outgoing, Output, single
from leg_wear_monitor.state import Level

MARKERS = Output("~/markers", encode.MARKER_ARRAY)

_PERIOD_NS = 100_000_000
_STEPS = 180  # positions per turn; the nearest position is drawn

# Okabe and Ito's colours, because colour-blind people can distinguish them; the text has the levels as well
_COLOURS = {Level.OK: (0.0, 0.45, 0.70), Level.WARN: (0.90, 0.62, 0.0), Level.ERROR: (0.84, 0.37, 0.0)}
_SIZES = {Level.OK: 0.03, Level.WARN: 0.042, Level.ERROR: 0.054}
_BODIES, _TEXTS = (0.60, 0.62, 0.68), (0.90, 0.90, 0.90)
_LINE, _TEXT, _SAME = 0.008, 0.04, 1.0e-3  # as fractions of the leg's size


class LegDrawing:
    """The ideal leg at equal steps of the crank; the clearances are too small to be visible.

    All points are (…, 3) [m] in the frame of the pelvis by REP 103: x forwards, z up.

    Parameters
    ----------
    mechanism : Mechanism

    Attributes
    ----------
    size : float
        Largest extent of the leg in its plane [m].
    lines : (STEPS, 2 b, 3) array
        Both ends of b lines of the bodies.
    joints : (STEPS, k, 3) array
        The clearance joints.
    tags : dict of int to str
        Names of joints at the same place, such as ``A B``, by the index of the first joint.
    title : (3,) array
        Position of the title next to the leg.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        linkage = build_linkage(mechanism)
        motion = ideal_motion(linkage, TURN / _STEPS * np.arange(_STEPS), TURN)

        def path(body: str, point: str) -> Floats:
            plane = point_motion(motion, linkage, body, point)[0]
            # the leg walks towards its own -x, REP 103 to +x
            return np.stack([-plane[:, 0], np.zeros(_STEPS), plane[:, 1]], axis=-1)

        ends: list[Floats] = []
        for body in mechanism.bodies:
            first, *others = (path(body, point) for point in mechanism.points_of(body))
            for other in others:
                ends += [first, other]
        self.lines = np.stack(ends, axis=1) if ends else np.zeros((_STEPS, 0, 3))
        names = mechanism.clearance_joints
        joints = [path(mechanism.sides(name)[0], name) for name in names]
        self.joints = np.stack(joints, axis=1) if joints else np.zeros((_STEPS, 0, 3))
        points = np.concatenate([self.lines, self.joints], axis=1)
        corners = np.array([points.min(axis=(0, 1)), points.max(axis=(0, 1))])
        self.size = float(np.ptp(corners, axis=0).max())
        self.title = np.array([corners[1, 0] + 0.2 * self.size, 0.0, corners[1, 2]])
        self.tags: dict[int, str] = {}
        for k, name in enumerate(names):
            apart = np.abs(self.joints - self.joints[:, k : k + 1]).max(axis=(0, 2))
            first_here = int(np.flatnonzero(apart <= _SAME * self.size)[0])
            self.tags[first_here] = f"{self.tags.get(first_here, '')} {name}".strip()

    def step_at(self, crank_angle: float) -> int:
        """Index of the position nearest to a crank angle [rad]."""
        return round(crank_angle / TURN * _STEPS) % _STEPS


class LegMarkers:
    """Messages of `MARKERS` while the leg is tracked, the same live and in replay.

    Parameters
    ----------
    monitor : WearMonitor
        Its present state is shown until its next reports.
    drawing : LegDrawing
        Drawing of the leg's mechanism.
    """

    def __init__(self, monitor: WearMonitor, drawing: LegDrawing) -> None:
        self._drawing, self._frame_id = drawing, monitor.config.frame_id
        self._joints = monitor.clearance_joints
        self._shown_levels, self._clearances_m = self._levels(monitor.alarms), monitor.clearances_m
        self._verdict = _words(monitor.verdict)
        self._changes: list[AlarmList | CycleReport | VerdictReport] = []
        self._last_ns = 0

    def of(self, reports: Reports) -> Iterator[Outgoing]:
        """Messages at the first sample of each tenth of a second."""
        self._changes += (*reports.alarms, *reports.cycles, *reports.verdicts)
        samples = reports.samples
        before_ns = np.concatenate([[self._last_ns], samples.stamp_ns[:-1]])
        for i in np.flatnonzero(samples.stamp_ns // _PERIOD_NS != before_ns // _PERIOD_NS).tolist():
            stamp_ns = int(samples.stamp_ns[i])
            self._take(stamp_ns, int(samples.stamp_ns[-1]))
            if math.isfinite(angle := float(samples.crank_angle_rad[i])):
                markers = list(self._markers(self._drawing.step_at(angle)))
                yield single(MARKERS, stamp_ns, encode.marker_array(stamp_ns, markers, self._frame_id))
        if len(samples):
            self._last_ns = int(samples.stamp_ns[-1])

    def _take(self, stamp_ns: int, newest_ns: int) -> None:
        """Show the changes before a stamp; those after the newest sample are of a clock that was set back."""
        waiting = []
        for change in self._changes:
            if stamp_ns <= change.stamp_ns <= newest_ns:
                waiting.append(change)
            elif isinstance(change, AlarmList):
                self._shown_levels = self._levels(change)
            elif isinstance(change, VerdictReport):
                self._verdict = _words(change)
            else:
                self._clearances_m = tuple(joint.clearance_m for joint in change.joints)
        self._changes = waiting

    def _levels(self, alarms: AlarmList) -> tuple[Level, ...]:
        """Level of each joint: the level of its worst alarm."""
        by_name = {alarm.name: alarm.level for alarm in alarms.alarms}
        return tuple(
            max((by_name.get(spec.name(joint), Level.OK) for spec in alarm_specs.JOINT), default=Level.OK)
            for joint in self._joints
        )

    def _markers(self, step: int) -> Iterator[Marker]:
        size, joints = self._drawing.size, self._drawing.joints[step]
        above = np.array([0.0, 0.0, 0.8 * _TEXT * size])
        yield Marker(
            namespace="bodies",
            type=LINE_LIST,
            scale=(_LINE * size, 0.0, 0.0),
            colour=_BODIES,
            points=self._drawing.lines[step],
        )
        for k, level in enumerate(self._shown_levels):
            yield Marker(
                namespace="joints",
                id=k,
                type=SPHERE,
                scale=(_SIZES[level] * size,) * 3,
                colour=_COLOURS[level],
                position=joints[k],
            )
        for k, name in self._drawing.tags.items():
            yield self._text("names", k, name, joints[k] + above)
        lines = [self._verdict]
        for joint, level, clearance_m in zip(
            self._joints, self._shown_levels, self._clearances_m, strict=True
        ):
            lines.append(f"{joint}: {level.name} {1.0e3 * clearance_m:.3f} mm")
        yield self._text("verdict", 0, "\n".join(lines), self._drawing.title)

    def _text(self, namespace: str, number: int, text: str, position: Floats) -> Marker:
        return Marker(
            namespace=namespace,
            id=number,
            type=TEXT,
            scale=(0.0, 0.0, _TEXT * self._drawing.size),
            colour=_TEXTS,
            position=position,
            text=text,
        )


def _words(report: VerdictReport) -> str:
    """State and joints of a verdict."""
    verdict = report.verdict
    return f"{verdict.state.words}: {', '.join(verdict.joints)}" if verdict.joints else verdict.state.words

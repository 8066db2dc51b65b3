"""The leg as markers for RViz and Foxglove, ten times a second of the samples' stamps."""

import math
from collections.abc import Iterator, Sequence

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.messages import encode
from leg_wear_monitor.messages.encode import (
    CYLINDER,
    LINE_LIST,
    LINE_STRIP,
    SPHERE,
    TEXT,
    LegDrawing,
    Marker,
    MarkerArrayTemplate,
    circle,
    in_rep_103,
)
from leg_wear_monitor.messages.streams import Outgoing, Output, single
from leg_wear_monitor.monitor import alarm_specs
from leg_wear_monitor.monitor.reports import AlarmList, CycleReport, Reports, SampleReports, VerdictReport
from leg_wear_monitor.monitor.wear_monitor import WearMonitor
from leg_wear_monitor.state import Level

# What the markers show: the leg, and beside it each journal in its bushing, magnified, with texts.


# Okabe and Ito's colours, which colour-blind people can tell apart; level and state are texts, too
_COLOURS = {Level.OK: (0.0, 0.45, 0.70), Level.WARN: (0.90, 0.62, 0.0), Level.ERROR: (0.84, 0.37, 0.0)}
_GREY, _BODIES, _PATH, _TEXTS = (
    (0.55, 0.55, 0.55),
    (0.60, 0.62, 0.68),
    (0.35, 0.70, 0.90),
    (0.90, 0.90, 0.90),
)
_LARGER = {Level.OK: 1.0, Level.WARN: 1.4, Level.ERROR: 1.8}

# as fractions of the leg's size
_LINE, _JOINT, _RING, _TEXT = 0.008, 0.03, 0.08, 0.04
_THICK = 0.2  # of a journal, as a fraction of its bushing's radius
_AT_LIMIT = 0.5  # clearance at the limit, likewise
_LEAST = 0.1  # radius of a journal, likewise
_ALONG_Y = (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))  # turns a cylinder's z axis


@attrs.frozen
class Shown:
    """What the markers show besides the motion; joints in their order.

    Attributes
    ----------
    levels : tuple of Level
    clearances_m : tuple of float
    verdict : str
    is_current : bool
        Whether there are current data; without, everything is grey.
    """

    levels: tuple[Level, ...]
    clearances_m: tuple[float, ...]
    verdict: str
    is_current: bool


class LegScene:
    """Markers of a leg.

    Parameters
    ----------
    drawing : LegDrawing
    joints : sequence of str
        The clearance joints.
    limit_m : float
        Clearance at which a journal is drawn with half of its bushing's radius.
    """

    def __init__(self, drawing: LegDrawing, joints: Sequence[str], limit_m: float) -> None:
        self.drawing, self._joints = drawing, tuple(joints)
        self._ring_m = _RING * drawing.size
        self._factor = _AT_LIMIT * self._ring_m / limit_m

    def markers(self, shown: Shown) -> list[Marker]:
        """All markers; `moving` gives the places of those that move."""
        return [*self._leg(shown), *self._rings(shown), *self._texts(shown)]

    def moving(self, step: int, eccentricity_m: Floats) -> Floats:
        """Places (m, 3) [m] of what moves, at an index of the drawing's positions.

        Parameters
        ----------
        step : int
        eccentricity_m : (k, 2) array
            Of the journals.
        """
        drawing = self.drawing
        tags = drawing.joints[step, [k for _, k in drawing.tags]] + self._above(0.8 * _TEXT)
        off = self._factor * in_rep_103(eccentricity_m)
        length = np.linalg.norm(off, axis=1, keepdims=True)
        off *= np.minimum(1.0, self._ring_m / np.maximum(length, 1.0e-300))
        return np.concatenate([drawing.lines[step], drawing.joints[step], tags, drawing.rings + off])

    def _above(self, fraction: float) -> Floats:
        return np.array([0.0, 0.0, fraction * self.drawing.size])

    def _leg(self, shown: Shown) -> Iterator[Marker]:
        drawing, is_current, line = self.drawing, shown.is_current, _LINE * self.drawing.size
        yield Marker(
            namespace="bodies",
            type=LINE_LIST,
            scale=(line, 0.0, 0.0),
            colour=_BODIES if is_current else _GREY,
            points=drawing.lines[0],
            moves=True,
        )
        for k, level in enumerate(shown.levels):
            size = _JOINT * _LARGER[level] * drawing.size
            colour = _colour(level, shown)
            yield Marker(
                namespace="joints", id=k, type=SPHERE, scale=(size, size, size), colour=colour, moves=True
            )
        for number, (text, _) in enumerate(drawing.tags):
            yield self._text(shown, "names", number, text, np.zeros(3), moves=True)
        if len(drawing.path):
            thin, colour = (0.5 * line, 0.0, 0.0), _PATH if is_current else _GREY
            yield Marker(
                namespace="toe_path", type=LINE_STRIP, scale=thin, colour=colour, points=drawing.path
            )

    def _rings(self, shown: Shown) -> Iterator[Marker]:
        """Journals in their bushings."""
        radius = self._ring_m
        for k, level in enumerate(shown.levels):
            yield Marker(
                namespace="bushings",
                id=k,
                type=LINE_STRIP,
                scale=(0.5 * _LINE * self.drawing.size, 0.0, 0.0),
                colour=_colour(level, shown),
                position=self.drawing.rings[k],
                points=circle(radius),
            )
        for k, clearance_m in enumerate(shown.clearances_m):
            width = 2.0 * max(radius - self._factor * clearance_m, _LEAST * radius)
            yield Marker(
                namespace="journals",
                id=k,
                type=CYLINDER,
                scale=(width, width, _THICK * radius),
                colour=_BODIES if shown.is_current else _GREY,
                orientation=_ALONG_Y,
                moves=True,
            )

    def _texts(self, shown: Shown) -> Iterator[Marker]:
        above = self._above(_RING + 0.6 * _TEXT)
        for k, joint in enumerate(self._joints):
            words = f"{joint}: {shown.levels[k].name} {1.0e3 * shown.clearances_m[k]:.3f} mm"
            words = words if shown.is_current else f"{joint}: no data"
            yield self._text(shown, "values", k, words, self.drawing.rings[k] + above)
        verdict = shown.verdict if shown.is_current else "no current data"
        yield self._text(
            shown, "verdict", 0, f"{verdict}\nclearances x {self._factor:.3g}", self.drawing.title
        )

    def _text(
        self, shown: Shown, namespace: str, number: int, text: str, position: Floats, moves: bool = False
    ) -> Marker:
        return Marker(
            namespace=namespace,
            id=number,
            type=TEXT,
            scale=(0.0, 0.0, _TEXT * self.drawing.size),
            colour=_TEXTS if shown.is_current else _GREY,
            position=position,
            text=text,
            moves=moves,
        )


def _colour(level: Level, shown: Shown) -> tuple[float, float, float]:
    return _COLOURS[level] if shown.is_current else _GREY


MARKERS = Output("~/markers", encode.MARKER_ARRAY)
LINKAGE = Output("~/linkage_states", encode.JOINT_STATE)
"""Joint positions of its robot description (`leg-wear-monitor draw --urdf`): those of the ideal leg."""

PERIOD_NS = 100_000_000
_NEVER_NS = 2**63 - 1
SILENT_NS = 1_000_000_000  # samples apart by more: there was no current data


class LegMarkers:
    """Messages of `MARKERS` and `LINKAGE`: the same live and in replay, however the reports are cut.

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
            # what is later than all stamps of a new time base is of the old one
            if stamp_ns < before_ns[i]:
                self._take(int(samples.stamp_ns[-1]) + 1, _NEVER_NS)
                self._drawn_ns = 0
            elif 0 < before_ns[i] < stamp_ns - SILENT_NS:
                yield self.no_data(int(before_ns[i]) + SILENT_NS)
            self._take(self._drawn_ns or stamp_ns - SILENT_NS, stamp_ns)
            self._drawn_ns = stamp_ns
            yield from self._at(samples, i)
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

    def _at(self, samples: SampleReports, i: int) -> Iterator[Outgoing]:
        angle, stamp_ns = float(samples.crank_angle_rad[i]), int(samples.stamp_ns[i])
        drawing = self._scene.drawing
        if math.isnan(angle):
            yield self.no_data(stamp_ns)
            return
        self._step = drawing.step_at(angle)
        self._now = attrs.evolve(self._now, is_current=True)
        yield self._drawn(stamp_ns, np.nan_to_num(samples.eccentricity_m[i]))
        position = drawing.link_positions[self._step]
        rows = encode.joint_states(stamp_ns, drawing.links, position=position, frame_id=self._frame_id)
        yield single(LINKAGE, stamp_ns, rows[0].tobytes())

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
            max((by_name.get(spec.name(joint), Level.OK) for spec in alarm_specs.JOINT), default=Level.OK)
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

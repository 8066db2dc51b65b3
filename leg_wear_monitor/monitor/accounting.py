"""Accounting: counters over all runs of the monitor, time coverage, and the entries of the ledger."""

import math
from collections.abc import Iterable, Mapping

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.files import with_same_fields
from leg_wear_monitor.mechanism.arrays import Floats, Ints
from leg_wear_monitor.monitor.alarm_specs import CLEARANCE
from leg_wear_monitor.monitor.alarms import Alarm
from leg_wear_monitor.monitor.config.settings import LedgerFile
from leg_wear_monitor.monitor.inputs import InputGuard
from leg_wear_monitor.monitor.ledger.entry import (
    AlarmEvent,
    ClearancePoint,
    Entry,
    Event,
    JointWear,
    clearance_limit_key,
    one_part,
)
from leg_wear_monitor.monitor.ledger.ledger import Ledger
from leg_wear_monitor.monitor.reports import AlarmList, CycleReport, Lost
from leg_wear_monitor.state import Level
from leg_wear_monitor.twin.digital_twin import DigitalTwin
from leg_wear_monitor.twin.sample import Samples
from leg_wear_monitor.twin.statistics import SampleStatistics
from leg_wear_monitor.wear import BUSHING

# Stretches of time whose wear is in the model, so that no wear is added twice.


Spans = tuple[tuple[int, int], ...]

NEIGHBOURS_NS = 10_000_000_000  # stretches nearer than this are taken as one


def with_span(spans: Spans, begin_ns: int, end_ns: int) -> Spans:
    """Disjoint spans in order of time with one more, joined with those that it meets or nearly meets."""
    apart = []
    for begin, end in spans:
        if begin_ns - NEIGHBOURS_NS <= end and begin <= end_ns + NEIGHBOURS_NS:
            begin_ns, end_ns = min(begin, begin_ns), max(end, end_ns)
        else:
            apart.append((begin, end))
    return tuple(sorted([*apart, (begin_ns, end_ns)]))


def is_within(stamp_ns: Ints, spans: Ints) -> NDArray[np.bool_]:
    """Mask of the stamps (n,) in one of the spans (m, 2), sorted by their start; ends are within."""
    latest = np.maximum.accumulate(spans[:, 1])
    at = np.searchsorted(spans[:, 0], stamp_ns, side="right") - 1
    return np.asarray((at >= 0) & (stamp_ns <= latest[np.maximum(at, 0)]))


POINT_S = 600.0  # walking time between two points of the clearances' history
# or this fraction of all walking so far, if that is longer: a year of 8 h per day then has about 1100
# points, not 17 500
POINT_FRACTION = 0.005

_DUE_KEY = "history_due_s"  # moving_s, from the totals, at which the history takes its next point

_SUMS = ("moving_s", "standing_s", "bridged_s", "unmonitored_s")


@attrs.frozen
class PartLife:
    """When a joint's part was new: gait cycles and time in motion of the leg then, and the stamp."""

    cycles: int = 0
    moving_s: float = 0.0
    replaced_ns: int = 0


def next_point_s(moving_s: float) -> float:
    """Time in motion over all runs [s] of the history's next point after one at ``moving_s``."""
    return moving_s + max(POINT_S, POINT_FRACTION * moving_s)


class Accounting:
    """Counters for the ledger; writes an entry when it is due.

    Parameters
    ----------
    twin : DigitalTwin
        Twin whose wear is set to the ledger's wear.
    ledger : Ledger or None
    settings : LedgerFile

    Attributes
    ----------
    cycles : int
        Gait cycles over all runs.
    parts : tuple of PartLife
    spans : Spans
        Time whose wear this run has modelled, by the present epoch of the clock.
    skipped, skipped_s : int, float
        Number of samples skipped because an earlier run modelled their wear, and their time.
    without_zero_s : float
        Time of samples that did not reach the twin, because the crank's zero is not known.
    """

    def __init__(self, twin: DigitalTwin, ledger: Ledger | None, settings: LedgerFile) -> None:
        self.ledger = ledger
        self._twin = twin
        self._checkpoint_ns = int(settings.checkpoint_s * 1.0e9)
        self._counted = ledger.counted_ns if ledger and settings.skip_counted else np.zeros((0, 2), np.int64)
        self._tried_ns = 0
        entry = ledger.entry if ledger else None
        self._before = entry.totals if entry else {}
        self._kept_s = self._before.get("moving_s", 0.0)
        self.cycles, self.parts = self.cycles_before, (PartLife(),) * len(twin.clearance_joints)
        self.spans: Spans = ()
        # start, end and epoch of the spans that this run counted before its clock was reset
        self._past: tuple[tuple[int, int, int], ...] = ()
        self._is_anew = False
        self._point_due_s = self._before.get(_DUE_KEY, 0.0)  # next history point, in moving_s over all runs
        self.skipped, self.skipped_s, self._skipped_ns = 0, 0.0, 0
        self._shown: Mapping[str, tuple[Level, bool]] = {}  # last state of each alarm in the history
        # pauses between recordings: their number, their time, and the part of it before the last one that the
        # unmonitored time of the twin includes
        self._pauses, self._paused_s, self._passed_before_s = 0, 0.0, 0.0
        self._pause_s, self._pause_at_s = 0.0, 0.0  # the last one, and the unmonitored time when it began
        self.without_zero_s = 0.0
        if entry:
            self._shown = {a.name: (a.level, a.acknowledged) for a in entry.alarms}
            self._take_over({joint.name: joint for joint in entry.joints})

    def _take_over(self, joints: dict[str, JointWear]) -> None:
        own = [joints[name] for name in self._twin.clearance_joints]
        self._twin.set_depth(np.stack([joint.depth for joint in own]))
        self.parts = tuple(self._part(k, joint) for k, joint in enumerate(own))

    def _part(self, k: int, wear: JointWear) -> PartLife:
        """A part of joint k that has walked so much until now."""
        return PartLife(
            self.cycles - wear.cycles,
            self.totals["moving_s"] - wear.moving_s,
            wear.replaced_ns,
        )

    @property
    def cycles_before(self) -> int:
        """Gait cycles of the leg before this run."""
        return int(self._before.get("cycles", 0))

    def limit_before_m(self, joint: str) -> float | None:
        """Limit of a joint's clearance [m] in the ledger; None if the ledger does not have it."""
        if limit_m := self._before.get(clearance_limit_key(joint)):
            return limit_m
        entry = self.ledger.entry if self.ledger else None
        own = [one for one in (entry.alarms if entry else ()) if one.name == CLEARANCE.name(joint)]
        return own[0].limit if own and not math.isnan(own[0].limit) else None

    @property
    def unmonitored_s(self) -> float:
        """Time in which the leg was not tracked in this run.

        It excludes time that earlier runs have modelled, and pauses between recordings.
        """
        others_s = self.skipped_s + self._passed_pauses_s
        return max(0.0, self._twin.intake.unmonitored_s - others_s) + self.without_zero_s

    def lost(self, guard: InputGuard) -> Lost:
        """Samples and time that were not integrated so far, with those that a guard has withheld."""
        intake = self._twin.intake
        return with_same_fields(
            Lost,
            intake,
            guard,
            unmonitored_s=self.unmonitored_s,
            already_counted=self.skipped,
            outliers=intake.outliers + intake.load_outliers,
            gaps_lost=max(0, intake.lost - self._pauses),
            paused_s=self._paused_s,
        )

    def pause(self, pause_s: float) -> None:
        """Recording pauses for a time [s], from the newest sample on."""
        self._passed_before_s = self._passed_pauses_s
        self._pauses, self._paused_s = self._pauses + 1, self._paused_s + pause_s
        self._pause_s, self._pause_at_s = pause_s, self._twin.intake.unmonitored_s

    @property
    def _passed_pauses_s(self) -> float:
        """Part of the pauses that the twin's unmonitored time includes, once the leg is tracked again."""
        since_s = max(0.0, self._twin.intake.unmonitored_s - self._pause_at_s)
        return self._passed_before_s + min(self._pause_s, since_s)

    @property
    def replaced_ns(self) -> list[int]:
        """When each joint's part was replaced, 0 if it never was."""
        return [part.replaced_ns for part in self.parts]

    @property
    def totals(self) -> dict[str, float]:
        """Counters over all runs."""
        intake, before = self._twin.intake, self._before
        now = {name: getattr(intake, name) for name in _SUMS} | {"unmonitored_s": self.unmonitored_s}
        sums = {name: before.get(name, 0.0) + value for name, value in now.items()}
        return {"cycles": float(self.cycles), **sums}

    def not_counted(self, samples: Samples) -> Samples:
        """Samples without those whose wear is in the ledger from an earlier run."""
        known = self.counted(samples)
        if not known.any():
            return samples
        stamps = np.concatenate([[self._skipped_ns], samples["stamp_ns"][known]])
        steps = np.diff(stamps)
        self.skipped += len(steps)
        self.skipped_s += 1.0e-9 * float(steps[(steps > 0) & (steps <= NEIGHBOURS_NS)].sum())
        self._skipped_ns = int(stamps[-1])
        return np.asarray(samples[~known])

    def counted(self, samples: Samples) -> NDArray[np.bool_]:
        """Mask of the samples whose wear is in the ledger from an earlier run."""
        if self._is_anew or not len(self._counted):
            return np.zeros(len(samples), bool)
        return is_within(samples["stamp_ns"], self._counted)

    @property
    def is_all_counted(self) -> bool:
        """True if there were samples, and the ledger already contained the wear of all of them."""
        return self.skipped > 0 and not (self.spans or self._past or self._is_anew)

    def begin_epoch(self) -> None:
        """The clock was reset: stamps from now on are not comparable with earlier stamps."""
        epoch = self.ledger.epoch if self.ledger else 0
        self._past = (*self._past, *((*span, epoch) for span in self.spans))
        self.spans, self._is_anew = (), True
        if self.ledger:
            self.ledger.epoch += 1

    @property
    def not_kept_s(self) -> float:
        """Time in motion since the last entry, which a kill would lose."""
        return self.totals["moving_s"] - self._kept_s

    def joint_wear(self, k: int, depth: Floats) -> JointWear:
        """Present wear of joint k; depth (clearance joints, 2, N) of the twin."""
        part, totals = self.parts[k], self.totals
        return JointWear(
            self._twin.clearance_joints[k],
            depth[k],
            self.cycles - part.cycles,
            totals["moving_s"] - part.moving_s,
            part.replaced_ns,
            float(self._twin.wear_coefficient_per_pa[k]),
        )

    def wear_of(self, joint: str) -> JointWear:
        """Present wear of a joint; raises LegWearError for a joint without clearance."""
        return self.joint_wear(self._index(joint), self._twin.depth)

    def _index(self, joint: str) -> int:
        if joint not in self._twin.clearance_joints:
            raise LegWearError(
                f"{joint}: no clearance joint. Expected one of {', '.join(self._twin.clearance_joints)}"
            )
        return self._twin.clearance_joints.index(joint)

    def replace(self, joint: str, stamp_ns: int) -> JointWear:
        """Fresh surfaces for a joint; its wear as it was."""
        k = self._index(joint)
        was = self.joint_wear(k, self._twin.depth)
        self._twin.reset_wear(joint)
        self._set_part(k, PartLife(self.cycles, self.totals["moving_s"], stamp_ns))
        return was

    def correct(self, joint: str, clearance_m: float) -> JointWear:
        """Open a joint to a larger mean clearance [m], evenly, its wear profile kept; its wear as it was."""
        k = self._index(joint)
        depth = self._twin.depth
        was = self.joint_wear(k, depth.copy())
        depth[k, BUSHING] += max(clearance_m - float(self._twin.clearance_mean_m[k]), 0.0)
        self._twin.set_depth(depth)
        return was

    def put_back(self, joint: str, before: JointWear) -> JointWear:
        """Undo `replace`: the wear before and that since are of one part. Gives the wear since."""
        k = self._index(joint)
        since, depth = self.joint_wear(k, self._twin.depth), self._twin.depth
        part = one_part(before, since)
        depth[k] = part.depth
        self._twin.set_depth(depth)
        self._set_part(k, self._part(k, part))
        return since

    def _set_part(self, k: int, part: PartLife) -> None:
        self.parts = (*self.parts[:k], part, *self.parts[k + 1 :])

    def followed(self, samples: SampleStatistics) -> None:
        """Note the time in which the leg was tracked."""
        stamp = samples.stamp_ns[np.isfinite(samples.crank_angle_rad)]
        if len(stamp):
            step_ns = np.diff(stamp)
            is_apart = (step_ns < 0) | (step_ns > NEIGHBOURS_NS)
            for part in np.split(stamp, np.flatnonzero(is_apart) + 1):
                self.spans = with_span(self.spans, int(part[0]), int(part[-1]))

    def note(self, event: Event) -> None:
        """Take an event down for the ledger."""
        if self.ledger:
            self.ledger.note(event)

    def note_alarms(self, change: AlarmList) -> None:
        """Note the alarms whose published state has changed."""
        shown = {alarm.name: (alarm.level, alarm.acknowledged) for alarm in change.alarms}
        for alarm in change.alarms:
            if shown[alarm.name] != self._shown.get(alarm.name, (Level.OK, False)):
                self.note(AlarmEvent(change.stamp_ns, alarm))
        self._shown = shown

    def note_clearances(self, report: CycleReport) -> None:
        """Note the clearances for the history from time to time."""
        moving_s = self.totals["moving_s"]
        if moving_s < self._point_due_s:
            return
        self._point_due_s = next_point_s(moving_s)
        for joint in report.joints:
            self.note(
                ClearancePoint(
                    report.stamp_ns, report.cycle, joint.joint, joint.clearance_m, joint.clearance_max_m
                )
            )

    def keep_if_due(self, alarms: Iterable[Alarm]) -> None:
        """Write an entry if the last is old enough, and there is something new to write."""
        if self.ledger is None or self.ledger.at_end:
            return
        now = self._twin.intake.followed_stamp_ns
        is_due = now and not 0 <= now - self._tried_ns < self._checkpoint_ns
        if is_due and (self.not_kept_s > 0.0 or self.ledger.waiting or self.ledger.fault):
            self.keep(alarms)

    def keep(self, alarms: Iterable[Alarm], closed: bool = False) -> bool:
        """Write an entry; False without a ledger, or if it could not be written."""
        if self.ledger is None:
            return False
        entry = self._entry(alarms)
        self._tried_ns = self._twin.intake.followed_stamp_ns
        kept = self.ledger.keep(entry, closed)
        if kept:
            self._kept_s = entry.totals["moving_s"]
        return kept

    def _entry(self, alarms: Iterable[Alarm]) -> Entry:
        depth, alarms = self._twin.depth, tuple(alarms)
        epoch = self.ledger.epoch if self.ledger else 0
        return Entry(
            stamp_ns=self._twin.intake.followed_stamp_ns or (self.ledger.kept_ns if self.ledger else 0),
            joints=tuple(self.joint_wear(k, depth) for k in range(len(self._twin.clearance_joints))),
            totals=self.totals
            | {_DUE_KEY: self._point_due_s}
            | {
                clearance_limit_key(alarm.subject): alarm.limit
                for alarm in alarms
                if alarm.kind == CLEARANCE.kind and not math.isnan(alarm.limit)
            },
            alarms=tuple(alarm for alarm in alarms if alarm.level is not Level.OK),
            spans=(*self._past, *((*span, epoch) for span in self.spans)),
        )

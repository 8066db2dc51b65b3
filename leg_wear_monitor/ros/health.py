"""Health of the node itself: silent inputs, clock, load, lost messages, several publishers."""

import math
from collections.abc import Iterable, Iterator, Mapping
from datetime import UTC, datetime
from typing import TYPE_CHECKING

import attrs
import numpy as np

from leg_wear_monitor.monitor import alarms
from leg_wear_monitor.monitor.alarm_specs import SILENCE
from leg_wear_monitor.monitor.alarms import INPUT_SILENCE, Alarm, Limit, has_changed
from leg_wear_monitor.monitor.evaluation import AlarmBoard
from leg_wear_monitor.monitor.reports import AlarmList, Status
from leg_wear_monitor.ros.inputs import Inbox, InputTopic
from leg_wear_monitor.ros.outputs import BlackBox
from leg_wear_monitor.state import Level
from leg_wear_monitor.twin import CRANK, KINDS
from leg_wear_monitor.twin.sample import NO_FAULT, Samples

if TYPE_CHECKING:
    from leg_wear_monitor.monitor.wear_monitor import WearMonitor

# Detection of silent inputs (no usable samples), which only the node can do because it has a clock.
#
# Unusable messages count as silence, because the leg is not monitored.


SILENT_FROM_S = 1.0
NOTHING_FROM_S = 10.0  # grace period after the start; a leg may be switched on after its monitor

# status values that are rates or speeds, and their values during silence
_NOW = {
    "cadence_rpm": math.nan,
    **{f"{kind.name}_rate_hz": 0.0 for kind in KINDS.values()},
}
# statuses of the node itself or of faults; they remain valid during silence
_KEPT = ("verdict", "input", "alarms", "ledger", "cpu_load", "topics", "recording", "clock")
_NOTHING_WRONG = "in order"


def utc(time_ns: int) -> str:
    """A time in ISO 8601 format, such as 2026-11-21T22:13:05.250Z."""
    time = datetime.fromtimestamp(time_ns / 1e9, UTC).isoformat(timespec="milliseconds")
    return time.replace("+00:00", "Z")


@attrs.define
class _Kind:
    """Number of used samples of a kind, and time of its last increase on both clocks."""

    steady_ns: int
    wall_ns: int
    used: int = 0


class Silence:
    """Measures how long samples of each kind have been missing.

    Parameters
    ----------
    kinds : iterable of str
        Names of the kinds that have samples of their own.
    steady_ns, wall_ns : int
        Present time on a monotonic clock and on the wall clock [ns].
    """

    def __init__(self, kinds: Iterable[str], steady_ns: int, wall_ns: int) -> None:
        self._kinds = {kind: _Kind(steady_ns, wall_ns) for kind in kinds}

    @property
    def kinds(self) -> tuple[str, ...]:
        """The expected kinds."""
        return tuple(self._kinds)

    def note(self, used: Mapping[str, int], steady_ns: int, wall_ns: int) -> None:
        """Record the number of samples of each kind used so far."""
        for name, kind in self._kinds.items():
            if used[name] != kind.used:
                kind.used, kind.steady_ns, kind.wall_ns = used[name], steady_ns, wall_ns

    def excuse(self, late_ns: int) -> None:
        """Exclude a time when the node did not take arriving messages."""
        for kind in self._kinds.values():
            kind.steady_ns += late_ns

    def silent_s(self, name: str, steady_ns: int) -> float:
        """Time since the last used sample of a kind, or since the start [s]; 0 if none is expected."""
        kind = self._kinds.get(name)
        return 0.0 if kind is None else (steady_ns - kind.steady_ns) * 1.0e-9

    def level(self, name: str, steady_ns: int) -> Level:
        """Level of the silence: ERROR; WARN before the first sample during the seconds after the start."""
        kind, silent_s = self._kinds.get(name), self.silent_s(name, steady_ns)
        if kind is None or (kind.used and silent_s <= SILENT_FROM_S):
            return Level.OK
        return Level.ERROR if kind.used or silent_s >= NOTHING_FROM_S else Level.WARN

    def since(self, name: str) -> str:
        """Start of the silence as text."""
        kind = self._kinds[name]
        return f"since {utc(kind.wall_ns)}" if kind.used else f"since the start at {utc(kind.wall_ns)}"

    def marked(self, statuses: Iterable[Status], steady_ns: int) -> tuple[Status, ...]:
        """Mark statuses without current data; if the crank is silent, this concerns every status."""
        silent = {name: level for name in self._kinds if (level := self.level(name, steady_ns)) > Level.OK}
        crank = KINDS[CRANK].name
        marked = []
        for status in statuses:
            kind = crank if crank in silent else status.name
            marked.append(self._without(status, kind, silent[kind], steady_ns) if kind in silent else status)
        return tuple(marked)

    def _without(self, status: Status, kind: str, level: Level, steady_ns: int) -> Status:
        message = f"no current data {self.since(kind)}"
        if status.name in _KEPT and status.message != _NOTHING_WRONG:
            message += f"; {status.message}"
        values = status.values | {key: now for key, now in _NOW.items() if key in status.values}
        values["no_data_s"] = self.silent_s(kind, steady_ns)
        code = status.fault_code if status.level > level else INPUT_SILENCE
        return attrs.evolve(
            status, level=max(level, status.level), message=message, values=values, fault_code=code
        )


# Alarms that need a clock: a silent input.


_SILENT = Limit(SILENT_FROM_S, SILENT_FROM_S, is_latched=False)


class NodeAlarms(AlarmBoard):
    """Alarms of silent inputs, in addition to the monitor's alarms.

    The list of alarms contains them only while they are raised; otherwise live runs and replays publish the
    same bytes.

    Parameters
    ----------
    kinds : tuple of str
        Names of the input kinds.
    """

    def __init__(self, kinds: tuple[str, ...]) -> None:
        alarms = [Alarm(kind=SILENCE, subject=kind, unit="s") for kind in kinds]
        super().__init__(alarms, {alarm.name: _SILENT for alarm in alarms})

    def changed(self, values: Mapping[str, float], stamp_ns: int) -> tuple[Alarm, ...]:
        """Evaluate values by alarm name; return the alarms whose published state has changed."""
        before, _ = self.alarms, self.evaluate(values, stamp_ns)
        return tuple(alarm for name, alarm in self.alarms.items() if has_changed(before[name], alarm))

    @property
    def raised(self) -> tuple[Alarm, ...]:
        """Alarms that are published."""
        return tuple(alarm for alarm in self.alarms.values() if alarm.level is not Level.OK)

    def beside(self, alarms: AlarmList) -> AlarmList:
        """The monitor's alarms and the node's alarms."""
        return attrs.evolve(alarms, alarms=(*alarms.alarms, *self.raised)) if self.raised else alarms


# Clocks: ROS time may stand still or be set back, and stamps may be ahead of it.
#
# A live leg cannot walk through the same time twice: samples whose time is already in the ledger come from a
# clock that was reset, or from playback of a recording. If stamps agree with the node's own clock, the
# samples are live and the clock was reset: simulation time restarted, the board has no hardware clock, or the
# clock was set back. After a reboot, the same holds for stamps that are not calendar dates. The node cannot
# decide any other case.


NOW_NS = 10 * 10**9  # live samples are within this time of the node's clock; the inbox holds no more
NO_DATE_NS = 10**17  # stamps below are of 1970 to 1973: they count from the start of a device
_AHEAD_FROM_S = 1.0  # larger than the usual clock differences within a network
_STANDS_FROM_S = 1.0
_SET_BACK_NS = 10**9

UNDECIDED = (
    "the ledger contains the time of these samples already, so they are skipped and nothing is "
    "monitored. For simulated samples, set use_sim_time: true; if the clock restarts with each start, "
    "set ledger.skip_counted: false; for a recording, use replay, or no ledger"
)
BEGUN = "the clock of the samples has restarted: the ledger begins a new epoch"
_FAULTS = {
    alarms.CLOCK_MISSING: "use_sim_time is set, and no node publishes /clock",
    alarms.CLOCK_STOPPED: "stands still: /clock has stopped",
    alarms.ALREADY_COUNTED: UNDECIDED,
    alarms.CLOCK_SET_BACK: "was set back; samples keep their own stamps",
    alarms.STAMPS_AHEAD: "the stamps of the samples are ahead of the node's clock: synchronise the clocks of "
    "both computers; otherwise the monitor skips later samples",
}
"""Faults of the clock, the most severe first; the last two are warnings."""


class Clocks:
    """Compares the clocks of samples, node and ledger; a clock that was reset begins an epoch of the ledger.

    Parameters
    ----------
    monitor : WearMonitor
    boot : str
        Identifier of the computer's present boot.
    """

    def __init__(self, monitor: "WearMonitor", boot: str) -> None:
        self._monitor, self._is_other_boot = monitor, monitor.begin_run(boot)
        self._ros_ns = self._changed_ns = self._noted_ns = 0
        self._begun, self._left_out, self._reported, self._ahead_s = 0, 0, 0, 0.0

    def check(self, samples: Samples, ros_ns: int) -> None:
        """Check samples at a time of the node's clock [ns], before they are passed to the monitor."""
        sound = samples["fault"] == NO_FAULT
        # otherwise the clock was set back after these samples had arrived
        if ros_ns >= self._noted_ns and ros_ns > 0 and sound.any():
            self._ahead_s = max(self._ahead_s, 1.0e-9 * (int(samples["stamp_ns"][sound].max()) - ros_ns))
        self._noted_ns = ros_ns
        known = self._monitor.counted(samples) & sound
        if not known.any():
            return
        stamp_ns = int(samples["stamp_ns"][known][-1])
        if abs(ros_ns - stamp_ns) <= NOW_NS or (self._is_other_boot and stamp_ns < NO_DATE_NS):
            self._monitor.begin_epoch(stamp_ns, "clock")
            self._begun += 1
        else:
            self._left_out += int(np.count_nonzero(known))

    def status(self, ros_ns: int, steady_ns: int, is_simulated: bool) -> Status:
        """Present status of the clocks, and of the samples since the last status.

        Parameters
        ----------
        ros_ns, steady_ns : int
            Present time of the node's clock and of a monotonic clock [ns].
        is_simulated : bool
            True if the node follows ``/clock``.
        """
        passed_ns, before_ns = ros_ns - self._ros_ns, self._ros_ns
        if passed_ns or not self._changed_ns:
            self._ros_ns, self._changed_ns = ros_ns, steady_ns
        stands_s = (steady_ns - self._changed_ns) * 1.0e-9
        found = {
            alarms.CLOCK_MISSING: is_simulated and not ros_ns,
            alarms.CLOCK_STOPPED: stands_s > _STANDS_FROM_S,
            alarms.ALREADY_COUNTED: self._left_out > self._reported,
            alarms.CLOCK_SET_BACK: bool(before_ns) and passed_ns < -_SET_BACK_NS,
            alarms.STAMPS_AHEAD: self._ahead_s >= _AHEAD_FROM_S,
        }
        values = {
            "stands_s": stands_s,
            "is_simulated": float(is_simulated),
            "stamps_ahead_s": self._ahead_s,
            "left_out_samples": float(self._left_out),
            "epochs_begun": float(self._begun),
        }
        self._reported, self._ahead_s = self._left_out, 0.0
        code = next((code for code in _FAULTS if found[code]), "")
        if not code:
            return Status("clock", Level.OK, BEGUN if self._begun else "goes on", values)
        level = Level.WARN if code in (alarms.CLOCK_SET_BACK, alarms.STAMPS_AHEAD) else Level.ERROR
        return Status("clock", level, _FAULTS[code], values, code)


# Status of the node itself for /diagnostics: load, message loss, recording.


# Above this delay, topics with one message per sample are not published, so that the monitor can catch up.
COARSE_FROM_S = 0.25
# seconds between two turns of the node; shared memory of Fast DDS holds 512 messages meanwhile
_LATE_NS = 250_000_000
_CAUGHT_UP_NS = 1_000_000_000  # added to twice the time that the node was late


@attrs.define
class Load:
    """Load of the node.

    Attributes
    ----------
    delay_s, worst_delay_s : float
        Waiting time of the oldest message: current, and maximum since the last report [s].
    unpublished : int
        Samples whose torque and forces were not published in order to catch up.
    lost, lost_before : int
        Messages lost in transport while the node was late, and all messages lost.
    dropped_reported : int
        Messages dropped up to the last report.
    """

    delay_s: float = 0.0
    worst_delay_s: float = 0.0
    unpublished: int = 0
    lost: int = 0
    lost_before: int = 0
    dropped_reported: int = 0
    _turn_ns: int = 0
    _late_until_ns: int = 0

    def late_ns(self, now_ns: int) -> int:
        """Delay of a turn of the node at a time of the monotonic clock [ns]; 0 if the node is not late.

        A turn comes every 50 ms. Messages that arrive between turns wait in the middleware, which holds
        several seconds of them.
        """
        passed_ns, self._turn_ns = now_ns - (self._turn_ns or now_ns), now_ns
        if passed_ns < _LATE_NS:
            return 0
        # the node processes at least as fast as samples arrive
        self._late_until_ns = now_ns + 2 * passed_ns + _CAUGHT_UP_NS
        self.worst_delay_s = max(self.worst_delay_s, 1.0e-9 * passed_ns)
        return passed_ns

    def is_late(self, now_ns: int) -> bool:
        """True if the node may still be late, or was late when the messages it now takes had arrived."""
        return now_ns < self._late_until_ns

    def note_lost(self, lost: int, now_ns: int) -> None:
        """Record the number of lost messages; while the node is late, they count as its own losses."""
        if self.is_late(now_ns):
            self.lost += lost - self.lost_before
        self.lost_before = lost

    def note(self, delay_s: float) -> bool:
        """Record a delay; return whether it is too long to publish every sample."""
        self.delay_s, self.worst_delay_s = delay_s, max(self.worst_delay_s, delay_s)
        return delay_s > COARSE_FROM_S


def load_status(load: Load, inbox: Inbox, is_recorded: bool = False) -> Status:
    """Status of the load; starts a new reporting interval. Recorded samples are published even if late."""
    dropped = inbox.shed + load.lost
    level, message, code = Level.OK, "keeps up", alarms.NO_FAULT
    if dropped > load.dropped_reported:
        level, message = Level.ERROR, "overloaded: samples were dropped, and their wear is not modelled"
        code = alarms.SAMPLES_DROPPED
    elif load.worst_delay_s > COARSE_FROM_S:
        left = "published late" if is_recorded else "not published"
        level, message = Level.WARN, f"overloaded: forces and torques of samples are {left}"
        code = alarms.SAMPLES_NOT_PUBLISHED
    values = {
        "received": float(inbox.received),
        "waiting": float(len(inbox)),
        "worst_delay_s": load.worst_delay_s,
        "unpublished_samples": float(load.unpublished),
        "shed_messages": float(dropped),
    }
    load.worst_delay_s, load.dropped_reported = load.delay_s, dropped
    return Status("cpu_load", level, message, values, code)


def topics_status(topics: Iterable[InputTopic], now_ns: int, started_ns: int) -> Status:
    """Status of the input topics: their publishers and faults.

    The monitor core has no clock and cannot detect missing messages, so the node does.

    Parameters
    ----------
    topics : iterable of InputTopic
    now_ns, started_ns : int
        Present time and start time on a monotonic clock [ns].
    """
    messages, values, level = [], {}, Level.OK
    for topic in topics:
        short = topic.name.rsplit("/", 1)[-1]
        silent_s = max(0, now_ns - topic.heard_ns) * 1.0e-9 if topic.heard_ns else math.nan
        values[f"{short}_publishers"] = float(topic.publishers)
        values[f"{short}_silent_s"] = silent_s
        values[f"{short}_lost_messages"] = float(topic.lost)
        for at, fault in _faults(topic, silent_s, (now_ns - started_ns) * 1.0e-9):
            messages.append(f"{topic.name}: {fault}")
            level = max(level, at)
    code = alarms.TOPICS if messages else alarms.NO_FAULT
    return Status("topics", level, "; ".join(messages) or "connected", values, code)


def _faults(topic: InputTopic, silent_s: float, running_s: float) -> Iterator[tuple[Level, str]]:
    """Faults of a topic with their levels."""
    if silent_s > SILENT_FROM_S:
        yield Level.ERROR, f"has been silent since {utc(topic.heard_wall_ns)}: nothing is monitored"
    elif not topic.publishers:
        yield (
            Level.ERROR if running_s >= NOTHING_FROM_S else Level.WARN,
            "no node publishes it. Start its driver, or remap the topic",
        )
    elif math.isnan(silent_s) and running_s >= NOTHING_FROM_S:
        yield (
            Level.ERROR,
            "has a publisher, but no message has arrived. Compare its type and quality of service: "
            f"ros2 topic info --verbose {topic.name}",
        )
    if topic.lost > topic.lost_reported:
        yield Level.WARN, "messages are lost before they reach this node"
    if topic.content_fault:
        yield Level.ERROR, topic.content_fault
    if topic.publishers > 1 and topic.stream.kind != CRANK:  # several nodes may publish joints of one robot
        yield Level.WARN, f"{topic.publishers} publishers. Expected one"


def recording_status(black_box: BlackBox) -> Status:
    """Status of the recording."""
    values = {"recorded_messages": float(black_box.recorded)}
    if black_box.fault:
        message = f"stopped: {black_box.fault}"
        return Status("recording", Level.ERROR, message, values, alarms.RECORDING_STOPPED)
    return Status("recording", Level.OK, "on" if black_box.on else "off", values)

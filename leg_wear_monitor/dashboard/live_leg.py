"""A leg as a running monitor reports it: takes in its messages, in any order, and gives the page."""

import math
import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import islice
from typing import Any

import attrs
import numpy as np

from leg_wear_monitor.configuration.strict import structure
from leg_wear_monitor.dashboard import source as region
from leg_wear_monitor.dashboard.motion import MotionFeed, motion_region
from leg_wear_monitor.dashboard.source import (
    NOTHING_KNOWN,
    Content,
    Freshness,
    LegSetup,
    Words,
    leg_content,
    unknown_leg,
    view_of,
    words_of,
)
from leg_wear_monitor.errors import ConfigError, printable
from leg_wear_monitor.files import finite_or_none, number_of, or_nan, received_json
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.playback.history import CYCLE_COLUMNS, SEEN_COLUMNS, SUMMARY_COLUMNS
from leg_wear_monitor.playback.result import ReplayHistory, ReplayStatus, ReplaySummary
from leg_wear_monitor.report.replay.page import belief, raised_alarms
from leg_wear_monitor.state import SCHEMA_VERSION, LegState, Level

# Messages as other processes sent them; nothing in them is trusted.


MOST = 200
"""Statuses in a message, values in a status, entries of a list: what exceeds it is not from a monitor."""

_MOST_CHARACTERS = 10**6  # of a state; that of a leg with five joints has 10 000
_HUGE = 2.0**63  # no stamp, no count and no value in SI units is that large
_CODE, _NO_DATA = "fault_code", "no_data_s"


def received_status(name: str, level: int, message: str, values: Mapping[str, str]) -> ReplayStatus:
    """A status from the parts of a message: its texts on one line and not too long, its values numbers."""
    first = islice(values.items(), MOST)
    return ReplayStatus(
        name=printable(name),
        level=Level(min(max(level, Level.OK), Level.ERROR)),
        message=printable(message),
        values={printable(key): number_of(value) for key, value in first if key != _CODE},
        fault_code=printable(values.get(_CODE, "")),
    )


def own_statuses(node: str, statuses: Iterable[ReplayStatus]) -> dict[str, ReplayStatus]:
    """The statuses of a node by their names without the node's; those of other nodes are left out."""
    prefix, own = f"{node.lstrip('/')}: ", {}
    for status in islice((each for each in statuses if each.name.startswith(prefix)), MOST):
        name = status.name.removeprefix(prefix)
        own[name] = attrs.evolve(status, name=name)
    return own


def received_state(text: str, source: str) -> LegState:
    """The state of a leg from the text of a message.

    Parameters
    ----------
    text : str
    source : str
        Name of the topic, for messages.

    Raises
    ------
    ConfigError
        If it is no state, or one of another version.
    """
    record = received_json(text, source, _MOST_CHARACTERS)
    record = structure(_clean(record), dict[str, Any], source, "")
    version = record.pop("schema_version", None)
    if version != SCHEMA_VERSION:
        raise ConfigError(source, "schema_version", f"{version!r} is not {SCHEMA_VERSION}")
    return structure(record, LegState, source, "")


def _clean(part: Any) -> Any:
    """A part of a message with texts on one line, and with lists and objects that are not too long."""
    if isinstance(part, dict):
        return {printable(name): _clean(value) for name, value in islice(part.items(), MOST)}
    if isinstance(part, list):
        return [_clean(value) for value in part[:MOST]]
    if isinstance(part, str):
        return printable(part)
    is_huge = isinstance(part, int | float) and not abs(part) < _HUGE
    return None if is_huge else part


# What was heard of a leg over time, in a bounded number of rows.


MOST_ROWS = 600
"""So many points are as many as a screen shows; twice as many are thinned by two."""

_MAXIMA = ("peak_force_n",)  # of a group of gait cycles, its largest value


@attrs.frozen
class Row:
    """Values at a stamp, by column and, for those of a joint, by its name; what is absent is not known."""

    stamp_ns: int
    leg: Mapping[str, float | None]
    joints: Mapping[str, Mapping[str, float | None]]


class Trends:
    """The rows, the older ones thinned like the newer ones: always every so many."""

    def __init__(self) -> None:
        self._begin()

    def _begin(self) -> None:
        self._rows: list[Row] = []
        self._every = 1  # rows that were given, for one that is kept
        self._waiting: list[Row] = []

    def add(self, row: Row) -> None:
        """Keep a row; one of another time base, before the last, begins anew."""
        if self._rows and row.stamp_ns < self._rows[-1].stamp_ns:
            self._begin()
        self._waiting.append(row)
        if len(self._waiting) < self._every:
            return
        self._rows.append(_merged(self._waiting))
        self._waiting.clear()
        if len(self._rows) >= 2 * MOST_ROWS:
            self._rows = [_merged(self._rows[k : k + 2]) for k in range(0, len(self._rows), 2)]
            self._every *= 2

    def history(self, joints: Sequence[str]) -> ReplayHistory:
        """The rows as columns; all NaN in columns that were never heard."""
        rows = [*self._rows, *self._waiting[-1:]]
        columns: dict[str, Any] = {name: _column(row.leg.get(name) for row in rows) for name in CYCLE_COLUMNS}
        columns |= {
            name: {joint: _column(row.joints.get(name, {}).get(joint) for row in rows) for joint in joints}
            for name in SUMMARY_COLUMNS.values()
        }
        stamps = np.array([row.stamp_ns for row in rows], np.int64)
        return ReplayHistory(stamp_ns=stamps, **columns)


def _merged(rows: Sequence[Row]) -> Row:
    """One row for some: the last values that are known, and the largest of what counts as such."""
    leg: dict[str, float | None] = {}
    joints: dict[str, dict[str, float | None]] = {}
    for row in rows:
        leg |= {name: value for name, value in row.leg.items() if value is not None}
        for name, values in row.joints.items():
            kept = joints.setdefault(name, {})
            for joint, value in values.items():
                before = kept.get(joint)
                if value is not None and (name not in _MAXIMA or before is None or value > before):
                    kept[joint] = value
    return Row(rows[-1].stamp_ns, leg, joints)


def _column(values: Iterable[float | None]) -> Floats:
    return np.array([or_nan(value) for value in values], float)


OLD_AFTER_S = 5.0  # the monitor reports every second, whether the leg walks or not
_REPORTS = 3.0  # or so many of its reports did not come
_TRENDS_S = 5.0  # charts are many kilobytes: not with each message

_GAIT = {"cycle": "cycles", "cadence_rpm": "cadence_rpm"}
_TORQUE = {
    "measured_torque_rms_nm": "measured_rms_nm",
    "predicted_torque_rms_nm": "predicted_rms_nm",
    "torque_mismatch": "mismatch",
    "load_n": "load_n",
    "friction_nm": "friction_nm",
}


class LiveLeg:
    """A source that receives what a monitor publishes, from any thread.

    Parameters
    ----------
    node : str
        Full name of the monitor, such as ``/left/leg_wear_monitor``.
    waited_for : sequence of str
        Topics that its messages are to come from.
    clock : callable
        Seconds that only grow.
    """

    def __init__(self, node: str, waited_for: Sequence[str], clock: Callable[[], float]) -> None:
        self._node, self._clock = node, clock
        self._waited_for = ", ".join(map(printable, waited_for))
        self._lock = threading.Lock()
        self._setup: LegSetup | None = None
        self._why_unknown = "The monitor has not told its parameters yet."
        self._state, self._fault = NOTHING_KNOWN, ""
        self._statuses: dict[str, ReplayStatus] = {}
        self._leg_silent_s: float | None = None
        self._peaks_n: dict[str, float | None] = {}
        self._trends = Trends()
        self._arrived_s: float | None = None
        self._is_new = True
        self._drawn: tuple[float, str] = (-math.inf, "")
        self._moving = ""
        self.motion = MotionFeed()

    # --- what the monitor says ---

    def take_setup(self, setup: LegSetup | None, why_not: str = "") -> None:
        """The leg's parameters, or why they are not known."""
        with self._lock:
            self._setup, self._why_unknown, self._is_new = setup, printable(why_not), True
            if setup is not None and setup.mechanism is not None:
                self._moving = motion_region(setup.mechanism, setup.monitor.limits.torque_mismatch)

    def take_motion(self, text: str) -> None:
        """A message of ``~/motion``."""
        with self._lock:
            clearances = self._state.clearances
        self.motion.add(text, f"{self._node}/motion", clearances)

    def take_diagnostics(self, stamp_ns: int, statuses: Iterable[ReplayStatus]) -> None:
        """A message of ``/diagnostics``; those of other nodes are left out."""
        own = own_statuses(self._node, statuses)
        if not own:
            return
        with self._lock:
            self._note_arrival()
            verdict = own.pop("verdict", None)
            self._leg_silent_s = verdict.values.get(_NO_DATA) if verdict else None
            self._statuses = own
            self._trends.add(self._row(stamp_ns))

    def take_state(self, text: str) -> None:
        """A message of ``~/state``; what is no state is left out, and reported."""
        try:
            state, fault = received_state(text, f"{self._node}/state"), ""
        except ConfigError as error:
            state, fault = NOTHING_KNOWN, f"The state of the leg cannot be read: {error}"
        with self._lock:
            self._note_arrival()
            self._state, self._fault = state, fault

    def take_peaks(self, peaks_n: Mapping[str, float]) -> None:
        """A message of ``~/clearance_states``: the largest contact force of each joint in a gait cycle."""
        first = islice(peaks_n.items(), MOST)
        with self._lock:
            self._note_arrival()
            self._peaks_n = {printable(joint): finite_or_none(peak_n) for joint, peak_n in first}

    def _note_arrival(self) -> None:
        self._arrived_s, self._is_new = self._clock(), True

    def _row(self, stamp_ns: int) -> Row:
        leg: dict[str, float | None] = {}
        for status, columns in (("gait", _GAIT), ("torque", _TORQUE)):
            if status in self._statuses:
                values = self._statuses[status].values
                leg |= {column: values.get(name) for column, name in columns.items()}
        joints = self._state.clearances
        counted = {joint: each.counted_m for joint, each in joints.items()}
        seen = {name: {joint: getattr(each, name) for joint, each in joints.items()} for name in SEEN_COLUMNS}
        return Row(stamp_ns, leg, {"counted_m": counted, **seen, "peak_force_n": self._peaks_n})

    # --- what the page shows ---

    def renew(self) -> bool:
        """Whether anything was heard since the last content."""
        return self._is_new

    def content(self) -> Content:
        """The page with all that was heard last."""
        with self._lock:
            view, why_unknown = self._view(), self._fault or ("" if self._setup else self._why_unknown)
            self._is_new = False
        regions = {
            region.VERDICT: region.verdict_region(view),
            region.JOINTS: region.joints_region(view, why_unknown),
            **({region.MOTION: self._moving} if self._moving else {}),
            region.ALARMS: raised_alarms(view, otherwise="No alarm is raised."),
            region.BELIEF: belief(view),
            region.TRENDS: self._trends_region(view),
            region.STATUS: region.status_region(view),
        }
        return leg_content(regions, self._words(view), self.freshness(), "Live, data ")

    def freshness(self) -> Freshness:
        """Since when nothing was heard of the monitor; or, if it speaks, since when it has no data."""
        with self._lock:
            arrived_s, leg_s = self._arrived_s, self._leg_silent_s
        if arrived_s is None:
            return Freshness(
                None,
                f"WAITING for the monitor {printable(self._node)}: no message yet on {self._waited_for}. "
                "Is it running, with this name and this ROS_DOMAIN_ID?",
                self._old_after_s,
            )
        age_s = self._clock() - arrived_s
        silence = "nothing is heard of the monitor; is it running?"
        if leg_s is not None and age_s < self._old_after_s:
            age_s += leg_s
            silence = "the monitor runs, but receives nothing from the leg; see its status below"
        return Freshness(age_s, silence, self._old_after_s)

    def _words(self, view: ReplaySummary) -> Words:
        node, leg = printable(self._node), printable(view.monitor.hardware_id) or "a leg"
        which = ", ".join(filter(None, [view.monitor.mechanism, f"live from {node}"]))
        return words_of(view, node, f"Joint wear of {leg}", which)

    @property
    def _old_after_s(self) -> float:
        return max(OLD_AFTER_S, _REPORTS * self._setup.report_s) if self._setup else OLD_AFTER_S

    def _trends_region(self, view: ReplaySummary) -> str:
        now_s, (drawn_s, markup) = self._clock(), self._drawn
        if now_s - drawn_s >= _TRENDS_S or len(view.history.stamp_ns) < 3:
            markup = region.trends_region(view, "Since this dashboard was started.")
            self._drawn = now_s, markup
        return markup

    def _view(self) -> ReplaySummary:
        setup, gait = self._setup or unknown_leg(), self._statuses.get("gait")
        return view_of(
            setup,
            self._state,
            self._trends.history(setup.joints),
            status=list(self._statuses.values()),
            missing="" if self._state.life_cycles else gait.message if gait else "nothing was heard",
        )

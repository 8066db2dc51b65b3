"""A leg as a running monitor reports it: takes in its messages, in any order, and gives the page."""

import math
import threading
from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import islice
from typing import Any

import attrs
import numpy as np

from leg_wear_monitor.configuration.strict import structure
from leg_wear_monitor.dashboard.leg_page import (
    NOTHING_KNOWN,
    Content,
    Freshness,
    LegSetup,
    leg_content,
    summary_of_now,
    trends_markup,
)
from leg_wear_monitor.errors import ConfigError, printable
from leg_wear_monitor.files import number_of, or_nan, received_json
from leg_wear_monitor.recordings.result import ReplayHistory, ReplayStatus, ReplaySummary
from leg_wear_monitor.recordings.summary import CYCLE_COLUMNS, SEEN_COLUMNS, SUMMARY_COLUMNS
from leg_wear_monitor.state import SCHEMA_VERSION, LegState, Level

# Messages as other processes sent them; nothing in them is trusted.


MOST = 200
"""Statuses in a message, values in a status, entries of a list: a monitor sends fewer."""

_MOST_CHARACTERS = 10**6  # characters of a state; a leg with five joints has 10 000
_HUGE = 2.0**63  # no stamp, no count and no value in SI units is that large
_CODE, _NO_DATA = "fault_code", "no_data_s"


def received_status(name: str, level: int, message: str, values: Mapping[str, str]) -> ReplayStatus:
    """A status from the parts of a message, with short texts on one line and numeric values."""
    first = islice(values.items(), MOST)
    return ReplayStatus(
        name=printable(name),
        level=Level(min(max(level, Level.OK), Level.ERROR)),
        message=printable(message),
        values={printable(key): number_of(value) for key, value in first if key != _CODE},
        fault_code=printable(values.get(_CODE, "")),
    )


def own_statuses(node: str, statuses: Iterable[ReplayStatus]) -> dict[str, ReplayStatus]:
    """The statuses of a node by their names without the node's name; statuses of other nodes are left out."""
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
        If it is not a state, or has a different version.
    """
    record = received_json(text, source, _MOST_CHARACTERS)
    record = structure(_clean(record), dict[str, Any], source, "")
    version = record.pop("schema_version", None)
    if version != SCHEMA_VERSION:
        raise ConfigError(source, "schema_version", f"{version!r} is not {SCHEMA_VERSION}")
    return structure(record, LegState, source, "")


def _clean(part: Any) -> Any:
    """A part of a message, with texts on one line and bounded lists and objects."""
    if isinstance(part, dict):
        return {printable(name): _clean(value) for name, value in islice(part.items(), MOST)}
    if isinstance(part, list):
        return [_clean(value) for value in part[:MOST]]
    if isinstance(part, str):
        return printable(part)
    is_huge = isinstance(part, int | float) and not abs(part) < _HUGE
    return None if is_huge else part


_STATES = 1200  # in the trends: twenty minutes at one gait cycle per second
OLD_AFTER_S = 5.0  # the monitor reports every second, whether the leg walks or not
_TRENDS_S = 5.0  # charts are many kilobytes, so the page does not send them with each message


class LiveLeg:
    """Receives the messages of a monitor, from any thread.

    Parameters
    ----------
    node : str
        Full name of the monitor, such as ``/left/leg_wear_monitor``.
    waited_for : sequence of str
        Topics that its messages are to come from.
    clock : callable
        Seconds that only grow.
    setup : LegSetup
        The leg by the parameters of its monitor.
    """

    def __init__(
        self, node: str, waited_for: Sequence[str], clock: Callable[[], float], setup: LegSetup
    ) -> None:
        self._node, self._clock = node, clock
        self._waited_for = ", ".join(map(printable, waited_for))
        self._lock = threading.Lock()
        self._setup = setup
        self._state, self._fault = NOTHING_KNOWN, ""
        self._statuses: dict[str, ReplayStatus] = {}
        self._leg_silent_s: float | None = None
        self._past: deque[LegState] = deque(maxlen=_STATES)
        self._arrived_s: float | None = None
        self._is_new = True
        self._trends: tuple[float, str] = (-math.inf, "")

    def take_diagnostics(self, stamp_ns: int, statuses: Iterable[ReplayStatus]) -> None:
        """A message of ``/diagnostics``; statuses of other nodes are left out."""
        own = own_statuses(self._node, statuses)
        if not own:
            return
        with self._lock:
            self._note_arrival()
            verdict = own.pop("verdict", None)
            self._leg_silent_s = verdict.values.get(_NO_DATA) if verdict else None
            self._statuses = own

    def take_state(self, text: str) -> None:
        """A message of ``~/state``; the page reports a message that it cannot read."""
        try:
            state, fault = received_state(text, f"{self._node}/state"), ""
            if state.clearances and set(state.clearances) != set(self._setup.monitor.clearance_joints):
                fault = "This is a different leg. Give the parameter file of its monitor with --config FILE."
        except ConfigError as error:
            state, fault = NOTHING_KNOWN, f"The state of the leg cannot be read: {error}"
        with self._lock:
            self._note_arrival()
            self._state, self._fault = state, fault
            if self._past and state.stamp_ns < self._past[-1].stamp_ns:  # a different time base
                self._past.clear()
            if not fault:
                self._past.append(state)

    def _note_arrival(self) -> None:
        self._arrived_s, self._is_new = self._clock(), True

    def has_news(self) -> bool:
        """True if messages have come since the last content."""
        return self._is_new

    def content(self) -> Content:
        """The page with the last received values."""
        with self._lock:
            now, fault = self._now(), self._fault
            self._is_new = False
        return leg_content(now, printable(self._node), self.freshness(), fault, self._charts(now))

    def freshness(self) -> Freshness:
        """Start of the time without messages, or, if the monitor sends messages, of the time without data."""
        with self._lock:
            arrived_s, leg_s = self._arrived_s, self._leg_silent_s
        if arrived_s is None:
            return Freshness(
                None,
                f"WAITING for the monitor {printable(self._node)}: no message yet on {self._waited_for}. "
                "Is it running, with this name and this ROS_DOMAIN_ID?",
                OLD_AFTER_S,
            )
        age_s = self._clock() - arrived_s
        silence = "no message from the monitor. Is it running?"
        if leg_s is not None and age_s < OLD_AFTER_S:
            age_s += leg_s
            silence = "the monitor runs, but receives nothing from the leg; see its status below"
        return Freshness(age_s, silence, OLD_AFTER_S)

    def _charts(self, now: ReplaySummary) -> str:
        now_s, (drawn_s, markup) = self._clock(), self._trends
        if now_s - drawn_s >= _TRENDS_S or len(now.history.stamp_ns) < 3:
            markup = trends_markup(now)
            self._trends = now_s, markup
        return markup

    def _now(self) -> ReplaySummary:
        setup, gait = self._setup, self._statuses.get("gait")
        missing = "" if self._state.life_cycles else gait.message if gait else "no message was received"
        history = _history(self._past, setup.monitor.clearance_joints)
        return summary_of_now(setup, self._state, history, list(self._statuses.values()), missing)


def _history(states: Sequence[LegState], joints: Sequence[str]) -> ReplayHistory:
    """Clearances of past states as columns; the columns of gait cycles are not known."""
    columns: dict[str, Any] = dict.fromkeys(CYCLE_COLUMNS, np.full(len(states), math.nan))
    columns |= {name: {} for name in SUMMARY_COLUMNS.values()}
    for name in ("modelled_m", *SEEN_COLUMNS):
        columns[name] = {
            joint: np.array([or_nan(getattr(one.clearances.get(joint), name, None)) for one in states], float)
            for joint in joints
        }
    return ReplayHistory(stamp_ns=np.array([one.stamp_ns for one in states], np.int64), **columns)

"""Since when no sample comes that can be used: only the node has a clock to see it by.

Messages that come and cannot be used are silence, too: the leg is not monitored.
"""

import math
from collections.abc import Iterable, Mapping
from datetime import UTC, datetime

import attrs

from leg_wear_monitor.monitor.alarms.alarm import Level
from leg_wear_monitor.monitor.reports import Status
from leg_wear_monitor.twin.kinds import CRANK, KINDS

SILENT_FROM_S = 1.0
NOTHING_FROM_S = 10.0  # after the start; a leg may be switched on after its monitor

# what of a status is a rate or a speed of samples that come no more
_NOW = {
    "cadence_rpm": math.nan,
    **{f"{kind.name}_rate_hz": 0.0 for kind in KINDS.values()},
}
# of the node itself, or of faults: what they say still holds
_KEPT = ("input", "alarms", "ledger", "load", "topics", "recording", "clock")
_NOTHING_WRONG = "in order"


def utc(time_ns: int) -> str:
    """A time as people write it, such as 2026-11-21T22:13:05.250Z."""
    time = datetime.fromtimestamp(time_ns / 1e9, UTC).isoformat(timespec="milliseconds")
    return time.replace("+00:00", "Z")


@attrs.define
class _Kind:
    """Samples of a kind: how many were used, and when that last grew, by both clocks."""

    steady_ns: int
    wall_ns: int
    used: int = 0


class Silence:
    """Knows since when samples of a kind have not come.

    Parameters
    ----------
    kinds : iterable of str
        Names of those that have samples of their own.
    steady_ns, wall_ns : int
        Now, by a clock that only goes forward, and by the one that people read.
    """

    def __init__(self, kinds: Iterable[str], steady_ns: int, wall_ns: int) -> None:
        self._kinds = {kind: _Kind(steady_ns, wall_ns) for kind in kinds}

    @property
    def kinds(self) -> tuple[str, ...]:
        """The kinds that are waited for."""
        return tuple(self._kinds)

    def note(self, used: Mapping[str, int], steady_ns: int, wall_ns: int) -> None:
        """Take down how many samples of each kind were used so far."""
        for name, kind in self._kinds.items():
            if used[name] != kind.used:
                kind.used, kind.steady_ns, kind.wall_ns = used[name], steady_ns, wall_ns

    def silent_s(self, name: str, steady_ns: int) -> float:
        """For how long none of a kind came [s], since the start if none ever did; 0 if none is awaited."""
        kind = self._kinds.get(name)
        return 0.0 if kind is None else (steady_ns - kind.steady_ns) * 1.0e-9

    def level(self, name: str, steady_ns: int) -> Level:
        """How bad that is: ERROR for a silence; a warning for the first seconds after the start."""
        kind, silent_s = self._kinds.get(name), self.silent_s(name, steady_ns)
        if kind is None or (kind.used and silent_s <= SILENT_FROM_S):
            return Level.OK
        return Level.ERROR if kind.used or silent_s >= NOTHING_FROM_S else Level.WARN

    def since(self, name: str) -> str:
        """Since when, in words."""
        kind = self._kinds[name]
        return f"since {utc(kind.wall_ns)}" if kind.used else f"since the start at {utc(kind.wall_ns)}"

    def marked(self, statuses: Iterable[Status], steady_ns: int) -> tuple[Status, ...]:
        """Statuses, each with what it has no current data of: without the crank, all of them."""
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
        return Status(status.name, max(level, status.level), message, values)

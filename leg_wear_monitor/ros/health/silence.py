"""Detection of silent inputs (no usable samples), which only the node can do because it has a clock.

Unusable messages count as silence, because the leg is not monitored.
"""

import math
from collections.abc import Iterable, Mapping
from datetime import UTC, datetime

import attrs

from leg_wear_monitor.monitor.alarms.alarm import Level
from leg_wear_monitor.monitor.alarms.fault_codes import INPUT_SILENCE
from leg_wear_monitor.monitor.reports import Status
from leg_wear_monitor.twin.kinds import CRANK, KINDS

SILENT_FROM_S = 1.0
NOTHING_FROM_S = 10.0  # grace period after the start; a leg may be switched on after its monitor

# status values that are rates or speeds, and their values during silence
_NOW = {
    "cadence_rpm": math.nan,
    **{f"{kind.name}_rate_hz": 0.0 for kind in KINDS.values()},
}
# statuses of the node itself or of faults; they remain valid during silence
_KEPT = ("verdict", "input", "alarms", "ledger", "load", "topics", "recording", "clock")
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

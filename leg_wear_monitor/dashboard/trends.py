"""What was heard of a leg over time, in a bounded number of rows."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import attrs
import numpy as np

from leg_wear_monitor.json_text import or_nan
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.playback.history import CYCLE_COLUMNS, JOINT_COLUMNS
from leg_wear_monitor.playback.result.replay_history import ReplayHistory

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
            for name in (*JOINT_COLUMNS, "seen_m")
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

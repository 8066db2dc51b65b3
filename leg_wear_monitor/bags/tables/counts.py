"""What is remarkable about the rows of a table: times that go back, gaps, empty cells."""

from collections.abc import Iterator

import attrs
import numpy as np
from numpy.typing import NDArray

from leg_wear_monitor.bags.findings import Severity
from leg_wear_monitor.bags.tables.layout import CRANK_ANGLE, DRIVE_TORQUE, Rows
from leg_wear_monitor.monitor.config.settings import MonitorConfig

_Found = Iterator[tuple[str, Severity]]


@attrs.define
class _Steps:
    """How often something happened from one row to the next, the line where it did first, its size there."""

    count: int = 0
    line: int = 0
    size_s: float = 0.0

    @property
    def more(self) -> str:
        """How often it happened, if more than once."""
        return f" ({self.count} times in all)" if self.count > 1 else ""

    def add(self, which: NDArray[np.bool_], line: NDArray[np.int64], steps_ns: NDArray[np.int64]) -> None:
        at = np.flatnonzero(which)
        if len(at) and not self.count:
            self.line, self.size_s = int(line[at[0]]), float(steps_ns[at[0]]) * 1.0e-9
        self.count += len(at)


@attrs.define
class Counts:
    """Counts over all rows so far.

    Parameters
    ----------
    config : MonitorConfig
    is_effort : bool
        Whether a torque without an angle in its row cannot be used.
    word : str
        What a row is called: ``line`` or ``row``.

    Attributes
    ----------
    rows : int
    first_ns, last_ns : int or None
        Stamps of the first and of the last row [ns].
    measured : dict
        Number of rows with a value, by column.
    least, most : dict
        Range of the values in SI units, by column.
    """

    config: MonitorConfig
    is_effort: bool
    word: str
    rows: int = attrs.field(init=False, default=0)
    first_ns: int | None = attrs.field(init=False, default=None)
    last_ns: int | None = attrs.field(init=False, default=None)
    measured: dict[str, int] = attrs.field(init=False, factory=dict)
    least: dict[str, float] = attrs.field(init=False, factory=dict)
    most: dict[str, float] = attrs.field(init=False, factory=dict)
    _back: _Steps = attrs.field(init=False, factory=_Steps)
    _repeated: _Steps = attrs.field(init=False, factory=_Steps)
    _gaps: _Steps = attrs.field(init=False, factory=_Steps)
    _zero: int = attrs.field(init=False, default=0)
    _unused: int = attrs.field(init=False, default=0)

    def add(self, rows: Rows) -> None:
        """Add rows, in their order."""
        if not len(rows.line):
            return
        before = rows.stamp_ns[0] if self.last_ns is None else self.last_ns
        steps = np.diff(rows.stamp_ns, prepend=before)
        begin = self.last_ns is None
        self._back.add(steps < 0, rows.line, steps)
        self._repeated.add((steps == 0) & (np.arange(len(steps)) >= begin), rows.line, steps)
        self._gaps.add(steps > 1.0e9 * self.config.tracker.gap_limit_s, rows.line, steps)
        self.first_ns = int(rows.stamp_ns[0]) if self.first_ns is None else self.first_ns
        self.last_ns, self.rows = int(rows.stamp_ns[-1]), self.rows + len(rows.line)
        self._zero += int(np.count_nonzero(rows.stamp_ns == 0))
        if self.is_effort:
            alone = rows.measured[DRIVE_TORQUE] & ~rows.measured[CRANK_ANGLE]
            self._unused += int(np.count_nonzero(alone))
        for key, there in rows.measured.items():
            self.measured[key] = self.measured.get(key, 0) + int(np.count_nonzero(there))
            self._range(key, rows.values[key])

    def findings(self) -> _Found:
        """Findings after the last row: text and severity."""
        note, word = Severity.NOTE, self.word
        if self._back.count:
            back = f"the time goes back by {-self._back.size_s:.6g} s at {word} {self._back.line}"
            yield f"{back}{self._back.more}", note
        if self._repeated.count:
            yield f"the time repeats at {word} {self._repeated.line}{self._repeated.more}", note
        if self._gaps.count:
            gap = f"the time jumps by {self._gaps.size_s:.6g} s at {word} {self._gaps.line}"
            yield f"{gap}{self._gaps.more}; the leg was not monitored in between", note
        if self._zero:
            text = "a time of 0 is that of a clock that is not set, and counts as faulty; set input.start"
            yield text, note
        if self._unused:
            text = f"{self._unused} torques have no angle in their row; drive_torque.source 'effort' needs it"
            yield f"{text}, 'wrench' does not", Severity.LOSS
        for key, number in self.measured.items():
            if number < self.rows:
                text = (
                    f"{key} is empty in {self.rows - number} of {self.rows} rows: nothing was measured there"
                )
                yield text, note

    def _range(self, key: str, values: NDArray[np.float64]) -> None:
        finite = values[np.isfinite(values)]
        if len(finite):
            self.least[key] = min(self.least.get(key, np.inf), float(finite.min()))
            self.most[key] = max(self.most.get(key, -np.inf), float(finite.max()))

"""When a forecast is told: with a minute's first gait cycle, after an alarm's change, with a new answer."""

from collections.abc import Iterator

from leg_wear_monitor.monitor.forecast.forecast import Answer
from leg_wear_monitor.monitor.reports import CycleReport, Reports

_MINUTE_NS = 60 * 10**9


class ForecastTimes:
    """Picks gait cycles by stamps alone: however reports are joined, the same ones."""

    def __init__(self) -> None:
        self._told_ns: int | None = None
        self._changes_ns: list[int] = []
        self._answers: list[Answer] = []

    def due(self, reports: Reports) -> Iterator[CycleReport]:
        """Gait cycles of reports after which a forecast is due."""
        self._changes_ns += [change.stamp_ns for change in reports.alarms]
        for cycle in reports.cycles:
            seen = [stamp for stamp in self._changes_ns if stamp <= cycle.stamp_ns]
            told = [joint.forecast for joint in cycle.joints] + [cycle.forecast]
            answers = [each.answer for each in told if each is not None]
            if seen or answers != self._answers or self._is_minute(cycle.stamp_ns):
                self._answers = answers
                self._changes_ns = [stamp for stamp in self._changes_ns if stamp > cycle.stamp_ns]
                self._told_ns = cycle.stamp_ns
                yield cycle

    def _is_minute(self, stamp_ns: int) -> bool:
        """Whether the last was a minute ago, or of another time base, or is still to come."""
        return self._told_ns is None or not 0 <= stamp_ns - self._told_ns < _MINUTE_NS

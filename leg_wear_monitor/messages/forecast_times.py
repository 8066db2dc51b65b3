"""Times of forecast messages: a minute after the last one, after an alarm change, on a new answer."""

from collections.abc import Iterator

from leg_wear_monitor.monitor.forecast.forecast import Answer
from leg_wear_monitor.monitor.reports import CycleReport, Reports

_MINUTE_NS = 60 * 10**9


class ForecastTimes:
    """Selects gait cycles by their stamps only, independent of how reports are grouped."""

    def __init__(self) -> None:
        self._published_ns: int | None = None
        self._changes_ns: list[int] = []
        self._answers: list[Answer] = []

    def due(self, reports: Reports) -> Iterator[CycleReport]:
        """Gait cycles after which a forecast is due."""
        self._changes_ns += [change.stamp_ns for change in reports.alarms]
        for cycle in reports.cycles:
            changes = [stamp for stamp in self._changes_ns if stamp <= cycle.stamp_ns]
            forecasts = [joint.forecast for joint in cycle.joints] + [cycle.forecast]
            answers = [each.answer for each in forecasts if each is not None]
            if changes or answers != self._answers or self._is_minute(cycle.stamp_ns):
                self._answers = answers
                self._changes_ns = [stamp for stamp in self._changes_ns if stamp > cycle.stamp_ns]
                self._published_ns = cycle.stamp_ns
                yield cycle

    def _is_minute(self, stamp_ns: int) -> bool:
        """Whether no forecast was published yet, or the last is a minute old or of another time base."""
        return self._published_ns is None or not 0 <= stamp_ns - self._published_ns < _MINUTE_NS

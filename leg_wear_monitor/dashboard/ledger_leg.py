"""A leg as its ledger has it, which a monitor may be writing meanwhile."""

from collections.abc import Callable, Iterable
from pathlib import Path

from leg_wear_monitor.dashboard import source as region
from leg_wear_monitor.dashboard.live_leg import Row, Trends
from leg_wear_monitor.dashboard.source import (
    Content,
    Freshness,
    leg_content,
    leg_setup,
    unreadable,
    view_of,
    words_of,
)
from leg_wear_monitor.errors import printable
from leg_wear_monitor.files import stamp_of
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.ledger.entry import ClearancePoint, walked_words
from leg_wear_monitor.monitor.ledger.file import LedgerError
from leg_wear_monitor.monitor.ledger.ledger import LedgerContent
from leg_wear_monitor.monitor.ledger_state import content_of, state_in_ledger
from leg_wear_monitor.playback.result import ReplaySummary
from leg_wear_monitor.report.replay.page import raised_alarms

OLD_AFTER_S = 60.0  # a monitor of a walking leg writes more often

# Times that a ledger is read, half a second apart while it is shown: a copy into which a monitor wrote
# meanwhile is not whole.
_TRIES = 6
_SILENCE = "nothing was written into the ledger; the monitor does not run, or the leg does not walk"


class LedgerLeg:
    """A source that reads a ledger again when it has changed.

    Parameters
    ----------
    path : pathlib.Path
    config : MonitorConfig
    mechanism : Mechanism
        As `fitted` returned it.
    clock : callable
        Seconds since 1970, as file systems have them.

    Raises
    ------
    LedgerError
        If the ledger is not one of this leg.
    """

    motion = None  # a ledger has no crank angles

    def __init__(
        self, path: Path, config: MonitorConfig, mechanism: Mechanism, clock: Callable[[], float]
    ) -> None:
        self._path, self._clock = path, clock
        self._config, self._mechanism = config, mechanism
        self._setup = leg_setup(config, mechanism)
        self._read_stamp = 0, 0, 0
        self._failures = 0
        self._fault = ""
        self._content: LedgerContent | None = None
        while not self._read() and self._failures < _TRIES:
            continue
        if self._content is None:
            raise LedgerError(self._fault)

    def renew(self) -> bool:
        """Read the ledger if it has changed; whether there is something else to show."""
        return stamp_of(self._path) != self._read_stamp and (self._read() or self._failures == _TRIES)

    def _read(self) -> bool:
        stamp = stamp_of(self._path)
        try:
            self._content = content_of(self._path, self._mechanism, self._config)
        except LedgerError as error:
            self._failures += 1
            self._fault = str(error)
            return False
        self._failures, self._fault, self._read_stamp = 0, "", stamp
        return True

    def freshness(self) -> Freshness:
        """Since when nothing was written."""
        if self._failures >= _TRIES:
            return unreadable(self._fault, OLD_AFTER_S)
        return Freshness(max(0.0, self._clock() - 1.0e-9 * self._read_stamp[0]), _SILENCE, OLD_AFTER_S)

    def content(self) -> Content:
        """The page."""
        view = self._view()
        regions = {
            region.VERDICT: region.verdict_region(view),
            region.JOINTS: region.joints_region(view),
            region.ALARMS: raised_alarms(view, otherwise="No alarm is raised."),
            region.TRENDS: region.trends_region(view, _heading(view)),
        }
        name = printable(self._setup.monitor.hardware_id)
        summary = f"{self._setup.monitor.mechanism}, from the ledger {printable(str(self._path))}"
        words = words_of(view, name, f"Joint wear of {name}", summary)
        return leg_content(regions, words, self.freshness(), "Written ")

    def _view(self) -> ReplaySummary:
        found = self._content
        if found is None:
            raise LedgerError(self._fault)
        state = state_in_ledger(found, self._mechanism, self._config)
        history = _trends(found.clearances).history(self._setup.joints)
        return view_of(self._setup, state, history, measurements=found.measurements, walked=found.loads)


def _heading(view: ReplaySummary) -> str:
    words = walked_words(view.walked)
    return f"As the ledger has it: {words}." if words else "As the ledger has it."


def _trends(points: Iterable[ClearancePoint]) -> Trends:
    """The clearances over time, those of one stamp in one row."""
    rows: dict[int, dict[str, float | None]] = {}
    for point in points:
        rows.setdefault(point.stamp_ns, {})[point.joint] = point.clearance_m
    trends = Trends()
    for stamp_ns, clearances in rows.items():
        trends.add(Row(stamp_ns, {}, {"counted_m": clearances}))
    return trends

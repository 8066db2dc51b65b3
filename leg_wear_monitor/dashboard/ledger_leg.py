"""A leg as its ledger has it, which a monitor may be writing meanwhile."""

from collections.abc import Callable, Iterable
from pathlib import Path

from leg_wear_monitor.dashboard import source as region
from leg_wear_monitor.dashboard.live_leg import Row, Trends
from leg_wear_monitor.dashboard.source import (
    NO_VERDICT,
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
from leg_wear_monitor.monitor.alarm_specs import with_its_unit
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.forecast.measurement import last_measured
from leg_wear_monitor.monitor.judgement import joint_clearance, leg_alarm, with_measured
from leg_wear_monitor.monitor.ledger.entry import (
    ClearancePoint,
    JointWear,
    binding_of,
    clearance_limit_key,
    walked_words,
)
from leg_wear_monitor.monitor.ledger.file import LedgerError
from leg_wear_monitor.monitor.ledger.ledger import LedgerContent, read_ledger
from leg_wear_monitor.monitor.verdict.situation import JointSituation
from leg_wear_monitor.playback.result import ReplaySummary
from leg_wear_monitor.report.replay.page import raised_alarms
from leg_wear_monitor.state import Figure, JointClearance, LegAlarms, LegState, LifeHours, Verdict

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
        self._setup, self._binding = leg_setup(config, mechanism), binding_of(mechanism, config)
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
            self._content = read_ledger(self._path, self._binding)
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

    def leg_page(self, name: str) -> None:
        """None: that is for a fleet, and this is one leg."""

    def _view(self) -> ReplaySummary:
        found = self._content
        if found is None:
            raise LedgerError(self._fault)
        parts = {part.name: part for part in found.entry.joints} if found.entry else {}
        joints = {joint: parts[joint] for joint in self._setup.joints if joint in parts}
        verdict = found.verdict or NO_VERDICT
        is_doubted = Figure.FORECAST in verdict.not_valid
        alarms = found.entry.alarms if found.entry else ()
        state = LegState(
            verdict=verdict,
            clearances={
                joint: self._clearance(found, part, self._setup.new_m[joint] + part.mean_m, verdict)
                for joint, part in joints.items()
            },
            life={joint: None if is_doubted else _life(found, part) for joint, part in joints.items()},
            alarms=LegAlarms(now=tuple(leg_alarm(with_its_unit(each)) for each in alarms)),
            life_cycles=int(found.entry.totals.get("cycles", 0.0)) if found.entry else 0,
        )
        history = _trends(found.clearances).history(self._setup.joints)
        return view_of(self._setup, state, history, measurements=found.measurements, walked=found.loads)

    def _clearance(
        self, found: LedgerContent, part: JointWear, counted_m: float, verdict: Verdict
    ) -> JointClearance:
        joint, totals = part.name, found.entry.totals if found.entry else {}
        limit_m = totals.get(clearance_limit_key(joint), self._setup.limits_m[joint])
        last = last_measured(found.measurements, joint, part.replaced_ns)
        known = with_measured(JointSituation(joint=joint, counted_m=counted_m, limit_m=limit_m), last)
        alarms = found.entry.alarms if found.entry else ()
        own = next((each for each in alarms if (each.kind, each.subject) == ("clearance", joint)), None)
        return joint_clearance(known, own, [verdict], self._setup.new_m[joint])


def _heading(view: ReplaySummary) -> str:
    words = walked_words(view.walked)
    return f"As the ledger has it: {words}." if words else "As the ledger has it."


def _life(found: LedgerContent, part: JointWear) -> LifeHours | None:
    """Hours of walking from the last forecast on, with the part's own mean duration of a gait cycle."""
    point = found.forecasts.get(part.name)
    if point is None or not part.cycles or point.stamp_ns < part.replaced_ns or found.entry is None:
        return None
    since = max(0.0, found.entry.totals.get("cycles", 0.0) - point.cycle)
    hours = part.moving_s / part.cycles / 3600.0
    p10, p50, p90 = (
        hours * max(0.0, cycles - since) for cycles in (point.p10_cycles, point.p50_cycles, point.p90_cycles)
    )
    return LifeHours(p10_h=p10, p50_h=p50, p90_h=p90)


def _trends(points: Iterable[ClearancePoint]) -> Trends:
    """The clearances over time, those of one stamp in one row."""
    rows: dict[int, dict[str, float | None]] = {}
    for point in points:
        rows.setdefault(point.stamp_ns, {})[point.joint] = point.clearance_m
    trends = Trends()
    for stamp_ns, clearances in rows.items():
        trends.add(Row(stamp_ns, {}, {"counted_m": clearances}))
    return trends

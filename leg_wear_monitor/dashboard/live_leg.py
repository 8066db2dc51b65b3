"""A leg as a running monitor reports it: takes in its messages, in any order, and gives the page."""

import math
import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import islice

import attrs

from leg_wear_monitor.dashboard import source as region
from leg_wear_monitor.dashboard.received import (
    MOST,
    NO_DATA,
    Row,
    Trends,
    alarm_of,
    hours_of,
    joint_forecast_of,
    leg_life_of,
    own_statuses,
    verdict_of,
)
from leg_wear_monitor.dashboard.source import (
    NO_VERDICT,
    Content,
    Freshness,
    Known,
    LegPage,
    LegSetup,
    Words,
    unknown_leg,
    view_of,
    words_of,
)
from leg_wear_monitor.errors import printable
from leg_wear_monitor.files import finite_or_none
from leg_wear_monitor.monitor.leg_state import life_hours
from leg_wear_monitor.playback.result import (
    LegLife,
    ReplayJoint,
    ReplayStatus,
    ReplaySummary,
)
from leg_wear_monitor.state import JointClearance, LifeHours

# Joints as a monitor's messages tell them.


_SEEN_BY = (("encoders", "encoders", "{}_seen_m"), ("diagnosis", "torque", "{}_clearance_m"))

_BELIEVED_BY = "believed_by_"

Statuses = Mapping[str, ReplayStatus]


@attrs.frozen
class LiveJoints:
    """Each joint's report, clearance and remaining life, by its name."""

    reports: dict[str, ReplayJoint]
    clearances: dict[str, JointClearance]
    life: dict[str, LifeHours | None]

    def life_with(self, leg: LegLife | None) -> dict[str, LifeHours | None]:
        """The lives with that of the leg; empty before there is one."""
        return self.life | ({"leg": life_hours(leg.hours)} if leg else {})


def joints_of(
    setup: LegSetup,
    statuses: Statuses,
    forecasts: Statuses,
    cycle: Mapping[str, Mapping[str, float | None]],
) -> LiveJoints:
    """The joints of a leg that were heard of.

    Parameters
    ----------
    setup : LegSetup
    statuses, forecasts : mapping of str to ReplayStatus
        Of ``/diagnostics`` and ``~/forecast``, by name.
    cycle : mapping
        Values of the last gait cycle by column and joint.
    """
    found = LiveJoints({}, {}, {})
    for joint in setup.joints:
        status = statuses.get(f"joint {joint}")
        counted_m = status.values.get("clearance_m") if status else None
        if status is None or counted_m is None:
            continue
        told = forecasts.get(f"forecast {joint}")
        found.reports[joint] = _report(status, told, cycle, joint)
        found.clearances[joint] = _clearance(setup, joint, status, counted_m, statuses)
        found.life[joint] = life_hours(hours_of(status))
    return found


def _report(
    status: ReplayStatus,
    told: ReplayStatus | None,
    cycle: Mapping[str, Mapping[str, float | None]],
    joint: str,
) -> ReplayJoint:
    values = status.values
    last_peak_n = cycle.get("peak_force_n", {}).get(joint)
    return ReplayJoint(
        opened_m=None,
        growth_m_per_cycle=values.get("growth_m_per_cycle"),
        growth_mps=values.get("growth_mps"),
        forecast=joint_forecast_of(told) if told else None,
        peak_force_n=values.get("peak_force_n") if last_peak_n is None else last_peak_n,
        mean_force_n=values.get("mean_force_n"),
        impacts=int(values.get("impacts") or 0.0),
        growth_error_m_per_cycle=None,
    )


def _clearance(
    setup: LegSetup, joint: str, status: ReplayStatus, counted_m: float, statuses: Statuses
) -> JointClearance:
    """What is counted, and what encoders or the drive torque show best."""
    seen = []
    for name, by, key in _SEEN_BY:
        values = statuses[name].values if name in statuses else {}
        clearance_m, sigma_m = values.get(key.format(joint)), values.get(f"{joint}_sigma_m")
        if clearance_m is not None and sigma_m is not None:
            seen.append((sigma_m, clearance_m, by))
    sigma_m, clearance_m, by = min(seen) if seen else (None, None, "")
    limit_m = status.values.get("clearance_limit_m")
    believed = (key.removeprefix(_BELIEVED_BY) for key in status.values if key.startswith(_BELIEVED_BY))
    return JointClearance(
        counted_m=counted_m,
        seen_m=clearance_m,
        seen_sigma_m=sigma_m,
        seen_by=(by,) if by else (),
        new_m=setup.new_m[joint],
        limit_m=setup.limits_m[joint] if limit_m is None else limit_m,
        measured_m=status.values.get("measured_clearance_m"),
        measured_sigma_m=status.values.get("measured_sigma_m"),
        believed_m=status.values.get("believed_m"),
        believed_sigma_m=status.values.get("believed_sigma_m"),
        believed_by=next(believed, None),
    )


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
    """A source that is told what a monitor publishes, from any thread.

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
        self._statuses: dict[str, ReplayStatus] = {}
        self._verdict: ReplayStatus | None = None
        self._leg_silent_s: float | None = None
        self._alarms: dict[str, ReplayStatus] = {}
        self._forecasts: dict[str, ReplayStatus] = {}
        self._cycle: dict[str, dict[str, float | None]] = {}
        self._trends = Trends()
        self._heard_s: float | None = None
        self._is_new = True
        self._drawn: tuple[float, str] = (-math.inf, "")

    # --- what the monitor says ---

    def take_setup(self, setup: LegSetup | None, why_not: str = "") -> None:
        """The leg's parameters, or why they are not known."""
        with self._lock:
            self._setup, self._why_unknown, self._is_new = setup, printable(why_not), True

    def take_diagnostics(self, stamp_ns: int, statuses: Iterable[ReplayStatus]) -> None:
        """A message of ``/diagnostics``; those of other nodes are left out."""
        own = own_statuses(self._node, statuses)
        if not own:
            return
        with self._lock:
            self._hear()
            self._take_current(own.pop("verdict", None))
            self._statuses = own
            self._trends.add(self._row(stamp_ns))

    def _take_current(self, verdict: ReplayStatus | None) -> None:
        """The verdict of this second: of one without data, what it was is in ``~/verdict``."""
        self._leg_silent_s = verdict.values.get(NO_DATA) if verdict else None
        if verdict and (self._leg_silent_s is None or self._verdict is None):
            self._verdict = verdict

    def take_verdict(self, statuses: Iterable[ReplayStatus]) -> None:
        """A message of ``~/verdict``; a joint that it names is drawn as it says, before its next report."""
        own = own_statuses(self._node, statuses)
        with self._lock:
            self._hear()
            self._verdict = own.get("verdict", self._verdict)

    def take_alarms(self, statuses: Iterable[ReplayStatus]) -> None:
        """A message of ``~/alarms``."""
        with self._lock:
            self._hear()
            self._alarms = own_statuses(self._node, statuses)

    def take_forecast(self, statuses: Iterable[ReplayStatus]) -> None:
        """A message of ``~/forecast``."""
        with self._lock:
            self._hear()
            self._forecasts = own_statuses(self._node, statuses)

    def take_cycle(self, columns: Mapping[str, Mapping[str, float]]) -> None:
        """A message of ``~/clearance_states``: values by column and joint."""
        with self._lock:
            self._hear()
            self._cycle = {name: _of_joints(values) for name, values in columns.items()}

    def _hear(self) -> None:
        self._heard_s, self._is_new = self._clock(), True

    def _row(self, stamp_ns: int) -> Row:
        leg: dict[str, float | None] = {}
        for status, columns in (("gait", _GAIT), ("torque", _TORQUE)):
            if status in self._statuses:
                values = self._statuses[status].values
                leg |= {column: values.get(name) for column, name in columns.items()}
        joints = joints_of(self._setup or unknown_leg(), self._statuses, {}, {}).clearances
        seen = {joint: each.seen_m for joint, each in joints.items()}
        return Row(stamp_ns, leg, self._cycle | {"seen_m": seen})

    # --- what the page shows ---

    def renew(self) -> bool:
        """Whether anything was heard since the last content."""
        return self._is_new

    def content(self) -> Content:
        """The page with all that was heard last."""
        with self._lock:
            view, why_unknown = self._view(), "" if self._setup else self._why_unknown
            self._is_new = False
        regions = {
            region.VERDICT: region.verdict_region(view),
            region.JOINTS: region.joints_region(view, why_unknown),
            region.ALARMS: region.alarms_region(view),
            region.BELIEF: region.belief_region(view),
            region.TRENDS: self._trends_region(view),
            region.STATUS: region.status_region(view),
        }
        return LegPage(fresh="Live, data ").content(regions, self._words(view), self.freshness())

    def freshness(self) -> Freshness:
        """Since when nothing was heard of the monitor; or, if it speaks, since when it has no data."""
        with self._lock:
            heard_s, leg_s = self._heard_s, self._leg_silent_s
        if heard_s is None:
            return Freshness(
                None,
                f"WAITING for the monitor {printable(self._node)}: no message yet on {self._waited_for}. "
                "Is it running, with this name and this ROS_DOMAIN_ID?",
                self._old_after_s,
            )
        age_s = self._clock() - heard_s
        silence = "nothing is heard of the monitor; is it running?"
        if leg_s is not None and age_s < self._old_after_s:
            age_s += leg_s
            silence = "the monitor runs, but receives nothing from the leg; see its status below"
        return Freshness(age_s, silence, self._old_after_s)

    def leg_page(self, name: str) -> None:
        """There is one leg."""

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
        setup = self._setup or unknown_leg()
        verdict = verdict_of(self._verdict) if self._verdict else NO_VERDICT
        gait = self._statuses.get("gait")
        joints = joints_of(setup, self._statuses, self._forecasts, self._cycle)
        leg = leg_life_of(self._forecasts["forecast leg"]) if "forecast leg" in self._forecasts else None
        cycles = int((gait.values.get("cycles") if gait else None) or 0.0)
        known = Known(
            verdict=verdict,
            history=self._trends.history(setup.joints),
            cycles=cycles,
            joints=joints.reports,
            clearances=joints.clearances,
            life=joints.life_with(leg),
            forecast=leg,
            alarms=[alarm_of(status) for status in self._alarms.values()],
            status=list(self._statuses.values()),
            missing="" if cycles else gait.message if gait else "nothing was heard",
        )
        return view_of(setup, known)


def _of_joints(values: Mapping[str, float]) -> dict[str, float | None]:
    """Values by joint, as far as they are numbers and not too many."""
    first = islice(values.items(), MOST)
    return {printable(joint): finite_or_none(value) for joint, value in first}

"""What a dashboard shows: where its content comes from, and how old it is."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from typing import Protocol

import attrs
import numpy as np

from leg_wear_monitor.dashboard.motion import MotionFeed
from leg_wear_monitor.errors import printable
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.monitor.alarm_specs import QUANTITIES
from leg_wear_monitor.monitor.alarms import ADVICE, amount
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.evaluation import AlarmBoard
from leg_wear_monitor.monitor.ledger.entry import Measurement, WalkedLoad
from leg_wear_monitor.monitor.ledger_state import NO_VERDICT
from leg_wear_monitor.monitor.reports import Lost
from leg_wear_monitor.monitor.verdict.verdict import guide_to
from leg_wear_monitor.playback.result import (
    ReplayGait,
    ReplayHistory,
    ReplayLeg,
    ReplayMonitor,
    ReplayRecording,
    ReplayStatus,
    ReplaySummary,
)
from leg_wear_monitor.playback.summary import leg_shape, settings_of
from leg_wear_monitor.report.page import (
    STATE_LOOKS,
    Banner,
    Page,
    Part,
    Table,
    Text,
    render,
    verdict_banner,
)
from leg_wear_monitor.report.replay.charts import health_chart, joint_trends
from leg_wear_monitor.report.replay.joints import joints_and_leg
from leg_wear_monitor.state import Evidence, LegState

# What is known of a leg at one instant, in the shape of a replay's summary: so the page has its words.


# nothing was recorded: times are times of the day, not those since a recording's begin
_NOT_RECORDED = ReplayRecording(
    files=(), topics={}, time="header", is_partial=False, findings=(), crank_samples=0, torque_samples=0,
    begin_ns=0, end_ns=0, duration_s=0.0,
)  # fmt: skip

_NOTHING_LOST = Lost(
    unmonitored_s=0.0, already_counted=0, faulty={}, conflicting=0, implausible=0, duplicates=0, late=0,
    stray_stamps=0, outliers=0, gaps_bridged=0, gaps_lost=0, backward_jumps=0, failures=0,
)  # fmt: skip


@attrs.frozen(eq=False)
class LegSetup:
    """The leg and the monitor's settings.

    Attributes
    ----------
    monitor : ReplayMonitor
    shape : ReplayLeg
    limits_m, new_m : dict of str to float
        Limit of each joint's mean clearance, and its clearance when new.
    mechanism : Mechanism or None
        None until the leg is known.
    report_s : float
        Time between two reports of the monitor on itself.
    """

    monitor: ReplayMonitor
    shape: ReplayLeg
    limits_m: dict[str, float]
    new_m: dict[str, float]
    mechanism: Mechanism | None = None
    report_s: float = 1.0

    @property
    def joints(self) -> tuple[str, ...]:
        """The clearance joints."""
        return self.monitor.clearance_joints


def leg_setup(config: MonitorConfig, mechanism: Mechanism) -> LegSetup:
    """The leg of a configuration, for a mechanism that `fitted` returned."""
    joints = mechanism.clearance_joints
    limits = AlarmBoard(config, joints).clearance_limits_m
    return LegSetup(
        monitor=settings_of(config, mechanism),
        shape=leg_shape(mechanism),
        limits_m=dict(zip(joints, limits, strict=True)),
        new_m={joint: float(mechanism.clearances[joint].radial_clearance) for joint in joints},
        mechanism=mechanism,
        report_s=config.diagnostics.period_s,
    )


def unknown_leg() -> LegSetup:
    """A leg without joints and shape, until its parameters are known."""
    default = MonitorConfig()
    monitor = ReplayMonitor(
        mechanism="",
        hardware_id="",
        clearance_joints=(),
        commanded_rpm=default.cadence.commanded_rpm,
        wear_acceleration=1.0,
        bushing_radius_m={},
        limits=default.limits,
        duty_hours_per_day=default.forecast.duty_hours_per_day,
    )
    return LegSetup(monitor, ReplayLeg(), {}, {})


NOTHING_KNOWN = LegState(verdict=NO_VERDICT, clearances={})


def view_of(
    setup: LegSetup,
    state: LegState,
    history: ReplayHistory,
    status: Sequence[ReplayStatus] = (),
    measurements: Sequence[Measurement] = (),
    walked: Sequence[WalkedLoad] = (),
    missing: str = "",
) -> ReplaySummary:
    """What is known of a leg, as a summary.

    Parameters
    ----------
    setup : LegSetup
    state : LegState
    history : ReplayHistory
    status, measurements, walked
        As in `ReplaySummary`.
    missing : str
        Why there is no gait cycle; empty if there is.
    """
    cycles = state.life_cycles
    return ReplaySummary(
        **attrs.asdict(state, recurse=False),
        recording=_NOT_RECORDED,
        monitor=setup.monitor,
        leg=setup.shape,
        cycles=cycles,
        gait=ReplayGait(believable_cycles=cycles, doubtful_cycles=0, missing=missing, is_counted=False),
        joints={},
        forecast=None,
        measurements=tuple(measurements),
        walked=tuple(walked),
        status=tuple(status),
        lost=_NOTHING_LOST,
        history=history,
        wear_depth_m={},
        advice=ADVICE,
    )


def over_time(view: ReplaySummary) -> ReplaySummary:
    """The same, its times since the first row of its history."""
    stamps = view.history.stamp_ns
    if not len(stamps):
        return view
    begin, end = int(stamps[0]), int(stamps[-1])
    times = attrs.evolve(_NOT_RECORDED, begin_ns=begin, end_ns=end, duration_s=1.0e-9 * (end - begin))
    return attrs.evolve(view, recording=times)


# Regions of the page: markup of what is known of a leg, each replaced by itself when it changes.


VERDICT, MOTION, JOINTS, ALARMS = "verdict", "motion", "joints", "alarms"
BELIEF, TRENDS, STATUS = "belief", "trends", "status"

TITLES = {
    JOINTS: "Joints",
    MOTION: "The leg now",
    ALARMS: "Alarms",
    BELIEF: "Are these values valid?",
    TRENDS: "Trends",
    STATUS: "Status of the monitor",
}
"""By region, in the order of the page; the verdict is above all."""

_MOST_EVIDENCE = 6


def verdict_region(view: ReplaySummary) -> str:
    """State, reason, action, evidence and what is not valid; its guide is one of the server's pages."""
    banner = verdict_banner(
        view, f"/{guide_to(view.verdict)}", "/docs/explanation/validity.md#how-sure-a-verdict-is"
    )
    return render("dashboard/banner.html", banner=with_evidence(banner, view.verdict.evidence))


def with_evidence(banner: Banner, evidence: Sequence[Evidence]) -> Banner:
    """A banner with the values that the verdict rests on, the first ones, below what to do."""
    known = [each for each in evidence if each.value is not None]
    if not known:
        return banner
    words = "; ".join(map(evidence_words, known[:_MOST_EVIDENCE]))
    more = len(known) - _MOST_EVIDENCE
    words += f"; {more} more" if more > 0 else ""
    first, *others = banner.notes
    return attrs.evolve(banner, notes=[first, ("Evidence", words), *others])


def evidence_words(evidence: Evidence) -> str:
    """A value and its limit, such as ``clearance G 0.62 mm (limit 0.6 mm)``; an alarm's, by its noun."""
    name = QUANTITIES.get(evidence.name) or evidence.name.replace("_", " ").removesuffix(f" {evidence.unit}")
    value = "unknown" if evidence.value is None else amount(evidence.value, evidence.unit)
    limit = "" if evidence.limit is None else f" (limit {amount(evidence.limit, evidence.unit)})"
    return f"{name} {value}{limit}"


def joints_region(view: ReplaySummary, instead: str = "") -> str:
    """The leg with its joints; a sentence instead of them, where they are not known."""
    if instead:
        return _parts([Text(instead, is_not_valid=True)])
    return joints_and_leg(view)


def status_region(view: ReplaySummary) -> str:
    """All statuses in words."""
    rows = [(status.name, status.level.name, status.message) for status in view.status]
    return _parts([Table(caption="Statuses", head=("", "level", "message"), rows=rows, is_text=True)])


def trends_region(view: ReplaySummary, caption: str) -> str:
    """Charts of the joint that the reader chooses, and folded those of input and torque."""
    timed = over_time(view)
    if len(timed.history.stamp_ns) < 2:
        return _parts([Text("There is nothing to draw yet.")])
    named = sorted(view.monitor.clearance_joints, key=lambda joint: joint not in view.verdict.joints)
    joints = [(joint, view.leg.joint_words(joint), joint_trends(timed, joint)) for joint in named]
    leg = [health_chart(timed)] if np.isfinite(timed.history.cadence_rpm).any() else []
    return render("dashboard/trends.html", caption=caption, joints=joints, leg=leg)


def _parts(parts: Sequence[Part]) -> str:
    return render("dashboard/parts.html", parts=parts)


SCRIPT = "dashboard/dashboard.js"


@attrs.frozen
class Words:
    """The page in a few words.

    Attributes
    ----------
    title : str
        Of the browser's tab.
    state : str
        Spoken when it changes.
    heading, summary : str
        At the head of the page.
    """

    title: str
    state: str
    heading: str
    summary: str


@attrs.frozen
class Freshness:
    """How old the data are.

    Attributes
    ----------
    age_s : float or None
        None before there are any.
    silence : str
        What it means that nothing new comes, and what to look at.
    old_after_s : float
        Age from which on the page says loudly that its data are old.
    """

    age_s: float | None
    silence: str
    old_after_s: float


def unreadable(fault: str, old_after_s: float) -> Freshness:
    """Freshness of what cannot be read any more, for a reason in words."""
    return Freshness(None, f"NOT READABLE: {printable(fault)}; what is shown is old", old_after_s)


@attrs.frozen(kw_only=True)
class Content:
    """What a page shows at one instant.

    Attributes
    ----------
    page : str
        Identity of the page around the regions: viewers load another one again.
    html : str
        The whole page.
    regions : mapping of str to str
        Markup by the name of its region.
    words : Words
    policy : str
        Content security policy of the page.
    """

    page: str
    html: str
    regions: Mapping[str, str]
    words: Words
    policy: str


class Source(Protocol):
    """Where the content comes from; its methods are called from one thread at a time."""

    def renew(self) -> bool:
        """Take in what is new, and return whether there is another content."""

    def content(self) -> Content:
        """The content as it was taken in last; LegWearError for one that cannot be shown."""

    def freshness(self) -> Freshness:
        """How old the data are now."""

    @property
    def motion(self) -> MotionFeed | None:
        """Frames of the moving leg; None where nothing moves."""


_STYLES = (
    "uplot/uPlot.min.css", "replay/replay.css", "dashboard/dashboard.css", "leg_slider.css",
    "torque_phase.css",
)  # fmt: skip
_LIBRARIES = (
    "uplot/uPlot.iife.min.js", "replay/charts.js", "leg_slider.js", "torque_phase.js", SCRIPT,
    "dashboard/motion.js", "dashboard/trends.js",
)  # fmt: skip


def leg_content(regions: Mapping[str, str], words: Words, freshness: Freshness, fresh: str) -> Content:
    """The page of one leg with its regions.

    Parameters
    ----------
    regions : mapping of str to str
        Markup by the name of its region.
    words : Words
    freshness : Freshness
    fresh : str
        Begin of the line that says how old the data are, such as ``Written ``.
    """
    page = Page(
        title=words.heading,
        summary=words.summary,
        sections=(),
        styles=_STYLES,
        libraries=_LIBRARIES,
        has_dark=True,
    )
    # the same for pages with the same scripts and styles
    identity = hashlib.sha256("\0".join((page.style, *page.scripts)).encode()).hexdigest()[:16]
    page = attrs.evolve(page, live=live_settings(identity, words, freshness, fresh))
    html = render("dashboard/page.html", page=page, regions=regions, titles=TITLES)
    return Content(page=identity, html=html, regions=regions, words=words, policy=page.policy)


def live_settings(page: str, words: Words, freshness: Freshness, fresh: str) -> str:
    """Settings of the page's script, as JSON."""
    settings = {"page": page, "fresh": fresh, **attrs.asdict(freshness), "words": attrs.asdict(words)}
    return json.dumps(settings, allow_nan=False)


def words_of(view: ReplaySummary, name: str, heading: str, summary: str) -> Words:
    """The verdict in a few words, and what stands at the head of its page."""
    verdict = view.verdict
    joints = ", ".join(map(view.leg.joint_words, verdict.joints))
    state = f"{verdict.state.words} joint {joints}" if joints else verdict.state.words
    title = f"{STATE_LOOKS[verdict.state][0]} {state} – {name}"
    return Words(title=title, state=f"{name}: {state}", heading=heading, summary=summary)

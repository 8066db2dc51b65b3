"""The page of a live leg: it shows the published state in the sections of a replay's page."""

import json
from collections.abc import Mapping, Sequence

import attrs

from leg_wear_monitor.errors import printable
from leg_wear_monitor.files import share_directory
from leg_wear_monitor.mechanism.loader import load_mechanism
from leg_wear_monitor.monitor.alarms import ADVICE
from leg_wear_monitor.monitor.config.fitting import fitted
from leg_wear_monitor.monitor.config.settings import MonitorConfig
from leg_wear_monitor.monitor.reports import Lost
from leg_wear_monitor.monitor.verdict.verdict import NO_GAIT_CYCLE, guide_to
from leg_wear_monitor.recordings.result import (
    ReplayGait,
    ReplayHistory,
    ReplayLeg,
    ReplayMonitor,
    ReplayRecording,
    ReplayStatus,
    ReplaySummary,
)
from leg_wear_monitor.recordings.summary import leg_shape, settings_of
from leg_wear_monitor.report.guide import enclosed
from leg_wear_monitor.report.page import (
    STATE_LOOKS,
    Fragment,
    Page,
    Part,
    Section,
    Table,
    Text,
    page_html,
    render,
    verdict_banner,
)
from leg_wear_monitor.report.replay.charts import joint_trends
from leg_wear_monitor.report.replay.joints import joints_and_leg
from leg_wear_monitor.report.replay.page import belief, raised_alarms
from leg_wear_monitor.state import LegState, State, Verdict

_STYLES = ("uplot/uPlot.min.css", "replay/replay.css", "guide.css", "dashboard/dashboard.css")
_LIBRARIES = (
    "uplot/uPlot.iife.min.js", "replay/charts.js", "dashboard/dashboard.js", "dashboard/trends.js",
)  # fmt: skip
_NO_VERDICT = Verdict(
    state=State.NOT_MONITORED,
    joints=(),
    why="there is no verdict yet",
    since_ns=0,
    do="let the leg walk with the monitor running",
    evidence=(),
    not_valid=(),
    fault_code=NO_GAIT_CYCLE,
)
NOTHING_KNOWN = LegState(verdict=_NO_VERDICT, clearances={})

# Nothing is recorded: the page shows times of the day, not times since the start of a recording.
_NOT_RECORDED = ReplayRecording(
    files=(), topics={}, time="header", is_partial=False, findings=(), crank_samples=0, torque_samples=0,
    begin_ns=0, end_ns=0, duration_s=0.0,
)  # fmt: skip
_NOTHING_LOST = Lost(
    unmonitored_s=0.0, already_counted=0, faulty={}, conflicting=0, implausible=0, torque_outliers=0,
    duplicates=0, late=0, stray_stamps=0, outliers=0, gaps_bridged=0, gaps_lost=0, backward_jumps=0,
    failures=0,
)  # fmt: skip


@attrs.frozen(eq=False)
class LegSetup:
    """The leg and the monitor's settings.

    Attributes
    ----------
    monitor : ReplayMonitor
    shape : ReplayLeg
    """

    monitor: ReplayMonitor
    shape: ReplayLeg


def leg_setup(config: MonitorConfig, source: str = "parameters") -> LegSetup:
    """The leg of a configuration; ``source`` is its origin, for messages."""
    mechanism = fitted(load_mechanism(config.mechanism), config, source)
    return LegSetup(settings_of(config, mechanism), leg_shape(mechanism))


def summary_of_now(
    setup: LegSetup, state: LegState, history: ReplayHistory, status: Sequence[ReplayStatus], missing: str
) -> ReplaySummary:
    """The state of a leg in the shape of a replay's summary, so that both pages share their sections.

    ``missing`` says why there is no gait cycle; it is empty if there is one.
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
        measurements=(),
        status=tuple(status),
        lost=_NOTHING_LOST,
        history=history,
        wear_depth_m={},
        advice=ADVICE,
    )


@attrs.frozen
class Freshness:
    """Age of the data.

    Attributes
    ----------
    age_s : float or None
        None before the first data.
    silence : str
        The likely reason if no new data arrive, and the place to look.
    old_after_s : float
        Data age above which the page shows a clear warning.
    """

    age_s: float | None
    silence: str
    old_after_s: float


@attrs.frozen
class Words:
    """The page in a few words.

    Attributes
    ----------
    title : str
        Title of the browser's tab.
    state : str
        Spoken when it changes.
    heading, summary : str
        Lines at the head of the page.
    """

    title: str
    state: str
    heading: str
    summary: str


@attrs.frozen(kw_only=True)
class Content:
    """The page at one instant.

    Attributes
    ----------
    html : str
        The whole page.
    regions : mapping of str to str
        Markup of each part that is renewed, by the id of its section.
    words : Words
    policy : str
        Content security policy of the page.
    """

    html: str
    regions: Mapping[str, str]
    words: Words
    policy: str


def leg_content(now: ReplaySummary, node: str, freshness: Freshness, instead: str, trends: str) -> Content:
    """The page of a leg.

    Parameters
    ----------
    now : ReplaySummary
        Summary returned by `summary_of_now`.
    node : str
        Full name of the monitor, printable.
    freshness : Freshness
    instead : str
        A sentence that the page shows instead of the joints; empty if the joints are known.
    trends : str
        Markup of the trends, as `trends_markup` returned it.
    """
    verdict = now.verdict
    title, guide = enclosed(share_directory() / guide_to(verdict))
    joints = Text(instead, is_not_valid=True) if instead else Fragment(joints_and_leg(now))
    rows = [(status.name, status.level.name, status.message) for status in now.status]
    sections = [
        Section("Joints", [joints]),
        Section("Alarms", [Fragment(raised_alarms(now, otherwise="No alarm is raised."))]),
        Section("Are these values valid?", [Fragment(belief(now))]),
        Section("Trends", [Fragment(trends)]),
        Section("Guide", [Text(title), Fragment(f'<div class="guide">{guide}</div>')], is_folded=True),
        Section(
            "Status of the monitor",
            [Table(caption="Statuses", head=("", "level", "message"), rows=rows, is_text=True)],
            is_folded=True,
        ),
    ]
    whose = ", ".join(map(now.leg.joint_words, verdict.joints))
    state = f"{verdict.state.words} joint {whose}" if whose else verdict.state.words
    words = Words(
        title=f"{STATE_LOOKS[verdict.state][0]} {state} – {node}",
        state=f"{node}: {state}",
        heading=f"Joint wear of {printable(now.monitor.hardware_id) or 'a leg'}",
        summary=", ".join(filter(None, [now.monitor.mechanism, f"live from {node}"])),
    )
    page = Page(
        title=words.heading,
        summary=words.summary,
        sections=sections,
        banner=verdict_banner(now, "#guide", ""),
        styles=_STYLES,
        libraries=_LIBRARIES,
        has_dark=True,
        live=json.dumps({**attrs.asdict(freshness), "words": attrs.asdict(words)}, allow_nan=False),
    )
    regions = {section.anchor: parts_markup(section.parts) for section in sections}
    regions["verdict"] = render("dashboard/verdict.html", banner=page.banner)
    return Content(html=page_html(page), regions=regions, words=words, policy=page.policy)


def trends_markup(now: ReplaySummary) -> str:
    """Charts of the clearance of the joint that the reader chooses."""
    stamps = now.history.stamp_ns
    if len(stamps) < 2:
        return parts_markup([Text("There is nothing to draw yet.")])
    begin, end = int(stamps[0]), int(stamps[-1])
    times = attrs.evolve(_NOT_RECORDED, begin_ns=begin, end_ns=end, duration_s=1.0e-9 * (end - begin))
    timed = attrs.evolve(now, recording=times)
    named = sorted(now.monitor.clearance_joints, key=lambda joint: joint not in now.verdict.joints)
    joints = [(joint, now.leg.joint_words(joint), joint_trends(timed, joint)) for joint in named]
    return render("dashboard/trends.html", joints=joints)


def parts_markup(parts: Sequence[Part]) -> str:
    """Markup of the parts of a section."""
    return render("dashboard/parts.html", parts=parts)

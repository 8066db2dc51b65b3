"""Charts of a replay over time: clearances, forces, input, alarms."""

import math
from collections.abc import Iterable, Sequence

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.materials import BushingLoad
from leg_wear_monitor.playback.result import EncoderEvidence, ReplayHistory, ReplaySummary
from leg_wear_monitor.report.figure import opened, time_of
from leg_wear_monitor.report.page import (
    NOT_VALID,
    Chart,
    Panel,
    Part,
    Section,
    Series,
    Table,
    Text,
    not_valid,
    value,
)
from leg_wear_monitor.report.replay.joint_rows import counted_mm
from leg_wear_monitor.state import AlarmChange, Figure

SERIES_COLOURS = 7  # of the style sheet
_GROUP = "time"
_STEADY = 0.1  # of the commanded cadence to either side, less does not fill the picture
_NEAR = 3.0  # a limit beyond so many times the largest value would only flatten the curve


def openings_chart(summary: ReplaySummary) -> Chart:
    """How much each clearance has opened since the first gait cycle."""
    columns, unit = opened(summary)
    series = [
        Series(name=f"opened by {joint}", unit=unit, values=values, colour=_colour(k))
        for k, (joint, values) in enumerate(columns.items())
    ]
    return Chart(
        name="clearances",
        alt="Opening of each joint's clearance over time",
        caption="Mean radial clearance of each joint, minus its value after the first gait cycle.",
        x=time_series(summary),
        ends=ends_of(summary),
        panels=[Panel(title="Opening of the clearances", series=series, height=260)],
        group=_GROUP,
    )


def has_estimates(summary: ReplaySummary) -> bool:
    """Whether encoders or the drive torque have shown a clearance at any time."""
    return any(np.isfinite(values).any() for values in summary.history.seen_m.values())


def estimates_chart(summary: ReplaySummary) -> Chart:
    """Clearances that encoders or the drive torque show, with their limit."""
    limits = [each.limit_m for each in summary.clearances.values()]
    series = [
        Series(name=f"clearance {joint}", unit="mm", values=1.0e3 * values, colour=_colour(k))
        for k, (joint, values) in enumerate(summary.history.seen_m.items())
    ]
    if limits:
        series.append(_limit("limit", "mm", 1.0e3 * min(limits), series[0].values))
    return Chart(
        name="estimates",
        alt="Clearances that encoders or the drive torque show, over time",
        caption="Mean radial clearance of each joint as encoders or the drive torque show it, whatever is "
        "counted; nothing is drawn while they show none.",
        x=time_series(summary),
        ends=ends_of(summary),
        panels=[Panel(title="Clearances by estimate", series=series, low=0.0, height=260)],
        group=_GROUP,
    )


def force_chart(summary: ReplaySummary) -> Chart:
    """Peak and mean contact force of each joint in each gait cycle, a panel a joint, all on the same axis."""
    history, limits = summary.history, summary.monitor.limits
    own = limits.joint_impact_force_n
    greatest = max((_greatest(values) for values in history.peak_force_n.values()), default=0.0)
    panels = []
    for k, (joint, peak) in enumerate(history.peak_force_n.items()):
        mean, limit = history.mean_force_n[joint], own[k] if own else limits.impact_force_n
        series = [
            Series(name=f"peak force {joint}", unit="N", values=peak),
            Series(name=f"mean force {joint}", unit="N", values=mean, colour="--ink"),
        ]
        if limit < _NEAR * greatest:
            series.append(_limit(f"limit {joint}", "N", limit, peak))
        panels.append(Panel(title=summary.leg.joint_words(joint), series=series, height=150))
    high = 1.05 * max([greatest, *(_greatest(each.values) for panel in panels for each in panel.series)])
    return Chart(
        name="forces",
        alt="Peak and mean contact force of each joint over time",
        caption="Contact force in each gait cycle, on the same axis for all joints. Peaks are of a heavy "
        "tail; their scatter does not mean that the joint changes.",
        x=time_series(summary),
        ends=ends_of(summary),
        panels=[Panel(title=each.title, series=each.series, low=0.0, high=high or 1.0, height=each.height)
                for each in panels],
        group=_GROUP,
    )  # fmt: skip


def health_chart(summary: ReplaySummary) -> Chart:
    """Cadence, the torque and its mismatch, and the load and friction that explain the rest."""
    history, limit = summary.history, summary.monitor.limits.torque_mismatch
    cadence, mismatch = history.cadence_rpm, history.torque_mismatch
    rpm = summary.monitor.commanded_rpm
    commanded, steady = np.full_like(cadence, rpm), _STEADY * abs(rpm)
    panels = [
        Panel(
            title="Cadence",
            series=[
                Series(name="cadence", unit="rpm", values=cadence),
                Series(name="commanded", unit="rpm", values=commanded, colour="--ink", style="dashed"),
            ],
            low=min(_least(cadence), rpm - steady),
            high=max(_greatest(cadence, rpm), rpm + steady),
        ),
        Panel(
            title="Drive torque, RMS of each gait cycle",
            series=[
                Series(name="measured", unit="N m", values=history.measured_torque_rms_nm),
                Series(
                    name="predicted", unit="N m", values=history.predicted_torque_rms_nm, colour=_colour(1)
                ),
            ],
            low=0.0,
        ),
        Panel(
            title="Fraction of the torque that is not explained",
            series=[Series(name="mismatch", unit="", values=mismatch), _limit("limit", "", limit, mismatch)],
            low=0.0,
            high=1.1 * max(_greatest(mismatch), limit),
        ),
        Panel(title="Load at the foot", series=[Series(name="load", unit="N", values=history.load_n)]),
        Panel(
            title="Friction of the drive",
            series=[Series(name="friction", unit="N m", values=history.friction_nm)],
        ),
    ]
    return Chart(
        name="input",
        alt="Cadence, drive torque, mismatch, load and friction over time",
        caption="Cadence with the commanded one dashed; measured and predicted drive torque; the fraction "
        "that load, friction and lag do not explain, with its limit dashed; load and friction as estimated.",
        x=time_series(summary),
        ends=ends_of(summary),
        panels=[_with_range(panel, history) for panel in panels if _is_known(panel)],
        group=_GROUP,
    )


_COLUMNS = {
    "cadence": "cadence_rpm",
    "measured": "measured_torque_rms_nm",
    "predicted": "predicted_torque_rms_nm",
    "mismatch": "torque_mismatch",
    "load": "load_n",
    "friction": "friction_nm",
}


def _is_known(panel: Panel) -> bool:
    return bool(np.isfinite(panel.series[0].values).any())


def _with_range(panel: Panel, history: ReplayHistory) -> Panel:
    """A panel with the smallest and the largest values, where its series are thinned."""
    added = [
        attrs.evolve(series, name=f"{series.name}, {words}", values=values[_COLUMNS[series.name]], width=0.7)
        for series in panel.series
        for words, values in (("lowest", history.lowest), ("highest", history.highest))
        if _COLUMNS.get(series.name) in values
    ]
    ends = [_least(each.values) for each in added], [_greatest(each.values) for each in added]
    low = None if panel.low is None else min([panel.low, *ends[0]])
    high = None if panel.high is None else max([panel.high, *ends[1]])
    return attrs.evolve(panel, series=[*panel.series, *added], low=low, high=high)


def alarm_chart(summary: ReplaySummary, changes: Sequence[AlarmChange]) -> Chart:
    """Level of each alarm that was ever raised; the first of a change holds until the next one."""
    begin, end = summary.recording.begin_ns, summary.recording.end_ns
    stamps = sorted({begin, end, *(change.stamp_ns for change in changes)})
    names = dict.fromkeys(change.alarm.name for change in changes)
    time, unit = time_of(summary, np.array(stamps, np.int64))
    series = [
        Series(name=name, unit="", values=_levels(stamps, changes, name), colour="--careful", style="steps")
        for name in names
    ]
    return Chart(
        name="alarms",
        alt="Levels of alarms over time",
        caption="Level of each alarm over time: 0 is OK, 1 WARN, 2 ERROR.",
        x=Series(name="time", unit=unit, values=time),
        ends=ends_of(summary),
        panels=[
            Panel(title="Alarms", series=series, height=80 + 34 * len(series), lanes=("OK", "WARN", "ERROR"))
        ],
        group=_GROUP,
    )


def _levels(stamps: Iterable[int], changes: Sequence[AlarmChange], name: str) -> Floats:
    own = {change.stamp_ns: float(change.alarm.level) for change in changes if change.alarm.name == name}
    level, levels = 0.0, []
    for stamp in stamps:
        level = own.get(stamp, level)
        levels.append(level)
    return np.array(levels)


def time_series(summary: ReplaySummary) -> Series:
    """The x axis of all charts over time."""
    time, unit = time_of(summary, summary.history.stamp_ns)
    return Series(name="time", unit=unit, values=time)


def ends_of(summary: ReplaySummary) -> tuple[float, float]:
    """Those of the recording, for all charts over time."""
    stamps = np.array([summary.recording.begin_ns, summary.recording.end_ns], np.int64)
    begin, end = time_of(summary, stamps)[0].tolist()
    return begin, max(end, begin + 1.0e-9)


def _limit(name: str, unit: str, limit: float, beside: Floats) -> Series:
    return Series(name=name, unit=unit, values=np.full(len(beside), limit), colour="--bad", style="dashed")


def _colour(k: int) -> str:
    return f"--series-{k % SERIES_COLOURS}"


def _greatest(values: Floats, otherwise: float = 0.0) -> float:
    known = values[np.isfinite(values)]
    return float(known.max()) if len(known) else otherwise


def _least(values: Floats) -> float:
    return -_greatest(-values, -math.inf)


# Clearances over time and at the end, as counted and as further encoders show them.


_TITLE = "Clearance over time"


def clearance_section(summary: ReplaySummary) -> Section:
    """Clearances by estimate, and the counted ones where they are valid."""
    doubt = not_valid(summary.verdict, Figure.CLEARANCES)
    seen = [estimates_chart(summary)] if has_estimates(summary) else []
    if doubt:
        text = Text(f"Counted clearances: {doubt}.", is_not_valid=True)
        return Section(_TITLE, [*seen, text], is_folded=True)
    return Section(_TITLE, [openings_chart(summary), *seen, _table(summary)], is_folded=True)


def _table(summary: ReplaySummary) -> Table:
    has_growth = Figure.GROWTH not in summary.verdict.not_valid
    is_sampled = any(joint.sampling_sigma_m for joint in summary.joints.values())
    rows = []
    for name, joint in summary.joints.items():
        growth = (
            value(1.0e12, joint.growth_m_per_cycle),
            value(1.0e12, joint.growth_error_m_per_cycle),
        )
        rows.append(
            (
                summary.leg.joint_words(name),
                counted_mm(summary, name),
                value(1.0e9, joint.opened_m),
                *((value(1.0e9, joint.sampling_sigma_m),) if is_sampled else ()),
                *(growth if has_growth else (NOT_VALID, NOT_VALID)),
            )
        )
    return Table(
        caption="Clearances at the end",
        head=(
            *("joint", "counted clearance [mm]", "opened [nm]"),
            *(("standard error of sampling [nm]",) if is_sampled else ()),
            *("growth [pm/cycle]", "± [pm/cycle]"),
        ),
        rows=rows,
        note="Counted: the clearance when new plus the wear counted by the model since, in its "
        "significant digits. ± is one standard deviation of the growth: gait cycles of a chaotic "
        "motion scatter, and the leg may be built with other masses than its file has.",
    )


def clearance_sentences(summary: ReplaySummary) -> list[str]:
    """Joints that surely are not as counted, a sentence each."""
    sentences = []
    for name, joint in summary.joints.items():
        off = joint.encoders.departure_m if joint.encoders and joint.encoders.is_other else None
        if off is not None:
            sentences.append(
                f"Encoders show that {summary.leg.joint_words(name)} is {1.0e6 * abs(off):.0f} µm "
                f"{'wider' if off > 0.0 else 'narrower'} than counted."
            )
    return sentences


def encoder_sections(summary: ReplaySummary) -> list[Section]:
    """Clearances as further encoders show them, if there are such."""
    is_counted_leg = Figure.CLEARANCES not in summary.verdict.not_valid
    rows = [
        (
            summary.leg.joint_words(name),
            _millimetres(summary.clearances[name].counted_m) if is_counted_leg else NOT_VALID,
            _millimetres(_estimated(summary.clearances[name].counted_m, joint.encoders)),
            _millimetres(joint.encoders.sigma_m),
            "other than counted" if joint.encoders.is_other else joint.encoders.observation.value,
        )
        for name, joint in summary.joints.items()
        if joint.encoders
    ]
    if not rows:
        return []
    title = "Clearances estimated from encoders"
    table = Table(
        caption=title,
        head=("joint", "counted [mm]", "estimated [mm]", "± [mm]", ""),
        rows=rows,
        note="Counted: by the law of wear with the nominal coefficient. Estimated: from the angles of "
        "further encoders over the last gait cycles; the standard deviation includes the model error.",
    )
    return [Section(title, [table], is_folded=True)]


def _estimated(counted_m: float, shown: EncoderEvidence) -> float | None:
    return None if shown.departure_m is None else counted_m + shown.departure_m


def _millimetres(metres: float | None) -> str:
    return "-" if metres is None else f"{1.0e3 * metres:.4f}"


# Contact forces of each joint over time.


def force_section(summary: ReplaySummary) -> Section:
    """Chart and table."""
    doubt = not_valid(summary.verdict, Figure.IMPACT_FORCES)
    if doubt:
        return Section("Impact forces", [Text(doubt, is_not_valid=True)], is_folded=True)
    rows = [
        (
            summary.leg.joint_words(name),
            value(1.0, joint.peak_force_n),
            value(1.0, joint.mean_force_n),
            str(joint.impacts),
        )
        for name, joint in summary.joints.items()
    ]
    table = Table(caption="Contact forces", head=("joint", "peak [N]", "mean [N]", "impacts"), rows=rows)
    return Section("Impact forces", [force_chart(summary), table, *_loads(summary)], is_folded=True)


def _loads(summary: ReplaySummary) -> list[Part]:
    """Pressure, sliding speed and p v of each joint in the last gait cycle, against its material's limits."""
    loads = {summary.leg.joint_words(name): joint.load for name, joint in summary.joints.items()}
    rows = [(name, *_load_cells(load)) for name, load in loads.items() if load is not None]
    if not rows:
        return []
    table = Table(
        caption="Pressure and sliding speed in the last gait cycle, and the limits of the materials",
        head=("joint", "p mean [MPa]", "p p99 [MPa]", "limit", "v [m/s]", "limit", "p v [MPa m/s]", "limit"),
        rows=rows,
        note="p: force over diameter times width. v: mean sliding speed under load. A dash: the material has "
        "no such limit. Beyond a limit, the wear coefficient does not hold.",
    )
    told = [f"{name}: {load.outside_limits}." for name, load in loads.items() if load and load.outside_limits]
    return [table, *(Text(text, is_not_valid=True) for text in told)]


def _load_cells(load: BushingLoad) -> tuple[str, ...]:
    return (
        value(1.0e-6, load.mean_pressure_pa),
        value(1.0e-6, load.p99_pressure_pa),
        value(1.0e-6, load.pressure_limit_pa),
        value(1.0, load.mean_sliding_speed_mps),
        value(1.0, load.sliding_speed_limit_mps),
        value(1.0e-6, load.mean_pressure_speed_pa_mps),
        value(1.0e-6, load.pressure_speed_limit_pa_mps),
    )

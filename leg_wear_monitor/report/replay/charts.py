"""Charts of a replay over time: clearances, forces, input, alarms, a single joint."""

from collections.abc import Iterable, Sequence

import attrs
import numpy as np

from leg_wear_monitor.estimate.cause import SURE_SIGMAS
from leg_wear_monitor.mechanism.arrays import Floats, Ints
from leg_wear_monitor.mechanism.materials import BushingLoad
from leg_wear_monitor.playback.result import ReplaySummary
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
from leg_wear_monitor.report.replay.joints import counted_mm
from leg_wear_monitor.state import AlarmChange, Figure

_COLOURS = 7  # of the style sheet, templates/replay/replay.css
_MOST_CHANGES = 1000  # of alarms that are drawn
_STEADY = 0.1  # of the commanded cadence to either side, less does not fill the picture
_NEAR = 3.0  # a limit beyond so many times the largest value would only flatten the curve


def _over_time(
    summary: ReplaySummary,
    name: str,
    words: str,
    caption: str,
    panels: Sequence[Panel],
    stamps_ns: Ints | None = None,
) -> Chart:
    """A chart from begin to end of the recording; over the gait cycles if no other stamps are given."""
    time, unit = time_of(summary, summary.history.stamp_ns if stamps_ns is None else stamps_ns)
    ends = np.array([summary.recording.begin_ns, summary.recording.end_ns], np.int64)
    begin, end = time_of(summary, ends)[0].tolist()
    return Chart(
        name=name,
        alt=f"{words} over time",
        caption=caption,
        x=Series("time", unit, time),
        ends=(begin, max(end, begin + 1.0e-9)),
        panels=panels,
        group="time",
    )


def _openings_chart(summary: ReplaySummary) -> Chart:
    """How much each clearance has opened since the first gait cycle."""
    columns, unit = opened(summary)
    series = [
        Series(f"opened by {joint}", unit, values, _colour(k))
        for k, (joint, values) in enumerate(columns.items())
    ]
    caption = "Mean radial clearance of each joint, minus its value after the first gait cycle."
    panels = [Panel("Opening of the clearances", series, height=260)]
    return _over_time(summary, "clearances", "Opening of each joint's clearance", caption, panels)


def _estimates_chart(summary: ReplaySummary) -> Chart:
    """Clearances that encoders or the drive torque show, with their limit."""
    seen_m = summary.history.seen_m
    series = [
        Series(f"clearance {joint}", "mm", 1.0e3 * values, _colour(k))
        for k, (joint, values) in enumerate(seen_m.items())
    ]
    limits = {joint: 1.0e3 * each.limit_m for joint, each in summary.clearances.items() if joint in seen_m}
    is_common = len(set(limits.values())) == 1
    for joint, limit in list(limits.items())[: 1 if is_common else None]:
        series.append(_limit("limit" if is_common else f"limit {joint}", "mm", limit, series[0].values))
    caption = (
        "Mean radial clearance of each joint as encoders or the drive torque show it, whatever is "
        "counted; nothing is drawn while they show none."
    )
    panels = [Panel("Clearances by estimate", series, low=0.0, height=260)]
    words = "Clearances that encoders or the drive torque show,"
    return _over_time(summary, "estimates", words, caption, panels)


def _force_chart(summary: ReplaySummary) -> Chart:
    """Peak and mean contact force of each joint in each gait cycle, a panel a joint, all on the same axis."""
    history, limits = summary.history, summary.monitor.limits
    own = limits.joint_impact_force_n or [limits.impact_force_n] * len(history.peak_force_n)
    greatest = _greatest(*history.peak_force_n.values())
    shown = [limit for limit in own if limit < _NEAR * greatest]
    panels = []
    for limit, (joint, peak) in zip(own, history.peak_force_n.items(), strict=False):
        series = [
            Series(f"peak force {joint}", "N", peak),
            Series(f"mean force {joint}", "N", history.mean_force_n[joint], "--ink"),
        ]
        if limit in shown:
            series.append(_limit(f"limit {joint}", "N", limit, peak))
        title, high = summary.leg.joint_words(joint), 1.05 * max([greatest, *shown])
        panels.append(Panel(title, series, low=0.0, high=high or 1.0, height=150))
    caption = (
        "Contact force in each gait cycle, on the same axis for all joints. Peaks are of a heavy "
        "tail; their scatter does not mean that the joint changes."
    )
    return _over_time(summary, "forces", "Peak and mean contact force of each joint", caption, panels)


def health_chart(summary: ReplaySummary) -> Chart:
    """Cadence, the torque and its mismatch, and the load and friction that explain the rest."""
    history, limit = summary.history, summary.monitor.limits.torque_mismatch
    rpm = summary.monitor.commanded_rpm
    steady = _STEADY * abs(rpm)

    def known(name: str, unit: str, column: str, colour: str = "--series-0") -> list[Series]:
        """A series, with its smallest and largest values where it is thinned."""
        series = Series(name, unit, getattr(history, column), colour)
        ends = (("lowest", history.lowest), ("highest", history.highest))
        return [
            series,
            *(
                attrs.evolve(series, name=f"{name}, {words}", values=values[column], width=0.7)
                for words, values in ends
                if column in values
            ),
        ]

    cadence, mismatch = known("cadence", "rpm", "cadence_rpm"), known("mismatch", "", "torque_mismatch")
    mismatches = [each.values for each in mismatch]
    torque = known("measured", "N m", "measured_torque_rms_nm")
    torque += known("predicted", "N m", "predicted_torque_rms_nm", _colour(1))
    commanded = attrs.evolve(_limit("commanded", "rpm", rpm, history.cadence_rpm), colour="--ink")
    panels = [
        Panel(
            "Cadence",
            [*cadence, commanded],
            low=min(rpm - steady, -_greatest(*(-each.values for each in cadence), otherwise=-rpm)),
            high=max(rpm + steady, _greatest(*(each.values for each in cadence), otherwise=rpm)),
        ),
        Panel("Drive torque, RMS of each gait cycle", torque, low=0.0),
        Panel(
            "Fraction of the torque that is not explained",
            [*mismatch, _limit("limit", "", limit, history.torque_mismatch)],
            low=0.0,
            high=max(1.1 * max(limit, _greatest(history.torque_mismatch)), _greatest(*mismatches)),
        ),
        Panel("Load at the foot", known("load", "N", "load_n")),
        Panel("Friction of the drive", known("friction", "N m", "friction_nm")),
    ]
    caption = (
        "Cadence with the commanded one dashed; measured and predicted drive torque; the fraction "
        "that load, friction and lag do not explain, with its limit dashed; load and friction as estimated."
    )
    words = "Cadence, drive torque, mismatch, load and friction"
    shown = [panel for panel in panels if _is_known(panel.series[0].values)]
    return _over_time(summary, "input", words, caption, shown)


def alarm_chart(summary: ReplaySummary, changes: Sequence[AlarmChange]) -> Chart:
    """Level of each alarm that was ever raised: OK at first, and each change holds until the next one."""
    begin, end, left = summary.recording.begin_ns, summary.recording.end_ns, len(changes) - _MOST_CHANGES
    if left > 0:
        changes, end = changes[:_MOST_CHANGES], changes[_MOST_CHANGES].stamp_ns
    stamps = sorted({begin, end, *(change.stamp_ns for change in changes)})
    names = dict.fromkeys(change.alarm.name for change in changes)
    series = [Series(name, "", _levels(stamps, changes, name), "--careful", "steps") for name in names]
    height, lanes = 80 + 34 * len(series), ("OK", "WARN", "ERROR")
    panels = [Panel("Alarms", series, height=height, lanes=lanes)]
    cut = f" The first {_MOST_CHANGES} changes; {left} later ones are not drawn." if left > 0 else ""
    caption = f"Level of each alarm over time: 0 is OK, 1 WARN, 2 ERROR.{cut}"
    return _over_time(summary, "alarms", "Levels of alarms", caption, panels, np.array(stamps, np.int64))


def _levels(stamps: Iterable[int], changes: Sequence[AlarmChange], name: str) -> Floats:
    own = {change.stamp_ns: float(change.alarm.level) for change in changes if change.alarm.name == name}
    level, levels = 0.0, []
    for stamp in stamps:
        level = own.get(stamp, level)
        levels.append(level)
    return np.array(levels)


def _limit(name: str, unit: str, limit: float, beside: Floats | Ints) -> Series:
    return Series(name, unit, np.full(len(beside), limit), "--bad", "dashed")


def _colour(k: int) -> str:
    return f"--series-{k % _COLOURS}"


def _is_known(values: Floats) -> bool:
    return bool(np.isfinite(values).any())


def _greatest(*columns: Floats, otherwise: float = 0.0) -> float:
    """The largest value that is known."""
    return max((float(values[np.isfinite(values)].max()) for values in columns if _is_known(values)),
               default=otherwise)  # fmt: skip


# A joint over time: its clearance as counted and as estimated, with an interval, and its contact forces.


def joint_trends(summary: ReplaySummary, joint: str) -> list[Part]:
    """Chart of what is known of a joint over time, and why something is not shown; empty if nothing is."""
    panels: list[Panel] = []
    doubts: list[Part] = []
    for name, figure, panel in (
        ("Counted clearance", Figure.CLEARANCES, _clearance_panel(summary, joint)),
        ("Contact forces", Figure.IMPACT_FORCES, _force_panel(summary, joint)),
    ):
        if doubt := not_valid(summary.verdict, figure):
            doubts.append(Text(f"{name}: {doubt}", is_not_valid=True))
        if panel.series:
            panels.append(panel)
    if not panels:
        return doubts
    caption = (
        "Mean radial clearance; the band is the estimate by encoders or the drive torque ± two "
        "standard deviations. Contact force in each gait cycle: peaks are of a heavy tail."
    )
    words = f"Joint {summary.leg.joint_words(joint)}"
    return [_over_time(summary, f"joint_{joint}", words, caption, panels), *doubts]


def _clearance_panel(summary: ReplaySummary, joint: str) -> Panel:
    history, known = summary.history, summary.clearances.get(joint)
    series: list[Series] = []
    seen_mm = 1.0e3 * history.seen_m.get(joint, np.array([]))
    if _is_known(seen_mm):
        reach = SURE_SIGMAS * 1.0e3 * history.seen_sigma_m.get(joint, np.full_like(seen_mm, np.nan))
        high, low = seen_mm + reach, np.maximum(seen_mm - reach, 0.0)
        series += [
            Series("estimate, high", "mm", high, style="edge"),
            Series("estimate, low", "mm", low, style="edge"),
            Series("estimate", "mm", seen_mm, width=2.0),
        ]
    bands = [(0, 1)] if series else []
    counted_m = history.counted_m.get(joint, np.array([]))
    if _is_known(counted_m) and Figure.CLEARANCES not in summary.verdict.not_valid:
        series.append(Series("counted", "mm", 1.0e3 * counted_m, "--ink"))
    if series and known:
        series.append(_limit("limit", "mm", 1.0e3 * known.limit_m, history.stamp_ns))
    title = f"Clearance of joint {summary.leg.joint_words(joint)}"
    return Panel(title, series, low=0.0, height=230, bands=bands)


def _force_panel(summary: ReplaySummary, joint: str) -> Panel:
    forces = (
        ("peak force", "--series-1", summary.history.peak_force_n),
        ("mean force", "--ink", summary.history.mean_force_n),
    )
    series = [
        Series(name, "N", columns[joint], colour)
        for name, colour, columns in forces
        if joint in columns and _is_known(columns[joint])
    ]
    is_valid = Figure.IMPACT_FORCES not in summary.verdict.not_valid
    return Panel("Contact force", series if is_valid else [], low=0.0, height=150)


# Clearances over time and at the end, as counted and as further encoders show them.


_TITLE = "Clearance over time"


def clearance_section(summary: ReplaySummary) -> Section:
    """Clearances by estimate, and the counted ones where they are valid."""
    doubt = not_valid(summary.verdict, Figure.CLEARANCES)
    is_seen = any(map(_is_known, summary.history.seen_m.values()))
    seen = [_estimates_chart(summary)] if is_seen else []
    if doubt:
        text = Text(f"Counted clearances: {doubt}.", is_not_valid=True)
        return Section(_TITLE, [*seen, text], is_folded=True)
    return Section(_TITLE, [_openings_chart(summary), *seen, _table(summary)], is_folded=True)


def _table(summary: ReplaySummary) -> Table:
    has_growth = Figure.GROWTH not in summary.verdict.not_valid
    head = ["joint", "counted clearance [mm]", "opened [nm]"]
    rows = []
    for name, joint in summary.joints.items():
        row = [summary.leg.joint_words(name), counted_mm(summary, name), value(1.0e9, joint.opened_m)]
        for growth in (joint.growth_m_per_cycle, joint.growth_error_m_per_cycle):
            row.append(value(1.0e12, growth) if has_growth else NOT_VALID)
        rows.append(tuple(row))
    return Table(
        caption="Clearances at the end",
        head=[*head, "growth [pm/cycle]", "± [pm/cycle]"],
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
    rows = []
    for name, joint in summary.joints.items():
        if shown := joint.encoders:
            counted_m = summary.clearances[name].counted_m
            estimated = None if shown.departure_m is None else counted_m + shown.departure_m
            rows.append((
                summary.leg.joint_words(name),
                _millimetres(counted_m) if is_counted_leg else NOT_VALID,
                _millimetres(estimated),
                _millimetres(shown.sigma_m),
                "other than counted" if shown.is_other else shown.observation.value,
            ))  # fmt: skip
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
    return Section("Impact forces", [_force_chart(summary), table, *_loads(summary)], is_folded=True)


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
    texts = (f"{name}: {one.outside_limits}." for name, one in loads.items() if one and one.outside_limits)
    return [table, *(Text(text, is_not_valid=True) for text in texts)]


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

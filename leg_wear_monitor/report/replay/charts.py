"""Charts over time: clearance and contact force of each joint, and the input."""

from collections.abc import Sequence

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats, Ints
from leg_wear_monitor.recordings.result import ReplaySummary
from leg_wear_monitor.report.figure import time_of
from leg_wear_monitor.report.page import (
    Chart,
    Panel,
    Part,
    Section,
    Series,
    Text,
    not_valid,
)
from leg_wear_monitor.report.replay.joints import SIGMAS
from leg_wear_monitor.state import Figure

_STEADY = 0.1  # fraction of the commanded cadence: small changes must not fill the picture
_NEAR = 3.0  # a limit above this multiple of the largest value would only flatten the curve


def _over_time(
    summary: ReplaySummary,
    name: str,
    words: str,
    caption: str,
    panels: Sequence[Panel],
) -> Chart:
    """A chart over the gait cycles, from start to end of the recording."""
    time, unit = time_of(summary, summary.history.stamp_ns)
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


def health_chart(summary: ReplaySummary) -> Chart:
    """Cadence, the torque and its mismatch, and the load and friction that explain the rest."""
    history, limit = summary.history, summary.monitor.limits.torque_mismatch
    rpm = summary.monitor.commanded_rpm
    steady = _STEADY * abs(rpm)

    def known(name: str, unit: str, column: str, colour: str = "--series-0") -> list[Series]:
        """A series; if it is thinned, with its smallest and largest values."""
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
    torque += known("predicted", "N m", "predicted_torque_rms_nm", "--series-1")
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
            "Unexplained fraction of the torque",
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


def _limit(name: str, unit: str, limit: float, beside: Floats | Ints) -> Series:
    return Series(name, unit, np.full(len(beside), limit), "--bad", "dashed")


def _is_known(values: Floats) -> bool:
    return bool(np.isfinite(values).any())


def _greatest(*columns: Floats, otherwise: float = 0.0) -> float:
    """The largest value that is known."""
    return max((float(values[np.isfinite(values)].max()) for values in columns if _is_known(values)),
               default=otherwise)  # fmt: skip


# A joint over time: its modelled and its estimated clearance, with an interval, and its contact forces.


def joint_trends(summary: ReplaySummary, joint: str) -> list[Part]:
    """Chart of a joint over time, with the reason for omitted values; empty without data."""
    panels: list[Panel] = []
    doubts: list[Part] = []
    for name, figure, panel in (
        ("Modelled clearance", Figure.CLEARANCES, _clearance_panel(summary, joint)),
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
        "standard deviations. Contact force in each gait cycle: single peaks are random."
    )
    words = f"Joint {summary.leg.joint_words(joint)}"
    return [_over_time(summary, f"joint_{joint}", words, caption, panels), *doubts]


def _clearance_panel(summary: ReplaySummary, joint: str) -> Panel:
    history, known = summary.history, summary.clearances.get(joint)
    series: list[Series] = []
    seen_mm = 1.0e3 * history.estimated_m.get(joint, np.array([]))
    if _is_known(seen_mm):
        reach = SIGMAS * 1.0e3 * history.estimated_sigma_m.get(joint, np.full_like(seen_mm, np.nan))
        high, low = seen_mm + reach, np.maximum(seen_mm - reach, 0.0)
        series += [
            Series("estimate, high", "mm", high, style="edge"),
            Series("estimate, low", "mm", low, style="edge"),
            Series("estimate", "mm", seen_mm, width=2.0),
        ]
    bands = [(0, 1)] if series else []
    modelled_m = history.modelled_m.get(joint, np.array([]))
    if _is_known(modelled_m) and Figure.CLEARANCES not in summary.verdict.not_valid:
        series.append(Series("modelled", "mm", 1.0e3 * modelled_m, "--ink"))
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
    limit = summary.monitor.limits.impact_force_n
    if any(np.nanmax(one.values) > limit / _NEAR for one in series):
        series.append(_limit("limit", "N", limit, summary.history.stamp_ns))
    is_valid = Figure.IMPACT_FORCES not in summary.verdict.not_valid
    return Panel("Contact force", series if is_valid else [], low=0.0, height=150)


# The clearance joints over time.


def joint_section(summary: ReplaySummary) -> Section:
    """A chart per joint, and the joints beyond the limits of their materials."""
    parts = [part for joint in summary.joints for part in joint_trends(summary, joint)]
    if Figure.IMPACT_FORCES not in summary.verdict.not_valid:
        loads = {summary.leg.joint_words(name): joint.load for name, joint in summary.joints.items()}
        beyond = {name: load.outside_limits for name, load in loads.items() if load and load.outside_limits}
        parts += [Text(f"{name}: {words}.", is_not_valid=True) for name, words in beyond.items()]
    return Section("Joints over time", parts, is_folded=True)

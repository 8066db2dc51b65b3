"""A joint over time: its clearance as counted and as estimated, with an interval, and its contact forces."""

import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.verdict.situation import SURE_SIGMAS
from leg_wear_monitor.playback.result import ReplaySummary
from leg_wear_monitor.report.page import Chart, Panel, Part, Series, Text, not_valid
from leg_wear_monitor.report.replay.charts import ends_of, time_series
from leg_wear_monitor.state import Figure


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
    words = summary.leg.joint_words(joint)
    chart = Chart(
        name=f"joint_{joint}",
        alt=f"Joint {words} over time",
        caption="Mean radial clearance; the band is the estimate by encoders or the drive torque ± two "
        "standard deviations. Contact force in each gait cycle: peaks are of a heavy tail.",
        x=time_series(summary),
        ends=ends_of(summary),
        panels=panels,
        group="time",
    )
    return [chart, *doubts]


def _clearance_panel(summary: ReplaySummary, joint: str) -> Panel:
    history, known = summary.history, summary.clearances.get(joint)
    series: list[Series] = []
    bands: list[tuple[int, int]] = []
    seen_mm = 1.0e3 * history.seen_m.get(joint, np.array([]))
    if _is_known(seen_mm):
        reach = SURE_SIGMAS * 1.0e3 * history.seen_sigma_m.get(joint, np.full_like(seen_mm, np.nan))
        high, low = seen_mm + reach, np.maximum(seen_mm - reach, 0.0)
        series += [
            Series(name="estimate, high", unit="mm", values=high, style="edge"),
            Series(name="estimate, low", unit="mm", values=low, style="edge"),
            Series(name="estimate", unit="mm", values=seen_mm, width=2.0),
        ]
        bands.append((0, 1))
    counted_m = history.counted_m.get(joint, np.array([]))
    if _is_known(counted_m) and Figure.CLEARANCES not in summary.verdict.not_valid:
        series.append(Series(name="counted", unit="mm", values=1.0e3 * counted_m, colour="--ink"))
    if series and known:
        limit = np.full(len(history.stamp_ns), 1.0e3 * known.limit_m)
        series.append(Series(name="limit", unit="mm", values=limit, colour="--bad", style="dashed"))
    title = f"Clearance of joint {summary.leg.joint_words(joint)}"
    return Panel(title=title, series=series, low=0.0, height=230, bands=bands)


def _force_panel(summary: ReplaySummary, joint: str) -> Panel:
    series = []
    if Figure.IMPACT_FORCES not in summary.verdict.not_valid:
        for name, colour, columns in (
            ("peak force", "--series-1", summary.history.peak_force_n),
            ("mean force", "--ink", summary.history.mean_force_n),
        ):
            values = columns.get(joint, np.array([]))
            if _is_known(values):
                series.append(Series(name=name, unit="N", values=values, colour=colour))
    return Panel(title="Contact force", series=series, low=0.0, height=150)


def _is_known(values: Floats) -> bool:
    return bool(np.isfinite(values).any())

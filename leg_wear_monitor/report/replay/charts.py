"""Charts of a replay: joints and input over time, forecast, wear around each bushing."""

from collections.abc import Sequence

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats, Ints
from leg_wear_monitor.monitor.forecast.forecast import JointForecast, LegForecast, bases, three_digits
from leg_wear_monitor.recordings.result import ReplaySummary, WornDepth
from leg_wear_monitor.report.figure import length_unit, time_of
from leg_wear_monitor.report.page import (
    Chart,
    Panel,
    Part,
    Section,
    Series,
    Table,
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

    cadence = Series("cadence", "rpm", history.cadence_rpm)
    mismatch = Series("mismatch", "", history.torque_mismatch)
    torque = [
        Series("measured", "N m", history.measured_torque_rms_nm),
        Series("predicted", "N m", history.predicted_torque_rms_nm, "--series-1"),
    ]
    commanded = attrs.evolve(_limit("commanded", "rpm", rpm, history.cadence_rpm), colour="--ink")
    panels = [
        Panel(
            "Cadence",
            [cadence, commanded],
            low=min(rpm - steady, -_greatest(-cadence.values, otherwise=-rpm)),
            high=max(rpm + steady, _greatest(cadence.values, otherwise=rpm)),
        ),
        Panel("Drive torque, RMS of each gait cycle", torque, low=0.0),
        Panel(
            "Unexplained fraction of the torque",
            [mismatch, _limit("limit", "", limit, history.torque_mismatch)],
            low=0.0,
            high=1.1 * max(limit, _greatest(history.torque_mismatch)),
        ),
        Panel("Load at the foot", [Series("load", "N", history.load_n)]),
        Panel("Friction of the drive", [Series("friction", "N m", history.friction_nm)]),
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


# The forecast: how long each joint and the leg last.


FRACTIONS = ("p10", "p50", "p90")


def forecast_section(summary: ReplaySummary) -> Section:
    """Section of the page."""
    doubt = not_valid(summary.verdict, Figure.FORECAST)
    parts: list[Part] = [Text(doubt, is_not_valid=True) if doubt else _lives(summary)]
    parts += [
        Text(f"The life of {basis}.")
        for basis in bases(
            {summary.leg.joint_words(name): forecast for name, forecast in _forecasts(summary)}
        )
    ]
    if not summary.measurements:
        parts.append(Text("No clearance was measured yet; one measurement makes the forecast narrower."))
    return Section("Forecast", parts, is_folded=True)


def _lives(summary: ReplaySummary) -> Table:
    leg, chances = summary.forecast, summary.forecast.first_probability if summary.forecast else {}
    rows = []
    for name, forecast in _forecasts(summary):
        may_be = forecast.clearance_m
        rows.append((
            summary.leg.joint_words(name),
            f"{1.0e3 * may_be.p10:.4f} to {1.0e3 * may_be.p90:.4f}" if may_be else "-",
            *_lasts(forecast),
            f"{100.0 * chances[name]:.0f}" if name in chances else "-",
            forecast.answer.value
            + (f"; measured {forecast.measurements} times" if forecast.measurements else ""),
        ))  # fmt: skip
    if leg is not None:
        rows.append(("leg", "", *_lasts(leg), "", leg.answer.value))
    quantiles = [f"{fraction} [h]" for fraction in FRACTIONS]
    return Table(
        caption="Hours of walking until the limit of the mean clearance",
        head=("", "clearance [mm]", *quantiles, "first [%]", ""),
        rows=rows,
        note="p10, p50 and p90 are not exceeded with a probability of 10, 50 and 90 %. "
        "Clearance: p10 to p90 of the present clearance. First: probability that this joint is the first "
        "at its limit, which ends the life of the leg.",
    )


def _forecasts(summary: ReplaySummary) -> list[tuple[str, JointForecast]]:
    """Joints that have a forecast."""
    return [(name, joint.forecast) for name, joint in summary.joints.items() if joint.forecast]


def _lasts(forecast: JointForecast | LegForecast) -> list[str]:
    hours = forecast.hours
    return [three_digits(getattr(hours, fraction)) if hours else "-" for fraction in FRACTIONS]


# Wear around each bushing and journal, on an axis that shows its true size.


_LEAST_M = 1.0e-6  # least length of the depth axis, so that small wear does not fill the picture
_TITLE = "Wear around each bushing"


def wear_section(summary: ReplaySummary) -> Section:
    """Depth over the angle, one panel per joint, all on the same axis."""
    doubt = not_valid(summary.verdict, Figure.CLEARANCES)
    if doubt:
        return Section(_TITLE, [Text(doubt, is_not_valid=True)], is_folded=True)
    return Section(_TITLE, [wear_chart(summary)], is_folded=True)


def wear_chart(summary: ReplaySummary) -> Chart:
    """Wear depth of each joint over the angle."""
    worn = summary.wear_depth_m
    most = max(1.1 * max(map(_deepest_m, worn.values()), default=0.0), _LEAST_M)
    factor, unit = length_unit(most)
    sectors = max((len(each.bushing) for each in worn.values()), default=0)
    angle = np.asarray((np.arange(sectors) + 0.5) * (360.0 / max(sectors, 1)), np.float64)
    panels = []
    for name, each in worn.items():
        bushing = Series(f"bushing {name}", unit, factor * each.bushing)
        journal = Series(f"journal {name}", unit, factor * each.journal, "--series-1")
        title, high = summary.leg.joint_words(name), factor * most
        panels.append(Panel(title, [bushing, journal], low=0.0, high=high, height=150))
    return Chart(
        name="wear",
        alt="Wear depth around bushing and journal of each joint",
        caption="Depth of the wear by the angle in each body's own frame, from the start of the ledger, or "
        "of the replay if none was continued. All joints on the same axis, which is never shorter than 1 µm.",
        x=Series("angle", "deg", angle),
        panels=panels,
        group="angle",
    )


def _deepest_m(worn: WornDepth) -> float:
    return max(float(depth.max(initial=0.0)) for depth in (worn.bushing, worn.journal))

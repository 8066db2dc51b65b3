"""The forecast on the page of a replay: how long each joint and the leg last, and how past forecasts did."""

import math
from collections.abc import Sequence

import numpy as np

from leg_wear_monitor.monitor.forecast.forecast import JointForecast, LegForecast, bases, three_digits
from leg_wear_monitor.monitor.forecast.forecaster import validity
from leg_wear_monitor.monitor.ledger.entry import Measurement
from leg_wear_monitor.recordings.result import ReplaySummary, WornDepth
from leg_wear_monitor.report.figure import length_unit
from leg_wear_monitor.report.page import Chart, Panel, Part, Section, Series, Table, Text, not_valid
from leg_wear_monitor.state import Figure

FRACTIONS = ("p10", "p50", "p90")
_MEASURED = ((True, "measured", "--series-0"), (False, "contradicts, not used", "--bad"))


def forecast_section(summary: ReplaySummary) -> Section:
    """Section of the page."""
    doubt = not_valid(summary.verdict, Figure.FORECAST)
    parts: list[Part] = [Text(doubt, is_not_valid=True) if doubt else _table(summary)]
    parts += [
        Text(f"The life of {basis}.")
        for basis in bases(
            {summary.leg.joint_words(name): forecast for name, forecast in _forecasts(summary)}
        )
    ]
    if summary.measurements:
        parts.append(_validity(summary.measurements))
    else:
        parts.append(Text("No clearance was measured yet; one measurement makes the forecast much narrower."))
    return Section("Forecast", parts, is_folded=True)


def _table(summary: ReplaySummary) -> Table:
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


def _validity(measurements: Sequence[Measurement]) -> Chart:
    """Each measured clearance in the distribution that was predicted before it."""
    kept = sorted((each for each in measurements if not each.is_withdrawn), key=lambda each: each.cycles)
    series = []
    for joint in dict.fromkeys(each.joint for each in kept):
        for counts, words, colour in _MEASURED:
            is_one = [each.joint == joint and each.counts is counts for each in kept]
            below = np.where(is_one, [each.expected_below for each in kept], math.nan)
            if any(is_one):
                name = f"{words}: {joint}"  # a name that starts with = would be a formula in a spreadsheet
                series.append(Series(name, "", below, colour, "points"))
    for name, end in (("p10", 0.1), ("p90", 0.9)):
        values = np.full(len(kept), end)
        series.append(Series(name, "", values, "--ink", "dashed"))
    title = "Predicted probability of a smaller clearance"
    cycles = np.array([float(each.cycles) for each in kept])
    return Chart(
        name="measurements",
        alt="Each measured clearance in its predicted distribution",
        caption=f"{validity(measurements)}. In the long run 80 % lie between p10 and p90.",
        x=Series("gait cycles of the part", "", cycles),
        ends=(0.0, max(1.05 * float(cycles.max(initial=0.0)), 1.0)),
        panels=[Panel(title, series, low=-0.02, high=1.02, height=240)],
        group="measurements",
    )


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
    most = max(1.1 * max(map(_greatest, worn.values()), default=0.0), _LEAST_M)
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


def _greatest(worn: WornDepth) -> float:
    return max(float(depth.max(initial=0.0)) for depth in (worn.bushing, worn.journal))

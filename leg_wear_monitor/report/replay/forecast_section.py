"""The forecast on the page of a replay: how long each joint and the leg last, and how past forecasts did."""

import math
from collections.abc import Sequence

import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.forecast.forecast import JointForecast, LegForecast, bases, three_digits
from leg_wear_monitor.monitor.forecast.measurement import validity
from leg_wear_monitor.monitor.ledger.entry import Measurement
from leg_wear_monitor.playback.result import ReplaySummary
from leg_wear_monitor.report.figure import length_unit
from leg_wear_monitor.report.page import Chart, Panel, Part, Section, Series, Table, Text, not_valid
from leg_wear_monitor.state import Figure

FRACTIONS = ("p10", "p50", "p90")
_MEASURED = ((True, "measured", "--series-0"), (False, "contradicts, not used", "--bad"))


def forecast_section(summary: ReplaySummary) -> Section:
    """Section of the page."""
    doubt = not_valid(summary.verdict, Figure.FORECAST)
    parts: list[Part] = [Text(sentence) for sentence in leg_sentence(summary)]
    parts.append(Text(doubt, is_not_valid=True) if doubt else _table(summary))
    parts += [Text(f"The life of {basis}.") for basis in bases(forecasts_of(summary))]
    if summary.measurements:
        parts.append(_validity(summary.measurements))
    else:
        parts.append(Text("No clearance was measured yet; one measurement makes the forecast much narrower."))
    return Section("Forecast", parts, is_folded=True)


def forecasts_of(summary: ReplaySummary) -> dict[str, JointForecast]:
    """Forecasts by the joints' names in words."""
    found = {summary.leg.joint_words(name): joint.forecast for name, joint in summary.joints.items()}
    return {name: told for name, told in found.items() if told is not None}


def _table(summary: ReplaySummary) -> Table:
    leg = summary.forecast
    rows = [
        (summary.leg.joint_words(name), _clearance(told), *_lasts(told), _first(leg, name), _answer(told))
        for name, joint in summary.joints.items()
        if (told := joint.forecast) is not None
    ]
    if leg is not None:
        rows.append(("leg", "", *_lasts(leg), "", leg.answer.value))
    quantiles = [f"{fraction} [{unit}]" for unit in ("h", "days") for fraction in FRACTIONS]
    head = ("", "clearance [mm]", *quantiles, "first [%]", "")
    return Table(
        caption="Hours of walking, and days of duty, until the limit of the mean clearance",
        head=head,
        rows=rows,
        note="p10, p50 and p90 are not exceeded with a probability of 10, 50 and 90 %. "
        f"A day of duty has {summary.monitor.duty_hours_per_day:g} h of walking. "
        "Clearance: p10 to p90 of the present clearance. First: probability of this "
        "joint to be the first at its limit, which ends the leg's life.",
    )


def leg_sentence(summary: ReplaySummary) -> list[str]:
    """How long the leg lasts, if that is known."""
    leg = summary.forecast
    if not_valid(summary.verdict, Figure.FORECAST):
        return []
    if leg is None or leg.hours is None or leg.first is None:
        return []
    p10, p50, p90 = (_life(leg, fraction) for fraction in FRACTIONS)
    probability = 100.0 * leg.first_probability[leg.first]
    first = summary.leg.joint_words(leg.first)
    return [
        f"The leg lasts {p50} (p10 {p10}, p90 {p90}); {first} is the first joint at its "
        f"limit with a probability of {probability:.0f} %."
    ]


def _life(leg: LegForecast, fraction: str) -> str:
    days = f" or {three_digits(getattr(leg.days, fraction))} days" if leg.days else ""
    return f"{three_digits(getattr(leg.hours, fraction))} hours of walking{days}"


def _validity(measurements: Sequence[Measurement]) -> Chart:
    """Each measured clearance in the distribution that was predicted before it."""
    kept = [each for each in measurements if not each.is_withdrawn]
    kept.sort(key=lambda each: each.cycles)
    series = [
        Series(
            name=f"{joint} {words}",
            unit="",
            values=np.array([_below(each, joint, counts) for each in kept]),
            colour=colour,
            style="points",
        )
        for joint in dict.fromkeys(each.joint for each in kept)
        for counts, words, colour in _MEASURED
        if any(each.joint == joint and each.counts is counts for each in kept)
    ]
    low, high = (
        Series(name=name, unit="", values=np.full(len(kept), end), colour="--ink", style="dashed")
        for name, end in (("p10", 0.1), ("p90", 0.9))
    )
    title = "Predicted probability of a smaller clearance"
    return Chart(
        name="measurements",
        alt="Each measured clearance in its predicted distribution",
        caption=f"{validity(measurements).words}. In the long run 80 % lie between p10 and p90.",
        x=Series(name="gait cycles of the part", unit="", values=np.array([float(m.cycles) for m in kept])),
        panels=[Panel(title=title, series=[*series, low, high], low=-0.02, high=1.02, height=240)],
        group="measurements",
    )


def _below(measured: Measurement, joint: str, counts: bool) -> float:
    is_this = measured.joint == joint and measured.counts is counts
    return measured.expected_below if is_this else math.nan


def _clearance(told: JointForecast) -> str:
    may_be = told.clearance_m
    if may_be is None:
        return "-"
    return f"{1.0e3 * may_be.p10:.4f} to {1.0e3 * may_be.p90:.4f}"


def _lasts(told: JointForecast | LegForecast) -> tuple[str, ...]:
    return tuple(
        three_digits(getattr(unit, fraction)) if unit else "-"
        for unit in (told.hours, told.days)
        for fraction in FRACTIONS
    )


def _first(leg: LegForecast | None, joint: str) -> str:
    known = leg is not None and joint in leg.first_probability
    return f"{100.0 * leg.first_probability[joint]:.0f}" if known and leg else "-"


def _answer(told: JointForecast) -> str:
    measured = f"; measured {told.measurements} times" if told.measurements else ""
    return f"{told.answer.value}{measured}"


# Wear around each bushing and journal, on an axis that shows it in its size.


_LEAST_M = 1.0e-6  # end of the depth axis: less wear than this does not fill the picture
_TITLE = "Wear around each bushing"


def wear_section(summary: ReplaySummary) -> Section:
    """Depth over the angle, a panel a joint, all on the same axis."""
    doubt = not_valid(summary.verdict, Figure.CLEARANCES)
    if doubt:
        return Section(_TITLE, [Text(doubt, is_not_valid=True)], is_folded=True)
    return Section(_TITLE, [Text(_deepest(summary)), wear_chart(summary)], is_folded=True)


def _deepest(summary: ReplaySummary) -> str:
    """The deepest wear beside the clearance limit, which tells how much it is."""
    depths = {name: _greatest(worn.bushing, worn.journal) for name, worn in summary.wear_depth_m.items()}
    name = max(depths, key=lambda joint: depths[joint], default="")
    if not name or not depths[name]:
        return "No wear is counted."
    factor, unit = length_unit(depths[name])
    limit = summary.clearances[name].limit_m if name in summary.clearances else None
    beside = f", {100.0 * depths[name] / limit:.2g} % of the limit of its clearance" if limit else ""
    joint = summary.leg.joint_words(name)
    what = "The deepest wear, corrections of the clearance included,"
    return f"{what} is {factor * depths[name]:.3g} {unit}, in joint {joint}{beside}."


def wear_chart(summary: ReplaySummary) -> Chart:
    """Wear depth of each joint over the angle."""
    greatest = max(
        (_greatest(worn.bushing, worn.journal) for worn in summary.wear_depth_m.values()), default=0.0
    )
    most = max(1.1 * greatest, _LEAST_M)
    factor, unit = length_unit(most)
    sectors = max((len(worn.bushing) for worn in summary.wear_depth_m.values()), default=0)
    angle = np.asarray((np.arange(sectors) + 0.5) * (360.0 / max(sectors, 1)), np.float64)
    panels = [
        Panel(
            title=summary.leg.joint_words(name),
            series=[
                Series(name=f"bushing {name}", unit=unit, values=factor * worn.bushing),
                Series(name=f"journal {name}", unit=unit, values=factor * worn.journal, colour="--series-1"),
            ],
            low=0.0,
            high=factor * most,
            height=150,
        )
        for name, worn in summary.wear_depth_m.items()
    ]
    return Chart(
        name="wear",
        alt="Wear depth around bushing and journal of each joint",
        caption="Depth of the wear by the angle in each body's own frame, from the start of the ledger, or "
        "of the replay if none was continued. All joints on the same axis, which is never shorter than 1 µm.",
        x=Series(name="angle", unit="deg", values=angle),
        panels=panels,
        group="angle",
    )


def _greatest(*depths: Floats) -> float:
    return max(float(depth.max(initial=0.0)) for depth in depths)

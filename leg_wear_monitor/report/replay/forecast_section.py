"""The forecast on the page of a replay: how long each joint and the leg last, and how past forecasts did."""

from collections.abc import Sequence

from leg_wear_monitor.monitor.forecast.forecast import JointForecast
from leg_wear_monitor.monitor.forecast.words import clearance_mm, three_digits
from leg_wear_monitor.monitor.ledger.entry import Measurement
from leg_wear_monitor.playback.result.parts import LegLife, ReplayJoint
from leg_wear_monitor.playback.result.replay_summary import ReplaySummary
from leg_wear_monitor.report.figures.validity_picture import validity_picture
from leg_wear_monitor.report.page import Part, Picture, Section, Table, Text

FRACTIONS = ("p10", "p50", "p90")


def forecast_section(summary: ReplaySummary) -> Section:
    """Section of the page."""
    leg = summary.forecast
    rows = [
        (name, _clearance(told), *_lasts(told), _first(leg, name), _answer(told))
        for name, joint in summary.joints.items()
        if (told := joint.forecast) is not None
    ]
    if leg is not None:
        rows.append(("leg", "", *_lasts(leg), "", leg.answer.value))
    quantiles = [f"{fraction} [{unit}]" for unit in ("h", "days") for fraction in FRACTIONS]
    head = ("", "clearance [mm]", *quantiles, "first [%]", "")
    parts: list[Part] = [
        Table(
            caption="Hours of walking, and days of duty, until the limit of the mean clearance",
            head=head,
            rows=rows,
            note="p10, p50 and p90 are not exceeded with a probability of 10, 50 and 90 %. "
            f"A day of duty has {summary.monitor.duty_hours_per_day:g} h of walking. "
            "Clearance: p10 to p90 of the present clearance. First: probability of this "
            "joint to be the first at its limit, which ends the leg's life.",
        )
    ]
    if summary.measurements:
        parts.append(_validity(summary.measurements))
    else:
        parts.append(Text("No clearance was measured yet; one measurement makes the forecast much narrower."))
    return Section("Forecast", parts)


def leg_sentence(summary: ReplaySummary) -> list[str]:
    """How long the leg lasts, if that is known."""
    leg = summary.forecast
    if leg is None or leg.hours is None or leg.first is None:
        return []
    p10, p50, p90 = (_life(leg, fraction) for fraction in FRACTIONS)
    probability = 100.0 * leg.first_probability[leg.first]
    return [
        f"The leg lasts {p50} (p10 {p10}, p90 {p90}); {leg.first} is the first joint at its "
        f"limit with a probability of {probability:.0f} %."
    ]


def counted_mm(joint: ReplayJoint) -> str:
    """A joint's counted clearance [mm] in the digits that are known of it."""
    counted = joint.clearance_m.last
    if joint.forecast is None:
        return f"{1.0e3 * counted:.3f}"
    may_be = joint.forecast.clearance_m
    return clearance_mm(counted, may_be.p10, may_be.p90)


def _life(leg: LegLife, fraction: str) -> str:
    days = f" or {three_digits(getattr(leg.days, fraction))} days" if leg.days else ""
    return f"{three_digits(getattr(leg.hours, fraction))} hours of walking{days}"


def _validity(measurements: Sequence[Measurement]) -> Picture:
    return Picture(
        image=validity_picture(measurements),
        alt="Each measured clearance in its predicted distribution",
        caption="Measured clearances of the ledger in the distribution predicted before each. In the long "
        "run 80 % lie in the shaded band.",
        wide=True,
    )


def _clearance(told: JointForecast) -> str:
    may_be = told.clearance_m
    return f"{1.0e3 * may_be.p10:.4f} to {1.0e3 * may_be.p90:.4f}"


def _lasts(told: JointForecast | LegLife) -> tuple[str, ...]:
    return tuple(
        three_digits(getattr(unit, fraction)) if unit else "-"
        for unit in (told.hours, told.days)
        for fraction in FRACTIONS
    )


def _first(leg: LegLife | None, joint: str) -> str:
    known = leg is not None and joint in leg.first_probability
    return f"{100.0 * leg.first_probability[joint]:.0f}" if known and leg else "-"


def _answer(told: JointForecast) -> str:
    measured = f"; measured {told.measurements} times" if told.measurements else ""
    return f"{told.answer.value}{measured}"

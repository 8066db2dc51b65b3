"""The forecast on the page of a replay: how long each joint and the leg last, and how past forecasts did."""

from typing import Any

from leg_wear_monitor.monitor.forecast.words import clearance_mm, three_digits
from leg_wear_monitor.monitor.ledger.entry import Measurement
from leg_wear_monitor.report.figures.validity_picture import validity_picture
from leg_wear_monitor.report.page import Part, Picture, Section, Table, Text


def forecast_section(record: dict[str, Any]) -> Section:
    """Section of the page, from what summary.json holds."""
    leg = record["forecast"]
    rows = [
        (name, *_clearance(joint["forecast"]), *_lasts(joint["forecast"]), _first(leg, name), _answer(joint))
        for name, joint in record["joints"].items()
        if joint["forecast"] is not None
    ]
    if leg is not None:
        rows.append(("leg", "", *_lasts(leg), "", leg["answer"]))
    quantiles = [f"{fraction} [{unit}]" for unit in ("h", "days") for fraction in ("p10", "p50", "p90")]
    head = ("", "clearance [mm]", *quantiles, "first [%]", "")
    parts: list[Part] = [
        Table(
            caption="Hours of walking, and days of duty, until the limit of the mean clearance",
            head=head,
            rows=rows,
            note="p10, p50 and p90 are not exceeded with a probability of 10, 50 and 90 %. "
            f"{_duty(record)}Clearance: p10 to p90 of the present clearance. First: probability of this "
            "joint to be the first at its limit, which ends the leg's life.",
        )
    ]
    measurements = [Measurement(**each) for each in record["measurements"]]
    if measurements:
        parts.append(_validity(measurements))
    else:
        parts.append(Text("No clearance was measured yet; one measurement makes the forecast much narrower."))
    return Section("Forecast", parts)


def leg_sentence(record: dict[str, Any]) -> list[str]:
    """How long the leg lasts, if that is known."""
    leg = record["forecast"]
    if leg is None or leg["hours"] is None:
        return []
    p10, p50, p90 = (_life(leg, fraction) for fraction in ("p10", "p50", "p90"))
    probability = 100.0 * leg["first_probability"][leg["first"]]
    return [
        f"The leg lasts {p50} (p10 {p10}, p90 {p90}); {leg['first']} is the first joint at its "
        f"limit with a probability of {probability:.0f} %."
    ]


def counted_mm(joint: dict[str, Any]) -> str:
    """A joint's counted clearance [mm] in the digits that are known of it."""
    counted, told = joint["clearance_m"]["last"], joint["forecast"]
    if told is None:
        return f"{1.0e3 * counted:.3f}"
    return clearance_mm(counted, told["clearance_m"]["p10"], told["clearance_m"]["p90"])


def _life(told: dict[str, Any], fraction: str) -> str:
    days = f" or {three_digits(told['days'][fraction])} days" if told["days"] else ""
    return f"{three_digits(told['hours'][fraction])} hours of walking{days}"


def _duty(record: dict[str, Any]) -> str:
    hours = record["monitor"].get("duty_hours_per_day")
    return f"A day of duty has {hours:g} h of walking. " if hours else ""


def _validity(measurements: list[Measurement]) -> Picture:
    return Picture(
        image=validity_picture(measurements),
        alt="Each measured clearance in its predicted distribution",
        caption="Measured clearances of the ledger in the distribution predicted before each. In the long "
        "run 80 % lie in the shaded band.",
        wide=True,
    )


def _clearance(told: dict[str, Any]) -> tuple[str]:
    seen = told["clearance_m"]
    return (f"{1.0e3 * seen['p10']:.4f} to {1.0e3 * seen['p90']:.4f}",)


def _lasts(told: dict[str, Any]) -> tuple[str, ...]:
    fractions = ("p10", "p50", "p90")
    units = (told["hours"], told["days"])
    return tuple(three_digits(unit[fraction]) if unit else "-" for unit in units for fraction in fractions)


def _first(leg: dict[str, Any] | None, joint: str) -> str:
    known = leg is not None and joint in leg["first_probability"]
    return f"{100.0 * leg['first_probability'][joint]:.0f}" if known and leg else "-"


def _answer(joint: dict[str, Any]) -> str:
    measured = joint["forecast"]["measurements"]
    return f"{joint['forecast']['answer']}" + (f"; measured {measured} times" if measured else "")

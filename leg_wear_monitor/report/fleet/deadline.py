"""By when a person should look after a leg."""

from leg_wear_monitor.fleet.overview.parts import LegOverview
from leg_wear_monitor.monitor.alarms.words import time_words
from leg_wear_monitor.report.fleet.standing import DAY_NS, Day, Standing

_LEAST_DAYS = 1.0  # of recordings; from less, hours of walking a day are not known
_MOST_DAYS = 3650.0


def deadline(leg: LegOverview, standing: Standing, day: Day) -> str:
    """By when a person should look after a leg, in words: by its standing and by the p10 of its life."""
    if standing is Standing.STOP:
        return "now, before it walks again"
    if standing in (Standing.NOT_MONITORED, Standing.OUTDATED, Standing.UNKNOWN):
        return "as soon as possible: nobody monitors it meanwhile"
    life = leg.life.get("leg")
    p10 = "" if life is None else f"{hours(life.p10_h)} h of walking{_date(leg, life.p10_h, day)}"
    if standing is Standing.INSPECT:  # what is to be inspected may make the forecast wrong
        return f"at its next stop{p10 and f'; p10 of its life: {p10}'}"
    return f"within the p10 of its life: {p10}" if p10 else "at its next service"


def hours(value_h: float) -> str:
    """Hours in three digits."""
    return f"{value_h:.0f}" if value_h >= 100.0 else f"{value_h:.3g}"


def _date(leg: LegOverview, p10_h: float, day: Day) -> str:
    """The date, if the leg walks as much a day as its recordings show; empty if that is not known."""
    span_days = (leg.recordings.end_ns - leg.recordings.begin_ns) / DAY_NS
    if span_days < _LEAST_DAYS or leg.recordings.counted_h <= 0.0:
        return ""
    a_day_h = min(leg.recordings.counted_h / span_days, 24.0)
    days = p10_h / a_day_h
    if days > _MOST_DAYS:
        return ""
    at_ns = leg.recordings.end_ns + int(days * DAY_NS)
    late = "overdue: " if at_ns < day.now_ns else ""
    return f"; {late}by {time_words(at_ns).split()[0]} at the {a_day_h:.2g} h a day that its recordings show"

"""A row a joint: clearance against limit, remaining life and alarms, on common axes."""

import math
from collections.abc import Sequence

import attrs

from leg_wear_monitor.monitor.forecast.forecast import clearance_mm, three_digits
from leg_wear_monitor.monitor.verdict.situation import MEASURED, OF_A_JOINT, SEEN, SOURCES
from leg_wear_monitor.playback.result import ReplaySummary
from leg_wear_monitor.report.page import STATE_LOOKS, Fragment, alarm_line, not_valid, render
from leg_wear_monitor.state import Figure, JointClearance, LegAlarm, Level, LifeHours, State

# A clearance joint as the first screen shows it: only values that are valid.


_NEAR = 0.5  # used fraction of the wear allowance from which on a joint is drawn as near its limit


@attrs.frozen(kw_only=True)
class JointView:
    """A joint.

    Attributes
    ----------
    joint, label : str
        Name, and what people call it; that may be empty.
    clearance : JointClearance or None
        None if it is not known.
    counted_m : float or None
        As counted; None while that is not valid.
    seen_m, seen_sigma_m : float or None
        What encoders or the drive torque show, or showed when its latched alarm was raised.
    seen_by : str
        Which of them.
    shown_m : float or None
        The clearance that the verdict rests on.
    counted_words : str
        The counted clearance [mm] in the digits that are known of it.
    doubt : str
        Why the counted clearance is not given; empty if it is.
    used : float or None
        Fraction of the wear allowance, from the clearance when new to its limit, that is used.
    look : str
        ``fine``, ``near``, ``over`` or ``unknown``.
    life : LifeHours or None
    life_words : str
        Why there is no remaining life; empty if there is.
    life_doubt : bool
        Whether that is because the verdict lists it as not valid.
    alarms : tuple of LegAlarm
        Those that are raised.
    """

    joint: str
    label: str
    clearance: JointClearance | None
    counted_m: float | None
    seen_m: float | None
    seen_sigma_m: float | None
    seen_by: str
    shown_m: float | None
    counted_words: str
    doubt: str
    used: float | None
    look: str
    life: LifeHours | None
    life_words: str
    life_doubt: bool
    alarms: tuple[LegAlarm, ...]


def joint_views(summary: ReplaySummary) -> tuple[JointView, ...]:
    """All clearance joints."""
    return tuple(_view(summary, joint) for joint in summary.monitor.clearance_joints)


def _view(summary: ReplaySummary, joint: str) -> JointView:
    clearance, doubt = summary.clearances.get(joint), not_valid(summary.verdict, Figure.CLEARANCES)
    counted = clearance.counted_m if clearance and not doubt else None
    seen_m, seen_sigma_m, seen_by = _seen(clearance) if clearance else (None, None, "")
    shown = clearance.believed_m if clearance else None
    used = _used(clearance, shown) if clearance and shown is not None else None
    if summary.verdict.state is State.NOT_MONITORED and (used or 0.0) < 1.0:
        used = None  # a joint that nobody watches is not shown as one that is all right
    drawn = summary.leg.joints.get(joint)
    life, life_doubt = summary.life.get(joint), not_valid(summary.verdict, Figure.FORECAST)
    return JointView(
        joint=joint,
        label=drawn.label if drawn else "",
        clearance=clearance,
        counted_m=counted,
        seen_m=seen_m,
        seen_sigma_m=seen_sigma_m,
        seen_by=seen_by,
        shown_m=shown,
        counted_words="" if counted is None else counted_mm(summary, joint),
        doubt=doubt or ("" if clearance else "not known: no gait cycle of this leg"),
        used=used,
        look=_look(summary, joint, clearance, shown, used),
        life=None if life_doubt else life,
        life_words=life_doubt or ("" if life else _answer(summary, joint)),
        life_doubt=bool(life_doubt),
        alarms=tuple(
            alarm for alarm in summary.alarms.now if alarm.level is not Level.OK and _is_of(alarm, joint)
        ),
    )


def counted_mm(summary: ReplaySummary, joint: str) -> str:
    """A joint's counted clearance [mm] in the digits that are known of it."""
    found = summary.joints.get(joint)
    counted = summary.clearances[joint].counted_m
    if found is None or found.forecast is None or found.forecast.clearance_m is None:
        return f"{1.0e3 * counted:.3f}"
    may_be = found.forecast.clearance_m
    return clearance_mm(counted, may_be.p10, may_be.p90)


def _seen(clearance: JointClearance) -> tuple[float | None, float | None, str]:
    """What encoders or the drive torque show, its standard deviation, and which of them; or what they showed.

    An estimate by torque does not rest on the counted clearance, so it is shown while that is not valid.
    """
    if clearance.believed_by in SEEN:
        return clearance.believed_m, clearance.believed_sigma_m, SOURCES[str(clearance.believed_by)]
    by = " and ".join(SOURCES.get(one, one) for one in clearance.seen_by)
    return clearance.seen_m, clearance.seen_sigma_m, by


def _used(clearance: JointClearance, shown_m: float) -> float:
    allowance = clearance.limit_m - clearance.new_m
    if allowance <= 0.0:
        return float(shown_m >= clearance.limit_m)
    return max(0.0, (shown_m - clearance.new_m) / allowance)


def _look(
    summary: ReplaySummary,
    joint: str,
    clearance: JointClearance | None,
    shown_m: float | None,
    used: float | None,
) -> str:
    """Look of a joint: as the verdict says, where it names the joint."""
    if clearance is None or shown_m is None or used is None:
        return "unknown"
    is_named = joint in summary.verdict.joints
    if used >= 1.0 or (is_named and summary.verdict.state is State.STOP):
        return "over"
    if is_named and summary.verdict.state is State.INSPECT:
        return "near"
    is_warning = shown_m >= summary.monitor.limits.warn_fraction * clearance.limit_m > clearance.new_m
    return "near" if used >= _NEAR or is_warning else "fine"


def _answer(summary: ReplaySummary, joint: str) -> str:
    return summary.life_answers.get(joint, "not known")


def _is_of(alarm: LegAlarm, joint: str) -> bool:
    return alarm.name in {f"{kind} {joint}" for kind in OF_A_JOINT}


_SIGMAS = 2.0  # drawn to either side of a seen clearance
_MOST_LIMITS = 4.0  # length of the clearance axis, in the greatest limit
_WIDTH = 100.0  # of a bar


@attrs.frozen
class Span:
    """A part of a bar, from ``x`` on and ``width`` long [% of the bar]."""

    x: float
    width: float


@attrs.frozen
class ClearanceBar:
    """Limit, counted clearance, and the one that is seen with what is sure of it; None where not known."""

    limit: Span
    counted: Span | None = None
    seen: Span | None = None
    sure: Span | None = None


@attrs.frozen
class LifeBar:
    """From p10 to p90, and p50."""

    range: Span
    median: Span


def joint_rows(summary: ReplaySummary, views: Sequence[JointView]) -> Fragment:
    """The rows as a table: first the joints that the verdict names, then those with alarms."""
    views = sorted(views, key=lambda view: (view.joint not in summary.verdict.joints, not view.alarms))
    leg = _leg_life(summary)
    most_m, life = _most_m(views), _life_axis([*(view.life for view in views), leg])
    rows = [
        {
            "view": view,
            "clearance": _clearance(view, most_m),
            "words": _clearance_words(view),
            "life": _life(view.life, life),
            "life_words": _hours_words(view.life) if view.life else view.life_words,
            "findings": _findings(summary, view),
        }
        for view in views
    ]
    row = {"life": _life(leg, life), "words": _hours_words(leg), "first": _first(summary)} if leg else None
    note = " ".join([_note(views, most_m, life), *(_holds_for(summary) if life else [])]).strip()
    return Fragment(render("replay/joints.html", rows=rows, leg=row, note=note))


def _holds_for(summary: ReplaySummary) -> list[str]:
    """Regimes that the remaining lives hold for, a sentence each."""
    priors = [joint.forecast.prior for joint in summary.joints.values() if joint.forecast]
    regimes = dict.fromkeys(prior.holds_for for prior in priors if prior)
    return [f"It holds for {', '.join(regimes)}."] if regimes else []


def _leg_life(summary: ReplaySummary) -> LifeHours | None:
    return None if Figure.FORECAST in summary.verdict.not_valid else summary.life.get("leg")


def _first(summary: ReplaySummary) -> str:
    """The joint that is probably the first at its limit; empty if that is not known."""
    chances = summary.first_probability
    first = max(chances, key=lambda joint: chances[joint], default=None)
    if first is None:
        return ""
    joint, percent = summary.leg.joint_words(first), 100.0 * chances[first]
    return f"{joint} first at its limit with {percent:.0f} % probability"


def _findings(summary: ReplaySummary, view: JointView) -> list[tuple[str, str, str]]:
    """Symbol, class and words of the verdict if it names the joint, and of the joint's alarms."""
    alarms = [alarm_line(summary, alarm) for alarm in view.alarms]
    found = [(alarm.symbol, alarm.look, alarm.short) for alarm in alarms]
    if view.joint in summary.verdict.joints:
        symbol, look = STATE_LOOKS[summary.verdict.state]
        found.insert(0, (symbol, look, summary.verdict.state.words.upper()))
    return found


def _most_m(views: Sequence[JointView]) -> float:
    """End of the clearance axis [m]: all limits and marks, unless that is far beyond them."""
    limits = [view.clearance.limit_m for view in views if view.clearance]
    greatest = max(limits, default=1.0e-3)
    ends = [_end_m(view) for view in views if view.clearance]
    return min(max([1.1 * greatest, *ends]), _MOST_LIMITS * greatest)


def _end_m(view: JointView) -> float:
    mark_m, sigma_m = _mark(view) or (0.0, 0.0)
    return 1.02 * max(view.counted_m or 0.0, mark_m + _SIGMAS * sigma_m)


def _mark(view: JointView) -> tuple[float, float] | None:
    """The clearance that was measured by hand, or else is seen, and its standard deviation [m]."""
    known = view.clearance
    if known is not None and known.believed_m is not None and known.believed_by == MEASURED:
        return known.believed_m, known.believed_sigma_m or 0.0
    return None if view.seen_m is None else (view.seen_m, view.seen_sigma_m or 0.0)


def _clearance(view: JointView, most_m: float) -> ClearanceBar | None:
    if view.clearance is None:
        return None
    limit = _span(view.clearance.limit_m, view.clearance.limit_m, most_m)
    counted = None if view.counted_m is None else _span(0.0, view.counted_m, most_m)
    if (mark := _mark(view)) is None:
        return ClearanceBar(limit, counted)
    mark_m, reach = mark[0], _SIGMAS * mark[1]
    seen = _span(mark_m, mark_m, most_m)
    return ClearanceBar(limit, counted, seen, _span(mark_m - reach, mark_m + reach, most_m))


def _span(low: float, high: float, most: float) -> Span:
    begin, end = (_WIDTH * min(max(end / most, 0.0), 1.0) for end in (low, high))
    return Span(round(begin, 2), round(end - begin, 2))


def _clearance_words(view: JointView) -> list[tuple[str, str]]:
    """What is counted and what is seen, each with the class of its words."""
    counted = (
        ("not-valid", f"counted {view.doubt}") if view.doubt else ("", f"counted {view.counted_words} mm")
    )
    if view.clearance is None:
        return [counted]
    seen = []
    if view.seen_m is not None:
        sigma = 1.0e3 * (view.seen_sigma_m or 0.0)
        digits = 2 if sigma >= 0.1 else 3
        seen.append(
            ("", f"estimated {1.0e3 * view.seen_m:.{digits}f} ± {sigma:.{digits}f} mm by {view.seen_by}")
        )
    if view.clearance.measured_m is not None:
        sigma = 1.0e3 * (view.clearance.measured_sigma_m or 0.0)
        seen.append(("", f"measured {1.0e3 * view.clearance.measured_m:.3f} ± {sigma:.3f} mm by hand"))
    limit = ("", f"limit {1.0e3 * view.clearance.limit_m:.3g} mm")
    return [*seen, counted, limit] if view.doubt else [counted, *seen, limit]


def _life_axis(lives: Sequence[LifeHours | None]) -> tuple[int, int] | None:
    """Decades of hours from which and to which the life axis goes; None without any life."""
    hours = [max(end, 1.0) for life in lives if life for end in (life.p10_h, life.p90_h)]
    if not hours:
        return None
    low, high = math.floor(math.log10(min(hours))), math.ceil(math.log10(max(hours)))
    return low, max(high, low + 1)


def _life(hours: LifeHours | None, axis: tuple[int, int] | None) -> LifeBar | None:
    if hours is None or axis is None:
        return None
    low, decades = axis[0], float(axis[1] - axis[0])
    p10, p50, p90 = (math.log10(max(each, 1.0)) - low for each in attrs.astuple(hours))
    return LifeBar(_span(p10, p90, decades), _span(p50, p50, decades))


def _hours_words(life: LifeHours) -> str:
    p10, p50, p90 = map(three_digits, attrs.astuple(life))
    return f"{p50} h; {p10} to {p90} h"


def _note(views: Sequence[JointView], most_m: float, life: tuple[int, int] | None) -> str:
    """How to read the bars."""
    if not any(view.clearance for view in views):
        return ""
    notes = [
        f"Clearances are radial, all bars from 0 to {1.0e3 * most_m:.3g} mm: blue bar counted, mark the "
        "estimate or the measurement with two standard deviations, red line limit.",
    ]
    if life:
        notes.append(
            f"Remaining life in hours of walking, p50 and p10 to p90, on a logarithmic axis from "
            f"{10 ** life[0]:,} to {10 ** life[1]:,} h."
        )
    return " ".join(notes)

"""The clearance joints of a replay: one row per joint, and the marks in the drawing of the leg."""

import math
from collections.abc import Sequence
from typing import Any

import attrs

from leg_wear_monitor.monitor.alarms import WARN_FRACTION, joint_of
from leg_wear_monitor.monitor.forecast.forecast import three_digits
from leg_wear_monitor.monitor.verdict.situation import SOURCES
from leg_wear_monitor.recordings.result import Place, ReplaySummary
from leg_wear_monitor.report.page import LEVEL_LOOKS, NOT_VALID, STATE_LOOKS, not_valid, render
from leg_wear_monitor.state import Figure, JointClearance, LegAlarm, Level, LifeHours, State

# A clearance joint as the first screen shows it: its best estimate, and no other clearance.


_NEAR = 0.5  # a joint is drawn as near its limit above this used fraction of the wear allowance


@attrs.frozen(kw_only=True)
class JointView:
    """A joint.

    Attributes
    ----------
    joint, label : str
        Name, and the name that people use; the label may be empty.
    clearance : JointClearance or None
        None if it is not known.
    used : float or None
        Fraction of the wear allowance, from the clearance when new to its limit, that is used.
    look : str
        ``fine``, ``near``, ``over`` or ``unknown``.
    alarms : tuple of LegAlarm
        The raised alarms of the joint.
    """

    joint: str
    label: str
    clearance: JointClearance | None
    used: float | None
    look: str
    alarms: tuple[LegAlarm, ...]


def joint_views(summary: ReplaySummary) -> tuple[JointView, ...]:
    """All clearance joints."""
    return tuple(_view(summary, joint) for joint in summary.monitor.clearance_joints)


def _view(summary: ReplaySummary, joint: str) -> JointView:
    clearance = summary.clearances.get(joint)
    used = _used(clearance) if clearance else None
    if summary.verdict.state is State.NOT_MONITORED and (used or 0.0) < 1.0:
        used = None  # an unmonitored joint must not look healthy
    drawn, now = summary.leg.joints.get(joint), summary.alarms.now
    raised = [alarm for alarm in now if alarm.level is not Level.OK and joint_of(alarm.name) == joint]
    return JointView(
        joint=joint,
        label=drawn.label if drawn else "",
        clearance=clearance,
        used=used,
        look=_look(summary, joint, clearance, used),
        alarms=tuple(raised),
    )


def _used(clearance: JointClearance) -> float | None:
    """Used fraction of the wear allowance, by the clearance that the verdict rests on."""
    shown_m, allowance = clearance.best_estimate_m, clearance.limit_m - clearance.new_m
    if shown_m is None:
        return None
    if allowance <= 0.0:
        return float(shown_m >= clearance.limit_m)
    return max(0.0, (shown_m - clearance.new_m) / allowance)


def _look(summary: ReplaySummary, joint: str, clearance: JointClearance | None, used: float | None) -> str:
    """Look of a joint: as the verdict says, where it names the joint."""
    if clearance is None or clearance.best_estimate_m is None or used is None:
        return "unknown"
    is_named = joint in summary.verdict.joints
    if used >= 1.0 or (is_named and summary.verdict.state is State.STOP):
        return "over"
    if is_named and summary.verdict.state is State.INSPECT:
        return "near"
    warn_m = WARN_FRACTION * clearance.limit_m
    return "near" if used >= _NEAR or clearance.best_estimate_m >= warn_m > clearance.new_m else "fine"


# One row per joint: clearance against limit, remaining life and alarms, on common axes.


SIGMAS = 2.0  # drawn to either side of an estimate
_MOST_ALLOWANCES = 4.0  # longest axis of the bars
_WIDTH = 100.0  # of a bar

Span = tuple[float, float]  # start and length of a part of a bar [% of the bar]


def joints_and_leg(summary: ReplaySummary) -> str:
    """Markup of the leg's picture next to one row per joint."""
    views = joint_views(summary)
    drawing, rows = leg_drawing(summary, views), joint_rows(summary, views)
    return render("replay/joints_and_leg.html", drawing=drawing, rows=rows)


def joint_rows(summary: ReplaySummary, views: Sequence[JointView]) -> str:
    """Markup of the rows as a table: first the joints that the verdict names, then those with alarms."""
    views = sorted(views, key=lambda view: (view.joint not in summary.verdict.joints, not view.alarms))
    doubt = not_valid(summary.verdict, Figure.FORECAST)
    lives = {} if doubt else summary.life
    leg, most = lives.get("leg"), _most(views)
    axis = _life_axis([*(lives.get(view.joint) for view in views), leg])
    rows = [
        {
            "view": view,
            "bar": _bar(view, most),
            "words": _clearance_words(view, not_valid(summary.verdict, Figure.CLEARANCES)),
            "life": _life(lives.get(view.joint), axis)
            or {"words": doubt or summary.life_answers.get(view.joint, "not known")},
            "findings": _findings(summary, view),
        }
        for view in views
    ]
    note = " ".join([_note(views, axis), *(_holds_for(summary) if axis else [])]).strip()
    values = {"leg": _life(leg, axis), "first": _first(summary), "note": note, "doubt": doubt}
    return render("replay/joints.html", rows=rows, **values)


def _holds_for(summary: ReplaySummary) -> list[str]:
    """Wear regimes for which the remaining lives are valid, one sentence per regime."""
    priors = [joint.forecast.prior for joint in summary.joints.values() if joint.forecast]
    regimes = dict.fromkeys(prior.holds_for for prior in priors if prior)
    return [f"It holds for {', '.join(regimes)}."] if regimes else []


def _first(summary: ReplaySummary) -> str:
    """The joint that is probably the first at its limit; empty if that is not known."""
    chances = summary.first_probability
    if not chances:
        return ""
    first = max(chances, key=lambda joint: chances[joint])
    percent = 100.0 * chances[first]
    return f"{summary.leg.joint_words(first)} first at its limit with {percent:.0f} % probability"


def _findings(summary: ReplaySummary, view: JointView) -> list[tuple[str, str, str]]:
    """Symbol, class and words of the verdict if it names the joint, and of the joint's alarms."""
    found = [
        (*LEVEL_LOOKS[alarm.level], f"{alarm.level.name} {alarm.name.partition(' ')[0]}")
        for alarm in view.alarms
    ]
    if view.joint in summary.verdict.joints:
        found.insert(0, (*STATE_LOOKS[summary.verdict.state], summary.verdict.state.words.upper()))
    return found


def _most(views: Sequence[JointView]) -> float:
    """End of the axis of all bars, in wear allowances; it includes all joints and limits, up to a bound."""
    ends = [end for view in views if (ends := _ends(view)) for end in ends]
    return min(max([1.1, *ends]), _MOST_ALLOWANCES)


def _ends(view: JointView) -> tuple[float, float] | None:
    """Best estimate minus and plus two standard deviations, in wear allowances; None if it is not known."""
    known = view.clearance
    if known is None or known.best_estimate_m is None or known.limit_m <= known.new_m:
        return None
    reach, allowance_m = SIGMAS * (known.best_estimate_sigma_m or 0.0), known.limit_m - known.new_m
    from_new_m = known.best_estimate_m - known.new_m
    return (from_new_m - reach) / allowance_m, (from_new_m + reach) / allowance_m


def _bar(view: JointView, most: float) -> dict[str, Span] | None:
    """Best estimate and limit, from the clearance when new on; None if the clearance is not known."""
    ends = _ends(view)
    if ends is None:
        return None
    bar = {"limit": _span(1.0, 1.0, most), "best": _span(0.0, 0.5 * sum(ends), most)}
    if ends[1] > ends[0]:
        bar["sure"] = _span(*ends, most)
    return bar


def _span(low: float, high: float, most: float) -> Span:
    begin, end = (_WIDTH * min(max(end / most, 0.0), 1.0) for end in (low, high))
    return round(begin, 2), round(end - begin, 2)


def _clearance_words(view: JointView, doubt: str) -> list[tuple[str, str]]:
    """Best estimate with its source, and limit, each with the class of its words."""
    known = view.clearance
    if known is None:
        return [("not-valid", "not known: no gait cycle of this leg")]
    others = [("", f"limit {1.0e3 * known.limit_m:.3g} mm")]
    if known.change_m is not None:
        change, sigma = 1.0e3 * known.change_m, 1.0e3 * (known.change_sigma_m or 0.0)
        others.append(("", f"changed by {change:+.3f} ± {sigma:.3f} mm since the baseline"))
    if known.best_estimate_m is None or known.best_estimate_source is None:
        return [("not-valid", doubt or NOT_VALID), *others]
    sigma_mm = 1.0e3 * (known.best_estimate_sigma_m or 0.0)
    digits = 2 if sigma_mm >= 0.1 else 3
    around = f" ± {sigma_mm:.{digits}f}" if sigma_mm else ""
    source = SOURCES[known.best_estimate_source]
    return [("", f"{1.0e3 * known.best_estimate_m:.{digits}f}{around} mm according to {source}"), *others]


def _life_axis(lives: Sequence[LifeHours | None]) -> tuple[int, int] | None:
    """First and last decade of hours on the life axis; None without any life."""
    hours = [max(end, 1.0) for life in lives if life for end in (life.p10_h, life.p90_h)]
    if not hours:
        return None
    low, high = math.floor(math.log10(min(hours))), math.ceil(math.log10(max(hours)))
    return low, max(high, low + 1)


def _life(hours: LifeHours | None, axis: tuple[int, int] | None) -> dict[str, Any] | None:
    """Bar from p10 to p90 with a mark at p50, and the same values as text."""
    if hours is None or axis is None:
        return None
    low, decades = axis[0], float(axis[1] - axis[0])
    p10, p50, p90 = (math.log10(max(each, 1.0)) - low for each in attrs.astuple(hours))
    words = [three_digits(each) for each in attrs.astuple(hours)]
    return {
        "range": _span(p10, p90, decades),
        "median": _span(p50, p50, decades)[0],
        "words": f"{words[1]} h; {words[0]} to {words[2]} h",
    }


def _note(views: Sequence[JointView], life: tuple[int, int] | None) -> str:
    """How to read the bars."""
    if not any(view.clearance for view in views):
        return ""
    note = "Clearances are radial. Each bar starts at the clearance when new; the red line is the limit."
    if any((ends := _ends(view)) and ends[1] > ends[0] for view in views):
        note += " The black line is two standard deviations to both sides."
    if life:
        note += (
            " Remaining life in hours of walking, p50 and p10 to p90, on a logarithmic axis from "
            f"{10 ** life[0]:,} to {10 ** life[1]:,} h."
        )
    return note


# The leg as an inline drawing, its clearance joints marked by how much of their limit is used.


_WIDEST, _TALLEST, _MARGIN = 260.0, 400.0, 30.0  # of the drawing; room for letters around it
_APART = 11.0  # joints at one place are drawn side by side
_NEAR_M = 1.0e-3


def leg_drawing(summary: ReplaySummary, views: Sequence[JointView]) -> str:
    """Markup of the drawing, or of a note if the summary has no shape of the leg."""
    leg = summary.leg
    if not leg.bodies_m or not leg.joints:
        return render("replay/leg.html", drawing=None)
    places = [place for shape in leg.bodies_m.values() for place in shape]
    xs, ys = zip(*places, *(joint.place_m for joint in leg.joints.values()), strict=True)
    wide, tall = max(max(xs) - min(xs), 1.0e-6), max(max(ys) - min(ys), 1.0e-6)
    scale = min((_WIDEST - 2.0 * _MARGIN) / wide, (_TALLEST - 2.0 * _MARGIN) / tall)

    def at(place: Place) -> Place:
        """Convert from the plane of the leg [m], y upwards, to the drawing, y downwards."""
        x, y = _MARGIN + scale * (place[0] - min(xs)), _MARGIN + scale * (max(ys) - place[1])
        return round(x, 1), round(y, 1)

    def beside(view: JointView) -> Place:
        """Place of a joint; joints at the same place stand side by side."""
        here = leg.joints[view.joint].place_m
        there = [other.joint for other in drawn if _is_near(leg.joints[other.joint].place_m, here)]
        x, y = at(here)
        return x + _APART * (2.0 * there.index(view.joint) - len(there) + 1.0), y

    drawn = [view for view in views if view.joint in leg.joints]
    shown = {view.joint for view in views}
    bodies = sorted(leg.bodies_m.values(), key=_size, reverse=True)
    drawing = {
        "width": round(scale * wide + 2.0 * _MARGIN, 1),
        "height": round(scale * tall + 2.0 * _MARGIN, 1),
        "bodies": [[at(place) for place in shape] for shape in bodies],
        "supports": sorted({at(joint.place_m) for joint in leg.joints.values() if joint.is_on_ground}),
        "ideal": [at(joint.place_m) for name, joint in leg.joints.items() if name not in shown],
        "marks": [(view, *beside(view)) for view in drawn],
        "title": f"The leg {summary.monitor.mechanism} with joints {', '.join(view.joint for view in drawn)}",
    }
    return render("replay/leg.html", drawing=drawing)


def _size(shape: Sequence[Place]) -> float:
    return sum(max(place[k] for place in shape) - min(place[k] for place in shape) for k in (0, 1))


def _is_near(one: Place, other: Place) -> bool:
    return max(abs(one[0] - other[0]), abs(one[1] - other[1])) < _NEAR_M

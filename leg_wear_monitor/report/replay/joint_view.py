"""A clearance joint as the first screen shows it: only values that are valid."""

import attrs

from leg_wear_monitor.monitor.alarms.alarm import Level
from leg_wear_monitor.monitor.forecast.words import clearance_mm
from leg_wear_monitor.monitor.verdict.alarm_rules import OF_A_JOINT
from leg_wear_monitor.monitor.verdict.belief import SEEN, SOURCES
from leg_wear_monitor.monitor.verdict.verdict import Figure, State
from leg_wear_monitor.playback.result.condition import JointClearance, LifeHours
from leg_wear_monitor.playback.result.parts import ReplayAlarm
from leg_wear_monitor.playback.result.replay_summary import ReplaySummary
from leg_wear_monitor.report.replay.words import not_valid

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
    alarms : tuple of ReplayAlarm
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
    alarms: tuple[ReplayAlarm, ...]


def joint_views(summary: ReplaySummary) -> tuple[JointView, ...]:
    """All clearance joints."""
    return tuple(_view(summary, joint) for joint in summary.monitor.clearance_joints)


def _view(summary: ReplaySummary, joint: str) -> JointView:
    clearance, doubt = summary.clearances.get(joint), not_valid(summary.verdict, Figure.CLEARANCES)
    counted = clearance.counted_m if clearance and not doubt else None
    seen_m, seen_sigma_m, seen_by = _seen(clearance) if clearance else (None, None, "")
    shown = clearance.believed_m if clearance else None
    if shown is None:  # a file of an older version
        shown = seen_m if counted is None else counted
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
    if found is None or found.forecast is None:
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
    found = summary.joints.get(joint)
    return found.forecast.answer.value if found and found.forecast else "not known"


def _is_of(alarm: ReplayAlarm, joint: str) -> bool:
    return alarm.name in {f"{kind} {joint}" for kind in OF_A_JOINT}

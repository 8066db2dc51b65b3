"""Which clearance of a joint is believed, and by whom: all views and the clearance alarm draw from here."""

import math
from collections.abc import Sequence

import attrs

from leg_wear_monitor.monitor.alarms.alarm import Alarm, Level
from leg_wear_monitor.monitor.verdict.situation import JointSituation, SeenClearance
from leg_wear_monitor.monitor.verdict.words import amount, estimate

COUNTED, MEASURED, BOTH = "counted", "measured", "both"
SEEN = ("torque", "encoders")
SURE_SIGMAS = 2.0  # by which an estimated or measured clearance must be beyond its limit, or below it
SOURCES = {
    COUNTED: "counting",
    MEASURED: "a measurement",
    BOTH: "counting and measurements together",
    "torque": "the drive torque",
    "encoders": "the joint encoders",
}


@attrs.frozen
class BelievedClearance:
    """The one clearance of a joint.

    Attributes
    ----------
    clearance_m, sigma_m : float
        Mean radial clearance and its standard deviation; NaN if that is not known.
    by : str
        ``counted``, ``torque``, ``encoders``, ``measured``, or ``both`` for what counting and measurements
        give together.
    """

    clearance_m: float
    sigma_m: float
    by: str


def believed_words(one: BelievedClearance) -> str:
    """A believed clearance, such as ``2.05 mm ± 0.65 mm according to the drive torque``."""
    value = amount(one.clearance_m, "m")
    if not math.isnan(one.sigma_m):
        value = estimate(one.clearance_m, one.sigma_m, "m")
    return f"{value} according to {SOURCES[one.by]}"


def judged(joint: JointSituation) -> BelievedClearance:
    """The counted clearance, or a larger one by measurement: what somebody found on the leg counts."""
    found = [BelievedClearance(joint.counted_m, math.nan, COUNTED)]
    if joint.measured is not None:
        found.append(BelievedClearance(joint.measured.clearance_m, joint.measured.sigma_m, MEASURED))
    rests_on_it = joint.measured is not None and joint.is_measurement_used
    if rests_on_it or joint.believed_m >= joint.limit_m:  # never with NaN
        found.append(BelievedClearance(joint.believed_m, math.nan, BOTH))
    return max((one for one in found if not math.isnan(one.clearance_m)), key=lambda one: one.clearance_m)


def surely_at(limit_m: float, seen: Sequence[SeenClearance]) -> SeenClearance | None:
    """The surest of the estimates that are beyond a limit by `SURE_SIGMAS`; None without one."""
    found = [one for one in seen if one.clearance_m - SURE_SIGMAS * one.sigma_m >= limit_m]
    return min(found, key=lambda one: one.sigma_m, default=None)


def is_surely_below(limit_m: float, clearance_m: float, sigma_m: float) -> bool:
    """Whether a measured clearance contradicts that a joint is at its limit."""
    return clearance_m + SURE_SIGMAS * sigma_m < limit_m


def is_overruled(joint: JointSituation, alarm: Alarm | None) -> bool:
    """Whether a measurement contradicts the estimate that an alarm of the clearance rests on.

    The counted clearance is below the limit, too: a measurement does not end what counting says.
    It was acknowledged with the measurement, and rises again, not acknowledged, if the estimate returns
    below the limit and then passes it again.
    """
    if alarm is None or joint.measured is None or not alarm.acknowledged or alarm.cause not in SEEN:
        return False
    is_counted_below = not judged(joint).clearance_m >= joint.limit_m
    return is_counted_below and is_surely_below(
        joint.limit_m, joint.measured.clearance_m, joint.measured.sigma_m
    )


def at_limit_by_estimate(joint: JointSituation, alarm: Alarm | None) -> SeenClearance | None:
    """What encoders or the drive torque surely show at the limit, now or as the latched alarm keeps it."""
    if is_overruled(joint, alarm):
        return None
    now = surely_at(joint.limit_m, joint.seen)
    if now is None and alarm is not None and alarm.level is Level.ERROR and alarm.cause in SEEN:
        return SeenClearance(alarm.cause, alarm.worst, alarm.sigma)
    return now


def believed(joint: JointSituation, alarm: Alarm | None, is_counted_leg: bool) -> BelievedClearance | None:
    """The clearance that the verdict rests on; None where nothing known of the joint is valid.

    Parameters
    ----------
    joint : JointSituation
    alarm : Alarm or None
        That of the joint's clearance.
    is_counted_leg : bool
        Whether the verdict does not list the counted clearances as not valid.
    """
    known, estimate = judged(joint), at_limit_by_estimate(joint, alarm)
    if estimate is not None and estimate.clearance_m > known.clearance_m:
        return BelievedClearance(estimate.clearance_m, estimate.sigma_m, estimate.by)
    if is_counted_leg or known.clearance_m >= joint.limit_m:
        return known
    if joint.measured is not None:
        return BelievedClearance(joint.measured.clearance_m, joint.measured.sigma_m, MEASURED)
    if not joint.seen:
        return None
    best = min(joint.seen, key=lambda one: one.sigma_m)
    return BelievedClearance(best.clearance_m, best.sigma_m, best.by)


def alarm_value(joint: JointSituation, alarm: Alarm) -> BelievedClearance | None:
    """The clearance that its alarm is evaluated with at the end of a period; None to leave it as it is.

    A counted clearance is evaluated once a gait cycle instead, unless an estimate had raised the alarm.
    """
    known, sure = judged(joint), surely_at(joint.limit_m, joint.seen)
    if sure is not None and sure.clearance_m > known.clearance_m:
        return BelievedClearance(sure.clearance_m, sure.sigma_m, sure.by)
    if is_held_by_estimate(alarm):
        # what the torque said, only the torque takes back: a new run shows nothing for a while
        return None if is_overruled(joint, alarm) and not joint.seen else known
    return None if known.by == COUNTED else known


def is_held_by_estimate(alarm: Alarm) -> bool:
    """Whether an alarm of the clearance is present because of what encoders or the drive torque showed."""
    return alarm.present is not Level.OK and alarm.cause in SEEN

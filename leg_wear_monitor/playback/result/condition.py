"""Condition of the leg after a replay: clearance of each joint as counted and as seen, remaining life."""

import attrs

from leg_wear_monitor.monitor.forecast.forecast import Quantiles


@attrs.frozen(kw_only=True)
class JointClearance:
    """Mean radial clearance of a joint [m]; None for what is not known.

    Attributes
    ----------
    counted_m : float
        Clearance when new, plus the wear counted since.
    seen_m : float or None
        Clearance that measurements of the gait show.
    seen_sigma_m : float or None
        Its standard deviation.
    seen_by : tuple of str
        What shows it, such as ``encoders``.
    new_m : float
        Clearance when new.
    limit_m : float
        Limit of the clearance.
    measured_m : float or None
        Clearance that somebody measured last on this part.
    measured_sigma_m : float or None
        Its standard deviation.
    believed_m : float or None
        The clearance that the verdict rests on; None where nothing known of the joint is valid.
    believed_sigma_m : float or None
        Its standard deviation.
    believed_by : str or None
        Whose it is: ``counted``, ``torque``, ``encoders``, ``measured``, or ``both`` for what counting and
        measurements give together.
    """

    counted_m: float
    seen_m: float | None = None
    seen_sigma_m: float | None = None
    seen_by: tuple[str, ...] = ()
    new_m: float
    limit_m: float
    measured_m: float | None = None
    measured_sigma_m: float | None = None
    believed_m: float | None = None
    believed_sigma_m: float | None = None
    believed_by: str | None = None


@attrs.frozen(kw_only=True)
class LifeHours:
    """Remaining hours of walking, as quantiles.

    Attributes
    ----------
    p10_h : float
        Hours that are not exceeded with a probability of 10 %.
    p50_h : float
        Hours that are not exceeded with a probability of 50 %.
    p90_h : float
        Hours that are not exceeded with a probability of 90 %.
    """

    p10_h: float
    p50_h: float
    p90_h: float


def life_hours(hours: Quantiles | None) -> LifeHours | None:
    """Quantiles of a remaining life; None if it is not known."""
    return None if hours is None else LifeHours(p10_h=hours.p10, p50_h=hours.p50, p90_h=hours.p90)

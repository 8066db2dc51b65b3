"""The leg after a replay: joints, remaining life, alarms, status; SI units, None for what is not known."""

from collections.abc import Mapping
from typing import Any

import attrs

from leg_wear_monitor.json_text import finite_or_none
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.materials.load import BushingLoad
from leg_wear_monitor.monitor.alarms.alarm import Level
from leg_wear_monitor.monitor.encoders.clearance_estimate import ClearanceObservation
from leg_wear_monitor.monitor.forecast.forecast import Answer, JointForecast, Quantiles


def _known_values(values: Mapping[str, float | None]) -> dict[str, float | None]:
    return {name: finite_or_none(value) for name, value in values.items()}


def _perhaps() -> Any:
    """Attrs field for a number that may not be known: NaN and infinity become None."""
    return attrs.field(converter=finite_or_none)


def _perhaps_none() -> Any:
    """The same for a number that files of older versions do not have."""
    return attrs.field(default=None, converter=finite_or_none)


@attrs.frozen
class ClearanceChange:
    """Radial clearance of a joint, as counted [m].

    Attributes
    ----------
    first : float
        Mean around the bushing after the first gait cycle.
    last : float
        Mean around the bushing after the last gait cycle.
    max : float
        Largest around the bushing at the end.
    """

    first: float
    last: float
    max: float


@attrs.frozen(kw_only=True)
class SeenClearance:
    """A clearance estimated from further encoders; see `monitor.encoders.ClearanceEstimate`.

    Attributes
    ----------
    observation : ClearanceObservation
        Whether the encoders show it, and why not.
    clearance_m : float or None
        The estimate.
    sigma_m : float or None
        Its standard deviation.
    departure_m : float or None
        Estimated minus counted clearance.
    believed : bool
        Whether the forecast uses it.
    is_other : bool
        Whether the difference is significant.
    """

    observation: ClearanceObservation
    clearance_m: float | None = _perhaps()
    sigma_m: float | None = _perhaps()
    departure_m: float | None = _perhaps()
    believed: bool
    is_other: bool


@attrs.frozen(kw_only=True)
class ReplayJoint:
    """A clearance joint at the end of a replay, and its forces meanwhile.

    Attributes
    ----------
    clearance_m : ClearanceChange
        As counted: the clearance when new plus the wear counted since.
    growth_m_per_cycle : float or None
        Growth of the mean clearance in a gait cycle; None while there is not enough data.
    growth_error_m_per_cycle : float or None
        Standard deviation of its error.
    growth_mps : float or None
        Growth of the mean clearance per second of walking.
    forecast : JointForecast or None
        Remaining life; None before the first forecast.
    peak_force_n : float or None
        Largest contact force.
    mean_force_n : float or None
        Mean contact force over all gait cycles.
    seen : SeenClearance or None
        Clearance that further encoders show; None without such encoders.
    impacts : int
        Number of impacts, in the gait cycles that were followed.
    load : BushingLoad or None
        Pressure and sliding speed in the last gait cycle, and the limits of the joint's material; None in a
        file of an older version.
    sampling_sigma_m : float
        Standard deviation of the mean clearance, because sampled replays did not follow all gait cycles.
    believed_m : float or None
        The clearance that the verdict rests on, at the end, as in ``clearances``; None where nothing known
        of the joint is valid.
    believed_sigma_m : float or None
        Its standard deviation.
    believed_by : str or None
        Whose it is, such as ``counted`` or ``torque``.
    """

    clearance_m: ClearanceChange
    growth_m_per_cycle: float | None = _perhaps()
    growth_error_m_per_cycle: float | None = _perhaps()
    growth_mps: float | None = _perhaps()
    forecast: JointForecast | None
    peak_force_n: float | None = _perhaps()
    mean_force_n: float | None = _perhaps()
    seen: SeenClearance | None = None
    impacts: int
    load: BushingLoad | None = None
    sampling_sigma_m: float = 0.0
    believed_m: float | None = _perhaps_none()
    believed_sigma_m: float | None = _perhaps_none()
    believed_by: str | None = None


@attrs.frozen(kw_only=True)
class LegLife:
    """The leg's remaining life: until the first of its joints reaches its limit.

    Attributes
    ----------
    answer : Answer
        What can be said of it.
    cycles : Quantiles or None
        Gait cycles; None unless known.
    hours : Quantiles or None
        Hours of walking; None unless known.
    days : Quantiles or None
        Days at the usual duty; None unless known.
    first_probability : dict of str to float
        Probability that this joint is the first; empty unless known.
    simulated_lives : int
        Number of simulated lives, which show the effect of joints on each other.
    first : str or None
        The joint that is most likely the first.
    """

    answer: Answer
    cycles: Quantiles | None
    hours: Quantiles | None
    days: Quantiles | None
    first_probability: dict[str, float]
    simulated_lives: int
    first: str | None


@attrs.frozen(kw_only=True)
class ReplayAlarm:
    """An alarm as operators see it.

    Attributes
    ----------
    name : str
        Kind and subject, such as ``clearance A``.
    level : Level
        Level that is shown; a latched alarm keeps its highest one.
    state : str
        Whether it is present or latched, and acknowledged.
    value : float or None
        Last value, in ``unit``.
    limit : float or None
        Limit of the level ERROR, in ``unit``.
    worst : float or None
        Worst value since it was raised, in ``unit``.
    unit : str
        Unit of the values, SI; empty for a fraction.
    raised_ns : int
        Stamp at which the level last rose [ns]; 0 before.
    """

    name: str
    level: Level
    state: str
    value: float | None = _perhaps()
    limit: float | None = _perhaps()
    unit: str
    worst: float | None = _perhaps()
    raised_ns: int


@attrs.frozen(kw_only=True)
class AlarmChange:
    """An alarm after a change.

    Attributes
    ----------
    stamp_ns : int
        Stamp of the change [ns].
    alarm : ReplayAlarm
        The alarm then.
    """

    stamp_ns: int
    alarm: ReplayAlarm = attrs.field(metadata={"flat": True})


@attrs.frozen(kw_only=True)
class ReplayAlarms:
    """All alarms.

    Attributes
    ----------
    now : tuple of ReplayAlarm
        All of them, at the end.
    changes : tuple of AlarmChange
        The first ten thousand changes.
    """

    now: tuple[ReplayAlarm, ...]
    changes: tuple[AlarmChange, ...]


@attrs.frozen(kw_only=True)
class ReplayStatus:
    """A line of /diagnostics at the end.

    Attributes
    ----------
    name : str
        Name of the status, such as ``joint A``.
    level : Level
        Level of the status.
    message : str
        The status in words.
    values : dict of str to float or None
        Values of the status; each key ends in its unit.
    fault_code : str
        Stable name of what is wrong; empty in a file of an older version.
    """

    name: str
    level: Level
    message: str
    values: dict[str, float | None] = attrs.field(converter=_known_values)
    fault_code: str = ""


@attrs.frozen(eq=False)
class WornDepth:
    """Wear depth (N,) [m] around both surfaces of a joint, by sector.

    Attributes
    ----------
    bushing : (N,) array
        By sector of the bushing's frame, the first one from angle 0 on.
    journal : (N,) array
        By sector of the journal's frame.
    """

    bushing: Floats
    journal: Floats

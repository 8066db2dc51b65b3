"""The leg after a replay: joints, remaining life, alarms, status; SI units, None for what is not known."""

import math
from collections.abc import Mapping
from typing import Any

import attrs

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.alarms.alarm import Level
from leg_wear_monitor.monitor.encoders.clearance_estimate import ClearanceObservation
from leg_wear_monitor.monitor.forecast.forecast import Answer, JointForecast, Quantiles


def _known(value: float | None) -> float | None:
    return None if value is None or not math.isfinite(value) else float(value)


def _known_values(values: Mapping[str, float | None]) -> dict[str, float | None]:
    return {name: _known(value) for name, value in values.items()}


def _perhaps() -> Any:
    """Attrs field for a number that may not be known: NaN and infinity become None."""
    return attrs.field(converter=_known)


@attrs.frozen
class ClearanceChange:
    """Mean radial clearance [m] after the first and the last gait cycle, and its largest value at the end."""

    first: float
    last: float
    max: float


@attrs.frozen(kw_only=True)
class SeenClearance:
    """A clearance estimated from further encoders; see `monitor.encoders.ClearanceEstimate`.

    Attributes
    ----------
    observation : ClearanceObservation
    clearance_m, sigma_m, departure_m : float or None
        Clearance, its standard deviation, and its difference from the counted one.
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
    growth_m_per_cycle, growth_error_m_per_cycle, growth_mps : float or None
        Growth of the mean clearance a gait cycle, the standard deviation of what it may be off, and growth
        per second of walking.
    forecast : JointForecast or None
    peak_force_n, mean_force_n : float or None
        Largest contact force, and the mean over all gait cycles.
    seen : SeenClearance or None
        None without further encoders.
    impacts : int
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


@attrs.frozen(kw_only=True)
class LegLife:
    """The leg's remaining life: until the first of its joints reaches its limit.

    Attributes
    ----------
    answer : Answer
    cycles, hours, days : Quantiles or None
        Gait cycles, hours of walking and days at the usual duty; None unless known.
    first_probability : dict of str to float
        With which each joint is the first; empty unless known.
    simulated_lives : int
        That tell how joints act upon each other.
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
    level : Level
    state : str
        Whether it is present or latched, and acknowledged.
    value, limit, worst : float or None
        Last value, limit of ERROR and worst value since it was raised [unit].
    unit : str
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
    """An alarm after a change at a stamp [ns]."""

    stamp_ns: int
    alarm: ReplayAlarm = attrs.field(metadata={"flat": True})


@attrs.frozen(kw_only=True)
class ReplayAlarms:
    """All alarms at the end (``now``), and the first ten thousand changes."""

    now: tuple[ReplayAlarm, ...]
    changes: tuple[AlarmChange, ...]


@attrs.frozen(kw_only=True)
class ReplayStatus:
    """A line of /diagnostics at the end; the keys of ``values`` end in their unit.

    ``fault_code`` is a stable name of what is wrong; empty in a file of an older version.
    """

    name: str
    level: Level
    message: str
    values: dict[str, float | None] = attrs.field(converter=_known_values)
    fault_code: str = ""


@attrs.frozen(eq=False)
class WornDepth:
    """Wear depth (N,) [m] around a joint's bushing and journal, by sector of their own frames."""

    bushing: Floats
    journal: Floats

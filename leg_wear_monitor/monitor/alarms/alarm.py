"""Alarms as a state machine: levels with a deadband and an on-delay, latched until acknowledged.

An alarm of silence is not latched: when data return, nothing is left to look at but its row in the history.

Everything here is a pure function of (alarm, value, limit). A value is evaluated once per gait cycle, so the
on-delay counts gait cycles.
"""

import math
from enum import IntEnum

import attrs


class Level(IntEnum):
    """Level of an alarm; numbers as in diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2


@attrs.frozen
class Limit:
    """Limits of the levels of an alarm.

    Attributes
    ----------
    warn, error : float
        A value at a limit or beyond has reached its level.
    deadband : float
        Fraction of a limit by which a value must have returned before the level falls.
    on_delay : int
        Gait cycles in a row for which a value must be beyond before the level rises; 1: at once.
    is_least : bool
        Whether the limits are lower bounds: values below them are faults.
    is_latched : bool
        Whether a level that was shown stays until it is acknowledged.
    """

    warn: float
    error: float
    deadband: float = 0.0
    on_delay: int = 1
    is_least: bool = False
    is_latched: bool = True

    def times(self, factor: float) -> "Limit":
        """The limits, multiplied."""
        return attrs.evolve(self, warn=factor * self.warn, error=factor * self.error)

    def reaches(self, value: float, level: Level) -> bool:
        """Whether a value is at the limit of WARN or ERROR, or beyond it."""
        limit = self.error if level is Level.ERROR else self.warn
        return value <= limit if self.is_least else value >= limit

    def leaves(self, value: float, level: Level) -> bool:
        """Whether a value is back from the limit of WARN or ERROR by more than the deadband."""
        limit = self.error if level is Level.ERROR else self.warn
        if self.is_least:
            return value > limit * (1.0 + self.deadband)
        return value < limit * (1.0 - self.deadband)


@attrs.frozen(kw_only=True)
class Alarm:
    """State of an alarm.

    Attributes
    ----------
    kind : str
        Monitored quantity, such as ``clearance``.
    subject : str
        Joint or input; empty if there is only one.
    unit : str
        Unit of value and limit.
    present : Level
        Level of the present value, with deadband and on-delay.
    level : Level
        Shown level: the highest present level since the last acknowledgement.
    acknowledged : bool
        Whether an operator has acknowledged it at this level.
    value : float
        Last evaluated value; NaN before.
    limit : float
        Limit of ERROR in the last evaluation; NaN before.
    raised_ns : int
        Stamp at which the level last rose; 0 before.
    worst : float
        The worst value since it was raised; NaN while its level is OK. Of estimates, which have a standard
        deviation, the last one at this level: it rests on most, and the largest of many is too large.
    sigma : float
        Standard deviation of `worst`; NaN if it is not known.
    cause : str
        Source or cause of `worst` as it was known then, such as ``torque``; a value without one keeps it.
    beyond : tuple of int
        Number of gait cycles in a row with the value beyond the limits of WARN and ERROR.
    """

    kind: str
    subject: str = ""
    unit: str = ""
    present: Level = Level.OK
    level: Level = Level.OK
    acknowledged: bool = False
    value: float = math.nan
    limit: float = math.nan
    raised_ns: int = 0
    worst: float = math.nan
    sigma: float = math.nan
    cause: str = ""
    beyond: tuple[int, int] = (0, 0)

    @property
    def name(self) -> str:
        """Stable name without values, such as ``clearance A``."""
        return f"{self.kind} {self.subject}".rstrip()


def next_level(
    level: Level, value: float, limit: Limit, beyond: tuple[int, int], cycles: int = 1
) -> tuple[Level, tuple[int, int]]:
    """Level after a value, and the numbers of gait cycles with values beyond WARN and ERROR.

    Parameters
    ----------
    level : Level
        Previous level.
    value : float
        Not NaN.
    limit : Limit
    beyond : tuple of int
        As returned by the previous call, (0, 0) at first.
    cycles : int
        Gait cycles the value stands for.
    """
    beyond_warn, beyond_error = (
        before + cycles if limit.reaches(value, at) else 0
        for before, at in zip(beyond, (Level.WARN, Level.ERROR), strict=True)
    )
    beyond = (beyond_warn, beyond_error)
    if beyond_error >= limit.on_delay or (level is Level.ERROR and not limit.leaves(value, Level.ERROR)):
        return Level.ERROR, beyond
    if beyond_warn >= limit.on_delay or (level is not Level.OK and not limit.leaves(value, Level.WARN)):
        return Level.WARN, beyond
    return Level.OK, beyond


def evaluated(
    alarm: Alarm,
    value: float,
    limit: Limit,
    stamp_ns: int,
    cycles: int = 1,
    sigma: float = math.nan,
    cause: str = "",
) -> Alarm:
    """Alarm after a value; NaN leaves the alarm unchanged.

    Parameters
    ----------
    alarm : Alarm
    value : float
        In the alarm's unit.
    limit : Limit
    stamp_ns : int
        Stamp of the value.
    cycles : int
        Gait cycles the value stands for.
    sigma : float
        Standard deviation of the value.
    cause : str
        Source or cause of the value; empty if it is not known.
    """
    if math.isnan(value):
        return alarm
    present, beyond = next_level(alarm.present, value, limit, alarm.beyond, cycles)
    level, is_acknowledged, raised_ns = alarm.level, alarm.acknowledged, alarm.raised_ns
    if present > level:
        level, is_acknowledged, raised_ns = present, False, stamp_ns
    elif (is_acknowledged or not limit.is_latched) and present < level:
        level, is_acknowledged = present, is_acknowledged and present is not Level.OK
    is_estimate = not math.isnan(sigma) and present is level is not Level.OK
    worst = value if is_estimate else _worst(level, alarm.worst, value, limit)
    if level is Level.OK:
        sigma, cause = math.nan, ""
    elif worst == alarm.worst and not is_estimate:  # what was known of the worst value stays with it
        sigma, cause = alarm.sigma, alarm.cause or cause
    return Alarm(  # all fields: `attrs.evolve` takes several times as long, for each value of each period
        kind=alarm.kind,
        subject=alarm.subject,
        unit=alarm.unit,
        present=present,
        level=level,
        acknowledged=is_acknowledged,
        value=value,
        limit=limit.error,
        raised_ns=raised_ns,
        worst=worst,
        sigma=sigma,
        cause=cause or (alarm.cause if level is not Level.OK else ""),
        beyond=beyond,
    )


def _worst(level: Level, worst: float, value: float, limit: Limit) -> float:
    """The worst value of an alarm since it was raised; NaN while its level is OK."""
    if level is Level.OK:
        return math.nan
    if math.isnan(worst):
        return value
    return min(worst, value) if limit.is_least else max(worst, value)


def acknowledged(alarm: Alarm) -> Alarm:
    """Alarm after an acknowledgement: cleared if it has returned to normal, marked if not."""
    if alarm.level is Level.OK:
        return alarm
    if alarm.present is Level.OK:
        return attrs.evolve(
            alarm, level=Level.OK, acknowledged=False, worst=math.nan, sigma=math.nan, cause=""
        )
    return attrs.evolve(alarm, level=alarm.present, acknowledged=True)


def cleared(alarm: Alarm) -> Alarm:
    """Alarm of a part that is not there any more: as new."""
    return Alarm(kind=alarm.kind, subject=alarm.subject, unit=alarm.unit)


def has_changed(before: Alarm, after: Alarm) -> bool:
    """Whether the state shown to operators has changed: level, presence or acknowledgement."""
    return (before.level, before.present, before.acknowledged) != (
        after.level,
        after.present,
        after.acknowledged,
    )

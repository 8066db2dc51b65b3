"""Alarms as a state machine: levels with a deadband and an on-delay, latched until acknowledged.

Everything here is a pure function of (alarm, value, limit). A value is judged once a gait cycle, so the
on-delay counts gait cycles.
"""

import math
from enum import IntEnum

import attrs


class Level(IntEnum):
    """How bad it is; numbers as in diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2


@attrs.frozen
class Limit:
    """Where the levels of an alarm begin.

    Attributes
    ----------
    warn, error : float
        A value at one of them or beyond has reached its level.
    deadband : float
        Share of a limit by which a value must have come back before the level falls.
    on_delay : int
        Gait cycles in a row for which a value must be beyond before the level rises; 1: at once.
    is_least : bool
        Whether values below the limits are the bad ones.
    """

    warn: float
    error: float
    deadband: float = 0.0
    on_delay: int = 1
    is_least: bool = False

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
    """An alarm as it stands.

    Attributes
    ----------
    kind : str
        What it is about, such as ``clearance``.
    subject : str
        Which joint or which input; empty where there is only one.
    unit : str
        Of value and limit.
    present : Level
        What the value is now, deadband and on-delay considered.
    level : Level
        What is shown: the highest that was present since it was last acknowledged.
    acknowledged : bool
        Whether somebody has seen it at this level.
    value : float
        As it was last judged; NaN before.
    limit : float
        The limit of ERROR it was judged against; NaN before.
    raised_ns : int
        When the level was last raised; 0 before.
    worst : float
        The worst value since it was raised; NaN while its level is OK.
    beyond : tuple of int
        For how many gait cycles in a row the value has been beyond the limits of WARN and ERROR.
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
    beyond: tuple[int, int] = (0, 0)

    @property
    def name(self) -> str:
        """Stable and free of values, such as ``clearance A``."""
        return f"{self.kind} {self.subject}".rstrip()


def next_level(
    level: Level, value: float, limit: Limit, beyond: tuple[int, int], cycles: int = 1
) -> tuple[Level, tuple[int, int]]:
    """Level after a value, and for how many gait cycles it has been beyond WARN and ERROR.

    Parameters
    ----------
    level : Level
        Before.
    value : float
        Not NaN.
    limit : Limit
    beyond : tuple of int
        As returned the last time, (0, 0) at first.
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


def evaluated(alarm: Alarm, value: float, limit: Limit, stamp_ns: int, cycles: int = 1) -> Alarm:
    """Alarm after a value; one that is NaN says nothing and leaves the alarm as it is.

    Parameters
    ----------
    alarm : Alarm
    value : float
        In the alarm's unit.
    limit : Limit
    stamp_ns : int
        When it was so.
    cycles : int
        Gait cycles the value stands for.
    """
    if math.isnan(value):
        return alarm
    present, beyond = next_level(alarm.present, value, limit, alarm.beyond, cycles)
    alarm = attrs.evolve(alarm, present=present, value=value, limit=limit.error, beyond=beyond)
    if present > alarm.level:
        alarm = attrs.evolve(alarm, level=present, acknowledged=False, raised_ns=stamp_ns)
    elif alarm.acknowledged and present < alarm.level:
        alarm = attrs.evolve(alarm, level=present, acknowledged=present is not Level.OK)
    return attrs.evolve(alarm, worst=_worst(alarm, value, limit))


def _worst(alarm: Alarm, value: float, limit: Limit) -> float:
    """The worst value of an alarm since it was raised; NaN while its level is OK."""
    if alarm.level is Level.OK:
        return math.nan
    if math.isnan(alarm.worst):
        return value
    return min(alarm.worst, value) if limit.is_least else max(alarm.worst, value)


def acknowledged(alarm: Alarm) -> Alarm:
    """Alarm after somebody has seen it: cleared if it has returned to normal, marked if not."""
    if alarm.level is Level.OK:
        return alarm
    if alarm.present is Level.OK:
        return attrs.evolve(alarm, level=Level.OK, acknowledged=False, worst=math.nan)
    return attrs.evolve(alarm, level=alarm.present, acknowledged=True)


def has_changed(before: Alarm, after: Alarm) -> bool:
    """Whether what people see of an alarm has changed: its level, presence or acknowledgement."""
    return (before.level, before.present, before.acknowledged) != (
        after.level,
        after.present,
        after.acknowledged,
    )

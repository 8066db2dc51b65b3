"""Alarms: levels, limits and latches, their codes, words, and the guide of each."""

import math
import re
from collections.abc import Iterable
from datetime import UTC, datetime
from functools import cache
from operator import attrgetter

import attrs

from leg_wear_monitor.estimate.cause import Cause
from leg_wear_monitor.files import share_directory
from leg_wear_monitor.state import LegAlarm, Level

# Alarms as a state machine: levels with a deadband and an on-delay, latched until acknowledged.
#
# An alarm of silence is not latched: when data return, nothing is left to look at but its row in the history.
#
# Everything here is a pure function of (alarm, value, limit). A value is evaluated once per gait cycle, so
# the on-delay counts gait cycles.


WARN_FRACTION = 0.8  # WARN begins at this fraction of a limit: time to order a part


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
        True if the limits are lower bounds: values below them are faults.
    is_latched : bool
        True if a level that was shown stays until it is acknowledged.
    far : float
        A value beyond so many times a limit raises the level at once.
    """

    warn: float
    error: float
    deadband: float = 0.0
    on_delay: int = 1
    is_least: bool = False
    is_latched: bool = True
    far: float = math.inf

    def times(self, factor: float) -> "Limit":
        """The limits, multiplied."""
        return attrs.evolve(self, warn=factor * self.warn, error=factor * self.error)

    def reaches(self, value: float, level: Level) -> bool:
        """True if a value is at the limit of WARN or ERROR, or beyond it."""
        limit = self.error if level is Level.ERROR else self.warn
        return value <= limit if self.is_least else value >= limit

    def is_far(self, value: float, level: Level) -> bool:
        """True if a value is so far beyond the limit of WARN or ERROR that it raises the level at once."""
        limit = self.error if level is Level.ERROR else self.warn
        return not self.is_least and value > self.far * limit

    def leaves(self, value: float, level: Level) -> bool:
        """True if a value is back from the limit of WARN or ERROR by more than the deadband."""
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
        True if an operator has acknowledged it at this level.
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
    level: Level, value: float, limit: Limit, beyond: tuple[int, int], cycles: int
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
        Number of gait cycles of the value.
    """
    beyond_warn, beyond_error = (
        before + (limit.on_delay if limit.is_far(value, at) else cycles) if limit.reaches(value, at) else 0
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
        Number of gait cycles of the value.
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
    elif worst == alarm.worst and not is_estimate:  # sigma and cause of the worst value stay with it
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


_SHOWN_STATE = attrgetter("level", "present", "acknowledged")


def has_changed(before: Alarm, after: Alarm) -> bool:
    """True if the state shown to operators has changed: level, presence or acknowledgement."""
    return _SHOWN_STATE(before) != _SHOWN_STATE(after)


# Stable fault codes, one with each status: codes of alarms, and codes of the parts of a monitor.
#
# A status of the verdict has the code of its rule (`verdict.rules`), which is the code of a cause
# (`estimate.cause`) if there is one.


NO_FAULT = "NONE"
INPUT_SILENCE, TRACKING_LOST, CRANK_ZERO = "INPUT_SILENCE", "TRACKING_LOST", "CRANK_ZERO"
ENCODERS, DIAGNOSIS = "ENCODERS", "DIAGNOSIS"
LEDGER_NOT_WRITTEN, LEDGER_INTERRUPTED = "LEDGER_NOT_WRITTEN", "LEDGER_INTERRUPTED"
SAMPLES_DROPPED, SAMPLES_NOT_PUBLISHED = "SAMPLES_DROPPED", "SAMPLES_NOT_PUBLISHED"
TOPICS, RECORDING_STOPPED = "TOPICS", "RECORDING_STOPPED"
CLOCK_MISSING, CLOCK_STOPPED, CLOCK_SET_BACK = "CLOCK_MISSING", "CLOCK_STOPPED", "CLOCK_SET_BACK"
STAMPS_AHEAD, ALREADY_COUNTED = "STAMPS_AHEAD", "ALREADY_COUNTED"

GAPS, STUCK, ZERO, SCALE, EXCHANGED, SIGN = (
    "input_gaps", "foot_load_stuck", "foot_load_zero", "foot_load_scale", "foot_load_exchanged",
    "foot_load_sign",
)  # fmt: skip
"""Kinds of the alarms of the foot load's sensor; their values have these names."""
FOOT_LOAD_LIMITS = {GAPS: 0.05, STUCK: 0.9, ZERO: 0.1, SCALE: 3.0, EXCHANGED: 0.5, SIGN: 0.5}

BIAS, LAG = "torque_bias", "torque_lag"
CAUSES_OF_ALARMS = {BIAS: Cause.BIAS, LAG: Cause.TIMING}
"""Causes that have a limit of their own, by the alarm."""


def joint_of(name: str) -> str:
    """Joint of an alarm with a name such as ``clearance A``; empty for one of the leg or an input."""
    kind, _, subject = name.partition(" ")
    return "" if kind.startswith(("input_", "stamps_")) else subject


def code_of(alarm: Alarm) -> str:
    """Code of a raised alarm, such as ``CLEARANCE_A``; NONE for any other alarm."""
    return alarm.name.upper().replace(" ", "_") if alarm.level is not Level.OK else NO_FAULT


def worst_code(alarms: Iterable[Alarm]) -> str:
    """Code of the first of the most severe alarms; NONE if none is raised."""
    found = sorted(alarms, key=lambda alarm: -alarm.level)
    return code_of(found[0]) if found else NO_FAULT


# The page of the how-to guides for each fault code, so that a message leads to the next action.


FOLDER = "docs/howto/verdict"
_CODE = re.compile(r"/reference/codes\.md#(\w+)\)")


@cache
def _guides() -> dict[str, str]:
    """Path of the page of each code, which is the page that links the code."""
    pages = sorted((share_directory() / FOLDER).glob("*.md"))
    links = ((page, _CODE.findall(page.read_text(encoding="utf-8"))) for page in pages)
    return {code.upper(): f"{FOLDER}/{page.name}" for page, codes in links for code in codes}


def guide_of(code: str) -> str:
    """Path of a code's page below the share directory; the overview for an unknown code.

    Parameters
    ----------
    code : str
        Without joints: ``CLEARANCE_DETECTED``, not ``CLEARANCE_DETECTED_G``.
    """
    return _guides().get(code, f"{FOLDER}/index.md")


# Human-readable texts of an alarm: its state, its worst value, its start.


_ROUNDING = 1.0e-12  # a smaller value is a rounding error
_FIRST_DATE_S = 1.0e8  # a smaller stamp is from a clock that began at zero
_SHOWN = {"m": (1.0e3, "mm"), "m/h": (1.0e6, "µm/h"), "s": (1.0e3, "ms"), "rad": (1.0e3, "mrad")}

ADVICE = "The monitor advises. The absence of an alarm does not mean the joints are healthy."


def state_of(alarm: Alarm) -> str:
    """An alarm's state, without values."""
    if alarm.level is Level.OK:
        return "OK"
    present = "present" if alarm.present is alarm.level else "latched"
    return f"{present}, acknowledged" if alarm.acknowledged else present


def leg_alarm(alarm: Alarm) -> LegAlarm:
    """An alarm as operators see it."""
    return LegAlarm(
        name=alarm.name,
        level=alarm.level,
        state=state_of(alarm),
        value=alarm.value,
        limit=alarm.limit,
        unit=alarm.unit,
        worst=alarm.worst,
        raised_ns=alarm.raised_ns,
    )


_LAST = {"torque": "last estimate", "encoders": "last estimate", "measured": "last measured"}


def raised_values(
    state: str, worst: float | None, limit: float | None, unit: str, by: str | None = None
) -> str:
    """State and values of a raised alarm, such as ``latched, worst 0.42, limit 0.05``.

    Parameters
    ----------
    state : str
        As returned by `state_of`.
    worst, limit : float or None
        None or NaN if unknown, as for an alarm from an older ledger.
    unit : str
    by : str, optional
        Source of a clearance: of estimates and measurements, the last one is kept, not the worst.
    """
    words = [state]
    for name, value in ((_LAST.get(by or "", "worst"), worst), ("limit", limit)):
        if value is not None and not math.isnan(value):
            words.append(f"{name} {amount(value, unit)}")
    return ", ".join(words)


def duration(seconds: float) -> str:
    """A time in a unit that suits it."""
    if seconds < 120.0:
        return f"{seconds:.3g} s"
    return f"{seconds / 60.0:.3g} min" if seconds < 7200.0 else f"{seconds / 3600.0:.3g} h"


def time_words(stamp_ns: int) -> str:
    """A stamp as date and time, or as seconds if its clock began at zero."""
    seconds = stamp_ns / 1.0e9
    if seconds < _FIRST_DATE_S:
        return f"{seconds:.3f} s"
    return datetime.fromtimestamp(seconds, UTC).strftime("%Y-%m-%d %H:%M:%S UTC")


def amount(value: float, unit: str) -> str:
    """A value [SI] with its unit, such as ``0.62 mm``; a fraction has none."""
    factor, shown = _SHOWN.get(unit, (1.0, unit))
    if unit == "s" and abs(value) >= 1.0:
        units = ((86400.0, "days"), (3600.0, "h"), (60.0, "min"))
        size, shown = next(((one, name) for one, name in units if abs(value) >= 2.0 * one), (1.0, unit))
        factor = 1.0 / size
    return f"{_digits(factor * value)} {shown}".rstrip()


def _digits(value: float) -> str:
    if math.isnan(value):
        return "unknown"
    if abs(value) < _ROUNDING:
        return "0"  # without the sign or the exponent of a rounding error
    return f"{value:.0f}" if 999.5 <= abs(value) < 1.0e6 else f"{value:.3g}"

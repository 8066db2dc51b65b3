"""Human-readable texts of an alarm: its state, its worst value, its start."""

import math
from datetime import UTC, datetime

from leg_wear_monitor.monitor.alarms.alarm import Alarm, Level

_FIRST_DATE_S = 1.0e8  # a smaller stamp is from a clock that began at zero

ADVICE = "The monitor advises. The absence of an alarm does not mean the joints are healthy."


def state_of(alarm: Alarm) -> str:
    """An alarm's state, without values."""
    if alarm.level is Level.OK:
        return "OK"
    present = "present" if alarm.present is alarm.level else "latched"
    return f"{present}, acknowledged" if alarm.acknowledged else present


def raised_words(state: str, worst: float | None, limit: float | None, unit: str, raised_ns: int) -> str:
    """Description of a raised alarm, such as ``latched, worst 0.42, limit 0.05, since ...``.

    Parameters
    ----------
    state : str
        As returned by `state_of`.
    worst, limit : float or None
        None or NaN if unknown, as for an alarm from an older ledger.
    unit : str
    raised_ns : int
        Stamp at which it was raised.
    """
    words = [state]
    for name, value in (("worst", worst), ("limit", limit)):
        if value is not None and not math.isnan(value):
            words.append(f"{name} {_three_digits(value)} {unit}".rstrip())
    return ", ".join([*words, f"since {time_words(raised_ns)}"])


def time_words(stamp_ns: int) -> str:
    """A stamp as date and time, or as seconds if its clock began at zero."""
    seconds = stamp_ns / 1.0e9
    if seconds < _FIRST_DATE_S:
        return f"{seconds:.3f} s"
    return datetime.fromtimestamp(seconds, UTC).strftime("%Y-%m-%d %H:%M:%S UTC")


def _three_digits(value: float) -> str:
    """Three digits; whole numbers as they are."""
    return f"{value:.0f}" if 1000.0 <= abs(value) < 1.0e6 else f"{value:.3g}"

"""Causes of a deviating drive torque in words: one sentence and one remedy per cause."""

import math

from leg_wear_monitor.estimate.cause import Cause, Change, NamedCause, TorqueExplanation
from leg_wear_monitor.monitor.alarms import amount
from leg_wear_monitor.monitor.diagnosis.state import Diagnosis
from leg_wear_monitor.monitor.verdict.table import words_of_cause
from leg_wear_monitor.monitor.verdict.verdict import estimate
from leg_wear_monitor.state import Evidence

# grease is stiff in the cold, and a warm motor has less torque
_WITH_TEMPERATURE = (Cause.FRICTION, Cause.LOAD_FRICTION, Cause.SCALE)
_SURE = 3.0  # standard deviations
_MOST = 3  # alternatives in words


def sentence(one: NamedCause, found: Diagnosis | None = None) -> str:
    """A cause other than a clearance, with its value; with the temperatures of a diagnosis if they matter.

    Parameters
    ----------
    one : NamedCause
    found : Diagnosis, optional
        Gives the temperature of the drive now, and when the leg was commissioned.
    """
    row = words_of_cause(one.cause)
    words = row.why.format(
        value=estimate(one.value, one.sigma, row.unit),
        size=estimate(abs(one.value), one.sigma, row.unit),
        percent=estimate(100.0 * abs(one.value), 100.0 * one.sigma, "%"),
        subject=one.subject,
        way=row.ways[one.value > 0.0],
    )
    if isinstance(one, Change) and one.cause is Cause.NOISE:
        words += f" instead of {amount(one.counted, row.unit)}"
    if found is None or one.cause not in _WITH_TEMPERATURE:
        return words
    now, then = found.temperature_c, found.commissioned_c
    if now is None or then is None:
        return words
    return f"{words} (the drive is at {now:.0f} °C, and was at {then:.0f} °C then)"


def remedy(one: NamedCause) -> str:
    """Action of the operator for a cause."""
    return words_of_cause(one.cause).do.format(subject=one.subject)


def evidence_of(one: NamedCause) -> Evidence:
    """The value of a cause; a cause has no limit."""
    row = words_of_cause(one.cause)
    return Evidence(f"{row.name} {one.subject}".rstrip(), one.value, math.nan, row.unit)


def explanation(explained: TorqueExplanation, found: Diagnosis | None = None) -> str:
    """Alternatives that explain a torque residual, with their values and the unexplained rest."""
    rest = estimate(explained.after, explained.after_sigma, "")
    left = f"{rest} of the predicted RMS remains unexplained: the mechanism or a clearance may have changed"
    if not explained.alternatives:
        return f"no fault of the sensors, load or mass explains half of it; {left}"
    alternatives = [
        " and ".join(sentence(one, found) for one in causes) for causes in explained.alternatives[:_MOST]
    ]
    words = ", or ".join(alternatives)
    if len(alternatives) > 1:
        words += " (these explain the torque equally well)"
    if abs(explained.bias.value) > _SURE * explained.bias.sigma:
        words += f"; {sentence(explained.bias, found)}"
    return words if explained.is_whole else f"{words}; {left}"

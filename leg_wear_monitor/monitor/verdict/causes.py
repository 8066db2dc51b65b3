"""Causes of a deviating drive torque in words: one sentence and one remedy per cause."""

import math
from collections.abc import Mapping

import attrs

from leg_wear_monitor.estimate.cause import Cause, Change, NamedCause, TorqueExplanation
from leg_wear_monitor.monitor.alarms import amount
from leg_wear_monitor.monitor.diagnosis.state import Diagnosis
from leg_wear_monitor.monitor.verdict.verdict import estimate
from leg_wear_monitor.state import Evidence


@attrs.frozen
class CauseWords:
    """Row of a cause.

    Attributes
    ----------
    name, unit : str
        Of its value, as evidence.
    why : str
        The sentence; the drive torque is *it*. ``{value}`` and ``{size}`` are the value with and without its
        sign, ``{percent}`` is the size in percent, ``{subject}`` the body, ``{way}`` one of `ways`.
    do : str
        Action of the operator.
    ways : tuple of str
        Words for a negative and for a positive value.
    """

    name: str
    unit: str
    why: str
    do: str
    ways: tuple[str, str] = ("fallen", "risen")


_OFFSET, _DELAY = "correct crank.offset_rad", "look for a delay of the torque"
_TIMING = f"turn the crank to a known angle and compare: {_OFFSET} if its angle is wrong, otherwise {_DELAY}"
_DRIVE = "check the zero of the torque sensor, the lubrication and the temperature of the drive"
_BODY = "look for loose, bent or added parts, and rock each joint"

CAUSES: Mapping[Cause, CauseWords] = {
    Cause.SIGN: CauseWords(
        "torque_factor", "", "it is {value} times the predicted torque", "reverse drive_torque.sign"
    ),
    Cause.SCALE: CauseWords(
        "torque_factor_size",
        "",
        "its size is {size} times the predicted size",
        "correct drive_torque.scale or drive_torque.gear_ratio",
    ),
    Cause.TIMING: CauseWords(
        "crank_angle_ahead",
        "rad",
        "the crank is {size} {way}: at one speed the two cannot be distinguished",
        _TIMING,
        (
            "behind its measured angle, or the torque is late by as much",
            "ahead of its measured angle, or the torque is early by as much",
        ),
    ),
    Cause.CRANK_OFFSET: CauseWords(
        "crank_angle_ahead",
        "rad",
        "the crank is {size} {way} its measured angle",
        _OFFSET,
        ("behind", "ahead of"),
    ),
    Cause.LAG: CauseWords("torque_late", "s", "the torque is {size} {way}", _TIMING, ("early", "late")),
    Cause.NOISE: CauseWords(
        "torque_noise",
        "N m",
        "its samples scatter by {size}",
        "check the cable, the shield and the filter of the torque sensor, and the drive's control",
    ),
    Cause.BIAS: CauseWords(
        "impossible_friction",
        "N m",
        "a constant torque of {size} {way}",
        "check the zero of the torque sensor, drive_torque.sign, scale and gear_ratio, and the friction of "
        "the drive",
        (
            "drives the crank, but friction cannot drive",
            "acts beyond the largest friction of the drive",
        ),
    ),
    Cause.FRICTION: CauseWords(
        "friction",
        "N m",
        "the constant torque has {way} by {size} since this leg was commissioned",
        _DRIVE,
    ),
    Cause.LOAD_FRICTION: CauseWords(
        "load_friction", "", "the friction fraction of the torque has {way} by {size}", _DRIVE
    ),
    Cause.JOINT_FRICTION: CauseWords(
        "joint_friction_fraction",
        "",
        "the friction in the joints has {way} by {percent}",
        "check the lubrication of the joints, and look for dirt in them",
    ),
    Cause.LOAD: CauseWords(
        "foot_load",
        "N",
        "the upward force on the foot has {way} by {size}",
        "check the load at the foot; if the leg walks on the ground, set load.model to ground",
    ),
    Cause.MASS: CauseWords(
        "mass_fraction",
        "",
        "body {subject} is {percent} {way}",
        "check {subject} for loose or added parts, and its mass in the mechanism's file",
        ("lighter", "heavier"),
    ),
    Cause.LENGTH: CauseWords(
        "length_fraction", "", "body {subject} is {percent} {way}", _BODY, ("shorter", "longer")
    ),
    Cause.SEVERAL: CauseWords("clearance", "m", "{subject} have opened together", "rock each joint"),
    Cause.UNKNOWN: CauseWords("unknown_change", "", "no single cause explains the change", _BODY),
}

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
    row = CAUSES[one.cause]
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
    return CAUSES[one.cause].do.format(subject=one.subject)


def evidence_of(one: NamedCause) -> Evidence:
    """The value of a cause; a cause has no limit."""
    row = CAUSES[one.cause]
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

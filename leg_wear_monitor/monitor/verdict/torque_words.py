"""What explains a torque mismatch, in words: causes with values, and what a person does about the first."""

import math

from leg_wear_monitor.estimate.cause import (
    Cause,
    NamedCause,
    Timing,
    TorqueExplanation,
)
from leg_wear_monitor.monitor.config.inputs import AT_START, Crank, DriveTorque
from leg_wear_monitor.monitor.verdict.words import amount, estimate

_SURE = 3.0  # standard deviations
_MOST = 3  # alternatives in words
_NEAR = 0.03  # by which a factor may differ from that of a known mistake

EVIDENCE = {
    Cause.SIGN: ("torque_factor", ""),
    Cause.SCALE: ("torque_factor_size", ""),
    Cause.CRANK_OFFSET: ("crank_angle_ahead", "rad"),
    Cause.LOAD: ("foot_load", "N"),
    Cause.MASS: ("mass_fraction", ""),
}
"""Name and unit of each cause's value."""


def causes_in_words(explained: TorqueExplanation, crank: Crank, torque: DriveTorque) -> str:
    """All alternatives with their values, and what stays unexplained."""
    rest = f"{estimate(explained.after, explained.after_sigma, '')} of the predicted RMS stays unexplained"
    other = "the mechanism is another one, or a clearance has changed"
    if not explained.alternatives:
        return (
            "no reversed sign, factor, crank angle, lag, load at the foot or mass of a body explains half of "
            f"it: {rest}; {other}"
        )
    told = [
        " and ".join(_words(one, explained, crank, torque) for one in causes)
        for causes in explained.alternatives
    ]
    words = ", or ".join([*told[:_MOST], *(["others"] if len(told) > _MOST else [])])
    if len(told) > 1:
        words += " (these explain the torque equally well and cannot be distinguished)"
    if abs(explained.bias_nm) > _SURE * explained.bias_sigma_nm:
        words += f"; {_bias(explained)}"
    return words if explained.is_whole else f"{words}; {rest}: {other}"


def _bias(explained: TorqueExplanation) -> str:
    value = estimate(abs(explained.bias_nm), explained.bias_sigma_nm, "N m")
    if explained.bias_nm < 0.0:
        return f"a constant torque of {value} drives the crank; friction cannot drive"
    return f"a constant torque exceeds the largest friction of the drive by {value}"


def remedy(explained: TorqueExplanation, crank: Crank, torque: DriveTorque) -> str:
    """What a person does about the causes of the first alternative."""
    return " and ".join(_remedy(one, explained, crank, torque) for one in explained.alternatives[0])


def _words(one: NamedCause, explained: TorqueExplanation, crank: Crank, torque: DriveTorque) -> str:
    match one.cause:
        case Cause.SIGN:
            return f"it is {estimate(one.value, one.sigma, '')} times the predicted one"
        case Cause.SCALE:
            like = _known_factor(one, crank, torque)[0]
            return f"its size is {estimate(one.value, one.sigma, '')} times the predicted one{like}"
        case Cause.CRANK_OFFSET:
            return _timing(one, explained)
        case Cause.LOAD:
            way = "lifts" if one.value > 0.0 else "pulls down"
            return f"a load of {estimate(abs(one.value), one.sigma, 'N')} {way} the foot"
    more = "heavier" if one.value > 0.0 else "lighter"
    share, sigma = 100.0 * abs(one.value), 100.0 * one.sigma
    return f"body {one.subject} is {estimate(share, sigma, '%')} {more}"


def _known_factor(one: NamedCause, crank: Crank, torque: DriveTorque) -> tuple[str, str]:
    """What a factor looks like, and the remedy."""
    scale = f"set drive_torque.scale to {torque.scale / one.value:.4g}"
    gear = crank.gear_ratio
    if _is_near(one, 1000.0):
        return ": it is in N mm", scale
    if gear != 1.0 and _is_near(one, 1.0 / gear):
        return (
            f": it is the torque on the joint's shaft; crank.gear_ratio is {amount(gear, '')}",
            f"set drive_torque.gear_ratio to {torque.gear_ratio * gear:.4g}",
        )
    if torque.gear_ratio != 1.0 and _is_near(one, torque.gear_ratio):
        return (
            ": it is already the torque on the crank; drive_torque.gear_ratio is "
            f"{amount(torque.gear_ratio, '')}",
            "set drive_torque.gear_ratio to 1",
        )
    return "", f"{scale}, or correct drive_torque.gear_ratio"


def _is_near(one: NamedCause, factor: float) -> bool:
    return abs(one.value - factor) <= max(_SURE * one.sigma, _NEAR * factor)


def _timing(one: NamedCause, explained: TorqueExplanation) -> str:
    if explained.timing is not None:
        offset, lag = _parts(explained.timing)
        return " and ".join(each for each in (offset, lag) if each)
    offset = _offset(one.value, one.sigma)
    speed = explained.speed_radps
    lag = _lag(-one.value / speed, one.sigma / abs(speed))
    return f"{offset}, or {lag}: at one speed the two cannot be distinguished"


def _parts(timing: Timing) -> tuple[str, str]:
    """Offset and lag, as far as they are significant: the larger one at least."""
    offset = abs(timing.offset_rad) / timing.offset_sigma_rad if timing.offset_sigma_rad else math.inf
    lag = abs(timing.lag_s) / timing.lag_sigma_s if timing.lag_sigma_s else math.inf
    return (
        _offset(timing.offset_rad, timing.offset_sigma_rad) if offset > _SURE or offset >= lag else "",
        _lag(timing.lag_s, timing.lag_sigma_s) if lag > _SURE or lag > offset else "",
    )


def _offset(value: float, sigma: float) -> str:
    where = "ahead of" if value > 0.0 else "behind"
    return f"the crank is {estimate(abs(value), sigma, 'rad')} {where} its measured angle"


def _lag(value: float, sigma: float) -> str:
    return f"the torque is {estimate(abs(value), sigma, 's')} {'late' if value > 0.0 else 'early'}"


def _remedy(one: NamedCause, explained: TorqueExplanation, crank: Crank, torque: DriveTorque) -> str:
    match one.cause:
        case Cause.SIGN:
            return f"set drive_torque.sign to {-torque.sign}"
        case Cause.SCALE:
            return _known_factor(one, crank, torque)[1]
        case Cause.CRANK_OFFSET:
            return _timing_remedy(one, explained, crank)
        case Cause.LOAD:
            return "check the load and the ground at the foot"
    return f"check for loose or added parts, and the mass of {one.subject} in the mechanism's file"


def _timing_remedy(one: NamedCause, explained: TorqueExplanation, crank: Crank) -> str:
    offset = one.value if explained.timing is None else explained.timing.offset_rad
    shift = f"set crank.offset_rad to {crank.offset_rad + offset:.4g}"
    if crank.zero == AT_START:
        shift = "restart the monitor while the leg walks steadily, so that the crank's zero is found again"
    late = "look for a delay of the torque"
    if explained.timing is None:
        return f"turn the crank to a known angle and compare: {shift} if its angle is wrong, else {late}"
    found = _parts(explained.timing)
    return " and ".join(each for each, told in zip((shift, late), found, strict=True) if told)

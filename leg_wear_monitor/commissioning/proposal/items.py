"""Parameters of the monitor from the chosen fit, each with its error and its runner-up."""

import math
from collections.abc import Iterator
from typing import Any

import attrs

from leg_wear_monitor.bags.series.signals import WRENCH
from leg_wear_monitor.commissioning.evidence.noise import scatter, sensor_noise
from leg_wear_monitor.commissioning.evidence.timing import cadence_rpm
from leg_wear_monitor.commissioning.proposal.better import better
from leg_wear_monitor.commissioning.proposal.found import Found, gear, offset_rad, offset_sigma_rad
from leg_wear_monitor.commissioning.result.commissioning_result import CommissioningItem as Item
from leg_wear_monitor.commissioning.search.candidates import SAME_GEAR
from leg_wear_monitor.commissioning.search.choice import Rival

_NEAR = 0.05  # relative error by which clearances shift the scale: a given one that near is kept
_HALF_A_GEAR = 0.5, 1.5  # efficiencies with which a torque may be that of the motor's shaft


def items(found: Found) -> list[Item]:
    """Everything that was looked for, parameters first."""
    told = [*_crank(found), *_torque(found), *_timing(found), *_noises(found)]
    return [attrs.evolve(item, better=better(item.name, found)) for item in told]


def changes(found: list[Item]) -> dict[str, Any]:
    """Values of the monitor's parameters among items."""
    return {item.name: item.value for item in found if "." in item.name or item.name == "crank_joint"}


def _rival(found: Found, name: str) -> dict[str, Any]:
    rival = found.choice.rivals.get(name)
    return {"other": _value(name, rival), "other_mismatch": rival.candidate.fit.mismatch} if rival else {}


def _value(name: str, rival: Rival) -> str | int | float:
    one = rival.candidate
    if name == "crank_joint":
        return one.joint.joint
    if name == "drive_torque.source":
        return one.torque.label
    if name == "crank.sign":
        return one.fit.direction
    return one.fit.torque_sign if name == "drive_torque.sign" else float(f"{one.fit.gear_ratio:.4g}")


def _crank(found: Found) -> Iterator[Item]:
    one, mismatch = found.fit, found.fit.mismatch
    ratio, is_exact = gear(found)
    yield Item(
        name="crank_joint",
        value=found.best.joint.joint,
        mismatch=mismatch,
        remark=f"in {found.best.joint.topic}",
        **_rival(found, "crank_joint"),
    )
    yield Item(name="crank.sign", value=one.direction, mismatch=mismatch, **_rival(found, "crank.sign"))
    yield Item(
        name="crank.gear_ratio",
        value=ratio,
        sigma=one.gear_ratio * one.sigma["ratio"] / abs(one.ratio),
        mismatch=mismatch,
        remark=f"measured {one.gear_ratio:.7g}" if is_exact else "not a fraction of small numbers",
        **_rival(found, "crank.gear_ratio"),
    )
    last = max(one.offset_rad)
    yield Item(
        name="crank.offset_rad",
        value=round(offset_rad(found, last), 4),
        unit="rad",
        sigma=offset_sigma_rad(found),
        remark="clearances shift the torque's phase"
        + ("" if found.timing.is_lag_separated else ", at one cadence a lag as well"),
        mismatch=mismatch,
    )


def _torque(found: Found) -> Iterator[Item]:
    one, torque = found.fit, found.best.torque
    yield Item(
        name="drive_torque.source",
        value=torque.source,
        mismatch=one.mismatch,
        remark=torque.label,
        **_rival(found, "drive_torque.source"),
    )
    if torque.source == WRENCH:
        yield Item(name="drive_torque.axis", value=torque.component)
    yield Item(
        name="drive_torque.sign",
        value=one.torque_sign,
        mismatch=one.mismatch,
        **_rival(found, "drive_torque.sign"),
    )
    scale, turns = _scale(found)
    total = 1.0 / abs(one.gain)
    yield Item(
        name="drive_torque.scale",
        value=scale,
        sigma=total / turns * math.hypot(one.sigma["gain"] / abs(one.gain), one.error.scale),
        mismatch=one.mismatch,
        remark=f"scale times gear ratio measured {total:.4g}",
    )
    yield Item(name="drive_torque.gear_ratio", value=turns)


def _scale(found: Found) -> tuple[float, float]:
    """Scale and gear ratio of the torque, of which only the product is measured."""
    one, given = found.fit, found.base.drive_torque
    total = 1.0 / abs(one.gain)
    if abs(given.scale * given.gear_ratio / total - 1.0) <= _NEAR:
        return given.scale, given.gear_ratio
    ratio = gear(found)[0]
    is_geared = abs(ratio - 1.0) > SAME_GEAR and _HALF_A_GEAR[0] < total / ratio < _HALF_A_GEAR[1]
    turns = ratio if is_geared else 1.0
    scale = total / turns
    return (1.0 if abs(scale - 1.0) <= _NEAR else float(f"{scale:.4g}")), turns


def _timing(found: Found) -> Iterator[Item]:
    one, timing = found.fit, found.timing
    yield Item(
        name="drive_torque.sampling",
        value=found.used_sampling,
        remark=found.sampling.why if found.sampling.value else "as given: not enough to tell",
    )
    yield Item(
        name="lag",
        value=timing.late_s,
        unit="s",
        sigma=timing.error_s if timing.is_lag_separated else None,
        remark="of the torque, beside that of its sampling"
        if timing.is_lag_separated
        else "cannot be distinguished from an offset at one cadence",
    )
    yield from _low_pass(found)
    cadence, tolerance = cadence_rpm(one)
    yield Item(name="cadence.commanded_rpm", value=cadence, unit="rpm")
    yield Item(name="cadence.tolerance_rpm", value=tolerance, unit="rpm")


def _frictions(found: Found) -> Iterator[Item]:
    declared = found.declared
    friction, sigma = found.friction_nm
    yield Item(
        name="friction",
        value=friction,
        unit="N m",
        sigma=sigma,
        remark="constant, on the crank" + _declared(declared.coulomb_nm, " N m"),
    )
    friction, sigma = found.load_friction
    yield Item(
        name="load friction",
        value=friction,
        sigma=sigma,
        remark="as a fraction of the torque's size" + _declared(declared.load_friction),
    )


def _declared(value: float, unit: str = "") -> str:
    return f"; declared: {value:.4g}{unit}" if math.isfinite(value) else ""


def _low_pass(found: Found) -> Iterator[Item]:
    one = found.low_pass
    if one is None:
        return
    hz = one.bandwidth_hz
    value: str | float = hz
    if not one.is_told:
        told = "no low-pass is sure: the torque's noise hides it, or clearances and masses are others"
    elif math.isfinite(hz):
        told = "corner frequency of a low-pass between the crank and the torque's samples"
    else:
        value, told = f"none below {one.least_hz:g}", "no low-pass shows"
    yield Item(
        name="bandwidth",
        value=value,
        unit="Hz",
        sigma=hz * one.log_sigma if math.isfinite(hz) else None,
        remark=told + _declared(found.declared.bandwidth_hz, " Hz"),
    )


def _noises(found: Found) -> Iterator[Item]:
    one = found.fit
    yield from _frictions(found)
    if "bias" in one.linear:
        bias = one.linear["bias"] / one.gain
        yield Item(name="bias", value=bias, unit="N m", sigma=one.sigma["bias"] / abs(one.gain))
    yield Item(name="noise of the encoder", value=found.motion.noise_rad, unit="rad")
    quiet = sensor_noise(one) / abs(one.gain)
    yield Item(name="noise of the torque", value=quiet, unit="N m", remark="in the quietest part of the turn")
    rest = scatter(one) / abs(one.gain)
    yield Item(name="scatter", value=rest, unit="N m", remark="from turn to turn, over 1/12 turn")
    yield Item(name="rate of the joint", value=found.motion.rate_hz, unit="Hz")

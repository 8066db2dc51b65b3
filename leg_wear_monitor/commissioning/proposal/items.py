"""Parameters of the monitor from the chosen fit, each with its error and its runner-up."""

import math
from collections.abc import Iterator
from typing import Any

import attrs
import numpy as np

from leg_wear_monitor.bags.series.signals import WRENCH
from leg_wear_monitor.commissioning.evidence.noise import scatter, sensor_noise
from leg_wear_monitor.commissioning.evidence.sampling import Sampling
from leg_wear_monitor.commissioning.evidence.timing import Timing, cadence_rpm
from leg_wear_monitor.commissioning.proposal.exact_ratio import exact_ratio
from leg_wear_monitor.commissioning.result.commissioning_result import CommissioningItem as Item
from leg_wear_monitor.commissioning.search.candidates import SAME_GEAR, Candidate
from leg_wear_monitor.commissioning.search.choice import Choice, Rival
from leg_wear_monitor.estimate.torque_fit.fit import Fit
from leg_wear_monitor.estimate.torque_fit.likeness import repeating
from leg_wear_monitor.estimate.torque_fit.motion import JointMotion
from leg_wear_monitor.estimate.torque_fit.torque_model import PHASE_ERROR_RAD
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.monitor.config.settings import MonitorConfig

_SURE = 3.0  # standard deviations
_NEAR = 0.05  # relative error by which clearances shift the scale: a given one that near is kept
_DRIFT_RAD = 0.05  # by which clearances may shift the phase over a recording
_MODEL_SCALE = 0.03  # by which they raise it
# of the torque's RMS, half of its energy: legs with clearance have 0.03 to 0.05 of averages, 0.3 to 0.45 of
# instants at 50 to 200 Hz (full coordinates, 60 rpm)
UNEXPLAINED = 0.7
_HALF_A_GEAR = 0.5, 1.5  # efficiencies with which a torque may be that of the motor's shaft


@attrs.frozen(eq=False)
class Found:
    """What the parameters are made of."""

    choice: Choice
    fit: Fit
    motion: JointMotion
    sampling: Sampling
    timing: Timing
    base: MonitorConfig

    @property
    def doubts(self) -> tuple[str, ...]:
        """Why nothing is proposed; empty if the choice is sure, and explains the torque."""
        mismatch = self.fit.mismatch
        if mismatch < UNEXPLAINED:
            return self.choice.doubts
        told = f"the torque: {100.0 * mismatch:.0f} % of its RMS is not that of this leg, whatever is chosen"
        return (*self.choice.doubts, told)

    @property
    def best(self) -> Candidate:
        """The chosen joint and torque."""
        return self.choice.best

    @property
    def used_sampling(self) -> str:
        """What is found, or what the given parameters have if it cannot be told."""
        return self.sampling.value or self.base.drive_torque.sampling


def items(found: Found) -> list[Item]:
    """Everything that was looked for, parameters first."""
    return [*_crank(found), *_torque(found), *_timing(found), *_noises(found)]


def changes(found: list[Item]) -> dict[str, Any]:
    """Values of the monitor's parameters among items."""
    return {item.name: item.value for item in found if "." in item.name or item.name == "crank_joint"}


def gear(found: Found) -> tuple[float, bool]:
    """Gear ratio, and whether it is exact: the given one or a fraction of small numbers within the error."""
    measured, error = found.fit.gear_ratio, gear_error(found.fit)
    given = found.base.crank.gear_ratio
    if abs(given / measured - 1.0) <= error:
        return given, True
    exact = exact_ratio(measured, error)
    return (measured, False) if exact is None else (exact, True)


def gear_error(one: Fit) -> float:
    """Largest relative error of the gear ratio."""
    travel = abs(one.ratio) * float(np.ptp(one.pair.position_rad))
    return _SURE * one.sigma["ratio"] / abs(one.ratio) + _DRIFT_RAD / max(travel, 1.0e-9)


def offset_rad(found: Found, number: int) -> float:
    """Crank angle at joint position 0 of a recording, from -pi to pi."""
    one = found.fit
    offset = one.offset_rad[number]
    # the exact ratio instead of the measured one leaves the phase in the middle of the recording as it is
    middle = float(np.median(one.pair.position_rad[one.pair.recording == number]))
    offset += (one.ratio - one.direction / gear(found)[0]) * middle
    # at one cadence, a lag is a part of the phase
    offset += (found.timing.lag_s - one.lag_s) * float(np.median(one.crank()[1]))
    return float((offset + math.pi) % TURN - math.pi)


def _offset_sigma_rad(found: Found) -> float:
    """Standard deviation of the offset, with what clearances, a rest that repeats and a lag make of it."""
    one, timing = found.fit, found.timing
    # were all of the rest that repeats a shift of the phase, it would shift by this
    slope = np.gradient(one.predicted) / np.gradient(one.blocks.mean(one.crank()[0]))
    by_rest = repeating(one) * float(one.measured.std() / np.sqrt(np.mean(slope**2)))
    lag_s = 0.0 if timing.is_late else timing.error_s  # a lag that shows is a term of the fit
    if not timing.is_lag_separated:
        lag_s = found.base.drive_torque.max_lag_s
    if not found.sampling.value:
        lag_s = math.hypot(lag_s, 0.5 * one.pair.interval_s)  # averages are late by half an interval
    by_lag = lag_s * float(np.median(np.abs(one.crank()[1])))
    return math.hypot(one.sigma["offset_rad"], PHASE_ERROR_RAD, by_rest, by_lag)


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
        sigma=_offset_sigma_rad(found),
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
        sigma=total / turns * math.hypot(one.sigma["gain"] / abs(one.gain), _MODEL_SCALE),
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
    cadence, tolerance = cadence_rpm(one)
    yield Item(name="cadence.commanded_rpm", value=cadence, unit="rpm")
    yield Item(name="cadence.tolerance_rpm", value=tolerance, unit="rpm")


def _noises(found: Found) -> Iterator[Item]:
    one = found.fit
    friction, sigma = one.linear["friction"] / one.gain, one.sigma["friction"] / abs(one.gain)
    yield Item(name="friction", value=friction, unit="N m", sigma=sigma, remark="constant, on the crank")
    if "bias" in one.linear:
        bias = one.linear["bias"] / one.gain
        yield Item(name="bias", value=bias, unit="N m", sigma=one.sigma["bias"] / abs(one.gain))
    yield Item(name="noise of the encoder", value=found.motion.noise_rad, unit="rad")
    quiet = sensor_noise(one) / abs(one.gain)
    yield Item(name="noise of the torque", value=quiet, unit="N m", remark="in the quietest part of the turn")
    rest = scatter(one) / abs(one.gain)
    yield Item(name="scatter", value=rest, unit="N m", remark="from turn to turn, over 1/12 turn")
    yield Item(name="rate of the joint", value=found.motion.rate_hz, unit="Hz")

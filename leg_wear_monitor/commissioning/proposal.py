"""The proposed parameters: each with its interval, and how it could be known better."""

import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import attrs
import numpy as np

from leg_wear_monitor.commissioning.evidence import (
    Sampling,
    Timing,
    cadence_rpm,
    scatter,
    sensor_noise,
)
from leg_wear_monitor.commissioning.result import CommissioningItem as Item
from leg_wear_monitor.commissioning.search import SAME_GEAR, Candidate, Choice, Rival
from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.estimate.drive import DriveFigures
from leg_wear_monitor.estimate.joint_motion import JointMotion
from leg_wear_monitor.estimate.torque_fit import Fit, Terms, fit, repeating
from leg_wear_monitor.estimate.torque_model import TorqueModel
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.monitor.config.inputs import INTERFACE, WRENCH
from leg_wear_monitor.monitor.config.settings import MonitorConfig

# A gear's ratio is the ratio of two numbers of teeth: the simplest fraction within a measurement's error.


_LARGEST_DENOMINATOR = 20
_BY_CHANCE = 0.1  # fractions that may lie within the error by chance


def exact_ratio(measured: float, error: float) -> float | None:
    """The simplest fraction within a relative error, if it is not one of many.

    Parameters
    ----------
    measured : float
        Gear ratio; below 1, its inverse is taken for a fraction.
    error : float
        Largest relative error.

    Returns
    -------
    float or None
        None if no simple fraction lies within the error, or if one would by chance.
    """
    if not measured > 0.0:
        raise LegWearError(f"{measured!r} is not a gear ratio. Expected a number above 0")
    if measured < 1.0:
        inverse = exact_ratio(1.0 / measured, error)
        return None if inverse is None else 1.0 / inverse
    fractions = 0
    for denominator in range(1, _LARGEST_DENOMINATOR + 1):
        fractions += denominator
        if 2.0 * error * measured * fractions > _BY_CHANCE:
            return None
        numerator = round(measured * denominator)
        if abs(numerator / denominator / measured - 1.0) <= error:
            return numerator / denominator
    return None


# The chosen fit and the parameters that follow from it.


_SURE = 3.0  # standard deviations
_DRIFT_RAD = 0.05  # phase shift by clearances over a recording
# fraction of the torque's RMS, half of its energy: legs with clearance have 0.03 to 0.05 with averages, 0.3
# to 0.45 with instants at 50 to 200 Hz (full coordinates, 60 rpm)
UNEXPLAINED = 0.7
# factor on the errors of friction where the foot carries a load, whose course is not known exactly
_UNDER_LOAD = 3.0


@attrs.frozen(eq=False)
class Found:
    """Measured quantities from which the parameters are derived."""

    choice: Choice
    fit: Fit
    motion: JointMotion
    sampling: Sampling
    timing: Timing
    declared: DriveFigures
    base: MonitorConfig

    @property
    def doubts(self) -> tuple[str, ...]:
        """Why nothing is proposed; empty if the choice is sure, and explains the torque."""
        mismatch = self.fit.mismatch
        if mismatch < UNEXPLAINED:
            return self.choice.doubts
        sentence = f"the torque: {100.0 * mismatch:.0f} % of its RMS does not fit this leg, with any choice"
        return (*self.choice.doubts, sentence)

    @property
    def best(self) -> Candidate:
        """The chosen joint and torque."""
        return self.choice.best

    @property
    def used_sampling(self) -> str:
        """The sampling found, or the given parameter's sampling if it is not known."""
        return self.sampling.value or self.base.drive_torque.sampling

    @property
    def friction_nm(self) -> tuple[float, float]:
        """Constant friction on the crank, and its standard deviation [N m]."""
        one = self.fit
        by_clearances = one.error.friction * self._roughly * float(one.predicted.std())
        sigma = math.hypot(one.sigma["friction"], by_clearances)
        return one.linear["friction"] / one.gain, sigma / abs(one.gain)

    @property
    def load_friction(self) -> tuple[float, float]:
        """Friction as a fraction of the torque's size, and its standard deviation."""
        one = self.fit
        by_clearances = one.error.load_friction * self._roughly
        sigma = math.hypot(one.sigma["load_friction"] / one.gain, by_clearances)
        return one.linear["load_friction"] / one.gain, sigma

    @property
    def _roughly(self) -> float:
        """Factor on the changes by clearances."""
        return _UNDER_LOAD if "load" in self.fit.linear else 1.0

    @property
    def turned_radps(self) -> float:
        """Usual speed of the crank, without its sign: by it, a lag looks like an offset."""
        return float(np.median(np.abs(self.fit.crank()[1])))


def settled(found: Found, model: TorqueModel) -> Found:
    """The same with a fit for the lag to allow for."""
    timing, one = found.timing, found.fit
    if timing.is_lag_separated:
        terms = Terms(bias="bias" in one.linear, load="load" in one.linear, load_friction=True)
        start = attrs.evolve(one.refined, lag_s=timing.lag_s)
        one = fit(one.pair, model, start, terms, with_errors=True)
    return attrs.evolve(found, fit=one)


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


def offset_sigma_rad(found: Found) -> float:
    """Standard deviation of the offset, with the effect of clearances, a repeating residual and a lag."""
    one, timing = found.fit, found.timing
    # were all of the rest that repeats a shift of the phase, it would shift by this
    slope = np.gradient(one.predicted) / np.gradient(one.blocks.mean(one.crank()[0]))
    by_rest = repeating(one) * float(one.measured.std() / np.sqrt(np.mean(slope**2)))
    by_lag = timing.lag_sigma_s * found.turned_radps
    return math.hypot(one.sigma["offset_rad"], one.error.phase_rad, by_rest, by_lag)


# How each quantity could be known better than a recording shows it.


_FURTHER = "record cadences further apart"
_TWO_CADENCES = "record two cadences in one recording, 40 rpm apart"


def better(name: str, found: Found) -> str:
    """Measure that would determine a quantity better; empty if none is needed."""
    return _WAYS[name](found) if name in _WAYS else ""


def _offset(found: Found) -> str:
    by_lag = found.timing.lag_sigma_s * found.turned_radps
    if by_lag <= found.fit.error.phase_rad:
        return "turn the crank to a known angle, such as a dead centre"
    if found.timing.is_lag_separated:
        return f"{_FURTHER}, or declare drive.lag_s"
    return f"{_TWO_CADENCES}, or declare drive.lag_s"


def _lag(found: Found) -> str:
    if math.isfinite(found.declared.lag_s):
        return ""
    return _FURTHER if found.timing.is_lag_separated else _TWO_CADENCES


_WAYS: Mapping[str, Callable[[Found], str]] = {
    "crank.gear_ratio": lambda found: "" if gear(found)[1] else "enter the ratio of the teeth",
    "crank.offset_rad": _offset,
    "drive_torque.scale": lambda _: "measure the torque of a known weight on the crank",
    "drive_torque.sampling": lambda found: "" if found.sampling.value else "ask the drive's manual",
    "lag": _lag,
    "load friction": lambda found: (
        f"declare drive.type: clearances change it by {found.fit.error.load_friction:.2g}"
    ),
}


# Parameters of the monitor from the chosen fit, each with its error and its runner-up.


_NEAR = 0.05  # relative error by which clearances shift the scale: a given scale that near is kept
_HALF_A_GEAR = 0.5, 1.5  # efficiencies for which a torque may be measured at the motor's shaft


def items(found: Found) -> list[Item]:
    """Everything that was looked for, parameters first."""
    quantities = [*_crank(found), *_torque(found), *_timing(found), *_noises(found)]
    return [attrs.evolve(item, better=better(item.name, found)) for item in quantities]


def changes(found: list[Item]) -> dict[str, Any]:
    """Values of the monitor's parameters among items."""
    return {item.name: item.value for item in found if "." in item.name or item.name == "crank_joint"}


def _chosen(found: Found, name: str, **own: Any) -> Item:
    """A choice among candidates, with the best one that differs in it."""
    rival = found.choice.rivals.get(name)
    if rival:
        own |= {"other": _value(name, rival), "other_mismatch": rival.candidate.fit.mismatch}
    return Item(name=name, mismatch=found.fit.mismatch, **own)


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
    one, (ratio, is_exact) = found.fit, gear(found)
    joint = found.best.joint
    yield _chosen(found, "crank_joint", value=joint.joint, remark=f"in {joint.topic}")
    yield _chosen(found, "crank.sign", value=one.direction)
    yield _chosen(
        found,
        "crank.gear_ratio",
        value=ratio,
        sigma=one.gear_ratio * one.sigma["ratio"] / abs(one.ratio),
        remark=f"measured {one.gear_ratio:.7g}" if is_exact else "not a fraction of small numbers",
    )
    last = max(one.offset_rad)
    yield Item(
        name="crank.offset_rad",
        value=round(offset_rad(found, last), 4),
        unit="rad",
        sigma=offset_sigma_rad(found),
        remark="clearances shift the torque's phase"
        + ("" if found.timing.is_lag_separated else ", at one cadence a lag as well"),
        mismatch=one.mismatch,
    )


def _torque(found: Found) -> Iterator[Item]:
    one, torque = found.fit, found.best.torque
    yield _chosen(found, "drive_torque.source", value=torque.source, remark=torque.label)
    if torque.source == WRENCH:
        yield Item(name="drive_torque.axis", value=torque.component)
    if torque.source == INTERFACE:
        yield Item(name="drive_torque.interface", value=torque.interface)
    yield _chosen(found, "drive_torque.sign", value=one.torque_sign)
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
    """Scale and gear ratio of the torque; only their product is measured."""
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

"""What the proposed parameters are made of: the chosen fit, and what follows from it."""

import math

import attrs
import numpy as np

from leg_wear_monitor.commissioning.evidence.low_pass import LowPass
from leg_wear_monitor.commissioning.evidence.sampling import Sampling
from leg_wear_monitor.commissioning.evidence.timing import Timing
from leg_wear_monitor.commissioning.proposal.exact_ratio import exact_ratio
from leg_wear_monitor.commissioning.search.candidates import Candidate
from leg_wear_monitor.commissioning.search.choice import Choice
from leg_wear_monitor.estimate.drive_figures import DriveFigures
from leg_wear_monitor.estimate.torque_fit.fit import Fit, fit
from leg_wear_monitor.estimate.torque_fit.likeness import repeating
from leg_wear_monitor.estimate.torque_fit.motion import JointMotion
from leg_wear_monitor.estimate.torque_fit.regression import Terms
from leg_wear_monitor.estimate.torque_fit.torque_model import TorqueModel
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.monitor.config.settings import MonitorConfig

_SURE = 3.0  # standard deviations
_DRIFT_RAD = 0.05  # by which clearances may shift the phase over a recording
# of the torque's RMS, half of its energy: legs with clearance have 0.03 to 0.05 of averages, 0.3 to 0.45 of
# instants at 50 to 200 Hz (full coordinates, 60 rpm)
UNEXPLAINED = 0.7
# factor on the errors of friction where the foot carries a load, whose course is not known exactly
_UNDER_LOAD = 3.0


@attrs.frozen(eq=False)
class Found:
    """What the parameters are made of."""

    choice: Choice
    fit: Fit
    motion: JointMotion
    sampling: Sampling
    timing: Timing
    declared: DriveFigures
    base: MonitorConfig
    low_pass: LowPass | None = None

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
        """Factor on what clearances change."""
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
    """Standard deviation of the offset, with what clearances, a rest that repeats and a lag make of it."""
    one, timing = found.fit, found.timing
    # were all of the rest that repeats a shift of the phase, it would shift by this
    slope = np.gradient(one.predicted) / np.gradient(one.blocks.mean(one.crank()[0]))
    by_rest = repeating(one) * float(one.measured.std() / np.sqrt(np.mean(slope**2)))
    by_lag = timing.lag_sigma_s * found.turned_radps
    return math.hypot(one.sigma["offset_rad"], one.error.phase_rad, by_rest, by_lag)

"""What speeds tell: a lag of the torque from an offset of the crank; and the cadence."""

import math

import attrs
import numpy as np

from leg_wear_monitor.estimate.torque_fit.fit import Fit
from leg_wear_monitor.estimate.torque_fit.pairing import Pair, slow_speed
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.twin.settings import AVERAGE

_SPREAD = 0.15  # relative spread of the speed from which on a lag is separated from the offset
_SURE = 3.0  # standard deviations
_FILTERED = 0.25  # of an interval: behind a low-pass, instants look like averages, and are not late by a half
# a drive may have no lag to speak of, or any up to 30 ms: current loops, filters, buses; neither is likelier
_MOST_S, _STEP_S = 0.030, 0.00025
_UNKNOWN_S = 0.0122  # the RMS of that, where nothing is measured: then the proposal allows for no lag
_DECLARED_S = 0.001  # by which a declared lag may be off
_MARGIN = 1.5  # of the cadence's tolerance beyond the departures seen
_ONE_CADENCE = 0.2  # relative distance from the usual cadence beyond which there is another one


def separates_lag(pair: Pair) -> bool:
    """Whether the crank walks at speeds different enough to tell a lag from an offset.

    In one recording: each has an offset of its own, as its encoder may have started anew.
    """
    speed = slow_speed(pair)
    spans = [np.quantile(speed[pair.recording == i], [0.1, 0.9]) for i in np.unique(pair.recording)]
    return any(abs(high - low) > _SPREAD * max(abs(high), abs(low)) for low, high in spans)


@attrs.frozen
class Timing:
    """When a torque is measured, as far as it can be told.

    Attributes
    ----------
    is_lag_separated : bool
        Whether the recording tells a lag from an offset.
    late_s, error_s : float
        Time by which the torque is late beside its sampling, and its standard deviation [s]; NaN if it is not
        separated.
    sampling_s, sampling_sigma_s : float
        Lag of the sampling, half a sampling interval for averages, and its standard deviation.
    declared_s : float
        Declared lag of the drive [s]; NaN without one.
    low_pass_s, low_pass_sigma_s : float
        Time by which the drive's low-pass makes the torque late, and its standard deviation [s].
    """

    is_lag_separated: bool
    late_s: float
    error_s: float
    sampling_s: float
    sampling_sigma_s: float = 0.0
    declared_s: float = math.nan
    low_pass_s: float = 0.0
    low_pass_sigma_s: float = 0.0

    @property
    def is_late(self) -> bool:
        """Whether a lag shows for sure."""
        return self.is_lag_separated and abs(self.late_s) > _SURE * self.error_s

    @property
    def lag_s(self) -> float:
        """Lag to allow for: what sampling, low-pass and drive make of it [s]."""
        return self.sampling_s + self.low_pass_s + self._drive[0]

    @property
    def lag_sigma_s(self) -> float:
        """Standard deviation of the lag to allow for [s]."""
        sigma = self._drive[1]
        # where the whole lag is measured, errors of its parts are those of the drive's part, too
        if self.is_lag_separated:
            return sigma
        return math.hypot(sigma, self.low_pass_sigma_s, self.sampling_sigma_s)

    @property
    def _drive(self) -> tuple[float, float]:
        """Expected lag of the drive beside sampling and low-pass, and its standard deviation [s]."""
        is_declared = math.isfinite(self.declared_s)
        if not self.is_lag_separated:
            return (self.declared_s, _DECLARED_S) if is_declared else (0.0, _UNKNOWN_S)
        lag = np.arange(0.0, 2.0 * _MOST_S, _STEP_S)
        if is_declared:
            prior = np.exp(-0.5 * ((lag - self.declared_s) / _DECLARED_S) ** 2)
        else:
            prior = np.where(lag <= _MOST_S, _STEP_S / _MOST_S, 0.0)
            prior[0] += 1.0
        error = math.hypot(self.error_s, self.low_pass_sigma_s)
        away = (self.late_s - self.low_pass_s - lag) / error
        likely = prior * np.exp(-0.5 * (away**2 - float(np.min(away**2))))
        likely /= likely.sum()
        mean = float(likely @ lag)
        return mean, math.sqrt(float(likely @ (lag - mean) ** 2))


def timing_of(one: Fit, sampling: str, is_told: bool, declared_s: float = math.nan) -> Timing:
    """Timing of a torque with a sampling, from a fit whose lag is free if the recording separates it.

    Parameters
    ----------
    one : Fit
    sampling : str
    is_told : bool
        Whether the recording tells the sampling.
    declared_s : float
        Declared lag of the drive [s].
    """
    interval_s = one.pair.interval_s
    half, sigma_s = (0.5 * interval_s, _FILTERED * interval_s) if sampling == AVERAGE else (0.0, 0.0)
    if not is_told:
        sigma_s = 0.5 * interval_s
    if not separates_lag(one.pair):
        return Timing(False, math.nan, math.nan, half, sigma_s, declared_s)
    error_s = math.hypot(lag_error_s(one), sigma_s)
    return Timing(True, one.lag_s - half, error_s, half, sigma_s, declared_s)


def lag_error_s(one: Fit) -> float:
    """Standard deviation of the lag [s], with what clearances may shift the phase from speed to speed."""
    speed = np.quantile(np.abs(one.crank()[1]), [0.1, 0.9])
    shift = one.error.lag_rad / max(float(speed[1] - speed[0]), 1.0e-9)
    return math.hypot(one.sigma.get("lag_s", math.inf), shift)


def cadence_rpm(one: Fit) -> tuple[float, float]:
    """Usual cadence, negative for clockwise, and its tolerance [rpm]: a tenth, or what the leg needs."""
    speed = slow_speed(one.pair) * one.ratio * 60.0 / TURN
    usual = _usual(speed)
    departures = np.abs(speed - usual)
    own = departures[departures < _ONE_CADENCE * abs(usual)]
    most = _MARGIN * float(own.max()) if len(own) else 0.0
    return float(f"{usual:.3g}"), float(f"{max(0.1 * abs(usual), most):.2g}")


def _usual(speed: Floats) -> float:
    """The speed near which the leg walks most of the time."""
    centres = np.quantile(speed, np.linspace(0.05, 0.95, 19))
    near = [np.abs(speed - centre) < _ONE_CADENCE * abs(centre) for centre in centres]
    return float(np.median(speed[max(near, key=np.count_nonzero)]))


def cadences_rpm(one: Fit) -> list[float]:
    """Cadences that last at least a tenth of the time [rpm], rounded to 5 rpm."""
    speed = slow_speed(one.pair) * one.ratio * 60.0 / TURN
    values, counts = np.unique(np.round(speed / 5.0) * 5.0, return_counts=True)
    return [float(value) for value in values[counts > 0.1 * len(speed)]]

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
_MODEL_LAG_RAD = 0.01  # by which clearances shift the torque's phase; measured on the synthetic leg
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
    sampling_s : float
        Lag of the sampling: half a sampling interval for averages.
    """

    is_lag_separated: bool
    late_s: float
    error_s: float
    sampling_s: float

    @property
    def is_late(self) -> bool:
        """Whether a lag shows for sure."""
        return self.is_lag_separated and abs(self.late_s) > _SURE * self.error_s

    @property
    def lag_s(self) -> float:
        """Lag to allow for: the measured one if it shows for sure, else that of the sampling [s]."""
        return self.sampling_s + (self.late_s if self.is_late else 0.0)


def timing_of(one: Fit, sampling: str) -> Timing:
    """Timing of a torque with a sampling, from a fit whose lag is free if the recording separates it."""
    half = 0.5 * one.pair.interval_s if sampling == AVERAGE else 0.0
    if not separates_lag(one.pair):
        return Timing(False, math.nan, math.nan, half)
    return Timing(True, one.lag_s - half, lag_error_s(one), half)


def lag_error_s(one: Fit) -> float:
    """Standard deviation of the lag [s], with what clearances may shift the phase from speed to speed."""
    speed = np.quantile(np.abs(one.crank()[1]), [0.1, 0.9])
    shift = _MODEL_LAG_RAD / max(float(speed[1] - speed[0]), 1.0e-9)
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

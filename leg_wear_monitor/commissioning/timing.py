"""What speeds tell apart: a lag of the torque from an offset, averages from instants; and the cadence."""

import math

import attrs
import numpy as np

from leg_wear_monitor.commissioning.fit import Fit
from leg_wear_monitor.commissioning.pairing import Pair, slow_speed
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.twin.settings import AVERAGE, INSTANT

_SPREAD = 0.15  # relative spread of the speed from which on a lag is separated from the offset
_SURE = 3.0  # standard deviations
_MODEL_LAG_RAD = 0.01  # by which clearances shift the torque's phase; measured on the synthetic leg
_MARGIN = 1.5  # of the cadence's tolerance beyond the departures seen
_ONE_CADENCE = 0.2  # relative distance from the usual cadence beyond which there is another one


def separates_lag(pair: Pair) -> bool:
    """Whether the crank walks at speeds different enough to tell a lag from an offset."""
    low, high = np.quantile(slow_speed(pair), [0.1, 0.9])
    return bool(abs(high - low) > _SPREAD * max(abs(high), abs(low)))


@attrs.frozen
class Sampling:
    """What a torque sample is, as far as it can be told.

    Attributes
    ----------
    value : str
        ``average``, ``instant``, or empty if it cannot be told.
    why : str
        Why it cannot.
    """

    value: str
    why: str = ""


def sampling_of(one: Fit, is_separated: bool) -> Sampling:
    """Averages are late by half a sampling interval; that shows only if a lag shows."""
    half = 0.5 * one.pair.interval_s
    speed = float(np.median(np.abs(one.crank()[1])))
    if not is_separated:
        shift = half * speed
        why = (
            f"averages are late by {1.0e3 * half:.3g} ms, which at one cadence looks like {shift:.2g} rad of "
            "offset; record two cadences"
        )
        return Sampling("", why)
    error = lag_error_s(one)
    if error > 0.5 * half:
        why = f"the lag is known to ± {1.0e3 * error:.2g} ms only, averages are late by {1.0e3 * half:.3g} ms"
        return Sampling("", why)
    near = {AVERAGE: abs(one.lag_s - half) <= 2.0 * error, INSTANT: abs(one.lag_s) <= 2.0 * error}
    found = [name for name, is_near in near.items() if is_near]
    if len(found) == 1:
        return Sampling(found[0])
    return Sampling("", f"a lag of {1.0e3 * one.lag_s:.2g} ms is that of neither averages nor instants")


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

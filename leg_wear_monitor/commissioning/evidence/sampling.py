"""Whether a torque sample is the mean since the one before, or the torque at its instant.

Joints with clearance let go and hit again. The bodies' momenta are bounded, so what the torque lacks during a
flight is in the impact after it: means cancel over a part of a turn. Of impacts that last a millisecond,
instants meet some and miss others: their errors add up as independent ones do.
"""

import math

import attrs
import numpy as np

from leg_wear_monitor.commissioning.evidence.noise import sensor_noise
from leg_wear_monitor.commissioning.evidence.timing import lag_error_s, separates_lag
from leg_wear_monitor.estimate.torque_fit.fit import Fit
from leg_wear_monitor.estimate.torque_fit.pairing import is_steady, slow_speed
from leg_wear_monitor.estimate.torque_fit.torque_model import TorqueModel
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.twin.settings import AVERAGE, INSTANT

_WINDOW = 0.125  # of a turn, half of the window's width: some flights with their impacts
# Of a turn: what repeats with it is of a load or of other masses, and does not cancel either. Not more, or
# impacts that repeat would be taken out with it, and what is left of means would cancel no longer
_HARMONICS = 8
_SINGULAR = 1.0e-9
_CHUNKS = 12
# Energy of windows as a fraction of that of independent samples, typical of each, and how much legs differ
# (natural logarithm): the default leg in full coordinates, five joints of 0.2 to 0.4 mm, 35 to 90 rpm,
# 100 to 500 Hz; averages have 0.002 to 0.009, instants 0.4 to 1.1
_TYPICAL = {AVERAGE: 0.005, INSTANT: 0.65}
_LEGS_DIFFER = 0.7
_SURE_ODDS = 20.0
_MOST_ODDS = 1000.0  # the typical values are not known so well that more could be said
_SURE = 2.0  # standard deviations of the recording
_STRANGE = 3.0  # what neither adds up to
_LEAST = 1.0e-4  # below which it is rounding
_NOISE_ERROR = 0.25  # relative error of the noise's variance
_HIDDEN = 0.5  # of the rest's energy that is the sensor's noise, from which on nothing is told
_LARGE = 0.3  # of the torque; smaller ones do not drown slow errors of 0.02, which add up; impacts: 0.5 to 2
_NARROWER, _FLAT = 3.0, 0.5  # independent errors add up as much in narrow windows, slow ones less
_ROUGH = 0.5  # energy of neighbours' steps as a fraction of that of independent ones; of impacts, 0.8 to 1.4


@attrs.frozen
class Sampling:
    """What a torque sample is, as far as it can be told.

    Attributes
    ----------
    value : str
        ``average``, ``instant``, or empty if it cannot be told.
    why : str
        Why, or why it cannot.
    """

    value: str
    why: str


def sampling_of(one: Fit, model: TorqueModel) -> Sampling:
    """Judge by whether the errors of neighbouring samples cancel; without impacts, by the lag."""
    rest, noise = _rest(one, model), sensor_noise(one)
    turn = TURN / max(float(np.median(np.abs(one.crank()[1]))), 1.0e-9) / one.pair.interval_s
    added, error = added_up(rest, noise, max(2, round(_WINDOW * turn)))
    narrow = added_up(rest, noise, max(2, round(_WINDOW / _NARROWER * turn)))[0]
    if not _shows_impacts(one, rest, noise) or not added + _SURE * error > 0.0:
        return _by_lag(one)
    near = min(_TYPICAL, key=lambda name: abs(math.log(max(added, _LEAST) / _TYPICAL[name])))
    odds = min(_odds(near, added - _SURE * error), _odds(near, added + _SURE * error))
    told = (
        f"the errors of neighbouring samples add up to {added:.2g} ± {error:.1g} times those of independent "
        f"samples (averages: about {_TYPICAL[AVERAGE]:g}, instants: about {_TYPICAL[INSTANT]:g})"
    )
    if added > _STRANGE or (near == INSTANT and narrow < _FLAT * added):
        return Sampling("", f"{told}: does a load change slowly?")
    if odds < _SURE_ODDS:
        return Sampling("", f"{told}: probably {near}, but this is not certain")
    return Sampling(near, f"odds {'at least ' if odds >= _MOST_ODDS else ''}{odds:.0f} to 1: {told}")


def _odds(name: str, added: float) -> float:
    """Odds of one sampling against the other, of legs that differ."""
    x = math.log(max(added, _LEAST))
    away = {each: (x - math.log(typical)) ** 2 for each, typical in _TYPICAL.items()}
    other = INSTANT if name == AVERAGE else AVERAGE
    exponent = 0.5 * (away[other] - away[name]) / _LEGS_DIFFER**2
    return math.exp(min(exponent, math.log(_MOST_ODDS)))


def _shows_impacts(one: Fit, rest: Floats, noise: float) -> bool:
    """Whether a rest is large, more than the sensor's noise, and rough, as errors of the motion are not."""
    if float(rest.std()) < _LARGE * float(one.measured.std()):
        return False
    size, steps = float(rest.var()) - noise**2, 0.5 * float(np.mean(np.diff(rest) ** 2)) - noise**2
    return size > _HIDDEN * float(rest.var()) and steps > _ROUGH * size


def _by_lag(one: Fit) -> Sampling:
    """Averages are late by half a sampling interval: it shows if no other lag does."""
    why = "averages and instants differ by impacts, and the torque shows no strong impacts above its noise"
    half, error = 0.5 * one.pair.interval_s, lag_error_s(one)
    if not separates_lag(one.pair) or error > 0.5 * half:
        return Sampling("", why)
    late = {AVERAGE: abs(one.lag_s - half), INSTANT: abs(one.lag_s)}
    near = [name for name, away in late.items() if away <= 2.0 * error]
    if len(near) != 1:
        return Sampling("", f"{why}; a lag of {1.0e3 * one.lag_s:.2g} ms fits neither or both")
    return Sampling(
        near[0], f"the torque is late by {1.0e3 * one.lag_s:.2g} ms; averages are late by half an interval"
    )


def added_up(rest: Floats, noise: float, half: int) -> tuple[float, float]:
    """Energy of triangular windows of a rest, as a fraction of that of independent samples, and its error.

    NaN if there are too few samples, or only noise.

    Parameters
    ----------
    rest : (n,) array
    noise : float
        Standard deviation of the sensor's noise, which counts for neither.
    half : int
        Half of the window's width, in samples.
    """
    window = np.convolve(np.ones(half), np.ones(half))
    size = float(window @ window)
    if len(rest) < _CHUNKS * len(window):
        return math.nan, math.nan
    together = np.convolve(rest, window, mode="valid") ** 2 / size - noise**2
    alone = rest[half - 1 : half - 1 + len(together)] ** 2 - noise**2
    total, parts = float(alone.mean()), np.array([each.mean() for each in np.array_split(together, _CHUNKS)])
    if not total > 0.0:
        return math.nan, math.nan
    error = math.hypot(float(parts.std()) / math.sqrt(_CHUNKS), _NOISE_ERROR * noise**2) / total
    return float(together.mean()) / total, error


def _rest(one: Fit, model: TorqueModel) -> Floats:
    """What of each torque sample is neither the ideal leg's, nor slow and repeating (n,).

    Without changes of the speed, at which the smoothed motion and so the leg's torque are off for a while.
    """
    angle, speed, acceleration = one.crank()
    rest: Floats = one.pair.torque - one.gain * model.torque(angle, speed, acceleration)[0]
    waves = np.outer(np.arange(_HARMONICS + 1.0), angle)
    still = np.concatenate([np.cos(waves), np.sin(waves[1:])])
    square = (slow_speed(one.pair) * one.ratio) ** 2
    by = np.concatenate([still, still * (square / square.mean())])
    steady = is_steady(one.pair)
    by, rest = by[:, steady], rest[steady]
    # columns are alike at one cadence; few of them, so that the normal equations save most of the time
    coefficients = np.linalg.pinv(by @ by.T, rcond=_SINGULAR, hermitian=True) @ (by @ rest)
    return np.asarray(rest - coefficients @ by)

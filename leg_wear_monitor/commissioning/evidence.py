"""Evidence of a recording on its torque: foot load, lag, cadence, and the meaning of a sample."""

import math

import attrs
import numpy as np

from leg_wear_monitor.estimate.drive import DriveFigures
from leg_wear_monitor.estimate.joint_motion import Pair, is_steady, slow_speed
from leg_wear_monitor.estimate.torque_model import BINS, Fit, Terms, TorqueModel, fit, repeating
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.twin.sample import AVERAGE, INSTANT

# repeating rest below which a load is not looked for: sensors that average have up to 0.05
_LEAST_LOAD = 0.06
_EXPLAINS = 0.5  # a load is named if it explains this fraction of the energy of the repeating rest
_SURE_LOAD = 5.0  # standard deviations


def with_load(one: Fit, model: TorqueModel, terms: Terms) -> tuple[Fit, Terms]:
    """The fit with a foot load if this explains most of the repeating residual; otherwise without."""
    before = repeating(one) ** 2
    if not model.load.any() or before < _LEAST_LOAD**2:
        return one, terms
    with_it = attrs.evolve(terms, load=True)
    loaded = fit(one.pair, model, one.refined, with_it, with_errors=True)
    is_sure = abs(loaded.linear["load"]) >= _SURE_LOAD * loaded.sigma["load"]
    explains = repeating(loaded) ** 2 <= (1.0 - _EXPLAINS) * before
    return (loaded, with_it) if is_sure and explains and loaded.gain * one.gain > 0.0 else (one, terms)


# Several speeds separate a lag of the torque from an offset of the crank. They also give the cadence.


_SPEED_SPREAD = 0.15  # least relative spread of the speed that separates a lag from the offset
_FILTERED = 0.25  # intervals late: behind a low-pass, instants look like averages, and are not late by a half
# a drive may have no lag to speak of, or any up to 30 ms: current loops, filters, buses; neither is likelier
_UNKNOWN_S = 0.0122  # RMS lag if nothing is measured: then the proposal allows for no lag
_DECLARED_S = 0.001  # error of a declared lag
_MARGIN = 1.5  # cadence tolerance over the observed departures
_ONE_CADENCE = 0.2  # relative distance from the usual cadence beyond which a cadence counts as different


def separates_lag(pair: Pair) -> bool:
    """True if the crank walks at speeds different enough to tell a lag from an offset.

    In one recording: each has an offset of its own, as its encoder may have started anew.
    """
    speed = slow_speed(pair)
    spans = [np.quantile(speed[pair.recording == i], [0.1, 0.9]) for i in np.unique(pair.recording)]
    return any(abs(high - low) > _SPEED_SPREAD * max(abs(high), abs(low)) for low, high in spans)


@attrs.frozen
class Timing:
    """Timing of the measured torque, as far as it is known.

    Attributes
    ----------
    late_s, error_s : float
        Time by which the torque is late in addition to its sampling and a declared low-pass, and its standard
        deviation [s]; NaN if the recording does not tell a lag from an offset.
    lag_s, sigma_s : float
        Whole lag to allow for, and its standard deviation [s].
    is_declared : bool
        True if the drive's lag is declared.
    """

    late_s: float
    error_s: float
    lag_s: float
    sigma_s: float
    is_declared: bool

    @property
    def is_separated(self) -> bool:
        """True if the recording distinguishes a lag from an offset."""
        return math.isfinite(self.late_s)


def timing_of(one: Fit, sampling: str, is_sampling_known: bool, declared: DriveFigures) -> Timing:
    """Timing of a torque, from a fit whose lag is free if the recording separates it.

    Parameters
    ----------
    one : Fit
    sampling : str
    is_sampling_known : bool
        True if the recording shows the sampling.
    declared : DriveFigures
        Declared lag and low-pass of the drive.
    """
    interval_s = one.pair.interval_s
    known_s, sigma_s = (0.5 * interval_s, _FILTERED * interval_s) if sampling == AVERAGE else (0.0, 0.0)
    if not is_sampling_known:
        sigma_s = 0.5 * interval_s
    if math.isfinite(declared.bandwidth_hz):
        known_s += 1.0 / (TURN * declared.bandwidth_hz)
    late_s = error_s = math.nan
    if separates_lag(one.pair):
        late_s, error_s = one.lag_s - known_s, math.hypot(lag_error_s(one), sigma_s)
    if math.isfinite(declared.lag_s):
        lag_s, sigma_s = known_s + declared.lag_s, math.hypot(_DECLARED_S, sigma_s)
        return Timing(late_s, error_s, lag_s, sigma_s, True)
    if math.isfinite(late_s):  # the measured lag is the sum of all its parts
        return Timing(late_s, error_s, max(0.0, one.lag_s), lag_error_s(one), False)
    return Timing(late_s, error_s, known_s, math.hypot(_UNKNOWN_S, sigma_s), False)


def lag_error_s(one: Fit) -> float:
    """Standard deviation of the lag [s], with the phase shift by clearances from speed to speed."""
    speed = np.quantile(np.abs(one.crank()[1]), [0.1, 0.9])
    shift = one.error.lag_rad / max(float(speed[1] - speed[0]), 1.0e-9)
    return math.hypot(one.sigma.get("lag_s", math.inf), shift)


def cadence_rpm(one: Fit) -> tuple[float, float]:
    """Usual cadence, negative for clockwise, and its tolerance [rpm]: a tenth, or more if needed."""
    speed = slow_speed(one.pair) * one.ratio * 60.0 / TURN
    # the speed near which the leg walks most of the time
    centres = np.quantile(speed, np.linspace(0.05, 0.95, 19))
    near = [np.abs(speed - centre) < _ONE_CADENCE * abs(centre) for centre in centres]
    usual = float(np.median(speed[max(near, key=np.count_nonzero)]))
    departures = np.abs(speed - usual)
    own = departures[departures < _ONE_CADENCE * abs(usual)]
    most = _MARGIN * float(own.max()) if len(own) else 0.0
    return float(f"{usual:.3g}"), float(f"{max(0.1 * abs(usual), most):.2g}")


def cadences_rpm(one: Fit) -> list[float]:
    """Cadences that last at least a tenth of the time [rpm], rounded to 5 rpm."""
    speed = slow_speed(one.pair) * one.ratio * 60.0 / TURN
    values, counts = np.unique(np.round(speed / 5.0) * 5.0, return_counts=True)
    return [float(value) for value in values[counts > 0.1 * len(speed)]]


# Decide between averages (mean since the previous sample) and instants (torque at the stamp).
#
# Joints with clearance let go and hit again. The bodies' momenta are bounded, so the torque missing during a
# flight comes with the impact after it: means cancel over a part of a turn. Of impacts that last a
# millisecond, instants meet some and miss others: their errors add up as independent ones do.


_WINDOW = 0.125  # turns, half of the window's width: it contains some flights with their impacts
# Harmonics of a turn that are removed: a load or wrong masses repeat with the turn, and do not cancel either.
# More harmonics would remove repeating impacts as well, and the rest of the means would no longer cancel
_HARMONICS = 8
_SINGULAR = 1.0e-9
_CHUNKS = 12
# Energy of windows over the energy of independent samples: averages have 0.002 to 0.009, instants 0.4 to 1.1
# (legs in full coordinates, five joints of 0.2 to 0.4 mm, 35 to 90 rpm, 100 to 500 Hz)
_AVERAGES_TO, _INSTANTS_FROM, _INSTANTS_TO = 0.04, 0.08, 3.0
_SURE_SAMPLING = 2.0  # standard deviations of the recording
_NOISE_ERROR = 0.25  # relative error of the noise's variance
_HIDDEN = 0.5  # no decision if sensor noise is more than this fraction of the residual's energy
_LARGE = 0.3  # fraction of the torque: impacts have 0.5 to 2; smaller ones do not drown slow errors of 0.02
_ROUGH = 0.5  # energy of neighbours' steps over the energy of independent steps; 0.8 to 1.4 for impacts


def sampling_of(one: Fit, model: TorqueModel) -> tuple[str, str]:
    """Sampling, empty if it is not known, and the reason: whether errors of neighbouring samples cancel."""
    rest, noise = _rest(one, model), sensor_noise(one)
    size, steps = float(rest.var()) - noise**2, 0.5 * float(np.mean(np.diff(rest) ** 2)) - noise**2
    is_large = float(rest.std()) >= _LARGE * float(one.measured.std())
    turn = TURN / max(float(np.median(np.abs(one.crank()[1]))), 1.0e-9) / one.pair.interval_s
    added, error = added_up(rest, noise, max(2, round(_WINDOW * turn)))
    is_rough = size > _HIDDEN * float(rest.var()) and steps > _ROUGH * size
    if not (is_large and is_rough and math.isfinite(added)):
        return "", "only impacts tell averages from instantaneous values, and no impact is above the noise"
    low, high = added - _SURE_SAMPLING * error, added + _SURE_SAMPLING * error
    why = (
        f"sums of neighbouring errors are {added:.2g} ± {error:.1g} times as large as for independent errors "
        f"(averages: up to {_AVERAGES_TO:g}, instantaneous values: from {_INSTANTS_FROM:g} on)"
    )
    if 0.0 < high < _AVERAGES_TO:
        return AVERAGE, why
    return (INSTANT if low > _INSTANTS_FROM and high < _INSTANTS_TO else ""), why


def added_up(rest: Floats, noise: float, half: int) -> tuple[float, float]:
    """Energy of triangular windows of a residual, over the energy of independent samples, and its error.

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
    """Part (n,) of each torque sample beyond the ideal leg's torque and the slow repeating residual.

    Changes of the speed are left out: there the smoothed motion, and so the leg's torque, is wrong for a
    while.
    """
    angle, speed, acceleration = one.crank()
    rest: Floats = one.pair.torque - one.gain * model.torque(angle, speed, acceleration)[0]
    waves = np.outer(np.arange(_HARMONICS + 1.0), angle)
    still = np.concatenate([np.cos(waves), np.sin(waves[1:])])
    square = (slow_speed(one.pair) * one.ratio) ** 2
    by = np.concatenate([still, still * (square / square.mean())])
    steady = is_steady(one.pair)
    by, rest = by[:, steady], rest[steady]
    # columns are similar at one cadence; they are few, so the normal equations save most of the time
    coefficients = np.linalg.pinv(by @ by.T, rcond=_SINGULAR, hermitian=True) @ (by @ rest)
    return np.asarray(rest - coefficients @ by)


_QUIETEST = 5  # parts of the turn of 48: so many that the median of an odd number is taken
_MEDIAN_TO_SIGMA = 1.0 / 0.6745  # sigma over the median absolute value of a normal distribution


def sensor_noise(one: Fit) -> float:
    """Standard deviation of the torque samples in the quietest parts of the turn, in the sensor's unit.

    From differences of neighbours, so that the leg's own torque, which changes slowly, drops out; in the
    parts of the turn without impacts these are the sensor's. Even turns choose the parts, odd ones are
    measured: the least of many estimates would be too small.
    """
    first, length = one.blocks.first, one.blocks.length
    block = np.repeat(np.arange(len(first)), length)
    inside = np.diff(block) == 0
    part = one.blocks.part[block[1:][inside]]
    # second differences would be quieter still, but steps of the sensor's resolution repeat in them
    steps, bins, is_odd = np.diff(one.pair.torque)[inside], part % BINS, part // BINS % 2 == 1
    even = {i: _size(steps[(bins == i) & ~is_odd]) for i in np.unique(bins).tolist()}
    quietest = sorted(even, key=lambda i: even[i])[:_QUIETEST]
    sizes = [_size(steps[(bins == i) & is_odd]) for i in quietest]
    return float(np.median(sizes)) * _MEDIAN_TO_SIGMA / math.sqrt(2.0) if sizes else 0.0


def _size(steps: Floats) -> float:
    """Median size of steps about their median; infinite if there are none."""
    return float(np.median(np.abs(steps - np.median(steps)))) if len(steps) else math.inf

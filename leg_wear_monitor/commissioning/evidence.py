"""Evidence of a walk on its sensors and drive: timing, sampling, noise, load."""

import math

import attrs
import numpy as np

from leg_wear_monitor.estimate.body_torques import body_torques
from leg_wear_monitor.estimate.drive import DriveFigures
from leg_wear_monitor.estimate.joint_motion import Pair, is_steady, slow_speed
from leg_wear_monitor.estimate.least_squares import solved
from leg_wear_monitor.estimate.torque_fit import BINS, Fit, Terms, fit, repeating
from leg_wear_monitor.estimate.torque_model import TorqueModel
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.twin.sample import AVERAGE, INSTANT

# Torque that repeats with each turn and does not fit the ideal leg: foot load, other masses, a different leg.


# Clearances of 0.3 mm in five joints of the default leg repeat with 0.03 to 0.17 of the torque, the most at
# 30 rpm and of a sensor that samples instants, whose impacts do not average out
_NOTABLE = 0.2
# repeating rest below which a load is not looked for: sensors that average have up to 0.05
_LEAST_LOAD = 0.06
_EXPLAINS = 0.5  # a cause is named if it explains this fraction of the energy of the repeating rest
_SURE_CAUSE = 5.0  # standard deviations


@attrs.frozen
class Load:
    """A foot load that explains most of the torque residual.

    Attributes
    ----------
    force_n, sigma_n : float
        Upward force at its peak, and its standard deviation [N].
    explained : float
        Fraction of the energy of the repeating rest.
    """

    force_n: float
    sigma_n: float
    explained: float


def with_load(one: Fit, model: TorqueModel, terms: Terms) -> tuple[Fit, Load | None]:
    """The fit with a foot load, if that explains most of the rest that repeats; else the fit as it is."""
    before = repeating(one) ** 2
    if not model.load.any() or before < _LEAST_LOAD**2:
        return one, None
    loaded = fit(one.pair, model, one.refined, attrs.evolve(terms, load=True), with_errors=True)
    after = repeating(loaded) ** 2
    force, sigma = loaded.linear["load"] / loaded.gain, loaded.sigma["load"] / abs(loaded.gain)
    explained = 1.0 - after / before if before > 0.0 else 0.0
    if explained < _EXPLAINS or abs(force) < _SURE_CAUSE * sigma or loaded.gain * one.gain < 0.0:
        return one, None
    return loaded, Load(force, sigma, explained)


def does_not_fit(one: Fit, mechanism: Mechanism) -> str:
    """The repeating residual, and the body whose mass would explain most of it; empty if it is small."""
    rest = repeating(one)
    if rest < _NOTABLE:
        return ""
    sentence = (
        f"{100.0 * rest:.0f} % of the torque repeats with each turn and does not fit {mechanism.name}: "
        "other masses or lengths, a spring, a load, or impacts that a sensor of instants does not average"
    )
    body, change, explained = _heavier(one, mechanism)
    if explained < _EXPLAINS:
        return f"{sentence}; no body's mass alone explains it"
    more = f"{100.0 * abs(change):.0f} % {'more' if change > 0.0 else 'less'} mass and inertia of {body}"
    return f"{sentence}; {more} would explain {100.0 * explained:.0f} % of it"


def _heavier(one: Fit, mechanism: Mechanism) -> tuple[str, float, float]:
    """Body, relative change of its mass, and the fraction of the rest's energy that this explains."""
    angle, speed, acceleration = one.crank()
    before = float(one.rest @ one.rest)
    floor = before - len(one.rest) * (repeating(one) * float(one.measured.std())) ** 2
    best = ("", 0.0, 0.0)
    for name, tables in zip(mechanism.bodies, body_torques(mechanism).mass, strict=True):
        more = TorqueModel(tables, np.zeros(tables.shape[1])).torque(angle, speed, acceleration)[0]
        by = np.stack([one.blocks.mean(more), one.predicted / one.gain, np.ones_like(one.rest)])
        coefficients = solved(by.T, one.rest)
        left: Floats = one.rest - coefficients @ by
        explained = (before - float(left @ left)) / max(before - floor, 1.0e-12)
        gain = one.gain + float(coefficients[1])
        change = float(coefficients[0]) / gain if gain else -1.0
        if explained > best[2] and abs(change) < 1.0:
            best = (name, change, min(explained, 1.0))
    return best


# Noise of the torque: of the sensor where the joints are quiet, and of everything that does not repeat.


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


def scatter(one: Fit) -> float:
    """RMS of the residual that does not repeat, in means over a twelfth of a turn, in the sensor's unit."""
    energy = float(np.mean(one.rest**2)) - (repeating(one) * float(one.measured.std())) ** 2
    return math.sqrt(max(energy, 0.0))


# Several speeds separate a lag of the torque from an offset of the crank; also the cadence.


_SPEED_SPREAD = 0.15  # relative spread of the speed from which on a lag is separated from the offset
_FILTERED = 0.25  # intervals late: behind a low-pass, instants look like averages, and are not late by a half
# a drive may have no lag to speak of, or any up to 30 ms: current loops, filters, buses; neither is likelier
_MOST_S, _STEP_S = 0.030, 0.00025
_UNKNOWN_S = 0.0122  # RMS lag if nothing is measured: then the proposal allows for no lag
_DECLARED_S = 0.001  # error of a declared lag
_MARGIN = 1.5  # cadence tolerance over the observed departures
_ONE_CADENCE = 0.2  # relative distance from the usual cadence beyond which the cadence is a different one


def separates_lag(pair: Pair) -> bool:
    """Whether the crank walks at speeds different enough to tell a lag from an offset.

    In one recording: each has an offset of its own, as its encoder may have started anew.
    """
    speed = slow_speed(pair)
    spans = [np.quantile(speed[pair.recording == i], [0.1, 0.9]) for i in np.unique(pair.recording)]
    return any(abs(high - low) > _SPEED_SPREAD * max(abs(high), abs(low)) for low, high in spans)


@attrs.frozen
class Timing:
    """When a torque is measured, as far as it is known.

    Attributes
    ----------
    is_lag_separated : bool
        Whether the recording tells a lag from an offset.
    late_s, error_s : float
        Time by which the torque is late in addition to its sampling, and its standard deviation [s]; NaN if
        it is not separated.
    sampling_s, sampling_sigma_s : float
        Lag of the sampling (half a sampling interval for averages) and of a declared low-pass, and its
        standard deviation.
    declared_s : float
        Declared lag of the drive [s]; NaN without one.
    """

    is_lag_separated: bool
    late_s: float
    error_s: float
    sampling_s: float
    sampling_sigma_s: float = 0.0
    declared_s: float = math.nan

    @property
    def lag_s(self) -> float:
        """Lag to allow for, from sampling and drive [s]."""
        return self.sampling_s + self._drive[0]

    @property
    def lag_sigma_s(self) -> float:
        """Standard deviation of the lag to allow for [s]."""
        sigma = self._drive[1]
        # if only the whole lag is measured, its parts have the error of the drive's part
        if self.is_lag_separated:
            return sigma
        return math.hypot(sigma, self.sampling_sigma_s)

    @property
    def _drive(self) -> tuple[float, float]:
        """Expected lag of the drive in addition to its sampling, and its standard deviation [s]."""
        is_declared = math.isfinite(self.declared_s)
        if not self.is_lag_separated:
            return (self.declared_s, _DECLARED_S) if is_declared else (0.0, _UNKNOWN_S)
        lag = np.arange(0.0, 2.0 * _MOST_S, _STEP_S)
        if is_declared:
            prior = np.exp(-0.5 * ((lag - self.declared_s) / _DECLARED_S) ** 2)
        else:
            prior = np.where(lag <= _MOST_S, _STEP_S / _MOST_S, 0.0)
            prior[0] += 1.0
        away = (self.late_s - lag) / self.error_s
        likely = prior * np.exp(-0.5 * (away**2 - float(np.min(away**2))))
        likely /= likely.sum()
        mean = float(likely @ lag)
        return mean, math.sqrt(float(likely @ (lag - mean) ** 2))


def timing_of(one: Fit, sampling: str, is_sampling_known: bool, declared: DriveFigures) -> Timing:
    """Timing of a torque with a sampling, from a fit whose lag is free if the recording separates it.

    Parameters
    ----------
    one : Fit
    sampling : str
    is_sampling_known : bool
        Whether the recording shows the sampling.
    declared : DriveFigures
        Declared lag and low-pass of the drive.
    """
    interval_s = one.pair.interval_s
    known_s, sigma_s = (0.5 * interval_s, _FILTERED * interval_s) if sampling == AVERAGE else (0.0, 0.0)
    if math.isfinite(declared.bandwidth_hz):
        known_s += 1.0 / (TURN * declared.bandwidth_hz)
    if not is_sampling_known:
        sigma_s = 0.5 * interval_s
    if not separates_lag(one.pair):
        return Timing(False, math.nan, math.nan, known_s, sigma_s, declared.lag_s)
    error_s = math.hypot(lag_error_s(one), sigma_s)
    return Timing(True, one.lag_s - known_s, error_s, known_s, sigma_s, declared.lag_s)


def lag_error_s(one: Fit) -> float:
    """Standard deviation of the lag [s], with the phase shift by clearances from speed to speed."""
    speed = np.quantile(np.abs(one.crank()[1]), [0.1, 0.9])
    shift = one.error.lag_rad / max(float(speed[1] - speed[0]), 1.0e-9)
    return math.hypot(one.sigma.get("lag_s", math.inf), shift)


def cadence_rpm(one: Fit) -> tuple[float, float]:
    """Usual cadence, negative for clockwise, and its tolerance [rpm]: a tenth, or more if needed."""
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
# Typical energy of windows over the energy of independent samples, and how much legs differ (natural
# logarithm): the default leg in full coordinates, five joints of 0.2 to 0.4 mm, 35 to 90 rpm, 100 to 500 Hz;
# averages have 0.002 to 0.009, instants 0.4 to 1.1
_TYPICAL = {AVERAGE: 0.005, INSTANT: 0.65}
_LEGS_DIFFER = 0.7
_SURE_ODDS = 20.0
_MOST_ODDS = 1000.0  # the typical values are not known so well that more could be said
_SURE_SAMPLING = 2.0  # standard deviations of the recording
_STRANGE = 3.0  # energy that neither kind adds up to
_LEAST = 1.0e-4  # smaller energies are rounding
_NOISE_ERROR = 0.25  # relative error of the noise's variance
_HIDDEN = 0.5  # fraction of sensor noise in the residual's energy from which nothing is decided
_LARGE = 0.3  # fraction of the torque: impacts have 0.5 to 2; smaller ones do not drown slow errors of 0.02
_NARROWER, _FLAT = 3.0, 0.5  # independent errors add up as much in narrow windows, slow ones less
_ROUGH = 0.5  # energy of neighbours' steps over the energy of independent steps; 0.8 to 1.4 for impacts


@attrs.frozen
class Sampling:
    """Meaning of a torque sample, as far as it is known.

    Attributes
    ----------
    value : str
        ``average``, ``instant``, or empty if it is not known.
    why : str
        Reason for the value, or why it is not known.
    """

    value: str
    why: str


def sampling_of(one: Fit, model: TorqueModel) -> Sampling:
    """Judge by whether the errors of neighbouring samples cancel; without impacts, by the lag."""
    rest, noise = _rest(one, model), sensor_noise(one)
    turn = TURN / max(float(np.median(np.abs(one.crank()[1]))), 1.0e-9) / one.pair.interval_s
    added, error = added_up(rest, noise, max(2, round(_WINDOW * turn)))
    narrow = added_up(rest, noise, max(2, round(_WINDOW / _NARROWER * turn)))[0]
    if not _shows_impacts(one, rest, noise) or not added + _SURE_SAMPLING * error > 0.0:
        return _by_lag(one)
    near = min(_TYPICAL, key=lambda name: abs(math.log(max(added, _LEAST) / _TYPICAL[name])))
    odds = min(_odds(near, added - _SURE_SAMPLING * error), _odds(near, added + _SURE_SAMPLING * error))
    sentence = (
        f"the errors of neighbouring samples add up to {added:.2g} ± {error:.1g} times as much as for "
        f"independent samples (averages: about {_TYPICAL[AVERAGE]:g}, instants: about {_TYPICAL[INSTANT]:g})"
    )
    if added > _STRANGE or (near == INSTANT and narrow < _FLAT * added):
        return Sampling("", f"{sentence}: does a load change slowly?")
    if odds < _SURE_ODDS:
        return Sampling("", f"{sentence}: probably {near}, but this is not certain")
    return Sampling(near, f"odds {'at least ' if odds >= _MOST_ODDS else ''}{odds:.0f} to 1: {sentence}")


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
    # columns are alike at one cadence; few of them, so that the normal equations save most of the time
    coefficients = np.linalg.pinv(by @ by.T, rcond=_SINGULAR, hermitian=True) @ (by @ rest)
    return np.asarray(rest - coefficients @ by)

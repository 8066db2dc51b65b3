"""The signature of a gait cycle: mean and roughness of its drive torque in each phase.

Throughout, F is the length of a signature: mean and roughness in each phase.
"""

import math

import attrs
import numpy as np

from leg_wear_monitor.estimate.drive import DIRECT, Channel
from leg_wear_monitor.mechanism.arrays import Flags, Floats, Ints
from leg_wear_monitor.mechanism.position import TURN, build_linkage, one_cycle
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.twin.reference import POINTS
from leg_wear_monitor.twin.references import FRICTIONS, MASSES, TorqueReference

SAMPLES = 200  # per gait cycle: faster samples are averaged, since clearances show at this rate already

_MOST_PHASES, _LEAST_PHASES = 80, 10
_IN_PHASE = 2.5  # samples, at least: with fewer, some phases have one only
_FLOOR = 1.0e-4  # fraction of the torque's size below which roughness is rounding
_CLIP = 8.0  # upper bound of a peak, as a multiple of the torque's size


@attrs.frozen
class TorqueSensor:
    """How a drive torque is measured.

    Attributes
    ----------
    period_s : float
        Time between two samples.
    cycle_s : float
        Duration of a gait cycle.
    size_nm : float
        RMS of the leg's drive torque.
    is_instant : bool
        True if a sample is the torque at its instant; False if it is the mean since the previous sample.
    noise_nm : float
        Standard deviation of a sample.
    channel : Channel
    """

    period_s: float
    cycle_s: float
    size_nm: float
    is_instant: bool = False
    noise_nm: float = 0.0
    channel: Channel = DIRECT

    @property
    def together(self) -> int:
        """Number of samples that are averaged into one."""
        return max(1, round(self.cycle_s / SAMPLES / self.period_s))

    @property
    def phases(self) -> int:
        """Number of phases of a signature; 0 where samples are too few for one."""
        phases = min(_MOST_PHASES, int(round(self.samples) / _IN_PHASE))
        return phases if phases >= _LEAST_PHASES else 0

    @property
    def samples(self) -> float:
        """Number of samples in a gait cycle, after averaging."""
        return self.cycle_s / (self.period_s * self.together)

    def shown(self, torque: Floats, speed: float) -> Floats:
        """Torques (..., n) [N m] as the samples show them: behind the channel, and averaged.

        Without the channel's load friction, which is not linear.

        Parameters
        ----------
        torque : (..., n) array
            At equal steps of the crank angle from 0 [N m].
        speed : float
            Of the crank [rad/s]; the torque of a crank that turns backwards is in reversed order of time.
        """
        points, along = torque.shape[-1], np.sign(speed)
        omega = along * TURN * np.fft.rfftfreq(points, TURN / abs(speed) / points)
        response = self.channel.response(omega)
        # a sample is the mean since the previous sample, or an instantaneous value; instantaneous values are
        # averaged
        if not self.is_instant:
            half = 0.5 * omega * self.period_s
            response *= np.sinc(half / math.pi) * np.exp(-1j * half)
        lags = np.arange(self.together) * self.period_s
        response *= np.exp(-1j * np.outer(omega, lags)).mean(axis=1)
        return np.asarray(np.fft.irfft(np.fft.rfft(torque) * response, points))


def averaged(values: Floats, together: int) -> Floats:
    """Means (n // together,) of neighbouring values; the remainder at the end is dropped."""
    whole = len(values) // together * together
    return np.asarray(values[:whole].reshape(-1, together).mean(axis=1))


def signatures(cycle: Ints, angle: Floats, torque: Floats, step: Floats, sensor: TorqueSensor) -> Floats:
    """Signatures of gait cycles.

    Parameters
    ----------
    cycle : (n,) array of int
        Number of the gait cycle of each sample, from 0.
    angle, torque : (n,) arrays
        Crank angle [rad] and drive torque [N m] of each sample.
    step : (n,) array
        Torque minus the torque of the sample before [N m]; NaN if the sample before was lost.
    sensor : TorqueSensor

    Returns
    -------
    (cycles, 2 phases) array
        Mean torque [N m] of each phase, then the logarithm of the mean size of the steps [log N m]; NaN for a
        phase without samples.
    """
    shape = int(cycle.max()) + 1 if len(cycle) else 0, sensor.phases
    known = np.isfinite(step)
    steps = PhaseMeans(cycle[known], angle[known], shape)
    return signatures_by_phase(PhaseMeans(cycle, angle, shape), steps, torque, step[known], sensor)


class PhaseMeans:
    """Means of quantities in each phase of gait cycles, for samples at given angles.

    A sample counts for the two phases whose middles are next to it, the nearer one more. Samples often come
    at the same angles in each cycle, and a small shift must not move them into a different phase.

    Parameters
    ----------
    cycle : (n,) array of int
        Number of the gait cycle of each sample, from 0.
    angle : (n,) array
        Crank angle of each sample [rad].
    shape : (cycles, phases)
        Shape of the means.
    """

    def __init__(self, cycle: Ints, angle: Floats, shape: tuple[int, int]) -> None:
        phases = shape[1]
        place = ((angle / TURN) % 1.0) * phases - 0.5
        before = np.floor(place).astype(np.int64)
        self._shape = shape
        self._flat = np.concatenate([cycle * phases + at % phases for at in (before, before + 1)])
        self._weight = np.concatenate([before + 1 - place, place - before])
        self._counts = np.bincount(self._flat, self._weight, shape[0] * phases)

    def of(self, value: Floats) -> Floats:
        """Means of a quantity (n,), NaN for a phase without samples."""
        sums = np.bincount(self._flat, self._weight * np.tile(value, 2), len(self._counts))
        with np.errstate(invalid="ignore"):
            return np.asarray((sums / self._counts).reshape(self._shape))


def signatures_by_phase(
    samples: PhaseMeans, steps: PhaseMeans, torque: Floats, step: Floats, sensor: TorqueSensor
) -> Floats:
    """`signatures` of samples whose phases are known: torques (n,) and steps (m,) at their places."""
    furthest = _CLIP * sensor.size_nm
    mean = samples.of(np.clip(torque, -furthest, furthest))
    rough = steps.of(np.minimum(np.abs(step), furthest))
    return np.hstack([mean, np.log(rough + _FLOOR * sensor.size_nm)])


def quiet_phases(signature: Floats) -> Floats:
    """Mask (2 phases,) of the roughness entries of the calmest third of the phases."""
    phases = len(signature) // 2
    limit = np.sort(signature[phases:])[math.ceil(phases / 3) - 1]
    return np.concatenate([np.zeros(phases, bool), signature[phases:] <= limit])


# The drive torque of the leg with ideal joints, and its effect on a signature.


_POINTS = 240  # points per gait cycle: three in each of 80 phases


def ideal_torque(mechanism: Mechanism, speed: float) -> Floats:
    """Drive torque (n,) [N m] with ideal joints at equal steps of the crank angle, at a crank speed [rad/s].

    Raises
    ------
    AssemblyError
        If the linkage does not close or has a dead point.
    """
    return one_cycle(build_linkage(mechanism), _POINTS, speed).drive_torque


def signature_of_torque(torque: Floats, sensor: TorqueSensor, speed: float) -> Floats:
    """Signature's change (F,) by a torque that a sensor shows, without roughness; as `TorqueSensor.shown`."""
    angle: Floats = np.linspace(0.0, TURN, len(torque), endpoint=False)
    first, phases = np.zeros(len(torque), np.int64), sensor.phases
    mean = PhaseMeans(first, angle, (1, phases)).of(sensor.shown(torque, speed))[0]
    return np.concatenate([mean, np.zeros(phases)])


# A torque sensor on simulated legs: its samples, and their signatures.


# seed of the noise on simulated torques: equal at each start, but different per leg. With equal noise, the
# covariance would be too small
_SEED = 20261122

# draws of this noise for the mean signature of a leg: the noise is three quarters of the scatter of simulated
# cycles, and drawing it again costs no simulation
_DRAWS = 4
_PART_OF_SAMPLE = 0.618  # fraction of a sampling period by which samples move in each simulated gait cycle
_PLACES = 8  # tried places of samples within their period


class SimulatedSensor:
    """A sensor on legs of a reference that were simulated for the same number of gait cycles.

    Its samples fall at the same times on each of these legs.

    Parameters
    ----------
    reference : TorqueReference
    cycles : int
        Simulated gait cycles of a leg.
    sensor : TorqueSensor
    offset_rad : float
        Added to the crank angle.
    late : float, optional
        Time from the start of each gait cycle to its first sample, in periods of the sensor; by default
        different in each, because samples of a real leg fall anywhere as well.
    """

    def __init__(
        self,
        reference: TorqueReference,
        cycles: int,
        sensor: TorqueSensor,
        offset_rad: float = 0.0,
        late: float | None = None,
    ) -> None:
        self._reference, self._sensor = reference, sensor
        period = TURN / abs(reference.profile.speed)
        each = np.arange(1, cycles + 1) * _PART_OF_SAMPLE % 1.0 if late is None else np.full(cycles, late)
        # groups of averaged samples from the start of each gait cycle, without the incomplete one at its end
        averages = int(period / (sensor.period_s * sensor.together)) + 1
        last = sensor.period_s * (sensor.together * np.arange(1, averages + 1) - 1)
        ends = sensor.period_s * each[:, None] + last
        cycle, which = np.nonzero(ends < period)
        self._step_s, self._cycles = period / POINTS, cycles
        # places and distances of samples are counted in points of the simulated torque, from its first one
        self._between = sensor.period_s / self._step_s
        self._ends = cycle * POINTS + ends[cycle, which] / self._step_s
        angle = np.interp(self._ends % POINTS, np.arange(POINTS + 1.0), reference.angle) + offset_rad
        self._angle, shape, later = angle, (cycles, sensor.phases), which > 0
        self._phases = PhaseMeans(cycle, angle, shape), PhaseMeans(cycle[later], angle[later], shape)
        self._has_step = later

    def signatures(self, leg: int, scale: float = 1.0) -> Floats:
        """Signatures (cycles, F) of a leg, with the sensor's noise and a factor on the torque."""
        torque = scale * self.torque(leg)
        return self.signatures_of(torque + self._sensor.noise_nm * self.noise(leg))

    def draws(self, leg: int) -> Floats:
        """Signatures (draws, cycles, F) of a leg with different noise; the first draw is `signatures`."""
        torque = self.torque(leg)
        noisy = (torque + self._sensor.noise_nm * self.noise(leg, draw) for draw in range(_DRAWS))
        return np.array([self.signatures_of(one) for one in noisy])

    def signatures_of(self, torque: Floats) -> Floats:
        """Signatures (cycles, F) of averaged samples (n,) [N m]."""
        step = np.diff(torque, prepend=0.0)[self._has_step]
        return signatures_by_phase(*self._phases, torque, step, self._sensor)

    def torque(self, leg: int, channel: Channel | None = None) -> Floats:
        """Averaged samples (n,) of a leg [N m], without noise; behind the sensor's channel or a given one."""
        simulated = self._reference.torque_nm[leg][: self._cycles].astype(float).ravel()
        direction = float(np.sign(self._reference.profile.speed))
        torque = (channel or self._sensor.channel).received(simulated, self._step_s, direction)
        if self._sensor.is_instant:
            back = np.arange(self._sensor.together) * self._between
            at = np.maximum(self._ends[:, None] - back, 0.0).astype(np.int64)
            return np.asarray(torque[at].mean(axis=1))
        # a mean is the difference of the torque sums received up to the ends of two samples
        since = self._sensor.together * self._between
        received = _received_until(torque, np.stack([self._ends - since, self._ends]))
        return np.asarray(np.diff(received, axis=0)[0] / since)

    def slope(self, leg: int, torque: Floats, step: float) -> Floats:
        """Change of the mean signature (F,) of a leg by a torque that is added to its own.

        Parameters
        ----------
        leg : int
        torque : (n,) array
            At equal steps of the crank angle from 0 [N m].
        step : float
            Fraction of the torque for the finite difference of the signature.
        """
        even: Floats = np.linspace(0.0, TURN, len(torque), endpoint=False)
        shown = self._sensor.shown(torque, self._reference.profile.speed)
        added = step * np.interp(self._angle % TURN, even, shown, period=TURN)
        own = self.torque(leg) + self._sensor.noise_nm * self.noise(leg)
        more, less = (self.signatures_of(own + sign * added).mean(axis=0) for sign in (1.0, -1.0))
        return np.asarray((more - less) / (2.0 * step))

    def noise(self, leg: int, draw: int = 0) -> Floats:
        """Noise (n,) of averaged samples of a leg, in standard deviations of a single sample."""
        drawn = np.random.default_rng([_SEED, leg, draw]).standard_normal(len(self._ends))
        return np.asarray(drawn / math.sqrt(self._sensor.together))


def _received_until(torque: Floats, place: Floats) -> Floats:
    """Sums of a torque (n,) [N m] up to places (...), in its steps; beyond its ends, it is as there."""
    at = np.clip(place.astype(np.int64), 0, len(torque) - 1)
    return np.asarray(np.cumsum(torque)[at] + (place - at - 1.0) * torque[at])


# Expected signatures over clearances, for a torque sensor, from simulated torque references.


_WEAKEST_NOISE, _STRONGEST_NOISE = 1.0e-4, 1.0  # fractions of the torque's size
_HALVINGS = 12  # halvings of that range: the noise is found to 0.2 %


@attrs.frozen(eq=False)
class Changes:
    """Changes of a signature (F,) by each of n quantities, as far as they were simulated.

    Attributes
    ----------
    grid : (n, s) array
        Increasing values of each quantity.
    change : (n, s, F) array
        Change of the signature at each value.
    scatter : (n, s) array
        Variance of each change, as a part of a gait cycle's variance; 0 if it is exact.
    """

    grid: Floats
    change: Floats
    scatter: Floats = attrs.field()
    _log_grid: Floats = attrs.field(init=False)
    _slopes: Floats = attrs.field(init=False)

    def at(self, value: Floats, which: Ints) -> tuple[Floats, Floats]:
        """Changes (m, F) by quantities ``which`` (m,), and their slopes.

        The slopes (m, F) are derivatives by the logarithms of the values (m,). The changes are linear in
        these between points of the grid, and beyond its ends.
        """
        x = np.log(value)
        i = (self._log_grid[which, 1:-1] < x[:, None]).sum(axis=1)
        slopes, beyond = self._slopes[which, i], x - self._log_grid[which, i]
        return self.change[which, i] + beyond[:, None] * slopes, slopes

    def scatter_at(self, value: Floats, which: Ints) -> Floats:
        """Variances (m,) of the changes, as in `at`, as a part of a gait cycle's variance."""
        pairs = zip(np.log(value), which, strict=True)
        return np.array([np.interp(x, self._log_grid[i], self.scatter[i]) for x, i in pairs])

    @scatter.default
    def _exact(self) -> Floats:
        return np.zeros(self.grid.shape)

    @_log_grid.default
    def _logarithms(self) -> Floats:
        return np.asarray(np.log(self.grid))

    @_slopes.default
    def _derivatives(self) -> Floats:
        """Derivatives (n, s - 1, F) by the logarithm of a value between points of the grid."""
        with np.errstate(invalid="ignore", divide="ignore"):  # a clearance that cannot grow further
            return np.asarray(np.diff(self.change, axis=1) / np.diff(self._log_grid, axis=1)[:, :, None])


@attrs.frozen(eq=False)
class SignatureModel:
    """Expected signatures (F,) of a leg, as a function of its k clearances, masses, and friction.

    The effects of several quantities add up.

    Attributes
    ----------
    sensor : TorqueSensor
    mean : (F,) array
        Signature of the expected leg.
    joints : Changes
        Changes by the clearances [m].
    covariance : (F, F) array
        Covariance of the signature of one gait cycle.
    own : float
        Variance of the mean signature of a simulated leg, as a part of a gait cycle's variance.
    masses, friction : Changes
        Changes by factors on the mass of each body, and on the friction in all joints; empty if such legs
        were not simulated.
    places : (F, F) array
        Covariance of the changes if samples come at other angles of the crank; 0 if nothing changes.
    """

    sensor: TorqueSensor
    mean: Floats
    joints: Changes
    covariance: Floats
    own: float
    masses: Changes = attrs.field()
    friction: Changes = attrs.field()
    places: Floats = attrs.field()

    def at(self, clearance_m: Floats) -> tuple[Floats, Floats]:
        """Signature (F,) at clearances (k,) [m], and its derivatives (F, k) by their logarithms."""
        change, slopes = self.joints.at(clearance_m, np.arange(len(clearance_m)))
        return self.mean + change.sum(axis=0), slopes.T

    def scatter_at(self, clearance_m: Floats) -> float:
        """Variance of the signature at clearances (k,) [m], as a part of a gait cycle's variance."""
        return float(self.joints.scatter_at(clearance_m, np.arange(len(clearance_m))).sum())

    @masses.default
    @friction.default
    def _none(self) -> Changes:
        return Changes(np.ones((0, 2)), np.zeros((0, 2, len(self.mean))))

    @places.default
    def _anywhere(self) -> Floats:
        return np.zeros((len(self.mean), len(self.mean)))


def signature_model(reference: TorqueReference, sensor: TorqueSensor) -> SignatureModel:
    """Model for a sensor, whose noise is added to the simulated torques."""
    drawn = _drawn(reference, sensor)
    cycles = np.array([leg.shape[1] for leg in drawn])
    means = np.array([leg.mean(axis=(0, 1)) for leg in drawn])
    alike = drawn[: 1 + reference.of_joints.size]  # dry joints scatter more than this leg does
    scatter = np.concatenate([leg[0] - leg[0].mean(axis=0) for leg in alike])
    covariance = scatter.T @ scatter / (len(scatter) - len(alike))
    own = _part_of_cycle(drawn[0], covariance) / cycles

    def changes(legs: Ints, grid: Floats) -> Changes:
        """Effects of n quantities whose values in legs (n, s) differ from the expected leg."""
        found, variance = np.zeros((*grid.shape, len(means[0]))), np.zeros(grid.shape)
        for i, each in enumerate(legs):
            ratio = np.log(grid[i, 1:] / grid[i, 0])
            found[i, 1:], variance[i, 1:] = without_scatter(
                ratio, means[each] - means[0], covariance, own[each], own[0]
            )
        place = np.argsort(grid, axis=1, kind="stable")
        grid, variance = (np.take_along_axis(one, place, 1) for one in (grid, variance))
        return Changes(grid, np.take_along_axis(found, place[:, :, None], 1), variance)

    clearance_m = [reference.clearance_m[[0, *legs], k] for k, legs in enumerate(reference.of_joints)]
    joints = changes(reference.of_joints, np.array(clearance_m))
    masses, friction = (
        changes(legs, np.tile([1.0, *factors], (len(legs), 1)))
        for legs, factors in ((reference.of_masses, MASSES), (reference.of_frictions, FRICTIONS))
    )
    places = _of_places(reference, sensor)
    return SignatureModel(sensor, means[0], joints, covariance, float(own[1]), masses, friction, places)


def _of_places(reference: TorqueReference, sensor: TorqueSensor) -> Floats:
    """Covariance (F, F) of the mean signature of the expected leg over the places of its samples.

    A drive that shares the sensor's clock leaves samples at their angles until either is restarted, and a
    separate clock moves them within minutes or hours.
    """
    cycles, places = len(reference.torque_nm[0]), (np.arange(_PLACES) + 0.5) / _PLACES
    legs = [SimulatedSensor(reference, cycles, sensor, late=place) for place in places]
    return np.asarray(np.cov(np.array([leg.signatures(0).mean(axis=0) for leg in legs]).T))


def _drawn(reference: TorqueReference, sensor: TorqueSensor) -> list[Floats]:
    """Signatures (draws, cycles, F) of each leg of a reference."""
    cycles = [len(torque) for torque in reference.torque_nm]
    sensors = {n: SimulatedSensor(reference, n, sensor) for n in set(cycles)}
    return [sensors[n].draws(leg) for leg, n in enumerate(cycles)]


def _part_of_cycle(drawn: Floats, covariance: Floats) -> float:
    """Variance of a gait cycle over several draws of noise (draws, cycles, F), over a single draw's."""
    off = (drawn - drawn.mean(axis=0)).reshape(-1, drawn.shape[2])
    square = float((off * np.linalg.solve(covariance, off.T).T).sum())
    part = square / ((len(drawn) - 1) * drawn[0].size)
    return float(1.0 - min(part, 1.0) * (1.0 - 1.0 / len(drawn)))


# variances per logarithm of a clearance that are tried, of a cycle's variance
_STEEPNESS = np.geomspace(1.0e-4, 1.0e4, 81)

# number of entries as which the mean of all entries counts in the estimate of one entry's steepness. J
# changes a few phases much and the others hardly: with one steepness for all, its estimated change was 0.81
# to 0.89 of the true change at 1.35 and 1.5 times its clearance, with 4 it is 0.88 to 0.95; with 2, three
# times as much mere scatter is left for a joint that the torque does not show (2026-11-26)
_ALIKE = 4.0
# smaller eigenvalues, relative to the largest, are rounding errors if there are fewer cycles than entries
_LEAST_VARIANCE = 1.0e-12


def without_scatter(
    wider: Floats, change: Floats, covariance: Floats, own: Floats, common: float
) -> tuple[Floats, Floats]:
    """Most probable changes (s, F) of a signature by one clearance, given changes of chaotic simulated legs.

    The change of each entry, in units of the scatter of a gait cycle, is modelled as a random walk over the
    clearance's logarithm, from zero at the expected clearance. Its steepness makes its own s changes and,
    with a fixed weight, the changes of all entries most probable. Without this, the scatter of simulated
    means counts as an effect of the clearance, and a clearance that the torque does not show seems known.

    Parameters
    ----------
    wider : (s,) array
        Logarithm of the clearance over the expected clearance; negative if it is narrower.
    change : (s, F) array
    covariance : (F, F) array
        Covariance of a gait cycle.
    own : (s,) array
        Variance of the mean of each leg, as a part of a gait cycle's variance.
    common : float
        The same for the expected leg, which all changes have in common.

    Returns
    -------
    change : (s, F) array
    variance : (s,) array
        Variance of each change, as a part of a gait cycle's variance.
    """
    # the symmetric root keeps each entry with its phase
    variances, axes = np.linalg.eigh(covariance)
    root = np.sqrt(np.maximum(variances, _LEAST_VARIANCE * variances[-1]))
    measured = change @ (axes / root) @ axes.T
    scatter = np.diag(own) + common
    is_alike = np.sign(wider)[:, None] == np.sign(wider)
    walk = np.where(is_alike, np.minimum(np.abs(wider)[:, None], np.abs(wider)), 0.0)
    total = _STEEPNESS[:, None, None] * walk + scatter
    # minus twice the logarithms of the likelihoods (steepness, F), less a constant
    square = (measured * np.linalg.solve(total, measured[None])).sum(axis=1)
    unlikely = np.linalg.slogdet(total)[1][:, None] + square
    best = (unlikely + _ALIKE * unlikely.mean(axis=1, keepdims=True)).argmin(axis=0)
    taken = _STEEPNESS[:, None, None] * np.linalg.solve(total, walk[None]).swapaxes(1, 2)
    left = _STEEPNESS[:, None] * np.diagonal(walk - taken @ walk, axis1=1, axis2=2)
    found = np.einsum("fst,tf->sf", taken[best], measured)
    return found @ (axes * root) @ axes.T, left[best].mean(axis=0)


def simulated_signatures(
    reference: TorqueReference,
    leg: int,
    sensor: TorqueSensor,
    scale: float = 1.0,
    offset_rad: float = 0.0,
    cycles: int | None = None,
) -> Floats:
    """Signatures (cycles, F) of a leg of a reference.

    Parameters
    ----------
    reference : TorqueReference
    leg : int
    sensor : TorqueSensor
    scale : float
        Factor on the torque.
    offset_rad : float
        Added to the crank angle.
    cycles : int, optional
        The first ones; all by default.
    """
    simulated = SimulatedSensor(reference, cycles or len(reference.torque_nm[leg]), sensor, offset_rad)
    return simulated.signatures(leg, scale)


def mean_signatures(reference: TorqueReference, sensor: TorqueSensor) -> Floats:
    """Mean signatures (legs, F) of the legs of a reference."""
    return np.array([leg.mean(axis=(0, 1)) for leg in _drawn(reference, sensor)])


def with_noise_of(reference: TorqueReference, sensor: TorqueSensor, measured: Floats) -> TorqueSensor:
    """The sensor with the noise that makes simulated torques as rough as measured ones in quiet phases.

    Parameters
    ----------
    reference : TorqueReference
    sensor : TorqueSensor
    measured : (F,) array
        Mean of measured signatures.
    """
    simulated = SimulatedSensor(reference, len(reference.torque_nm[0]), sensor)
    torque, noise = simulated.torque(0), simulated.noise(0)
    quiet = quiet_phases(simulated.signatures_of(torque + sensor.noise_nm * noise).mean(axis=0))
    low, high = (np.log(fraction * sensor.size_nm) for fraction in (_WEAKEST_NOISE, _STRONGEST_NOISE))
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        rough = simulated.signatures_of(torque + np.exp(middle) * noise).mean(axis=0)
        low, high = (middle, high) if (rough - measured)[quiet].mean() < 0.0 else (low, middle)
    return attrs.evolve(sensor, noise_nm=float(np.exp(0.5 * (low + high))))


# The baseline of a leg: its drive torque when it was commissioned.


@attrs.frozen(eq=False)
class CommissionedTorque:
    """Signatures of the drive torque of a leg whose k clearances were known.

    Attributes
    ----------
    stamp_ns : int
        End of the last gait cycle.
    clearance_m : (k,) array
        Modelled clearances at that time.
    signatures : (cycles, F) array
        Signature of each gait cycle, as in `estimate.signature`.
    sigma_m : (k,) array
        Standard deviations of the clearances: above 0 if a correction set them.
    channel : Channel
        Drive dynamics by these signatures.
    speed : float
        Mean speed of the crank [rad/s]; 0 if it is not known.
    temperature_c : float
        Mean temperature of the drive [°C]; NaN if it was not measured.
    period_s : float
        Period of the sensor that measured the torque; NaN if it is not known.
    together : int
        Number of samples that were averaged into one.
    is_instant : bool
        As in `TorqueSensor`.
    """

    stamp_ns: int
    clearance_m: Floats
    signatures: Floats
    sigma_m: Floats = attrs.field()
    channel: Channel = DIRECT
    speed: float = 0.0
    temperature_c: float = math.nan
    period_s: float = math.nan
    together: int = 1
    is_instant: bool = False

    @sigma_m.default
    def _as_modelled(self) -> Floats:
        return np.zeros(len(self.clearance_m))

    @property
    def is_as_modelled(self) -> bool:
        """True if the clearances were modelled, not corrected."""
        return not self.sigma_m.any()

    @property
    def is_unknown(self) -> Flags:
        """True if each clearance (k,) is unknown: a correction elsewhere may hide its opening."""
        return np.asarray(self.sigma_m >= self.clearance_m)

    @property
    def cycles(self) -> int:
        """Number of gait cycles."""
        return len(self.signatures)

    def measured_by(self, sensor: TorqueSensor) -> "CommissionedTorque":
        """Expected signatures for a sensor."""
        period_s, together, is_instant = sensor.period_s, sensor.together, sensor.is_instant
        return attrs.evolve(self, period_s=period_s, together=together, is_instant=is_instant)

    def is_of(self, sensor: TorqueSensor) -> bool:
        """True if a sensor measured the torque in the same way; if unknown, in as many phases."""
        own = self.period_s, self.together, self.is_instant
        is_same = own == (sensor.period_s, sensor.together, sensor.is_instant)
        return (is_same or math.isnan(self.period_s)) and self.signatures.shape[1] == 2 * sensor.phases

    @property
    def mean(self) -> Floats:
        """Mean signature (F,)."""
        return np.asarray(self.signatures.mean(axis=0))

"""The channel of a drive and its sensor, from the mean signature of a commissioned leg.

The measured torque is often motor current, which is delayed by a control loop, passes a low-pass of first or
second order (a mean over some time is much like one), and contains the friction of a gear that grows with the
load. At one cadence, an offset of the crank looks like a delay. All of these move or change the phases in
which the torque is rough, and these phases tell the joints apart. So a simulated torque has to pass the same
channel before it is compared with the samples.
"""

import functools
import math
from collections.abc import Callable, Iterable, Sequence

import attrs
import numpy as np

from leg_wear_monitor.estimate.cause import LEAST_DELAY_S, MOST_DELAY_S, Cause
from leg_wear_monitor.estimate.drive import (
    DIRECT,
    UNDECLARED,
    Channel,
    DriveFigures,
)
from leg_wear_monitor.estimate.explanations import Nuisance
from leg_wear_monitor.estimate.least_squares import Point, gauss_newton
from leg_wear_monitor.estimate.signature import (
    SimulatedSensor,
    TorqueSensor,
    simulated_signatures,
    with_noise_of,
)
from leg_wear_monitor.estimate.torque_model import PHASE_ERROR_RAD
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.twin.references import TorqueReference

# tried delays, and low-passes of 100 to 10 Hz
_DELAYS_S = np.linspace(LEAST_DELAY_S, MOST_DELAY_S, 13)
_TIME_CONSTANTS_S = (0.0, *(1.0 / (TURN * hz) for hz in (100.0, 70.0, 50.0, 35.0, 25.0, 20.0, 14.0, 10.0)))
_STEP_S = 0.0025  # search range on both sides of the best delay
# The search starts at the best of them. For each free value: bounds, the difference for a derivative, the
# longest step, and the step that ends the search.
_RANGES = {
    "delay_s": (LEAST_DELAY_S, MOST_DELAY_S, 0.0005, 0.0025, 0.0001),
    "time_constant_s": (0.0005, 0.025, 0.0005, 0.0025, 0.0001),
    "second_order": (0.0, 0.5, 0.05, 0.2, 0.01),
}
_CYCLES = 20  # simulated gait cycles; enough for a mean signature
# A channel has to lower the mean square of the residual by this much, compared with none: unknown masses and
# lengths change it by about 0.2 (docs/explanation/diagnosis.md).
_CHANNEL_IMPROVEMENT = 0.3
# A low-pass that is not of first order must lower the mean square by this much. With masses 4 % off and a
# worn joint, a second order does by 0.17 to 1.8 behind Butterworth's and means over 20 to 40 ms (24 of 25,
# one 0.05), by at most 0.04 behind low-passes of first order and lags (n = 20).
_IMPROVEMENT = 0.05
_SECOND_ORDER = 0.3  # the first that is tried

# Load friction, as a fraction of the transmitted torque: 0.04 in harmonic drives to 0.31 in planetary servos.
_FRICTION_SIGMA, _MOST_FRICTION = 0.2, 0.45  # prior standard deviation about 0; largest one
_FRICTION_STEP = 0.1  # for its derivative
# load friction has to lower the mean square by this much: chance does by 0.02, a load friction of 0.1 by 0.8
_FRICTION_IMPROVEMENT = 0.1
_FRICTION_ERROR = 0.02  # error of the estimate, from legs with masses 4 % off
_DECLARED_FRICTION_SIGMA = 0.03  # standard deviation of a declared load friction

# Standard deviations of the differences between a leg and its reference besides the drive dynamics. In each
# phase, an error of the model: of the mean torque, as a fraction of the torque's size, and of the logarithm
# of the roughness. Clearances other than modelled: of their logarithm. Masses, lengths, bias, scale and load:
# by cause, in units of their `Nuisance`. On the ground, the first harmonics of the mean torque are free
# instead.
_MEAN_SIGMA, _ROUGHNESS_SIGMA, _CLEARANCE_SIGMA = 0.05, 0.4, math.log(1.25)
_SPREADS = {Cause.MASS: 0.05, Cause.LENGTH: 0.005, Cause.FRICTION: 5.0, Cause.SCALE: 0.1, Cause.LOAD: 20.0}
_SPREAD_FACTOR = 5.0  # factor on `Nuisance.spread`, the usual change of a known leg, if this is larger
# number of these harmonics, and their standard deviation: far above the torque of a leg
_HARMONICS, _HARMONIC_NM = 16, 100.0


@attrs.frozen(eq=False)
class ChannelFit:
    """Drive dynamics that explain a measured signature.

    Attributes
    ----------
    channel : Channel
    square : float
        Mean square of the residual, in units of its expected standard deviation.
    load_friction_sigma : float
        Standard deviation of the channel's load friction; NaN if the load friction is not observable, as on
        the ground, where the unknown load hides it.
    misfit : float
        Minus twice the logarithm of the likelihood, up to a constant; compares hypotheses.
    rest : (m,) array
        Residuals of the signature, and of the prior, in standard deviations.
    """

    channel: Channel
    square: float
    load_friction_sigma: float
    misfit: float
    rest: Floats = attrs.field(repr=False)


def with_channel_of(
    reference: TorqueReference,
    sensor: TorqueSensor,
    measured: Floats,
    nuisances: Sequence[Nuisance],
    figures: DriveFigures = UNDECLARED,
) -> TorqueSensor:
    """The sensor with the noise and the channel that explain the measured signature of an expected leg.

    Parameters
    ----------
    reference : TorqueReference
    sensor : TorqueSensor
    measured : (F,) array
        Mean of the measured signatures of a leg that is as expected.
    nuisances : sequence of Nuisance
    figures : DriveFigures, optional
        Declared values of the drive: a bandwidth is used as it is, a load friction is known within 0.03.
    """
    # the noise depends on the channel, and the channel on the noise: noise, channel, and the noise behind it
    plain = with_noise_of(reference, attrs.evolve(sensor, channel=DIRECT), measured)
    channel = channel_of(reference, plain, measured, nuisances, figures).channel
    if channel == DIRECT:
        return plain
    return with_noise_of(reference, attrs.evolve(plain, channel=channel), measured)


def channel_of(
    reference: TorqueReference,
    sensor: TorqueSensor,
    measured: Floats,
    nuisances: Sequence[Nuisance],
    figures: DriveFigures = UNDECLARED,
) -> ChannelFit:
    """The channel of a sensor whose noise is known; parameters as in `with_channel_of`.

    Two hypotheses are compared, and the more probable one decides: a leg in the air, whose mean torque is
    known within tolerances, and a leg on the ground under an unknown load, whose first harmonics say nothing.
    """
    variance = np.repeat([_MEAN_SIGMA * sensor.size_nm, _ROUGHNESS_SIGMA], sensor.phases) ** 2
    is_alone = len(reference.torque_nm) == 1
    if is_alone:  # the effect of clearances, mostly a shift of phases, is not simulated
        variance += np.square(PHASE_ERROR_RAD * _slopes(measured, sensor))
    tolerances = [
        max(_SPREADS[one.cause], _SPREAD_FACTOR * one.spread) * one.column
        for one in nuisances
        if one.cause in _SPREADS
    ]
    is_declared = not math.isnan(figures.load_friction)
    friction = (figures.load_friction, _DECLARED_FRICTION_SIGMA) if is_declared else (0.0, _FRICTION_SIGMA)
    in_air = _Hypothesis(np.diag(variance) + _covariance_of(np.array(tolerances)), *friction)
    ground_friction = friction if is_declared else (0.0, 0.0)  # not observable under an unknown load
    on_ground = _Hypothesis(
        np.diag(variance) + _covariance_of(_harmonic_columns(sensor.phases)), *ground_friction
    )
    phases_per_s = np.sign(reference.profile.speed) * sensor.phases / sensor.cycle_s
    hz = figures.bandwidth_hz
    time_constants_s = _TIME_CONSTANTS_S if math.isnan(hz) else (1.0 / (TURN * hz),)

    simulated = SimulatedSensor(reference, _CYCLES, sensor)
    noise = sensor.noise_nm * simulated.noise(0)

    @functools.cache  # both hypotheses try the same channels
    def residual(channel: Channel) -> Floats:
        behind = simulated.torque(0, channel) + noise
        return np.asarray(measured - simulated.signatures_of(behind).mean(axis=0))

    @functools.cache
    def filtered(low_pass: Channel) -> Floats:  # clearance columns without a delay
        return _clearance_columns(reference, attrs.evolve(sensor, channel=low_pass))

    def clearances(channel: Channel) -> Floats:
        low_pass = attrs.evolve(channel, delay_s=0.0)
        return _delayed(filtered(low_pass), float(phases_per_s * channel.delay_s))

    fits = [
        _best_channel(residual, clearances, each, time_constants_s, first_order=is_alone)
        for each in (in_air, on_ground)
    ]
    return min(fits, key=lambda fit: fit.misfit)


def _slopes(measured: Floats, sensor: TorqueSensor) -> Floats:
    """Sizes (F,) of a signature's derivatives by the crank angle; for the torque, from its roughness."""
    rough = measured[sensor.phases :]
    per_phase = 0.5 * np.abs(np.roll(rough, -1) - np.roll(rough, 1))
    return np.concatenate([np.exp(rough) * sensor.samples, per_phase * sensor.phases]) / TURN


class _Hypothesis:
    """How a leg may differ from its reference besides the channel: a covariance (F, F) of signatures.

    Load friction has a prior mean and standard deviation; with a standard deviation of 0, the mean is kept.
    """

    def __init__(self, covariance: Floats, friction: float, friction_sigma: float) -> None:
        self._whiten = np.linalg.inv(np.linalg.cholesky(covariance))
        self._friction, self._sigma = friction, friction_sigma
        self._log_size = float(np.linalg.slogdet(covariance)[1])

    def fit(
        self, channel: Channel, residual: Floats, friction_change: Floats, clearances: Floats
    ) -> ChannelFit:
        """Fit load friction and clearances to the residual of a channel (linear least squares with a prior).

        Parameters
        ----------
        channel : Channel
        residual : (F,) array
            Measured less simulated signature, without load friction.
        friction_change : (F,) array
            Change of the signature per unit of load friction.
        clearances : (k, F) array
            Change by one standard deviation of each clearance.
        """
        # each with a prior variance of 1
        columns = np.vstack([clearances, self._sigma * friction_change]) @ self._whiten.T
        residual = self._whiten @ (residual - self._friction * friction_change)
        information = columns @ columns.T + np.eye(len(columns))
        covariance = np.linalg.inv(information)
        x = covariance @ (columns @ residual)
        friction = self._friction + self._sigma * float(x[-1])
        sigma = math.hypot(self._sigma * float(covariance[-1, -1]) ** 0.5, _FRICTION_ERROR)
        if not 0.0 <= friction <= _MOST_FRICTION:
            friction = min(max(friction, 0.0), _MOST_FRICTION)
            # best clearances with the friction at its bound
            x += covariance[-1] * ((friction - self._friction) / self._sigma - x[-1]) / covariance[-1, -1]
        rest = np.concatenate([residual - x @ columns, x])
        square = float(rest @ rest)
        return ChannelFit(
            channel=attrs.evolve(channel, load_friction=friction),
            square=square / len(residual),
            load_friction_sigma=sigma if self._sigma else math.nan,
            misfit=square + self._log_size + float(np.linalg.slogdet(information)[1]),
            rest=rest,
        )


@attrs.frozen(eq=False)
class _Tried(Point):
    """A channel during the search."""

    fit: ChannelFit


def _best_channel(
    residual: Callable[[Channel], Floats],
    clearances: Callable[[Channel], Floats],
    hypothesis: _Hypothesis,
    time_constants_s: Sequence[float],
    *,
    first_order: bool,
) -> ChannelFit:
    """The channel with the least residual; None unless it is clearly better.

    Parameters
    ----------
    residual, clearances : callable
        Residual (F,) of a channel, and change (k, F) of the signature by clearances behind a channel without
        load friction.
    hypothesis : _Hypothesis
    time_constants_s : sequence of float
        Of the low-passes to try; without 0, a low-pass is declared.
    first_order : bool
        True if no others are tried: impacts tell them apart, of clearances as they are.
    """

    def fit_of(near: Channel) -> ChannelFit:
        channel = attrs.evolve(near, load_friction=0.0)  # the load friction is fitted again
        rubbing = attrs.evolve(channel, load_friction=_FRICTION_STEP)
        friction_change = (residual(channel) - residual(rubbing)) / _FRICTION_STEP
        return hypothesis.fit(channel, residual(channel), friction_change, clearances(channel))

    def least(fits: Iterable[ChannelFit]) -> ChannelFit:
        return min(fits, key=lambda fit: fit.square)

    # without delay and low-pass; with load friction only if it fits clearly better
    direct, none = fit_of(DIRECT), np.zeros_like(residual(DIRECT))
    frictionless = hypothesis.fit(DIRECT, residual(DIRECT), none, clearances(DIRECT))
    if frictionless.square - direct.square < _FRICTION_IMPROVEMENT:
        sigma = direct.load_friction_sigma
        direct = attrs.evolve(frictionless, channel=DIRECT, load_friction_sigma=sigma)
    # search over a grid of delay and low-pass, then refine the best point
    others = []
    for time_constant_s in time_constants_s:
        low_pass = Channel(time_constant_s=time_constant_s)
        best = least(fit_of(attrs.evolve(low_pass, delay_s=one)) for one in _DELAYS_S.tolist())
        near_s = best.channel.delay_s
        nearer = [attrs.evolve(low_pass, delay_s=near_s + step_s) for step_s in (-_STEP_S, _STEP_S)]
        others += [best, *map(fit_of, nearer)]
    is_declared, near = 0.0 not in time_constants_s, least(others).channel
    free = ("delay_s",) if is_declared or not near.time_constant_s else ("delay_s", "time_constant_s")
    other = _refined(fit_of, near, *free)
    if len(free) == 2 and not first_order:  # second order only if it is clearly better
        second = attrs.evolve(other.channel, second_order=_SECOND_ORDER)
        better = _refined(fit_of, second, *free, "second_order")
        if other.square - better.square > _IMPROVEMENT:
            other = better
    return other if is_declared or other.square < direct.square - _CHANNEL_IMPROVEMENT else direct


def _refined(fit_of: Callable[[Channel], ChannelFit], near: Channel, *free: str) -> ChannelFit:
    """The best channel near a given channel, with some attributes free."""
    low, high, difference, longest, done = np.array([_RANGES[name] for name in free]).T

    def fit_at(x: Floats) -> ChannelFit:
        return fit_of(attrs.evolve(near, **dict(zip(free, x.tolist(), strict=True))))

    def at(x: Floats) -> _Tried:
        fit, moved = fit_at(x), x + np.diag(difference)

        def slopes() -> Floats:
            return np.asarray(np.array([fit_at(one).rest - fit.rest for one in moved]).T / difference)

        return _Tried(fit.rest, slopes, fit)

    start = np.array([getattr(near, name) for name in free])
    return gauss_newton(at, start, low=low, high=high, longest=longest, done=done).point.fit


def _clearance_columns(reference: TorqueReference, sensor: TorqueSensor) -> Floats:
    """Columns (k, F): change of the signature by one standard deviation of each clearance.

    Among the legs of each joint, the leg with the smallest increase comes first.
    """
    firsts = reference.of_joints[:, :1].ravel().tolist()
    expected = simulated_signatures(reference, 0, sensor, cycles=_CYCLES).mean(axis=0)
    columns = np.zeros((len(firsts), len(expected)))
    for column, leg in zip(columns, firsts, strict=True):
        log_ratio = np.log(reference.clearance_m[leg] / reference.clearance_m[0]).sum()
        if log_ratio > 0.0:  # 0 for a joint that has its largest clearance already
            changed = simulated_signatures(reference, leg, sensor, cycles=_CYCLES).mean(axis=0)
            column[:] = _CLEARANCE_SIGMA / log_ratio * (changed - expected)
    return columns


def _delayed(columns: Floats, by_phases: float) -> Floats:
    """Columns (k, F) of signatures that come later by a number of phases, whole or not."""
    phases = columns.shape[1] // 2
    waves = np.fft.rfft(columns.reshape(len(columns), 2, phases))
    shifted = waves * np.exp(-1j * TURN * by_phases / phases * np.arange(waves.shape[2]))
    return np.asarray(np.fft.irfft(shifted, phases).reshape(columns.shape))


def _harmonic_columns(phases: int) -> Floats:
    """Columns (1 + 2 _HARMONICS, F): constant and first harmonics of the mean torque; roughness unchanged."""
    order = np.arange(1, _HARMONICS + 1)[:, None] * (TURN * np.arange(phases) / phases)
    columns = np.vstack([np.ones((1, phases)), np.cos(order), np.sin(order)])
    return _HARMONIC_NM * np.hstack([columns, np.zeros_like(columns)])


def _covariance_of(columns: Floats) -> Floats:
    """Covariance (F, F) of columns (n, F), each with a standard deviation of 1."""
    return np.asarray(columns.T @ columns)

"""The channel between a leg's drive torque and its samples: late, filtered, and with friction of the load.

Torque is often motor current through a gear: it comes late by a control loop, through a low-pass, and the
gear loses a part of what it transmits. At one cadence an offset of the crank looks like a delay. All of these
move or change the phases in which a torque is rough, by which clearances are told apart, so a reference has
to pass the same channel as the samples.
"""

import functools
import math
from collections.abc import Callable, Iterable, Sequence

import attrs
import numpy as np

from leg_wear_monitor.estimate.cause import Cause
from leg_wear_monitor.estimate.drive_figures import UNDECLARED, DriveFigures
from leg_wear_monitor.estimate.explanations import Nuisance
from leg_wear_monitor.estimate.signature import DIRECT, Channel, TorqueSensor
from leg_wear_monitor.estimate.signature_model import simulated_signatures, with_noise_of
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.twin.reference.torque_reference import TorqueReference

# an offset of 0.13 rad at 60 rpm, a lag of 40 ms; low-passes of 100 to 10 Hz
_DELAYS_S = 0.005 * np.arange(-4, 9)
_TIME_CONSTANTS_S = (0.0, *(1.0 / (TURN * hz) for hz in (100.0, 70.0, 50.0, 35.0, 25.0, 20.0, 14.0, 10.0)))
_FINER_S = (0.0025, 0.00125)  # steps about the best delay
_CYCLES = 20  # simulated gait cycles that are enough for a mean signature
# mean square by which another channel has to explain more than none: what the masses and lengths of a leg
# leave unexplained moves it by about 0.2 (docs/explanation/diagnosis.md)
_SURELY_BETTER = 0.3

# friction of the load: 0.04 (harmonic drives) to 0.31 (planetary servos) of the torque; by how much it has to
# lower the mean square: 0.02 by chance, 0.8 by a friction of 0.1
_FRICTION, _MOST_FRICTION, _FRICTION_STEP, _FRICTION_BETTER = 0.2, 0.45, 0.1, 0.1
_FRICTION_ERROR = 0.02  # of it, by legs with masses 4 % off
_DECLARED_FRICTION = 0.03  # error of a declared one

# what a leg may have beside its channel: an error of the model in each phase, of the torque's size and of the
# roughness' logarithm, other clearances than the counted ones, by their logarithms, and other masses,
# lengths, bias, scale and load; or, on the ground, anything in the first harmonics of the mean torque
_MEAN, _ROUGHNESS, _CLEARANCE = 0.05, 0.4, math.log(1.25)
_SPREADS = {Cause.MASS: 0.05, Cause.LENGTH: 0.005, Cause.FRICTION: 5.0, Cause.SCALE: 0.1, Cause.LOAD: 20.0}
_UNKNOWN = 5.0  # times the usual changes, where these are larger
_HARMONICS, _HARMONIC_NM = 16, 100.0


@attrs.frozen
class ChannelFit:
    """A channel that was found.

    Attributes
    ----------
    channel : Channel
    square : float
        Mean square of what it leaves over.
    load_friction_sigma : float
        Standard deviation of its load friction; NaN where that is not observable: on the ground, the load
        hides it.
    misfit : float
        Minus twice the logarithm of its likelihood, less a constant.
    """

    channel: Channel
    square: float
    load_friction_sigma: float
    misfit: float


def with_channel_of(
    reference: TorqueReference,
    sensor: TorqueSensor,
    measured: Floats,
    nuisances: Sequence[Nuisance],
    figures: DriveFigures = UNDECLARED,
) -> TorqueSensor:
    """The sensor with the noise and the channel by which the expected leg has a measured signature.

    Parameters
    ----------
    reference : TorqueReference
    sensor : TorqueSensor
    measured : (F,) array
        Mean of measured signatures of a leg as expected.
    nuisances : sequence of Nuisance
    figures : DriveFigures, optional
        Declared ones: a bandwidth is taken as it is, a load friction is known within 0.03.
    """
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
    """The channel of a sensor whose noise is known, as of `with_channel_of`.

    The mean torque of a leg in the air has tolerances; under a load that nobody knows, its first harmonics
    tell nothing. The more probable of the two decides.
    """
    variance = np.repeat([_MEAN * sensor.size_nm, _ROUGHNESS], sensor.phases) ** 2
    known = [
        max(_SPREADS[one.cause], _UNKNOWN * one.spread) * one.column
        for one in nuisances
        if one.cause in _SPREADS
    ]
    is_declared = not math.isnan(figures.load_friction)
    friction = (figures.load_friction, _DECLARED_FRICTION) if is_declared else (0.0, _FRICTION)
    in_air = _Leg(np.diag(variance) + _products(np.array(known)), *friction)
    unseen = friction if is_declared else (0.0, 0.0)
    on_ground = _Leg(np.diag(variance) + _products(_harmonics(sensor.phases)), *unseen)
    reach = np.sign(reference.profile.speed) * sensor.phases / sensor.cycle_s  # phases a second
    hz = figures.bandwidth_hz
    time_constants_s = _TIME_CONSTANTS_S if math.isnan(hz) else (1.0 / (TURN * hz),)

    @functools.cache  # both legs try the same channels
    def rest(channel: Channel) -> Floats:
        behind = attrs.evolve(sensor, channel=channel)
        return np.asarray(measured - simulated_signatures(reference, 0, behind, cycles=_CYCLES).mean(axis=0))

    @functools.cache
    def filtered(time_constant_s: float) -> Floats:
        channel = Channel(time_constant_s=time_constant_s)
        return _clearances(reference, attrs.evolve(sensor, channel=channel))

    def clearances(channel: Channel) -> Floats:
        return _moved(filtered(channel.time_constant_s), float(reach * channel.delay_s))

    found = [_best(rest, clearances, leg, time_constants_s) for leg in (in_air, on_ground)]
    return min(found, key=lambda one: one.misfit)


class _Leg:
    """What a leg may have beside its channel, as a covariance (F, F), and what a channel leaves over.

    Load friction has a prior mean and standard deviation; with a deviation of 0 it is not looked for.
    """

    def __init__(self, covariance: Floats, friction: float, friction_sigma: float) -> None:
        self._weight = np.linalg.inv(covariance)
        self._friction, self._sigma = friction, friction_sigma
        self._log_size = float(np.linalg.slogdet(covariance)[1])

    def fit(self, channel: Channel, rest: Floats, rubbing: Floats, clearances: Floats) -> ChannelFit:
        """What a channel leaves over, with the load friction and the clearances by which it is least.

        Parameters
        ----------
        channel : Channel
        rest : (F,) array
            What it leaves over without load friction.
        rubbing : (F,) array
            Change of the signature by load friction.
        clearances : (k, F) array
            That by a standard deviation of each clearance.
        """
        columns = np.vstack([clearances, self._sigma * rubbing])  # each with a standard deviation of 1
        rest = rest - self._friction * rubbing
        information = columns @ self._weight @ columns.T + np.eye(len(columns))
        covariance, along = np.linalg.inv(information), columns @ self._weight @ rest
        x = covariance @ along
        friction = self._friction + self._sigma * float(x[-1])
        sigma = math.hypot(self._sigma * float(covariance[-1, -1]) ** 0.5, _FRICTION_ERROR)
        if not 0.0 <= friction <= _MOST_FRICTION:
            friction = min(max(friction, 0.0), _MOST_FRICTION)
            x += covariance[-1] * ((friction - self._friction) / self._sigma - x[-1]) / covariance[-1, -1]
        left = rest - x @ columns
        square = float(left @ self._weight @ left + x @ x)
        return ChannelFit(
            channel=attrs.evolve(channel, load_friction=friction),
            square=square / len(rest),
            load_friction_sigma=sigma if self._sigma else math.nan,
            misfit=square + self._log_size + float(np.linalg.slogdet(information)[1]),
        )


def _best(
    rest: Callable[[Channel], Floats],
    clearances: Callable[[Channel], Floats],
    leg: _Leg,
    time_constants_s: Sequence[float],
) -> ChannelFit:
    """The channel that leaves least.

    Parameters
    ----------
    rest, clearances : callable
        What a channel leaves over (F,), and what clearances change behind it (k, F), without load friction.
    leg : _Leg
    time_constants_s : sequence of float
    """

    def tried(time_constant_s: float, delay_s: float) -> ChannelFit:
        channel = Channel(delay_s=delay_s, time_constant_s=time_constant_s)
        more = attrs.evolve(channel, load_friction=_FRICTION_STEP)
        rubbing = (rest(channel) - rest(more)) / _FRICTION_STEP
        return leg.fit(channel, rest(channel), rubbing, clearances(channel))

    def least(found: Iterable[ChannelFit]) -> ChannelFit:
        return min(found, key=lambda one: one.square)

    best = tried(0.0, 0.0)
    without = leg.fit(DIRECT, rest(DIRECT), np.zeros_like(rest(DIRECT)), clearances(DIRECT))
    if without.square - best.square < _FRICTION_BETTER:
        best = attrs.evolve(without, channel=DIRECT, load_friction_sigma=best.load_friction_sigma)
    other = []
    for time_constant_s in time_constants_s:
        found = {delay_s: tried(time_constant_s, delay_s) for delay_s in _DELAYS_S.tolist()}
        for step_s in _FINER_S:
            middle = min(found, key=lambda at: found[at].square)
            found |= {at: tried(time_constant_s, at) for at in (middle - step_s, middle + step_s)}
        other.append(least(found.values()))
    is_sure = 0.0 not in time_constants_s or least(other).square < best.square - _SURELY_BETTER
    return least(other) if is_sure else best


def _clearances(reference: TorqueReference, sensor: TorqueSensor) -> Floats:
    """Columns (k, F) of a standard deviation of each clearance, by the smallest wider one of a reference."""
    joints, wider = reference.clearance_m.shape[1], len(reference.torque_nm) - 1
    expected = simulated_signatures(reference, 0, sensor, cycles=_CYCLES).mean(axis=0)
    columns = np.zeros((joints if wider else 0, len(expected)))
    for column, leg in zip(columns, range(1, wider + 1, max(1, wider // joints)), strict=True):
        by = np.log(reference.clearance_m[leg] / reference.clearance_m[0]).sum()
        if by > 0.0:  # else it can be no wider
            changed = simulated_signatures(reference, leg, sensor, cycles=_CYCLES).mean(axis=0)
            column[:] = _CLEARANCE / by * (changed - expected)
    return columns


def _moved(columns: Floats, by: float) -> Floats:
    """Columns (k, F) of signatures that are late by a part of a phase, or by several."""
    phases = columns.shape[1] // 2
    waves = np.fft.rfft(columns.reshape(len(columns), 2, phases))
    turned = waves * np.exp(-1j * TURN * by / phases * np.arange(waves.shape[2]))
    return np.asarray(np.fft.irfft(turned, phases).reshape(columns.shape))


def _harmonics(phases: int) -> Floats:
    """Columns (1 + 2 _HARMONICS, F) of the first harmonics of a mean torque."""
    order = np.arange(1, _HARMONICS + 1)[:, None] * (TURN * np.arange(phases) / phases)
    columns = np.vstack([np.ones((1, phases)), np.cos(order), np.sin(order)])
    return _HARMONIC_NM * np.hstack([columns, np.zeros_like(columns)])


def _products(columns: Floats) -> Floats:
    """Covariance (F, F) of columns (n, F), each with a standard deviation of 1."""
    return np.asarray(columns.T @ columns)

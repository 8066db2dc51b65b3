"""The channel between a leg's drive torque and its samples: late, filtered, and with friction of the load.

Torque is often motor current through a gear: it comes late by a control loop, through a low-pass, and the
gear loses a part of what it transmits. At one cadence an offset of the crank looks like a delay. All of these
move or change the phases in which a torque is rough, by which clearances are told apart, so a reference has
to pass the same channel as the samples.
"""

import functools
import math
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import attrs
import numpy as np

from leg_wear_monitor.estimate.cause import Cause
from leg_wear_monitor.estimate.explanations import Nuisance, body_torques
from leg_wear_monitor.estimate.signature import (
    DIRECT,
    UNDECLARED,
    Channel,
    DriveFigures,
    TorqueSensor,
    simulated_signatures,
    with_noise_of,
)
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.twin.reference import COUPLING_DAMPING, CrankProfile, LegParameters
from leg_wear_monitor.twin.torque_reference import TorqueReference

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


# Compliance between the measured crank angle and the crank, from the mean torque of a commissioned leg.
#
# Behind a coupling or a belt the crank of a leg swings at some 4 to 20 Hz, and the measured torque is that of
# the spring: harmonics near the resonance grow, those above vanish. A delay or a low-pass turns and weakens
# harmonics in their order, and masses, lengths and friction change the first ones, so all of these are left
# free. The leg has ideal joints here, so an identification with simulated legs goes on from what is found.


STIFFNESS_NM_PER_RAD = np.geomspace(
    8000.0, 150.0, 24
)  # that are tried, neighbours at half a resonance's width

_POINTS = 256  # of a gait cycle
_MEAN_HARMONICS = 12  # of the mean torque
# of the measured torque's size: what a leg with clearances is off one with ideal joints, in the mean and with
# each harmonic more
_ERROR, _ERROR_BY_HARMONIC = 0.01, 0.005
_MASS, _LENGTH = 0.03, 0.006  # standard deviations about the file's, as in `identification`
# those of friction, over the torque's size, and load friction; of the sensor's scale and delay
_DRIVE_FRICTION, _LOAD_FRICTION, _SCALE, _DELAY_S = 0.5, 0.2, 0.1, 0.04
_RIGID_TIME_CONSTANTS_S = (0.0, 0.004, 0.008, 0.016)  # low-passes that are tried on a rigid drive: to 10 Hz
_ROUNDS = 4  # of Gauss and Newton

# Sums of squares of what is left over: with a coupling at most the first, and less than that of a rigid drive
# by the second. Behind 200 to 5000 N m/rad they are 2 to 15, and 31 to 593 as of a rigid drive; of rigid ones
# 2.5 to 8, with a lag, a low-pass, load friction, lengths within 5 % or twice the friction of joints, too,
# and 310 to 1500 on the ground (docs/explanation/diagnosis.md)
_FITS, _BETTER = 40.0, 15.0

# rad/(N m): what clearances of 0.3 mm add where the torque of some 20 N m changes its sign, 1.3e-4 to 1.9e-4
# behind 200 to 5000 N m/rad; at most this part of the compliance
_CLEARANCES, _MOST_OF_IT = 1.5e-4, 0.5

# dampings over the critical one that are tried, and what losses in clearances add to it: 0.005 to 0.015
_DAMPINGS, _DAMPING_OF_CLEARANCES = np.geomspace(0.01, 0.16, 9), 0.012

_RIGID_NM_PER_RAD = 2.0e4  # a resonance above 35 Hz, which no signature of 200 samples shows


class _Fit(NamedTuple):
    """A fitted leg: sum of squares, factors on bodies less 1 (2 bodies,), and how the crank deviates."""

    square: float
    bodies: Floats
    deviation: Floats


def leg_behind_coupling(
    mechanism: Mechanism, sensor: TorqueSensor, profile: CrankProfile, mean: Floats
) -> LegParameters | None:
    """The leg with a compliant drive that explains a mean torque; None where a rigid drive does as well.

    Parameters
    ----------
    mechanism : Mechanism
    sensor : TorqueSensor
    profile : CrankProfile
        Of the measured angle.
    mean : (F,) array
        Mean signature of a leg as expected.
    """
    search = _Search(mechanism, sensor, profile, mean[: sensor.phases])
    rigid = min(search.fit(0.0, time_constant_s).square for time_constant_s in _RIGID_TIME_CONSTANTS_S)
    if rigid < _BETTER:
        return None
    found: list[_Fit] = []
    for stiffness in STIFFNESS_NM_PER_RAD:
        found.append(search.fit(stiffness, 0.0, found[-1] if found else None))
    squares = np.array([one.square for one in found])
    best = int(np.argmin(squares))
    if squares[best] > min(_FITS, rigid - _BETTER) or best in (0, len(found) - 1):
        return None
    stiffness = math.exp(
        _vertex(np.log(STIFFNESS_NM_PER_RAD[best - 1 : best + 2]), squares[best - 1 : best + 2])
    )
    mass, length = np.split(1.0 + found[best].bodies, 2)
    compliance = max((1.0 - _MOST_OF_IT) / stiffness, 1.0 / stiffness - _CLEARANCES)
    damping = search.damping_at(stiffness, found[best])
    return LegParameters(mass, length, compliance=compliance, damping=damping)


def compliance_of(stiffness_nm_per_rad: float) -> float:
    """Compliance [rad/(N m)] of a drive whose stiffness is declared; 0 where it may be taken for rigid."""
    return 0.0 if stiffness_nm_per_rad >= _RIGID_NM_PER_RAD else 1.0 / stiffness_nm_per_rad


class _Search:
    """Fits of legs behind couplings to a mean torque by phase (phases,)."""

    def __init__(
        self, mechanism: Mechanism, sensor: TorqueSensor, profile: CrankProfile, mean: Floats
    ) -> None:
        torques, self._speed = body_torques(mechanism), profile.speed
        self._own, self._by_body = torques.own, np.concatenate([torques.mass, torques.length])
        self._phi = np.arange(_POINTS) * (TURN / _POINTS)
        motion = np.array([profile.at(phi) for phi in self._phi])
        self._angle, self._rate, self._acceleration = motion.T
        order = np.fft.fftfreq(_POINTS, 1.0 / _POINTS)[:, None]
        unit = np.fft.fft(np.eye(_POINTS), axis=0)
        self._slope = np.asarray(np.fft.ifft(1j * order * unit, axis=0).real * self._speed)
        phases = len(mean)
        self._order = np.arange(min(_MEAN_HARMONICS, phases // 2 - 1) + 1.0)
        middle = (np.arange(phases) + 0.5) * (TURN / phases)
        self._wanted = np.exp(-1j * np.outer(self._order, middle)) @ mean / phases
        size = float(np.std(mean))
        error = size * (_ERROR + _ERROR_BY_HARMONIC * self._order)
        self._weight = np.where(self._order > 0.0, math.sqrt(2.0), 1.0) / error
        # means over a sample that end at its angle, in phases that fade into their neighbours
        omega = self._order * self._speed
        self._sensor = np.sinc(self._order / phases) ** 2
        if not sensor.is_instant:
            period = sensor.period_s * sensor.together
            self._sensor = self._sensor * np.sinc(omega * period / TURN) * np.exp(-0.5j * omega * period)
        bodies = len(mechanism.bodies)
        drive = _DRIVE_FRICTION * size, _LOAD_FRICTION, _SCALE, _DELAY_S
        self._sigma = np.array([*[_MASS] * bodies, *[_LENGTH] * bodies, *drive])

    def damping_at(self, stiffness: float, start: _Fit) -> float:
        """Damping over the critical one of a leg behind a stiffness [N m/rad]."""
        squares = np.array([self.fit(stiffness, 0.0, start, ratio).square for ratio in _DAMPINGS])
        best = int(np.clip(np.argmin(squares), 1, len(_DAMPINGS) - 2))
        near = slice(best - 1, best + 2)
        found = math.exp(_vertex(np.log(_DAMPINGS[near]), squares[near]))
        return float(np.clip(found - _DAMPING_OF_CLEARANCES, _DAMPINGS[0], _DAMPINGS[-1]))

    def fit(
        self,
        stiffness: float,
        time_constant_s: float,
        start: _Fit | None = None,
        damping_ratio: float = COUPLING_DAMPING,
    ) -> _Fit:
        """The most probable leg behind a stiffness [N m/rad], 0 for a rigid drive, and a low-pass [s]."""
        x, omega = np.zeros(len(self._sigma)), self._order * self._speed
        deviation = start.deviation if start else np.zeros(_POINTS)
        if start:
            x[:-4] = start.bodies
        square = math.inf
        for _ in range(_ROUNDS):
            tables = self._own + np.tensordot(x[:-4], self._by_body, 1)
            deviation, torque = self._torques(tables, stiffness, damping_ratio, deviation)
            passed = self._sensor * np.exp(-1j * omega * x[-1]) / (1.0 + 1j * omega * time_constant_s)
            rubbing = np.copysign(np.abs(torque[:1]), self._speed)
            leg, load_friction, *by_body = passed * self._harmonics(
                np.vstack([torque[:1], rubbing, torque[1:]])
            )
            constant = np.eye(len(leg))[0]
            whole = (1.0 + x[-2]) * leg + x[-3] * load_friction + x[-4] * constant
            columns = np.vstack([*by_body, constant, load_friction, leg, -1j * omega * leg])
            rest, by = self._real(self._wanted - whole), self._real(columns)
            square = float(rest @ rest + np.sum((x / self._sigma) ** 2))
            information = by @ by.T + np.diag(self._sigma**-2.0)
            x = x + np.linalg.solve(information, by @ rest - x / self._sigma**2)
        return _Fit(square, x[:-4], deviation)

    def _real(self, harmonics: Floats) -> Floats:
        """Harmonics (..., h) in units of their errors, as real numbers (..., 2 h)."""
        scaled = harmonics * self._weight
        return np.concatenate([scaled.real, scaled.imag], axis=-1)

    def _harmonics(self, torque: Floats) -> Floats:
        """Harmonics (..., h) over the measured angle of torques (..., POINTS) at equal steps of time."""
        kernel = np.exp(-1j * np.outer(self._order, self._angle)) * (self._rate / self._speed / _POINTS)
        return np.asarray(torque @ kernel.T)

    def _torques(
        self, tables: Floats, stiffness: float, damping_ratio: float, deviation: Floats
    ) -> tuple[Floats, Floats]:
        """How the crank deviates (POINTS,) [rad], and the measured torque with its derivatives by bodies.

        The crank's motion is periodic; Newton's method finds it. The torques are rows (1 + 2 bodies, POINTS).
        """
        if not stiffness:
            powers = np.stack([np.ones(_POINTS), self._rate, self._rate**2, self._acceleration])
            both = np.concatenate([tables[None], self._by_body])
            return deviation, np.asarray((_at(both, self._angle)[0] * powers).sum(axis=1))
        damping = 2.0 * damping_ratio * math.sqrt(stiffness * float(tables[3].mean()))
        twice = self._slope @ self._slope
        for _ in range(_MOST):
            angle, rate = self._angle + deviation, self._rate + self._slope @ deviation
            powers = np.stack([np.ones(_POINTS), rate, rate**2, self._acceleration + twice @ deviation])
            values, slopes = _at(tables, angle)
            spring = stiffness * deviation + damping * (self._slope @ deviation)
            steep = (values[1] + 2.0 * rate * values[2] + damping)[:, None] * self._slope
            jacobian = np.diag((slopes * powers).sum(axis=0) + stiffness) + steep + values[3][:, None] * twice
            step = np.linalg.solve(jacobian, -(values * powers).sum(axis=0) - spring)
            largest = float(np.abs(step).max())
            deviation = deviation + min(1.0, _FURTHEST / max(largest, _SMALL)) * step
            if largest < _SMALL:
                break
        push = (_at(self._by_body, angle)[0] * powers).sum(axis=1)
        moved = np.vstack([deviation, np.linalg.solve(jacobian, -push.T).T])
        return deviation, np.asarray(-stiffness * moved - damping * moved @ self._slope.T)


_MOST, _FURTHEST, _SMALL = 30, 0.05, 1.0e-7  # steps of Newton's method; of the deviation, the longest [rad]


def _at(tables: Floats, angle: Floats) -> tuple[Floats, Floats]:
    """Values (..., n) of periodic tables (..., P) at angles (n,), and their slopes by the angle."""
    points = tables.shape[-1]
    place = (angle / TURN) % 1.0 * points
    left = np.minimum(place.astype(np.int64), points - 1)
    values = tables[..., left]
    step = tables[..., (left + 1) % points] - values
    return values + (place - left) * step, step * (points / TURN)


def _vertex(x: Floats, y: Floats) -> float:
    """Place of the vertex of the parabola through three points, the middle one of which is the least."""
    left, right = (y[1] - y[0]) / (x[1] - x[0]), (y[2] - y[1]) / (x[2] - x[1])
    bend = (right - left) / (0.5 * (x[2] - x[0]))
    return float(0.5 * (x[0] + x[1]) - left / bend)

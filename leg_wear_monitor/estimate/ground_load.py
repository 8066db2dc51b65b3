"""The force of the ground on the toe from the mean drive torque of a leg that walks on it.

By virtual work, a force F at the toe needs the drive torque -F . dr/dtheta, r the toe's place: one equation
in each phase for two components. What is known beside it is a template of stance, from which real steps
differ in size, begin, end, fore-aft part and shape. A sensor shows that torque behind its channel, and the
friction of the load of a drive follows the whole torque.

Under a force the joints rub more, and impacts fall elsewhere: a reference under the force that was found
leads to the next one.
"""

import functools
import itertools
import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import attrs
import numpy as np

from leg_wear_monitor.dynamics.clearance.tables import POINTS
from leg_wear_monitor.estimate.cause import Cause
from leg_wear_monitor.estimate.explanations import (
    Baseline,
    LeftOut,
    Nuisance,
    OtherChannel,
    Point,
    body_torques,
    gauss_newton,
)
from leg_wear_monitor.estimate.signature import (
    UNDECLARED,
    CommissionedTorque,
    DriveFigures,
    TorqueSensor,
    signature_of_torque,
    simulated_signatures,
)
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.person import FORE_AFT, PHASES, Stance, nominal_stance, stance_template
from leg_wear_monitor.mechanism.position import TURN, Linkage, build_linkage, one_cycle, point_motion
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.twin.load import at_points, load_shape, load_signatures
from leg_wear_monitor.twin.reference import MASS_TOLERANCE
from leg_wear_monitor.twin.torque_reference import TorqueReference

_HARMONICS = 12  # sin(k pi s) over stance, in each component

# standard deviations about the template: begin and end of stance [turns], fore-aft over vertical force, each
# harmonic of the vertical and fore-aft shape over the peak. Measured ones differ by 0.04 and 0.03 (RMS) up to
# the sixth and by 0.02 and 0.01 from there on, 0.119 and 0.074 at most (docs/appendix/benchmarks.md): those
# of a continuous force fall with the square of their number. With 0.05 and 0.025 in all twelve, what the
# model's torque is off became a ripple of the force, and the heel wore 1.3 times as fast under 100 N
_TIMING, _FORE_AFT = 0.03, 0.03
_SHAPES = np.outer([0.06, 0.03], np.minimum(1.0, (6.0 / np.arange(1, _HARMONICS + 1)) ** 2))
# by how much steps usually differ from the template: half as much as those on a treadmill do
_USUAL = np.zeros((2, _HARMONICS))
_USUAL[0, :9] = -0.012, 0.013, 0.0, 0.003, -0.035, 0.012, 0.008, 0.005, -0.007
_USUAL[1, 1:3] = 0.007, -0.007
_FRICTION, _DECLARED_FRICTION = 0.2, 0.03  # load friction of the drive
_MEAN = 0.02  # error of the model in each phase, of the torque's size
_SPREADS = {Cause.MASS: 0.05, Cause.LENGTH: 0.005, Cause.FRICTION: 5.0, Cause.SCALE: 0.05, Cause.TIMING: 0.02}
_SURE, _WORSE = 2.0, 3.0  # standard deviations of a load, and a factor on what is left over without it
_UNIT_N = 100.0
_STANDS = 0.05  # of the peak of a force, above which the foot stands
# of the fit, which has several minima: 69 N and a toe-off later by 0.04 left over 2.5, 100 N left over
# 2.2 (2026-11-25). Sizes, and toe-offs in standard deviations, where it begins
_STARTS_N, _TOE_OFFS, _ROUNDS = (50.0, 200.0, 600.0), (-2.0, 0.0, 2.0), 4
_SAME = 0.5  # standard deviations: within them minima are one
_AS_GOOD = 4.0  # by which the squares of forces differ that explain as well
_MOST_N = 5000.0
_FURTHEST = 4.0  # standard deviations
_STEP, _DONE = 1.0e-4, 1.0e-3  # of the differences, and the last step, in standard deviations


@attrs.frozen(eq=False)
class GroundLoad:
    """A force of the ground that explains a mean torque.

    Attributes
    ----------
    force : (PHASES, 2) array
        At equal steps of the crank angle from 0 [N].
    peak_n, peak_sigma_n : float
        Size of the template, the largest vertical force of its shape; its standard deviation, that of other
        forces that explain almost as well included.
    heel_strike, toe_off : float
        Crank angle at the begin and at the end of stance, as a fraction of a turn.
    load_friction : float
        Friction of the drive over the size of the torque that it transmits.
    square, without : float
        Mean squares of what is left over with it and without a load, in units of its uncertainty.
    other_n : float
        Size of another force that explains the torque as well; NaN without one.
    """

    force: Floats
    peak_n: float
    peak_sigma_n: float
    heel_strike: float
    toe_off: float
    load_friction: float
    square: float
    without: float
    other_n: float = math.nan

    @property
    def is_sure(self) -> bool:
        """Whether the foot carries a load, and not only masses, friction or scatter."""
        return self.peak_n > _SURE * self.peak_sigma_n and self.without > _WORSE * max(self.square, 1.0)


def stance_phases(up: Floats, speed: float) -> tuple[float, float]:
    """Heel strike and toe-off of a vertical force, as fractions of a turn of the crank.

    Parameters
    ----------
    up : (n,) array
        At equal steps of the crank angle from 0.
    speed : float
        Of the crank, whose sign tells which of the two ends of the force comes first.

    Returns
    -------
    (float, float)
        Where the force rises above and falls below a twentieth of its peak; NaN if it does so more than once.
    """
    stands = up > _STANDS * up.max()
    begin, end = (np.flatnonzero(stands & ~np.roll(stands, step)) for step in (1, -1))
    if len(begin) != 1:
        return math.nan, math.nan
    ends = float(begin[0] / len(up)), float(end[0] / len(up))
    return ends if speed > 0.0 else (ends[1], ends[0])


class _Minimum(NamedTuple):
    """A minimum of the fit: its square, the size that shapes are in proportion to, parameters, and sigma."""

    square: float
    near_n: float
    x: Floats
    sigma: float


class _Leg:
    """The mean torque of a leg under a force of the ground; parameters (p,) are in standard deviations.

    They are the size, over `_UNIT_N`; the begin of stance and its end, the fore-aft part, the load friction
    of the drive, and the harmonics of the vertical and of the fore-aft shape.
    """

    def __init__(
        self,
        linkage: Linkage,
        reference: TorqueReference,
        sensor: TorqueSensor,
        friction: tuple[float, float],
    ) -> None:
        toe = linkage.mechanism.toe
        if toe is None:
            raise RuntimeError("a mechanism without a toe does not stand")
        self._stance, self._friction = nominal_stance(linkage), friction
        self.near_n = 0.0  # about the size: shapes differ in proportion to it
        _, velocity, _ = point_motion(one_cycle(linkage, POINTS, 1.0), linkage, *toe)
        self._lever, profile = -velocity, reference.profile
        angle, torque = reference.angle[:-1], reference.torque_nm[0].astype(float).mean(axis=0)
        even = np.arange(POINTS) * (TURN / POINTS)
        own = np.interp(even, angle % TURN, torque, period=TURN)
        former = reference.parameters.load
        self._own = own - (self._lever * at_points(former)).sum(axis=1) if former.size else own
        self._torques = functools.lru_cache(maxsize=3)(self._torques_of)
        self._direction = math.copysign(1.0, profile.speed)
        # of the torque after its friction, all that the sensor shows is linear: (points, phases)
        linear, step_s = attrs.evolve(sensor.channel, load_friction=0.0), TURN / abs(profile.speed) / POINTS
        self._seen = linear.received(np.eye(POINTS), step_s, self._direction) @ _phase_means(sensor.phases)

    def stance(self, x: Floats) -> Stance:
        """When the foot stands."""
        nominal = self._stance
        begin, end = nominal.heel_strike + _TIMING * x[1], nominal.toe_off + _TIMING * x[2]
        return attrs.evolve(nominal, heel_strike=float(begin), toe_off=float(end))

    def force(self, x: Floats) -> Floats:
        """Force (PHASES, 2) [N]."""
        vertical, along = _shapes(self.stance(x), PHASES)
        size = self._sizes(x)
        return np.outer(size[0] @ vertical, self._stance.up) + np.outer(size[1] @ along, self._stance.back)

    def _sizes(self, x: Floats) -> Floats:
        """Sizes (..., 2, 1 + harmonics) of the vertical and of the fore-aft shapes [N]."""
        template = (
            _UNIT_N * x[..., :1] * np.stack([np.ones_like(x[..., 3]), FORE_AFT + _FORE_AFT * x[..., 3]], -1)
        )
        more = self.near_n * (_USUAL + _SHAPES * x[..., 5:].reshape(*x.shape[:-1], 2, -1))
        return np.concatenate([template[..., None], more], axis=-1)

    def _torques_of(self, begin: float, end: float) -> tuple[Floats, Floats]:
        """Torques (1 + harmonics, points) of the shapes, by newton [N m/N]; the same for most differences."""
        stance = self.stance(np.array([0.0, begin, end]))
        vertical, along = _shapes(stance, POINTS)
        return vertical * (self._lever @ stance.up), along * (self._lever @ stance.back)

    def load_friction(self, x: Floats) -> float:
        """Friction of the drive over the size of the torque that it transmits."""
        mean, sigma = self._friction
        return mean + sigma * float(x[4])

    def means(self, x: Floats) -> Floats:
        """Mean torques (n, phases) of each phase, as the sensor shows them [N m], for parameters (n, p)."""
        torque, sizes = np.tile(self._own, (len(x), 1)), self._sizes(x)
        for stance in np.unique(x[:, 1:3], axis=0):  # few, for most differences
            alike = (x[:, 1:3] == stance).all(axis=1)
            up, back = self._torques(float(stance[0]), float(stance[1]))
            torque[alike] += sizes[alike, 0] @ up + sizes[alike, 1] @ back
        mean, sigma = self._friction
        friction = mean + sigma * x[:, 4:5]
        return np.asarray((torque + self._direction * friction * np.abs(torque)) @ self._seen)


@functools.cache
def _phase_means(phases: int) -> Floats:
    """Means (points, phases) of each phase of a gait cycle, of torques at the points of the tables."""
    return np.array([signature_of_torque(one, phases)[:phases] for one in np.eye(POINTS)])


def _shapes(stance: Stance, points: int) -> tuple[Floats, Floats]:
    """Template and harmonics (1 + harmonics, points) of the vertical and of the fore-aft force."""
    s = stance.fractions(points)
    stands = s <= 1.0  # elsewhere all are 0
    found = np.zeros((2, 1 + _HARMONICS, points))
    found[:, 0, stands] = stance_template(s[stands])
    found[:, 1:, stands] = np.sin(0.5 * TURN * np.outer(np.arange(1, _HARMONICS + 1), s[stands]))
    return found[0], found[1]


def ground_load(
    linkage: Linkage,
    reference: TorqueReference,
    sensor: TorqueSensor,
    measured: Floats,
    covariance: Floats,
    nuisances: Sequence[Nuisance],
    figures: DriveFigures = UNDECLARED,
) -> GroundLoad:
    """The most probable force of the ground.

    Parameters
    ----------
    linkage : Linkage
        Of the leg without the load.
    reference : TorqueReference
        Of that leg, under any load.
    sensor : TorqueSensor
        With its channel.
    measured : (F,) array
        Mean signature of a leg as expected.
    covariance : (F, F) array
        Of its difference from the reference's, by the scatter of gait cycles.
    nuisances : sequence of Nuisance
    figures : DriveFigures, optional
        A declared load friction is known within 0.03.
    """
    is_declared = not math.isnan(figures.load_friction)
    friction = (figures.load_friction, _DECLARED_FRICTION) if is_declared else (0.0, _FRICTION)
    leg, phases = _Leg(linkage, reference, sensor, friction), sensor.phases
    covariance = covariance[:phases, :phases] + np.diag(np.full(phases, (_MEAN * sensor.size_nm) ** 2))
    for one in nuisances:
        spread = _SPREADS.get(one.cause, 0.0)
        covariance += spread**2 * np.outer(one.column[:phases], one.column[:phases])
    weight = np.linalg.inv(np.linalg.cholesky(covariance))

    def residuals(x: Floats) -> Floats:
        return np.hstack([(leg.means(x) - measured[:phases]) @ weight.T, x[:, 1:]])

    def at(x: Floats) -> Point:
        now = residuals(x[None])[0]
        steps = _STEP * np.eye(len(x))
        return Point(now, lambda: (residuals(x + steps) - now).T / _STEP)

    number = 5 + 2 * _HARMONICS
    low, high = np.full(number, -_FURTHEST), np.full(number, _FURTHEST)
    low[0], high[0], low[4] = 0.0, _MOST_N / _UNIT_N, -friction[0] / friction[1]
    without = at(np.zeros(number)).square
    minima = _minima(leg, at, low, high)
    best, least = minima[0], minima[0].square
    # by as much as the model is off, differences between minima say less: the square of Birge's ratio
    worse = np.array([one.square - least for one in minima]) / max(1.0, least / phases)
    likely = np.exp(-0.5 * worse) / np.exp(-0.5 * worse).sum()
    apart = np.array([one.x[0] - best.x[0] for one in minima])
    sigma = math.sqrt(likely @ (apart**2 + np.square([one.sigma for one in minima])))
    others = (worse < _AS_GOOD) & (np.abs(apart) > best.sigma)
    leg.near_n = best.near_n
    stance = leg.stance(best.x)
    return GroundLoad(
        force=leg.force(best.x),
        peak_n=_UNIT_N * float(best.x[0]),
        peak_sigma_n=_UNIT_N * sigma,
        heel_strike=stance.heel_strike % 1.0,
        toe_off=stance.toe_off % 1.0,
        load_friction=leg.load_friction(best.x),
        square=least / phases,
        without=without / phases,
        other_n=_UNIT_N * float(minima[int(others.argmax())].x[0]) if others.any() else math.nan,
    )


def _minima(leg: _Leg, at: Callable[[Floats], Point], low: Floats, high: Floats) -> list[_Minimum]:
    """The minima that the starts lead to, the least first."""
    found: list[_Minimum] = []
    minima: list[_Minimum] = []
    for start_n, toe_off in itertools.product(_STARTS_N, _TOE_OFFS):
        x = np.zeros(len(low))
        x[0], x[2] = start_n / _UNIT_N, toe_off
        for _ in range(_ROUNDS):
            leg.near_n = _UNIT_N * float(x[0])
            best = gauss_newton(at, x, low=low, high=high, done=_DONE)
            x = best.x
        found.append(_Minimum(best.point.square, leg.near_n, x, math.sqrt(best.covariance[0, 0])))
    for one in sorted(found, key=lambda one: one.square):
        if all(np.abs(one.x - other.x).max() > _SAME for other in minima):
            minima.append(one)
    return minima


# What changes a torque's signature beside clearances: friction, scale, lag, load, bodies.


# usual changes of a leg that is all right: friction warms up, sensors drift, the ground differs
_FRICTION_CHANGE = 0.1  # of the torque's size
_SCALE = 0.02
_OFFSET_RAD = 0.01  # a lag of 1.6 ms at 60 rpm, or a crank offset: at one speed the two look alike
_LOAD_N = 5.0
_LOAD_FRICTION = 0.03  # a gear that warms up
# of the ground's peak: its mean over some steps, and the harmonics of its vertical and fore-aft shape
_LOAD_FRACTION, _VERTICAL, _FORE_AFT_CHANGE, _LOAD_HARMONICS = 0.05, 0.01, 0.005, 8

# of a leg that was never commissioned: tolerances of bodies, and what else the model may have wrong
_TOLERANCES = {Cause.MASS: MASS_TOLERANCE, Cause.LENGTH: 0.005}
_MEAN_ERROR = 0.05  # of the torque's size, in each phase
_ROUGHNESS_ERROR = 0.15
_SENSOR_TOLERANCE = 5.0  # times the usual changes of friction, scale and lag

_SCALE_STEP, _OFFSET_STEP_RAD, _LOAD_FRICTION_STEP = 0.1, 0.03, 0.05

_LATER_S = 0.0025 * np.array([*range(-8, 0), *range(1, 13)])
_SLOWER_S = tuple(1.0 / (TURN * hz) for hz in (70.0, 35.0, 20.0, 10.0))
_CHANNEL_CYCLES = 20

# gait cycles that the expected covariance counts as: a tenth to 0.45 of the weight is that of 50 measured
# cycles where the others are most probable by it, in the air and on the ground (2026-11-25)
_EXPECTED_CYCLES = 120
_PARTS = 5  # of the commissioned cycles, each of which is seen by the others
_LEAST_PARTED = 4  # gait cycles: each part leaves a mean and a scatter


def nuisances(mechanism: Mechanism, reference: TorqueReference, sensor: TorqueSensor) -> list[Nuisance]:
    """Nuisances of a leg that walks as a reference does."""
    phases, speed = sensor.phases, reference.profile.speed
    constant = np.concatenate([np.full(phases, np.sign(speed)), np.zeros(phases)])
    scaled = _difference(reference, sensor, scale_step=_SCALE_STEP)
    shifted = _difference(reference, sensor, offset_step_rad=_OFFSET_STEP_RAD)
    rubbing = _difference(reference, sensor, load_friction_step=_LOAD_FRICTION_STEP)
    found = [
        Nuisance(Cause.FRICTION, "", constant, _FRICTION_CHANGE * sensor.size_nm),
        Nuisance(Cause.SCALE, "", scaled, _SCALE),
        # the samples' angle is too large where the torque comes late, and too small where the crank is ahead
        Nuisance(Cause.TIMING, "", -shifted, _OFFSET_RAD),
        Nuisance(Cause.LOAD_FRICTION, "", rubbing, _LOAD_FRICTION),
    ]
    if mechanism.toe is not None:
        found += _loads(build_linkage(reference.parameters.in_air.applied(mechanism)), reference, sensor)
    for name, mass, length in zip(mechanism.bodies, *body_torques(mechanism).at(speed), strict=True):
        found.append(Nuisance(Cause.MASS, name, signature_of_torque(mass, phases), 0.0))
        found.append(Nuisance(Cause.LENGTH, name, signature_of_torque(length, phases), 0.0))
    return found


def _loads(linkage: Linkage, reference: TorqueReference, sensor: TorqueSensor) -> list[Nuisance]:
    """The ground's force: its size, and for a leg that walks under one its shape, too."""
    known, usual = reference.parameters.load, [(load_shape(linkage), _LOAD_N)]
    if known.size:
        stance = nominal_stance(linkage)
        peak_n = float((known @ stance.up).max())
        s, order = stance.fractions(), np.arange(1, _LOAD_HARMONICS + 1)
        waves = np.where(s <= 1.0, np.sin(0.5 * TURN * np.outer(order, s)), 0.0)
        usual = [(known / peak_n, _LOAD_FRACTION * peak_n)]
        usual += [(np.outer(one, stance.up), _VERTICAL * peak_n) for one in waves]
        usual += [(np.outer(one, stance.back), _FORE_AFT_CHANGE * peak_n) for one in waves]
    speed, found = reference.profile.speed, []
    channel = attrs.evolve(sensor.channel, load_friction=0.0)
    for torque, (_, spread) in zip(
        load_signatures(linkage, [force for force, _ in usual]), usual, strict=True
    ):
        received = channel.received(torque, TURN / abs(speed) / len(torque), float(np.sign(speed)))
        found.append(Nuisance(Cause.LOAD, "", signature_of_torque(received, sensor.phases), spread))
    return found


def other_channels(reference: TorqueReference, sensor: TorqueSensor) -> list[OtherChannel]:
    """Channels that a torque sensor may have instead of its own: earlier, later, filtered."""
    own = simulated_signatures(reference, 0, sensor, cycles=_CHANNEL_CYCLES).mean(axis=0)
    present = sensor.channel
    slower = [one for one in _SLOWER_S if one > present.time_constant_s]
    tried = [(late, present.time_constant_s) for late in _LATER_S] + [
        (late, time_constant_s)
        for time_constant_s in slower
        for late in (0.0, *_LATER_S[_LATER_S > 0.0][::2])
    ]
    found = []
    for later_s, time_constant_s in tried:
        other = attrs.evolve(present, delay_s=present.delay_s + later_s, time_constant_s=time_constant_s)
        behind = attrs.evolve(sensor, channel=other)
        column = simulated_signatures(reference, 0, behind, cycles=_CHANNEL_CYCLES).mean(axis=0) - own
        found.append(OtherChannel(float(other.lateness_s - present.lateness_s), column))
    return found


def with_scatter_of(covariance: Floats, signatures: Floats) -> Floats:
    """Covariance (F, F) of a gait cycle in a leg that scatters as some commissioned cycles do.

    The sample covariance is shrunk to the expected one, whose variances are at least the measured ones.

    Parameters
    ----------
    covariance : (F, F) array
        Expected one.
    signatures : (n, F) array
        Measured gait cycles.
    """
    if len(signatures) < 2:
        return covariance
    measured = np.cov(signatures.T)
    more = np.maximum(0.0, np.diagonal(measured) - np.diagonal(covariance))
    weight = len(signatures) / (len(signatures) + _EXPECTED_CYCLES)
    return np.asarray(weight * measured + (1.0 - weight) * (covariance + np.diag(more)))


def parts_left_out(covariance: Floats, signatures: Floats) -> tuple[LeftOut, ...]:
    """Parts of some commissioned gait cycles, signatures (n, F), each seen by the others.

    Within the cycles that a covariance was made of, any test scatters less than in later ones.

    Parameters
    ----------
    covariance : (F, F) array
        Expected one, as of `with_scatter_of`.
    signatures : (n, F) array
    """
    if len(signatures) < _LEAST_PARTED:
        return ()
    found = []
    for part in np.array_split(np.arange(len(signatures)), min(_PARTS, len(signatures) // 2)):
        others = np.delete(signatures, part, axis=0)
        departures = signatures[part] - others.mean(axis=0)
        found.append(LeftOut(with_scatter_of(covariance, others), departures, len(others)))
    return tuple(found)


def commissioned_baseline(
    commissioned: CommissionedTorque,
    expected: Floats,
    covariance: Floats,
    left_out: tuple[LeftOut, ...] = (),
) -> Baseline:
    """Baseline of a commissioned leg; the signature (F,) that is expected, covariance (F, F) of a cycle.

    What the reference of the expected leg is off is in that difference, and cancels.
    """
    mean = commissioned.mean
    return Baseline(mean - expected, covariance / commissioned.cycles, left_out)


def unknown_baseline(found: list[Nuisance], sensor: TorqueSensor, covariance: Floats) -> Baseline:
    """Baseline of a leg that was never commissioned, with its tolerances.

    The covariance (F, F) is that of the expected signature.
    """
    phases = sensor.phases
    sigma = np.repeat([_MEAN_ERROR * sensor.size_nm, _ROUGHNESS_ERROR], phases)
    covariance = covariance + np.diag(sigma**2)
    for one in found:
        spread = _TOLERANCES.get(one.cause, _SENSOR_TOLERANCE * one.spread)
        covariance += spread**2 * np.outer(one.column, one.column)
    return Baseline(np.zeros(2 * phases), covariance)


def _difference(
    reference: TorqueReference,
    sensor: TorqueSensor,
    scale_step: float = 0.0,
    offset_step_rad: float = 0.0,
    load_friction_step: float = 0.0,
) -> Floats:
    """Derivative of the expected leg's signature: by a factor on the torque, the crank's offset, friction."""

    def stepped(sign: float) -> Floats:
        own = sensor.channel
        channel = attrs.evolve(own, load_friction=own.load_friction + sign * load_friction_step)
        behind = attrs.evolve(sensor, channel=channel)
        scale, offset_rad = 1.0 + sign * scale_step, sign * offset_step_rad
        return np.asarray(simulated_signatures(reference, 0, behind, scale, offset_rad).mean(axis=0))

    step = scale_step or offset_step_rad or load_friction_step
    return np.asarray((stepped(1.0) - stepped(-1.0)) / (2.0 * step))

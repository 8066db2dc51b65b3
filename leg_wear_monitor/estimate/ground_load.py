"""The force of the ground on the toe from the mean drive torque of a leg that walks on it.

By virtual work, a force F at the toe needs the drive torque -F . dr/dtheta, with r the toe's position: one
equation in each phase for two components. In addition, a template of stance is known. Real steps differ from
it in size, start, end, fore-aft part and shape. A sensor shows this torque after the drive dynamics, and the
load friction of a drive follows the whole torque.

Under a force the joints rub more, and impacts fall elsewhere: a reference under the estimated force leads to
the next estimate.
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
from leg_wear_monitor.estimate.drive import UNDECLARED, DriveFigures
from leg_wear_monitor.estimate.explanations import Nuisance
from leg_wear_monitor.estimate.least_squares import Point, gauss_newton
from leg_wear_monitor.estimate.signature import TorqueSensor, signature_of_torque
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.person import FORE_AFT, PHASES, Stance, nominal_stance, stance_template
from leg_wear_monitor.mechanism.position import TURN, Linkage, one_cycle, point_motion
from leg_wear_monitor.twin.load import at_points
from leg_wear_monitor.twin.references import TorqueReference

_HARMONICS = 12  # sin(k pi s) over stance, in each component

# standard deviations about the template: start and end of stance [turns], fore-aft over vertical force, each
# harmonic of the vertical and fore-aft shape over the peak. Measured ones differ by 0.04 and 0.03 (RMS) up to
# the sixth and by 0.02 and 0.01 from there on, 0.119 and 0.074 at most (docs/appendix/benchmarks.md): the
# harmonics of a continuous force fall with the square of their number. With 0.05 and 0.025 in all twelve, the
# error of the model's torque became a ripple of the force, and the heel wore 1.3 times as fast under 100 N
_TIMING, _FORE_AFT = 0.03, 0.03
_SHAPES = np.outer([0.06, 0.03], np.minimum(1.0, (6.0 / np.arange(1, _HARMONICS + 1)) ** 2))
# usual difference of steps from the template: half of the difference on a treadmill
_USUAL = np.zeros((2, _HARMONICS))
_USUAL[0, :9] = -0.012, 0.013, 0.0, 0.003, -0.035, 0.012, 0.008, 0.005, -0.007
_USUAL[1, 1:3] = 0.007, -0.007
_FRICTION, _DECLARED_FRICTION = 0.2, 0.03  # load friction of the drive
_MEAN = 0.02  # error of the model in each phase, of the torque's size
_SPREADS = {Cause.MASS: 0.05, Cause.LENGTH: 0.005, Cause.FRICTION: 5.0, Cause.SCALE: 0.05, Cause.TIMING: 0.02}
_SURE, _WORSE = 2.0, 3.0  # standard deviations of a load, and a factor on the residual without it
# 3 % of cogging, with all else that drives do, was a load of 13 ± 4 N (2026-11-26); so little of it would
# hardly change the wear, but keep the leg from being identified
_LEAST_N = 25.0
_UNIT_N = 100.0
_IN_STANCE = 0.05  # the foot is on the ground above this fraction of the peak force
# Start values of the fit, which has several minima: sizes, and toe-offs in standard deviations. With 69 N and
# a toe-off later by 0.04 the residual was 2.5, with 100 N it was 2.2 (2026-11-25)
_STARTS_N, _TOE_OFFS, _ROUNDS = (50.0, 200.0, 600.0), (-2.0, 0.0, 2.0), 4
_SAME = 0.5  # standard deviations: within them minima are one
_AS_GOOD = 4.0  # difference of the squares of forces that explain equally well
_MOST_N = 5000.0
_FURTHEST = 4.0  # standard deviations
_STEP, _DONE = 1.0e-4, 1.0e-3  # step of the differences, and the last step, in standard deviations


@attrs.frozen(eq=False)
class GroundLoad:
    """A force of the ground that explains a mean torque.

    Attributes
    ----------
    force : (PHASES, 2) array
        Force at equal steps of the crank angle from 0 [N].
    peak_n, peak_sigma_n : float
        Size of the template, the largest vertical force of its shape; its standard deviation, which includes
        other forces that explain almost as well.
    heel_strike, toe_off : float
        Crank angle at the start and at the end of stance, as a fraction of a turn.
    square, without : float
        Mean squares of the residual with this load and without a load, in units of its uncertainty.
    other_n : float
        Size of a different force that explains the torque equally well; NaN without one.
    """

    force: Floats
    peak_n: float
    peak_sigma_n: float
    heel_strike: float
    toe_off: float
    square: float
    without: float
    other_n: float = math.nan

    @property
    def is_sure(self) -> bool:
        """True if a load at the foot explains the torque, and not masses, friction or scatter alone."""
        is_seen = self.peak_n > max(_SURE * self.peak_sigma_n, _LEAST_N)
        return is_seen and self.without > _WORSE * max(self.square, 1.0)


def stance_phases(up: Floats, speed: float) -> tuple[float, float]:
    """Heel strike and toe-off of a vertical force, as fractions of a turn of the crank.

    Parameters
    ----------
    up : (n,) array
        At equal steps of the crank angle from 0.
    speed : float
        Of the crank, whose sign shows which of the two ends of the force comes first.

    Returns
    -------
    (float, float)
        Where the force rises above and falls below a twentieth of its peak; NaN if it does so more than once.
    """
    in_stance = up > _IN_STANCE * up.max()
    begin, end = (np.flatnonzero(in_stance & ~np.roll(in_stance, step)) for step in (1, -1))
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
            raise RuntimeError("a mechanism without a toe cannot stand")
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
        # after the friction, the sensor is linear in the torque: (points, phases)
        shown = [signature_of_torque(one, sensor, profile.speed) for one in np.eye(POINTS)]
        self._seen = np.array(shown)[:, : sensor.phases]

    def stance(self, x: Floats) -> Stance:
        """Start and end of stance."""
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
        """Torques (1 + harmonics, points) of the shapes per newton [N m/N]; equal for most differences."""
        stance = self.stance(np.array([0.0, begin, end]))
        vertical, along = _shapes(stance, POINTS)
        return vertical * (self._lever @ stance.up), along * (self._lever @ stance.back)

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


def _shapes(stance: Stance, points: int) -> tuple[Floats, Floats]:
    """Template and harmonics (1 + harmonics, points) of the vertical and of the fore-aft force."""
    s = stance.fractions(points)
    in_stance = s <= 1.0  # elsewhere all are 0
    found = np.zeros((2, 1 + _HARMONICS, points))
    found[:, 0, in_stance] = stance_template(s[in_stance])
    found[:, 1:, in_stance] = np.sin(0.5 * TURN * np.outer(np.arange(1, _HARMONICS + 1), s[in_stance]))
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
    # an error of the model weakens differences between minima: the square of Birge's ratio
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

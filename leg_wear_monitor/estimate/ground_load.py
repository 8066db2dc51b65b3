"""The force of the ground on the toe from the mean drive torque of a leg that walks on it.

By virtual work, a force F at the toe needs the drive torque -F . dr/dtheta, r the toe's place: one equation
in each phase for two components. What is known beside it is a template of stance, from which real steps
differ in size, begin, end, fore-aft part and shape. A sensor shows that torque behind its channel, and the
friction of the load of a drive follows the whole torque.

Under a force the joints rub more, and impacts fall elsewhere: a reference under the force that was found
leads to the next one.
"""

import math
from collections.abc import Sequence

import attrs
import numpy as np

from leg_wear_monitor.dynamics.clearance.tables import POINTS
from leg_wear_monitor.estimate.cause import Cause
from leg_wear_monitor.estimate.drive_figures import UNDECLARED, DriveFigures
from leg_wear_monitor.estimate.explanations import Nuisance
from leg_wear_monitor.estimate.ideal_signature import signature_of_torque
from leg_wear_monitor.estimate.least_squares import Point, gauss_newton
from leg_wear_monitor.estimate.signature import TorqueSensor
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ground_reaction import FORE_AFT, PHASES, Stance, nominal_stance
from leg_wear_monitor.mechanism.ideal import TURN, one_cycle, point_motion
from leg_wear_monitor.mechanism.position import Linkage
from leg_wear_monitor.twin.follower.load import at_points
from leg_wear_monitor.twin.reference.torque_reference import TorqueReference

_HARMONICS = 12  # sin(k pi s) over stance, in each component

# standard deviations about the template: begin and end of stance [turns], fore-aft over vertical force, each
# harmonic of the vertical and of the fore-aft shape over the peak; measured ones differ by up to 0.119 and
# 0.074 in one harmonic (docs/appendix/benchmarks.md)
_TIMING, _FORE_AFT, _SHAPES = 0.03, 0.03, np.array([[0.05], [0.025]])
# by how much steps usually differ from the template: half as much as those on a treadmill do
_USUAL = np.zeros((2, _HARMONICS))
_USUAL[0, :9] = -0.012, 0.013, 0.0, 0.003, -0.035, 0.012, 0.008, 0.005, -0.007
_USUAL[1, 1:3] = 0.007, -0.007
_FRICTION, _DECLARED_FRICTION = 0.2, 0.03  # load friction of the drive
_MEAN = 0.02  # error of the model in each phase, of the torque's size
_SPREADS = {Cause.MASS: 0.05, Cause.LENGTH: 0.005, Cause.FRICTION: 5.0, Cause.SCALE: 0.05, Cause.TIMING: 0.02}
_SURE, _WORSE = 2.0, 3.0  # standard deviations of a load, and a factor on what is left over without it
_UNIT_N = 100.0
_START_N, _ROUNDS = 200.0, 4
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
        Size of the template, the largest vertical force of its shape.
    heel_strike, toe_off : float
        Crank angle at the begin and at the end of stance, as a fraction of a turn.
    load_friction : float
        Friction of the drive over the size of the torque that it transmits.
    square, without : float
        Mean squares of what is left over with it and without a load, in units of its uncertainty.
    """

    force: Floats
    peak_n: float
    peak_sigma_n: float
    heel_strike: float
    toe_off: float
    load_friction: float
    square: float
    without: float

    @property
    def is_sure(self) -> bool:
        """Whether the foot carries a load, and not only masses, friction or scatter."""
        return self.peak_n > _SURE * self.peak_sigma_n and self.without > _WORSE * max(self.square, 1.0)


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
        self._stance, self._sensor, self._friction = nominal_stance(linkage), sensor, friction
        self.near_n = 0.0  # about the size: shapes differ in proportion to it
        _, velocity, _ = point_motion(one_cycle(linkage, POINTS, 1.0), linkage, *toe)
        self._lever, profile = -velocity, reference.profile
        angle, torque = reference.angle[:-1], reference.torque_nm[0].astype(float).mean(axis=0)
        even = np.arange(POINTS) * (TURN / POINTS)
        own = np.interp(even, angle % TURN, torque, period=TURN)
        former = reference.parameters.load
        self._own = own - self._torque(at_points(former)) if former.size else own
        self._step_s, self._direction = TURN / abs(profile.speed) / POINTS, math.copysign(1.0, profile.speed)
        each = [signature_of_torque(one, sensor.phases)[: sensor.phases] for one in np.eye(POINTS)]
        self._phases = np.array(each).T

    def stance(self, x: Floats) -> Stance:
        """When the foot stands."""
        nominal = self._stance
        begin, end = nominal.heel_strike + _TIMING * x[1], nominal.toe_off + _TIMING * x[2]
        return attrs.evolve(nominal, heel_strike=float(begin), toe_off=float(end))

    def force(self, x: Floats, points: int = PHASES) -> Floats:
        """Force (points, 2) [N]."""
        stance = self.stance(x)
        s, order = stance.fractions(points), np.arange(1, _HARMONICS + 1)
        waves = np.where(s <= 1.0, np.sin(0.5 * TURN * np.outer(order, s)), 0.0)
        vertical, along = (_USUAL + _SHAPES * x[5:].reshape(2, -1)) @ waves
        shape = stance.force(FORE_AFT + _FORE_AFT * x[3], points)
        more = np.outer(vertical, stance.up) + np.outer(along, stance.back)
        return np.asarray(_UNIT_N * x[0] * shape + self.near_n * more)

    def load_friction(self, x: Floats) -> float:
        """Friction of the drive over the size of the torque that it transmits."""
        mean, sigma = self._friction
        return mean + sigma * float(x[4])

    def mean(self, x: Floats) -> Floats:
        """Mean torque (phases,) of each phase, as the sensor shows it [N m]."""
        torque = self._own + self._torque(self.force(x, POINTS))
        channel = attrs.evolve(self._sensor.channel, load_friction=self.load_friction(x))
        received = channel.received(torque, self._step_s, self._direction)
        return np.asarray(self._phases @ received)

    def _torque(self, force: Floats) -> Floats:
        return np.asarray((self._lever * force).sum(axis=1))


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

    def residual(x: Floats) -> Floats:
        return np.concatenate([weight @ (leg.mean(x) - measured[:phases]), x[1:]])

    def at(x: Floats) -> Point:
        now = residual(x)
        steps = _STEP * np.eye(len(x))
        return Point(now, lambda: np.array([residual(x + one) - now for one in steps]).T / _STEP)

    number = 5 + 2 * _HARMONICS
    low, high = np.full(number, -_FURTHEST), np.full(number, _FURTHEST)
    low[0], high[0], low[4] = 0.0, _MOST_N / _UNIT_N, -friction[0] / friction[1]
    without = at(np.zeros(number)).square
    x = np.append(_START_N / _UNIT_N, np.zeros(number - 1))
    for _ in range(_ROUNDS):
        leg.near_n = _UNIT_N * float(x[0])
        best = gauss_newton(at, x, low=low, high=high, done=_DONE)
        x = best.x
    sigma = np.sqrt(np.diag(best.covariance))
    stance = leg.stance(x)
    return GroundLoad(
        force=leg.force(x),
        peak_n=_UNIT_N * float(x[0]),
        peak_sigma_n=_UNIT_N * float(sigma[0]),
        heel_strike=stance.heel_strike % 1.0,
        toe_off=stance.toe_off % 1.0,
        load_friction=leg.load_friction(x),
        square=best.point.square / phases,
        without=without / phases,
    )

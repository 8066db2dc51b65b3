"""Masses, lengths and friction of a commissioned leg, from its drive torque.

A real leg differs a little from its mechanism file. The times of its impacts and the effect of a clearance
depend on its masses, lengths and friction: a length that is 1 % off, or twice the friction, makes a reference
name wrong joints. So the reference is simulated again with the parameters that explain the torque of the leg
when it was commissioned.

Simulated legs show the effect of each parameter near the simulated leg. All parameters are changed at once:
with one leg for each, 4 % of a body's mass changed less than the scatter of simulated legs, and slopes of
masses were noise.

If a leg is far from its file, the torque with ideal joints leads near it: lengths that are 5 % off change
this torque by half of its size.
"""

import math
from collections.abc import Sequence

import attrs
import numpy as np

from leg_wear_monitor.errors import AssemblyError
from leg_wear_monitor.estimate.explanations import Nuisance
from leg_wear_monitor.estimate.least_squares import Point, gauss_newton
from leg_wear_monitor.estimate.signature import (
    CommissionedTorque,
    SignatureModel,
    ideal_torque,
    mean_signatures,
    signature_of_torque,
)
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.twin.reference import LegParameters
from leg_wear_monitor.twin.references import (
    HEAVIER,
    LONGER,
    ROUGHER,
    TorqueReference,
    levels_of,
)

# residual from which on a leg is identified, and the residual at which identification ends: scatter alone
# leaves 0.1 to 0.25, and 0.5 to 0.6 where samples fall at the same angles in each gait cycle. J at 0.45 mm
# was 0.48 to 0.50 mm where 0.39 was left, 0.54 at 0.58, and 0.62, or I was taken for it, at 0.68 (2026-11-26)
WORTH_IDENTIFYING, ONLY_SCATTER = 0.6, 0.45

FAR_FROM_FILE = 20.0  # torque residual above which the ideal torque is fitted first

_MASS, _LENGTH = 0.03, 0.006  # standard deviations of a leg's bodies about the file's bodies
_LOG_FRICTION = 0.7  # standard deviation of the logarithm of its friction: a factor of two, greased or not
_FAR = 0.03  # standard deviation of masses and lengths of a leg far from its file
_HARMONICS = 6  # harmonics of the torque that show masses and lengths rather than impacts
_IDEAL = 0.01  # effect of impacts on each harmonic, as a fraction of the torque's size
_STEP = 1.0e-4  # step of the differences for masses and lengths, in standard deviations
_DONE = 1.0e-3  # last step of masses and lengths
_LARGEST_LOG = 10.0  # largest logarithm of friction: far beyond a possible leg
_SENSOR = 5.0  # times the usual changes of friction, scale, offset and load: they are constant here

# a model with the right parameters is off by a part of the torque's size, by a part of its steps where it is
# steep, and in its roughness (docs/explanation/diagnosis.md)
_OF_SIZE, _OF_STEP, _ROUGHNESS = 0.005, 0.1, 0.1


def misfit(model: SignatureModel, nuisances: Sequence[Nuisance], commissioned: CommissionedTorque) -> float:
    """Mean square of a model's residual for a commissioned leg, in units of its uncertainty."""
    rest = commissioned.mean - model.at(commissioned.clearance_m)[0]
    covariance = _covariance(model, nuisances, commissioned.cycles)
    return float(rest @ np.linalg.solve(covariance, rest)) / len(rest)


def identified_leg(
    legs: TorqueReference,
    model: SignatureModel,
    nuisances: Sequence[Nuisance],
    commissioned: CommissionedTorque,
) -> LegParameters:
    """Most probable parameters of a commissioned leg: one step of Gauss and Newton.

    Parameters that the torque does not show keep the file's values. Lengths are assumed to be as far from the
    file as the simulated leg's lengths.

    Parameters
    ----------
    legs : TorqueReference
        Legs of `begin_identification`, with the clearances of the commissioned leg.
    model : SignatureModel
    nuisances : sequence of Nuisance
    commissioned : CommissionedTorque
    """
    means = mean_signatures(legs, model.sensor)
    bodies, near = len(legs.parameters.mass), legs.parameters
    # friction is positive, and known to a factor: its logarithm is the unknown
    before = np.concatenate([near.mass - 1.0, near.length - 1.0, [math.log(near.friction)]])
    far = float(np.sqrt(np.mean(np.square(near.length - 1.0))))
    steps = np.append(np.repeat([HEAVIER, LONGER], bodies), math.log(ROUGHER))
    sigma = np.append(np.repeat([_MASS, np.hypot(_LENGTH, far)], bodies), _LOG_FRICTION)
    levels = levels_of(near)[1:]
    slopes = means[1:].T @ levels / (len(levels) * steps)
    weighted = np.linalg.solve(_covariance(model, nuisances, commissioned.cycles), slopes)
    information = slopes.T @ weighted + np.diag(sigma**-2.0)
    rest = commissioned.mean - means[0]
    found = before + np.linalg.solve(information, weighted.T @ rest - before / sigma**2)
    mass, length, log_friction = np.split(found, [bodies, 2 * bodies])
    friction = math.exp(np.clip(log_friction.item(), -_LARGEST_LOG, _LARGEST_LOG))
    return attrs.evolve(near, mass=1.0 + mass, length=1.0 + length, friction=friction)


def leg_of_ideal_torque(
    mechanism: Mechanism, model: SignatureModel, commissioned: CommissionedTorque, speed: float, load: Floats
) -> LegParameters:
    """Approximate masses and lengths of a leg far from its file, from the torque with ideal joints.

    The ideal torques of this leg and of the file's leg differ as the measured mean torque differs from the
    model's, if impacts have the same part in both.

    Parameters
    ----------
    mechanism : Mechanism
    model : SignatureModel
        Model of the file's leg.
    commissioned : CommissionedTorque
    speed : float
        Speed of the crank [rad/s].
    load : (PHASES, 2) array
        Load of the model's leg [N], or none.
    """
    phases, bodies = model.sensor.phases, len(mechanism.bodies)
    unit = _IDEAL * model.sensor.size_nm
    rest = (commissioned.mean - model.at(commissioned.clearance_m)[0])[:phases]

    def bodies_at(x: Floats) -> LegParameters:
        return LegParameters(1.0 + _FAR * x[:bodies], 1.0 + _FAR * x[bodies:], load=load)

    def residual(x: Floats) -> Floats:
        torque = ideal_torque(bodies_at(x).applied(mechanism), speed) - of_file
        left = _harmonics(signature_of_torque(torque, model.sensor, speed)[:phases] - rest)
        return np.concatenate([left / unit, x])

    def at(x: Floats) -> Point:
        impossible = Point(np.full(1, np.inf), lambda: np.zeros((1, len(x))))
        if not bodies_at(x).is_possible(mechanism):
            return impossible
        try:
            now = residual(x)
        except AssemblyError:  # such a leg cannot move
            return impossible
        steps = _STEP * np.eye(len(x))
        return Point(now, lambda: np.array([residual(x + one) - now for one in steps]).T / _STEP)

    of_file = ideal_torque(bodies_at(np.zeros(2 * bodies)).applied(mechanism), speed)
    return bodies_at(gauss_newton(at, np.zeros(2 * bodies), done=_DONE).x)


def _harmonics(torque: Floats) -> Floats:
    """The mean and the first harmonics (1 + 2 n,) of a torque over the phases."""
    found = np.fft.rfft(torque)[: _HARMONICS + 1] / len(torque)
    return np.concatenate([found.real, found.imag[1:]])


def _covariance(model: SignatureModel, nuisances: Sequence[Nuisance], cycles: int) -> Floats:
    """Covariance (F, F) of the difference between a leg's mean signature over some cycles and its model."""
    phases = model.sensor.phases
    steep = np.hypot(_OF_SIZE * model.sensor.size_nm, _OF_STEP * np.exp(model.mean[phases:]))
    found = model.covariance * (1.0 / cycles + model.own)
    found = found + np.diag(np.concatenate([steep, np.full(phases, _ROUGHNESS)]) ** 2)
    for one in nuisances:
        found = found + (_SENSOR * one.spread) ** 2 * np.outer(one.column, one.column)
    return np.asarray(found)

"""Masses and lengths of a commissioned leg, from its drive torque.

A real leg is not quite that of its mechanism file. Where its impacts fall, and what a clearance changes,
depends on its masses and lengths: a length that is 1 % off makes a reference name wrong joints. So the
reference is simulated again with the bodies that explain the torque of the leg when it was commissioned.
"""

from collections.abc import Sequence

import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.diagnosis.explanations import Nuisance
from leg_wear_monitor.monitor.diagnosis.signature_model import SignatureModel, simulated_signatures
from leg_wear_monitor.monitor.ledger.entry import CommissionedTorque
from leg_wear_monitor.twin.reference.body_factors import BodyFactors
from leg_wear_monitor.twin.reference.torque_reference import HEAVIER, LONGER, TorqueReference

UNLIKE_FILE = 0.8  # misfit from which on the leg is not that of its file (docs/explanation/diagnosis.md)

_MASS, _LENGTH = 0.03, 0.006  # standard deviations of a leg's bodies about those of its file
_SENSOR = 5.0  # times the usual changes of friction, scale, offset and load: they are constant here

# a model with the right bodies is off by a part of the torque's size, by a part of its steps where it is
# steep, and in its roughness (docs/explanation/diagnosis.md)
_OF_SIZE, _OF_STEP, _ROUGHNESS = 0.005, 0.1, 0.1


def misfit(model: SignatureModel, nuisances: Sequence[Nuisance], commissioned: CommissionedTorque) -> float:
    """Mean square of what a model does not explain of a commissioned leg, in units of its uncertainty."""
    rest = commissioned.mean - model.at(commissioned.clearance_m)[0]
    covariance = _covariance(model, nuisances, commissioned.cycles)
    return float(rest @ np.linalg.solve(covariance, rest)) / len(rest)


def identified_bodies(
    legs: TorqueReference,
    model: SignatureModel,
    nuisances: Sequence[Nuisance],
    commissioned: CommissionedTorque,
) -> BodyFactors:
    """Most probable masses and lengths of a commissioned leg: one step of Gauss and Newton.

    What the torque does not show of them stays that of the file.

    Parameters
    ----------
    legs : TorqueReference
        Of `begin_bodies`, with the clearances of the commissioned leg.
    model : SignatureModel
    nuisances : sequence of Nuisance
    commissioned : CommissionedTorque
    """
    means = [simulated_signatures(legs, leg, model.sensor).mean(axis=0) for leg in range(len(legs.torque_nm))]
    bodies = len(legs.bodies.mass)
    before = np.concatenate([legs.bodies.mass, legs.bodies.length]) - 1.0
    steps, sigma = np.repeat([HEAVIER, LONGER], bodies), np.repeat([_MASS, _LENGTH], bodies)
    slopes = ((np.array(means[1:]) - means[0]) / steps[:, None]).T
    weighted = np.linalg.solve(_covariance(model, nuisances, commissioned.cycles), slopes)
    information = slopes.T @ weighted + np.diag(sigma**-2.0)
    rest = commissioned.mean - means[0]
    found = before + np.linalg.solve(information, weighted.T @ rest - before / sigma**2)
    return BodyFactors(1.0 + found[:bodies], 1.0 + found[bodies:])


def _covariance(model: SignatureModel, nuisances: Sequence[Nuisance], cycles: int) -> Floats:
    """Covariance (F, F) of what a leg's mean signature over some cycles is off its model."""
    phases = model.sensor.phases
    steep = np.hypot(_OF_SIZE * model.sensor.size_nm, _OF_STEP * np.exp(model.mean[phases:]))
    found = model.covariance * (1.0 / cycles + 1.0 / model.cycles)
    found = found + np.diag(np.concatenate([steep, np.full(phases, _ROUGHNESS)]) ** 2)
    for one in nuisances:
        found = found + (_SENSOR * one.spread) ** 2 * np.outer(one.column, one.column)
    return np.asarray(found)

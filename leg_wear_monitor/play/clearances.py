"""From plays of an encoder to clearances of a mechanism's joints: the linear model of `joint_angles`.

A push that turns the encoder's joint presses each journal to the end that turns it most. Between two pushes,
the angle moves by the sum over the joints of 2 |S_phi| c.
"""

import math
from collections.abc import Sequence

import attrs
import numpy as np

from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.mechanism.spec import Mechanism
from leg_wear_monitor.play.result import Clearances, JointClearance
from leg_wear_monitor.twin.reference.joint_angles import PHASES, AngleModel, angle_model

_SURE = 2.0  # standard deviations
_SAME = 1.0e-9  # of the largest singular value: below, two joints have the same effect
_NO_FIT = 3.0  # standard deviations of a play that the clearances cannot explain


def clearances_of(
    mechanism: Mechanism,
    encoder: str,
    crank_angles: Sequence[float],
    play_rad: Sequence[float],
    sigma_rad: Sequence[float],
) -> Clearances:
    """Clearances of a mechanism's clearance joints from plays of an encoder in several postures.

    Parameters
    ----------
    mechanism : Mechanism
        Its other joints count as ideal.
    encoder : str
        Joint with the encoder.
    crank_angles, play_rad, sigma_rad : sequences of float
        Crank angle [rad], play and its standard deviation, of each posture.
    """
    effect = effects(angle_model(mechanism, [encoder]), np.asarray(crank_angles, float))
    return solved(mechanism.clearance_joints, effect, np.asarray(play_rad), np.asarray(sigma_rad))


def effects(model: AngleModel, crank_angle: Floats) -> Floats:
    """Play (r, k) that a meter of radial clearance of each joint gives at crank angles (r,) [rad/m]."""
    middle = (np.arange(PHASES) + 0.5) * (TURN / PHASES)
    tables = model.by_e[:, 0].reshape(PHASES, -1).T
    by_e = np.stack([np.interp(crank_angle, middle, one, period=TURN) for one in tables], axis=1)
    return np.asarray(2.0 * np.linalg.norm(by_e.reshape(len(crank_angle), -1, 2), axis=2))


def solved(names: Sequence[str], effect: Floats, play: Floats, sigma: Floats) -> Clearances:
    """Clearances by weighted least squares, for joints with effects (r, k) on plays (r,) [rad].

    A joint is told if its standard deviation is below half of what the plays allow at most, so that the
    result says more than this bound.
    """
    shown = np.asarray(effect.any(axis=0))
    if not shown.any():
        raise LegWearError("no clearance joint of the mechanism has an effect on this encoder")
    with np.errstate(divide="ignore"):
        most = np.asarray(np.min((play + _SURE * sigma)[:, None] / effect, axis=0))
    # in fractions of these largest clearances, a standard deviation of half of one says nothing new
    a = effect[:, shown] * most[shown] / sigma[:, None]
    value, deviation = np.full((2, len(names)), np.nan)
    value[shown] = np.linalg.lstsq(a, play / sigma, rcond=_SAME)[0]
    deviation[shown] = _deviations(a)
    joints = [
        _joint(name, effect[:, k], float(most[k]), float(value[k]), float(deviation[k]))
        for k, name in enumerate(names)
    ]
    residual = a @ value[shown] - play / sigma
    return Clearances(joints=tuple(joints), findings=tuple(_findings(joints, residual, a)))


def _deviations(a: Floats) -> Floats:
    """Standard deviations of the solution for rows a (r, k) of unit variance; infinite if not determined."""
    _, values, vt = np.linalg.svd(a, full_matrices=True)
    values = np.pad(values, (0, len(vt) - len(values)))
    weak = values <= _SAME * values[0]
    variance = np.square(vt[~weak].T) @ np.square(1.0 / values[~weak])
    blind = np.square(vt[weak]).sum(axis=0) > _SAME
    return np.asarray(np.where(blind, np.inf, np.sqrt(variance)))


def _joint(name: str, effect: Floats, most: float, fraction: float, deviation: float) -> JointClearance:
    """Clearance of a joint from its fraction of the largest one."""
    one = JointClearance(joint=name, rad_per_m=tuple(effect.tolist()))
    if not effect.any():
        return one
    one = attrs.evolve(one, most_m=most)
    if not _SURE * deviation < 1.0:
        return one
    return attrs.evolve(one, clearance_m=fraction * most, sigma_m=deviation * most)


def _findings(joints: Sequence[JointClearance], residual: Floats, a: Floats) -> list[str]:
    found = [
        f"the clearance of {one.joint} would be {1e3 * one.clearance_m:.3g} mm: mechanism, crank angle or "
        "direction of the pushes does not fit"
        for one in joints
        if one.clearance_m is not None and one.sigma_m is not None
        if one.clearance_m < -_SURE * one.sigma_m
    ]
    rest = len(residual) - int(np.linalg.matrix_rank(a))
    if rest > 0 and math.sqrt(float(residual @ residual) / rest) > _NO_FIT:
        found.append("no clearances explain all plays: mechanism, crank angles or pushes do not fit")
    return found

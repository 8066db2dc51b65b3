"""Regression of encoder angles on clearances and on the encoders' own errors, one gait cycle at a time."""

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.twin.reference.joint_angles import PHASES, AngleModel

_RIDGE = 1.0e-9
_HUBER = 1.5  # standard deviations beyond which a bin loses weight
_ROUNDS = 4
_BLIND = 1.0e-3  # fraction of the largest singular value: smaller ones are unobservable


@attrs.frozen(eq=False)
class Estimate:
    """Clearances and encoder errors, with their covariance.

    Attributes
    ----------
    mean : (k + 1 + 2 m,) array
        Clearances [m], offset of the crank's encoder [rad], offsets [rad] and scale errors of the others.
    covariance : array
    joints : int
        Number k of clearance joints.
    """

    mean: Floats
    covariance: Floats
    joints: int

    @property
    def clearance_m(self) -> Floats:
        """Clearances (k,)."""
        return self.mean[: self.joints]

    @property
    def sigma_m(self) -> Floats:
        """Their standard deviations (k,)."""
        return np.asarray(np.sqrt(np.diagonal(self.covariance)[: self.joints]))


def binned(model: AngleModel, crank_angle: Floats, angles: Floats) -> tuple[Floats, Floats]:
    """Mean deviation (P, m) [rad] of a cycle's samples in each phase, NaN without any; and their counts."""
    at = np.minimum((crank_angle % TURN) * (PHASES / TURN), PHASES - 0.5).astype(np.int64)
    deviation = model.deviation(crank_angle, angles)
    there = np.isfinite(deviation)
    sums, counts = np.zeros((2, PHASES, angles.shape[1]))
    np.add.at(sums, at, np.where(there, deviation, 0.0))
    np.add.at(counts, at, there.astype(float))
    with np.errstate(invalid="ignore"):
        return sums / counts, counts


def regress(columns: Floats, deviation: Floats, counts: Floats, before: Estimate) -> Floats:
    """Clearances and encoder errors (k + 1 + 2 m,) of one cycle, by Huber's M-estimate.

    Unobservable directions keep their prior values.

    Parameters
    ----------
    columns : (P, m, k + 1 + 2 m) array
        As `design` gives them.
    deviation, counts : (P, m) arrays
        Results of `binned`.
    before : Estimate
        Prior, which separates with a very small weight what the sensors cannot.
    """
    p = columns.shape[-1]
    used = (counts > 0.0).ravel()
    x, y = columns.reshape(-1, p)[used], deviation.ravel()[used]
    root = np.sqrt(counts.ravel()[used])
    y = y - x @ before.mean
    length = np.linalg.norm(x, axis=0)
    scale = 1.0 / np.where(length > 0.0, length, 1.0)
    x = x * scale
    weight, solution = root.copy(), np.zeros(p)
    for _ in range(_ROUNDS):
        a = x * weight[:, None]
        ridge = _RIDGE * np.linalg.norm(a) ** 2 / p
        solution = np.linalg.solve(a.T @ a + ridge * np.eye(p), a.T @ (y * weight))
        residual = np.abs(y - x @ solution) * root
        spread = max(1.4826 * float(np.median(residual)), 1.0e-12)
        weight = root * np.sqrt(np.minimum(1.0, _HUBER * spread / np.maximum(residual, 1.0e-300)))
    return np.asarray(before.mean + scale * solution)


def blind_directions(columns: Floats, counts: Floats) -> Floats:
    """Unobservable changes (n, p) of the parameters; ``counts`` (P, m) are the samples in each bin."""
    a = columns.reshape(-1, columns.shape[-1])[(counts > 0.0).ravel()]
    length = np.linalg.norm(a, axis=0)
    length[length == 0.0] = 1.0
    _, s, vt = np.linalg.svd(a / length, full_matrices=len(a) < a.shape[1])
    shown = np.pad(s, (0, len(vt) - len(s)))
    return np.asarray(vt[shown <= _BLIND * s[0]] / length)


def rms(values: Floats) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))

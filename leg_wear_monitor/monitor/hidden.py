"""Clearances seen in the joint states: a regression on the angles of further joints, cycle by cycle.

Each gait cycle gives an estimate of all clearances and of the encoders' own errors, robust against outliers.
Single cycles are chaotic, so how far cycles scatter, and nothing else, says how good their mean is. That mean
is fused with what was known before: the clearances that Archard's law predicts, and the encoders' errors as
held since commissioning. A sensor that comes later starts with errors that are not known.
"""

from collections.abc import Sequence
from enum import Enum

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.ideal import TURN
from leg_wear_monitor.twin.joint_angles import PHASES, SHAPE_CYCLES, AngleModel, design

OFFSET_SIGMA_RAD = 0.05  # of an encoder that is not commissioned
SCALE_SIGMA = 0.01
LEAST_CYCLES = 20
# what the linear model and its shape are off against full coordinates (benchmarks/hidden.py)
MODEL_SIGMA_M = 2.0e-5

_RIDGE = 1.0e-9
_HUBER = 1.5  # standard deviations beyond which a bin loses weight
_ROUNDS = 4
_BATCH = 2  # cycles: neighbours hang together
_NO_NEWS = 1.0e6  # of the variance before
_BLIND = 1.0e-3  # of the largest singular value: less is not shown


class Observable(Enum):
    """Whether sensors show a joint's clearance."""

    YES = "observable"
    TOGETHER = "observable only together with others"
    NO = "not observable"


@attrs.frozen(eq=False)
class Estimate:
    """Clearances and encoder errors, with their covariance.

    Attributes
    ----------
    mean : (k + 1 + 2 m,) array
        Clearances [m], offset of the crank's encoder [rad], offsets [rad] and scale errors of the others.
    covariance : array
    joints : int
        k.
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


def known_before(clearance_m: Sequence[float], sigma_m: float | Floats, sensors: int) -> Estimate:
    """What is known without a look at encoders: the clearances, and nothing of the encoders' errors.

    Parameters
    ----------
    clearance_m : sequence of k float
        When new, or as Archard's law predicts.
    sigma_m : float or (k,) array
    sensors : int
        Encoders beside the crank's.
    """
    k = len(clearance_m)
    sigma = np.concatenate(
        [
            np.broadcast_to(sigma_m, k),
            np.full(1 + sensors, OFFSET_SIGMA_RAD),
            np.full(sensors, SCALE_SIGMA),
        ]
    )
    return Estimate(np.concatenate([clearance_m, np.zeros(1 + 2 * sensors)]), np.diag(np.square(sigma)), k)


def with_clearances(before: Estimate, clearance_m: Sequence[float], sigma_m: float | Floats) -> Estimate:
    """The encoders' errors as held, and clearances as predicted anew."""
    k = before.joints
    mean, covariance = before.mean.copy(), before.covariance.copy()
    mean[:k] = clearance_m
    covariance[:k], covariance[:, :k] = 0.0, 0.0
    covariance[:k, :k] = np.diag(np.square(np.broadcast_to(sigma_m, k)))
    return Estimate(mean, covariance, k)


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

    What no sensor shows stays as it was before.

    Parameters
    ----------
    columns : (P, m, k + 1 + 2 m) array
        As `design` gives them.
    deviation, counts : (P, m) arrays
        Of `binned`.
    before : Estimate
        Keeps apart, very weakly, what sensors cannot.
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


class HiddenClearance:
    """Estimates clearances from encoders, cycle by cycle.

    Parameters
    ----------
    model : AngleModel
    shape : (P, k, 2) array
        As `contact_shape` gives it.
    before : Estimate
        What is known without these cycles.
    cycles : int
        That are kept: the estimate is of these last ones.
    shape_cycles : int
        That were simulated for a shape.
    """

    def __init__(
        self,
        model: AngleModel,
        shape: Floats,
        before: Estimate,
        cycles: int = 300,
        shape_cycles: int = SHAPE_CYCLES,
    ) -> None:
        self._model, self._columns, self._most = model, design(model, shape), cycles
        self.before, self._shape_cycles = before, shape_cycles
        self._seen: list[tuple[Floats, Floats]] = []
        self._each: list[Floats] = []

    def add(self, crank_angle: Floats, angles: Floats) -> None:
        """Take in a gait cycle's samples: crank angles (n,) [rad], encoders (n, m) [rad], NaN where none."""
        deviation, counts = binned(self._model, crank_angle, angles)
        self._seen.append((deviation, counts))
        self._each.append(regress(self._columns, deviation, counts, self.before))
        del self._seen[: -self._most], self._each[: -self._most]

    def reshape(self, shape: Floats) -> None:
        """Look at the kept cycles again with another shape: that of the clearances found."""
        self._columns = design(self._model, shape)
        self._each = [regress(self._columns, *seen, self.before) for seen in self._seen]

    def alone_worn(self, k: int, shape: Floats) -> tuple[float, float]:
        """How badly the kept cycles fit if joint k alone is not as expected; and its clearance then [m].

        Parameters
        ----------
        k : int
        shape : (P, k, 2) array
            As `contact_shape` gives it for such a leg.

        Returns
        -------
        misfit, clearance_m : float
            RMS of what is left [rad], and the clearance that leaves least.
        """
        counts = np.sum([counts for _, counts in self._seen], axis=0)
        sums = np.nansum([deviation * counts for deviation, counts in self._seen], axis=0)
        used = counts.ravel() > 0.0
        columns = design(self._model, shape).reshape(-1, len(self.before.mean))[used]
        rest, column = self.before.mean.copy(), columns[:, k]
        rest[k] = 0.0
        left = (sums.ravel()[used] / counts.ravel()[used]) - columns @ rest
        size = float(column @ column)
        clearance_m = float(column @ left) / size if size > 0.0 else float(self.before.mean[k])
        return _rms(left - clearance_m * column), clearance_m

    @property
    def cycles(self) -> int:
        """Cycles that are kept."""
        return len(self._each)

    def alone(self) -> Estimate | None:
        """What the cycles say by themselves; None while there are not enough."""
        if len(self._each) < LEAST_CYCLES:
            return None
        each = np.array(self._each)
        size = len(each) // _BATCH
        batches = each[len(each) - _BATCH * size :].reshape(size, _BATCH, -1).mean(axis=1)
        # a shape has the scatter of the cycles that it was simulated from
        covariance = np.cov(batches, rowvar=False) * (1.0 / size + _BATCH / self._shape_cycles)
        floor = 1.0e-6 * np.diagonal(self.before.covariance)
        floor[: self.before.joints] += MODEL_SIGMA_M**2
        return Estimate(np.median(batches, axis=0), covariance + np.diag(floor), self.before.joints)

    def fused(self) -> Estimate | None:
        """The cycles and what was known before, weighted by their covariances (a Kalman filter's update)."""
        seen = self.alone()
        if seen is None:
            return None
        blind = blind_directions(self._columns, np.sum([counts for _, counts in self._seen], axis=0))
        # along what the sensors do not show, each cycle repeats what was known before: that is no news
        scale = np.sqrt(np.diagonal(self.before.covariance))
        across = blind / scale
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        prior = self.before.covariance / np.outer(scale, scale)
        noise = seen.covariance / np.outer(scale, scale) + _NO_NEWS * across.T @ across
        gain = np.linalg.solve(prior + noise, prior).T
        mean = self.before.mean + scale * (gain @ ((seen.mean - self.before.mean) / scale))
        rest = np.eye(len(mean)) - gain
        covariance = rest @ prior @ rest.T + gain @ noise @ gain.T
        return Estimate(mean, covariance * np.outer(scale, scale), self.before.joints)


def blind_directions(columns: Floats, counts: Floats) -> Floats:
    """Changes (n, p) of the parameters that sensors do not show; ``counts`` (P, m) samples in each bin."""
    a = columns.reshape(-1, columns.shape[-1])[(counts > 0.0).ravel()]
    length = np.linalg.norm(a, axis=0)
    length[length == 0.0] = 1.0
    _, s, vt = np.linalg.svd(a / length)
    return np.asarray(vt[s <= _BLIND * s[0]] / length)


def observability(columns: Floats, sensors: Sequence[int], joints: int) -> list[tuple[Observable, float]]:
    """Of each loose joint, whether some of the sensors show its clearance, and how much.

    Parameters
    ----------
    columns : (P, m, k + 1 + 2 m) array
        As `design` gives them.
    sensors : sequence of int
        Those of the m that are there.
    joints : int
        k.

    Returns
    -------
    list of (Observable, float)
        With the RMS deviation [rad/m] that its clearance makes beyond what other clearances and the
        encoders' errors can make, too.
    """
    m, errors = columns.shape[1], joints + 1
    own = [*range(errors), *(errors + i for i in sensors), *(errors + m + i for i in sensors)]
    a = columns[:, list(sensors)][:, :, own].reshape(-1, len(own))
    found = []
    for k in range(joints):
        alone = _rms(_beyond(a[:, joints:], a[:, k]))
        apart = _rms(_beyond(np.delete(a, k, axis=1), a[:, k]))
        seen = Observable.TOGETHER if apart < 0.02 * alone else Observable.YES
        found.append((Observable.NO if alone < 1.0e-3 else seen, apart))
    return found


def _beyond(others: Floats, column: Floats) -> Floats:
    """What of a column others cannot make."""
    return np.asarray(column - others @ np.linalg.lstsq(others, column, rcond=1.0e-9)[0])


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def worn_joint(
    expected: Estimate, found: Estimate, sigmas: float = 4.0, least_m: float = 5.0e-5
) -> int | None:
    """The loose joint whose clearance is most surely another than expected, None if none surely is.

    Parameters
    ----------
    expected : Estimate
        By Archard's law.
    found : Estimate
        By the encoders.
    sigmas, least_m : float
        Least departure, in standard deviations and in metres.
    """
    off = np.abs(found.clearance_m - expected.clearance_m)
    surely = np.where(off >= least_m, off / found.sigma_m, 0.0)
    k = int(surely.argmax())
    return k if surely[k] >= sigmas else None

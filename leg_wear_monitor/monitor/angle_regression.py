"""Regression of encoder angles on clearances and on the encoders' own errors, one gait cycle at a time."""

import math
from enum import Enum

import attrs
import numpy as np

from leg_wear_monitor.errors import LegWearError
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.position import TURN
from leg_wear_monitor.twin.references import PHASES, AngleModel, AngleReference

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
        """Standard deviations of the clearances (k,)."""
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
        Prior, which has a very small weight and separates values that the sensors cannot.
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


# Clearance estimates from the joint states: a regression on the angles of further joints, cycle by cycle.
#
# Each gait cycle gives an estimate of all clearances and of the encoders' own errors, robust against
# outliers. Single cycles are chaotic, so the uncertainty of their mean is computed from the scatter of the
# cycles alone. The mean is fused with the prior: the expected clearances, and the encoders' errors as fixed
# at commissioning. A sensor that is added later starts with unknown errors.


LEAST_CYCLES = 20
# error of the linear model and its reference against full coordinates
MODEL_SIGMA_M = 2.0e-5

_BATCH = 2  # cycles per batch: neighbouring cycles are correlated
_NO_NEWS = 1.0e6  # times the prior variance: no information


class ClearanceRegression:
    """Estimates clearances from encoders, cycle by cycle.

    Parameters
    ----------
    model : AngleModel
    reference : AngleReference, optional
        Expected angles; cycles are kept without evaluation until it is given.
    before : Estimate, optional
        Prior knowledge without these cycles; given with the reference.
    most : int
        Number of cycles that are kept; the estimate uses the last ones.

    Attributes
    ----------
    most : int
        As above; may be changed.
    """

    def __init__(
        self,
        model: AngleModel,
        reference: AngleReference | None = None,
        before: Estimate | None = None,
        most: int = 300,
    ) -> None:
        self._model, self.most = model, most
        self._reference, self._before = reference, before
        self._cycles: list[tuple[Floats, Floats]] = []
        self._each: list[Floats] = []

    def add(self, crank_angle: Floats, angles: Floats) -> None:
        """Add the samples of a gait cycle: crank (n,) and encoder angles (n, m) [rad], NaN where absent."""
        self.add_binned(*binned(self._model, crank_angle, angles))

    def add_binned(self, deviation: Floats, counts: Floats) -> None:
        """Add a gait cycle as returned by `binned`."""
        self._cycles.append((deviation, counts))
        if self._reference is not None:
            self._each.append(self._regressed(deviation, counts))
        del self._cycles[: -self.most], self._each[: -self.most]

    def refer(self, reference: AngleReference, before: Estimate) -> None:
        """Evaluate the kept cycles with a new reference and a new prior."""
        self._reference, self._before = reference, before
        self._each = [self._regressed(*cycle) for cycle in self._cycles]

    def forget(self) -> None:
        """Drop the kept cycles, because the leg has changed."""
        self._cycles, self._each = [], []

    def _regressed(self, deviation: Floats, counts: Floats) -> Floats:
        reference, before = self._given()
        joints = before.joints
        columns = self._columns(counts)
        # the prior is expressed at the linearisation point: at the clearances of the reference
        shift = reference.deviation - columns[:, :, :joints] @ reference.clearance_m
        return regress(columns, deviation - shift, counts, before)

    def _columns(self, counts: Floats) -> Floats:
        """Columns of the regression for the available encoders, given the counts (P, m) of their samples.

        Joints without a direct effect are excluded: an effect through other joints alone is not
        proportional to the clearance and would give wrong estimates.
        """
        reference, before = self._given()
        there = counts.any(axis=0)
        shown = self._model.by_e[:, there].any(axis=(0, 1, 3))
        columns = reference.columns.copy()
        columns[:, :, : before.joints][:, :, ~shown] = 0.0
        return columns

    def _given(self) -> tuple[AngleReference, Estimate]:
        if self._reference is None or self._before is None:
            raise LegWearError("no reference was given yet")
        return self._reference, self._before

    @property
    def reference(self) -> AngleReference | None:
        """Reference that the cycles are compared with."""
        return self._reference

    @property
    def cycles(self) -> int:
        """Number of kept cycles."""
        return len(self._cycles)

    def alone(self) -> Estimate | None:
        """Estimate from the cycles alone, without the prior; None while there are not enough."""
        if len(self._each) < LEAST_CYCLES:
            return None
        reference, before = self._given()
        each = np.array(self._each)
        size = len(each) // _BATCH
        batches = each[len(each) - _BATCH * size :].reshape(size, _BATCH, -1).mean(axis=1)
        # scatter from differences of neighbouring cycles, so that slow changes do not add to it
        steps = np.diff(batches, axis=0)
        scatter = steps.T @ steps / (2.0 * len(steps))
        # the reference adds the scatter of the cycles that it was simulated from
        covariance = scatter * (1.0 / size + _BATCH / reference.cycles)
        floor = 1.0e-6 * np.diagonal(before.covariance)
        floor[: before.joints] += MODEL_SIGMA_M**2
        return Estimate(np.median(batches, axis=0), covariance + np.diag(floor), before.joints)

    def fused(self) -> Estimate | None:
        """Cycles and prior, weighted by their covariances (update step of a Kalman filter)."""
        alone = self.alone()
        if alone is None:
            return None
        _, before = self._given()
        counts = np.sum([counts for _, counts in self._cycles], axis=0)
        blind = blind_directions(self._columns(counts), counts)
        # in unobservable directions, each cycle repeats the prior and adds no information
        scale = np.sqrt(np.diagonal(before.covariance))
        across = blind / scale
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        prior = before.covariance / np.outer(scale, scale)
        noise = alone.covariance / np.outer(scale, scale) + _NO_NEWS * across.T @ across
        gain = np.linalg.solve(prior + noise, prior).T
        mean = before.mean + scale * (gain @ ((alone.mean - before.mean) / scale))
        rest = np.eye(len(mean)) - gain
        covariance = rest @ prior @ rest.T + gain @ noise @ gain.T
        return Estimate(mean, covariance * np.outer(scale, scale), before.joints)


# Estimate of a joint's clearance from further encoders.


ESTIMATED_M = 1.0e-4  # largest standard deviation of an observable clearance
SURE_SIGMAS = 4.0
LEAST_M = 5.0e-5  # smallest departure that is reported


class ClearanceObservation(Enum):
    """Observability of a clearance; the value is human-readable."""

    WAITING = "not enough gait cycles with encoders yet"
    COMMISSIONING = "the encoders are being commissioned"
    NOT_OBSERVABLE = "not observable with these encoders"
    SEEN = "seen by encoders"


@attrs.frozen(kw_only=True)
class ClearanceEstimate:
    """A clearance estimated from encoders.

    Attributes
    ----------
    observation : ClearanceObservation
    clearance_m, sigma_m : float
        Clearance and its standard deviation; NaN unless it is estimated.
    departure_m : float
        Estimated minus modelled clearance; NaN unless it is estimated.
    believed : bool
        True if the forecast uses it: not if the model gives it a tail probability below 0.135 %.
    """

    observation: ClearanceObservation
    clearance_m: float = math.nan
    sigma_m: float = math.nan
    departure_m: float = math.nan
    believed: bool = False

    @property
    def is_other(self) -> bool:
        """True if the clearance differs significantly from the modelled clearance."""
        return abs(self.departure_m) >= max(LEAST_M, SURE_SIGMAS * self.sigma_m)

    @property
    def surely_m(self) -> float:
        """Size of a significant departure; 0 if there is none, NaN if it is not estimated."""
        return abs(self.departure_m) if self.is_other else 0.0 * self.departure_m


def clearance_estimates(found: Estimate, modelled_m: Floats) -> tuple[ClearanceEstimate, ...]:
    """Estimates of each joint, compared with the modelled clearances (k,) [m]."""
    return tuple(
        _estimate(float(clearance), float(sigma), float(counted))
        for clearance, sigma, counted in zip(found.clearance_m, found.sigma_m, modelled_m, strict=True)
    )


def _estimate(clearance_m: float, sigma_m: float, modelled_m: float) -> ClearanceEstimate:
    if sigma_m > ESTIMATED_M:
        return ClearanceEstimate(observation=ClearanceObservation.NOT_OBSERVABLE)
    return ClearanceEstimate(
        observation=ClearanceObservation.SEEN,
        clearance_m=clearance_m,
        sigma_m=sigma_m,
        departure_m=clearance_m - modelled_m,
    )

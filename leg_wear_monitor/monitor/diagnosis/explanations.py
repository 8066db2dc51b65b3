"""What may explain a change of the torque's signature: a clearance, or something else."""

import math
from collections.abc import Sequence

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.diagnosis.diagnosis import Cause
from leg_wear_monitor.monitor.diagnosis.signature_model import SignatureModel

MODEL_ERROR = 0.1  # of what a clearance changes: another leg's masses and lengths change it by so much

_SIZES = 24  # clearances of a joint that are tried; between them a parabola finds the best
_LEAST_FACTOR = 0.7  # of the counted clearance


@attrs.frozen(eq=False)
class Nuisance:
    """A quantity other than a clearance that changes signatures.

    Attributes
    ----------
    cause : Cause
    subject : str
        The body, for a mass.
    column : (F,) array
        Change of the signature by a unit of the quantity.
    spread : float
        Standard deviation of its changes in a leg that is all right; 0 for what does not change by itself.
    """

    cause: Cause
    subject: str
    column: Floats
    spread: float


@attrs.frozen(eq=False)
class Baseline:
    """What measured signatures have in addition to those of the model, in a leg as it is counted.

    Attributes
    ----------
    offset : (F,) array
        Mean difference of the commissioned leg; zeros before.
    covariance : (F, F) array
        Its uncertainty.
    scatter : (n, F) array
        Departures of the commissioned leg's gait cycles from their mean; no rows before.
    """

    offset: Floats
    covariance: Floats
    scatter: Floats


@attrs.frozen(kw_only=True)
class Explanation:
    """A cause that explains a change, and how well.

    Attributes
    ----------
    cause : Cause
    subject : str
        Joint or body; empty where there is none.
    value, sigma, counted : float
        As those of `Change`.
    misfit : float
        Minus twice the logarithm of its likelihood, less a constant.
    """

    cause: Cause
    subject: str
    value: float
    sigma: float
    counted: float
    misfit: float


class Explainer:
    """Compares causes of a change.

    Parameters
    ----------
    model : SignatureModel
    joints : sequence of str
    baseline : Baseline
    nuisances : sequence of Nuisance
    """

    def __init__(
        self, model: SignatureModel, joints: Sequence[str], baseline: Baseline, nuisances: Sequence[Nuisance]
    ) -> None:
        self.model, self.joints, self.baseline, self.nuisances = (
            model,
            tuple(joints),
            baseline,
            tuple(nuisances),
        )
        self._constant = baseline.covariance.copy()  # what does not become less over several cycles
        for one in nuisances:
            if one.spread:
                self._constant += one.spread**2 * np.outer(one.column, one.column)

    def covariance(self, cycles: int) -> Floats:
        """Covariance (F, F) of the mean of some cycles' signatures in a leg as counted."""
        model = self.model
        return np.asarray(model.covariance * (1.0 / cycles + 1.0 / model.cycles) + self._constant)

    def explanations(self, mean: Floats, cycles: int, counted_m: Floats) -> list[Explanation]:
        """Single causes of a change, the best first.

        Parameters
        ----------
        mean : (F,) array
            Mean signature of the cycles since the change.
        cycles : int
        counted_m : (k,) array
            Counted clearances.
        """
        there = self.model.at(counted_m)[0]
        rest = mean - self.baseline.offset - there
        found = [self._as_counted(rest, cycles)]
        found += [self._clearance(k, rest, there, cycles, counted_m) for k in range(len(counted_m))]
        found += [self._nuisance(one, rest, self.covariance(cycles)) for one in self.nuisances]
        return sorted(found, key=lambda one: one.misfit)

    def _as_counted(self, rest: Floats, cycles: int) -> Explanation:
        misfit = _misfit(rest, self.covariance(cycles))
        return Explanation(cause=Cause.UNKNOWN, subject="", value=0.0, sigma=0.0, counted=0.0, misfit=misfit)

    def _clearance(self, k: int, rest: Floats, there: Floats, cycles: int, counted_m: Floats) -> Explanation:
        """Best clearance of one joint, the others as counted."""
        covariance, widest = self.covariance(cycles), self.model.grid_m[k, -1]
        sizes = np.geomspace(_LEAST_FACTOR * counted_m[k], max(widest, counted_m[k]), _SIZES)
        misfits = np.empty(_SIZES)
        for i, size in enumerate(sizes):
            change = self.model.at(opened(counted_m, k, size))[0] - there
            misfits[i] = _misfit(rest - change, covariance + np.diag((MODEL_ERROR * change) ** 2))
        best = int(misfits.argmin())
        value, sigma = _vertex(np.log(sizes), misfits, best)
        size = float(np.exp(value))
        change = self.model.at(opened(counted_m, k, size))[0] - there
        poor = poorness(rest - change, covariance + np.diag((MODEL_ERROR * change) ** 2))
        return Explanation(
            cause=Cause.CLEARANCE,
            subject=self.joints[k],
            value=size,
            sigma=float(poor * np.hypot(size * sigma, MODEL_ERROR * (size - counted_m[k]))),
            counted=float(counted_m[k]),
            misfit=float(misfits[best]),
        )

    def _nuisance(self, one: Nuisance, rest: Floats, covariance: Floats) -> Explanation:
        """Best value of a nuisance, of which nothing was known."""
        plain = covariance - one.spread**2 * np.outer(one.column, one.column)
        weighted = np.linalg.solve(plain, one.column)
        information = float(weighted @ one.column)
        value = float(weighted @ rest) / information
        change = value * one.column
        misfit = _misfit(rest - change, plain + np.diag((MODEL_ERROR * change) ** 2))
        return Explanation(
            cause=one.cause,
            subject=one.subject,
            value=value,
            sigma=information**-0.5,
            counted=0.0,
            misfit=misfit,
        )


def opened(clearance_m: Floats, k: int, size: float) -> Floats:
    """Clearances (k,) [m] with that of one joint replaced."""
    changed = clearance_m.copy()
    changed[k] = size
    return changed


def _misfit(rest: Floats, covariance: Floats) -> float:
    """Minus twice the logarithm of a normal density, less a constant."""
    root = np.linalg.cholesky(covariance)
    return float(np.sum(np.linalg.solve(root, rest) ** 2) + 2.0 * np.log(np.diagonal(root)).sum())


def poorness(rest: Floats, covariance: Floats) -> float:
    """Birge's ratio, at least 1: by how much a standard deviation is too small where the best fit is poor."""
    ratio = float(rest @ np.linalg.solve(covariance, rest)) / len(rest)
    return math.sqrt(max(1.0, ratio))


def _vertex(x: Floats, y: Floats, best: int) -> tuple[float, float]:
    """Place of a parabola's vertex about the least of y, and the standard deviation that its width gives."""
    i = int(np.clip(best, 1, len(x) - 2))
    left, right = (y[i] - y[i - 1]) / (x[i] - x[i - 1]), (y[i + 1] - y[i]) / (x[i + 1] - x[i])
    bend = (right - left) / (0.5 * (x[i + 1] - x[i - 1]))
    if not bend > 0.0:
        return float(x[best]), float(x[i + 1] - x[i - 1])
    place = x[i] - 0.5 * (left + right) / bend
    return float(np.clip(place, x[i - 1], x[i + 1])), float((2.0 / bend) ** 0.5)

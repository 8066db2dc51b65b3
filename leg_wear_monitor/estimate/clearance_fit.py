"""All clearances at once from a mean signature, with their covariance."""

import attrs
import numpy as np

from leg_wear_monitor.estimate.explanations import MODEL_ERROR, Explainer
from leg_wear_monitor.mechanism.arrays import Floats

_ROUNDS = 30
_LEAST_FACTOR = 0.7  # of the expected clearance
_FLAT = 1.0  # prior standard deviation of a clearance's logarithm: what shows nothing keeps its prior
_MODEL_M = 5.0e-6  # error of the model against full coordinates (docs/explanation/diagnosis.md)


@attrs.frozen(eq=False)
class ClearanceFit:
    """Clearances (k,) [m], their covariance (k, k) [m^2], and the misfit: about F if the model holds."""

    clearance_m: Floats
    covariance: Floats
    misfit: float

    @property
    def sigma_m(self) -> Floats:
        """Standard deviations (k,)."""
        return np.asarray(np.sqrt(np.diagonal(self.covariance)))


def fit_clearances(
    explainer: Explainer,
    mean: Floats,
    cycles: int,
    start_m: Floats,
    counted_m: Floats,
    known_sigma_m: Floats | float = 0.0,
) -> ClearanceFit:
    """Generalised least squares over the logarithms of all clearances.

    Parameters
    ----------
    explainer : Explainer
    mean : (F,) array
        Mean signature.
    cycles : int
    start_m, counted_m : (k,) arrays
        Where the search begins, and the counted clearances.
    known_sigma_m : (k,) array, optional
        Standard deviations of the clearances that the baseline was taken with.
    """
    model = explainer.model
    measured = mean - explainer.baseline.offset
    change = model.at(start_m)[0] - model.at(counted_m)[0]
    weight = np.linalg.inv(explainer.covariance(cycles) + np.diag((MODEL_ERROR * change) ** 2))
    low, high = np.log(_LEAST_FACTOR * model.grid_m[:, 0]), np.log(model.grid_m[:, -1])
    prior = np.eye(len(start_m)) / _FLAT**2
    x = np.clip(np.log(start_m), low, high)

    def cost(at: Floats) -> float:
        rest, off = measured - model.at(np.exp(at))[0], at - np.log(counted_m)
        return float(rest @ weight @ rest + off @ prior @ off)

    best = cost(x)
    for _ in range(_ROUNDS):
        expected, slopes = model.at(np.exp(x))
        information = slopes.T @ weight @ slopes + prior
        downhill = slopes.T @ weight @ (measured - expected) - prior @ (x - np.log(counted_m))
        step, length = np.linalg.solve(information, downhill), 1.0
        while length > 1.0e-3 and not cost(np.clip(x + length * step, low, high)) < best - 1.0e-9:
            length *= 0.5
        if length <= 1.0e-3:
            break
        x = np.clip(x + length * step, low, high)
        best = cost(x)
    expected, slopes = model.at(np.exp(x))
    spread = np.linalg.inv(slopes.T @ weight @ slopes + prior)
    clearance: Floats = np.asarray(np.exp(x), dtype=np.float64)
    # what a clearance changes is known to a fraction, and so is a clearance that is far from the counted one
    uncertain = np.hypot(_MODEL_M, MODEL_ERROR * (clearance - counted_m))
    # a baseline after a correction hides what that is off
    covariance = spread * np.outer(clearance, clearance) + np.diag(uncertain**2 + known_sigma_m**2)
    rest = measured - expected
    misfit = float(rest @ weight @ rest)
    return ClearanceFit(clearance, max(1.0, misfit / len(rest)) * covariance, misfit)

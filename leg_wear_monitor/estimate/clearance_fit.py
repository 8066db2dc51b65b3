"""All clearances at once from a mean signature, with their covariance."""

import attrs
import numpy as np

from leg_wear_monitor.estimate.explanations import MODEL_ERROR, Explainer
from leg_wear_monitor.estimate.least_squares import Point, gauss_newton
from leg_wear_monitor.mechanism.arrays import Floats

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
    measured, counted = mean - explainer.baseline.offset, np.log(counted_m)
    change = model.at(start_m)[0] - model.at(counted_m)[0]
    covariance = explainer.covariance(cycles) + np.diag((MODEL_ERROR * change) ** 2)
    whiten = np.linalg.inv(np.linalg.cholesky(covariance))

    def at(x: Floats) -> Point:
        expected, slopes = model.at(np.exp(x))
        rest = np.concatenate([whiten @ (expected - measured), (x - counted) / _FLAT])
        return Point(rest, lambda: np.vstack([whiten @ slopes, np.eye(len(x)) / _FLAT]))

    low, high = np.log(_LEAST_FACTOR * model.grid_m[:, 0]), np.log(model.grid_m[:, -1])
    found = gauss_newton(at, np.log(start_m), low=low, high=high)
    clearance: Floats = np.asarray(np.exp(found.x), dtype=np.float64)
    # what a clearance changes is known to a fraction, and so is a clearance that is far from the counted one
    uncertain = np.hypot(_MODEL_M, MODEL_ERROR * (clearance - counted_m))
    # a baseline after a correction hides what that is off
    covariance = found.covariance * np.outer(clearance, clearance) + np.diag(uncertain**2 + known_sigma_m**2)
    misfit = float(np.square(found.point.rest[: len(mean)]).sum())
    return ClearanceFit(clearance, max(1.0, misfit / len(mean)) * covariance, misfit)

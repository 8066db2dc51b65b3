"""Fit of all clearances to a mean signature, with their covariance."""

from collections.abc import Sequence

import attrs
import numpy as np

from leg_wear_monitor.estimate.cause import SURE_LOG_ODDS, SURE_SIGMAS, Cause, Change
from leg_wear_monitor.estimate.explanations import MODEL_ERROR, Explainer, Explanation, opened
from leg_wear_monitor.estimate.least_squares import Point, gauss_newton
from leg_wear_monitor.mechanism.arrays import Floats

_LEAST_FACTOR = 0.7  # smallest clearance over the expected one
_FLAT = 1.0  # prior standard deviation of a clearance's logarithm: an unobservable clearance keeps its prior
_NARROWER = 0.03  # the same on the narrow side for a new part, because wear only opens
# mean square up to which clearances explain: one joint that opened leaves 0.4 to 1.3, two at once do not add
# up. A and G at 0.45 mm left 2.1 to 2.4, and G was 0.33 ± 0.01 mm, B 0.35 ± 0.02 (2026-11-26)
_EXPLAINED = 1.75
_FIT_ROUNDS = 2
_ELSEWHERE = 1.5  # factor on a clearance where a further search for each joint begins
_MODEL_M = 5.0e-6  # error of the model against full coordinates (docs/explanation/diagnosis.md)


@attrs.frozen(eq=False)
class ClearanceFit:
    """Clearances (k,) [m] and their covariance (k, k) [m^2].

    `square` is the mean square of their residual, about 1 if the model holds; `unlikely` is minus twice the
    logarithm of their probability, less a constant.
    """

    clearance_m: Floats
    covariance: Floats
    square: float
    unlikely: float

    @property
    def sigma_m(self) -> Floats:
        """Standard deviations (k,)."""
        return np.asarray(np.sqrt(np.diagonal(self.covariance)))

    @property
    def explains(self) -> bool:
        """True if the clearances explain the measured signature."""
        return self.square <= _EXPLAINED

    def agrees(self, k: int, change: Change) -> bool:
        """True if the fit of all clearances gives joint k the same size as a change of joint k alone."""
        return bool(abs(self.clearance_m[k] - change.value) <= SURE_SIGMAS * change.sigma)


def fit_clearances(
    explainer: Explainer,
    mean: Floats,
    cycles: int,
    start_m: Floats,
    modelled_m: Floats,
    known_sigma_m: Floats | float = 0.0,
) -> ClearanceFit:
    """Generalised least squares over the logarithms of all clearances.

    Parameters
    ----------
    explainer : Explainer
    mean : (F,) array
        Mean signature.
    cycles : int
    start_m, modelled_m : (k,) arrays
        Where the search begins, and the modelled clearances.
    known_sigma_m : (k,) array, optional
        Standard deviations of the clearances that the baseline was taken with.
    """
    model = explainer.model
    measured, counted = mean - explainer.baseline.offset, np.log(modelled_m)
    low, high = np.log(_LEAST_FACTOR * model.joints.grid[:, 0]), np.log(model.joints.grid[:, -1])
    new, flat = np.log(np.minimum(modelled_m, explainer.fresh_m)), np.eye(len(modelled_m)) / _FLAT
    clearance: Floats = start_m
    for _ in range(_FIT_ROUNDS):  # the error of the model depends on the clearances
        change = model.at(clearance)[0] - model.at(modelled_m)[0]
        scatter = model.scatter_at(clearance) + float(explainer.error(change[None])[0])
        whiten, log_size = explainer.whitening(cycles, scatter)

        def at(x: Floats, whiten: Floats = whiten) -> Point:
            expected, slopes = model.at(np.exp(x))
            below = np.minimum(x - new, 0.0) / _NARROWER
            rest = np.concatenate([whiten @ (expected - measured), (x - counted) / _FLAT, below])
            return Point(rest, lambda: np.vstack([whiten @ slopes, flat, np.diag((below < 0.0) / _NARROWER)]))

        found = gauss_newton(at, np.log(clearance), low=low, high=high)
        clearance = np.asarray(np.exp(found.x), dtype=np.float64)
    # the effect of a clearance is known to a fraction, and so is a clearance far from the modelled one
    uncertain = np.hypot(_MODEL_M, MODEL_ERROR * (clearance - modelled_m))
    # a baseline after a correction hides the error of the correction
    covariance = found.covariance * np.outer(clearance, clearance) + np.diag(uncertain**2 + known_sigma_m**2)
    square = float(np.square(found.point.rest[: len(mean)]).mean())
    fit = ClearanceFit(
        clearance, max(1.0, square) * covariance, square, unlikely=found.point.square + log_size
    )
    if fit.explains:
        return fit
    return attrs.evolve(fit, covariance=fit.covariance + np.diag(clearance**2))


def best_fit(
    explainer: Explainer,
    mean: Floats,
    cycles: int,
    modelled_m: Floats,
    starts: Sequence[Floats],
    known_sigma_m: Floats | float = 0.0,
) -> ClearanceFit:
    """All clearances from a mean signature, from the best of several starts: there are several minima."""
    fits = [fit_clearances(explainer, mean, cycles, start, modelled_m, known_sigma_m) for start in starts]
    return min(fits, key=lambda fit: fit.unlikely)


def starts_of(explainer: Explainer, change: Change | None, modelled_m: Floats) -> list[Floats]:
    """Clearances (k,) [m] where searches begin: after a change, and from there with each joint wider."""
    widest, first = explainer.model.joints.grid[:, -1], start_of(change, explainer.joints, modelled_m)
    wider = np.minimum(_ELSEWHERE * first, np.maximum(widest, first))
    return [first, *(opened(first, k, size) for k, size in enumerate(wider.tolist()))]


def with_rivals(
    found: ClearanceFit, explanations: Sequence[Explanation], joints: Sequence[str]
) -> ClearanceFit:
    """A fit with the clearances that explain a change as well, alone: which of them it was is not known."""
    best = min((one.misfit for one in explanations), default=0.0)
    apart = np.zeros(len(joints))
    for one in explanations:
        if one.cause is Cause.CLEARANCE and 0.5 * (one.misfit - best) < SURE_LOG_ODDS:
            k = joints.index(one.subject)
            apart[k] = one.value - found.clearance_m[k]
    return attrs.evolve(found, covariance=found.covariance + np.diag(apart**2))


def start_of(change: Change | None, joints: Sequence[str], modelled_m: Floats) -> Floats:
    """Clearances (k,) [m] after a change."""
    if change is None or change.cause not in (Cause.CLEARANCE, Cause.SEVERAL):
        return modelled_m
    for one in change.joints or (change,):
        modelled_m = opened(modelled_m, joints.index(one.subject), one.value)
    return modelled_m

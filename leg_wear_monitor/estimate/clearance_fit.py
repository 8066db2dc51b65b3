"""Changes of a leg: their detection, their first gait cycle, and the clearances that explain them.

One CUSUM test for each quantity and size detects that the leg departs from its wear model. A CUSUM adds up,
gait cycle by gait cycle, by how much a changed leg explains the signature better, and starts again where it
falls below zero. If its likelihoods are right, the mean time between two false alarms of a test is at least
exp(threshold) cycles (Lorden 1971).
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import attrs
import numpy as np

from leg_wear_monitor.estimate.cause import SURE_LOG_ODDS, SURE_SIGMAS, Cause, Change
from leg_wear_monitor.estimate.explanations import MODEL_ERROR, Explainer, Explanation, opened
from leg_wear_monitor.estimate.least_squares import Point, gauss_newton
from leg_wear_monitor.mechanism.arrays import Floats, Ints

# factors on the modelled clearance of one joint; the two factors below 1 test for a new part in a worn joint
FACTORS = (1.08, 1.2, 1.35, 1.5, 2.0, 2.5, 3.3, 5.0, 8.0)

_LEAST_INFORMATION = 1.0e-6  # information per gait cycle below which a test shows nothing
_SIGMAS = 4.0  # possible error of the baseline in standard deviations
# fraction of the threshold that one gait cycle adds at most, so that two alone raise no alarm. One of 260
# healthy cycles on the ground looked like a wider joint: two in a row occur by chance every twenty hours
# (2026-11-25)
_MOST = 0.4


class DetectorState(NamedTuple):
    """Sums (tests,), and the stamp (tests,) [ns] since each was 0; 0 where it is."""

    sums: Floats
    since_ns: Ints


def threshold(false_alarm_cycles: float, tests: int) -> float:
    """Threshold of each of some tests for a mean number of gait cycles between two false alarms."""
    return math.log(false_alarm_cycles * tests)


def excess(scatter: Floats) -> Floats:
    """Factor by which the statistics (n, tests) of some tests scatter more than expected, at least 1.

    The statistics come from gait cycles that the tests do not know, minus their mean, in standard deviations.
    """
    pairs = len(scatter) // 2
    if not pairs:
        return np.ones(scatter.shape[1])
    # means of two cycles, because neighbouring cycles are correlated
    means = scatter[: 2 * pairs].reshape(pairs, 2, -1).mean(axis=1)
    return np.asarray(np.maximum(1.0, 2.0 * np.square(means).mean(axis=0)))


def _scatter(explainer: Explainer, change: Floats) -> Floats:
    """Statistics (n, tests) of each part of the commissioned cycles, by tests that the others make."""
    own, found = explainer.model.covariance, [np.zeros((0, len(change)))]
    for part in explainer.baseline.left_out:
        weighted = np.linalg.solve(explainer.covariance(1) + part.covariance - own, change.T).T
        variance = ((weighted @ part.covariance) * weighted).sum(axis=1) * (1.0 + 1.0 / part.others)
        found.append(part.departures @ weighted.T / np.sqrt(np.maximum(variance, _LEAST_INFORMATION)))
    return np.concatenate(found)


class ChangeDetector:
    """CUSUM tests of a leg against legs with a wider joint, a new part, a changed mass or friction.

    Parameters
    ----------
    explainer : Explainer
    modelled_m : (k,) array
        Modelled clearances.
    false_alarm_cycles : float
        Mean number of gait cycles between two false alarms.
    """

    def __init__(self, explainer: Explainer, modelled_m: Floats, false_alarm_cycles: float) -> None:
        model = explainer.model
        expected = model.at(modelled_m)[0]
        changes: list[Floats] = []
        for k in range(len(modelled_m)):
            fresh = min(explainer.fresh_m[k], modelled_m[k])
            sizes = [factor * modelled_m[k] for factor in FACTORS] + [fresh, math.sqrt(fresh * modelled_m[k])]
            changes += [model.at(opened(modelled_m, k, size))[0] - expected for size in sizes]
        self._of_joints = len(changes)
        changes += [each for one in (model.masses, model.friction) for each in one.change[one.grid != 1.0]]
        # for a leg whose response to a larger clearance is weaker by the model's error
        change = (1.0 - MODEL_ERROR) * np.array(changes)
        weighted = np.linalg.solve(explainer.covariance(1), change.T).T
        self._expected = expected + explainer.baseline.offset
        self._weighted = weighted
        # the baseline is off by the same in each cycle: that alone must not drive a test upwards
        drift = np.sqrt(((weighted @ explainer.baseline.covariance) * weighted).sum(axis=1))
        information = (weighted * change).sum(axis=1)
        # a part that is new already cannot be renewed
        is_possible = information > _LEAST_INFORMATION
        self._half = np.where(is_possible, 0.5 * information + _SIGMAS * drift, np.inf)
        self._excess = excess(_scatter(explainer, change))
        self.threshold = threshold(false_alarm_cycles, len(change))
        self._step, self._modelled_m = (information - self._half) / self._excess, modelled_m

    def unseen_m(self, cycles: int) -> Floats:
        """Widest clearances (k,) [m] that are not expected to be detected within some gait cycles."""
        steps = self._step[: self._of_joints].reshape(len(self._modelled_m), -1)[:, : len(FACTORS)]
        factors = np.where(cycles * steps < self.threshold, FACTORS, 1.0)
        return np.asarray(factors.max(axis=1) * self._modelled_m)

    def fresh(self) -> DetectorState:
        """State before the first gait cycle."""
        tests = len(self._half)
        return DetectorState(np.zeros(tests), np.zeros(tests, np.int64))

    def with_cycle(self, state: DetectorState, signature: Floats, begin_ns: int) -> DetectorState:
        """State after one more gait cycle, with its signature (F,) and the stamp of its begin."""
        ratio = (self._weighted @ (signature - self._expected) - self._half) / self._excess
        ratio = np.minimum(ratio, _MOST * self.threshold)
        since = np.where(state.since_ns == 0, begin_ns, state.since_ns)
        sums = state.sums + ratio
        positive = sums > 0.0
        return DetectorState(np.where(positive, sums, 0.0), np.where(positive, since, 0))

    def detected_ns(self, state: DetectorState) -> int:
        """Stamp since when there is a change; 0 where no test exceeds the threshold."""
        best = int(state.sums.argmax())
        return int(state.since_ns[best]) if state.sums[best] > self.threshold else 0


def first_changed(explainer: Explainer, signatures: Floats, modelled_m: Floats, changed_m: Floats) -> int:
    """Index of the first of some gait cycles, signatures (n, F), that belongs to a change of clearances.

    The index maximises the likelihood of the earlier cycles as modelled and of the later cycles as changed.
    """
    before, after = (explainer.model.at(clearance)[0] for clearance in (modelled_m, changed_m))
    weighted = np.linalg.solve(explainer.covariance(1), after - before)
    middle = 0.5 * (before + after) + explainer.baseline.offset
    gain = (signatures - middle) @ weighted
    return int(np.cumsum(gain[::-1])[::-1].argmax())


# Fit of all clearances to a mean signature, with their covariance.


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

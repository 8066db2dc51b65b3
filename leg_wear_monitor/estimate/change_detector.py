"""Detects when a leg departs from its wear model: one CUSUM test for each quantity and size.

A CUSUM adds up, gait cycle by gait cycle, by how much a changed leg explains the signature better, and
starts again where it falls below zero. If its likelihoods are right, the mean time between two false alarms
of a test is at least exp(threshold) cycles (Lorden 1971).
"""

import math
from typing import NamedTuple

import numpy as np

from leg_wear_monitor.estimate.explanations import MODEL_ERROR, Explainer, opened
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

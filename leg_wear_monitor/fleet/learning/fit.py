"""Fit of the three levels to the measured parts of a material pair.

A measured clearance is normal in the factor x, the levels are normal in ln x. So each part's likelihood is
approximated by a normal one in ln x, at the place that the other parts predict: with it, that prediction
leads to the same mean and variance (expectation propagation). Predictions and likelihoods are repeated until
they agree.
"""

import itertools
import math
from collections import Counter
from collections.abc import Sequence
from statistics import NormalDist

import numpy as np

from leg_wear_monitor.fleet.learning.levels import Evidence, Prediction, predict, variances
from leg_wear_monitor.fleet.learning.part import Part
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.forecast.coefficient_prior import CoefficientPrior
from leg_wear_monitor.monitor.forecast.wear_coefficients import posterior_grid

ASIDE = 4.0
"""Residual beyond which other parts do not learn from a part: one in 16 000 parts if the model is right."""

LEAST = 5
"""Other parts that count, below which no part is set aside: it is not known which of them is wrong."""

MOST_RESIDUAL = 8.0  # beyond it, probabilities are 0 in double precision

_ROUNDS, _SETTLED = 50, 1.0e-4  # the second in standard deviations
_DAMPING = 0.7  # fraction of a change that is made, since all parts change at the same time

_Group = tuple[str, ...]  # a lot; a part of an unknown lot is a group of its own
_NEW: _Group = ("2",)

_NORMAL = np.linspace(-MOST_RESIDUAL, MOST_RESIDUAL, 201)
_DENSITY = np.exp(-0.5 * np.square(_NORMAL))
_DENSITY /= _DENSITY.sum()

_phi = np.frompyfunc(NormalDist().cdf, 1, 1)


class Fit:
    """Predictions of the measured parts, of a further part of each lot, and of a part of a new lot.

    Parameters
    ----------
    measured : sequence of Part
        In an order that depends on the parts only.
    lots : sequence of str
        Known lots.
    sigma : float
        Standard deviation of ln x before anything is learned.

    Attributes
    ----------
    counts : (n,) array of bool
        Whether other parts learn from a measured part.
    mean, spread : arrays
        Predicted mean and standard deviation of ln x: of the measured parts, of a further part of each lot,
        and last of a part of a new lot.
    residuals : (n,) array
        Measured factor of each measured part against its prediction, in standard deviations.
    prediction : Prediction
        Means and spreads in the order of lots, and the standard deviations between them.
    """

    mean: Floats
    spread: Floats
    residuals: Floats
    prediction: Prediction

    def __init__(self, measured: Sequence[Part], lots: Sequence[str], sigma: float) -> None:
        self._measured, self._sigma, self._given = measured, sigma, variances(sigma)
        places = [(_group(part), k) for k, part in enumerate(measured)]
        places += [(("1", lot), len(measured) + j) for j, lot in enumerate(lots)]
        places.append((_NEW, len(measured) + len(lots)))
        groups, numbers = zip(*sorted(places), strict=True)
        self._groups: list[_Group] = [group for group, _ in places]
        self._order = np.array(numbers)
        begins = [one != before for before, one in itertools.pairwise(groups)]
        self._lot = np.cumsum([False, *begins])
        self.counts = np.ones(len(measured), dtype=bool)
        self._counting: Counter[_Group] = Counter()

    def settle(self) -> None:
        """Fit the parts that count, from the beginning."""
        self._counting = Counter(self._groups[k] for k in np.flatnonzero(self.counts).tolist())
        self.mean, self.spread = np.zeros(len(self._groups)), np.full(len(self._groups), self._sigma)
        for _ in range(_ROUNDS):
            self.prediction = predict(self._evidence(), self._given)
            mean, spread = np.empty_like(self.mean), np.empty_like(self.spread)
            mean[self._order], spread[self._order] = self.prediction.mean, self.prediction.sigma
            change = np.maximum(np.abs(mean - self.mean), np.abs(spread - self.spread)) / spread
            if change.max() < _SETTLED:
                break
            self.mean += _DAMPING * (mean - self.mean)
            self.spread += _DAMPING * (spread - self.spread)
        self.residuals = np.array(
            [_residual(part, self.mean[k], self.spread[k]) for k, part in enumerate(self._measured)]
        )

    def _evidence(self) -> Evidence:
        likelihood = np.zeros((2, len(self._groups)))
        for k in np.flatnonzero(self.counts).tolist():
            likelihood[:, k] = _normal_likelihood(self._measured[k], self.mean[k], self.spread[k])
        precision, pull = likelihood[:, self._order]
        return Evidence(precision, pull, self._lot)

    def prior(self, number: int) -> CoefficientPrior:
        """Prior of a measured part, and after these of a further part of each lot, and of a new lot."""
        basis = self._basis(number)
        if not basis:  # nothing else is measured
            return self._measured[number].prior
        return CoefficientPrior(mean=float(self.mean[number]), sigma=float(self.spread[number]), basis=basis)

    def outlier(self) -> int | None:
        """The part that contradicts all others most, if it is to be set aside."""
        sizes = np.where(self.counts, np.abs(self.residuals), 0.0)
        if np.count_nonzero(self.counts) <= LEAST or sizes.max() <= ASIDE:
            return None
        return int(sizes.argmax())

    def _basis(self, number: int) -> str:
        """What was measured for a prior; empty if nothing was."""
        group = self._groups[number]
        is_in = number < len(self.counts) and bool(self.counts[number])
        own = self._counting[group] - is_in
        others = self._counting.total() - self._counting[group]
        texts = [f"{_parts(own)} of lot {group[1]}"] if own else []
        if others:
            texts.append(f"{others} of other lots" if own else f"{_parts(others)} of other lots")
        return " and ".join(texts)


def _residual(part: Part, mean: float, sigma: float) -> float:
    """Measured factor of a part in standard deviations of what is predicted, by its tail probability."""
    predicted = np.exp(mean + sigma * _NORMAL)
    z = (part.factor - predicted) * math.sqrt(part.precision)
    # the smaller tail, since the other one is 1 to all digits
    below, above = (float(_DENSITY @ np.asarray(_phi(tail), dtype=float)) for tail in (z, -z))
    size = -NormalDist().inv_cdf(max(min(below, above, 0.5), NormalDist().cdf(-MOST_RESIDUAL)))
    return size if above < below else -size


def _parts(count: int) -> str:
    return f"{count} part" if count == 1 else f"{count} parts"


def _group(part: Part) -> _Group:
    if part.lot:
        return "1", part.lot
    return "0", part.leg, part.joint, str(part.replaced_ns)


def _normal_likelihood(part: Part, mean: float, sigma: float) -> tuple[float, float]:
    """Precision and pull of the normal likelihood of ln x that takes a prior to the same moments."""
    grid, log_weight = posterior_grid(CoefficientPrior(mean=mean, sigma=sigma), part.factor, part.precision)
    weight = np.exp(log_weight - log_weight.max())
    weight /= weight.sum()
    after = float(weight @ grid)
    variance = float(weight @ np.square(grid - after))
    # a factor far below a prior moves and widens it: then the mean alone is kept
    variance = min(variance, sigma**2)
    return 1.0 / variance - 1.0 / sigma**2, after / variance - mean / sigma**2

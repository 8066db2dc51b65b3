"""Three levels of wear coefficients: ln x = pair + lot + part, normal on each level.

x is a part's factor on its nominal wear coefficient. The three levels share the variance of the pair's prior.
Half of it is the pair's, since a published coefficient holds for the tests of another laboratory; a quarter
each is expected between lots and between the parts of a lot. These fractions are a judgement. The variances
between lots and parts are not known: their standard deviations have lognormal priors, a factor of 1.65 up and
down, on a grid. Given the variances, all is normal and in closed form.
"""

import math

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats, Ints

PAIR, LOT, PART = 0.5, 0.25, 0.25
"""Expected fractions of the variance."""

_LOG_SIGMA = 0.5  # of the standard deviations between lots and between parts
_STEP = 0.15  # between nodes: a standard deviation is at most 8 % beside one
_NODES = np.arange(-10, 11) * _STEP
_CHUNK = 256  # parts at a time, to bound the memory


@attrs.frozen(eq=False)
class Evidence:
    """Likelihoods exp(-precision u² / 2 + pull u) of n parts' u = ln x, sorted by lot.

    Attributes
    ----------
    precision : (n,) array
        Inverse variance of ln x.
    pull : (n,) array
        Precision times mean. A part that is not measured has neither.
    lot : (n,) array of int
        Number of each part's lot, rising from 0 without gaps.
    """

    precision: Floats
    pull: Floats
    lot: Ints


@attrs.frozen(eq=False)
class Prediction:
    """Predicted ln x of each of n parts, from all parts but itself.

    Attributes
    ----------
    mean, sigma : (n,) array
    lot_sigma, part_sigma : float
        Standard deviations between lots, and between the parts of a lot, from all parts.
    """

    mean: Floats
    sigma: Floats
    lot_sigma: float
    part_sigma: float


@attrs.frozen(eq=False)
class Variances:
    """Variances that are possible: of the pair, and nodes of a grid for lots (l,) and parts (p,).

    Attributes
    ----------
    pair : float
    lot, part : (l,) array, (p,) array
    log_prior : (l, p) array
    """

    pair: float
    lot: Floats
    part: Floats
    log_prior: Floats


def variances(sigma: float) -> Variances:
    """Prior of the variances, whose expected sum is the variance before anything is learned.

    Parameters
    ----------
    sigma : float
        Standard deviation of ln x before anything is learned.
    """
    log_prior = -0.5 * np.square(_NODES / _LOG_SIGMA)
    weight = np.exp(log_prior)
    ratio = np.exp(2.0 * _NODES)
    ratio *= weight.sum() / float(weight @ ratio)  # to a mean of 1
    square = sigma**2
    return Variances(
        PAIR * square, LOT * square * ratio, PART * square * ratio, log_prior[:, None] + log_prior
    )


@attrs.frozen(eq=False)
class _Sums:
    """Normal distributions in closed form for all variances of the grid, as precision and pull.

    Attributes
    ----------
    own, own_pull : (p, n) array
        Of each part for the level of its lot.
    of_lot, of_lot_pull : (p, lots) array
        Of all parts of a lot for its level.
    of_pair, of_pair_pull : (l, p, lots) array
        Of each lot for the level of the pair.
    total, total_pull : (l, p, 1) array
        Of all lots and the prior for the level of the pair.
    log_weight : (l, p) array
        Posterior of the variances.
    """

    own: Floats
    own_pull: Floats
    of_lot: Floats
    of_lot_pull: Floats
    of_pair: Floats
    of_pair_pull: Floats
    total: Floats
    total_pull: Floats
    log_weight: Floats


def predict(evidence: Evidence, given: Variances) -> Prediction:
    """Prediction of each part from all other parts; a part without precision is predicted from all."""
    sums = _sums(evidence, given)
    count = len(evidence.lot)
    chunks = [
        _left_out(evidence, given, sums, slice(first, min(first + _CHUNK, count)))
        for first in range(0, count, _CHUNK)
    ]
    mean, sigma = (np.concatenate(parts) for parts in zip(*chunks, strict=True))
    weight = _normalized(sums.log_weight)
    return Prediction(
        mean,
        sigma,
        math.sqrt(float(weight.sum(axis=1) @ given.lot)),
        math.sqrt(float(weight.sum(axis=0) @ given.part)),
    )


def _sums(evidence: Evidence, given: Variances) -> _Sums:
    starts = np.flatnonzero(np.diff(evidence.lot, prepend=-1))
    shrink = 1.0 / (1.0 + given.part[:, None] * evidence.precision)
    own, own_pull = evidence.precision * shrink, evidence.pull * shrink
    of_lot, of_lot_pull = (np.add.reduceat(each, starts, axis=1) for each in (own, own_pull))
    shrink_lot = 1.0 / (1.0 + given.lot[:, None, None] * of_lot)
    of_pair, of_pair_pull = of_lot * shrink_lot, of_lot_pull * shrink_lot
    total = 1.0 / given.pair + of_pair.sum(axis=2, keepdims=True)
    total_pull = of_pair_pull.sum(axis=2, keepdims=True)
    # the likelihood, integrated over parts, lots and the pair in turn
    square = given.part * (own_pull * evidence.pull).sum(axis=1)
    square = square + given.lot[:, None] * (of_lot_pull * of_pair_pull).sum(axis=2)
    square += np.square(total_pull[:, :, 0]) / total[:, :, 0]
    log_scale = np.log(shrink).sum(axis=1) + np.log(shrink_lot).sum(axis=2)
    log_scale -= np.log(given.pair * total[:, :, 0])
    log_weight = given.log_prior + 0.5 * (log_scale + square)
    return _Sums(own, own_pull, of_lot, of_lot_pull, of_pair, of_pair_pull, total, total_pull, log_weight)


def _left_out(evidence: Evidence, given: Variances, sums: _Sums, parts: slice) -> tuple[Floats, Floats]:
    """Mean and standard deviation (c,) of parts, each from all others; arrays in between are (l, p, c)."""
    lot, precision, pull = evidence.lot[parts], evidence.precision[parts], evidence.pull[parts]
    others = np.maximum(sums.of_lot[:, lot] - sums.own[:, parts], 0.0)
    others_pull = sums.of_lot_pull[:, lot] - sums.own_pull[:, parts]
    # the lot's level: from the other lots, then from the other parts of this one
    pair = sums.total - sums.of_pair[:, :, lot]
    before = 1.0 / (1.0 / pair + given.lot[:, None, None])
    level = before + others
    mean = (before * (sums.total_pull - sums.of_pair_pull[:, :, lot]) / pair + others_pull) / level
    variance = 1.0 / level + given.part[:, None]
    # this part's own likelihood is taken out of the posterior of the variances
    scale = 1.0 + precision * variance
    square = (variance * np.square(pull) + mean * (2.0 * pull - precision * mean)) / scale
    weight = _normalized(sums.log_weight[:, :, None] + 0.5 * (np.log(scale) - square))
    centre = (weight * mean).sum(axis=(0, 1))
    spread = (weight * (variance + np.square(mean - centre))).sum(axis=(0, 1))
    return centre, np.sqrt(spread)


def _normalized(log_weight: Floats) -> Floats:
    """Weights whose sum over the grid, the first two axes, is 1."""
    weight = np.exp(log_weight - log_weight.max(axis=(0, 1), keepdims=True))
    return np.asarray(weight / weight.sum(axis=(0, 1), keepdims=True))

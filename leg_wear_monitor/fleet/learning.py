"""Wear coefficients of a fleet: three levels, ln x = pair + lot + part, fitted to measured clearances."""

import itertools
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from statistics import NormalDist

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats, Ints
from leg_wear_monitor.mechanism.spec import Clearance, Mechanism
from leg_wear_monitor.monitor.config.sections import Forecasting
from leg_wear_monitor.monitor.forecast.measurement import observations_of
from leg_wear_monitor.monitor.forecast.wear_coefficients import (
    CoefficientPrior,
    corrections_of,
    measured_factor,
    nominal_per_pa,
    posterior_grid,
    usual_prior,
)
from leg_wear_monitor.monitor.ledger.entry import CorrectedClearance, Measurement

# Three levels of wear coefficients: ln x = pair + lot + part, normal on each level.
#
# x is a part's factor on its nominal wear coefficient. The three levels share the variance of the pair's
# prior. Half of it is the pair's, since a published coefficient holds for the tests of another laboratory; a
# quarter each is expected between lots and between the parts of a lot. These fractions are a judgement. The
# variances between lots and parts are not known: their standard deviations have lognormal priors, a factor of
# 1.65 up and down, on a grid. Given the variances, all is normal and in closed form.


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


# Parts of the legs of a fleet, with what their measured clearances say about their wear coefficients.


@attrs.frozen(kw_only=True)
class Part:
    """A part of a leg: journal and bushing of a joint, until they are replaced.

    Attributes
    ----------
    leg, joint : str
    replaced_ns : int
        When it was mounted, 0 for the first part.
    is_present : bool
        Whether it is in the leg now.
    pair : str
        Material pair and nominal wear coefficients.
    lot : str
        Empty if it is not known.
    nominal_per_pa : float
        Nominal wear coefficient of bushing and journal together.
    prior : CoefficientPrior
        That of its material pair, before anything is learned.
    factor, precision : float
        Factor on the nominal coefficient by the measured clearances, and the inverse of its variance; a
        precision of 0 means that nothing is measured.
    """

    leg: str
    joint: str
    replaced_ns: int = 0
    is_present: bool = True
    pair: str
    lot: str = ""
    nominal_per_pa: float
    prior: CoefficientPrior
    factor: float = 0.0
    precision: float = 0.0

    @property
    def key(self) -> tuple[str, str, int]:
        """Leg, joint and time of mounting, which name a part."""
        return self.leg, self.joint, self.replaced_ns


def parts_of(
    leg: str,
    mechanism: Mechanism,
    settings: Forecasting,
    measurements: Sequence[Measurement],
    replaced_ns: Mapping[str, int],
    *,
    lot: str = "",
    lots: Mapping[str, str] | None = None,
    corrections: Sequence[CorrectedClearance] = (),
) -> list[Part]:
    """All parts that a leg has, and those it had that were measured.

    Parameters
    ----------
    leg : str
        Its name in the fleet.
    mechanism : Mechanism
        As the configuration wants it.
    settings : Forecasting
    measurements : sequence of Measurement
        Of its ledger.
    replaced_ns : mapping of str to int
        When the present part of each joint was mounted; 0 for the first part, and for an absent joint.
    lot : str, optional
        Lot of the parts that the leg was built with.
    lots : mapping of str to str, optional
        Lots of the present parts of single joints; a replaced part has no other known lot.
    corrections : sequence of CorrectedClearance
        Of its ledger.
    """
    parts = []
    for joint in mechanism.clearance_joints:
        clearance, present = mechanism.clearances[joint], replaced_ns.get(joint, 0)
        mounted = {m.replaced_ns for m in measurements if m.joint == joint} | {present}
        for when in sorted(mounted):
            observations = observations_of(measurements, joint, when)
            corrected = corrections_of(corrections, joint, when)
            factor, precision = measured_factor(settings, clearance.radial_clearance, observations, corrected)
            own = (lots or {}).get(joint, "") if when == present else ""
            parts.append(
                Part(
                    leg=leg,
                    joint=joint,
                    replaced_ns=when,
                    is_present=when == present,
                    pair=pair_of(clearance),
                    lot=own or (lot if when == 0 else ""),
                    nominal_per_pa=nominal_per_pa(clearance),
                    prior=usual_prior(settings, clearance),
                    factor=factor,
                    precision=precision,
                )
            )
    return [part for part in parts if part.nominal_per_pa > 0.0]


def pair_of(clearance: Clearance) -> str:
    """Name of a material pair: parts with the same name have the same nominal wear coefficients."""
    bushing, journal = clearance.wear_coefficient
    return f"{clearance.material or 'no material'}, {bushing:.6g} and {journal:.6g} 1/Pa"


# Fit of the three levels to the measured parts of a material pair.
#
# A measured clearance is normal in the factor x, the levels are normal in ln x. So each part's likelihood is
# approximated by a normal one in ln x, at the place that the other parts predict: with it, that prediction
# leads to the same mean and variance (expectation propagation). Predictions and likelihoods are repeated
# until they agree.


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


# Learn the wear coefficients of a fleet: priors of parts from the measured clearances of all other parts.


@attrs.frozen(kw_only=True)
class LearnedPart:
    """A measured part.

    Attributes
    ----------
    part : Part
    prior : CoefficientPrior
        From all other parts that count.
    residual : float
        Measured factor against this prior, in standard deviations, at most 8; positive if it wears faster.
    counts : bool
        Whether other parts learn from it.
    """

    part: Part
    prior: CoefficientPrior
    residual: float
    counts: bool

    @property
    def finding(self) -> str:
        """What an operator has to look at; empty if it fits."""
        if abs(self.residual) <= ASIDE:
            return ""
        doubt = "it counts, too few others are measured" if self.counts else "others do not learn from it"
        than = "faster" if self.residual > 0.0 else "slower"
        return (
            f"{self.part.leg}: joint {self.part.joint} wears {than} than {self.prior.basis} predict, by "
            f"{abs(self.residual):.1f} standard deviations; {doubt}; measure it again, and check its lot"
        )


@attrs.frozen(kw_only=True)
class LearnedPair:
    """What the parts of a material pair say together.

    Attributes
    ----------
    pair : str
    prior_sigma : float
        Standard deviation of ln x before anything is learned; the largest one if legs differ.
    lot_sigma, part_sigma : float
        Standard deviations of ln x between lots, and between the parts of a lot.
    measured : tuple of LearnedPart
    lots : mapping of str to CoefficientPrior
        For a part of each known lot that is not measured.
    new_lot : CoefficientPrior
        For a part of a new lot, or of an unknown one.
    """

    pair: str
    prior_sigma: float
    lot_sigma: float
    part_sigma: float
    measured: tuple[LearnedPart, ...]
    lots: Mapping[str, CoefficientPrior]
    new_lot: CoefficientPrior


def learn(parts: Sequence[Part]) -> dict[str, LearnedPair]:
    """Learn from the parts of a fleet, in any order.

    Parameters
    ----------
    parts : sequence of Part
        All of them, measured or not.

    Returns
    -------
    dict of str to LearnedPair
        By material pair, for those with a measured part. Parts of other pairs keep their configured prior.
    """
    measured = sorted(
        (part for part in parts if part.precision > 0.0), key=lambda part: (part.pair, *part.key)
    )
    by_pair = {pair: list(own) for pair, own in itertools.groupby(measured, key=lambda part: part.pair)}
    return {
        pair: _learned(pair, own, sorted({part.lot for part in parts if part.pair == pair and part.lot}))
        for pair, own in by_pair.items()
    }


def _learned(pair: str, measured: Sequence[Part], lots: Sequence[str]) -> LearnedPair:
    sigma = max(part.prior.sigma for part in measured)
    fit = Fit(measured, lots, sigma)
    fit.settle()
    while (outlier := fit.outlier()) is not None:
        fit.counts[outlier] = False
        fit.settle()
    return LearnedPair(
        pair=pair,
        prior_sigma=sigma,
        lot_sigma=fit.prediction.lot_sigma,
        part_sigma=fit.prediction.part_sigma,
        measured=tuple(
            LearnedPart(
                part=part, prior=fit.prior(k), residual=float(fit.residuals[k]), counts=bool(fit.counts[k])
            )
            for k, part in enumerate(measured)
        ),
        lots={lot: fit.prior(len(measured) + j) for j, lot in enumerate(lots)},
        new_lot=fit.prior(len(measured) + len(lots)),
    )

"""Wear coefficients of a fleet: priors of parts, learned from the measured clearances of all other parts.

The model has three levels: a material pair, the lots of its parts, and the parts of a lot. The file goes from
the inside to the outside: the model with normal likelihoods, the parts of a leg, the fit to measured parts,
and `learn`.
"""

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
from leg_wear_monitor.monitor.ledger.entry import Measurement, Recount

# The model with normal likelihoods: ln x = pair + lot + part, each of them normal.
#
# x is a part's factor on its nominal wear coefficient. The three levels share the variance of the pair's
# prior. Half of it is the pair's, since a published coefficient holds for the tests of another laboratory; a
# quarter each is expected between lots and between the parts of a lot. These fractions are a judgement. The
# variances between lots and parts are not known: their standard deviations have lognormal priors, a factor of
# 1.65 up and down, on a grid. Given the variances, all is normal and in closed form.
# Normal distributions are kept as precision (inverse variance) and pull (precision times mean), which add up.


PAIR_FRACTION, LOT_FRACTION, PART_FRACTION = 0.5, 0.25, 0.25
"""Expected fractions of the prior variance of ln x, on each level."""

_LOG_SIGMA = 0.5  # of the logarithm of the standard deviations between lots and between parts
_NODE_STEP = 0.15  # between nodes of the grid: a standard deviation is within 8 % of a node
_NODES = np.arange(-10, 11) * _NODE_STEP
_PARTS_PER_CHUNK = 256  # parts at a time, to bound the memory


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
    """Possible variances of ln x: of the pair, known, and between lots (l,) and parts (p,), on a grid.

    Attributes
    ----------
    pair : float
    lot, part : (l,) array, (p,) array
    log_prior : (l, p) array
        Logarithm of the prior density at the nodes.
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
        PAIR_FRACTION * square,
        LOT_FRACTION * square * ratio,
        PART_FRACTION * square * ratio,
        log_prior[:, None] + log_prior,
    )


@attrs.frozen(eq=False)
class _Levels:
    """Evidence passed from level to level, for all variances of the grid, as precision and pull.

    Attributes
    ----------
    own, own_pull : (p, n) array
        From each part to the value of its lot.
    of_lot, of_lot_pull : (p, lots) array
        From all parts of a lot to its value.
    of_pair, of_pair_pull : (l, p, lots) array
        From each lot to the value of the pair.
    total, total_pull : (l, p, 1) array
        From all lots and the prior to the value of the pair.
    log_weight : (l, p) array
        Logarithm of the posterior of the variances.
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
    sums = _summed_levels(evidence, given)
    count = len(evidence.lot)
    chunks = [
        _leave_one_out(evidence, given, sums, slice(first, min(first + _PARTS_PER_CHUNK, count)))
        for first in range(0, count, _PARTS_PER_CHUNK)
    ]
    mean, sigma = (np.concatenate(parts) for parts in zip(*chunks, strict=True))
    weight = _normalized(sums.log_weight)
    return Prediction(
        mean,
        sigma,
        math.sqrt(float(weight.sum(axis=1) @ given.lot)),
        math.sqrt(float(weight.sum(axis=0) @ given.part)),
    )


def _summed_levels(evidence: Evidence, given: Variances) -> _Levels:
    """Pass the evidence from the parts to the lots and to the pair."""
    starts = np.flatnonzero(np.diff(evidence.lot, prepend=-1))
    # a part's evidence of its lot has the variance between parts added
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
    return _Levels(own, own_pull, of_lot, of_lot_pull, of_pair, of_pair_pull, total, total_pull, log_weight)


def _leave_one_out(
    evidence: Evidence, given: Variances, sums: _Levels, parts: slice
) -> tuple[Floats, Floats]:
    """Mean and standard deviation (c,) of parts, each from all others; arrays in between are (l, p, c)."""
    lot, precision, pull = evidence.lot[parts], evidence.precision[parts], evidence.pull[parts]
    others = np.maximum(sums.of_lot[:, lot] - sums.own[:, parts], 0.0)
    others_pull = sums.of_lot_pull[:, lot] - sums.own_pull[:, parts]
    # value of the lot: from the other lots, then from the other parts of this one
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


# The parts of a leg, each with the factor on its wear coefficient that its measured clearances show.


@attrs.frozen(kw_only=True)
class Part:
    """A part of a leg: journal and bushing of a joint, until they are replaced.

    Attributes
    ----------
    leg, joint : str
    replaced_ns : int
        When it was mounted [ns], 0 for the first part.
    is_present : bool
        Whether it is in the leg now.
    pair : str
        Material pair and nominal wear coefficients.
    lot : str
        Empty if unknown.
    nominal_per_pa : float
        Nominal wear coefficient of bushing and journal together.
    prior : CoefficientPrior
        Prior of its material pair, before anything is learned.
    factor, precision : float
        Measured factor on the nominal coefficient, and the inverse of its variance; a precision of 0 means
        that nothing is measured.
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
        """Leg, joint and time of mounting, which identify a part."""
        return self.leg, self.joint, self.replaced_ns


def parts_of(
    leg: str,
    mechanism: Mechanism,
    settings: Forecasting,
    measurements: Sequence[Measurement],
    replaced_ns: Mapping[str, int],
    *,
    lot: str = "",
    corrections: Sequence[Recount] = (),
) -> list[Part]:
    """All present parts of a leg, and its former parts that were measured.

    Parameters
    ----------
    leg : str
        Its name in the fleet.
    mechanism : Mechanism
        With the parameters of the leg's configuration applied.
    settings : Forecasting
    measurements : sequence of Measurement
        Of its ledger.
    replaced_ns : mapping of str to int
        When the present part of each joint was mounted; 0 for the first part, and for an absent joint.
    lot : str, optional
        Lot of the parts that the leg was built with; a replaced part has no known lot.
    corrections : sequence of CorrectedClearance and CoefficientSpan
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
            parts.append(
                Part(
                    leg=leg,
                    joint=joint,
                    replaced_ns=when,
                    is_present=when == present,
                    pair=pair_of(clearance),
                    lot=lot if when == 0 else "",
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


# The fit of the model to the measured parts of a material pair, by expectation propagation.
#
# A measured clearance is normal in the factor x, but the levels are normal in ln x. So each part's likelihood
# is replaced by a normal one in ln x, chosen so that the prediction from the other parts, updated with it,
# has the same mean and variance as with the true one. Predictions and likelihoods are computed in turn until
# they agree.


_MOST_TRUSTED_RESIDUAL = 4.0
"""Residual above which other parts do not learn from a part: one in 16 000 parts if the model is right."""

_LEAST_OTHERS = 5
"""With fewer other parts, none is set aside, because it is unclear which of them is wrong."""

_LARGEST_RESIDUAL = 8.0  # beyond it, probabilities are 0 in double precision

_ITERATIONS, _CONVERGED = 50, 1.0e-4  # at most; largest change, in standard deviations
_DAMPING = 0.7  # fraction of each change that is applied, since all parts change at once

# A group is a lot; a part of an unknown lot is a group of its own. The first string is its kind, by which
# groups are sorted: "0" part of an unknown lot, "1" known lot, "2" new lot.
_Group = tuple[str, ...]
_NEW_LOT: _Group = ("2",)

# nodes and weights of a standard normal distribution, for integrals over a prediction
_STANDARD_NODES = np.linspace(-_LARGEST_RESIDUAL, _LARGEST_RESIDUAL, 201)
_STANDARD_WEIGHTS = np.exp(-0.5 * np.square(_STANDARD_NODES))
_STANDARD_WEIGHTS /= _STANDARD_WEIGHTS.sum()

_normal_cdf = np.frompyfunc(NormalDist().cdf, 1, 1)


class Fit:
    """Predictions for the measured parts, for a further part of each lot, and for a part of a new lot.

    Parameters
    ----------
    measured : sequence of Part
        In an order that depends on the parts only, so that results do not depend on that of the fleet.
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
        self._measured, self._sigma, self._variances = measured, sigma, variances(sigma)
        # The model needs the parts sorted by lot: `_groups` is in the order of the attributes, `_sorted` are
        # the numbers in the order of lots.
        places = [(_group(part), k) for k, part in enumerate(measured)]
        places += [(("1", lot), len(measured) + j) for j, lot in enumerate(lots)]
        places.append((_NEW_LOT, len(measured) + len(lots)))
        groups, numbers = zip(*sorted(places), strict=True)
        self._groups: list[_Group] = [group for group, _ in places]
        self._sorted = np.array(numbers)
        begins = [one != before for before, one in itertools.pairwise(groups)]
        self._lot = np.cumsum([False, *begins])
        self.counts = np.ones(len(measured), dtype=bool)
        self._counts_by_group: Counter[_Group] = Counter()

    def iterate(self) -> None:
        """Fit the parts that count, starting from the prior."""
        self._counts_by_group = Counter(self._groups[k] for k in np.flatnonzero(self.counts).tolist())
        self.mean, self.spread = np.zeros(len(self._groups)), np.full(len(self._groups), self._sigma)
        for _ in range(_ITERATIONS):
            self.prediction = predict(self._evidence(), self._variances)
            mean, spread = np.empty_like(self.mean), np.empty_like(self.spread)
            mean[self._sorted], spread[self._sorted] = self.prediction.mean, self.prediction.sigma
            change = np.maximum(np.abs(mean - self.mean), np.abs(spread - self.spread)) / spread
            if change.max() < _CONVERGED:
                break
            self.mean += _DAMPING * (mean - self.mean)
            self.spread += _DAMPING * (spread - self.spread)
        self.residuals = np.array(
            [_residual(part, self.mean[k], self.spread[k]) for k, part in enumerate(self._measured)]
        )

    def _evidence(self) -> Evidence:
        """Normal likelihoods at the present predictions, sorted by lot."""
        likelihood = np.zeros((2, len(self._groups)))
        for k in np.flatnonzero(self.counts).tolist():
            likelihood[:, k] = _normal_likelihood(self._measured[k], self.mean[k], self.spread[k])
        precision, pull = likelihood[:, self._sorted]
        return Evidence(precision, pull, self._lot)

    def prior(self, number: int) -> CoefficientPrior:
        """Learned prior of a part, numbered as `mean`."""
        basis = self._basis(number)
        if not basis:  # nothing else is measured
            return self._measured[number].prior
        return CoefficientPrior(mean=float(self.mean[number]), sigma=float(self.spread[number]), basis=basis)

    def outlier(self) -> int | None:
        """Number of the part with the largest residual, if it is to be set aside."""
        sizes = np.where(self.counts, np.abs(self.residuals), 0.0)
        if np.count_nonzero(self.counts) <= _LEAST_OTHERS or sizes.max() <= _MOST_TRUSTED_RESIDUAL:
            return None
        return int(sizes.argmax())

    def _basis(self, number: int) -> str:
        """Text on the measured parts that a prior is learned from; empty without any."""
        group = self._groups[number]
        is_in = number < len(self.counts) and bool(self.counts[number])
        own = self._counts_by_group[group] - is_in
        others = self._counts_by_group.total() - self._counts_by_group[group]
        texts = [f"{_part_count(own)} of lot {group[1]}"] if own else []
        if others:
            texts.append(f"{others} of other lots" if own else f"{_part_count(others)} of other lots")
        return " and ".join(texts)


def _residual(part: Part, mean: float, sigma: float) -> float:
    """Deviation of a measured factor from its prediction [standard deviations], from its tail probability."""
    predicted = np.exp(mean + sigma * _STANDARD_NODES)
    z = (part.factor - predicted) * math.sqrt(part.precision)
    # the smaller tail, since the other one is 1 to all digits
    below, above = (float(_STANDARD_WEIGHTS @ np.asarray(_normal_cdf(tail), dtype=float)) for tail in (z, -z))
    size = -NormalDist().inv_cdf(max(min(below, above, 0.5), NormalDist().cdf(-_LARGEST_RESIDUAL)))
    return size if above < below else -size


def _part_count(count: int) -> str:
    return f"{count} part" if count == 1 else f"{count} parts"


def _group(part: Part) -> _Group:
    if part.lot:
        return "1", part.lot
    return "0", part.leg, part.joint, str(part.replaced_ns)


def _normal_likelihood(part: Part, mean: float, sigma: float) -> tuple[float, float]:
    """Precision and pull of the normal likelihood of ln x that leads to the same posterior moments."""
    grid, log_weight = posterior_grid(CoefficientPrior(mean=mean, sigma=sigma), part.factor, part.precision)
    weight = np.exp(log_weight - log_weight.max())
    weight /= weight.sum()
    after = float(weight @ grid)
    variance = float(weight @ np.square(grid - after))
    # a factor far below the prior would widen it, and no likelihood does that: only the mean is matched then
    variance = min(variance, sigma**2)
    return 1.0 / variance - 1.0 / sigma**2, after / variance - mean / sigma**2


# The result for a fleet: what the parts of each material pair show, and parts that contradict the others.


@attrs.frozen(kw_only=True)
class LearnedPart:
    """A measured part, its prior from the other parts, and how well it fits.

    Attributes
    ----------
    part : Part
    prior : CoefficientPrior
        Learned from all other parts that count.
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
        """Text for operators if the part contradicts the others; empty otherwise."""
        if abs(self.residual) <= _MOST_TRUSTED_RESIDUAL:
            return ""
        doubt = "it counts, too few others are measured" if self.counts else "others do not learn from it"
        than = "faster" if self.residual > 0.0 else "slower"
        return (
            f"joint {self.part.joint} wears {than} than {self.prior.basis} predict, by "
            f"{abs(self.residual):.1f} standard deviations; {doubt}; measure it again, and check its lot"
        )


@attrs.frozen(kw_only=True)
class LearnedPair:
    """What the parts of a material pair show together.

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
    """Fit the parts of a pair, and set aside the worst outlier until none is left."""
    sigma = max(part.prior.sigma for part in measured)
    fit = Fit(measured, lots, sigma)
    fit.iterate()
    while (outlier := fit.outlier()) is not None:
        fit.counts[outlier] = False
        fit.iterate()
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

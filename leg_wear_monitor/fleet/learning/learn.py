"""Learn the wear coefficients of a fleet: priors of parts from the measured clearances of all other parts."""

import itertools
from collections.abc import Mapping, Sequence

import attrs

from leg_wear_monitor.fleet.learning.fit import ASIDE, Fit
from leg_wear_monitor.fleet.learning.part import Part
from leg_wear_monitor.monitor.forecast.coefficient_prior import CoefficientPrior


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

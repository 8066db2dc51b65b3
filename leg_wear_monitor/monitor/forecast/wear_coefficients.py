"""Estimate of a joint's wear coefficient, and its Bayes update with measured clearances.

The clearance is c = c_0 + d + x w: c_0 the nominal one when new, d the deviation of the part, w the wear that
the twin has counted with the nominal coefficient, x the joint's factor on it. The priors are lognormal for
x and normal for d; measured clearances have normal errors. d is eliminated in closed form, x is on a grid
around the estimate: an accepted measurement moves it as far as the data require.

Where the counted clearance was corrected by what the drive torque shows, c_0, d and w begin anew with that
clearance, its error and the wear since; x remains.
"""

import math
from collections.abc import Sequence
from statistics import NormalDist

import attrs
import numpy as np
from numpy.typing import ArrayLike

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.config.forecast import Forecasting
from leg_wear_monitor.monitor.forecast.coefficient_prior import CoefficientPrior, usual_prior
from leg_wear_monitor.monitor.forecast.known_clearance import KnownClearance, known_clearances
from leg_wear_monitor.monitor.ledger.entry import CorrectedClearance

GRID = 801
_WIDTH = 8.0  # standard deviations on both sides, of the prior and of the measurements
_DEEP = 25.0  # below the highest, of log density: what is left out weighs less than 1e-9
_ZOOMS = 12  # each at least halves the grid's extent

_phi = np.frompyfunc(NormalDist().cdf, 1, 1)


@attrs.frozen
class MeasuredClearance:
    """A measured clearance.

    Attributes
    ----------
    clearance_m, sigma_m : float
        Mean radial clearance and its standard deviation.
    wear_m : float
        Wear in the twin then.
    """

    clearance_m: float
    sigma_m: float
    wear_m: float


@attrs.frozen(eq=False)
class CoefficientEstimate:
    """Estimate for a joint: weights over its factor's logarithm, and its excess given the factor.

    Attributes
    ----------
    log_factor, weight : (g,) arrays
        Weights sum to 1.
    excess_m : (g,) array
        Mean of d given the factor.
    excess_sigma_m : float
        Its standard deviation.
    observations : int
        Measurements in it.
    prior : CoefficientPrior
        What was believed before them.
    known : KnownClearance
        The one from which on wear is counted now; d is the deviation from it.
    """

    log_factor: Floats
    weight: Floats
    excess_m: Floats
    excess_sigma_m: float
    observations: int
    prior: CoefficientPrior
    known: KnownClearance

    @property
    def mean(self) -> float:
        """Mean of the factor's logarithm."""
        return float(self.weight @ self.log_factor)

    @property
    def sigma(self) -> float:
        """Standard deviation of the factor's logarithm."""
        return math.sqrt(float(self.weight @ np.square(self.log_factor - self.mean)))

    def log_factors(self, fractions: ArrayLike) -> Floats:
        """Quantiles of the factor's logarithm at fractions in (0, 1)."""
        reached = np.cumsum(self.weight) - 0.5 * self.weight
        return np.asarray(np.interp(np.asarray(fractions), reached, self.log_factor))

    def probability_below(self, observation: MeasuredClearance) -> float:
        """Predicted probability that a measurement of this accuracy, now, is smaller than this one."""
        worn = observation.wear_m - self.known.wear_m
        expected = self.known.clearance_m + self.excess_m + np.exp(self.log_factor) * worn
        spread = math.hypot(observation.sigma_m, self.excess_sigma_m)
        below = np.asarray(_phi((observation.clearance_m - expected) / spread), dtype=float)
        return float(self.weight @ below)


def estimate_coefficient(
    settings: Forecasting,
    fresh_m: float,
    observations: Sequence[MeasuredClearance] = (),
    prior: CoefficientPrior | None = None,
    corrections: Sequence[CorrectedClearance] = (),
) -> CoefficientEstimate:
    """Coefficient estimate after measurements of the same part, in any order.

    Parameters
    ----------
    settings : Forecasting
    fresh_m : float
        Nominal clearance when new.
    observations : sequence of MeasuredClearance
    prior : CoefficientPrior, optional
        Without it, the configured or usual spread about the nominal coefficient.
    corrections : sequence of CorrectedClearance
        Of its counted clearance, in the order of time.
    """
    prior = prior or usual_prior(settings)
    factor = measured_factor(settings, fresh_m, observations, corrections)
    log_factor, log_weight = posterior_grid(prior, *factor)
    weight = np.exp(log_weight - log_weight.max())
    known, own = _spans(settings, fresh_m, observations, corrections)[-1]
    precision = 1.0 / known.sigma_m**2 + sum(observation.sigma_m**-2 for observation in own)
    pull = np.zeros(GRID)
    for observation in own:
        opened, worn = observation.clearance_m - known.clearance_m, observation.wear_m - known.wear_m
        pull += (opened - np.exp(log_factor) * worn) / observation.sigma_m**2
    return CoefficientEstimate(
        log_factor,
        weight / weight.sum(),
        pull / precision,
        precision**-0.5,
        len(observations),
        prior,
        known,
    )


def measured_factor(
    settings: Forecasting,
    fresh_m: float,
    observations: Sequence[MeasuredClearance],
    corrections: Sequence[CorrectedClearance] = (),
) -> tuple[float, float]:
    """Mean and precision of the factor from the measurements alone; 0 if they have no information.

    The likelihood is normal in the factor, not in its logarithm. The clearance from which on wear is counted
    is eliminated: it correlates the errors of the measurements after it.
    """
    spans = [_factor_since(*span) for span in _spans(settings, fresh_m, observations, corrections)]
    product, precision = (sum(each) for each in zip(*spans, strict=True))
    return (product / precision, precision) if precision else (0.0, 0.0)


def _spans(
    settings: Forecasting,
    fresh_m: float,
    observations: Sequence[MeasuredClearance],
    corrections: Sequence[CorrectedClearance],
) -> list[tuple[KnownClearance, list[MeasuredClearance]]]:
    """Known clearances, each with the measurements between it and the next one."""
    known = known_clearances(settings, fresh_m, corrections)
    ends = [*(each.from_m for each in known[1:]), math.inf]
    return [
        (each, [one for one in observations if each.from_m <= one.wear_m < end])
        for each, end in zip(known, ends, strict=True)
    ]


def _factor_since(known: KnownClearance, observations: Sequence[MeasuredClearance]) -> tuple[float, float]:
    """Factor times its precision, and the precision, from measurements after a known clearance."""
    if not any(observation.wear_m != known.wear_m for observation in observations):
        return 0.0, 0.0
    opened, wear, sigma = np.array(
        [
            (one.clearance_m - known.clearance_m, one.wear_m - known.wear_m, one.sigma_m)
            for one in observations
        ]
    ).T
    own, new = sigma**-2.0, known.sigma_m**-2.0
    # about their common mean, so that nothing large cancels
    common_wear, common = (float(own @ values) / (float(own.sum()) + new) for values in (wear, opened))
    precision = float(own @ np.square(wear - common_wear)) + new * common_wear**2
    product = float(own @ ((wear - common_wear) * (opened - common))) + new * common_wear * common
    return product, precision


def posterior_grid(prior: CoefficientPrior, mean: float, precision: float) -> tuple[Floats, Floats]:
    """Grid (g,) over the factor's logarithm where its density is, and the logarithm of that, (g,).

    Parameters
    ----------
    prior : CoefficientPrior
    mean, precision : float
        Of the factor, from `measured_factor`.
    """
    # relative to the median of the prior, the factor is normal as well
    median = math.exp(prior.mean)
    grid, density = _centred_grid(prior.sigma, mean / median, precision * median**2)
    return grid + prior.mean, density


def _centred_grid(sigma: float, mean: float, precision: float) -> tuple[Floats, Floats]:
    """Grid and density for a prior with mean 0."""
    low, high = -_WIDTH * sigma, _WIDTH * sigma
    if precision > 0.0:
        own = precision**-0.5
        least = min(own, own**2 / abs(mean)) if mean < 0.0 else own
        low += min(0.0, math.log(least) - _WIDTH)
        high = max(high, math.log(max(mean, 0.0) + _WIDTH * own))
    for _ in range(_ZOOMS):
        grid = np.linspace(low, high, GRID)
        density = -0.5 * np.square(grid / sigma) - 0.5 * precision * np.square(np.exp(grid) - mean)
        near = np.flatnonzero(density > density.max() - _DEEP)
        first, last = max(near[0] - 1, 0), min(near[-1] + 1, GRID - 1)
        if last - first > GRID // 2:
            break
        low, high = grid[first], grid[last]
    return grid, density

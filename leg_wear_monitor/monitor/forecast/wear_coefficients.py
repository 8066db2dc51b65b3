"""Estimate of a joint's wear coefficient, and its Bayes update with measured clearances.

The clearance is c = c_0 + d + x w: c_0 a known clearance, at first the one of a new part, d its error, w the
wear that the twin has modelled since with the nominal coefficient, x the joint's factor on it. The priors
are lognormal for x and normal for d; measured clearances have normal errors. d is eliminated in closed form,
x is on a grid around the estimate: an accepted measurement moves it as far as the data require.
"""

import math
from collections.abc import Iterable, Sequence
from statistics import NormalDist

import attrs
import numpy as np
from numpy.typing import ArrayLike

from leg_wear_monitor.configuration import Doubt
from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.mechanism.materials import USUAL_SPREAD, regime_of, spread_of
from leg_wear_monitor.mechanism.spec import Clearance, Mechanism
from leg_wear_monitor.monitor.config.settings import Forecasting
from leg_wear_monitor.monitor.ledger.entry import JointWear


@attrs.frozen(kw_only=True)
class CoefficientPrior:
    """Normal prior of the logarithm of a joint's factor on its nominal wear coefficient.

    Attributes
    ----------
    sigma, mean : float
        Standard deviation and mean of this logarithm.
    basis : str
        Source of the standard deviation, such as ``spread of steel-on-steel-greased-mild``.
    holds_for : str
        Material pair and regime that the wear coefficient holds for.
    """

    sigma: float
    mean: float = 0.0
    basis: str = ""
    holds_for: str = ""


def nominal_per_pa(clearance: Clearance) -> float:
    """Nominal wear coefficient of bushing and journal together [1/Pa]."""
    return sum(clearance.wear_coefficient)


def coefficient_doubts(counted: Iterable[JointWear], leg: Mechanism) -> tuple[Doubt, ...]:
    """Joints whose wear was modelled with a different wear coefficient than the leg's."""
    found: dict[tuple[float, float], list[str]] = {}
    for part in counted:
        was, now = part.wear_coefficient_per_pa, nominal_per_pa(leg.clearances[part.name])
        if was > 0.0 and was != now and part.mean_m > 0.0:
            found.setdefault((was, now), []).append(part.name)
    return tuple(
        Doubt(
            f"wear coefficient of {'joint' if len(joints) == 1 else 'joints'} {', '.join(joints)}",
            f"{now:.4g} 1/Pa (bushing and journal together), but the wear in the ledger was modelled "
            f"with "
            f"{was:.4g} 1/Pa; that wear stays as modelled, {_further(was, now)}",
        )
        for (was, now), joints in found.items()
    )


def _further(was_per_pa: float, now_per_pa: float) -> str:
    """Message on the future wear if the coefficient differs."""
    if not now_per_pa > 0.0:
        return "and no further wear is modelled"
    return (
        "the model uses the new coefficient from now on, and the forecast keeps a measured one "
        f"(its factor is {was_per_pa / now_per_pa:.3g} times as large)"
    )


def usual_prior(clearance: Clearance | None = None) -> CoefficientPrior:
    """Prior of a joint before any measurement (docs/decisions/0012-wear-prior.md).

    Parameters
    ----------
    clearance : Clearance, optional
        Settings of the joint, whose material pair may give a spread; `USUAL_SPREAD` if it does not.
    """
    regime = regime_of(clearance) if clearance else ""
    of_pair = spread_of(clearance, USUAL_SPREAD) if clearance else None
    if clearance is None or of_pair is None:
        basis = "usual scatter of wear coefficients"
        return CoefficientPrior(sigma=USUAL_SPREAD, basis=basis, holds_for=regime)
    return CoefficientPrior(sigma=of_pair, basis=f"spread of {clearance.material}", holds_for=regime)


@attrs.frozen
class ClearanceAtWear:
    """A clearance that is known at some modelled wear: of a new part, corrected, or measured.

    Attributes
    ----------
    clearance_m, sigma_m : float
        Mean radial clearance and its standard deviation.
    wear_m : float
        Wear in the twin at that time.
    """

    clearance_m: float
    sigma_m: float
    wear_m: float = 0.0


def when_new(settings: Forecasting, fresh_m: float) -> ClearanceAtWear:
    """The clearance of a new part."""
    return ClearanceAtWear(fresh_m, settings.new_clearance_sigma * fresh_m)


GRID = 801
_WIDTH = 8.0  # standard deviations on both sides, of the prior and of the measurements
_DEEP = 25.0  # log density below the highest: the neglected part weighs less than 1e-9
_ZOOMS = 12  # each at least halves the grid's extent

_phi = np.frompyfunc(NormalDist().cdf, 1, 1)


@attrs.frozen(eq=False)
class CoefficientEstimate:
    """Estimate for a joint: weights over its factor's logarithm, and its excess given the factor.

    Attributes
    ----------
    log_factor, weight : (g,) arrays
        Weights sum to 1.
    excess_m : (g,) array
        Mean of d, by which the clearance is wider than `known`, given the factor.
    excess_sigma_m : float
        Its standard deviation.
    observations : int
        Measurements in it.
    prior : CoefficientPrior
        Prior before the measurements.
    known : ClearanceAtWear
        The clearance from which on wear is modelled now; d is the deviation from it.
    """

    log_factor: Floats
    weight: Floats
    excess_m: Floats
    excess_sigma_m: float
    observations: int
    prior: CoefficientPrior
    known: ClearanceAtWear

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

    def clearance_m(self, wear_m: float) -> float:
        """Median of the clearance at some wear in the twin."""
        expected = self._expected_m(wear_m)
        order = np.argsort(expected)
        reached = np.cumsum(self.weight[order]) - 0.5 * self.weight[order]
        return float(np.interp(0.5, reached, expected[order]))

    def clearance_sigma_m(self, wear_m: float) -> float:
        """Standard deviation of the clearance at some wear in the twin."""
        expected = self._expected_m(wear_m)
        variance = float(self.weight @ np.square(expected - self.weight @ expected))
        return math.hypot(math.sqrt(variance), self.excess_sigma_m)

    def probability_below(self, observation: ClearanceAtWear) -> float:
        """Predicted probability of a smaller measurement with this accuracy at this time."""
        spread = math.hypot(observation.sigma_m, self.excess_sigma_m)
        off = (observation.clearance_m - self._expected_m(observation.wear_m)) / spread
        return float(self.weight @ np.asarray(_phi(off), dtype=float))

    def _expected_m(self, wear_m: float) -> Floats:
        """Mean of the clearance at some wear in the twin, given each factor."""
        worn = wear_m - self.known.wear_m
        return self.known.clearance_m + self.excess_m + np.exp(self.log_factor) * worn


def estimate_coefficient(
    known: ClearanceAtWear,
    observations: Sequence[ClearanceAtWear] = (),
    prior: CoefficientPrior | None = None,
) -> CoefficientEstimate:
    """Coefficient estimate after measurements of the same part, in any order.

    Parameters
    ----------
    known : ClearanceAtWear
        The clearance from which on wear is modelled.
    observations : sequence of ClearanceAtWear
    prior : CoefficientPrior, optional
        Without it, the usual spread about the nominal coefficient.
    """
    prior = prior or usual_prior()
    log_factor, log_weight = posterior_grid(prior, *measured_factor(known, observations))
    weight = np.exp(log_weight - log_weight.max())
    precision = 1.0 / known.sigma_m**2 + sum(observation.sigma_m**-2 for observation in observations)
    pull = np.zeros(GRID)
    for observation in observations:
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


def measured_factor(known: ClearanceAtWear, observations: Sequence[ClearanceAtWear]) -> tuple[float, float]:
    """Mean and precision of the factor from the measurements alone; 0 if they have no information.

    The likelihood is normal in the factor, not in its logarithm. The known clearance is eliminated: it
    correlates the errors of the measurements after it.
    """
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
    return product / precision, precision


def posterior_grid(prior: CoefficientPrior, mean: float, precision: float) -> tuple[Floats, Floats]:
    """Grid (g,) over the logarithm of the factor where its density is significant, and the log density (g,).

    Parameters
    ----------
    prior : CoefficientPrior
    mean, precision : float
        Of the factor, from `measured_factor`.
    """
    sigma = prior.sigma
    low, high = prior.mean - _WIDTH * sigma, prior.mean + _WIDTH * sigma
    if precision > 0.0:
        own = precision**-0.5
        # with a mean below 0, positive factors have only the tail, which falls by e over own² / |mean|
        least = min(own, own**2 / abs(mean)) if mean < 0.0 else own
        low += min(0.0, math.log(least) - _WIDTH)
        high = max(high, math.log(max(mean, 0.0) + _WIDTH * own))
    for _ in range(_ZOOMS):
        grid = np.linspace(low, high, GRID)
        off = (grid - prior.mean) / sigma
        density = -0.5 * np.square(off) - 0.5 * precision * np.square(np.exp(grid) - mean)
        near = np.flatnonzero(density > density.max() - _DEEP)
        first, last = max(near[0] - 1, 0), min(near[-1] + 1, GRID - 1)
        if last - first > GRID // 2:
            break
        low, high = grid[first], grid[last]
    return grid, density

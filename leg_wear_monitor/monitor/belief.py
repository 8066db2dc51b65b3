"""What is believed of a joint's wear coefficient, and how a measured clearance changes it (Bayes).

The clearance is c = c_0 + d + x w: c_0 the nominal one when new, d what the part is off it, w the wear that
the twin has counted with the nominal coefficient, x the joint's factor on it. x is lognormal and d normal
beforehand; measured clearances have normal errors. d drops out in closed form, x stays on a grid.
"""

import math
from collections.abc import Sequence
from statistics import NormalDist

import attrs
import numpy as np
from numpy.typing import ArrayLike

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.monitor.forecast_config import Forecasting

GRID = 801
_WIDTH = 5.0  # standard deviations of the prior on both sides

_phi = np.frompyfunc(NormalDist().cdf, 1, 1)


@attrs.frozen
class Look:
    """A measured clearance.

    Attributes
    ----------
    clearance_m, sigma_m : float
        Mean radial clearance and its standard deviation.
    wear_m : float
        Wear w that the twin had counted then.
    """

    clearance_m: float
    sigma_m: float
    wear_m: float


@attrs.frozen(eq=False)
class Belief:
    """What is known of a joint: weights over its factor's logarithm, and its excess given the factor.

    Attributes
    ----------
    log_factor, weight : (g,) arrays
        Weights sum to 1.
    excess_m : (g,) array
        Mean of d given the factor.
    excess_sigma_m : float
        Its standard deviation.
    looks : int
        Measurements in it.
    """

    log_factor: Floats
    weight: Floats
    excess_m: Floats
    excess_sigma_m: float
    looks: int

    @property
    def mean(self) -> float:
        """Mean of the factor's logarithm."""
        return float(self.weight @ self.log_factor)

    @property
    def sigma(self) -> float:
        """Standard deviation of the factor's logarithm."""
        return math.sqrt(float(self.weight @ np.square(self.log_factor - self.mean)))

    def log_factors(self, shares: ArrayLike) -> Floats:
        """Quantiles of the factor's logarithm at shares in (0, 1)."""
        reached = np.cumsum(self.weight) - 0.5 * self.weight
        return np.asarray(np.interp(np.asarray(shares), reached, self.log_factor))

    def probability_below(self, fresh_m: float, look: Look) -> float:
        """Probability that a measurement of such accuracy would have come out smaller than this one did."""
        expected = fresh_m + self.excess_m + np.exp(self.log_factor) * look.wear_m
        spread = math.hypot(look.sigma_m, self.excess_sigma_m)
        below = np.asarray(_phi((look.clearance_m - expected) / spread), dtype=float)
        return float(self.weight @ below)


def believe(settings: Forecasting, fresh_m: float, looks: Sequence[Look] = ()) -> Belief:
    """Belief after measurements of the same part, in any order.

    Parameters
    ----------
    settings : Forecasting
    fresh_m : float
        Nominal clearance when new.
    looks : sequence of Look
    """
    sigma = settings.wear_coefficient_sigma
    log_factor = np.linspace(-_WIDTH * sigma, _WIDTH * sigma, GRID)
    precision = 1.0 / settings.clearance_sigma_m**2 + sum(look.sigma_m**-2 for look in looks)
    log_weight, pull = -0.5 * np.square(log_factor / sigma), np.zeros(GRID)
    for look in looks:
        residual = look.clearance_m - fresh_m - np.exp(log_factor) * look.wear_m
        log_weight -= 0.5 * np.square(residual / look.sigma_m)
        pull += residual / look.sigma_m**2
    log_weight += 0.5 * np.square(pull) / precision
    weight = np.exp(log_weight - log_weight.max())
    return Belief(log_factor, weight / weight.sum(), pull / precision, precision**-0.5, len(looks))

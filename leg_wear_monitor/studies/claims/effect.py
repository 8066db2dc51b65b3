"""Effects: how far a claim is from its limit in one leg, with the standard error of that."""

from typing import NamedTuple

import attrs
import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats
from leg_wear_monitor.studies.plan.keys import Names
from leg_wear_monitor.studies.plan.kinds.legs import SETS
from leg_wear_monitor.studies.point import Arrays

_TINY = 1.0e-300  # in place of a mean of 0, such as of impacts that do not occur


@attrs.frozen
class Effect:
    """The measure of a claim, above 0 where the claim holds.

    Attributes
    ----------
    value : float
        Logarithm of a ratio, or a difference of fractions.
    error : float
        Its standard error, from the scatter over runs.
    """

    value: float
    error: float

    @property
    def score(self) -> float:
        """The value in standard errors."""
        if self.error > 0.0:
            return self.value / self.error
        return float(np.copysign(np.inf, self.value)) if self.value else 0.0


class Measured(NamedTuple):
    """A statistic of a leg: its name in the data, the clearance joints of the runs, and a joint of them."""

    name: str
    where: Names
    joint: str = ""

    def of(self, leg: Arrays) -> Floats:
        """Its value (r,) in every run."""
        values = leg[f"set{SETS.index(self.where)}_{self.name}"]
        return np.asarray(values[:, self.where.index(self.joint)] if self.joint else values, dtype=float)


def log_ratio(x: Floats, y: Floats, paired: bool) -> Effect:
    """Logarithm of mean x over mean y, (r,) each; ``paired`` if they are of the same runs."""
    mean_x, mean_y = max(x.mean(), _TINY), max(y.mean(), _TINY)
    return Effect(float(np.log(mean_x / mean_y)), _error(x / mean_x, y / mean_y, paired))


def difference(x: Floats, y: Floats, paired: bool) -> Effect:
    """Mean x minus mean y."""
    return Effect(float(x.mean() - y.mean()), _error(x, y, paired))


def _error(x: Floats, y: Floats, paired: bool) -> float:
    """Standard error of the difference of the means."""
    variance = np.var(x - y, ddof=1) if paired else np.var(x, ddof=1) + np.var(y, ddof=1)
    return float(np.sqrt(variance / len(x)))


def least(effects: list[Effect]) -> Effect:
    """The effect of a claim with several conditions: that of the condition that holds by least."""
    return min(effects, key=lambda effect: effect.value)


def greatest(effects: list[Effect]) -> Effect:
    """The effect of a claim with alternatives: that of the one that holds by most."""
    return max(effects, key=lambda effect: effect.value)

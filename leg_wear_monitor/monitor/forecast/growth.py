"""Growth of the clearances: measured over gait cycles, and its error."""

import math

import attrs

from leg_wear_monitor.mechanism.arrays import Floats

# Mean growth over gait cycles: single cycles of a chaotic motion scatter.


GROWTH_CYCLES = 30  # over which the reported growth is averaged
LEAST_CYCLES = 10
LARGEST_ERROR = 0.5  # fraction of the mean: beyond it, the mean says nothing

_BATCHES = 5  # batches of six cycles in a window of thirty: longer than the correlation of neighbours
# five means leave four degrees of freedom: Student's t, not a normal distribution. With this factor, a normal
# distribution has the same interval from p10 to p90 as t: 1.533 standard errors, not 1.282
_WIDER = 1.533 / 1.282


@attrs.frozen
class GrowthRate:
    """Mean growth over a window.

    Attributes
    ----------
    per_cycle_m, sampling_m : float
        A gait cycle, and the uncertainty of this mean because single cycles scatter.
    per_second_m : float
        A second of walking.
    """

    per_cycle_m: float
    sampling_m: float
    per_second_m: float

    def error_m(self, model_error: float) -> float:
        """Uncertainty of a gait cycle's growth in this leg: of the mean, and of the model.

        As of a normal distribution: 80 % lie within 1.28 of it either way.

        Parameters
        ----------
        model_error : float
            Standard deviation of the relative growth.
        """
        return math.hypot(self.sampling_m, model_error * self.per_cycle_m)


def growth_rate(growth_m: Floats, moving_s: Floats) -> GrowthRate | None:
    """Mean growth, None while there is not enough data to know it.

    A mean is used and not a median: wear comes in bursts, and means add up. Neighbouring cycles of a chaotic
    motion are correlated, so the scatter is computed from the means of batches.

    Parameters
    ----------
    growth_m : (n,) array
        Growth of the mean clearance in each of the last gait cycles.
    moving_s : (n,) array
        Time in motion of each.
    """
    if len(growth_m) < LEAST_CYCLES:
        return None
    mean, sampling = float(growth_m.mean()), _WIDER * _standard_error(growth_m)
    if not sampling <= LARGEST_ERROR * abs(mean):
        return None
    return GrowthRate(mean, sampling, float(growth_m.sum() / moving_s.sum()))


def _standard_error(values: Floats) -> float:
    size = len(values) // _BATCHES
    means = values[len(values) - _BATCHES * size :].reshape(_BATCHES, size).mean(axis=1)
    return float(means.std(ddof=1) / math.sqrt(_BATCHES))

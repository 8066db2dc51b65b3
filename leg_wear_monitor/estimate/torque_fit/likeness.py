"""How much of a torque repeats and does not fit, and whether a rival fits nearly as well."""

import math

import numpy as np

from leg_wear_monitor.estimate.torque_fit.fit import Fit
from leg_wear_monitor.mechanism.arrays import Floats

_CHUNKS = 12
_WORSE_CHUNKS = 11  # in which a rival has to be worse; of two that are alike, in 3 of 1000 recordings
_LEAST_STEP = 0.02  # of the torque's variance
# The best fit's repeating rest is the model's error; a rival nearer than twice its energy may be the truth
_MODEL_ERROR = 2.0


def repeating(one: Fit) -> float:
    """RMS of the rest that repeats from turn to turn, as a fraction of the measured torque's RMS.

    From the product of the means of even and of odd turns, in which what does not repeat averages out.
    """
    even, odd = (_folded(one, one.blocks.turn % 2 == remainder) for remainder in (0, 1))
    both = np.isfinite(even) & np.isfinite(odd)
    energy = float(np.mean(even[both] * odd[both])) if both.any() else 0.0
    return math.sqrt(max(energy, 0.0)) / float(one.measured.std())


def _folded(one: Fit, which: Floats) -> Floats:
    """Means of the rest over some turns, by part of the turn; NaN where there is none."""
    bins = one.blocks.bin[which]
    number = np.bincount(bins, minlength=int(one.blocks.bin.max()) + 1)
    total = np.bincount(bins, one.rest[which], minlength=len(number))
    return np.where(number > 0, total / np.maximum(number, 1), np.nan)


def too_alike(best: Fit, rival: Fit, other_signal: bool = False) -> bool:
    """Whether a rival is so near to the best that the best need not be the truth.

    With another signal, the model errs in the same way for both; else its error may favour the wrong one.
    """
    steps = _by_time(rival) - _by_time(best)
    error = 0.0 if other_signal else _MODEL_ERROR * repeating(best) ** 2
    is_always_worse = np.count_nonzero(steps > 0.0) >= _WORSE_CHUNKS
    return float(steps.mean()) < max(_LEAST_STEP, error) or not is_always_worse


def _by_time(one: Fit) -> Floats:
    """Energy of the rest in twelve stretches of time, as a fraction of the torque's variance."""
    chunks = np.array_split(one.rest**2, _CHUNKS)
    return np.array([chunk.mean() for chunk in chunks]) / float(one.measured.var())

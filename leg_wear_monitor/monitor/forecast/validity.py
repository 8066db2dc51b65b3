"""How past forecasts did: a measured clearance is later reality, and the ledger says what was expected."""

from collections.abc import Sequence

import attrs
import numpy as np

from leg_wear_monitor.monitor.ledger.entry import Measurement

LEAST = 5  # measurements, below which fractions have no meaning


@attrs.frozen
class Validity:
    """Predicted against measured.

    Attributes
    ----------
    measurements : int
    within : int
        Of them between p10 and p90 of what was expected: 80 % in the long run.
    bias : float
        Mean probability with which less was expected, less one half: above 0, joints wear faster than
        forecast; from -0.5 to 0.5.
    """

    measurements: int
    within: int
    bias: float

    @property
    def words(self) -> str:
        """In a line, for operators."""
        text = f"{self.within} of {self.measurements} measured clearances were between expected p10 and p90"
        if self.measurements < LEAST:
            return f"{text}; too few to evaluate the forecast"
        # a mean of n even numbers from 0 to 1 has a standard deviation of 1 / sqrt(12 n)
        if abs(self.bias) * np.sqrt(12.0 * self.measurements) < 2.0:
            return f"{text}; no bias found"
        return f"{text}; joints wear {'faster' if self.bias > 0.0 else 'slower'} than forecast"


def validity(measurements: Sequence[Measurement]) -> Validity:
    """What measurements say of the forecasts before each of them; contradictions too, not withdrawn ones."""
    below = np.array([m.expected_below for m in measurements if not m.is_withdrawn])
    within = int(np.count_nonzero((below >= 0.1) & (below <= 0.9)))
    return Validity(len(below), within, float(below.mean() - 0.5) if len(below) else 0.0)

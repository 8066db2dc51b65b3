"""What of the torque's residual repeats over gait cycles, without the scatter of instants."""

import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats

CYCLES = 8  # fewer scatter more, more tell later
_LEAST_PHASES = 8


class RepeatingResidual:
    """The residual by the crank's phase, over the last gait cycles.

    Attributes
    ----------
    cycles : tuple of (5, PHASES) arrays
        Of each gait cycle, the newest last, as in `TORQUE_SUMS`.
    """

    def __init__(self) -> None:
        self.cycles: tuple[Floats, ...] = ()

    def take(self, by_phase: Floats) -> None:
        """Take in a whole gait cycle."""
        self.cycles = (*self.cycles[1 - CYCLES :], by_phase.copy())

    @property
    def rms_nm(self) -> float:
        """RMS of what repeats and neither load, friction nor lag explain; NaN before there are enough cycles.

        The mean over cycles has a standard error from their scatter, whose square is taken off: what scatters
        alone has an expected value of 0.
        """
        if len(self.cycles) < CYCLES:
            return float("nan")
        sums = np.stack(self.cycles)
        sums = sums[:, :, (sums[:, 0] > 0.0).all(axis=0)]
        if sums.shape[2] < _LEAST_PHASES:
            return float("nan")
        weight = sums[:, 0]
        total = sums.sum(axis=0)
        mean, columns = total[1] / total[0], (total[2:] / total[0]).T
        # a column that is nothing (no toe, no speed) takes no part
        columns = columns[:, np.abs(columns).max(axis=0) > 0.0]
        size = np.linalg.norm(columns, axis=0)
        explained = columns @ (np.linalg.lstsq(columns / size, mean, rcond=None)[0] / size)
        fraction = weight / total[0]
        scatter = (fraction**2 * (sums[:, 1] / weight - mean) ** 2).sum(axis=0) * CYCLES / (CYCLES - 1)
        square = ((mean - explained) ** 2).mean() - scatter.mean()
        return float(np.sqrt(max(square, 0.0)))

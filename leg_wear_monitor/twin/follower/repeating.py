"""The part of the torque residual that repeats over gait cycles, without the scatter of instants."""

import numpy as np

from leg_wear_monitor.mechanism.arrays import Floats

CYCLES = 8  # averaged gait cycles: fewer have more scatter, more have a longer delay
_LEAST_PHASES = 8


class RepeatingResidual:
    """The torque residual by crank phase over the last gait cycles.

    Attributes
    ----------
    cycles : tuple of (5, PHASES) arrays
        ``by_phase`` of `TORQUE_SUMS` for each gait cycle, the newest last.
    """

    def __init__(self) -> None:
        self.cycles: tuple[Floats, ...] = ()

    def take(self, by_phase: Floats) -> None:
        """Add the sums (5, PHASES) of a complete gait cycle."""
        self.cycles = (*self.cycles[1 - CYCLES :], by_phase.copy())

    @property
    def rms_nm(self) -> float:
        """RMS [N m] of the repeating residual without load, friction and lag; NaN without enough cycles.

        The squared standard error of the mean over cycles is subtracted, so that pure scatter gives 0 on
        average.
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
        # leave out columns of zeros (no toe, no speed)
        columns = columns[:, np.abs(columns).max(axis=0) > 0.0]
        size = np.linalg.norm(columns, axis=0)
        explained = columns @ (np.linalg.lstsq(columns / size, mean, rcond=None)[0] / size)
        fraction = weight / total[0]
        scatter = (fraction**2 * (sums[:, 1] / weight - mean) ** 2).sum(axis=0) * CYCLES / (CYCLES - 1)
        square = ((mean - explained) ** 2).mean() - scatter.mean()
        return float(np.sqrt(max(square, 0.0)))
